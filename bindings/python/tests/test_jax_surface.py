"""`isograd.jax` beyond φ on a grid: queries, meshes, extended attributes."""

import numpy as np
import pytest

jax = pytest.importorskip("jax", reason="SKIPPED: JAX is not installed")

import isograd  # noqa: E402
import isograd.jax as ij  # noqa: E402
import jax.numpy as jnp  # noqa: E402
from jax.test_util import check_grads  # noqa: E402
from test_jax import GIVEN, GRID, check_batches, dtype, torus, x64  # noqa: E402, F401

FIXED = isograd.Options(radius=0.25)
"""A radius that does not follow the points, as the gradient holds it constant."""
SIZES = {"max_vertices": 10000, "max_faces": 20000}
SMALL_STEPS = {"order": 1, "modes": ["rev"], "eps": 1e-7, "atol": 1e-6, "rtol": 1e-6}
RNG = np.random.default_rng(3)
PLACES = RNG.uniform(-1.8, 1.8, (400, 3)) * [1, 1, 0.5]
WEIGHTS = RNG.standard_normal(400)


def volume(points, normals=None, options=None):
    options = options or (GIVEN if normals is not None else None)
    surface = ij.mesh(points, GRID, normals=normals, options=options, **SIZES)
    a, b, c = (surface.vertices[surface.faces[:, k]] for k in range(3))
    return jnp.sum(a * jnp.cross(b, c)) / 6


def test_queries_at_cell_centers_give_the_field(dtype):  # noqa: F811
    points, _ = torus(dtype=dtype)
    phi = ij.signed_distance(points, GRID)
    centers = GRID.centers(dtype).reshape(-1, 3)
    distance = jax.jit(lambda p, q: ij.query(p, GRID, q))(points, centers)
    assert distance.dtype == dtype
    tolerance = 20 * np.finfo(dtype).eps
    np.testing.assert_allclose(distance, phi.reshape(-1), atol=tolerance, rtol=0)


def test_gradients_of_queries_agree_with_differences(x64):  # noqa: F811
    points, normals = torus()

    def weighted(points, queries):
        return jnp.sum(WEIGHTS * ij.query(points, GRID, queries, options=FIXED))

    check_grads(weighted, (points, PLACES), **SMALL_STEPS)
    slopes = jax.grad(lambda q: jnp.sum(ij.query(points, GRID, q, normals=normals, options=GIVEN)))(PLACES)
    np.testing.assert_allclose(jnp.linalg.norm(slopes, axis=1), 1, rtol=1e-12)


def test_queries_that_are_not_finite_give_nan_and_no_gradient(x64):  # noqa: F811
    points, _ = torus()
    queries = np.vstack([PLACES[:3], [[np.nan, 0, 0], [np.inf, 0, 0]]])
    distance, pullback = jax.vjp(lambda p, q: ij.query(p, GRID, q), points, queries)
    assert np.isfinite(distance[:3]).all() and np.isnan(distance[3:]).all()
    points_bar, queries_bar = pullback(jnp.ones(5))
    assert np.isfinite(points_bar).all() and np.abs(points_bar).max() > 0
    np.testing.assert_array_equal(queries_bar[3:], 0)


def test_mesh_is_padded_and_counted(dtype):  # noqa: F811
    points, _ = torus(dtype=dtype)
    surface = jax.jit(lambda p: ij.mesh(p, GRID, **SIZES))(points)
    vertices, faces = int(surface.vertex_count), int(surface.face_count)
    assert surface.vertices.dtype == dtype and surface.vertices.shape == (10000, 3)
    assert faces == 2 * vertices and 2000 < faces < 20000, "a torus has Euler number 0"
    used = np.asarray(surface.faces)
    np.testing.assert_array_equal(np.unique(used[:faces]), np.arange(vertices))
    assert not used[faces:].any() and not surface.vertices[vertices:].any()
    np.testing.assert_allclose(volume(points), 2 * np.pi**2 * 0.4**2, rtol=0.02)
    edges = np.sort(np.concatenate([used[:faces, [k, (k + 1) % 3]] for k in range(3)]), axis=1)
    assert (np.unique(edges, axis=0, return_counts=True)[1] == 2).all()


def test_mesh_that_does_not_fit_is_cut_and_counted():
    points, _ = torus(dtype=np.float32)
    whole = ij.mesh(points, GRID, **SIZES)
    sizes = {"max_vertices": 300, "max_faces": 700}
    cut = ij.mesh(points, GRID, **sizes)
    assert cut.vertex_count == whole.vertex_count and cut.face_count == whole.face_count
    np.testing.assert_array_equal(cut.vertices, whole.vertices[:300])
    fits = (whole.faces[:700] < 300).all(axis=1, keepdims=True)
    assert 0 < fits.sum() < 700
    np.testing.assert_array_equal(cut.faces, jnp.where(fits, whole.faces[:700], 0))

    def top(points, sizes):
        return ij.mesh(points, GRID, **sizes).vertices[:300, 2].sum()

    bar = jax.grad(top)(points, sizes)
    np.testing.assert_array_equal(bar, jax.grad(top)(points, SIZES))


