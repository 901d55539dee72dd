"""`isograd.jax.surface`: distance, normal, closest point and values at cell centers, faces, another grid and positions."""

import numpy as np
import pytest

jax = pytest.importorskip("jax", reason="SKIPPED: JAX is not installed")

import isograd  # noqa: E402
import isograd.jax as ij  # noqa: E402
import jax.numpy as jnp  # noqa: E402
from jax.test_util import check_grads  # noqa: E402
from test_jax import GIVEN, GRID, check_batches, dtype, torus, x64  # noqa: E402, F401

FACES = ((1.0, 0.5, 0.5), (0.5, 1.0, 0.5), (0.5, 0.5, 1.0))
FIXED = isograd.Options(radius=0.4)
"""A radius that does not follow the points, as the gradient holds it constant, with enough samples for every fit."""
SMALL_STEPS = {"order": 1, "modes": ["rev"], "eps": 1e-7, "atol": 1e-6, "rtol": 1e-6}
RNG = np.random.default_rng(5)
PLACES = RNG.uniform(-1.6, 1.6, (300, 3)) * [1, 1, 0.4]


def ball(dtype=np.float64, count=2000):
    """Samples of the unit sphere, and a grid in which it is 16 cells thick."""
    points = isograd.sample("sphere", count, dtype=dtype).points
    points = points / np.linalg.norm(points, axis=1, keepdims=True).astype(dtype)
    return points, isograd.Grid(lower=(-1.5, -1.5, -1.5), spacing=0.125, shape=(24, 24, 24))


def positions(grid, offset):
    axes = [low + grid.spacing * (np.arange(n) + o) for low, n, o in zip(grid.lower, grid.shape, offset)]
    return np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1)


def test_results_of_a_sphere_are_those_of_its_closed_form(dtype):  # noqa: F811
    points, grid = ball(dtype)
    found = jax.jit(lambda p: ij.surface(p, grid, FACES, values=p, band="full"))(points)
    for offset, part in zip(FACES, found):
        x = positions(grid, offset)
        radius = np.linalg.norm(x, axis=-1)
        out = x / radius[..., None]
        away = radius > 0.3  # every point of the sphere is closest to its center
        assert part.sdf.shape == grid.shape and part.sdf.dtype == dtype
        # The surface is a polyhedron through 2,000 samples: of faces 0.08 long, 0.001 off the sphere.
        np.testing.assert_allclose(part.sdf, radius - 1, atol=0.004)
        assert np.abs(part.closest - out)[away].max() < 0.1
        # Values are the coordinates of the samples: at the closest point they are that point.
        assert np.abs(part.values - part.closest).max() < 0.006
        assert (np.sum(part.normal * out, axis=-1)[away] > 0.99).all()
        np.testing.assert_allclose(np.linalg.norm(part.normal, axis=-1), 1, rtol=1e-5)


def test_places_in_all_their_forms_agree(dtype):  # noqa: F811
    points, _ = torus(dtype=dtype)
    centers = GRID.centers(dtype).reshape(-1, 3)

    def at(places):
        return ij.surface(points, GRID, places, values=points, band="full")

    cells = at(None)
    np.testing.assert_array_equal(cells.sdf, ij.signed_distance(points, GRID))
    # Where two faces are equally close, as inside near the axis of the tube, either may be found.
    near = np.abs(cells.sdf) < 0.3
    tolerance = 200 * np.finfo(dtype).eps
    same = isograd.Grid(GRID.lower, GRID.spacing, GRID.shape)
    for places in (GRID, same, (0.5, 0.5, 0.5), ((0.5, 0.5, 0.5),), centers, jnp.asarray(centers)):
        found = at(places)
        found = found[0] if isinstance(places, tuple) and isinstance(places[0], tuple) else found
        for name in ("sdf", "normal", "closest", "values"):
            one, other = (np.asarray(getattr(x, name)).reshape(*GRID.shape, -1) for x in (found, cells))
            np.testing.assert_allclose(one[near], other[near], atol=tolerance * (100 if name == "normal" else 10))
    finer = isograd.Grid((-1.2, -1.2, -0.5), 0.07, (34, 34, 14))
    on_finer, on_list = at(finer), at(finer.centers(dtype).reshape(-1, 3))
    for one, other in zip(on_finer, on_list):
        np.testing.assert_array_equal(np.ravel(one), np.ravel(other))
    faces = ij.surface(points, GRID, FACES, band="full")
    for offset, part in zip(FACES, faces):
        alone = at(offset)
        np.testing.assert_array_equal(part.sdf, alone.sdf)
        assert part.values is None
        on_list = at(positions(GRID, offset).astype(dtype).reshape(-1, 3))
        np.testing.assert_array_equal(part.closest.reshape(-1, 3), on_list.closest)


