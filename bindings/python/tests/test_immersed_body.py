"""`isograd.immersed`: bodies, loads, unions and moving grids beside closed forms of spheres."""

import os
import pathlib

import numpy as np
import pytest

jax = pytest.importorskip("jax", reason="SKIPPED: JAX is not installed")

import isograd  # noqa: E402
import isograd.jax  # noqa: E402
import jax.numpy as jnp  # noqa: E402
from isograd import immersed  # noqa: E402
from jax.test_util import check_grads  # noqa: E402
from test_jax import x64  # noqa: E402, F401

GRID = isograd.Grid((-1.6, -1.6, -1.6), 0.1, (32, 32, 32))
H = GRID.spacing
WIDTH = 1.5 * H
REVERSE = {"order": 1, "modes": ["rev"], "eps": 1e-6, "atol": 1e-6, "rtol": 1e-6}
RNG = np.random.default_rng(13)


def sphere(center, radius, velocity, spin=(0.0, 0.0, 0.0), offsets=immersed.FACES):
    """A rigid sphere in closed form; the velocity is that of the closest point of its surface."""
    center, velocity, spin = (jnp.asarray(x, float) for x in (center, velocity, spin))
    away = [x - center for x in immersed.positions(GRID, offsets)]
    distance = [jnp.linalg.norm(a, axis=-1) for a in away]
    normal = tuple(a / d[..., None] for a, d in zip(away, distance))
    return immersed.Body(
        tuple(d - radius for d in distance), normal, tuple(velocity + jnp.cross(spin, radius * n) for n in normal)
    )


def uniform(velocity, shape=GRID.shape):
    return tuple(jnp.full(shape, float(u)) for u in velocity)


def ball(count=1500, radius=1.0):
    points = isograd.sample("sphere", count).points
    return radius * points / np.linalg.norm(points, axis=1, keepdims=True)


@pytest.mark.parametrize("layout", ["staggered", "collocated"])
def test_the_body_of_a_cloud_is_that_of_its_closed_form(layout, x64):  # noqa: F811
    center, velocity, spin = np.array([0.03, -0.05, 0.02]), np.array([1.0, -2.0, 0.5]), np.array([0.3, 0.1, -0.7])
    unit = ball()
    moving = velocity + np.cross(spin, unit)
    if layout == "staggered":
        offsets = immersed.FACES
        body = jax.jit(lambda p, v: immersed.staggered(p, v, GRID, band=4 * H))(unit + center, moving)
        below = ((0.0, 0.5, 0.5), (0.5, 0.0, 0.5), (0.5, 0.5, 0.0))
        lower = immersed.staggered(unit + center, moving, GRID, below, band=4 * H)
        # The upper face of a cell is the lower face of the next.
        np.testing.assert_allclose(lower.sdf[1][:, 1:], body.sdf[1][:, :-1], atol=1e-12)
    else:
        offsets = immersed.CENTERS
        body = immersed.collocated(unit + center, moving, GRID, band=4 * H)
    exact = sphere(center, 1.0, velocity, spin, offsets)
    for k in range(3):
        near = np.abs(exact.sdf[k]) < 3 * H
        # The surface lies 0.002 inside the sphere, between samples 0.09 apart.
        assert np.abs(body.sdf[k] - exact.sdf[k])[near].max() < 0.006
        assert np.abs(body.velocity[k] - exact.velocity[k])[near].max() < 0.06
        assert (jnp.sum(body.normal[k] * exact.normal[k], axis=-1)[near] > 0.995).all()
        assert not body.velocity[k][exact.sdf[k] > 4.2 * H].any()
    volume = sum((1 - share).sum() for share in immersed.fluid_share(body, WIDTH)) * H**3 / 3
    assert abs(volume / (4 / 3 * np.pi) - 1) < 0.01


@pytest.mark.parametrize("layout", [immersed.staggered, immersed.collocated])
def test_velocities_of_another_shape_are_refused(layout):
    for velocity in (np.ones((1500, 2)), np.ones(1500), 1.0):
        with pytest.raises(ValueError, match=r"velocity has the shape .* must have \(N, 3\)"):
            layout(ball(), velocity, GRID)


def test_the_blend_is_the_fluid_outside_and_the_body_inside(x64):  # noqa: F811
    body = sphere((0, 0, 0), 1.0, (1.0, 2.0, 3.0))
    fluid = tuple(jnp.asarray(RNG.standard_normal(GRID.shape)) for _ in range(3))
    for order in (1, 2):
        blended = immersed.blend(fluid, body, width=WIDTH, spacing=H, order=order)
        for k in range(3):
            outside, inside = body.sdf[k] > WIDTH, body.sdf[k] < -WIDTH
            assert outside.sum() > 10000 and inside.sum() > 1000
            np.testing.assert_allclose(blended[k][outside], fluid[k][outside], atol=1e-14)
            np.testing.assert_allclose(blended[k][inside], k + 1.0, rtol=1e-12)


