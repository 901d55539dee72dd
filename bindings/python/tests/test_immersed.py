"""`isograd.immersed` beside closed forms: kernels, fractions, apertures, links and markers."""

import numpy as np
import pytest

jax = pytest.importorskip("jax", reason="SKIPPED: JAX is not installed")

import isograd  # noqa: E402
import isograd.jax as ij  # noqa: E402
import jax.numpy as jnp  # noqa: E402
from isograd import immersed  # noqa: E402
from jax.test_util import check_grads  # noqa: E402
from test_jax import x64  # noqa: E402, F401

RNG = np.random.default_rng(11)
REVERSE = {"order": 1, "modes": ["rev"], "eps": 1e-6, "atol": 1e-6, "rtol": 1e-6}
D3Q19 = [(i, j, k) for i in (-1, 0, 1) for j in (-1, 0, 1) for k in (-1, 0, 1) if abs(i) + abs(j) + abs(k) in (1, 2)]

# Compiled as a whole, which takes less time than each operation by itself.
volume_fraction = jax.jit(immersed.volume_fraction)
apertures = jax.jit(immersed.apertures, static_argnums=3)


def links(sdf, normal, spacing):
    found = jax.jit(lambda s, n: immersed.links(s, D3Q19, n, spacing))(sdf, normal)
    return immersed.Links(*map(np.asarray, found))


def check_gradients(function, arguments):
    check_grads(jax.jit(function), arguments, **REVERSE)


def directions(count):
    """Random unit vectors, some of them along axes and diagonals of the grid."""
    found = RNG.standard_normal((count, 3))
    found[:6] = np.vstack([np.eye(3), -np.eye(3)])
    found[6:9] = [[1, 1, 0], [0, -1, 1], [1, 1, 1]]
    return found / np.linalg.norm(found, axis=1, keepdims=True)


def integral(function, low, high, steps=20_000):
    """By the midpoint rule."""
    step = (high - low) / steps
    return function(low + step * (np.arange(steps) + 0.5)).sum() * step


def test_moments_are_the_integrals_of_the_kernel(x64):  # noqa: F811
    width = 0.7

    def kernel(s):
        return (1 + np.cos(np.pi * s / width)) / (2 * width)

    for sdf in (-1.0, -0.7, -0.3, 0.0, 0.2, 0.69, 2.0):
        # The fluid begins at s = −φ along the normal.
        low = np.clip(-sdf, -width, width)
        # The midpoint rule is off by the square of its step, 1e-9.
        assert abs(immersed.mu0(sdf, width) - integral(kernel, low, width)) < 1e-8
        assert abs(immersed.mu1(sdf, width) - integral(lambda s: s * kernel(s), low, width)) < 1e-8
    places = jnp.linspace(-0.65, 0.65, 9)
    check_gradients(lambda x: immersed.mu0(x, width), (places,))
    check_gradients(lambda x: immersed.mu1(x, width), (places,))


def test_the_second_order_blend_of_a_linear_flow_is_its_convolution(x64):  # noqa: F811
    grid = isograd.Grid((-1, -1, -1), 0.1, (20, 20, 20))
    normal, slope, width = np.array([2, -1, 2]) / 3, np.array([0.3, -1.2, 0.7]), 0.2
    x = immersed.positions(grid, immersed.FACES)
    own = np.array([0.4, -0.1, 0.2])
    sdf = tuple(p @ normal + 0.05 for p in x)
    body = immersed.Body(sdf, (jnp.broadcast_to(normal, x[0].shape),) * 3, (jnp.broadcast_to(own, x[0].shape),) * 3)
    fluid = tuple(p @ slope + k for k, p in enumerate(x))
    first, second = (immersed.blend(fluid, body, width=width, spacing=0.1, order=order) for order in (1, 2))

    for index in RNG.integers(0, 20, (25, 3)):
        at = tuple(index)
        for k in range(3):
            w, phi = fluid[k][at] - own[k], sdf[k][at]

            def integrand(s):
                return (1 + np.cos(np.pi * s / width)) / (2 * width) * (w + s * (slope @ normal))

            expected = own[k] + integral(integrand, np.clip(-phi, -width, width), width)
            assert abs(second[k][at] - expected) < 1e-7
    assert max(np.abs(a - b).max() for a, b in zip(first, second)) > 0.01
    with pytest.raises(ValueError, match="order"):
        immersed.blend(fluid, body, width=width, spacing=0.1, order=3)
    with pytest.raises(ValueError, match="components"):
        immersed.blend(fluid[:2], body, width=width, spacing=0.1)


