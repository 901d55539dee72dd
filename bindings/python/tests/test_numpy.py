"""The NumPy interface: results, gradients, errors."""

import dataclasses
import os
import pathlib
import signal
import subprocess
import sys
import threading
import time

import numpy as np
import pure
import pytest

import isograd
from isograd import _core, _settings

TYPES = [np.float32, np.float64]
SPHERE = isograd.sample("sphere", 3000, radius=1.0).points
GRID = isograd.Grid.fit(SPHERE, 32)


def bits(array):
    return np.ascontiguousarray(array).tobytes()


@pytest.mark.parametrize("dtype", TYPES)
def test_the_field_of_a_sphere_is_its_distance(dtype):
    result = isograd.reconstruct(SPHERE.astype(dtype), GRID)
    exact = np.linalg.norm(GRID.centers(), axis=-1) - 1
    assert result.sdf.dtype == dtype and result.sdf.shape == GRID.shape
    # 27 cells across: the error of the reconstruction.
    assert np.abs(result.sdf - exact).max() < 0.1 * GRID.spacing
    outward = np.einsum("ij,ij->i", result.normals, SPHERE)
    assert result.normals.dtype == dtype and outward.min() > 0.98
    mesh = result.mesh
    assert mesh.vertices.dtype == dtype and mesh.faces.dtype == np.uint32
    a, b, c = (mesh.vertices[mesh.faces[:, k]].astype(float) for k in range(3))
    volume = np.einsum("ij,ij->i", a, np.cross(b, c)).sum() / 6
    assert abs(volume / (4 / 3 * np.pi) - 1) < 0.01
    assert result.report["surface"]["closed"] and result.report["orientation"]["method"] == "auto"
    assert abs(result.report["surface"]["volume"] / volume - 1) < 1e-5
    assert result.warnings == [] and result.confidence.shape == (3000,)


@pytest.mark.parametrize("dtype", TYPES)
def test_a_growing_sphere_lowers_the_field_everywhere(dtype):
    points = SPHERE.astype(dtype)
    result = isograd.reconstruct(points, GRID)
    mean = np.full(GRID.shape, 1 / result.sdf.size, dtype)
    gradient = result.pullback(mean)
    assert gradient.points.dtype == dtype and gradient.points.shape == points.shape
    assert gradient.normals is None and gradient.guarded == 0
    assert abs((gradient.points * points).sum() + 1) < 0.01


def test_gradients_are_central_differences():
    points = isograd.sample("torus", 2500).points
    grid = isograd.Grid.fit(points, 28, padding=0.2)
    plan = isograd.Reconstructor(grid, checks=False)
    base = plan(points)
    # Near the surface alone: on the medial axis φ has no derivative.
    weights = np.cos(5 * grid.centers()).sum(axis=-1) * np.exp(-((base.sdf / grid.spacing) ** 2))
    direction = np.sin(3 * points[:, [1, 2, 0]])
    slope = (base.pullback(weights).points * direction).sum()
    h = 1e-6 * grid.spacing
    sides = [plan(points + s * direction) for s in (h, -h)]
    # No neighborhood, sign or cell changes over so small a step.
    assert np.array_equal(sides[0].neighbors, sides[1].neighbors)
    difference = (weights * (sides[0].sdf - sides[1].sdf)).sum() / (2 * h)
    assert abs(slope / difference - 1) < 1e-5


def test_every_cotangent_counts_and_they_add_up():
    rng = np.random.default_rng(2)
    cloud = isograd.sample("torus", 2000)
    grid = isograd.Grid.fit(cloud.points, 24, padding=0.2)
    result = isograd.reconstruct(
        cloud.points, grid, normals=cloud.normals, attributes={"a": cloud.points}, orient="given"
    )
    extension = result.extend("a", 3 * grid.spacing)
    bars = {
        "sdf": rng.normal(size=grid.shape),
        "indicator": rng.normal(size=result.surface_grid.shape),
        "vertices": rng.normal(size=result.mesh.vertices.shape),
        "normals": rng.normal(size=cloud.normals.shape),
        "areas": rng.normal(size=len(cloud.points)),
        "iso_value": 0.7,
        "extensions": [(extension, None, rng.normal(size=extension.values.shape))],
    }
    every = result.pullback(**bars)
    parts = [result.pullback(**{name: bar}) for name, bar in bars.items()]
    assert all(np.abs(part.points).max() > 0 for part in parts if part is not parts[3])
    assert np.abs(parts[3].normals).max() > 0
    for of in (lambda g: g.points, lambda g: g.normals, lambda g: np.array(g.lower)):
        whole, total = of(every), sum(of(part) for part in parts)
        assert np.abs(whole - total).max() < 1e-9 * np.abs(whole).max()
    assert every.attributes["a"].shape == cloud.points.shape