def test_gradient_of_the_volume_agrees_with_differences(x64):  # noqa: F811
    points, normals = torus()
    # Steps of 1e-7 of 1,500 points bring a vertex of the surface past a corner of a cell, where the slope changes by 1e-4.
    steps = SMALL_STEPS | {"eps": 1e-8}
    check_grads(lambda p: volume(p, options=FIXED), (points,), **steps)
    given = isograd.Options(radius=0.25, orient="given")
    check_grads(lambda p, n: volume(p, n, given), (points, normals), **steps)


@pytest.mark.parametrize("fill", ["band", "inside"])
def test_extension_is_exact_for_constants_and_zero_off_the_band(fill, dtype):  # noqa: F811
    points, _ = torus(dtype=dtype)
    values = np.ones((len(points), 2), dtype) * np.array([1, -3], dtype)
    sdf, field = jax.jit(lambda p, v: ij.extend(p, v, GRID, band=0.2, fill=fill))(points, values)
    np.testing.assert_array_equal(sdf, ij.signed_distance(points, GRID))
    near = np.abs(sdf) <= 2 * GRID.spacing
    inside = near | (sdf < 0) if fill == "inside" else near
    assert field.shape == (*GRID.shape, 2) and 0.1 < inside.mean() < 0.9 and (~near & (sdf < 0)).sum() > 100
    tolerance = 100 * np.finfo(dtype).eps
    np.testing.assert_allclose(field[inside], np.broadcast_to(values[0], field[inside].shape), rtol=tolerance)
    assert not field[~inside].any()
    flat = ij.extend(points, values[:, 0], GRID, band=0.2, fill=fill).values
    np.testing.assert_array_equal(flat, field[..., 0])


def test_extension_is_linear_and_its_gradients_agree_with_differences(x64):  # noqa: F811
    points, normals = torus()
    values = np.cross([0.0, 0.0, 1.0], points) + 0.1 * RNG.standard_normal(points.shape)
    field_weights = RNG.standard_normal((*GRID.shape, 3))
    sdf_weights = RNG.standard_normal(GRID.shape)

    def linear(values):
        return ij.extend(points, values, GRID).values

    field, pullback = jax.vjp(linear, values)
    inner = jnp.vdot(field, field_weights)
    np.testing.assert_allclose(inner, jnp.vdot(values, pullback(field_weights)[0]), rtol=1e-10)

    def weighted(points, values):
        # With fewer neighbors the fit at a vertex has a radius of its own, which the gradient holds constant. The
        # band ends at a cell or not, a step function of the points, so only cells well inside count.
        options = isograd.Options(radius=0.4)
        sdf, field = ij.extend(points, values, GRID, options=options)
        near = (jnp.abs(sdf) < 2.5 * GRID.spacing)[..., None]
        return (jnp.sum(field_weights * field * near) + jnp.sum(sdf_weights * sdf)) / 1e3

    check_grads(weighted, (points, values), **SMALL_STEPS)


@pytest.mark.parametrize("name", ["query", "mesh", "extend"])
def test_callbacks_and_batches_give_the_same_bits(name, monkeypatch):
    def loss(points, normals, queries):
        if name == "query":
            return jnp.sum(ij.query(points, GRID, queries, normals=normals, options=GIVEN) ** 2)
        if name == "mesh":
            return volume(points, normals)
        return jnp.sum(ij.extend(points, normals, GRID, normals=normals, options=GIVEN).values[..., 0])

    which = (0, 1, 2) if name == "query" else (0, 1)
    clouds = [torus(seed, dtype=np.float32) for seed in range(3)]
    check_batches(jax.grad(loss, which), clouds, monkeypatch, jnp.asarray(PLACES, jnp.float32))


def test_bad_arguments_are_refused():
    points, _ = torus(dtype=np.float32)
    bad = (ValueError, TypeError)
    for queries in (None, [1.0, 2.0, 3.0], points[:, :2], "here", points + 1j):
        with pytest.raises(bad, match="queries"):
            ij.query(points, GRID, queries)
    for size in (0, -1, 2.5, None, True, 2**31):
        with pytest.raises(ValueError, match="max_faces"):
            ij.mesh(points, GRID, max_vertices=10, max_faces=size)
    for values in (points[1:], points[:, :0], 1.0, points[None]):
        with pytest.raises(bad, match="values"):
            ij.extend(points, values, GRID)
    for band in (0, -1.0, np.nan, np.inf, "wide", None):
        with pytest.raises(ValueError, match="band"):
            ij.extend(points, points, GRID, band=band)
    nan = points.copy()
    nan[3] = np.nan
    with pytest.raises((ValueError, jax.errors.JaxRuntimeError), match="sample 3 is not finite"):
        ij.extend(points, nan, GRID).values.block_until_ready()
    for call in (
        lambda: ij.query(nan, GRID, points),
        lambda: ij.mesh(nan, GRID, **SIZES).vertices,
        lambda: ij.extend(nan, points, GRID).values,
    ):
        with pytest.raises((ValueError, jax.errors.JaxRuntimeError), match="point 3 is not finite"):
            call().block_until_ready()
    assert ij.query(points, GRID, points[:0]).shape == (0,)
