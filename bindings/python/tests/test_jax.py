"""`isograd.jax`: the same bits as without JAX, under every transformation that reverse mode allows."""

import re

import numpy as np
import pure
import pytest

jax = pytest.importorskip("jax", reason="SKIPPED: JAX is not installed")

import isograd  # noqa: E402
import isograd.jax as ij  # noqa: E402
import jax.numpy as jnp  # noqa: E402
from isograd import _core, _settings  # noqa: E402
from jax.test_util import check_grads  # noqa: E402

def torus(seed=0, count=1500, dtype=np.float64):
    """Points on a torus of radii 1 and 0.4 around the z axis, scattered a little along it, and outward normals."""
    k = np.arange(count)
    u = 2 * np.pi * (k * 0.6180339887498949 % 1)
    u += 0.01 * np.random.default_rng(seed).standard_normal(count)
    v = 2 * np.pi * (k + 0.5) / count
    normals = np.stack([np.cos(v) * np.cos(u), np.cos(v) * np.sin(u), np.sin(v)], axis=1)
    centers = np.stack([np.cos(u), np.sin(u), np.zeros(count)], axis=1)
    return (centers + 0.4 * normals).astype(dtype), normals.astype(dtype)


GRID = isograd.Grid(lower=(-1.7, -1.7, -0.7), spacing=0.1, shape=(34, 34, 14))
WEIGHTS = np.random.default_rng(1).standard_normal(GRID.shape)


def in_double(enabled):
    before = jax.config.jax_enable_x64
    jax.config.update("jax_enable_x64", enabled)
    yield
    jax.config.update("jax_enable_x64", before)


@pytest.fixture(params=["float32", "float64"])
def dtype(request):
    """Both number types, each with the mode of JAX that it needs."""
    for _ in in_double(request.param == "float64"):
        yield np.dtype(request.param)


@pytest.fixture
def x64():
    yield from in_double(True)


GIVEN = isograd.Options(orient="given")


def loss(points, normals=None, options=None):
    """A number that depends on φ everywhere; normals are used as they are unless the options say else."""
    options = options or (GIVEN if normals is not None else None)
    phi = ij.signed_distance(points, GRID, normals=normals, options=options)
    return jnp.sum(WEIGHTS.astype(points.dtype) * phi)


def without_jax(points, normals, options):
    """φ and the cotangents of points and normals for the loss, from the functions for NumPy."""
    settings = _settings.encode(GRID, options)
    saved = pure.forward(settings, points, normals)
    bar = WEIGHTS.astype(points.dtype)
    return saved[0], pure.pullback(settings, points, normals, saved, bar)


@pytest.mark.parametrize("orient", ["auto", "given", "signs"])
@pytest.mark.parametrize("by", ["handler", "callback"])
def test_bits_are_those_without_jax(dtype, orient, by, monkeypatch):
    monkeypatch.setenv("ISOGRAD_JAX_CALLBACK", "1" if by == "callback" else "0")
    points, given = torus(dtype=dtype)
    normals = None if orient == "auto" else 2 * given
    options = isograd.Options(orient=orient)
    sdf, (points_bar, *normals_bar) = without_jax(points, normals, options)

    phi = jax.jit(lambda p, n: ij.signed_distance(p, GRID, normals=n, options=options))
    text = phi.lower(points, normals).compile().as_text()
    (called,) = re.findall('custom_call_target="([^"]*)"', text)
    assert called == "isograd_forward" if by == "handler" else "callback" in called
    assert phi(points, normals).dtype == dtype
    np.testing.assert_array_equal(phi(points, normals), sdf)
    which = 0 if normals is None else (0, 1)
    found = jax.jit(jax.grad(lambda p, n: loss(p, n, options), which))(points, normals)
    np.testing.assert_array_equal(found if normals is None else found[0], points_bar)
    if normals is not None:
        np.testing.assert_array_equal(found[1], normals_bar[0])
        assert (np.abs(normals_bar[0]).max() > 0) == (orient == "given")


