"""Reconstruction of φ, surface and normals from points, and its pullback."""

from __future__ import annotations

import json
from collections.abc import Mapping
from functools import cached_property, partial
from typing import TYPE_CHECKING, Any, Literal

import numpy as np

from . import _convert, _core
from ._arrays import floats
from ._grid import Grid
from ._inputs import read_input
from ._mesh import Mesh
from ._numbers import number
from ._options import Options, check_fill, resolve
from ._progress import Progress, observe
from ._results import Extension, Gradients
from ._settings import check_backend, encode, warn_caller, warn_note
from ._stored import Stored, checksum, compute_again
from ._threads import check_threads

if TYPE_CHECKING:
    import os

    import open3d
    import pyvista
    import trimesh
    import xarray
    from matplotlib.figure import Figure
    from numpy.typing import ArrayLike
    from typing_extensions import Unpack

    from ._inputs import CloudLike
    from ._options import OptionChanges

    from ._files import Cloud


class ReconstructionWarning(UserWarning):
    """The verdict of a reconstruction is ``"check"`` or ``"bad"``; the message has the reasons and what to try."""


class Reconstruction(Stored):
    """Reconstruction of a cloud. Arrays have the type of the points and are copies, which may be modified.

    A pickle has the inputs, and the results that are small or were read before. All else, such as a pullback, is computed
    again when it is needed. On a machine that would give other bits, and after ``orient="previous"``, this is a
    ``RuntimeError``.
    """

    def __init__(
        self, core: _core.Result, grid: Grid, options: Options, backend: str, count: int, dtype: np.dtype
    ) -> None:
        self._core = core
        self._requested = backend
        self._count = count
        self.dtype = dtype
        """float32 or float64: the type of the points."""
        self.grid = grid
        """The grid of φ."""
        self.options = options
        """The options of the reconstruction."""

    def __getstate__(self) -> dict[str, Any]:
        small = ("mesh", "normals", "confidence", "outliers", "iso_value", "surface_grid", "backend", "report")
        state = self._state("sdf", *small)
        if "_inputs" not in state:
            state["_inputs"], state["_checksum"] = self._core.inputs(), checksum(self._core)
        return state

    @cached_property
    def _core(self) -> _core.Result:
        return compute_again(self, self.__dict__["_inputs"], self.__dict__["_checksum"])

    def __repr__(self) -> str:
        verdict = self.verdict or "not checked"
        return f"Reconstruction of {self._count} points on {self.grid.shape} cells, {self.dtype}: {verdict}"

    def _repr_html_(self) -> str:
        return _convert.reconstruction_html(self)

    @cached_property
    def sdf(self) -> np.ndarray:
        """``(nx, ny, nz)`` signed distance φ at the cell centers, in the points' unit, negative inside."""
        return self._core.array("sdf")

    @cached_property
    def indicator(self) -> np.ndarray:
        """Indicator χ, in the shape of the surface's grid: below :attr:`iso_value` inside, above it outside.

        After a sparse solve, the far part of χ on coarse cells.
        """
        return self._core.array("indicator")

    @cached_property
    def surface_grid(self) -> Grid:
        """The grid that the surface was found on: that of :attr:`indicator`, unless the solve was sparse."""
        return Grid(*self._core.surface_grid())

    @cached_property
    def iso_value(self) -> float:
        """The iso-value of the surface."""
        return self._core.iso_value()

    @cached_property
    def mesh(self) -> Mesh:
        """The surface, counter-clockwise seen from outside: with ``trim`` the part near samples, of a ``sheet`` the shell."""
        return Mesh(self._core.array("vertices"), self._core.array("faces"))

    @cached_property
    def closest(self) -> np.ndarray:
        """``(nx, ny, nz)`` uint32: face of :attr:`closest_mesh` closest to each cell; 2**32 - 1 outside the band."""
        return self._core.array("closest")

    @cached_property
    def closest_mesh(self) -> Mesh:
        """The mesh that φ is the distance to: the surface before ``trim``, of a ``sheet`` its middle, else :attr:`mesh`."""
        return Mesh(self._core.array("closest_vertices"), self._core.array("closest_faces"))

    @cached_property
    def normals(self) -> np.ndarray:
        """``(N, 3)`` outward unit normals, in the order of the points."""
        return self._core.array("normals")

    @cached_property
    def confidence(self) -> np.ndarray:
        """``(N,)`` confidence in the side of each normal, from 0 to 1."""
        return self._core.array("confidence")

    @cached_property
    def areas(self) -> np.ndarray:
        """``(N,)`` area that each sample stands for, in unit length²; 1 without area weights."""
        return self._core.array("areas")

    @cached_property
    def cloud(self) -> Cloud:
        """The samples in their order, with :attr:`normals`, ``confidence`` and the given attributes: ``points.ply`` of the
        command line."""
        return _convert.cloud_of(self)

    @cached_property
    def outliers(self) -> np.ndarray:
        """``(M,)`` uint32: indices of the outliers that were left out. Their normals, confidence, areas and gradients are 0."""
        return self._core.array("outliers")

    @cached_property
    def neighbors(self) -> np.ndarray:
        """``(N,)`` number of samples in the neighborhood of each, itself included."""
        return self._core.array("neighbors")

    @cached_property
    def report(self) -> dict[str, Any]:
        """Settings, measurements, timings and warnings, with the names of the command line's ``report.json``."""
        return {"backend": self.backend, **json.loads(self._core.report())}

    @cached_property
    def backend(self) -> str:
        """Name of the backend: ``"cpu"``, or a backend and its device, such as ``"cuda: NVIDIA H100"``."""
        return self._core.backend()

    @property
    def verdict(self) -> Literal["good", "check", "bad"] | None:
        """Whether the result can be trusted; ``None`` where nothing was checked (``checks=False``)."""
        verdict: Literal["good", "check", "bad"] | None = self.report["verdict"]
        return verdict

    @property
    def warnings(self) -> list[str]:
        """Reasons of the verdict, the worst first, each with what to try."""
        return texts(self.report)

    def _warn(self) -> None:
        """Warns the caller unless the verdict is good. Without numbers, so that a time loop repeats the message, which
        Python then shows once."""
        if self.options.checks and self.verdict != "good":
            reasons = "; ".join(f"{w['code']} (try: {w['try']})" for w in self.report["warnings"])
            message = f"the result is {self.verdict}: {reasons}. Numbers: result.report[\"warnings\"]; help: docs/bad-results.md"
            warn_caller(message, ReconstructionWarning)

    def save(self, path: str | os.PathLike[str]) -> None:
        """Writes a result, as the name ends: φ (.vti, .npz), the mesh (.ply, .obj, .stl, .off, .glb, .vtp), the report
        (.json) or slices of φ (.png). Files are written atomically. In PLY and VTP the mesh has the attributes of the cloud.

        A folder, which exists or ends in ``/``, gets what ``isograd reconstruct -o`` writes: ``sdf.vti``, ``mesh.ply``,
        ``points.ply``, ``report.json`` and ``slices.png``.

        Raises:
            ValueError: another ending.
            FileNotFoundError, OSError: an error of the operating system.
        """
        _convert.save_reconstruction(self, path)

    def plot(self, **arguments: Any) -> Figure:
        """Slices of φ with the samples, by matplotlib: a figure, and arguments, of :func:`isograd.viz.slices`. For a view
        in three dimensions, ``result.mesh.plot(points=result.cloud.points)``.

        Raises:
            ImportError: matplotlib is not installed.
        """
        from .viz import slices

        return slices(self.sdf, self.grid, **{"points": self.cloud.points, **arguments})

    def to_pyvista(self, *, cells: bool = False) -> pyvista.ImageData:
        """φ for PyVista, named ``sdf``, as in the VTI file: values at points, which are the centers of the cells, so that
        ``contour([0.0])`` works. With ``cells`` the box of the grid, with values in its cells."""
        return _convert.to_image(self, bool(cells))

    def to_xarray(self) -> xarray.DataArray:
        """φ for xarray, named ``sdf``, with the centers of the cells as coordinates x, y and z."""
        return _convert.to_xarray(self)

    def to_trimesh(self) -> trimesh.Trimesh:
        """:attr:`mesh` for trimesh, vertices and faces in this order."""
        return self.mesh.to_trimesh()

    def to_open3d(self) -> open3d.geometry.TriangleMesh:
        """:attr:`mesh` for Open3D, with normals."""
        return self.mesh.to_open3d()

    def extend(
        self, name: str, band: float, *, fill: Literal["inside", "band"] = "inside"
    ) -> Extension:
        """The attribute ``name`` of the cloud at the vertices of the mesh, and at the cells inside and around it.

        Args:
            name: name of the attribute.
            band: distance from the surface, in the unit of the points, up to which cells get the value at the closest
                surface point.
            fill: ``"inside"``: all cells inside get values, however far from the surface; ``"band"``: only those of the
                band.

        Raises:
            ValueError: an unknown attribute, a band without width, or ``fill="inside"`` with ``options.band``, beyond
                which closest points are unknown.
        """
        inside = check_fill(fill, self.options.band) == "inside"
        core = self._core.extend(str(name), number(band, "band"), inside)
        return Extension(core, str(name), self.grid)

    def pullback(
        self,
        sdf: ArrayLike | None = None,
        *,
        vertices: ArrayLike | None = None,
        normals: ArrayLike | None = None,
        indicator: ArrayLike | None = None,
        areas: ArrayLike | None = None,
        iso_value: float = 0.0,
        extensions: list[tuple[Extension, ArrayLike | None, ArrayLike | None]] | None = None,
    ) -> Gradients:
        """Cotangents of the inputs, from those of any results.

        Args:
            sdf: ``(nx, ny, nz)`` derivative of a loss in φ.
            vertices: ``(V, 3)`` in the vertices of the mesh.
            normals: ``(N, 3)`` in the outward normals.
            indicator: in χ, in its shape; not after a sparse solve.
            areas: ``(N,)`` in the areas.
            iso_value: in the level.
            extensions: triples of an :class:`Extension` and its derivatives in ``vertices`` and ``values``, or ``None``.

        Signs of normals, signs of cells and closest faces are held constant.

        Raises:
            TypeError, ValueError: an array of another type or shape, or one that is not finite.
        """
        shape = self.grid.shape
        given = {
            "sdf": (sdf, shape),
            "indicator": (indicator, shape if indicator is None else self.indicator.shape),
            "vertices": (vertices, (None, 3)),
            "normals": (normals, (self._count, 3)),
            "areas": (areas, (self._count,)),
        }
        bars = {
            name: floats(values, f"the cotangent of {name}", wanted, self.dtype)
            for name, (values, wanted) in given.items()
            if values is not None
        }
        extended = [self._extension(*entry) for entry in extensions or []]
        out = self._core.pullback(bars, number(iso_value, "iso_value"), extended)
        names = [entry[0].name for entry in extensions or []]
        return Gradients(
            points=out["points"],
            normals=out["normals"],
            attributes=dict(zip(names, out["attributes"])),
            lower=out["lower"],
            spacing=out["spacing"],
            guarded=out["guarded"],
        )

    def _extension(
        self, extension: Extension, at_vertices: ArrayLike | None, in_band: ArrayLike | None
    ) -> tuple[Any, np.ndarray | None, np.ndarray | None]:
        if not isinstance(extension, Extension):
            raise TypeError(f"an extension is a {type(extension).__name__}; give what extend() returned")

        def bar(values: ArrayLike | None, like: np.ndarray) -> np.ndarray | None:
            if values is None:
                return None
            return floats(values, f"the cotangent of {extension.name}", like.shape, self.dtype)

        return (
            extension._core,
            bar(at_vertices, extension.vertices),
            bar(in_band, extension.values),
        )


