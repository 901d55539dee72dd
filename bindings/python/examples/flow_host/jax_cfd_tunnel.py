"""A flow past bodies, with the projection of jax-cfd 0.2.1 and the blend of `isograd.immersed`: host of the examples."""

import jax
import jax.numpy as jnp
import numpy as np
from isograd import immersed
from jax_cfd.base import boundaries, grids, pressure


class Tunnel:
    """Flow at speed 1 along x in a periodic box, whose last part restores the inflow: a projection method in two stages.

    Bodies are given on the cells of `window`, which is all of the box unless given.
    """

    offsets = ((1.0, 0.5, 0.5), (0.5, 1.0, 0.5), (0.5, 0.5, 1.0))

    def __init__(self, grid, viscosity, dt, speed=1.0, window=None):
        domain = tuple(zip(grid.lower, grid.upper))
        self.cells, self.grid = grid, grids.Grid(grid.shape, domain=domain)
        self.near = (np.zeros(3, np.int32), window or grid, grid)
        self.bc = boundaries.periodic_boundary_conditions(3)
        self.viscosity, self.dt, self.speed = viscosity, dt, speed
        x = (grid.centers()[:, :1, :1, 0] - grid.lower[0]) / (grid.upper[0] - grid.lower[0])
        self.fringe = dt * np.sin(np.pi * np.clip((x - 0.85) / 0.15, 0, 1)) ** 2 * 12 / (0.15 * np.ptp(domain[0]))

    def start(self):
        """Three components of the velocity at the faces, and the pressure."""
        still = jnp.zeros(self.cells.shape)
        return still + self.speed, still, still, still

    def variables(self, arrays, offsets):
        return tuple(grids.GridVariable(grids.GridArray(a, o, self.grid), self.bc) for a, o in zip(arrays, offsets))

    def rate(self, velocity, i):
        """Change of component `i` by advection (van Leer's limiter) and diffusion, through the faces around its place."""
        total = 0
        for axis, u in enumerate(velocity):
            u = sum(moved(u, i, 0, 1)) / 2
            a, b, c, d = moved(velocity[i], axis, -1, 2)
            speed = jnp.abs(u)
            slope = limited(c - b, jnp.where(u > 0, b - a, d - c))
            carried = u * (b + c) - speed * (c - b - (1 - speed * self.dt / self.cells.spacing) * slope)
            below, above = moved(carried / 2 - self.viscosity * (c - b) / self.cells.spacing, axis, -1, 0)
            total = total + (below - above) / self.cells.spacing
        return total

    def downhill(self, velocity, p):
        return tuple(u - (jnp.roll(p, -1, k) - p) / self.cells.spacing for k, u in enumerate(velocity))

    def stage(self, velocity, p, rates, body):
        """The velocity near the body before the blend and after it, that after the projection, and the pressure."""
        driven = self.downhill(tuple(u + self.dt * r for u, r in zip(velocity, rates)), self.dt * p)
        inflow = (self.speed, 0.0, 0.0)
        predicted = tuple((u + self.fringe * w) / (1 + self.fringe) for u, w in zip(driven, inflow))
        near = immersed.crop(predicted, *self.near)
        blended = immersed.blend(near, body, width=self.cells.spacing, spacing=self.cells.spacing)
        whole = immersed.insert(predicted, blended, *self.near)
        (guess,) = self.variables([jnp.zeros_like(p)], [self.grid.cell_center])
        q = pressure.solve_fast_diag(self.variables(whole, self.grid.cell_faces), guess, self.bc)
        q = getattr(q, "data", q)
        return near, blended, self.downhill(whole, q), p + q / self.dt

    def step(self, state, body):
        """One step past a body, which may move: the state, and the force on the body with its inner fluid.

        That on the body alone is larger by the rate of the momentum of the inner fluid, which is returned too.
        """
        *velocity, p = state
        first = [self.rate(velocity, i) for i in range(3)]
        *_, middle, p = self.stage(velocity, p, first, body)
        second = [(rate + self.rate(middle, i)) / 2 for i, rate in enumerate(first)]
        predicted, blended, after, p = self.stage(velocity, p, second, body)
        h = self.cells.spacing
        inner = immersed.inner_momentum(immersed.crop(after, *self.near), body, h)
        force = immersed.loads(predicted, blended, body, spacing=h, dt=self.dt).force
        return (*after, p), (force, jnp.stack([u.sum() for u in inner]) * h**3)


def moved(field, axis, first, last):
    """A periodic field moved by `first` to `last` cells down an axis, as parts of one array: slices are quick to reverse."""
    n = field.shape[axis]
    ends = [jax.lax.slice_in_dim(field, low, high, axis=axis) for low, high in ((n + first, n), (0, last))]
    padded = jax.lax.optimization_barrier(jnp.concatenate([ends[0], field, ends[1]], axis))
    return [jax.lax.slice_in_dim(padded, k, k + n, axis=axis) for k in range(last - first + 1)]


def limited(a, b):
    """The harmonic mean of two differences of one sign, 0 otherwise."""
    return (a * jnp.abs(b) + jnp.abs(a) * b) / (jnp.abs(a) + jnp.abs(b) + 1e-12)
