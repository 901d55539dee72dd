"""Files, plots and objects of other libraries from results. Each library is imported by the function that needs it."""

from __future__ import annotations

import base64
import importlib
import io
import json
import os
import pathlib
from html import escape
from typing import TYPE_CHECKING, Any

import numpy as np

from . import _core, _measure
from ._settings import warn_caller

if TYPE_CHECKING:
    import open3d
    import pyvista
    import trimesh
    import xarray

    from ._files import Cloud
    from ._mesh import Mesh
    from ._reconstruction import Reconstruction

    Path = str | os.PathLike[str]

FIELD_SUFFIXES = (".vti", ".npz")
VERDICT_COLORS = {"good": "green", "check": "darkorange", "bad": "firebrick"}


def require(module: str, caller: str, package: str) -> Any:
    """A module of an optional library.

    Raises:
        ImportError: it can't be imported; the message has the command that installs ``package``.
    """
    try:
        return importlib.import_module(module)
    # OSError: a shared library of the system is missing.
    except (ImportError, OSError) as error:
        library = module.partition(".")[0]
        raise ImportError(f"{caller} needs {library} ({error}); `pip install {package}`") from error


def save_reconstruction(result: Reconstruction, path: Path) -> None:
    """Writes one result, as the name ends, or all of them into a folder: see :meth:`Reconstruction.save`."""
    from ._files import write_sdf

    name = os.fspath(path)
    is_folder = os.path.isdir(name) or name.endswith(("/", os.sep))
    suffix = pathlib.Path(name).suffix.lower()
    if is_folder:
        _save_folder(result, pathlib.Path(name))
    elif suffix in FIELD_SUFFIXES:
        write_sdf(name, result.grid, result.sdf)
    elif suffix == ".json":
        _core.write_bytes(name, _report_text(result).encode())
    elif suffix == ".png":
        result._core.write_slices(name)
    else:
        try:
            _save_surface(result, name)
        except ValueError as error:
            raise ValueError(
                f"{error} for the mesh, {' or '.join(FIELD_SUFFIXES)} for φ, .json for the report or .png for slices; "
                "for all of them give a folder, which exists or ends in /"
            ) from None


def _save_surface(result: Reconstruction, path: str) -> None:
    """Writes the mesh, with the attributes of the cloud where the format holds them."""
    inputs = result.__dict__.get("_inputs")
    if inputs is not None and not inputs[-1]:
        # A reconstruction that was unpickled has its mesh, and is not computed again for attributes that it lacks.
        result.mesh.save(path)
        return
    for omitted in result._core.write_mesh(path):
        warn_caller(omitted, UserWarning)


def _save_folder(result: Reconstruction, folder: pathlib.Path) -> None:
    """Writes what ``isograd reconstruct -o`` writes, with the same names."""
    if folder.exists() and not folder.is_dir():
        raise NotADirectoryError(f"{folder} is a file; give a folder")
    folder.mkdir(parents=True, exist_ok=True)
    for name in ("mesh.ply", "sdf.vti", "slices.png", "report.json"):
        save_reconstruction(result, folder / name)
    result.cloud.save(folder / "points.ply")


def _report_text(result: Reconstruction) -> str:
    """The report as JSON, with the parts that ``report.json`` of the command has besides."""
    report = dict(result.report)
    grid = result.grid
    head = {
        "version": _core.__version__,
        "backend": report.pop("backend"),
        "input": {"points": report.pop("points")},
        "grid": {"shape": grid.shape, "origin": grid.origin, "spacing": grid.spacing},
    }
    return json.dumps(head | report, indent=2, ensure_ascii=False) + "\n"


def cloud_of(result: Reconstruction) -> Cloud:
    """The samples with their outward normals, ``confidence`` and attributes."""
    from ._files import Cloud

    given = dict(result._core.attributes())
    attributes = {"confidence": result.confidence[:, None]}
    attributes |= {name: values for name, values in given.items() if name != "confidence"}
    return Cloud(result._core.array("points"), result.normals, attributes)


def plot_mesh(mesh: Mesh, *, screenshot: Path | None = None, **arguments: Any) -> Any:
    """Shows :func:`isograd.viz.scene` with PyVista, and writes what it shows to a file."""
    from .viz import scene

    plotter = scene(mesh, **arguments)
    return plotter.show(screenshot=False if screenshot is None else os.fspath(screenshot))


def to_trimesh(mesh: Mesh) -> trimesh.Trimesh:
    """A mesh of trimesh, with its vertices and faces in this order."""
    library = require("trimesh", "to_trimesh", "trimesh")
    _measure.check_faces(mesh.vertices, mesh.faces)
    converted: trimesh.Trimesh = library.Trimesh(mesh.vertices.copy(), mesh.faces.copy(), process=False)
    return converted


