"""Clouds per core-hour at 64³, with estimated and with given normals: `cargo xtask datasets`.

Each cloud is one process of one thread, reading and writing included. The ways take turns, cloud by cloud, so that other
load affects both; CPU seconds are counted."""

import argparse
import json
import os
import subprocess
import tempfile
from pathlib import Path

import report

SHAPES = ["sphere", "ellipsoid", "torus", "knot", "box", "fish"]
SAMPLES = [2_500, 10_000, 40_000]
WAYS = {"estimated": [], "given": ["--orient", "given"]}
CELLS = 64


def main() -> None:
    options = arguments()
    rows = []
    with tempfile.TemporaryDirectory() as folder:
        cloud, out = Path(folder) / "cloud.npz", Path(folder) / "sdf.npz"
        for samples in SAMPLES:
            seconds = {way: [] for way in WAYS}
            for seed in range(1, options.seeds + 1):
                for shape in SHAPES:
                    run(options.program, "sample", shape, "-n", samples, "--seed", seed, "-o", cloud)
                    for way, choice in WAYS.items():
                        size = ["--resolution", CELLS, "--threads", 1, "--sdf", out]
                        seconds[way].append(run(options.program, "reconstruct", cloud, *size, *choice))
            rows.append({"samples": samples, "seconds": seconds})
            print(samples, {way: f"{sum(all_) / len(all_):.4f} s" for way, all_ in seconds.items()}, flush=True)
    data = {"machine": report.machine(), "cells": CELLS, "shapes": SHAPES, "seeds": options.seeds, "rows": rows}
    options.json.write_text(json.dumps(data, indent=1) + "\n")
    print(f"wrote {options.json}")


def run(program: Path, *command: object) -> float:
    """CPU seconds of a command."""
    process = subprocess.Popen([str(program), *map(str, command), "-q"], stderr=subprocess.DEVNULL)
    _, status, usage = os.wait4(process.pid, 0)
    if status != 0:
        raise SystemExit(f"{' '.join(map(str, command))} failed")
    return usage.ru_utime + usage.ru_stime


def arguments() -> argparse.Namespace:
    root = Path(__file__).resolve().parents[2]
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--program", type=Path, required=True, help="the program isograd, built for release")
    parser.add_argument("--json", type=Path, default=root / "docs" / "datasets.json", help="results")
    parser.add_argument("--seeds", type=int, default=4, help="clouds of each shape and number of samples")
    return parser.parse_args()


if __name__ == "__main__":
    main()
