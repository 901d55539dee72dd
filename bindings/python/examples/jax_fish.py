"""Finds the shape of a fish from its distance field: optax moves parameters, through points and φ and back.

    pip install "isograd[jax]" optax && python jax_fish.py
"""

import isograd
import isograd.jax
import jax
import jax.numpy as jnp
import numpy as np
import optax

NAMES = ("width2", "width4", "height5")
TRUTH = dict(zip(NAMES, (0.056, 0.030, 0.075)))
fish = isograd.Shape("fish")
coordinates = fish.sample(8_000, dtype=np.float32).coordinates  # where on the body, whatever its shape is


def with_parameters(values):
    return fish.replace(**dict(zip(NAMES, np.asarray(values).tolist())))


@jax.custom_vjp
def body(parameters):
    """(3,) parameters → (N, 3) points of the body."""

    def points(values):
        return with_parameters(values).points_at(coordinates)[0].astype(np.float32)

    shape = jax.ShapeDtypeStruct((len(coordinates.patch), 3), jnp.float32)
    return jax.pure_callback(points, shape, parameters)


def body_pullback(parameters, points_bar):
    def pullback(values, bar):
        bars = with_parameters(values).pullback(coordinates, np.asarray(bar))
        return np.array([bars[name] for name in NAMES], np.float32)

    shape = jax.ShapeDtypeStruct(parameters.shape, jnp.float32)
    return (jax.pure_callback(pullback, shape, parameters, points_bar),)


body.defvjp(lambda parameters: (body(parameters), parameters), body_pullback)

# What is known: the field of another fish, from other samples.
sought = isograd.sample("fish", 8_000, seed=2, dtype=np.float32, **TRUTH).points
grid = isograd.Grid.fit(sought, 96)
options = isograd.Options(surface="1x")  # the same cells at every step
target = isograd.jax.signed_distance(sought, grid, options=options)
start = jnp.array([fish.values[name] for name in NAMES], jnp.float32)


def loss(logs):
    error = isograd.jax.signed_distance(body(start * jnp.exp(logs)), grid, options=options) - target
    return jnp.mean((error / grid.spacing) ** 2, where=jnp.abs(target) < 4 * grid.spacing)


optimizer = optax.adam(optax.cosine_decay_schedule(0.05, 40))


@jax.jit
def step(logs, state):
    value, bar = jax.value_and_grad(loss)(logs)
    change, state = optimizer.update(bar, state)
    return optax.apply_updates(logs, change), state, value


logs = jnp.zeros(len(NAMES), jnp.float32)
state, losses = optimizer.init(logs), []
for k in range(40):
    logs, state, value = step(logs, state)
    losses.append(float(value))
    if k % 5 == 0:
        print(f"step {k:2d}  loss {value:.5f} cells²")

found = {name: round(x, 4) for name, x in zip(NAMES, (start * jnp.exp(logs)).tolist())}
print("found", found, "sought", TRUTH)
assert losses[-1] < 0.05 * losses[0], "the loss must fall"
assert all(abs(found[name] / TRUTH[name] - 1) < 0.03 for name in NAMES), "the parameters must be found"