def test_loads_of_a_stopped_flow_are_those_of_its_momentum(x64):  # noqa: F811
    volume, dt, speed = 4 / 3 * np.pi, 0.01, np.array([0.7, -0.4, 1.1])
    rest = sphere((0.02, 0.01, -0.03), 1.0, (0, 0, 0))
    fluid = uniform(speed)
    blended = immersed.blend(fluid, rest, width=WIDTH, spacing=H, order=1)
    where = immersed.positions(GRID)
    center = jnp.array([0.5, -0.2, 0.3])
    found = immersed.loads(fluid, blended, rest, spacing=H, dt=dt, positions=where, center=center)
    # The smoothed sphere has the volume of a sphere but for (ε/R)² and the sum over cells: 0.6 %.
    np.testing.assert_allclose(found.force, volume * speed / dt, rtol=0.01)
    arm = np.array([0.02, 0.01, -0.03]) - np.asarray(center)
    np.testing.assert_allclose(found.torque, np.cross(arm, volume * speed / dt), rtol=0.02)
    assert found.power == 0 and immersed.loads(fluid, blended, rest, spacing=H, dt=dt).torque is None
    # Fluid that turns rigidly, stopped: the angular momentum of a ball, 8π/15 ω.
    spin = np.array([0.4, -0.2, 0.9])
    turning = tuple(jnp.cross(spin, x)[..., k] for k, x in enumerate(where))
    rest = sphere((0, 0, 0), 1.0, (0, 0, 0))
    blended = immersed.blend(turning, rest, width=WIDTH, spacing=H, order=1)
    found = immersed.loads(turning, blended, rest, spacing=H, dt=dt, positions=where)
    # The second moment of the smoothed ball is larger by 10 (0.36 ε)²/R² of it, 3 %.
    np.testing.assert_allclose(found.torque, 8 * np.pi / 15 * spin / dt, rtol=0.05)
    np.testing.assert_allclose(found.force, 0, atol=1e-6 / dt)


def test_a_body_that_moves_with_the_fluid_has_no_loads_but_its_inner_fluid_counts(x64):  # noqa: F811
    speed, gain, dt = np.array([0.7, -0.4, 1.1]), np.array([0.02, 0.03, -0.01]), 0.01
    body = sphere((0, 0, 0), 1.0, speed)
    blended = immersed.blend(uniform(speed), body, width=WIDTH, spacing=H)
    still = immersed.loads(uniform(speed), blended, body, spacing=H, dt=dt)
    np.testing.assert_allclose([*still.force, still.power], 0, atol=1e-9)
    # Body and fluid gain speed together: the inner fluid gains the momentum that its surface must pass on.
    faster = sphere((0, 0, 0), 1.0, speed + gain)
    before = immersed.inner_momentum(uniform(speed), body, WIDTH)
    after = immersed.inner_momentum(uniform(speed + gain), faster, WIDTH)
    predicted = uniform(speed + gain)
    blended = immersed.blend(predicted, faster, width=WIDTH, spacing=H)
    found = immersed.loads(predicted, blended, faster, spacing=H, dt=dt, inner=(before, after))
    np.testing.assert_allclose(found.force, 4 / 3 * np.pi * gain / dt, rtol=0.01)
    np.testing.assert_allclose(found.power, found.force @ (speed + gain), rtol=1e-9)


def test_the_rate_of_the_distance_is_that_of_a_moving_sphere(x64):  # noqa: F811
    center, velocity, step = np.array([0.1, 0.0, -0.1]), np.array([0.5, -1.0, 0.25]), 1e-5
    rate = immersed.sdf_rate(sphere(center, 1.0, velocity, (0.0, 0.0, 3.0)))
    early, late = (sphere(center + s * step * velocity, 1.0, velocity) for s in (-1, 1))
    for k in range(3):
        near = np.abs(late.sdf[k]) < 4 * H
        difference = (late.sdf[k] - early.sdf[k]) / (2 * step)
        np.testing.assert_allclose(rate[k][near], difference[near], atol=1e-8)