def test_differences_are_exact_for_linear_fields_and_periodic_ones_close(x64):  # noqa: F811
    grid = isograd.Grid((0, 0, 0), 0.05, (20, 20, 20))
    x = grid.centers()
    along = jnp.asarray(np.broadcast_to([0.6, 0.0, 0.8], x.shape))
    slope = immersed.derivative(jnp.asarray(x @ [1.0, 2.0, -3.0]), along, 0.05)
    np.testing.assert_allclose(slope, 0.6 - 2.4, rtol=1e-10)
    wave = jnp.sin(2 * np.pi * x[..., 0])
    slope = immersed.derivative(wave, along, 0.05, "periodic")
    # A central difference of a wave is that of the wave times sin(kh)/(kh).
    k = 2 * np.pi
    np.testing.assert_allclose(slope, 0.6 * k * jnp.cos(k * x[..., 0]) * np.sin(k * 0.05) / (k * 0.05), atol=1e-10)
    with pytest.raises(ValueError, match="boundary"):
        immersed.derivative(wave, along, 0.05, "wall")


def test_unit_gradients_are_the_normals_of_a_sphere_and_zero_on_a_plateau(x64):  # noqa: F811
    grid = isograd.Grid((-1.5, -1.5, -1.5), 0.1, (30, 30, 30))
    x = grid.centers() + 0.003
    radius = np.linalg.norm(x, axis=-1)
    found = np.asarray(immersed.unit_gradient(jnp.minimum(radius - 1, 0.3), 0.1))
    near = np.abs(radius - 1) < 0.19
    # The difference is off by h²/6 times a third derivative of order 1.
    np.testing.assert_allclose(found[near], (x / radius[..., None])[near], atol=0.005)
    assert not found[radius > 1.45].any()
    weights = RNG.standard_normal(found.shape)
    slope = jax.jit(jax.grad(lambda f: jnp.sum(weights * immersed.unit_gradient(f, 0.1))))(jnp.minimum(radius - 1, 0.3))
    assert np.isfinite(slope).all()
    check_gradients(lambda f: jnp.sum(weights * immersed.unit_gradient(f, 0.1, "periodic")), (jnp.asarray(radius**2),))


def share_by_inclusion(sdf, normal, spacing):
    """Share of a cube above a plane, by inclusion and exclusion of the corners: exact, without thin directions."""
    m = np.abs(normal) * spacing
    level = sdf + m.sum() / 2
    total = 0.0
    for corner in np.ndindex(*(2,) * len(m)):
        total += (-1) ** sum(corner) * max(level - m @ corner, 0.0) ** len(m)
    return total / np.prod(m) / [1, 1, 2, 6][len(m)]


def test_fractions_and_apertures_of_planes_are_exact(x64):  # noqa: F811
    h = 0.3
    for normal in directions(60)[9:]:
        if np.abs(normal).min() < 0.02:
            continue  # the sum over corners has no digits left
        sdf = RNG.uniform(-0.9, 0.9, 40) * h
        n = np.broadcast_to(normal, (40, 3))
        found = volume_fraction(jnp.asarray(sdf), n, h)
        np.testing.assert_allclose(found, [share_by_inclusion(s, normal, h) for s in sdf], atol=1e-9)
        for axis in range(3):
            inside = np.delete(normal, axis)
            found = apertures(jnp.asarray(sdf), n, h, axis)
            np.testing.assert_allclose(found, [share_by_inclusion(s, inside, h) for s in sdf], atol=1e-9)


@pytest.mark.parametrize("dtype", [np.float32, np.float64])
def test_fractions_of_planes_along_the_grid_are_those_of_the_distance(dtype, x64):  # noqa: F811
    h, sdf = 0.5, np.linspace(-0.4, 0.4, 33).astype(dtype)
    for normal in np.vstack([np.eye(3), -np.eye(3)]).astype(dtype):
        n = np.broadcast_to(normal, (33, 3))
        expected, found = np.clip(0.5 + sdf / h, 0, 1), np.asarray(volume_fraction(sdf, n, h))
        # Directions in the plane count as ε^(1/3) of the normal, where the plane enters and leaves the cell.
        tolerance = 1.1 * np.finfo(dtype).eps ** (1 / 3)
        np.testing.assert_allclose(found, expected, atol=tolerance)
        middle = np.abs(expected - 0.5) < 0.4
        np.testing.assert_allclose(found[middle], expected[middle], atol=200 * np.finfo(dtype).eps)
        axis = int(np.argmax(np.abs(normal)))
        step = np.asarray(apertures(sdf, n, h, axis))
        np.testing.assert_array_equal(step[sdf > 0], 1)
        np.testing.assert_array_equal(step[sdf < 0], 0)
    with pytest.raises(ValueError, match="axis"):
        immersed.apertures(sdf, n, h, 3)