def test_the_surface_may_be_finer_than_the_field():
    coarse, fine = (
        isograd.reconstruct(SPHERE, GRID, surface=surface, checks=False) for surface in ("grid", "2x")
    )
    assert coarse.surface_grid == GRID and fine.sdf.shape == GRID.shape
    assert fine.surface_grid.shape == tuple(2 * n for n in GRID.shape) == fine.indicator.shape
    assert len(fine.mesh.faces) > 3 * len(coarse.mesh.faces)
    spacing = isograd.reconstruct(SPHERE, GRID, surface=GRID.spacing / 2, checks=False)
    assert bits(spacing.sdf) == bits(fine.sdf)
    halves = [isograd.reconstruct(SPHERE, GRID, surface=cells, checks=False) for cells in ("0.5x", 2 * GRID.spacing)]
    assert bits(halves[0].sdf) == bits(halves[1].sdf) != bits(coarse.sdf)
    exact = np.linalg.norm(GRID.centers(), axis=-1) - 1
    off = [np.abs(result.sdf - exact).mean() for result in (coarse, fine)]
    assert off[1] < off[0]


def test_the_grid_of_the_surface_may_lie_beyond_that_of_the_field():
    cloud = isograd.sample("sphere", 400, dtype=np.float64).points
    result = isograd.reconstruct(cloud, resolution=101, padding=0.03)
    grid = result.surface_grid
    assert grid.shape == result.indicator.shape and grid.spacing == result.report["surface_spacing"]
    assert all(a < b for a, b in zip(grid.lower, result.grid.lower))
    away = np.linalg.norm(grid.centers(), axis=-1) - np.linalg.norm(cloud, axis=1).mean()
    clear = np.abs(away) > grid.spacing
    assert ((result.indicator < result.iso_value) == (away < 0))[clear].all()


def test_a_sparse_solve_agrees_with_the_dense_one():
    dense, sparse = (
        isograd.reconstruct(SPHERE, GRID, surface="2x", solve=solve, checks=False) for solve in ("dense", "sparse")
    )
    assert sparse.surface_grid == dense.surface_grid and sparse.indicator.shape == GRID.shape
    assert sparse.report["surface_cells"] < dense.report["surface_cells"]
    # The indicator differs by less than 1e-4 of its jump, which takes about two cells.
    assert np.abs(sparse.sdf - dense.sdf).mean() < 1e-3 * GRID.spacing
    bar = np.exp(-((dense.sdf / GRID.spacing) ** 2))
    gradients = [result.pullback(sdf=bar).points for result in (dense, sparse)]
    assert np.linalg.norm(gradients[0] - gradients[1]) < 5e-3 * np.linalg.norm(gradients[0])
    with pytest.raises(ValueError, match="solve = dense"):
        sparse.pullback(indicator=np.ones(GRID.shape))


def test_attributes_are_carried_to_the_surface():
    values = SPHERE[:, 0]
    result = isograd.reconstruct(SPHERE, GRID, attributes={"x": values})
    extension = result.extend("x", 2 * GRID.spacing, fill="band")
    assert np.abs(extension.vertices[:, 0] - result.mesh.vertices[:, 0]).max() < 0.05
    centers = GRID.centers()
    exact = centers[..., 0] / np.linalg.norm(centers, axis=-1)
    dense = extension.dense(fill=np.nan)[..., 0]
    known = np.isfinite(dense)
    assert known.sum() == len(extension.cells) > 1000
    assert np.abs(dense - exact)[known].max() < 0.1
    with pytest.raises(ValueError, match="nothing"):
        result.extend("nothing", 0.1)