class Reconstructor:
    """A plan for one grid and one set of options: made once, used for every time step.

    Copies and pickles are new plans, without earlier calls.

    Calls reuse its memory. It may be called from several threads at once; each call beyond the first then makes a plan
    of its own. With ``orient="previous"``, call it from one thread at a time: the result depends on the previous calls.
    """

    def __init__(
        self,
        grid: Grid,
        options: Options | None = None,
        *,
        backend: str = "cpu",
        threads: int | None = None,
        **changes: Unpack[OptionChanges],
    ) -> None:
        self.options = resolve(options, changes)
        """Options of the reconstruction."""
        self.grid = grid
        """The grid of all results."""
        self.backend = check_backend(backend)
        """The requested backend."""
        self.threads = None if threads is None else check_threads(threads, "threads")
        """Number of threads of its own, for results and their pullbacks; ``None`` for those of :func:`set_num_threads`."""
        self._plan = _core.Plan(encode(grid, self.options, self.backend), self.threads)
        warn_note(self._plan.take_note())

    def __reduce__(self) -> tuple[Any, ...]:
        return partial(type(self), self.grid, self.options, backend=self.backend, threads=self.threads), ()

    def __call__(
        self,
        points: CloudLike,
        *,
        normals: ArrayLike | None = None,
        sensors: ArrayLike | None = None,
        attributes: Mapping[str, ArrayLike] | None = None,
        progress: Progress | bool | None = None,
    ) -> Reconstruction:
        """See :func:`reconstruct`."""
        result = self._run(points, normals, sensors, attributes, progress)
        result._warn()
        return result

    reconstruct = __call__

    def _run(
        self,
        points: CloudLike,
        normals: ArrayLike | None = None,
        sensors: ArrayLike | None = None,
        attributes: Mapping[str, ArrayLike] | None = None,
        progress: Progress | bool | None = None,
    ) -> Reconstruction:
        """A reconstruction without a warning that its verdict is not good."""
        given = read_input(points)
        cloud, normals, sensors = given.arrays(normals, sensors, self.options.orient)
        if attributes is None:
            attributes = given.usable_attributes(len(cloud))
        with observe(progress) as observer:
            core = self._plan.reconstruct(cloud, normals, sensors, _attributes(attributes, cloud), observer)
        warn_note(self._plan.take_note())
        return Reconstruction(core, self.grid, self.options, self.backend, len(cloud), cloud.dtype)