def test_apertures_and_fractions_obey_the_divergence_theorem(x64):  # noqa: F811
    # The faces and the cut close the fluid part of a cell: (A⁺ − A⁻) h² = S n, with the cut S = h³ ∂V/∂φ.
    h = 0.3
    slope = jax.jit(jax.vmap(jax.grad(lambda s, n: immersed.volume_fraction(s, n, h))))
    for normal in directions(30)[6:]:
        sdf = jnp.asarray(RNG.uniform(-0.8, 0.8, 30) * h)
        n = jnp.broadcast_to(jnp.asarray(normal), (30, 3))
        cut = h * slope(sdf, n)
        for axis in range(3):
            high, low = (apertures(sdf + s * normal[axis] * h / 2, n, h, axis) for s in (1, -1))
            # Directions that the plane is nearly parallel to are held at ε^(1/3), 6e-6, of the largest.
            np.testing.assert_allclose(high - low, cut * normal[axis], atol=1e-4)


def test_derivatives_of_fractions_agree_with_differences(x64):  # noqa: F811
    normal, sdf = directions(40)[8:], RNG.uniform(-0.1, 0.1, 32)
    # Equal components, and planes through the center of a cell; for both at once second derivatives jump.
    sdf[1:6] = 0
    normal, sdf = jnp.asarray(normal), jnp.asarray(sdf)
    check_gradients(lambda s, n: immersed.volume_fraction(s, n, 0.3), (sdf, normal))
    for axis in range(3):
        check_gradients(lambda s, n: immersed.apertures(s, n, 0.3, axis), (sdf, normal))
    ugly = jnp.asarray(np.vstack([np.zeros(3), np.eye(3), [1e-12, 1, 0], [1, 1, 0]]))
    for function in (immersed.volume_fraction, lambda *x: immersed.apertures(*x, 0)):
        slope = jax.jit(jax.grad(lambda s, n: jnp.sum(function(s, n, 0.3)), (0, 1)))
        for where in (-1.0, 0.0, 1e-9, 0.15, 1.0):
            bars = slope(jnp.full(len(ugly), where), ugly)
            assert all(np.isfinite(bar).all() for bar in bars)


def test_the_volume_of_a_sphere_converges_at_second_order(x64):  # noqa: F811
    errors = []
    for n in (16, 32, 64):
        grid = isograd.Grid((-1.5, -1.5, -1.5), 3 / n, (n, n, n))
        x = grid.centers() + 0.013
        radius = np.linalg.norm(x, axis=-1, keepdims=True)
        outside = volume_fraction(jnp.asarray(radius[..., 0] - 1), x / radius, grid.spacing)
        errors.append(abs(float((1 - outside).sum()) * grid.spacing**3 / (4 / 3 * np.pi) - 1))
    assert errors[0] > 3.5 * errors[1] > 12 * errors[2] and errors[2] < 1e-3


def test_links_to_a_plane_are_exact_and_to_a_sphere_converge(x64):  # noqa: F811
    for normal in (None, directions(10)[9]):
        grid = isograd.Grid((-1, -1, -1), 0.125, (16, 16, 16))
        way = directions(11)[10]
        sdf = grid.centers() @ way + 0.021
        found = links(sdf, None if normal is None else jnp.broadcast_to(way, (16, 16, 16, 3)), 0.125)
        assert found.is_cut.sum() > 500
        for k, direction in enumerate(D3Q19):
            step = 0.125 * (way @ direction)
            cut = found.is_cut[..., k]
            np.testing.assert_allclose(found.fraction[..., k][cut], (sdf / -step)[cut], rtol=1e-9)
            np.testing.assert_array_equal(found.fraction[..., k][~cut], 1)
    with pytest.raises(ValueError, match="directions"):
        immersed.links(sdf, [(0.5, 0, 0)])
    errors = {False: [], True: []}
    for n in (16, 32):
        h = 3 / n
        x = isograd.Grid((-1.5, -1.5, -1.5), h, (n, n, n)).centers() + 0.01
        radius = np.linalg.norm(x, axis=-1, keepdims=True)
        for curved in errors:
            found = links(jnp.asarray(radius[..., 0] - 1), x / radius if curved else None, h)
            ends = x[..., None, :] + found.fraction[..., None] * h * np.array(D3Q19)
            errors[curved].append(np.abs(np.linalg.norm(ends, axis=-1) - 1)[found.is_cut].max() / h)
    # In cells: first order for the chord, third for the cubic.
    assert errors[False][0] > 1.7 * errors[False][1]
    assert errors[True][0] > 5 * errors[True][1] and errors[True][1] < 0.03 * errors[False][1]


