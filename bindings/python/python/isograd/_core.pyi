"""The extension module. Arrays must be of one number type, C-contiguous, aligned and of the native byte order;
``isograd._arrays`` makes them so."""

from collections.abc import Callable, Sequence
from os import PathLike
from typing import Any, Literal, TypeAlias, TypedDict, final

import numpy as np
from numpy.typing import NDArray

_Floats: TypeAlias = NDArray[np.float32] | NDArray[np.float64]
_Indices: TypeAlias = NDArray[np.uint32]
_Path: TypeAlias = str | PathLike[str]
_Vector: TypeAlias = tuple[float, float, float]
_Cells: TypeAlias = tuple[int, int, int]
# Name, components, values.
_Attributes: TypeAlias = list[tuple[str, int, _Floats]]

__all__ = [
    "Extension",
    "Isosurface",
    "Plan",
    "Result",
    "Shape",
    "__version__",
    "call_target",
    "check_grid",
    "clean_points",
    "extract_surface",
    "fit_grid",
    "get_num_threads",
    "open_backend",
    "orient",
    "query_mesh",
    "query_mesh_pullback",
    "read_field",
    "read_geometry",
    "run_command",
    "run_fit",
    "sdf_of_mesh",
    "sdf_of_mesh_pullback",
    "set_num_threads",
    "shapes",
    "write_bytes",
    "write_field",
    "write_mesh",
    "write_points",
    "xla_targets",
]

__version__: str

# Grids.

def check_grid(lower: _Vector, spacing: float, shape: _Cells) -> None:
    """Raises ValueError if the grid is invalid."""

def fit_grid(
    points: _Floats,
    resolution: int | None,
    spacing: float | None,
    padding: float,
    outliers: str,
) -> tuple[_Vector, float, _Cells]:
    """Lower corner, spacing and shape of a grid around ``(N, 3)`` points."""

# Reconstruction.

class _Cotangents(TypedDict):
    points: _Floats
    normals: _Floats | None
    attributes: list[_Floats]
    lower: _Vector
    spacing: float
    guarded: int

@final
class Extension:
    """An attribute on the surface and around it."""

    def array(self, name: str) -> NDArray[Any]:
        """A new copy of ``vertices``, ``cells`` or ``values``."""

@final
class Result:
    """Reconstruction of a cloud."""

    def array(self, name: str) -> NDArray[Any]:
        """A new copy of one of the arrays, by name."""

    def inputs(self) -> tuple[_Floats, _Floats | None, _Floats | None, _Attributes]:
        """Points, normals, sensors and attributes of the cloud, as :meth:`Plan.reconstruct` takes them."""

    def iso_value(self) -> float:
        """The iso-value of the surface."""

    def surface_grid(self) -> _Grid:
        """Lower corner, spacing and shape of the surface's grid."""

    def backend(self) -> str:
        """Name of the backend."""

    def report(self) -> str:
        """The report as JSON."""

    def attributes(self) -> list[tuple[str, NDArray[Any]]]:
        """Attributes of the cloud: name and ``(N, components)`` values."""

    def write_slices(self, path: _Path) -> None:
        """Writes slices of φ and the spread of ``|∇φ|`` as PNG, as the command line does."""

    def write_mesh(self, path: _Path) -> list[str]:
        """Writes the mesh with the attributes of the cloud, as the command line does. Returns why attributes were left
        out."""

    def pullback(
        self,
        bars: dict[str, _Floats],
        iso_value: float,
        extensions: Sequence[tuple[Extension, NDArray[Any] | None, NDArray[Any] | None]],
    ) -> _Cotangents:
        """Cotangents of the inputs, by name, from those of the results, by name."""

    def extend(self, name: str, band: float, inside: bool) -> Extension:
        """The attribute ``name`` of the cloud up to the distance ``band`` from the surface, on both sides or outside."""

@final
class Plan:
    """A plan for one grid and one set of options, in either number type."""

    def __new__(cls, settings: str, threads: int | None = None) -> Plan: ...
    def reconstruct(
        self,
        points: _Floats,
        normals: _Floats | None,
        sensors: _Floats | None,
        attributes: _Attributes,
        progress: Callable[[str], object] | None = None,
    ) -> Result:
        """Reconstructs a cloud: ``points``, ``normals`` and ``sensors`` of one type. ``progress`` is called with the name
        of each stage, before it."""

    def take_note(self) -> str | None:
        """Why ``"auto"`` selected the CPU; once."""

def orient(
    points: _Floats,
    normals: _Floats | None,
    sensors: _Floats | None,
    options: str,
) -> tuple[_Floats, _Floats, str]:
    """Outward normals, confidence and report (JSON) of a cloud: ``points``, ``normals`` and ``sensors`` of one type.
    ``options`` is the JSON text of options, of which ``radius`` and ``orient`` are used."""

def open_backend(settings: str, double: bool) -> str | None:
    """Makes the plan of these settings, in either number type. Returns why the CPU computes, where ``backend`` is
    ``"auto"``."""

# Meshes.

def query_mesh(vertices: _Floats, faces: _Indices, queries: _Floats) -> list[NDArray[Any]]:
    """Distance, gradient, closest point, face and barycentric coordinates of each of ``(M, 3)`` queries."""

def query_mesh_pullback(
    vertices: _Floats, faces: _Indices, queries: _Floats, distance_bar: _Floats
) -> list[_Floats]:
    """Cotangents of vertices and queries from those of the distances."""

# Fields of meshes, and meshes of fields.

_Grid: TypeAlias = tuple[_Vector, float, _Cells]

def sdf_of_mesh(
    vertices: _Floats, faces: _Indices, grid: _Grid, band: float | None
) -> tuple[_Floats, _Indices, Literal["closed", "winding number"]]:
    """φ ``(nx, ny, nz)``, the closest faces, and how the sign was found."""

