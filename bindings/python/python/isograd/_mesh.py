"""Triangle meshes and distances to them."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from . import _core
from ._arrays import floats, indices

if TYPE_CHECKING:
    from numpy.typing import ArrayLike


@dataclass(frozen=True, eq=False)
class Mesh:
    """Triangles.

    Attributes:
        vertices: ``(V, 3)``, float32 or float64.
        faces: ``(F, 3)`` uint32, counter-clockwise seen from outside.

    Raises:
        TypeError, ValueError: arrays of another type or shape.
    """

    vertices: np.ndarray
    faces: np.ndarray

    def __post_init__(self) -> None:
        object.__setattr__(self, "vertices", floats(self.vertices, "vertices", (None, 3)))
        object.__setattr__(self, "faces", indices(self.faces, "faces", (None, 3)))


class Hits(NamedTuple):
    """Distances of ``M`` points to a mesh."""

    distance: np.ndarray
    """``(M,)`` signed distance, negative inside."""
    gradient: np.ndarray
    """``(M, 3)`` derivative of the distance in the query: a unit vector."""
    point: np.ndarray
    """``(M, 3)`` closest point of the mesh."""
    face: np.ndarray
    """``(M,)`` face of the closest point."""
    barycentric: np.ndarray
    """``(M, 3)`` weights of the corners of that face in the closest point."""


def query(mesh: Mesh | tuple[ArrayLike, ArrayLike], queries: ArrayLike) -> Hits:
    """Exact distances of ``(M, 3)`` points to a mesh, and their closest points.

    The sign is that of the pseudonormal: correct for closed, consistently wound meshes.

    Raises:
        TypeError, ValueError: arrays of another type or shape, or a mesh without faces.
    """
    mesh = as_mesh(mesh)
    points = floats(queries, "queries", (None, 3), mesh.vertices.dtype)
    return Hits(*_core.query_mesh(mesh.vertices, mesh.faces, points))


def signed_distance(mesh: Mesh | tuple[ArrayLike, ArrayLike], queries: ArrayLike) -> np.ndarray:
    """``(M,)`` exact signed distances of ``(M, 3)`` points to a mesh, negative inside; see :func:`query`."""
    return query(mesh, queries).distance


def query_pullback(
    mesh: Mesh | tuple[ArrayLike, ArrayLike], queries: ArrayLike, distance_bar: ArrayLike
) -> tuple[np.ndarray, np.ndarray]:
    """Cotangents of the vertices ``(V, 3)`` and of the queries ``(M, 3)``, from those of the distances ``(M,)``.

    Sign and closest face are held constant: on the medial axis the derivative is one-sided.
    """
    mesh = as_mesh(mesh)
    dtype = mesh.vertices.dtype
    points = floats(queries, "queries", (None, 3), dtype)
    bar = floats(distance_bar, "distance_bar", (len(points),), dtype)
    vertices_bar, points_bar = _core.query_mesh_pullback(mesh.vertices, mesh.faces, points, bar)
    return vertices_bar, points_bar


def as_mesh(mesh: Mesh | tuple[ArrayLike, ArrayLike]) -> Mesh:
    """A mesh from a mesh, or from a pair of vertices and faces."""
    if isinstance(mesh, Mesh):
        return mesh
    if isinstance(mesh, tuple) and len(mesh) == 2:
        return Mesh(*mesh)  # type: ignore[arg-type]
    raise TypeError(f"mesh is a {type(mesh).__name__}; give an isograd.Mesh or (vertices, faces)")