def test_derivatives_of_links_agree_with_differences(x64):  # noqa: F811
    x = isograd.Grid((-1.5, -1.5, -1.5), 0.25, (12, 12, 12)).centers() + 0.013
    weights = RNG.standard_normal((12, 12, 12, len(D3Q19)))

    def loss(center, radius, curved):
        away = jnp.asarray(x) - center
        distance = jnp.linalg.norm(away, axis=-1)
        normal = away / distance[..., None] if curved else None
        return jnp.sum(weights * immersed.links(distance - radius, D3Q19, normal, 0.25).fraction)

    for curved in (False, True):
        check_gradients(lambda c, r: loss(c, r, curved), (jnp.array([0.02, -0.03, 0.01]), jnp.float64(1.0)))


def test_links_that_end_on_the_surface_have_derivatives(x64):  # noqa: F811
    # At the nodes of the second plane φ is 0, or a little less.
    normal = jnp.broadcast_to(jnp.array([-1.0, 0.0, 0.0]), (3, 2, 2, 3))

    def loss(sdf, normal):
        return jnp.sum(immersed.links(sdf, [(1, 0, 0)], normal, 0.5).fraction)

    for normals in (None, normal):
        slopes = []
        for depth in (0.0, 1e-9):
            sdf = jnp.broadcast_to(jnp.array([0.5, -depth, -0.5])[:, None, None], (3, 2, 2))
            slopes.append(jax.grad(loss)(sdf, normals))
        np.testing.assert_allclose(*slopes, atol=1e-6)
        assert (jnp.abs(slopes[0][1]) > 1).all()


def test_markers_of_a_sphere_have_its_area_and_volume(x64):  # noqa: F811
    points = isograd.sample("sphere", 4000).points
    points = points / np.linalg.norm(points, axis=1, keepdims=True)
    grid = isograd.Grid.fit(points, 32)
    spin = np.cross([0.0, 0.0, 2.0], points)

    @jax.jit
    def of(points):
        mesh = ij.mesh(points, grid, max_vertices=30000, max_faces=60000)
        velocity = ij.surface(points, grid, mesh.vertices, values=spin).values
        return immersed.markers(mesh.vertices, mesh.faces, velocity), mesh.face_count

    found, count = of(points)
    assert 8000 < count < 60000 and not found.areas[count:].any()
    # A polyhedron inside the sphere, of faces a sixteenth of its radius long.
    assert abs(found.areas.sum() / (4 * np.pi) - 1) < 0.005
    flux = found.areas[:, None] * found.normals
    np.testing.assert_allclose(flux.sum(axis=0), 0, atol=1e-12)
    assert abs((found.points * flux).sum() / (4 * np.pi) - 1) < 0.01
    used = found.areas > 0
    exact = np.cross([0.0, 0.0, 2.0], found.points)
    assert np.abs(found.velocities - exact)[used].max() < 0.02
    assert immersed.markers(points, [[0, 1, 2]]).velocities is None


def test_derivatives_of_markers_agree_with_differences(x64):  # noqa: F811
    vertices = jnp.asarray(RNG.standard_normal((7, 3)))
    faces = np.array([[0, 1, 2], [2, 3, 4], [4, 5, 6], [0, 0, 0]])
    values = jnp.asarray(RNG.standard_normal((7, 2)))
    weights = [RNG.standard_normal((4, k)) for k in (3, 1, 3, 2)]

    def loss(vertices, values):
        found = immersed.markers(vertices, faces, values)
        return sum(jnp.sum(w * part.reshape(4, -1)) for w, part in zip(weights, found))

    check_gradients(loss, (vertices, values))