def sdf_of_mesh_pullback(
    vertices: _Floats,
    faces: _Indices,
    grid: _Grid,
    sdf: _Floats,
    closest: _Indices,
    sdf_bar: _Floats,
) -> tuple[_Floats, _Vector, float]:
    """Cotangents of vertices, lower corner and spacing."""

@final
class Isosurface:
    """Surface of a field."""

    def mesh(self) -> tuple[_Floats, _Indices]:
        """Vertices and faces."""

    def walls(self) -> list[list[bool]]:
        """Whether the surface reaches the low and the high wall of each axis."""

    def pullback(self, vertices_bar: _Floats) -> tuple[_Floats, float, _Vector, float, int]:
        """Cotangents of field, level, lower corner and spacing; number of bounded derivatives."""

def extract_surface(field: _Floats, grid: _Grid, level: float) -> Isosurface:
    """Extracts the surface of a field."""

# Clouds.

class _Steps(TypedDict):
    drop_not_finite: bool
    duplicates: float | None
    statistical: tuple[int, float] | None
    radius: tuple[float, int] | None
    voxel: float | None
    poisson_disk: float | None

def clean_points(points: _Floats, steps: _Steps) -> tuple[_Indices, list[tuple[str, int]]]:
    """Indices of the samples kept, and the number that each step removed."""

# Shapes.

@final
class Shape:
    """A shape with its parameters."""

    def __new__(cls, name: str, values: list[tuple[str, float]]) -> Shape: ...
    def name(self) -> str: ...
    def parameters(self) -> list[tuple[str, str, str, float, float, float, bool]]:
        """Name, meaning, unit, default, least, greatest, whether whole."""

    def values(self) -> list[tuple[str, float]]: ...
    def area(self) -> float: ...
    def volume(self) -> float: ...
    def sample(
        self, n: int, seed: int, even: bool, density: tuple[int, float] | None, single: bool
    ) -> tuple[_Floats, _Floats, _Floats | None, _Indices, NDArray[np.float64]]:
        """Points, normals, velocity, patches, and coordinates ``(N, 2)`` on them."""

    def points_at(
        self, patch: _Indices, uv: NDArray[np.float64]
    ) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Material points, and their normals, at coordinates."""

    def pullback(
        self, patch: _Indices, uv: NDArray[np.float64], points_bar: _Floats
    ) -> list[float]:
        """Cotangents of all parameters, in order."""

def shapes() -> list[tuple[str, str]]:
    """Names and summaries of all shapes."""

# Fits.

def run_fit(
    options: str,
    target: Sequence[NDArray[Any]],
    shape: Shape | None,
    points: _Floats | None,
    callback: Callable[[str], bool | None] | None,
) -> tuple[
    str, str, str | None, str, list[tuple[str, float]], _Floats, _Floats, _Floats, _Indices
]:
    """Outcome, name of the backend, why ``"auto"`` selected the CPU, history as JSON, names and values of the shape,
    points, φ, vertices, faces.

    ``options`` is a JSON text; ``target`` is φ, ``(vertices, faces)`` or points, according to its ``kind``."""

# Threads.

def set_num_threads(n: int) -> None:
    """Starts ``n`` threads for all work that begins later."""

def get_num_threads() -> int:
    """Number of threads of the work. Starts none."""

# XLA.

def xla_targets() -> dict[str, dict[str, object]]:
    """``{platform: {name: capsule}}`` for ``jax.ffi.register_ffi_target``."""

def call_target(
    name: str,
    inputs: Sequence[NDArray[Any]],
    outputs: Sequence[NDArray[Any]],
    settings: str,
    band: float | None = None,
    inside: bool = False,
) -> None:
    """Calls a target with NumPy arrays, and writes its results into ``outputs``: float32, float64 or uint32, in C
    order."""

def call_target_on_cuda(
    name: str,
    inputs: Sequence[tuple[int, Sequence[int], str]],
    outputs: Sequence[tuple[int, Sequence[int], str]],
    stream: int,
    settings: str,
    band: float | None = None,
    inside: bool = False,
) -> None:
    """Calls a target with arrays on a CUDA device, each as its address, its shape and the name of its type. Built with
    CUDA only."""

# Command line.

def run_command(arguments: Sequence[str]) -> int:
    """Runs a command line, the first argument of which is the name of the program, and returns the exit status."""

# Files.

def read_geometry(
    path: _Path,
    columns: Sequence[str] | None = None,
    normal_columns: Sequence[str] | None = None,
    max_memory: int | str | None = None,
    attributes: bool = True,
    not_finite: str = "refuse",
) -> tuple[_Floats, _Floats | None, list[tuple[str, _Floats]], _Indices]:
    """Points, normals, attributes by name, and faces of a file, in its number type. Points and normals that are not finite
    are refused; ``"normals"`` keeps the normals, and ``"drop"`` leaves out the points."""

def read_field(
    path: _Path, max_memory: int | str | None = None
) -> tuple[_Vector, float, _Cells, _Floats]:
    """Lower corner, spacing, shape and values of a field, in its number type."""

def write_points(
    path: _Path, points: _Floats, normals: _Floats | None, attributes: _Attributes
) -> None:
    """Writes points, with normals and attributes."""

def write_mesh(path: _Path, vertices: _Floats, faces: _Indices) -> None:
    """Writes a mesh."""

def write_bytes(path: _Path, content: bytes) -> None:
    """Writes a file of these bytes; atomically."""

def write_field(
    path: _Path, lower: _Vector, spacing: float, shape: _Cells, values: _Floats
) -> None:
    """Writes a field."""

