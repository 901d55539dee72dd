"""A flow past bodies, of operators of jax-cfd 0.2.1 and the blend of `isograd.immersed`: host of the examples."""

import jax.numpy as jnp
import numpy as np
from isograd import immersed
from jax_cfd.base import advection, boundaries, diffusion, grids, pressure


class Tunnel:
    """Flow at speed 1 along x in a periodic box, whose last part restores the inflow: a projection method in two stages."""

    offsets = ((1.0, 0.5, 0.5), (0.5, 1.0, 0.5), (0.5, 0.5, 1.0))

    def __init__(self, grid, viscosity, dt, speed=1.0):
        domain = tuple(zip(grid.lower, grid.upper))
        self.cells, self.grid = grid, grids.Grid(grid.shape, domain=domain)
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

    def rates(self, velocity):
        v = self.variables(velocity, self.grid.cell_faces)
        carried = (advection.advect_van_leer(u, v, self.dt) for u in v)
        return tuple(c.data + diffusion.diffuse(u, self.viscosity).data for c, u in zip(carried, v))

    def downhill(self, velocity, p):
        return tuple(u - (jnp.roll(p, -1, k) - p) / self.cells.spacing for k, u in enumerate(velocity))

    def stage(self, velocity, p, rates, body):
        """The velocity before the blend, after it and after the projection, and the pressure."""
        moved = self.downhill(tuple(u + self.dt * r for u, r in zip(velocity, rates)), self.dt * p)
        inflow = (self.speed, 0.0, 0.0)
        predicted = tuple((u + self.fringe * w) / (1 + self.fringe) for u, w in zip(moved, inflow))
        h = self.cells.spacing
        blended = immersed.blend(predicted, body, width=h, spacing=h, boundary="periodic")
        (guess,) = self.variables([jnp.zeros_like(p)], [self.grid.cell_center])
        q = pressure.solve_fast_diag(self.variables(blended, self.grid.cell_faces), guess, self.bc)
        q = getattr(q, "data", q)
        return predicted, blended, self.downhill(blended, q), p + q / self.dt

    def step(self, state, body):
        """One step past a body, which may move: the state, and the force on the body with its inner fluid.

        That on the body alone is larger by the rate of the momentum of the inner fluid, which is returned too.
        """
        *velocity, p = state
        first = self.rates(velocity)
        *_, middle, p = self.stage(velocity, p, first, body)
        second = (0.5 * (a + b) for a, b in zip(first, self.rates(middle)))
        predicted, blended, after, p = self.stage(velocity, p, second, body)
        h = self.cells.spacing
        inner = jnp.stack([u.sum() for u in immersed.inner_momentum(after, body, h)]) * h**3
        return (*after, p), (immersed.loads(predicted, blended, body, spacing=h, dt=self.dt).force, inner)
