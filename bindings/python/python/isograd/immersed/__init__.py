"""Moving bodies inside flow solvers, in JAX: what stands between φ and a solver, without a solver.

    >>> body = immersed.staggered(points, velocity, grid)
    >>> velocity = immersed.blend(predicted, body, width=grid.spacing, spacing=grid.spacing)
    >>> force = immersed.loads(predicted, velocity, body, spacing=grid.spacing, dt=dt).force

A :class:`Body` has φ, normals and velocities at the places of each velocity component, so that the functions are those of
staggered and collocated solvers alike. It need not come from a cloud: any φ, such as a closed form, will do. All
functions are differentiable, in all arrays, and work inside ``jit``, ``grad``, ``vmap`` and ``scan``.

φ is negative inside, normals point outward, lengths are in the unit of the points, axes are in the order x, y, z.
"""

from ._body import CENTERS, FACES, Body, collocated, positions, sdf_rate, staggered, union
from ._boltzmann import Links, links
from ._fractions import apertures, volume_fraction
from ._kernels import blend, derivative, fluid_share, mu0, mu1, unit_gradient
from ._loads import Loads, inner_momentum, loads
from ._markers import Markers, markers
from ._window import crop, insert, paste, window

__all__ = [
    "CENTERS",
    "FACES",
    "Body",
    "Links",
    "Loads",
    "Markers",
    "apertures",
    "blend",
    "collocated",
    "crop",
    "derivative",
    "fluid_share",
    "inner_momentum",
    "insert",
    "links",
    "loads",
    "markers",
    "mu0",
    "mu1",
    "paste",
    "positions",
    "sdf_rate",
    "staggered",
    "union",
    "unit_gradient",
    "volume_fraction",
    "window",
]