@pytest.mark.parametrize("places", [None, (0.5, 1.0, 0.5)], ids=["cells", "faces"])
@pytest.mark.parametrize("narrow", [None, 0.3], ids=["all", "options.band"])
def test_a_band_ends_outside_and_inside_only_where_it_is_asked_to(places, narrow):
    points, grid = ball(np.float32)
    options = None if narrow is None else isograd.Options(band=narrow)
    full = ij.surface(points, grid, places, values=points[:, 0], band="full")
    for fill in ("inside", "band"):
        part = ij.surface(points, grid, places, values=points[:, 0], band=0.25, fill=fill, options=options)
        outside = full.sdf > 0.25
        deep = full.sdf < -0.25
        assert outside.sum() > 1000 and deep.sum() > 500
        dropped = outside | deep if fill == "band" else outside
        np.testing.assert_array_equal(part.sdf[outside], np.float32(0.25))
        np.testing.assert_array_equal(part.values[dropped], 0)
        np.testing.assert_array_equal(part.normal[dropped], 0)
        x = positions(grid, places or (0.5, 0.5, 0.5)).astype(np.float32)
        np.testing.assert_array_equal(part.closest[dropped], x[dropped])
        tolerance = 1e-5  # φ of cell centers, and of a search
        np.testing.assert_allclose(part.sdf[~dropped], full.sdf[~dropped], atol=tolerance)
        clear = ~dropped & (full.sdf > -0.8)  # near the center two faces are equally close
        np.testing.assert_allclose(part.values[clear], full.values[clear], atol=tolerance)
        if fill == "band":
            np.testing.assert_array_equal(part.sdf[deep], np.float32(-0.25))
        else:
            assert np.abs(part.values[deep]).max() > 0.9, "the core has the values of the surface"


def test_rigid_velocities_fill_the_whole_inside(dtype):  # noqa: F811
    points, grid = ball(dtype)
    velocity = np.broadcast_to(np.asarray([1, -2, 3], dtype), points.shape)
    tolerance = 100 * np.finfo(dtype).eps
    for field in (ij.surface(points, grid, values=velocity), ij.extend(points, velocity, grid)):
        inside = field.sdf < 0
        assert inside.sum() > 2000 and field.sdf.min() < -7 * grid.spacing
        np.testing.assert_allclose(field.values[inside], np.broadcast_to(velocity[0], (inside.sum(), 3)), rtol=tolerance)
        far = field.sdf >= 4 * grid.spacing
        np.testing.assert_array_equal(field.values[far], 0)
    band = ij.extend(points, velocity, grid, fill="band")
    assert not band.values[band.sdf < -3 * grid.spacing].any()


@pytest.mark.parametrize("places", ["cells", "faces", "list"])
def test_gradients_agree_with_differences(places, x64):  # noqa: F811
    points, normals = torus()
    values = np.cross([0.0, 0.0, 1.0], points) + 0.1 * RNG.standard_normal(points.shape)
    where = {"cells": None, "faces": (1.0, 0.5, 0.5), "list": PLACES}[places]
    count = len(PLACES) if places == "list" else int(np.prod(GRID.shape))
    weights = [RNG.standard_normal((count, k)) for k in (1, 3, 3, 3)]

    def loss(points, values, given, where):
        options = isograd.Options(radius=0.4, orient="given")
        found = ij.surface(points, GRID, where, values=values, normals=given, options=options, band="full")
        sdf = found.sdf.reshape(-1, 1)
        # Off the axis of the tube, where the closest point jumps, and off the surface, where the normal does.
        clear = ((sdf > -0.25) & (sdf < 0.35) & (jnp.abs(sdf) > 0.02)).astype(float)
        parts = (part.reshape(count, -1) for part in found)
        return sum(jnp.sum(w * part * clear) for w, part in zip(weights, parts)) / 1e2

    if places == "list":
        check_grads(loss, (points, values, normals, where), **SMALL_STEPS)
    else:
        check_grads(lambda *x: loss(*x, where), (points, values, normals), **SMALL_STEPS)


def test_the_values_are_linear_in_those_of_the_samples(x64):  # noqa: F811
    points, _ = torus()
    values = RNG.standard_normal(points.shape)
    weights = RNG.standard_normal((len(PLACES), 3))
    field, pullback = jax.vjp(lambda v: ij.surface(points, GRID, PLACES, values=v, band="full").values, values)
    np.testing.assert_allclose(jnp.vdot(field, weights), jnp.vdot(values, pullback(weights)[0]), rtol=1e-10)


def test_closest_points_outside_the_band_move_with_their_places(x64):  # noqa: F811
    points, _ = torus()
    far = np.array([[0.0, 0.0, 0.0], [1.6, 1.6, 0.6]])
    slope = jax.jacrev(lambda q: ij.surface(points, GRID, q, band=0.1).closest)(far)
    np.testing.assert_array_equal(slope, np.einsum("ij,kl->ikjl", np.eye(2), np.eye(3)))
    slope = jax.grad(lambda q: jnp.sum(ij.surface(points, GRID, q, band=0.1).sdf))(far)
    np.testing.assert_array_equal(slope, 0)