@pytest.mark.parametrize("with_normals", [False, True])
def test_a_pullback_has_the_same_bits_whatever_ran_since(dtype, with_normals):
    points, normals = torus(dtype=dtype)
    given = (jnp.asarray(normals),) if with_normals else ()
    _, pull = jax.vjp(loss, jnp.asarray(points), *given)
    at_once = pull(dtype.type(1))
    again = pull(dtype.type(1))
    others = (-given[0],) if with_normals else ()
    jax.block_until_ready(loss(jnp.asarray(points), *others) if with_normals else loss(jnp.asarray(points[1:])))
    with pytest.raises((ValueError, jax.errors.JaxRuntimeError), match="every sample must be at least 2 cells inside"):
        jax.block_until_ready(loss(10 * jnp.asarray(points), *given))
    after_others = pull(dtype.type(1))
    for one, two, three in zip(at_once, again, after_others):
        assert np.array_equal(one, two) and np.array_equal(one, three)


def test_the_field_is_the_distance_to_the_torus(x64):
    points, _ = torus(count=6000)
    x, y, z = np.moveaxis(GRID.centers(), -1, 0)
    exact = np.hypot(np.hypot(x, y) - 1, z) - 0.4
    assert np.abs(ij.signed_distance(points, GRID) - exact).max() < 0.25 * GRID.spacing


@pytest.mark.parametrize("with_normals", [False, True])
def test_gradients_agree_with_differences(x64, with_normals):
    points, normals = torus()
    arguments = (points, normals) if with_normals else (points,)
    options = isograd.Options(orient="given" if with_normals else "auto")

    def near(p, n=None):
        phi = ij.signed_distance(p, GRID, normals=n, options=options)
        # Further away, cells may lie between two parts of the surface as close as each other.
        return jnp.sum(WEIGHTS * phi * (abs(phi) < 0.25)) / 1e3

    check_grads(
        near,
        arguments,
        order=1,
        modes=["rev"],
        eps=3e-8,  # on the hollow side of edges the closest face jumps too, by a little
        atol=1e-6,
        rtol=1e-6,
    )


