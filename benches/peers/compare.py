"""Times isograd and other libraries in one run: `cargo xtask peers`."""

import argparse
import os
import tempfile
from contextlib import ExitStack
from pathlib import Path

import numpy as np
import warp as wp

import distance
import isosurface
import normals
import orientation
import poisson
import report
import shape_as_points
import whole

ROOT = Path(__file__).resolve().parents[2]


def main() -> None:
    options = arguments()
    os.environ["IGL_NUM_THREADS"] = str(options.threads)
    wp.config.quiet = True
    wp.init()
    cases = []
    with tempfile.TemporaryDirectory() as folder:
        for name, builders in jobs(options).items():
            if options.only and name not in options.only:
                continue
            for build in builders:
                # The processes of one case end before the next begins.
                with ExitStack() as stack:
                    case = build(stack, options.stage_times, Path(folder))
                    if case is None:
                        continue
                    case.measure(options.repeats)
                show(case)
                cases.append(case)
    report.write(cases, options.repeats, options.json)
    print(f"wrote {options.json}")


def jobs(options) -> dict:
    """All comparisons by name, as functions that set them up."""
    cells, count = (64, 10_000) if options.quick else (128, 50_000)
    shapes = [(cells,) * 3, (2 * cells, cells, cells)]
    threads = options.threads

    def job(make, *settings):
        return lambda *place: make(*place, *settings, threads)

    return {
        "poisson": [
            job(poisson.case, shape, dtype)
            for shape in shapes
            for dtype in (np.float32, np.float64)
        ],
        "indicator": [job(shape_as_points.case, count, cells)],
        "normals": [job(normals.case, n) for n in (count, 10 * count)],
        "orientation": [job(orientation.case, count)],
        "isosurface": [job(isosurface.case, n) for n in (cells, 2 * cells)],
        "distance": [job(distance.case, cells), job(distance.band, cells)],
        "whole": [job(whole.case, count, cells)],
    }


def show(case) -> None:
    print(case.title)
    for entry in case.entries:
        print(f"  {entry.name}, {entry.dtype}, {entry.threads} threads: {entry.median:.4g} s")
    print(*(f"  {check}" for check in case.checks), sep="\n", flush=True)


def arguments() -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--stage-times", type=Path, required=True, help="the program of isograd")
    parser.add_argument("--json", type=Path, help="results; default: docs/peers.json after a complete run")
    parser.add_argument("--repeats", type=int, default=None, help="timed runs (5; quick: 2)")
    parser.add_argument("--threads", type=int, default=2)
    parser.add_argument("--quick", action="store_true", help="small sizes, few runs")
    parser.add_argument("--only", nargs="*", help="names of comparisons")
    options = parser.parse_args()
    options.repeats = options.repeats or (2 if options.quick else 5)
    partial = options.quick or options.only
    options.json = options.json or ROOT / ("out/peers.json" if partial else "docs/peers.json")
    return options


if __name__ == "__main__":
    main()