def test_gradients_are_finite_on_the_surface_and_at_lost_places(x64):  # noqa: F811
    points, normals = torus()
    mesh = isograd.reconstruct(points, GRID, normals=normals, orient="given").mesh
    places = np.vstack([mesh.vertices[:200], mesh.vertices[mesh.faces[:200]].mean(axis=1), [[np.nan, 0, 0]]])

    def loss(points, places):
        found = ij.surface(points, GRID, places, values=points, normals=normals, options=GIVEN)
        return sum(jnp.sum(jnp.where(jnp.isnan(part), 0, part)) for part in found)

    for bar in jax.jit(jax.grad(loss, argnums=(0, 1)))(points, places):
        assert np.isfinite(bar).all() and np.abs(bar).max() > 0
    found = ij.surface(points, GRID, places)
    assert np.isnan(found.sdf[-1]) and np.isfinite(found.sdf[:-1]).all()


def test_callbacks_and_batches_give_the_same_bits(monkeypatch):
    def loss(points, normals):
        parts = ij.surface(points, GRID, FACES[:2], values=normals, normals=normals, options=GIVEN)
        cells = ij.surface(points, GRID, values=normals[:, 0], normals=normals, options=GIVEN)
        return sum(jnp.sum(x) for x in jax.tree.leaves((parts, cells)))

    clouds = [torus(seed, dtype=np.float32) for seed in range(2)]
    check_batches(jax.grad(loss, argnums=(0, 1)), clouds, monkeypatch)


def test_bad_arguments_are_refused():
    points, _ = torus(dtype=np.float32)
    bad = (ValueError, TypeError)
    for places in ((1, 2), (1.0, np.nan, 0.0), ((1, 2, 3), (1, 2)), "here", points[:, :2], ()):
        with pytest.raises(bad, match="places"):
            ij.surface(points, GRID, places)
    for fill in ("all", 0, None):
        for call in (ij.surface, lambda p, g, **k: ij.extend(p, p, g, **k)):
            with pytest.raises(ValueError, match="fill"):
                call(points, GRID, fill=fill)
    for band in (0, -1.0, np.nan, np.inf, "wide", None):
        with pytest.raises(ValueError, match="band"):
            ij.surface(points, GRID, band=band)
    with pytest.raises(ValueError, match="options.band"):
        ij.extend(points, points, GRID, options=isograd.Options(band=0.3))
    for options in (isograd.Options(trim=0.5), isograd.Options(sheet=0.3)):
        with pytest.raises((ValueError, jax.errors.JaxRuntimeError), match="trim and sheet"):
            ij.surface(points, GRID, options=options).sdf.block_until_ready()
    nan = points.copy()
    nan[3] = np.nan
    with pytest.raises((ValueError, jax.errors.JaxRuntimeError), match="sample 3 is not finite"):
        ij.surface(points, GRID, values=nan).values.block_until_ready()
    assert ij.surface(points, GRID, points[:0]).closest.shape == (0, 3)


def test_sides_follow_a_body_that_turns_over_inside_scan(x64):  # noqa: F811
    points, normals = torus(count=1500)
    # Half a turn about x: each normal ends on the other side of space.
    angles = jnp.linspace(0, np.pi, 13)

    def turned(vectors, angle):
        c, s = jnp.cos(angle), jnp.sin(angle)
        return vectors @ jnp.array([[1.0, 0, 0], [0, c, s], [0, -s, c]])

    grid = isograd.Grid((-1.7, -1.7, -1.7), 0.17, (20, 20, 20))
    first = isograd.orient(points).normals

    @jax.jit
    def motion(points, first):
        def step(before, angle):
            moved = turned(points, angle)
            now = ij.orient(moved, before)
            sdf = ij.signed_distance(moved, grid, normals=now, options=isograd.Options(orient="signs"))
            return now, jnp.sum(jnp.where(sdf < 0, 1.0, 0.0))

        return jax.lax.scan(step, first, angles)

    last, cells = motion(points, first)
    assert (jnp.sum(last * turned(normals, np.pi), axis=1) > 0.9).all()
    np.testing.assert_allclose(jnp.linalg.norm(last, axis=1), 1, rtol=1e-12)
    # The volume of a torus of radii 1 and 0.4, in whole cells, which fit it to 7 %.
    np.testing.assert_allclose(cells * grid.spacing**3, 2 * np.pi**2 * 0.16, rtol=0.1)
    expected = isograd.orient(points, normals=first, orient="signs").normals
    np.testing.assert_array_equal(ij.orient(points, first), expected)
    np.testing.assert_array_equal(ij.orient(points, -3 * first), -expected)
    assert not jax.grad(lambda p: jnp.sum(ij.orient(p, first)))(points).any()
    with pytest.raises(ValueError, match="before"):
        ij.orient(points, first[1:])
    with pytest.raises(ValueError, match="radius"):
        ij.orient(points, first, radius=-1)