def test_a_union_takes_the_closer_body(x64):  # noqa: F811
    one, two = sphere((-0.6, 0, 0), 0.5, (1, 0, 0)), sphere((0.7, 0.1, 0), 0.6, (0, 2, 0))
    both = immersed.union(one, two)
    for k in range(3):
        np.testing.assert_array_equal(both.sdf[k], np.minimum(one.sdf[k], two.sdf[k]))
        first = one.sdf[k] <= two.sdf[k]
        assert 0.2 < first.mean() < 0.8
        for name in ("normal", "velocity"):
            a, b, c = (getattr(body, name)[k] for body in (one, two, both))
            np.testing.assert_array_equal(c, jnp.where(first[..., None], a, b))
    for whole, part in zip(jax.tree.leaves(immersed.union(one)), jax.tree.leaves(one)):
        np.testing.assert_array_equal(whole, part)
    with pytest.raises(ValueError, match="components"):
        immersed.union()
    with pytest.raises(ValueError, match="components"):
        immersed.union(one, immersed.Body(*(part[:2] for part in two)))


@pytest.mark.skipif(not pathlib.Path("/proc/self/statm").exists(), reason="SKIPPED: memory is read from /proc")
def test_a_thousand_steps_compile_once_and_keep_their_memory():
    grid = isograd.Grid((-1.0, -1.0, -1.0), 0.2, (10, 10, 10))
    points, traced = ball(200, 0.5).astype(np.float32), []
    options = isograd.Options(orient="signs", surface="grid")

    @jax.jit
    def step(time, before):
        traced.append(time)
        moved = points + 0.1 * jnp.sin(time)
        normals = isograd.jax.orient(moved, before)
        body = immersed.staggered(moved, points, grid, normals=normals, options=options)
        return immersed.blend(body.sdf, body, width=0.2, spacing=0.2)[0].sum(), normals

    def resident():
        pages = int(pathlib.Path("/proc/self/statm").read_text().split()[1])
        return pages * os.sysconf("SC_PAGE_SIZE") / 2**20

    normals, sizes = points, []
    for k in range(1000):
        total, normals = step(np.float32(0.01 * k), normals)
        assert np.isfinite(total)
        sizes.append(resident())
    assert len(traced) == 1
    # A leak of one field of 4 kB a step would be 3 MB; allocators return memory in pieces of several.
    assert sizes[-1] < sizes[249] + 2.5, (sizes[0], sizes[249], sizes[-1])


def test_a_window_that_follows_gives_the_body_of_the_whole_grid(x64):  # noqa: F811
    small = isograd.Grid((-0.8, -0.8, -0.8), H, (16, 16, 16))
    points, band = jnp.asarray(ball(600, 0.35)), 3 * H
    # An automatic resolution depends on the numbers of cells.
    options = isograd.Options(surface="2x")

    @jax.jit
    def in_window(center):
        cells = immersed.window(center, small, GRID)
        near = immersed.staggered(points + center - H * cells, points, small, band=band, options=options)
        return immersed.paste(near, cells, small, GRID, band), cells

    seen = set()
    for center in ([0.0, 0.0, 0.0], [0.42, -0.37, 0.11], [-0.61, 0.58, 0.6]):
        center = jnp.array(center)
        found, cells = in_window(center)
        seen.add(tuple(cells.tolist()))
        np.testing.assert_allclose(cells * H, center, atol=0.51 * H)
        whole = immersed.staggered(points + center, points, GRID, band=band, options=options)
        for part, expected in zip(jax.tree.leaves(found), jax.tree.leaves(whole)):
            # The far field of χ depends a little on the walls of its grid.
            np.testing.assert_allclose(part, expected, atol=0.1 * H)
    assert len(seen) == 3
    # Near the walls of the solver's grid the window stops.
    np.testing.assert_array_equal(immersed.window(jnp.array([9.0, -9.0, 0.0]), small, GRID), [8, -8, 0])
    for bad in (
        isograd.Grid((-0.8, -0.8, -0.8), 0.05, (16, 16, 16)),
        isograd.Grid((-0.75, -0.8, -0.8), H, (16, 16, 16)),
        isograd.Grid((-0.8, -0.8, -0.8), H, (16, 16, 33)),
    ):
        with pytest.raises(ValueError, match="small grid"):
            immersed.window(jnp.zeros(3), bad, GRID)
    with pytest.raises(ValueError, match="small grid"):
        immersed.paste(sphere((0, 0, 0), 1.0, (0, 0, 0)), jnp.zeros(3, int), small, GRID, band)