def to_polydata(mesh: Mesh) -> pyvista.PolyData:
    """A mesh of PyVista."""
    library = require("pyvista", "to_pyvista", "isograd[viz]")
    _measure.check_faces(mesh.vertices, mesh.faces)
    faces = mesh.faces.astype(np.int64)
    converted: pyvista.PolyData = library.PolyData.from_regular_faces(mesh.vertices.copy(), faces)
    return converted


def to_open3d(mesh: Mesh) -> open3d.geometry.TriangleMesh:
    """A mesh of Open3D, with normals of vertices and faces."""
    library = require("open3d", "to_open3d", "open3d")
    vectors = library.utility.Vector3dVector
    normals, face_normals = mesh.normals.astype(float), mesh.face_normals.astype(float)
    faces = library.utility.Vector3iVector(mesh.faces.astype(np.int32))
    converted: open3d.geometry.TriangleMesh = library.geometry.TriangleMesh(vectors(mesh.vertices.astype(float)), faces)
    converted.vertex_normals = vectors(normals)
    converted.triangle_normals = vectors(face_normals)
    return converted


def to_image(result: Reconstruction, cells: bool) -> pyvista.ImageData:
    """φ on a grid of PyVista: at points, which are the centers of the cells, or in its cells."""
    library = require("pyvista", "to_pyvista", "isograd[viz]")
    grid = result.grid
    image: pyvista.ImageData = library.ImageData(
        dimensions=[n + cells for n in grid.shape],
        spacing=[grid.spacing] * 3,
        origin=grid.lower if cells else grid.origin,
    )
    data = image.cell_data if cells else image.point_data
    data.set_array(result.sdf.ravel(order="F"), "sdf")
    image.set_active_scalars("sdf", "cell" if cells else "point")
    return image


def to_xarray(result: Reconstruction) -> xarray.DataArray:
    """φ with the centers of the cells as coordinates."""
    library = require("xarray", "to_xarray", "xarray")
    grid = result.grid
    attributes = {
        "long_name": "signed distance",
        "sign": "negative inside",
        "lower": list(grid.lower),
        "spacing": grid.spacing,
        "backend": result.backend,
        "verdict": result.verdict or "not checked",
    }
    axes = dict(zip("xyz", grid.axes))
    array: xarray.DataArray = library.DataArray(result.sdf.copy(), axes, dims=["x", "y", "z"], name="sdf", attrs=attributes)
    return array


def reconstruction_html(result: Reconstruction) -> str:
    """Verdict, its reasons and a picture, for notebooks."""
    text, _, verdict = repr(result).rpartition(": ")
    color = VERDICT_COLORS.get(verdict, "inherit")
    reasons = "".join(f"<li>{escape(reason)}</li>" for reason in result.warnings)
    return (
        f'<div><p>{escape(text)}: <b style="color: {color}">{escape(verdict)}</b></p>'
        f"<ul>{reasons}</ul>{_picture(result)}</div>"
    )


def _picture(result: Reconstruction) -> str:
    """Slices of φ as an image inside of HTML; without matplotlib nothing."""
    from . import viz

    try:
        figure = require("matplotlib.figure", "a picture", "isograd[viz]").Figure
    except ImportError:
        return ""
    png = io.BytesIO()
    # Not a figure of pyplot, which notebooks would show a second time.
    viz.draw_slices(figure, result.sdf, result.grid).savefig(png, format="png", dpi=70)
    data = base64.b64encode(png.getvalue()).decode()
    return f'<img alt="three slices of φ" src="data:image/png;base64,{data}">'


def mesh_html(mesh: Mesh) -> str:
    """Measures of a mesh, for notebooks."""
    rows: dict[str, object] = {"vertices": f"{len(mesh.vertices):,}", "faces": f"{len(mesh.faces):,}"}
    try:
        rows |= {
            "area": f"{mesh.area:.6g}",
            "volume": f"{mesh.volume:.6g}",
            "closed": "yes" if mesh.is_closed else "no",
            "components": f"{mesh.components().max(initial=-1) + 1:,}",
            "bounds": " to ".join("(" + ", ".join(f"{x:.6g}" for x in corner) + ")" for corner in mesh.bounds),
        }
    except ValueError as error:
        rows["error"] = error
    cells = "".join(f"<tr><th>{name}</th><td>{escape(str(value))}</td></tr>" for name, value in rows.items())
    return f"<table><caption>Mesh, {mesh.vertices.dtype}</caption>{cells}</table>"
