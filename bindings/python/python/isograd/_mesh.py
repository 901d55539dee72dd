"""Triangle meshes and distances to them."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from . import _convert, _core, _measure
from ._arrays import cotangent, floats, indices, summary

if TYPE_CHECKING:
    import os

    import open3d
    import pyvista
    import trimesh
    from numpy.typing import ArrayLike


@dataclass(frozen=True, eq=False)
class Mesh:
    """Triangles. Properties are computed at each access, as arrays may be modified.

    Attributes:
        vertices: ``(V, 3)``, float32 or float64.
        faces: ``(F, 3)`` uint32, counter-clockwise seen from outside.

    Raises:
        TypeError, ValueError: arrays of another type or shape. Where a property or method needs a vertex that is not
            there, ValueError with the index of the face.
    """

    vertices: np.ndarray
    faces: np.ndarray

    def __post_init__(self) -> None:
        object.__setattr__(self, "vertices", floats(self.vertices, "vertices", (None, 3)))
        object.__setattr__(self, "faces", indices(self.faces, "faces", (None, 3)))

    def __repr__(self) -> str:
        return summary(self)

    def _repr_html_(self) -> str:
        return _convert.mesh_html(self)

    @property
    def normals(self) -> np.ndarray:
        """``(V, 3)`` unit normals: those of the faces around a vertex, weighted by their angles in it (Thürmer and
        Wüthrich, Computing Vertex Normals from Polygonal Facets, 1998). 0 for a vertex without faces."""
        return _measure.vertex_normals(self.vertices, self.faces).astype(self.vertices.dtype)

    @property
    def face_normals(self) -> np.ndarray:
        """``(F, 3)`` outward unit normals of the faces; 0 for faces without area."""
        return _measure.face_normals(self.vertices, self.faces).astype(self.vertices.dtype)

    @property
    def face_areas(self) -> np.ndarray:
        """``(F,)`` areas of the faces, in unit length²."""
        return _measure.face_areas(self.vertices, self.faces).astype(self.vertices.dtype)

    @property
    def area(self) -> float:
        """Area of all faces, in unit length²."""
        return float(_measure.face_areas(self.vertices, self.faces).sum())

    @property
    def volume(self) -> float:
        """Enclosed volume, in unit length³; positive for faces that are counter-clockwise seen from outside, and not
        meaningful for an open mesh."""
        return _measure.volume(self.vertices, self.faces)

    @property
    def is_closed(self) -> bool:
        """Whether there are faces, and each edge is in exactly two of them, with opposite directions."""
        return _measure.is_closed(self.vertices, self.faces)

    @property
    def bounds(self) -> np.ndarray:
        """``(2, 3)`` lower and upper corner of the box around all vertices; NaN without vertices."""
        if len(self.vertices) == 0:
            return np.full((2, 3), np.nan, self.vertices.dtype)
        return np.stack([self.vertices.min(axis=0), self.vertices.max(axis=0)])

    def components(self) -> np.ndarray:
        """``(F,)`` number of the connected component of each face, from 0 in the order of their first faces. Faces that
        share a vertex belong to one."""
        return _measure.components(self.vertices, self.faces)

    def split(self) -> list[Mesh]:
        """The connected components, open ones too, each with the vertices that its faces name."""
        return [Mesh(*part) for part in _measure.split(self.vertices, self.faces)]

    def keep_largest(self) -> Mesh:
        """The connected component of the largest area: unlike volume, it counts for open components and cavities too."""
        numbers = self.components()
        areas = np.bincount(numbers, _measure.face_areas(self.vertices, self.faces), minlength=1)
        return Mesh(*_measure.compact(self.vertices, self.faces[numbers == areas.argmax()]))

    def contains(self, points: ArrayLike) -> np.ndarray:
        """``(M,)`` whether each of ``(M, 3)`` points is inside, by the sign of :func:`signed_distance`."""
        return signed_distance(self, points) < 0.0

    def save(self, path: str | os.PathLike[str]) -> None:
        """Writes PLY, OBJ, STL, OFF, GLB or VTP, as the name ends; see :func:`write_mesh`."""
        from ._files import write_mesh

        write_mesh(path, self)

    def plot(self, **arguments: Any) -> Any:
        """Shows the surface with PyVista: arguments of :func:`isograd.viz.scene`, and ``screenshot`` for a file.

        Raises:
            ImportError: PyVista is not installed.
        """
        return _convert.plot_mesh(self, **arguments)

    def to_trimesh(self) -> trimesh.Trimesh:
        """A copy for trimesh, vertices and faces in this order."""
        return _convert.to_trimesh(self)

    def to_pyvista(self) -> pyvista.PolyData:
        """A copy for PyVista, vertices and faces in this order."""
        return _convert.to_polydata(self)

    def to_open3d(self) -> open3d.geometry.TriangleMesh:
        """A copy for Open3D, with :attr:`normals` and :attr:`face_normals`."""
        return _convert.to_open3d(self)

    # Names that users of trimesh know.
    vertex_normals = normals
    is_watertight = is_closed
    export = save


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

    def __repr__(self) -> str:
        return summary(self)


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

    Raises:
        TypeError, ValueError: as :func:`query`; cotangents of another shape, or that are not finite.
    """
    mesh = as_mesh(mesh)
    dtype = mesh.vertices.dtype
    points = floats(queries, "queries", (None, 3), dtype)
    bar = cotangent(distance_bar, "distance_bar", (len(points),), dtype)
    vertices_bar, points_bar = _core.query_mesh_pullback(mesh.vertices, mesh.faces, points, bar)
    return vertices_bar, points_bar


def as_mesh(mesh: object) -> Mesh:
    """A mesh from a mesh, from one of trimesh or another object with vertices and faces, or from a pair of these."""
    if isinstance(mesh, Mesh):
        return mesh
    if isinstance(mesh, tuple) and len(mesh) == 2:
        return Mesh(*mesh)
    if hasattr(mesh, "vertices") and hasattr(mesh, "faces"):
        return Mesh(mesh.vertices, mesh.faces)
    raise TypeError(f"mesh is a {type(mesh).__name__}; give an isograd.Mesh, a trimesh.Trimesh or (vertices, faces)")