def reconstruct(
    points: CloudLike,
    grid: Grid | None = None,
    *,
    resolution: int | None = None,
    spacing: float | None = None,
    padding: float | None = None,
    normals: ArrayLike | None = None,
    sensors: ArrayLike | None = None,
    attributes: Mapping[str, ArrayLike] | None = None,
    options: Options | None = None,
    backend: str = "cpu",
    progress: Progress | bool | None = None,
    threads: int | None = None,
    **changes: Unpack[OptionChanges],
) -> Reconstruction:
    """Reconstructs the signed distance field and the surface of a cloud.

    Args:
        points: ``(N, 3)`` samples of the surface; float32 or float64 decides the type of all results. Also the path of a
            file (see :func:`read_points`), a :class:`Cloud`, :class:`Samples`, a point cloud of Open3D, trimesh, PyVista or
            VTK, or a data frame with columns x, y and z; of a mesh, its vertices.
        grid: grid of φ; by default ``Grid.fit(points)``, with the given ``outliers``.
        resolution: of that fitted grid: cells on the longest side, by default 128.
        spacing: of that fitted grid: cell size, in the unit of the points, instead of a resolution.
        padding: of that fitted grid: see :meth:`Grid.fit`.
        normals: ``(N, 3)`` outward normals, only with ``orient="given"`` or ``"signs"``. By default those that came with
            the points, which other orientations ignore: the sides of a scan's normals are often arbitrary.
        sensors: positions of the sensors, only with ``orient="sensors"``: ``(N, 3)`` one for each point, ``(3,)`` one
            for all, or ``(M, 3)`` with another ``M`` where it is unknown which one saw a point.
        attributes: values of the samples, ``(N,)`` or ``(N, components)`` by name, for
            :meth:`Reconstruction.extend`. By default the numbers that came with the points.
        options: options of the reconstruction.
        backend: ``"cpu"``, ``"cuda"`` (``"cuda:1"`` is the second device), ``"vulkan"``, or
            ``"auto"``: a GPU if available, else the CPU with a ``RuntimeWarning`` that gives the reason.
        progress: ``True`` for a bar on standard error (of tqdm, if it is installed), or a function that is called with the
            name of each stage that begins and the fraction of the work before it, and last with ``"done"`` and 1.0. The
            fractions are those of typical clouds: stages take fixed shares of the time. An exception ends the work.
        threads: number of threads of this call, and of the pullback of its result; by default that of
            :func:`set_num_threads`. Results have the same bits for any number.
        changes: single options by name, such as ``orient="given"``.

    Raises:
        TypeError, ValueError: invalid input; the message says what is wrong and what to do.
        FileNotFoundError, OSError: a file that can't be read.
        RuntimeError: an unavailable backend.
        KeyboardInterrupt: at once, on Ctrl-C.

    Warns with :class:`ReconstructionWarning` unless the verdict is good.
    """
    cloud = read_input(points)
    options = resolve(options, changes)
    fitted: dict[str, Any] = {"resolution": resolution, "spacing": spacing, "padding": padding}
    fitted = {name: value for name, value in fitted.items() if value is not None}
    if grid is None:
        grid = Grid.fit(cloud, outliers=options.outliers, **fitted)
    elif fitted:
        raise TypeError(f"grid and {' and '.join(fitted)} are given; leave out grid, or give Grid.fit(points, ...) with them")
    plan = Reconstructor(grid, options, backend=backend, threads=threads)
    return plan(cloud, normals=normals, sensors=sensors, attributes=attributes, progress=progress)


def texts(report: dict[str, Any]) -> list[str]:
    """The warnings of a report, each with what to try."""
    return [f"{warning['text']}; try: {warning['try']}" for warning in report["warnings"]]


def _attributes(
    attributes: Mapping[str, ArrayLike] | None, cloud: np.ndarray
) -> list[tuple[str, int, np.ndarray]]:
    found = []
    for name, values in (attributes or {}).items():
        shape = np.shape(values)
        wanted = (len(cloud),) if len(shape) == 1 else (len(cloud), None)
        array = floats(values, f"attribute {name!r}", wanted, cloud.dtype)
        found.append((str(name), 1 if array.ndim == 1 else array.shape[1], array))
    return found
