"""Shapes as JAX functions of their parameters and the time."""

import isograd
import numpy as np
import pytest

jax = pytest.importorskip("jax")
import jax.numpy as jnp  # noqa: E402

FREE = {"fish": ("width2", "amplitude"), "nacelle": ("chord", "incidence"), "torus": ("major", "minor")}


@pytest.fixture(autouse=True)
def double():
    with jax.enable_x64(True):
        yield


def given(name, count=40):
    shape = isograd.Shape(name, **({"amplitude": 0.1} if name == "fish" else {}))
    free = FREE[name]
    samples = shape.sample(count)
    return shape, samples, shape.jax(samples.coordinates, free), np.array([shape.values[key] for key in free])


@pytest.mark.parametrize("name", FREE)
def test_it_gives_the_samples_and_their_velocity(name):
    _, samples, function, values = given(name)
    found = jax.jit(function)(values, 0.0)
    assert np.allclose(found.points, samples.points, atol=1e-12)
    assert np.allclose(found.normals, samples.normals, atol=1e-12)
    wanted = 0 if samples.velocity is None else samples.velocity
    assert np.allclose(found.velocity, wanted, atol=1e-6)


@pytest.mark.parametrize("name", FREE)
@pytest.mark.parametrize("part", ["points", "normals", "velocity"])
def test_its_pullback_agrees_with_differences(name, part):
    _, _, function, values = given(name)
    weights = np.random.default_rng(3).normal(size=(40, 3))

    def loss(values, time):
        return jnp.sum(weights * getattr(function(values, time), part))

    slopes = jax.jit(jax.grad(loss, (0, 1)))(values, 0.3)
    for k in range(len(values)):
        step = 1e-5 * np.eye(len(values))[k]
        change = float(loss(values + step, 0.3) - loss(values - step, 0.3)) / 2e-5
        assert float(slopes[0][k]) == pytest.approx(change, rel=1e-5, abs=1e-5), k
    change = float(loss(values, 0.3 + 1e-5) - loss(values, 0.3 - 1e-5)) / 2e-5
    assert float(slopes[1]) == pytest.approx(change, rel=1e-4, abs=1e-4)


def test_it_scans_over_times_and_maps_over_values():
    _, _, function, values = given("fish")
    times = jnp.linspace(0, 1, 3)
    _, scanned = jax.lax.scan(lambda carry, time: (carry, function(values, time).points), 0, times)
    assert np.array_equal(scanned[1], function(values, times[1]).points)
    mapped = jax.vmap(lambda v: function(v, 0.0).points)(jnp.stack([values, 1.1 * values]))
    assert np.array_equal(mapped[1], function(1.1 * values, 0.0).points)


def test_single_precision_is_the_rounded_double():
    _, _, function, values = given("fish")
    wanted = function(values, 0.25)
    with jax.enable_x64(False):
        found = function(values, 0.25)
        assert found.velocity.dtype == np.float32
        assert np.allclose(found.velocity, wanted.velocity, atol=1e-6)


@pytest.mark.parametrize("free", [("width9",), ("time",), ("width1", "width1")])
def test_parameters_that_cannot_be_free_are_refused(free):
    shape = isograd.Shape("fish")
    with pytest.raises(ValueError, match="width9|time|twice"):
        shape.jax(shape.sample(10).coordinates, free)


def test_values_of_another_number_are_refused():
    _, _, function, _ = given("fish")
    with pytest.raises(ValueError, match="width2, amplitude"):
        function([0.1], 0.0)
