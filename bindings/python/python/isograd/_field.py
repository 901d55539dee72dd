"""Fields of meshes, and meshes of fields."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Literal, NamedTuple

import numpy as np

from . import _core
from ._arrays import cotangent, floats
from ._grid import Grid, as_grid
from ._mesh import Mesh, as_mesh
from ._numbers import number

if TYPE_CHECKING:
    from numpy.typing import ArrayLike


class SdfGradients(NamedTuple):
    """Cotangents of the inputs of :func:`sdf_grid`."""

    vertices: np.ndarray
    """``(V, 3)``."""
    lower: tuple[float, float, float]
    """Of the grid's corner, at fixed vertices."""
    spacing: float
    """Of the grid's cell size, at fixed vertices and corner."""


@dataclass(frozen=True, eq=False)
class SdfGrid:
    """Signed distance of a mesh at every cell center of a grid.

    Attributes:
        sdf: ``(nx, ny, nz)`` signed distance in the unit of the vertices, negative inside.
        closest: ``(nx, ny, nz)`` uint32, the closest face; ``2**32 - 1`` beyond the band.
        sign: how the sign was found. ``"closed"``: every edge has as many faces in one direction as in the other, and
            what is enclosed is inside. ``"winding number"``: the mesh is not closed, or neighboring faces are wound
            against each other; inside is where the generalized winding number is at least ½ in size, and the sign
            changes inside holes without ``sdf`` passing 0.
        mesh: the mesh.
        grid: the grid.
    """

    sdf: np.ndarray
    closest: np.ndarray
    sign: Literal["closed", "winding number"]
    mesh: Mesh
    grid: Grid

    def pullback(self, sdf_bar: ArrayLike) -> SdfGradients:
        """Cotangents of the vertices and the grid, from ``sdf_bar`` ``(nx, ny, nz)``.

        Sign and closest face are held constant; cells beyond the band contribute nothing.

        Raises:
            TypeError, ValueError: an array of another type or shape, or one that is not finite.
        """
        mesh = self.mesh
        bar = cotangent(sdf_bar, "sdf_bar", self.grid.shape, mesh.vertices.dtype)
        cotangents = _core.sdf_of_mesh_pullback(
            mesh.vertices, mesh.faces, _parts(self.grid), self.sdf, self.closest, bar
        )
        return SdfGradients(*cotangents)


def sdf_grid(
    mesh: Mesh | tuple[ArrayLike, ArrayLike], grid: Grid, *, band: float | None = None
) -> SdfGrid:
    """Exact signed distance of a mesh at every cell center of a grid, in the type of the vertices.

    Args:
        mesh: any triangles: they need not share vertices, may intersect, and may be open. A body
            may be wound either way, but all its triangles the same way.
        grid: the grid, such as ``Grid.fit(mesh.vertices, outliers="keep")``.
        band: distance from the surface up to which ``sdf`` is computed, in the unit of the vertices; elsewhere it is this
            distance with the right sign. By default it is computed at every cell.

    Raises:
        TypeError, ValueError: arrays of another type or shape, a vertex that is not finite, a face with an invalid index,
            a mesh without faces, a band that is not a positive length, or a grid that memory can't hold.
        KeyboardInterrupt: at once, on Ctrl-C.
    """
    mesh, grid = as_mesh(mesh), as_grid(grid)
    width = None if band is None else number(band, "band")
    sdf, closest, sign = _core.sdf_of_mesh(mesh.vertices, mesh.faces, _parts(grid), width)
    return SdfGrid(sdf, closest, sign, mesh, grid)


class FieldGradients(NamedTuple):
    """Cotangents of the inputs of :func:`isosurface`."""

    field: np.ndarray
    """``(nx, ny, nz)``."""
    level: float
    """Of the level."""
    lower: tuple[float, float, float]
    """Of the grid's corner, at a fixed field."""
    spacing: float
    """Of the grid's cell size, at a fixed field and corner."""
    guarded: int
    """Number of vertices where the field hardly changes, and the derivative was replaced by a bounded one."""


@dataclass(frozen=True, eq=False)
class Isosurface:
    """Surface of a field.

    Attributes:
        mesh: the surface. Faces are counter-clockwise seen from where the field is above the level.
        grid: the grid of the field.
        level: value of the field at the surface.
        walls: for each axis, whether the surface reaches the low and the high wall of the grid, where it is left open.
    """

    mesh: Mesh
    grid: Grid
    level: float
    walls: tuple[tuple[bool, bool], tuple[bool, bool], tuple[bool, bool]]
    _found: _core.Isosurface = field(repr=False)

    def pullback(self, vertices: ArrayLike) -> FieldGradients:
        """Cotangents of field, level and grid, from those of the vertices ``(V, 3)``. The faces are held constant.

        Raises:
            TypeError, ValueError: an array of another type or shape, or one that is not finite.
        """
        own = self.mesh.vertices
        bar = cotangent(vertices, "vertices", own.shape, own.dtype)
        return FieldGradients(*self._found.pullback(bar))


def isosurface(field: ArrayLike, grid: Grid, level: float = 0.0) -> Isosurface:
    """Surface of a field at a level by marching cubes, in the type of the field: where it is below the level is inside.

    Args:
        field: ``(nx, ny, nz)`` values at the cell centers, such as a signed distance.
        grid: the grid.
        level: value of the field at the surface.

    Raises:
        TypeError, ValueError: an array of another type or shape, a value or a level that is not finite, or a field that is
            nowhere below the level, or everywhere.
        KeyboardInterrupt: at once, on Ctrl-C.
    """
    grid = as_grid(grid)
    values = floats(field, "field", grid.shape)
    value = number(level, "level")
    found = _core.extract_surface(values, _parts(grid), value)
    walls = [(bool(low), bool(high)) for low, high in found.walls()]
    return Isosurface(Mesh(*found.mesh()), grid, value, (walls[0], walls[1], walls[2]), found)


def _parts(grid: Grid) -> tuple[tuple[float, float, float], float, tuple[int, int, int]]:
    return grid.lower, grid.spacing, grid.shape
