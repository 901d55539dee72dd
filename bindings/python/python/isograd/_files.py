"""Readers and writers: PLY, PCD, LAS, PTS, XYZ, CSV, OBJ, OFF, STL, GLB, NPY, NPZ, VTP and VTI."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from . import _core
from ._arrays import floats, summary
from ._grid import Grid
from ._mesh import Mesh, as_mesh
from ._reconstruction import _attributes

if TYPE_CHECKING:
    from numpy.typing import ArrayLike

    Path = str | os.PathLike[str]


class Cloud(NamedTuple):
    """Contents of a point file."""

    points: np.ndarray
    """``(N, 3)``, float32 or float64 as in the file."""
    normals: np.ndarray | None
    """``(N, 3)``, unchanged."""
    attributes: dict[str, np.ndarray]
    """``(N, components)`` by name."""

    def __repr__(self) -> str:
        return summary(self)

    def save(self, path: Path) -> None:
        """Writes points, normals and attributes as PLY, NPZ, XYZ, CSV, TXT or PCD, as the name ends; see
        :func:`write_points`."""
        write_points(path, self.points, normals=self.normals, attributes=self.attributes)


def _names(columns: Sequence[str | int] | None) -> list[str] | None:
    return None if columns is None else [str(column) for column in columns]


def read_points(
    path: Path,
    *,
    columns: Sequence[str | int] | None = None,
    normal_columns: Sequence[str | int] | None = None,
    max_memory: int | str | None = None,
    drop_not_finite: bool = False,
) -> Cloud:
    """Reads the points of a file, or the vertices of a mesh.

    Args:
        columns: The columns of x, y and z in a text file, by name or by number from 1. By default they are recognized
            by the names in the header.
        normal_columns: Likewise the columns of the normals.
        max_memory: Memory that reading may take, in bytes or as text such as ``"4G"``. By default 64 times the size of
            the file, at least 64 MiB.
        drop_not_finite: Leaves out points that are not finite or whose normal is not, which are an error otherwise.

    Raises:
        FileNotFoundError, OSError: an error of the operating system.
        ValueError: invalid content, with its line or byte; columns that are not clear; more than ``max_memory``.
    """
    points, normals, attributes, _ = _core.read_geometry(
        os.fspath(path),
        _names(columns),
        _names(normal_columns),
        max_memory,
        not_finite="drop" if drop_not_finite else "refuse",
    )
    return Cloud(points, normals, dict(attributes))


def read_mesh(path: Path, *, max_memory: int | str | None = None) -> Mesh:
    """Reads a triangle mesh; errors and ``max_memory`` as :func:`read_points`, and ValueError for a file without faces."""
    points, _, _, faces = _core.read_geometry(os.fspath(path), max_memory=max_memory, attributes=False, not_finite="normals")
    if len(faces) == 0:
        raise ValueError(f"{os.fspath(path)} has points and no faces; read it with read_points")
    return Mesh(points, faces)


def read_sdf(path: Path, *, max_memory: int | str | None = None) -> tuple[Grid, np.ndarray]:
    """Reads grid and values of a field (VTI or NPZ); errors and ``max_memory`` as :func:`read_points`."""
    lower, spacing, shape, values = _core.read_field(os.fspath(path), max_memory)
    return Grid(lower, spacing, shape), values


def write_points(
    path: Path,
    points: ArrayLike,
    *,
    normals: ArrayLike | None = None,
    attributes: Mapping[str, ArrayLike] | None = None,
) -> None:
    """Writes points (PLY, NPZ, PCD, XYZ or CSV); atomically."""
    cloud = floats(points, "points", (None, 3))
    if normals is not None:
        normals = floats(normals, "normals", cloud.shape, cloud.dtype)
    _core.write_points(os.fspath(path), cloud, normals, _attributes(attributes, cloud))


def write_mesh(path: Path, mesh: Mesh | tuple[ArrayLike, ArrayLike]) -> None:
    """Writes a mesh (PLY, OBJ, STL, OFF, GLB or VTP); atomically."""
    mesh = as_mesh(mesh)
    _core.write_mesh(os.fspath(path), mesh.vertices, mesh.faces)


def write_sdf(path: Path, grid: Grid, sdf: ArrayLike) -> None:
    """Writes a field (VTI or NPZ); atomically."""
    values = floats(sdf, "sdf", grid.shape)
    _core.write_field(os.fspath(path), grid.lower, grid.spacing, grid.shape, values)
