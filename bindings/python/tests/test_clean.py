"""Cleaning, against all pairs of points."""

import numpy as np
import pytest

import isograd


def cloud(seed, dtype=np.float64):
    """Lattice points with duplicates, and scattered ones."""
    rng = np.random.default_rng(seed)
    lattice = rng.integers(0, 5, (150, 3)) * 0.25
    return np.vstack([lattice, rng.random((80, 3)), 5 * rng.random((5, 3)) + 1]).astype(dtype)


def distances(points):
    return np.linalg.norm(points[:, None] - points[None], axis=-1)


STEPS = [
    {"duplicates": True},
    {"duplicates": 0.05},
    {"statistical": (6, 1.0)},
    {"radius": (0.25, 3)},
    {"voxel": 0.3},
    {"poisson_disk": 0.25},
    {"duplicates": 0, "statistical": (4, 2), "radius": (0.4, 2), "voxel": 0.1, "poisson_disk": 0.15},
]


@pytest.mark.parametrize("steps", STEPS)
def test_order_of_the_points_does_not_matter(steps):
    points = cloud(1)
    order = np.random.default_rng(2).permutation(len(points))
    first, second = isograd.clean(points, **steps), isograd.clean(points[order], **steps)
    for result in (first, second):
        assert (np.diff(result.indices.astype(int)) > 0).all()
        assert sum(result.removed.values()) == len(points) - len(result.indices) > 0
    assert (first.points == points[first.indices]).all()
    assert set(map(tuple, first.points)) == set(map(tuple, second.points))


@pytest.mark.parametrize("dtype", [np.float32, np.float64])
def test_kept_samples_are_those_of_all_pairs_tried(dtype):
    points = cloud(3, dtype)
    far = distances(points.astype(float))
    unique = isograd.clean(points, duplicates=True)
    assert len(unique.points) == len(np.unique(points, axis=0)) and unique.points.dtype == dtype

    thin = isograd.clean(points, poisson_disk=0.25).indices
    near = far[:, thin] <= 0.25
    assert near.any(axis=1).all() and (near[thin].sum(axis=1) == 1).all()

    kept = isograd.clean(points, radius=(0.25, 4)).indices
    assert (kept == np.flatnonzero((far <= 0.25).sum(axis=1) - 1 >= 4)).all()

    mean = np.sort(far, axis=1)[:, 1:7].mean(axis=1)
    limit = mean.mean() + 1.5 * mean.std(ddof=1)
    kept = isograd.clean(points, statistical=(6, 1.5)).indices
    assert (kept == np.flatnonzero(mean <= limit)).all()

    voxels = np.floor(points.astype(float) / 0.3).astype(int)
    kept = isograd.clean(points, voxel=0.3).indices
    assert len(np.unique(voxels[kept], axis=0)) == len(kept) == len(np.unique(voxels, axis=0))


def test_normals_and_attributes_go_along():
    points = cloud(4)
    attributes = {"speed": points[:, 0], "pair": points[:, :2].astype(np.float32)}
    result = isograd.clean(points, normals=2 * points, attributes=attributes, voxel=0.3)
    assert (result.normals == 2 * result.points).all()
    assert (result.attributes["speed"] == result.points[:, 0]).all()
    assert result.attributes["pair"].shape == (len(result.indices), 2)
    whole = isograd.Cloud(points, 2 * points, attributes)
    again = isograd.clean(whole, voxel=0.3)
    assert (again.indices == result.indices).all() and (again.normals == result.normals).all()
    assert set(again.attributes) == {"speed", "pair"}


def test_points_that_are_not_finite_are_dropped_only_on_request():
    points = cloud(5)
    points[7, 1] = np.nan
    with pytest.raises(ValueError, match="point 7 is not finite"):
        isograd.clean(points, voxel=0.3)
    result = isograd.clean(points, drop_not_finite=True)
    assert result.removed == {"drop_not_finite": 1} and 7 not in result.indices
    assert len(result.points) == len(points) - 1
    assert len(isograd.clean(np.zeros((0, 3)), voxel=1.0, statistical=(3, 1)).indices) == 0


@pytest.mark.parametrize(
    ("steps", "text"),
    [
        ({"duplicates": -1}, "0 or a positive"),
        ({"statistical": (0, 1.0)}, "at least 1"),
        ({"statistical": (3, np.nan)}, "ratio"),
        ({"statistical": 3}, r"\(neighbors, ratio\)"),
        ({"statistical": (2.5, 1)}, "whole number"),
        ({"radius": (0.0, 1)}, "radius"),
        ({"radius": (0.1, -1)}, "0 or more"),
        ({"voxel": np.inf}, "voxels"),
        ({"voxel": 1e-30}, "larger voxels"),
        ({"poisson_disk": 0}, "distance between samples"),
        ({"voxel": "wide"}, "number"),
    ],
)
def test_bad_numbers_are_refused_with_a_reason(steps, text):
    with pytest.raises(ValueError, match=text):
        isograd.clean(cloud(6), **steps)


def test_normals_that_are_not_finite_matter_only_where_they_are_used(tmp_path):
    path = tmp_path / "cloud.csv"
    points = np.random.default_rng(6).normal(size=(400, 3))
    points /= np.linalg.norm(points, axis=1, keepdims=True)
    normals = 2 * points
    normals[3, 0] = np.inf
    rows = "\n".join(",".join(map(repr, row)) for row in np.hstack([points, normals]).tolist())
    path.write_text("x,y,z,nx,ny,nz\n" + rows)
    assert (isograd.orient(path).normals == isograd.orient(points).normals).all()
    with pytest.raises(ValueError, match="normal of point 3 is not finite"):
        isograd.orient(path, orient="signs")
    with pytest.raises(ValueError, match="line 5.*drop_not_finite"):
        isograd.read_points(path)
    read = isograd.read_points(path, drop_not_finite=True)
    assert (read.points == np.delete(points, 3, axis=0)).all()
    cleaned = isograd.clean(points, normals=normals, drop_not_finite=True)
    assert cleaned.removed == {"drop_not_finite": 1} and np.isfinite(cleaned.normals).all()
    assert (cleaned.points == read.points).all()
