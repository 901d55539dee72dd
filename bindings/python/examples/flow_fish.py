"""Drag of a swimming fish, held in a flow at Re 300, and its gradient in parameters of the body by one reverse pass.

    pip install "isograd[jax]" jax-cfd==0.2.1 && python flow_fish.py [CELLS_PER_LENGTH [STEPS [POINTS]]]

Parameters -> points, normals and velocity at all times -> surface -> φ and velocity at the faces -> flow -> force, and back,
all in JAX.
"""

import sys

import isograd
import jax
import jax.numpy as jnp
import numpy as np
from flow_host.jax_cfd_tunnel import Tunnel
from isograd import immersed

jax.config.update("jax_enable_x64", True)
NAMES = ("width2", "height5", "amplitude")


def main(n=16, steps=4, count=1000):
    grid = isograd.Grid((0.0, 0.0, 0.0), 1 / n, (2 * n, n, n))
    tunnel = Tunnel(grid, 1 / 300, 0.25 / n, speed=0.8)
    fish = isograd.Shape("fish", amplitude=0.1)
    coordinates = fish.sample(count).coordinates  # the same material points at all times
    material = fish.jax(coordinates, NAMES)
    times = tunnel.dt * jnp.arange(steps)
    place = jnp.array([0.5, 0.5, 0.5])
    options = isograd.Options(orient="signs", surface="2x")

    @jax.checkpoint  # keeps the state of each step alone, and computes the rest again
    def step(values, state, time):
        points, normals, velocity = material(values, time)
        body = immersed.staggered(
            place + points, velocity, grid, normals=normals, options=options, band=3 * grid.spacing
        )
        return tunnel.step(state, body)

    @jax.jit
    def drag(values):
        _, (force, inner) = jax.lax.scan(lambda *now: step(values, *now), tunnel.start(), times)
        return jnp.mean(force[1:, 0] + jnp.diff(inner[:, 0]) / tunnel.dt)

    values = np.array([fish.values[name] for name in NAMES])
    mean, slope = jax.jit(jax.value_and_grad(drag))(values)
    print(f"{steps} steps, {count} points, {grid.shape} cells: mean drag {float(mean):.6f}")
    for k, name in enumerate(NAMES):
        # Shorter ones are rounding where the drag hardly depends on the parameter, longer ones meet other triangles.
        way = 3e-7 * values[k] * np.eye(len(NAMES))[k]
        change = float(drag(values + way) - drag(values - way)) / (6e-7 * values[k])
        print(f"  d drag / d {name} = {slope[k]:+.6f}, by differences {change:+.6f}, ratio {slope[k] / change:.4f}")
        assert abs(slope[k] / change - 1) < 1e-3, name


if __name__ == "__main__":
    main(*map(int, sys.argv[1:]))
