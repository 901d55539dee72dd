"""Clouds in files and in the classes of other libraries, recognized by name: none of these libraries is imported."""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping
from types import MappingProxyType
from typing import TYPE_CHECKING, Any, NamedTuple, Protocol

import numpy as np

from . import _core
from ._arrays import floats, known
from ._options import Orient, OrientLike, check_known

if TYPE_CHECKING:
    from numpy.typing import ArrayLike

    class HasPoints(Protocol):
        """A :class:`Cloud`, :class:`Samples`, a point cloud of Open3D, or data of PyVista."""

        @property
        def points(self) -> Any: ...

    class HasVertices(Protocol):
        """A :class:`Mesh`, or a cloud or mesh of trimesh or Open3D."""

        @property
        def vertices(self) -> Any: ...

    class HasPoint(Protocol):
        """A point cloud of Open3D's tensors."""

        @property
        def point(self) -> Any: ...

    class HasVertex(Protocol):
        """A mesh of Open3D's tensors."""

        @property
        def vertex(self) -> Any: ...

    class HasGetPoints(Protocol):
        """Data of VTK."""

        def GetPoints(self) -> Any: ...

    Path = str | os.PathLike[str]
    CloudLike = ArrayLike | Path | HasPoints | HasVertices | HasPoint | HasVertex | HasGetPoints
    """Whatever has points: an array, a path, or an object of one of the libraries below."""


class Input(NamedTuple):
    """Points, and the normals and attributes that came with them."""

    points: object
    """Anything that is an array of points."""
    normals: Callable[[], object] | None = None
    """Returns the normals: some libraries compute them when they are read."""
    attributes: Mapping[str, object] = MappingProxyType({})
    """Values by name, usable or not."""

    def arrays(
        self, normals: object | None, sensors: Any, orient: OrientLike
    ) -> tuple[np.ndarray, np.ndarray | None, np.ndarray | None]:
        """Points, normals and sensors as arrays. Normals that came with the points are used where ``orient`` uses normals,
        and none are given.

        Raises:
            TypeError, ValueError: arrays of another type or shape; normals or sensors that are missing or not used.
        """
        cloud = floats(self.points, "points", (None, 3))
        if normals is None and self.normals is not None and orient in (Orient.GIVEN, Orient.SIGNS):
            normals = self.normals()
        given, places = known(cloud, normals, sensors)
        check_known(orient, given is not None, places is not None)
        return cloud, given, places

    def usable_attributes(self, count: int) -> dict[str, np.ndarray]:
        """The attributes that are ``(count,)`` or ``(count, components)`` numbers."""
        arrays = {name: np.asarray(values) for name, values in self.attributes.items()}
        return {name: array for name, array in arrays.items() if _is_usable(array, count)}


def _is_usable(array: np.ndarray, count: int) -> bool:
    is_number = array.dtype.kind in "fiu" and array.dtype.itemsize <= 8
    return is_number and array.ndim in (1, 2) and len(array) == count and array.size > 0


def read_input(cloud: object) -> Input:
    """The points of a file, of an object of one of the libraries below, or of anything else that is an array.

    Raises:
        FileNotFoundError, OSError, ValueError: as :func:`read_points`; an object without points.
    """
    if isinstance(cloud, Input):
        return cloud
    if isinstance(cloud, (str, os.PathLike)):
        points, normals, attributes, _ = _core.read_geometry(os.fspath(cloud), not_finite="normals")
        return _input(points, normals, dict(attributes))
    for kind in type(cloud).__mro__:
        library = kind.__module__.partition(".")[0]
        reader = _READERS.get(f"{kind.__module__}.{kind.__name__}") or _READERS.get(f"{library}.{kind.__name__}")
        if reader is not None:
            return reader(cloud)
    is_frame = hasattr(cloud, "columns") and hasattr(cloud, "__array__")
    return _from_frame(cloud) if is_frame else Input(cloud)


def _input(points: Any, normals: Any, attributes: Mapping[str, object]) -> Input:
    # Libraries have an empty array for no normals.
    is_given = normals is not None and len(normals) > 0
    return Input(points, (lambda: normals) if is_given else None, attributes)


def _from_samples(samples: Any) -> Input:
    attributes = {} if samples.velocity is None else {"velocity": samples.velocity}
    return _input(samples.points, samples.normals, attributes)


def _from_open3d(cloud: Any) -> Input:
    arrays = getattr(cloud, "point", getattr(cloud, "vertex", None))
    if arrays is not None:
        found = {name: _of_tensor(tensor) for name, tensor in arrays.items()}
        return _input(found.pop("positions", None), found.pop("normals", None), found)
    names = ("points", "normals", "colors")
    if hasattr(cloud, "vertices"):
        names = ("vertices", "vertex_normals", "vertex_colors")
    points, normals, colors = (np.asarray(getattr(cloud, name)) for name in names)
    return _input(points, normals, {"colors": colors})


def _of_tensor(tensor: Any) -> object:
    # That of a device is an error, and the message says what to do.
    return tensor if tensor.is_cuda else tensor.numpy()


def _from_trimesh(cloud: Any) -> Input:
    attributes = dict(getattr(cloud, "vertex_attributes", {}))
    has_normals = hasattr(cloud, "faces")
    return Input(cloud.vertices, (lambda: cloud.vertex_normals) if has_normals else None, attributes)


def _from_vtk(cloud: Any) -> Input:
    points, data = cloud.GetPoints(), cloud.GetPointData()
    if points is None:
        raise ValueError(f"points is a {type(cloud).__name__} without points")
    arrays = [data.GetAbstractArray(i) for i in range(data.GetNumberOfArrays())]
    normals = data.GetNormals()
    attributes = {str(array.GetName()): array for array in arrays if array is not normals}
    return _input(points.GetData(), None if normals is None else np.asarray(normals), attributes)


def _from_frame(frame: Any) -> Input:
    names = {str(name).lower(): name for name in frame.columns}
    if not names.keys() >= {"x", "y", "z"}:
        return Input(frame)

    def take(*wanted: str) -> np.ndarray:
        return np.stack([np.asarray(frame[names.pop(name)]) for name in wanted], axis=1)

    points = take("x", "y", "z")
    normals = take("nx", "ny", "nz") if names.keys() >= {"nx", "ny", "nz"} else None
    return _input(points, normals, {str(name): frame[name] for name in names.values()})


_READERS: dict[str, Callable[[Any], Input]] = {
    "isograd._files.Cloud": lambda cloud: _input(*cloud),
    "isograd._shapes.Samples": _from_samples,
    "isograd._mesh.Mesh": lambda mesh: Input(mesh.vertices),
    "open3d.PointCloud": _from_open3d,
    "open3d.TriangleMesh": _from_open3d,
    "open3d.Tensor": lambda tensor: Input(_of_tensor(tensor)),
    "trimesh.PointCloud": _from_trimesh,
    "trimesh.Trimesh": _from_trimesh,
    "vtkmodules.vtkPolyData": _from_vtk,
    "pyvista.PointSet": _from_vtk,
    "meshio.Mesh": lambda mesh: _input(mesh.points, None, mesh.point_data),
}
"""Readers by class: its module, or the library that it is of, and its name."""