def test_attributes_fill_the_whole_inside():
    # A body at uniform velocity: its core moves too.
    result = isograd.reconstruct(SPHERE, GRID, attributes={"v": np.full(len(SPHERE), 2.5)})
    extension = result.extend("v", 2 * GRID.spacing)
    dense = extension.dense(fill=np.nan)[..., 0]
    sdf = result.sdf
    assert sdf.min() < -4 * GRID.spacing
    np.testing.assert_array_equal(np.isfinite(dense), sdf <= 2 * GRID.spacing)
    np.testing.assert_allclose(extension.values, 2.5, rtol=1e-12)
    # At any places, by a query.
    moving = isograd.reconstruct(SPHERE, GRID, attributes={"v": SPHERE})
    extension, mesh = moving.extend("v", 2 * GRID.spacing), moving.closest_mesh
    hits = isograd.query(mesh, GRID.centers().reshape(-1, 3)[extension.cells])
    values = np.einsum("mk,mkc->mc", hits.barycentric, extension.vertices[mesh.faces[hits.face]])
    clear = np.abs(hits.distance) < 2 * GRID.spacing
    np.testing.assert_allclose(values[clear], extension.values[clear], atol=1e-6)
    with pytest.raises(ValueError, match="fill"):
        result.extend("v", 0.1, fill="all")
    narrow = isograd.reconstruct(SPHERE, GRID, attributes={"v": SPHERE}, band=0.2)
    with pytest.raises(ValueError, match="options.band"):
        narrow.extend("v", 0.1)
    assert len(narrow.extend("v", 0.1, fill="band").cells) > 0


def test_the_pullback_of_a_filled_inside_is_its_transpose():
    rng = np.random.default_rng(3)
    result = isograd.reconstruct(SPHERE, GRID, attributes={"v": rng.normal(size=(len(SPHERE), 2))})
    extension = result.extend("v", 2 * GRID.spacing)
    bar = rng.normal(size=extension.values.shape)
    gradient = result.pullback(extensions=[(extension, None, bar)]).attributes["v"]
    values = rng.normal(size=gradient.shape)
    other = isograd.reconstruct(SPHERE, GRID, attributes={"v": values}).extend("v", 2 * GRID.spacing)
    assert abs((bar * other.values).sum() / (gradient * values).sum() - 1) < 1e-9


@pytest.mark.parametrize("dtype", TYPES)
def test_saved_arrays_pull_back_to_the_same_bits(dtype):
    points = SPHERE.astype(dtype)
    settings = _settings.encode(GRID, isograd.Options(checks=False))
    saved = pure.forward(settings, points)
    sdf, closest, _ = saved
    result = isograd.reconstruct(points, GRID)
    assert bits(sdf) == bits(result.sdf) and bits(closest) == bits(result.closest)
    (bar,) = pure.pullback(settings, points, None, saved, sdf)
    assert bits(bar) == bits(result.pullback(sdf).points)


