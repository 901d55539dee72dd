"""Signed distance fields of many clouds with Dask, one thread for each process; it may be stopped and started again.

    python dataset_dask.py [FOLDER] [--clouds 200] [--resolution 64] [--points 4000] [--workers N]
"""

import argparse
import os
import tempfile
from pathlib import Path

# The processes inherit it: one thread each is the fastest for many small clouds.
os.environ.setdefault("RAYON_NUM_THREADS", "1")

import dask.bag
import distributed
import numpy as np

import isograd

SHAPES = {"sphere": ("radius", 0.6, 1.2), "torus": ("minor", 0.2, 0.4), "ellipsoid": ("a", 0.8, 1.6)}


def cloud(number, points):
    """Cloud `number` of the data set; here a test shape, usually a file."""
    name = sorted(SHAPES)[number % len(SHAPES)]
    parameter, low, high = SHAPES[name]
    value = np.random.default_rng(number).uniform(low, high)
    return isograd.sample(name, points, seed=number + 1, **{parameter: value}).points.astype(np.float32)


def process(number, folder, points, resolution):
    """Writes the field of a cloud and returns a few numbers of it: only these travel to the main process."""
    out = Path(folder) / f"{number:06}.npz"
    row = isograd.to_file(cloud(number, points), out, resolution=resolution)
    with np.load(out) as field:
        sdf = field["sdf"]
        volume = float((sdf < 0).sum() * field["spacing"] ** 3)
    return {"number": number, "verdict": row["verdict"], "skipped": row["skipped"], "volume": volume}


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("folder", nargs="?", help="a new temporary folder by default")
    parser.add_argument("--clouds", type=int, default=200)
    parser.add_argument("--points", type=int, default=4000)
    parser.add_argument("--resolution", type=int, default=64)
    parser.add_argument("--workers", type=int, default=os.cpu_count())
    options = parser.parse_args()
    folder = Path(options.folder or tempfile.mkdtemp()).resolve()
    folder.mkdir(parents=True, exist_ok=True)
    cluster = distributed.LocalCluster(
        n_workers=options.workers,
        threads_per_worker=1,
        dashboard_address=None,  # pyright: ignore[reportArgumentType]
    )
    with cluster, distributed.Client(cluster):
        parts = min(options.clouds, 16 * options.workers)
        numbers = dask.bag.from_sequence(range(options.clouds), npartitions=parts)
        rows = numbers.map(process, str(folder), options.points, options.resolution).compute()
    good = sum(row["verdict"] == "good" for row in rows)
    skipped = sum(row["skipped"] for row in rows)
    volume = np.mean([row["volume"] for row in rows])
    print(f"{len(rows)} clouds in {folder}: {good} good, {skipped} were there, mean volume {volume:.4f}")
    assert len(rows) == options.clouds and all(row["volume"] > 0 for row in rows)


if __name__ == "__main__":
    main()
