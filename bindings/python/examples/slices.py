"""The picture of the README: three slices of the field of a fish. `python slices.py [PICTURE]`, from the repository."""

import pathlib
import sys
import tempfile

import matplotlib

matplotlib.use("Agg")

import isograd
import isograd.viz


def main(picture):
    root = pathlib.Path(__file__).parents[3]
    cloud = isograd.read_points(root / "examples/clouds/fish.ply")
    result = isograd.reconstruct(cloud.points, isograd.Grid.fit(cloud.points, 96))
    figure = isograd.viz.slices(result.sdf, result.grid, limit=0.1)
    figure.savefig(picture, dpi=150, bbox_inches="tight")
    assert picture.stat().st_size > 10_000


if __name__ == "__main__":
    if len(sys.argv) > 1:
        main(pathlib.Path(sys.argv[1]))
    else:
        with tempfile.TemporaryDirectory() as folder:
            main(pathlib.Path(folder) / "slices.png")
