"""Fits through NumPy arrays."""

import numpy as np
import pytest

import isograd

SPHERE = isograd.sample("sphere", 2000, radius=0.5)
GRID = isograd.Grid.fit(SPHERE.points, 24, padding=0.3)
START = isograd.Shape("sphere", radius=0.4)


def test_the_radius_of_a_sphere_is_found_from_a_cloud_a_mesh_and_a_field():
    result = isograd.reconstruct(SPHERE.points, GRID)
    for target in (SPHERE.points, result.mesh, result.sdf, result.sdf.astype(np.float32)):
        fit = isograd.fit(target, GRID, shape=START, samples=2000, tolerance=0.02)
        assert fit.outcome == "met", fit.history[-1]
        # 16 cells across.
        assert abs(fit.shape.values["radius"] / 0.5 - 1) < 5e-3
        assert fit.history[0]["loss"] > 10 * fit.history[-1]["loss"]
        assert fit.sdf.shape == GRID.shape and fit.points.shape == (2000, 3)


def test_the_points_of_an_ellipsoid_become_a_sphere_and_a_callback_stops():
    start = isograd.sample("ellipsoid", 900, a=0.45, b=0.5, c=0.56).points
    fit = isograd.fit(SPHERE.points, GRID, points=start, tolerance=0.05, epochs=60)
    assert fit.shape is None and fit.history[-1]["mean_error"] < 0.06 < fit.history[0]["mean_error"]
    seen = []

    def callback(epoch):
        seen.append(epoch["epoch"])
        return len(seen) < 2

    fit = isograd.fit(SPHERE.points, GRID, points=start, callback=callback)
    assert fit.outcome == "stopped" and seen == [1, 2]


def test_what_a_callback_raises_is_raised_and_bad_input_is_refused():
    def callback(epoch):
        raise LookupError(epoch["epoch"])

    with pytest.raises(LookupError, match="1"):
        isograd.fit(SPHERE.points, GRID, shape=START, samples=500, callback=callback)
    for error, text, arguments in [
        (ValueError, "not both", {}),
        (ValueError, "not both", {"shape": START, "points": SPHERE.points}),
        (TypeError, "Shape", {"shape": "sphere"}),
        (ValueError, "lbfgs", {"shape": START, "optimizer": "newton"}),
        (ValueError, "color", {"shape": START, "only": ["color"]}),
        (ValueError, "random_start is for a shape", {"points": SPHERE.points, "random_start": 0.5}),
        (TypeError, "options is a dict", {"shape": START, "options": {}}),
        (ValueError, "epochs", {"shape": START, "epochs": -1}),
        (ValueError, "larger grid|padding", {"shape": isograd.Shape("sphere", radius=3.0)}),
    ]:
        with pytest.raises(error, match=text):
            isograd.fit(SPHERE.points, GRID, **arguments)
    with pytest.raises(ValueError, match="must have"):
        isograd.fit(np.zeros((3, 3, 3)), GRID, shape=START)