def test_a_plan_gives_the_same_bits_again_and_on_several_threads():
    plan = isograd.Reconstructor(GRID)
    first = bits(plan(SPHERE).sdf)
    plan(SPHERE[:2000])
    found = []
    threads = [threading.Thread(target=lambda: found.append(bits(plan(SPHERE).sdf))) for _ in range(4)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert found == [first] * 4


def test_input_of_any_layout_is_converted_and_never_reinterpreted():
    expected = isograd.reconstruct(SPHERE, GRID).sdf
    misaligned = np.frombuffer(b"x" + SPHERE.tobytes(), dtype=np.uint8)[1:].view(np.float64)
    read_only = SPHERE.copy()
    read_only.flags.writeable = False
    for same in (
        np.asfortranarray(SPHERE),
        np.repeat(SPHERE, 2, axis=0)[::2],
        SPHERE.astype(">f8"),
        misaligned.reshape(SPHERE.shape),
        read_only,
        SPHERE.tolist(),
    ):
        assert bits(isograd.reconstruct(same, GRID).sdf) == bits(expected)
    half = SPHERE.astype(np.float16)
    result = isograd.reconstruct(half, GRID)
    assert result.sdf.dtype == np.float32
    assert bits(result.sdf) == bits(isograd.reconstruct(half.astype(np.float32), GRID).sdf)
    whole = np.unique((SPHERE * 20).astype(int), axis=0)
    assert isograd.reconstruct(whole, resolution_of(whole)).sdf.dtype == np.float64


def resolution_of(points):
    return isograd.Grid.fit(points, 24)


@pytest.mark.parametrize(
    ("points", "error", "text"),
    [
        (np.zeros((0, 3)), ValueError, "point"),
        (np.zeros((5, 3)), ValueError, "same place|equal|coincide"),
        (np.zeros((5, 2)), ValueError, r"\(5, 2\)"),
        (np.zeros(6), ValueError, r"\(6,\)"),
        (np.full((9, 3), np.nan), ValueError, "not finite"),
        (SPHERE.astype(complex), TypeError, "complex"),
        (np.ones((9, 3), bool), TypeError, "bool"),
        (SPHERE.astype(object), TypeError, "object"),
        ("points", (OSError, ValueError), "points"),
        (None, TypeError, "points"),
        (np.ma.masked_array(SPHERE, mask=SPHERE > 0.9), TypeError, "masked"),
        ([[1, 2, 3], [4, 5]], TypeError, "points"),
        (np.longdouble(SPHERE), TypeError, "float"),
        (1e300 * SPHERE, ValueError, "e300|extent|spacing"),
    ],
)
def test_bad_points_are_refused_with_a_reason(points, error, text):
    with pytest.raises(error, match=text) as caught:
        isograd.reconstruct(points)
    assert len(str(caught.value)) > 10


def test_outliers_are_left_out_and_have_no_gradient():
    left_out = [7, 30]
    points = np.insert(np.insert(SPHERE, 7, (500.0, 0.0, 3.0), axis=0), 30, (0, 0, 0), axis=0)
    grid = isograd.Grid.fit(points, 32)
    assert grid == GRID
    result = isograd.reconstruct(points, grid)
    expected = isograd.reconstruct(SPHERE, GRID)
    assert list(result.outliers) == left_out and result.report["outliers"] == {"count": 2, "indices": left_out}
    assert "2 samples were left out" in result.warnings[0]
    assert bits(result.sdf) == bits(expected.sdf)
    assert not result.normals[left_out].any() and not result.confidence[left_out].any()
    gradient = result.pullback(sdf=result.sdf).points
    assert not gradient[left_out].any()
    assert bits(np.delete(gradient, left_out, axis=0)) == bits(expected.pullback(sdf=expected.sdf).points)
    kept = isograd.Grid.fit(points, 32, outliers="keep")
    assert kept.spacing > 100 * grid.spacing
    with pytest.raises(ValueError, match="point 7"):
        isograd.reconstruct(points, grid, outliers=isograd.Outliers.KEEP)


def test_a_trimmed_mesh_is_open_and_a_sheet_has_a_closed_shell():
    points = SPHERE[SPHERE[:, 2] > 0]
    whole = isograd.reconstruct(points, GRID, orient="given", normals=points)
    trimmed = isograd.reconstruct(points, GRID, orient="given", normals=points, trim=0.2)
    assert bits(trimmed.sdf) == bits(whole.sdf)
    assert bits(trimmed.closest_mesh.faces) == bits(whole.mesh.faces)
    removed = len(whole.mesh.faces) - len(trimmed.mesh.faces)
    assert removed > 100 and trimmed.report["trim"] == {"distance": 0.2, "faces": removed}
    gradient = trimmed.pullback(vertices=np.ones_like(trimmed.mesh.vertices)).points
    assert np.isfinite(gradient).all() and gradient.any()
    sheet = isograd.reconstruct(points, GRID, orient="given", normals=points, sheet=0.4)
    radius = np.linalg.norm(GRID.centers(), axis=-1)
    near = (abs(radius - 1) < 0.3) & (GRID.centers()[..., 2] > 0.6)
    assert abs(sheet.sdf - (abs(radius - 1) - 0.2))[near].max() < 0.02
    assert sheet.report["surface"]["closed"] and sheet.report["surface"]["components"] == 1
    gradient = sheet.pullback(vertices=np.ones_like(sheet.mesh.vertices), sdf=sheet.sdf).points
    assert np.isfinite(gradient).all() and gradient.any()
    with pytest.raises(ValueError, match="use a larger trim"):
        isograd.reconstruct(points, GRID, orient="given", normals=points, trim=1e-9)


def test_bad_arguments_are_refused_with_a_reason():
    result = isograd.reconstruct(SPHERE, GRID)
    bad = np.zeros(GRID.shape)
    bad[1, 2, 3] = np.inf
    for error, text, call in [
        (TypeError, "unknown option 'color'; the options are radius", lambda: isograd.reconstruct(SPHERE, GRID, color=1)),
        (TypeError, "did you mean 'smoothing'", lambda: isograd.reconstruct(SPHERE, GRID, smothing=1)),
        (ValueError, "'auto'", lambda: isograd.reconstruct(SPHERE, GRID, orient="left")),
        (ValueError, "normals", lambda: isograd.reconstruct(SPHERE, GRID, orient="given")),
        (ValueError, "does not use", lambda: isograd.reconstruct(SPHERE, GRID, normals=SPHERE)),
        (ValueError, "smoothing", lambda: isograd.Options(smoothing=-1)),
        (ValueError, "radius is 'cut:0'; give", lambda: isograd.Options(radius="cut:0")),
        (ValueError, "radius is 'wide'", lambda: isograd.Options(radius="wide")),
        (ValueError, "surface is '65x'", lambda: isograd.Options(surface="65x")),
        (ValueError, "surface is 0", lambda: isograd.Options(surface=0)),
        (ValueError, "'sparse'", lambda: isograd.Options(solve="fast")),
        (ValueError, "screening", lambda: isograd.Options(screening=float("inf"))),
        (ValueError, "'local'", lambda: isograd.Options(level="median")),
        (ValueError, "outliers is 'drop'", lambda: isograd.Options(outliers="drop")),
        (ValueError, "outliers is 'drop'", lambda: isograd.Grid.fit(SPHERE, outliers="drop")),
        (ValueError, "trim is 0", lambda: isograd.Options(trim=0)),
        (ValueError, "sheet is 'thin'", lambda: isograd.Options(sheet="thin")),
        (ValueError, "walls is 'open'", lambda: isograd.Options(walls="open")),
        (ValueError, "radius", lambda: isograd.Options(radius=0)),
        (ValueError, "band", lambda: isograd.Options(band=float("nan"))),
        (TypeError, "Grid", lambda: isograd.reconstruct(SPHERE, (1, 2, 3))),
        (ValueError, "lower", lambda: isograd.Grid(0.0, 1.0, (4, 4, 4))),
        (ValueError, "cells", lambda: isograd.Grid((0, 0, 0), 1.0, (4, 0, 4))),
        (ValueError, "-1", lambda: isograd.Grid((0, 0, 0), -1.0, (4, 4, 4))),
        (ValueError, "cells", lambda: isograd.Grid((0, 0, 0), 1.0, (2**40, 2**40, 2**40))),
        (ValueError, "not both", lambda: isograd.Grid.fit(SPHERE, 32, spacing=0.1)),
        (ValueError, "more padding", lambda: isograd.reconstruct(9 * SPHERE, GRID)),
        (ValueError, "must have", lambda: result.pullback(np.zeros((3, 3, 3)))),
        (ValueError, "not finite", lambda: result.pullback(bad)),
        (TypeError, "complex", lambda: result.pullback(bad.astype(complex))),
        (TypeError, "extend", lambda: result.pullback(extensions=[(3, None, None)])),
        (ValueError, "known|bodies|are", lambda: isograd.Shape("unicorn")),
        (ValueError, "radius", lambda: isograd.Shape("sphere", radius=-1)),
        (ValueError, "samples", lambda: isograd.sample("sphere", 0)),
        (TypeError, "mesh", lambda: isograd.signed_distance(3, SPHERE)),
        (ValueError, "9999", lambda: isograd.signed_distance((SPHERE, [[0, 1, 9999]]), SPHERE)),
        (FileNotFoundError, "none.ply", lambda: isograd.read_points("none.ply")),
        (OSError, "folder", lambda: isograd.read_points("/")),
    ]:
        with pytest.raises(error, match=text) as caught:
            call()
        assert len(str(caught.value)) > 10, caught.value


def test_a_thousand_random_calls_end_in_a_result_or_a_reason():
    rng = np.random.default_rng(3)
    odd = [None, -1, 0, 3, 1e308, -1e-308, float("nan"), float("inf"), "x", b"x", [], {}, (), [[]], object()]
    odd += [np.zeros(s, t) for s in [(0,), (3,), (4, 3), (3, 3, 3)] for t in ("f4", "f8", "i8", "c8", "U3", "?")]
    odd += [SPHERE, SPHERE[:5], GRID, isograd.Options(), isograd.Shape("torus")]

    def pick():
        return odd[rng.integers(len(odd))]

    calls = [
        lambda: isograd.reconstruct(pick(), pick()),
        lambda: isograd.reconstruct(SPHERE, GRID, normals=pick(), attributes=pick()),
        lambda: isograd.reconstruct(SPHERE[:50], pick(), options=pick(), smoothing=pick()),
        lambda: isograd.Grid(pick(), pick(), pick()),
        lambda: isograd.Grid.fit(pick(), pick()),
        lambda: isograd.Options(pick(), pick(), pick(), smoothing=pick(), band=pick()),
        lambda: isograd.query((pick(), pick()), pick()),
        lambda: isograd.query_pullback((SPHERE[:3], [[0, 1, 2]]), pick(), pick()),
        lambda: isograd.Shape(pick(), radius=pick()),
        lambda: isograd.sample("sphere", pick(), seed=pick(), density=pick()),
        lambda: isograd.read_points(pick()),
        lambda: isograd.write_points("/nowhere/x.ply", pick(), normals=pick()),
        lambda: _core.call_target("isograd_forward", [pick(), pick()], [pick()], pick()),
        lambda: _core.call_target("isograd_pullback", [pick() for _ in range(6)], [pick()], _settings.encode(GRID)),
    ]
    refused = 0
    for k in range(1000):
        try:
            calls[k % len(calls)]()
        except Exception as error:
            # A panic would be a RuntimeError that speaks of a defect.
            assert not isinstance(error, (RuntimeError, SystemError)), error
            assert str(error), repr(error)
            refused += 1
    assert refused > 700


def test_distances_to_a_mesh_and_back():
    result = isograd.reconstruct(SPHERE, GRID)
    queries = np.random.default_rng(4).uniform(-1.1, 1.1, (500, 3))
    hits = isograd.query(result.mesh, queries)
    exact = np.linalg.norm(queries, axis=1) - 1
    assert np.abs(hits.distance - exact).max() < 0.02
    assert np.array_equal(isograd.signed_distance(result.mesh, queries), hits.distance)
    corners = result.mesh.vertices[result.mesh.faces[hits.face]]
    assert np.allclose(np.einsum("ik,ikj->ij", hits.barycentric, corners), hits.point, atol=1e-12)
    bar = np.random.default_rng(5).normal(size=500)
    vertices_bar, queries_bar = isograd.query_pullback(result.mesh, queries, bar)
    assert np.allclose(queries_bar, bar[:, None] * hits.gradient)
    # A body that moves with its queries keeps its distances.
    assert np.allclose(vertices_bar.sum(axis=0) + queries_bar.sum(axis=0), 0, atol=1e-9)


def test_parameters_of_a_shape_are_pulled_back():
    fish = isograd.Shape("fish")
    samples = fish.sample(400)
    points, normals = fish.points_at(samples.coordinates)
    assert np.array_equal(points, samples.points) and np.array_equal(normals, samples.normals)
    bar = np.cos(7 * points)
    slope = fish.pullback(samples.coordinates, bar)["width3"]
    h = 1e-6
    sides = [fish.replace(width3=fish.values["width3"] + s) for s in (h, -h)]
    plus, minus = (side.points_at(samples.coordinates)[0] for side in sides)
    assert abs(slope - (bar * (plus - minus)).sum() / (2 * h)) < 1e-7 * max(1, abs(slope))
    assert set(isograd.shapes()) >= {"sphere", "torus", "fish", "airliner"}
    assert samples.velocity is not None and fish.parameters["width1"].unit != ""


@pytest.mark.parametrize("dtype", TYPES)
def test_files_keep_every_bit(tmp_path, dtype):
    points, normals = SPHERE.astype(dtype), SPHERE.astype(dtype)
    for name in ("a.ply", "a.npz"):
        path = tmp_path / name
        isograd.write_points(path, points, normals=normals, attributes={"w": points[:, 0]})
        cloud = isograd.read_points(path)
        assert bits(cloud.points) == bits(points) and bits(cloud.normals) == bits(normals)
        assert bits(cloud.attributes["w"][:, 0]) == bits(points[:, 0])
    result = isograd.reconstruct(points, GRID)
    isograd.write_mesh(tmp_path / "m.ply", result.mesh)
    mesh = isograd.read_mesh(tmp_path / "m.ply")
    assert bits(mesh.vertices) == bits(result.mesh.vertices)
    assert bits(mesh.faces) == bits(result.mesh.faces)
    for name in ("f.vti", "f.npz"):
        isograd.write_sdf(tmp_path / name, GRID, result.sdf)
        grid, sdf = isograd.read_sdf(tmp_path / name)
        assert grid.shape == GRID.shape and bits(sdf) == bits(result.sdf)
    with pytest.raises(ValueError, match="no faces"):
        isograd.read_mesh(tmp_path / "a.ply")


@pytest.mark.skipif(sys.platform != "linux", reason="signals and forks as on Linux")
def test_ctrl_c_interrupts_at_once_and_leaves_no_lock():
    plan = isograd.Reconstructor(isograd.Grid.fit(SPHERE, 128))
    timer = threading.Timer(0.1, lambda: os.kill(os.getpid(), signal.SIGINT))
    # A process in the background, or under nohup, starts with this signal ignored.
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    timer.start()
    start = time.monotonic()
    with pytest.raises(KeyboardInterrupt):
        while True:
            plan(SPHERE)
    signal.signal(signal.SIGINT, before)
    delay = time.monotonic() - start - 0.1
    print(f"interrupted after {delay:.3f} s")
    small = isograd.Reconstructor(GRID)
    assert bits(small(SPHERE).sdf) == bits(isograd.reconstruct(SPHERE, GRID).sdf)
    assert plan(SPHERE).sdf.shape == plan.grid.shape


@pytest.mark.skipif(sys.platform != "linux", reason="signals and forks as on Linux")
def test_a_forked_process_gets_an_error_with_the_remedy():
    code = """
import os, isograd
points = isograd.sample("sphere", 500).points
isograd.reconstruct(points, isograd.Grid.fit(points, 16))
if os.fork() == 0:
    try:
        isograd.reconstruct(points, isograd.Grid.fit(points, 16))
    except RuntimeError as error:
        os._exit(0 if "spawn" in str(error) else 2)
    os._exit(3)
assert os.waitstatus_to_exitcode(os.wait()[1]) == 0
"""
    subprocess.run([sys.executable, "-c", code], check=True)


def test_memory_is_flat():
    if not pathlib.Path("/proc/self/statm").exists():
        pytest.skip("SKIPPED: the memory of a process is read from /proc")

    def resident():
        return int(pathlib.Path("/proc/self/statm").read_text().split()[1]) * 4096

    points = SPHERE[:600]
    plan = isograd.Reconstructor(isograd.Grid.fit(points, 16))
    settings = _settings.encode(plan.grid)
    sizes = []
    for k in range(200):
        result = plan(points)
        result.pullback(result.sdf)
        saved = pure.forward(settings, points)
        pure.pullback(settings, points, None, saved, saved[0])
        if k in (60, 199):
            sizes.append(resident())
    # 139 calls of about 0.3 MB each would be 42 MB.
    assert sizes[1] - sizes[0] < 10e6, sizes


def test_options_are_typed_and_strings_are_enum_values():
    options = isograd.Options(orient="signs", splat="paper", radius=0.2)
    assert options.orient is isograd.Orient.SIGNS and options.splat is isograd.Splat.PAPER
    assert dataclasses.replace(options, band=3).band == 3.0
    assert options.smoothing == "auto" and options.level is isograd.Level.THIN
    assert isograd.Orient.SIGNS == "signs"
    result = isograd.reconstruct(SPHERE, GRID, normals=-SPHERE, orient=isograd.Orient.SIGNS)
    assert result.sdf[GRID.shape[0] // 2, GRID.shape[1] // 2, GRID.shape[2] // 2] > 0


@pytest.mark.parametrize("dtype", TYPES)
def test_normals_alone_are_those_of_a_reconstruction(dtype):
    points = SPHERE.astype(dtype)
    found = isograd.orient(points)
    whole = isograd.reconstruct(points, GRID)
    assert found.normals.dtype == dtype and found.confidence.dtype == dtype
    assert bits(found.normals) == bits(whole.normals) and bits(found.confidence) == bits(whole.confidence)
    assert found.report["orientation"] == whole.report["orientation"]
    doubtful = found.report["orientation"]["doubtful"]
    assert doubtful == dict.fromkeys(("share", "thin", "sparse", "open", "noisy", "unexplained"), 0.0)
    assert found.warnings == []
    inward = isograd.orient(points, normals=-points, orient="given")
    assert np.einsum("ij,ij->i", inward.normals, points).max() < 0


def test_a_doubtful_side_has_a_reason_in_the_warning():
    sheet = np.random.default_rng(1).random((2000, 3)) * (1, 1, 0)
    found = isograd.orient(sheet)
    doubtful = found.report["orientation"]["doubtful"]
    assert doubtful["open"] > 0.9 and doubtful["share"] == 1.0
    assert any("close the gaps" in warning for warning in found.warnings)


def test_sensors_are_one_for_all_one_for_each_or_any():
    sheet = np.random.default_rng(2).random((500, 3)) * (1, 1, 0)
    below = (0.5, 0.5, -2.0)
    each = np.tile(below, (500, 1))
    for sensors in (below, [below], np.array([below, (0, 0, -9)]), each):
        found = isograd.orient(sheet, sensors=sensors, orient="sensors")
        assert found.normals[:, 2].max() < 0
    result = isograd.reconstruct(SPHERE, GRID, sensors=(0, 0, 5), orient=isograd.Orient.SENSORS)
    assert result.report["orientation"]["method"] == "sensors"
    with pytest.raises(ValueError, match="there are no sensors"):
        isograd.orient(sheet, orient="sensors")
    with pytest.raises(ValueError, match="does not use them"):
        isograd.reconstruct(SPHERE, GRID, sensors=(0, 0, 5))
    with pytest.raises(ValueError, match="sensor position 1 is not finite"):
        isograd.orient(sheet, sensors=[below, (0, np.nan, 1)], orient="sensors")
    with pytest.raises(ValueError, match="lies exactly at a sensor"):
        isograd.orient(sheet, sensors=sheet[3], orient="sensors")
    with pytest.raises(ValueError, match="sensors has the shape"):
        isograd.orient(sheet, sensors=np.zeros((4, 2)), orient="sensors")


def test_a_plan_follows_the_step_before():
    plan = isograd.Reconstructor(GRID, orient="previous")
    methods = []
    for turn in (0.0, 0.1, 0.2):
        c, s = np.cos(turn), np.sin(turn)
        points = SPHERE @ np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]]).T
        result = plan(points)
        assert np.einsum("ij,ij->i", result.normals, points).min() > 0.98
        methods.append(result.report["orientation"]["method"])
    assert methods == ["auto", "previous", "previous"]
    assert plan(SPHERE[1:]).report["orientation"]["method"] == "auto"


