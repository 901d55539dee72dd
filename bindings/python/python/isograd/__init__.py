"""Point cloud in, signed distance field out, gradients back.

    >>> import isograd
    >>> points = isograd.sample("sphere", 2000).points
    >>> result = isograd.reconstruct(points, resolution=32)
    >>> gradient = result.pullback(sdf=result.sdf).points   # of the loss Σ φ²/2

φ is negative inside, in the unit of the points, at the centers of the cells; arrays are ``(nx, ny, nz)``, points
``(N, 3)``; float32 stays float32. ``isograd.jax`` and ``isograd.torch`` are differentiable functions of these libraries.
"""

from ._clean import Cleaned, clean
from ._core import __version__
from ._field import FieldGradients, Isosurface, SdfGradients, SdfGrid, isosurface, sdf_grid
from ._files import (
    Cloud,
    read_mesh,
    read_points,
    read_sdf,
    write_mesh,
    write_points,
    write_sdf,
)
from ._fit import Fit, fit
from ._grid import Grid
from ._mesh import Hits, Mesh, query, query_pullback, signed_distance
from ._options import Level, Options, Orient, Outliers, Solve, Splat, Walls
from ._orient import Oriented, orient
from ._reconstruction import (
    Reconstruction,
    ReconstructionWarning,
    Reconstructor,
    reconstruct,
)
from ._results import Extension, Gradients
from ._shapes import Coordinates, Parameter, Samples, Shape, sample, shapes
from ._threads import get_num_threads, set_num_threads
from ._to_file import to_file

__all__ = [
    "Cleaned",
    "Cloud",
    "Coordinates",
    "Extension",
    "FieldGradients",
    "Fit",
    "Gradients",
    "Grid",
    "Hits",
    "Isosurface",
    "Level",
    "Mesh",
    "Options",
    "Orient",
    "Oriented",
    "Outliers",
    "Parameter",
    "Reconstruction",
    "ReconstructionWarning",
    "Reconstructor",
    "Samples",
    "SdfGradients",
    "SdfGrid",
    "Shape",
    "Solve",
    "Splat",
    "Walls",
    "__version__",
    "clean",
    "fit",
    "get_num_threads",
    "isosurface",
    "orient",
    "query",
    "query_pullback",
    "read_mesh",
    "read_points",
    "read_sdf",
    "reconstruct",
    "sample",
    "sdf_grid",
    "set_num_threads",
    "shapes",
    "signed_distance",
    "to_file",
    "write_mesh",
    "write_points",
    "write_sdf",
]
