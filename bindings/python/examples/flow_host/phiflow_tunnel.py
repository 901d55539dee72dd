"""The tunnel of jax_cfd_tunnel.py with PhiFlow 3.4.0, whose velocities are at the lower faces of the cells."""

import jax.numpy as jnp
import numpy as np
from isograd import immersed
from phi.jax.flow import Box, Solve, StaggeredGrid, advect, diffuse, dual, extrapolation, fluid, math, spatial


class Tunnel:
    """Flow at speed 1 along x in a periodic box, whose last part restores the inflow: a projection method in one stage."""

    offsets = ((0.0, 0.5, 0.5), (0.5, 0.0, 0.5), (0.5, 0.5, 0.0))

    def __init__(self, grid, viscosity, dt, speed=1.0):
        self.cells, self.viscosity, self.dt, self.speed = grid, viscosity, dt, speed
        (x0, *_), (x1, *_) = grid.lower, grid.upper
        box = Box(**{axis: (low, high) for axis, low, high in zip("xyz", grid.lower, grid.upper)})
        self.still = StaggeredGrid(0.0, extrapolation.PERIODIC, box, **dict(zip("xyz", grid.shape)))
        x = (grid.centers()[:, :1, :1, 0] - x0) / (x1 - x0)
        self.fringe = dt * np.sin(np.pi * np.clip((x - 0.85) / 0.15, 0, 1)) ** 2 * 12 / (0.15 * (x1 - x0))

    def start(self):
        """Three components of the velocity at the faces."""
        still = jnp.zeros(self.cells.shape, np.float32)  # PhiFlow switches JAX to double precision
        return still + self.speed, still, still

    def field(self, velocity):
        parts = [math.tensor(u, spatial("x,y,z")) for u in velocity]
        return self.still.with_values(math.stack(parts, dual(vector="x,y,z")))

    def arrays(self, field):
        return tuple(field.values[{"~vector": axis}].native("x,y,z") for axis in "xyz")

    def step(self, velocity, body):
        """One step past a body: the velocity, and the force on the body and on its inner fluid, with the latter's momentum."""
        u, h = self.field(velocity), self.cells.spacing
        moved = diffuse.explicit(advect.mac_cormack(u, u, self.dt), self.viscosity, self.dt)
        inflow = (self.speed, 0.0, 0.0)
        predicted = tuple((u + self.fringe * w) / (1 + self.fringe) for u, w in zip(self.arrays(moved), inflow))
        blended = immersed.blend(predicted, body, width=h, spacing=h, boundary="periodic")
        solve = Solve("CG", 1e-5, 1e-5, rank_deficiency=0)
        after = self.arrays(fluid.make_incompressible(self.field(blended), (), solve)[0])
        inner = jnp.stack([u.sum() for u in immersed.inner_momentum(after, body, h)]) * h**3
        return after, (immersed.loads(predicted, blended, body, spacing=h, dt=self.dt).force, inner)
