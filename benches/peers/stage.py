"""The timing program of isograd, or of another library, as a process that stays alive between runs."""

import json
import subprocess
from pathlib import Path

import numpy as np

from case import Entry

SUFFIX = {np.dtype(np.float32): "f32", np.dtype(np.float64): "f64"}


def write_input(folder: Path, settings: dict, **arrays: np.ndarray) -> None:
    """Writes settings.json and each array as raw little-endian numbers."""
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "settings.json").write_text(json.dumps(settings))
    for name, array in arrays.items():
        np.ascontiguousarray(array).tofile(folder / f"{name}.{SUFFIX[array.dtype]}")


def stages(stack, program: Path, name: str, folder: Path, threads: int, dtype=np.float32) -> list["Stage"]:
    """A stage of isograd with one thread and with `threads`."""
    counts = sorted({1, threads})
    return [stack.enter_context(Stage(program, name, folder, dtype, count)) for count in counts]


class Stage:
    """`stage-times STAGE FOLDER TYPE THREADS`: each `run()` is one forward pass."""

    def __init__(self, program: Path | list, name: str, folder: Path, dtype, threads: int):
        self.folder, self.dtype, self.threads = folder, np.dtype(dtype), threads
        program = program if isinstance(program, list) else [program]
        command = [*program, name, folder, SUFFIX[self.dtype], threads]
        self.process = subprocess.Popen(
            [str(part) for part in command],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            text=True,
        )
        self._answer("ready")

    def run(self) -> float:
        """Seconds of one forward pass."""
        return float(self._ask("run"))

    def entry(self, output: str, name: str = "isograd") -> Entry:
        """An entry of a comparison, whose result is the array `output`."""
        return Entry(name, str(self.dtype), self.threads, self.run, lambda: self.result(output))

    def result(self, name: str, dtype=None) -> np.ndarray:
        """An output of the last run, as a flat array."""
        self._ask("save")
        dtype = np.dtype(dtype or self.dtype)
        suffix = SUFFIX.get(dtype, "u32")
        return np.fromfile(self.folder / f"{name}.{suffix}", dtype)

    def close(self) -> None:
        self.process.stdin.close()
        self.process.wait()

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.close()

    def _ask(self, request: str) -> str:
        self.process.stdin.write(request + "\n")
        self.process.stdin.flush()
        return self._answer(request)

    def _answer(self, request: str) -> str:
        line = self.process.stdout.readline()
        if not line:
            raise RuntimeError(f"stage-times ended at '{request}', exit {self.process.wait()}")
        return line.strip()