def test_vmap_is_a_loop(dtype):
    clouds = [torus(seed, dtype=dtype) for seed in range(4)]
    points, normals = (jnp.stack(part) for part in zip(*clouds))
    value_and_grad = jax.value_and_grad(loss, argnums=(0, 1))
    loop = [jax.jit(value_and_grad)(p, n) for p, n in zip(points, normals)]
    batch = jax.jit(jax.vmap(value_and_grad))(points, normals)
    nested = jax.jit(jax.vmap(jax.vmap(value_and_grad)))(
        points.reshape(2, 2, -1, 3), normals.reshape(2, 2, -1, 3)
    )
    for k, (_, bars) in enumerate(loop):
        for of_batch, of_nested, bar in zip(batch[1], nested[1], bars):
            np.testing.assert_array_equal(of_batch[k], bar)
            np.testing.assert_array_equal(of_nested[k // 2, k % 2], bar)
    # One of the two the same for all.
    shared = jax.vmap(loss, in_axes=(0, None))(points, normals[0])
    np.testing.assert_array_equal(shared[0], loss(points[0], normals[0]))


def check_batches(gradient, clouds, monkeypatch, *shared):
    """Checks that a batch of clouds, by handlers and by callbacks, has the bits of one cloud after the other.

    ``gradient`` takes points, normals and the shared arrays, and returns nonzero arrays.
    """
    points, normals = (jnp.stack(part) for part in zip(*clouds))
    axes = (0, 0, *(None for _ in shared))
    loop = [jax.jit(gradient)(p, n, *shared) for p, n in zip(points, normals)]
    batch = jax.jit(jax.vmap(gradient, axes))(points, normals, *shared)
    monkeypatch.setenv("ISOGRAD_JAX_CALLBACK", "1")
    jax.clear_caches()
    callback = jax.jit(jax.vmap(gradient, axes))(points, normals, *shared)
    for k, alone in enumerate(loop):
        for part, of_batch, of_callback in zip(alone, batch, callback):
            assert np.abs(part).max() > 0
            np.testing.assert_array_equal(of_batch[k], part)
            np.testing.assert_array_equal(of_callback[k], part)


def test_scan_compiles_once_and_moves_the_points():
    points, normals = torus(dtype=np.float32)
    traced = []

    @jax.jit
    def swim(points, normals):
        def step(points, time):
            traced.append(time)
            drift = 0.02 * jnp.sin(time) * jnp.array([0.0, 0.0, 1.0])
            value, bar = jax.value_and_grad(loss)(points, normals)
            return points + drift.astype(points.dtype), (points, value, bar)

        return jax.lax.scan(step, points, jnp.arange(10.0))

    _, (seen, values, bars) = swim(points, normals)
    swim(points + np.float32(1e-3), normals)
    assert len(traced) == 1 and swim._cache_size() == 1
    assert np.ptp(seen[:, 0, 2]) > 0.03
    step = jax.jit(jax.value_and_grad(loss))
    for k in range(10):
        value, bar = step(seen[k], normals)
        np.testing.assert_allclose(values[k], value, rtol=1e-4)  # XLA sums in another order
        np.testing.assert_array_equal(bars[k], bar)


def test_gradient_through_scan_and_checkpoint(x64):
    points, normals = torus()

    def total(move, inner):
        def step(z, _):
            return z + move, inner(points + jnp.array([0.0, 0.0, 1.0]) * z, normals)

        return jax.lax.scan(step, 0.0, length=3)[1].sum()

    plain = jax.jit(jax.grad(lambda m: total(m, loss)))(0.01)
    kept = jax.jit(jax.grad(lambda m: total(m, jax.checkpoint(loss))))(0.01)
    # Step k is moved by k, so the gradient is the sum of k times that of the field at step k.
    by_hand = sum(k * jax.grad(loss)(points + [0, 0, k * 0.01], normals)[:, 2].sum() for k in (1, 2))
    assert plain == kept
    np.testing.assert_allclose(plain, by_hand, rtol=1e-9)


@pytest.mark.parametrize("by", ["0", "1"])
def test_equal_calls_are_compiled_once(by, monkeypatch, caplog):
    monkeypatch.setenv("ISOGRAD_JAX_CALLBACK", by)
    points, _ = torus(dtype=np.float32)
    jitted = jax.jit(jax.grad(loss))
    compilations = []
    with jax.log_compiles(True):
        jax.clear_caches()
        for shift in (0.0, 0.0, 0.01):
            caplog.clear()
            moved = jnp.asarray(points + np.float32(shift))
            jitted(moved)
            jax.grad(loss)(moved)  # without jit: what is compiled is each operation
            compilations.append(sum("Compiling" in record.message for record in caplog.records))
    assert compilations[0] > 1 and compilations[1:] == [0, 0]
    assert jitted._cache_size() == 1


def test_all_kinds_of_arrays_are_taken(dtype):
    points, _ = torus(dtype=dtype)
    phi = ij.signed_distance(points, GRID)
    np.testing.assert_array_equal(ij.signed_distance(points.tolist(), GRID), phi)
    np.testing.assert_array_equal(ij.signed_distance(np.asfortranarray(points), GRID), phi)
    half = ij.signed_distance(points.astype(np.float16), GRID)
    assert half.dtype == np.float32


BAD_SHAPES = [(3,), (10, 2), (2, 10, 3), (), (0,)]


@pytest.mark.parametrize("shape", BAD_SHAPES)
def test_shapes_are_refused_at_once(shape):
    with pytest.raises(ValueError, match="points has the shape"):
        ij.signed_distance(jnp.zeros(shape), GRID)
    points, _ = torus(dtype=np.float32)
    with pytest.raises(ValueError, match="normals has the shape"):
        ij.signed_distance(points, GRID, normals=jnp.zeros(shape), options=GIVEN)


def test_types_and_options_are_refused_at_once():
    points, normals = torus(dtype=np.float32)
    for bad in (None, "points", object(), points.astype(complex), points > 0):
        with pytest.raises(TypeError):
            ij.signed_distance(bad, GRID)
    with pytest.raises(TypeError, match="isograd.Grid"):
        ij.signed_distance(points, (32, 32, 32))
    with pytest.raises(TypeError, match="isograd.Options"):
        ij.signed_distance(points, GRID, options={"radius": 1})
    with pytest.raises(ValueError, match="there are no normals"):
        ij.signed_distance(points, GRID, options=GIVEN)
    for options in (None, isograd.Options(), isograd.Options(orient="parity")):
        with pytest.raises(ValueError, match="does not use them"):
            ij.signed_distance(points, GRID, normals=normals, options=options)


@pytest.mark.parametrize("by", ["0", "1"])
def test_values_are_refused_with_the_text_of_the_core(by, monkeypatch):
    monkeypatch.setenv("ISOGRAD_JAX_CALLBACK", by)
    points, normals = torus(dtype=np.float32)
    nan, far, huge = points.copy(), points + 3, points.copy()
    nan[3, 1] = np.nan
    huge[:] = 3e38
    on_a_line = np.linspace(-1, 1, 30, dtype=np.float32)[:, None] * np.float32([1, 0, 0])
    settings = _settings.encode(GRID, isograd.Options(checks=False))
    phi = jax.jit(lambda p: ij.signed_distance(p, GRID))
    for bad in (nan, far, huge, points[:0], points[:2], 0 * points, on_a_line):
        with pytest.raises(ValueError) as expected:
            pure.forward(settings, bad)
        with pytest.raises((ValueError, jax.errors.JaxRuntimeError)) as found:
            phi(bad).block_until_ready()
        assert str(expected.value) in str(found.value)
    # The handler still works, and names the cloud of a batch.
    assert np.isfinite(phi(points)).all()
    with pytest.raises((ValueError, jax.errors.JaxRuntimeError), match="cloud 1 of the batch: point 3"):
        jax.block_until_ready(jax.vmap(phi)(jnp.stack([points, nan])))
    with pytest.raises((ValueError, jax.errors.JaxRuntimeError), match="cotangent of φ is not finite"):
        jax.block_until_ready(jax.grad(lambda p: jnp.nan * phi(p)[0, 0, 0])(points))


def test_random_arguments_never_crash():
    rng = np.random.default_rng(7)
    points, normals = torus(count=40, dtype=np.float32)
    refused = 0
    for _ in range(150):
        shape = tuple(rng.integers(0, 5, rng.integers(0, 4)))
        kinds = (np.float16, np.float32, np.float64, np.int8, np.uint64, bool, complex)
        with np.errstate(all="ignore"):
            odd = rng.standard_normal(shape) * 10.0 ** rng.integers(-30, 30)
            odd = odd.astype(kinds[rng.integers(7)])
        arguments = [points, normals]
        arguments[rng.integers(2)] = odd
        try:
            phi = ij.signed_distance(arguments[0], GRID, normals=arguments[1], options=GIVEN)
            assert phi.block_until_ready().shape == GRID.shape
        except (TypeError, ValueError, jax.errors.JaxRuntimeError) as error:
            assert str(error)
            refused += 1
    assert refused > 100


def test_forward_mode_and_second_order_say_that_they_are_missing():
    points, _ = torus(dtype=np.float32)
    with pytest.raises(TypeError, match="forward-mode"):
        jax.jvp(loss, (points,), (points,))
    with pytest.raises((ValueError, TypeError), match="cannot be differentiated|forward-mode|custom_vjp|callback"):
        jax.hessian(lambda s: loss(points * s))(1.0)


def test_targets_check_their_arrays():
    points, _ = torus(dtype=np.float32)
    settings = _settings.encode(GRID, isograd.Options(checks=False))
    phi = np.empty(GRID.shape, np.float32)

    def call(*inputs, outputs=(phi,), name="isograd_forward", settings=settings):
        _core.call_target(name, list(inputs), list(outputs), settings)

    call(points)
    for bad in (points[:, :2], points[0], points.astype(complex), points[::2]):
        with pytest.raises((ValueError, TypeError)):
            call(bad)
    read_only = np.empty(GRID.shape, np.float32)
    read_only.flags.writeable = False
    for outputs in ([], [phi[1:]], [phi.astype(float)], [phi[None]], [phi] * 2, [read_only]):
        with pytest.raises((ValueError, TypeError)):
            call(points, outputs=outputs)
    with pytest.raises(ValueError, match="no target"):
        call(points, name="isograd_else")
    with pytest.raises(ValueError, match="settings"):
        call(points, settings="{}")