@pytest.mark.parametrize("orient", ["previous", "sensors"])
def test_pure_functions_refuse_what_is_no_function_of_their_arguments(orient):
    with pytest.raises(ValueError, match='with orient="signs"'):
        _settings.encode_pure(GRID, isograd.Options(orient=orient), False, "cpu", False)
    with pytest.raises(ValueError, match='with orient="signs"'):
        isograd.fit(SPHERE, GRID, points=SPHERE, options=isograd.Options(orient=orient))


def test_every_way_to_the_level_has_a_gradient_that_agrees_with_differences():
    grid = isograd.Grid.fit(SPHERE, 24)
    weight = np.linspace(-1, 1, grid.shape[0] * grid.shape[1] * grid.shape[2]).reshape(grid.shape)
    direction = SPHERE[:, ::-1].copy()
    for options in [
        {"level": "mean", "smoothing": 0, "area": False},
        {"screening": 2.0, "radius": 0.6},
        {"screening": 2.0, "area": False},
        {"level": "local", "area": False},
        {"level": "thin", "smoothing": 0.5, "area": False},
        {"radius": 0.6},
    ]:
        options = isograd.Options(orient="given", surface="grid", **options)
        call = lambda points: isograd.reconstruct(points, grid, normals=SPHERE, options=options)  # noqa: E731
        result = call(SPHERE)
        pulled = (result.pullback(indicator=weight).points * direction).sum()
        step = 1e-6
        values = [(call(SPHERE + s * direction).indicator * weight).sum() for s in (step, -step)]
        difference = (values[0] - values[1]) / (2 * step)
        assert abs(pulled - difference) < 1e-4 * abs(difference), (options, pulled, difference)


def test_columns_and_memory_of_files_are_chosen(tmp_path):
    path = tmp_path / "a.csv"
    path.write_text("t,lon,lat,depth\n9,1,2,3\n9,4,5,6\n")
    with pytest.raises(ValueError, match=r"2 'lon'.*columns in Python"):
        isograd.read_points(path)
    for columns in [("lon", "lat", "depth"), (2, 3, 4)]:
        cloud = isograd.read_points(path, columns=columns)
        assert np.array_equal(cloud.points, [[1, 2, 3], [4, 5, 6]]) and set(cloud.attributes) == {"t"}
    cloud = isograd.read_points(path, columns=(2, 3, 4), normal_columns=["t", "lon", "lat"])
    assert np.array_equal(cloud.normals[0], [9, 1, 2])
    for memory in [64, "64"]:
        with pytest.raises(ValueError, match="the limit is 64 bytes.*max_memory"):
            isograd.read_points(path, columns=(2, 3, 4), max_memory=memory)
    assert len(isograd.read_points(path, columns=(2, 3, 4), max_memory="1M").points) == 2
    with pytest.raises(ValueError, match="'many' is not a size"):
        isograd.read_sdf(path, max_memory="many")