def test_a_blend_in_a_window_is_that_of_the_whole_grid(x64):  # noqa: F811
    small = isograd.Grid((-0.8, -0.8, -0.8), H, (16, 16, 16))
    fluid = tuple(jnp.asarray(np.random.default_rng(k).standard_normal(GRID.shape)) for k in range(3))
    cells = jnp.array([3, -2, 1])

    def of(body, near):
        blended = immersed.blend(near, body, width=H, spacing=H)
        inner = immersed.inner_momentum(near, body, H)
        return blended, immersed.loads(near, blended, body, spacing=H, dt=0.1).force, sum(u.sum() for u in inner)

    center = H * np.array([3, -2, 1])
    whole = sphere(center, 0.35, (0.1, 0.2, 0.3))
    cut = [immersed.crop(part, cells, small, GRID) for part in (whole.sdf, fluid)]
    assert cut[0][0].shape == small.shape
    near = whole._replace(sdf=cut[0], velocity=tuple(v[:16, :16, :16] for v in whole.velocity))  # the same everywhere
    (blended, force, momentum), (parts, found, inner) = of(whole, fluid), of(near, cut[1])
    for expected, part in zip(blended, immersed.insert(fluid, parts, cells, small, GRID)):
        np.testing.assert_allclose(part, expected, atol=1e-14)
    np.testing.assert_allclose(found, force, rtol=1e-12)
    np.testing.assert_allclose(inner, momentum, rtol=1e-12)
    for bad in (lambda: immersed.crop(cut[1], cells, small, GRID), lambda: immersed.insert(fluid, fluid, cells, small, GRID)):
        with pytest.raises(ValueError, match=r"have the shapes .* give those of the grid"):
            bad()
    with pytest.raises(ValueError, match="3 fields and 2 parts"):
        immersed.insert(fluid, parts[:2], cells, small, GRID)


def test_derivatives_of_loads_agree_with_differences_and_a_closed_form(x64):  # noqa: F811
    where = immersed.positions(GRID)
    fluid = tuple(jnp.sin(x[..., 0] + 2 * x[..., 1] - x[..., 2] + k) for k, x in enumerate(where))
    weights = RNG.standard_normal(7)

    def loss(center, radius, velocity):
        body = sphere(center, radius, velocity, (0.1, 0.2, 0.3))
        blended = immersed.blend(fluid, body, width=WIDTH, spacing=H)
        inner = (immersed.inner_momentum(fluid, body, WIDTH), immersed.inner_momentum(blended, body, WIDTH))
        found = immersed.loads(fluid, blended, body, spacing=H, dt=0.1, inner=inner, positions=where)
        return jnp.concatenate([found.force, found.torque, found.power[None]]) @ weights

    check_grads(jax.jit(loss), (jnp.array([0.02, 0.01, -0.03]), jnp.float64(0.9), jnp.array([1.0, 0.5, -0.2])), **REVERSE)

    def stop(radius):
        body = sphere((0.02, 0.01, -0.03), radius, (0, 0, 0))
        blended = immersed.blend(uniform((1, 0, 0)), body, width=WIDTH, spacing=H, order=1)
        return immersed.loads(uniform((1, 0, 0)), blended, body, spacing=H, dt=1.0).force[0]

    # The force is the volume: its derivative in the radius is the area.
    assert abs(jax.jit(jax.grad(stop))(1.0) / (4 * np.pi) - 1) < 0.01


def test_the_derivative_of_a_force_in_every_point_agrees_with_differences(x64):  # noqa: F811
    points = jnp.asarray(ball(1000))
    options = isograd.Options(radius=0.5, orient="given")
    where = immersed.positions(GRID)
    fluid = tuple(1 + 0.3 * jnp.sin(2 * x[..., 1] - x[..., 2] + k) for k, x in enumerate(where))

    def loss(points, velocity):
        # φ jumps in slope on the medial axis, deeper than the width; a small band leaves it out.
        body = immersed.staggered(points, velocity, GRID, normals=ball(1000), options=options, band=3 * H, fill="band")
        blended = immersed.blend(fluid, body, width=WIDTH, spacing=H, order=1)
        return immersed.loads(fluid, blended, body, spacing=H, dt=1.0).force @ jnp.array([1.0, 0.5, -0.7])

    # Velocities jump a little where the triangles change: so small a step seldom meets that.
    steps = {**REVERSE, "eps": 1e-8, "atol": 1e-5, "rtol": 1e-5}
    check_grads(jax.jit(loss), (points, jnp.cross(jnp.array([0.2, 0.1, 1.0]), points)), **steps)
    # Growth alone: the derivative is the integral of the fluid over the area.
    slope = jax.jit(jax.grad(loss))(points, jnp.zeros_like(points))
    growth = float(jnp.sum(slope * points))
    at = ball(20_000)
    speeds = np.stack([1 + 0.3 * np.sin(2 * at[:, 1] - at[:, 2] + k) for k in range(3)], axis=1)
    expected = 4 * np.pi * (speeds @ [1.0, 0.5, -0.7]).mean()
    assert abs(growth / expected - 1) < 0.02, (growth, expected)
