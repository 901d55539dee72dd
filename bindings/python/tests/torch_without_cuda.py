"""Installs PyTorch without the packages of CUDA into the Python that runs this file. For test rigs only.

On Linux the wheel of torch on PyPI is linked against CUDA, whose packages make up most of the 3 GB that
`pip install torch` takes. Nothing of them runs in a test on the CPU, but the loader wants to find every library
and every symbol. So this takes the real torch alone, and compiles for each library that is missing a stand-in
whose functions do nothing but return cudaErrorInsufficientDriver. To torch, that is a machine without a GPU.

Needs gcc, readelf and nm. Exit status 0: `import torch` works. Else the last line says why it doesn't, and torch is
taken away again.
"""

from __future__ import annotations

import re
import shutil
import subprocess
import sys
import sysconfig
import tempfile
from collections import defaultdict
from collections.abc import Iterable
from pathlib import Path

HERE = Path(__file__).parent
TORCH = Path(sysconfig.get_path("purelib")) / "torch"
PIP = [sys.executable, "-m", "pip"]

# Libraries of CUDA. Not libcuda itself, the driver: torch opens it by name only where there is one.
CUDA_LIBRARY = re.compile(r"lib(cu(?!da\.)|nccl|nvrtc|nvshmem_host)")
# Symbols of CUDA, for those that carry no version to tell their library by.
CUDA_SYMBOL = re.compile(r"(__cuda|cu|nv|nccl)")
INSUFFICIENT_DRIVER = 35

# A symbol and its version; the version is "" where it has none.
Symbol = tuple[str, str]


def main() -> int:
    try:
        install()
        if sys.platform == "linux":
            add_stand_ins(TORCH / "lib")
        output("import torch", sys.executable, "-c", "import torch; torch.ones(2).sum()")
    except (OSError, RuntimeError) as error:
        # With a torch that can't be imported tests would fail, not be skipped. pip leaves the stand-ins behind.
        subprocess.run([*PIP, "uninstall", "--quiet", "--yes", "torch"], check=False)
        shutil.rmtree(TORCH, ignore_errors=True)
        print(error)
        return 1
    return 0


def install() -> None:
    requirements = str(HERE / "requirements-torch.txt")
    # Not kept in pip's cache: half a gigabyte that is asked for once.
    options = ["--quiet", "--no-cache-dir", "--no-deps", "--disable-pip-version-check"]
    output("pip", *PIP, "install", *options, "--requirement", requirements)


def add_stand_ins(folder: Path) -> None:
    """Writes a stand-in into `folder` for every library of CUDA that the libraries there need."""
    libraries = [path for path in sorted(folder.glob("*.so*")) if not path.is_symlink()]
    versions: dict[str, set[str]] = defaultdict(set)
    missing: set[str] = set()
    for library in libraries:
        missing |= {name for name in needed_libraries(library) if CUDA_LIBRARY.match(name)}
        for name, version in needed_versions(library):
            versions[name].add(version)
    missing -= {library.name for library in libraries}
    symbols = undefined_symbols(libraries)
    # Symbols without a version are looked up in every library in turn: any may have them, so all do.
    plain = {name for name, version in symbols if not version and CUDA_SYMBOL.match(name)}
    for library in sorted(missing):
        blocks = {version: set[str]() for version in versions[library]}
        for name, version in symbols:
            if version in blocks:
                blocks[version].add(name)
        compile_stand_in(folder / library, plain, blocks)
    print(f"{len(missing)} stand-ins for libraries of CUDA")


def needed_libraries(library: Path) -> list[str]:
    dynamic = output("readelf", "readelf", "-d", "-W", str(library))
    return re.findall(r"NEEDED.*\[(.*?)\]", dynamic)


def needed_versions(library: Path) -> Iterable[tuple[str, str]]:
    """Names of libraries, each with a version of symbols that is wanted from it."""
    name = ""
    for line in output("readelf", "readelf", "-V", "-W", str(library)).splitlines():
        if found := re.search(r"File: (\S+)", line):
            name = found.group(1)
        elif found := re.search(r"Name: (\S+)\s+Flags", line):
            yield name, found.group(1)


def undefined_symbols(libraries: list[Path]) -> set[Symbol]:
    """What these libraries use and none of them has."""
    wanted: set[Symbol] = set()
    defined: set[str] = set()
    for library in libraries:
        for name, version in dynamic_symbols(library, "--undefined-only"):
            wanted.add((name, version))
        defined |= {name for name, _ in dynamic_symbols(library, "--defined-only")}
    return {(name, version) for name, version in wanted if version or name not in defined}


def dynamic_symbols(library: Path, which: str) -> Iterable[Symbol]:
    for line in output("nm", "nm", "-D", which, str(library)).splitlines():
        name, _, version = line.split()[-1].partition("@")
        yield name, version.lstrip("@")


def compile_stand_in(path: Path, plain: set[str], blocks: dict[str, set[str]]) -> None:
    """Compiles a library with these functions; `blocks` are its versions with the symbols of each."""
    with tempfile.TemporaryDirectory() as temporary:
        source, script = Path(temporary) / "stub.c", Path(temporary) / "versions.map"
        versioned = set[str]().union(*blocks.values())
        source.write_text("".join(function(name) for name in sorted(plain | versioned)))
        command = ["gcc", "-shared", "-fPIC", "-O1", "-w", f"-Wl,-soname,{path.name}"]
        if blocks:
            text = "".join(version_block(version, blocks[version]) for version in sorted(blocks))
            script.write_text(text)
            command.append(f"-Wl,--version-script={script}")
        output("gcc", *command, "-o", str(path), str(source))


def function(name: str) -> str:
    # Those that register kernels as torch is loaded give handles, which are read: they must point somewhere.
    if name.startswith("__cuda"):
        return f"void *{name}(void) {{ static char handle[64]; return handle; }}\n"
    return f"int {name}(void) {{ return {INSUFFICIENT_DRIVER}; }}\n"


def version_block(version: str, names: set[str]) -> str:
    listed = " ".join(f"{name};" for name in sorted(names))
    return f"{version} {{ {'global: ' + listed if names else ''} }};\n"


def output(what: str, *command: str) -> str:
    """What a command prints.

    Raises:
        OSError: where it is not there.
        RuntimeError: where it fails, with the last line that it wrote.
    """
    try:
        done = subprocess.run(command, capture_output=True, text=True, check=False)
    except FileNotFoundError:
        raise OSError(f"{command[0]} is not there") from None
    if done.returncode != 0:
        lines = (done.stderr.strip() or done.stdout.strip()).splitlines()
        raise RuntimeError(f"{what} failed: {lines[-1] if lines else done.returncode}")
    return done.stdout


if __name__ == "__main__":
    sys.exit(main())
