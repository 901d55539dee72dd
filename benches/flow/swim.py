"""A fish that swims in place in a flow, from a cloud of its points at every step: the host of the page docs/flow.md."""

import sys
from pathlib import Path

import isograd
import jax
import jax.numpy as jnp
import numpy as np
from isograd import immersed

sys.path.insert(0, str(Path(__file__).resolve().parents[2] / "bindings/python/examples"))
from flow_host.jax_cfd_tunnel import Tunnel  # noqa: E402

SPEED, REYNOLDS, AMPLITUDE = 0.8, 300, 0.1
# Corners of the cells around the fish, from its nose in lengths: what it sweeps, and a margin of more than the band.
LOW, HIGH = np.array([-0.15, -0.3, -0.25]), np.array([1.15, 0.3, 0.25])


class Swim:
    """A fish of length 1 in a tunnel of `lengths`, with `n` cells a length, float32 throughout."""

    def __init__(self, n=40, count=4000, lengths=(3, 1, 1), surface="2x", courant=0.25, radius="auto", **shape):
        self.grid = isograd.Grid((0.0, 0.0, 0.0), 1 / n, tuple(round(n * length) for length in lengths))
        self.fish = isograd.Shape("fish", **{"amplitude": AMPLITUDE, **shape})
        self.coordinates = self.fish.sample(count).coordinates  # the same material points at all times
        self.place = np.array([0.4, lengths[1] / 2, lengths[2] / 2])
        low, high = (np.round((self.place + sweep) * n).astype(int) for sweep in (LOW, HIGH))
        self.window = isograd.Grid(tuple(low / n), 1 / n, tuple(map(int, high - low)))
        self.tunnel = Tunnel(self.grid, 1 / REYNOLDS, courant / n, SPEED, self.window)
        self.options = isograd.Options(orient="signs", surface=surface, radius=radius)

    def times(self, first, steps):
        """Times of the points of `steps` steps, one before and one after them included."""
        return self.tunnel.dt * np.arange(first - 1, first + steps + 1)

    def at(self, time, changes=None):
        return self.fish.replace(time=float(time), **(changes or {}))

    def motion(self, first, steps, changes=None):
        """Points `(steps + 2, N, 3)` and normals `(steps, N, 3)`."""
        found = [self.at(time, changes).points_at(self.coordinates) for time in self.times(first, steps)]
        points = np.stack([points + self.place for points, _ in found])
        normals = np.stack([normals for _, normals in found[1:-1]])
        return points.astype(np.float32), normals.astype(np.float32)

    def body(self, points, velocity, normals):
        band = 3 * self.grid.spacing
        return immersed.staggered(points, velocity, self.window, normals=normals, options=self.options, band=band)

    def step(self, state, now):
        return self.tunnel.step(state, self.body(*now))

    def roll(self, state, points, normals, step=None):
        """Steps through all times: the state, and the force on the body alone in each step but the first."""
        velocity = (points[2:] - points[:-2]) / (2 * self.tunnel.dt)
        state, (force, inner) = jax.lax.scan(step or self.step, state, (points[1:-1], velocity, normals))
        return state, force[1:] + jnp.diff(inner, axis=0) / self.tunnel.dt
