"""Drag of a swimming fish, held in a flow at Re 300, and its gradient in parameters of the body by one reverse pass.

    pip install "isograd[jax]" jax-cfd==0.2.1 && python flow_fish.py [CELLS_PER_LENGTH [STEPS [POINTS]]]

Parameters -> points at all times -> surface -> φ and velocity at the faces -> flow -> force, and back. The flow is in
JAX; the points, which do not depend on it, are made before, and their cotangents pulled back after.
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
    times = tunnel.dt * np.arange(-1, steps + 1)
    place = np.array([0.5, 0.5, 0.5])
    options = isograd.Options(orient="signs", surface="2x", radius=0.05)

    def at(time, values):
        return fish.replace(time=float(time), **dict(zip(NAMES, values)))

    def motion(values):
        return np.stack([at(time, values).points_at(coordinates)[0] + place for time in times])

    sides = np.stack([at(time, [fish.values[k] for k in NAMES]).points_at(coordinates)[1] for time in times[1:-1]])

    @jax.checkpoint  # keeps the state of each step alone, and computes the rest again
    def step(state, now):
        points, velocity, normals = now
        body = immersed.staggered(points, velocity, grid, normals=normals, options=options, band=3 * grid.spacing)
        return tunnel.step(state, body)

    @jax.jit
    def drag(points):
        velocity = (points[2:] - points[:-2]) / (2 * tunnel.dt)
        _, (force, inner) = jax.lax.scan(step, tunnel.start(), (points[1:-1], velocity, sides))
        return jnp.mean(force[1:, 0] + jnp.diff(inner[:, 0]) / tunnel.dt)

    values = np.array([fish.values[name] for name in NAMES])
    mean, points_bar = jax.jit(jax.value_and_grad(drag))(motion(values))
    slope = np.zeros(len(NAMES))
    for time, bar in zip(times, np.asarray(points_bar)):
        pulled = at(time, values).pullback(coordinates, bar)
        slope += [pulled[name] for name in NAMES]
    print(f"{steps} steps, {count} points, {grid.shape} cells: mean drag {float(mean):.6f}")
    for k, name in enumerate(NAMES):
        way = 1e-7 * values[k] * np.eye(len(NAMES))[k]
        change = float(drag(motion(values + way)) - drag(motion(values - way))) / (2e-7 * values[k])
        print(f"  d drag / d {name} = {slope[k]:+.6f}, by differences {change:+.6f}, ratio {slope[k] / change:.4f}")
        assert abs(slope[k] / change - 1) < 1e-3, name
    assert np.isfinite(points_bar).all()


if __name__ == "__main__":
    main(*map(int, sys.argv[1:]))
