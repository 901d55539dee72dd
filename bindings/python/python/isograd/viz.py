"""Plots: slices of a field with matplotlib, a surface and its points with PyVista.

Both libraries come with ``pip install isograd[viz]``; each is imported by the function that needs it.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from ._arrays import floats
from ._convert import require, to_polydata
from ._grid import Grid, as_grid
from ._measure import check_faces
from ._mesh import Mesh, as_mesh

if TYPE_CHECKING:
    import pyvista
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure
    from matplotlib.image import AxesImage
    from numpy.typing import ArrayLike

__all__ = ["scene", "slices"]

AXES = "xyz"
SURFACE_COLOR = "lightsteelblue"
POINT_COLOR = "firebrick"
MOST_ARROWS = 500
# As a share of the diagonal of the surface's box.
ARROW_LENGTH = 0.03


def slices(
    phi: ArrayLike,
    grid: Grid,
    *,
    at: Sequence[float] | None = None,
    points: ArrayLike | None = None,
    limit: float | None = None,
    title: str | None = None,
    label: str = "φ",
) -> Figure:
    """Three slices of a field, one across each axis, with the surface φ = 0 as a black line.

    Blue is inside, red outside, and white is zero. Cells without a finite value stay empty.

    Args:
        phi: ``grid.shape`` field, such as ``Reconstruction.sdf``.
        grid: its grid.
        at: the point ``(x, y, z)`` through whose cell the slices pass; by default the center of the grid.
        points: ``(N, 3)``: those in the cells of a slice are drawn on it as dots.
        limit: value of the darkest colors, in the unit of φ; by default the largest of the three slices.
        title: above the three.
        label: of the colors.

    Returns:
        A figure of ``matplotlib.pyplot``: ``figure.savefig("slices.png")`` or ``pyplot.show()``, then
        ``pyplot.close(figure)``.

    Raises:
        ImportError: matplotlib is not installed.
        TypeError, ValueError: a field of another shape than the grid, or ``at`` outside of it.
    """
    pyplot = require("matplotlib.pyplot", "isograd.viz.slices", "isograd[viz]")
    return draw_slices(pyplot.figure, phi, grid, at, points, limit, title, label)


def draw_slices(
    new_figure: Callable[..., Figure],
    phi: ArrayLike,
    grid: Grid,
    at: Sequence[float] | None = None,
    points: ArrayLike | None = None,
    limit: float | None = None,
    title: str | None = None,
    label: str = "φ",
) -> Figure:
    """:func:`slices` on a figure of ``pyplot.figure``, or of ``Figure``, which ``pyplot`` does not know."""
    as_grid(grid)
    field = np.ma.masked_invalid(floats(phi, "phi", grid.shape))
    cell = _cell(grid, at)
    dots = None if points is None else floats(points, "points", (None, 3))
    planes = [field.take(cell[axis], axis=axis) for axis in range(3)]
    limit = _limit(planes, limit)

    size, widths = _layout(grid)
    figure = new_figure(layout="constrained", figsize=size)
    row = figure.subplots(1, 3, width_ratios=widths)
    images = []
    for axis, (axes, plane) in enumerate(zip(row, planes)):
        images.append(_draw_slice(axes, plane, grid, axis, limit))
        place = grid.origin[axis] + grid.spacing * cell[axis]
        axes.set_title(f"{AXES[axis]} = {place:.4g}")
        if dots is not None:
            near = dots[np.abs(dots[:, axis] - place) <= 0.5 * grid.spacing]
            axes.plot(*_across(list(near.T), axis), ".", color=POINT_COLOR, markersize=1.5)
    figure.colorbar(images[-1], ax=row, label=label, shrink=0.8)
    if title is not None:
        figure.suptitle(title)
    return figure


def _layout(grid: Grid) -> tuple[tuple[float, float], list[float]]:
    """Size of the figure in inches and widths of the slices, so that they are of one scale."""
    sides = [grid.spacing * n for n in grid.shape]
    widths = [_across(sides, axis)[0] for axis in range(3)]
    height = max(_across(sides, axis)[1] for axis in range(3))
    scale = min(10.0 / sum(widths), 6.0 / height)
    # Room for the labels; no panel is too narrow for its title.
    widths = [max(scale * width, 1.2) for width in widths]
    return (sum(widths) + 3.0, max(scale * height, 1.0) + 1.4), widths


def _cell(grid: Grid, at: Sequence[float] | None) -> list[int]:
    """Index of the cell that the slices pass through."""
    if at is None:
        return [n // 2 for n in grid.shape]
    place = floats(at, "at", (3,))
    if not all(low <= x <= high for low, x, high in zip(grid.lower, place, grid.upper)):
        raise ValueError(f"at is {tuple(place.tolist())}, outside the grid from {grid.lower} to {grid.upper}")
    index = (place - np.array(grid.lower)) // grid.spacing
    return [min(int(i), n - 1) for i, n in zip(index, grid.shape)]


def _limit(planes: list[np.ma.MaskedArray], limit: float | None) -> float:
    if limit is not None:
        if not 0.0 < float(limit) < float("inf"):
            raise ValueError(f"limit is {limit!r}; give a finite number above 0")
        return float(limit)
    # A field without finite values, or all zero, still needs a scale.
    largest = max((float(np.abs(plane).max()) for plane in planes if plane.count()), default=0.0)
    return largest or 1.0


def _across(values: Sequence[Any], axis: int) -> list[Any]:
    """The two of three entries that belong to the axes of a slice across `axis`, in their order."""
    return [value for other, value in enumerate(values) if other != axis]


def _draw_slice(axes: Axes, plane: np.ma.MaskedArray, grid: Grid, axis: int, limit: float) -> AxesImage:
    (left, bottom), (right, top) = _across(grid.lower, axis), _across(grid.upper, axis)
    # Rows of an image are vertical: the second axis of the slice.
    image = axes.imshow(
        plane.T, cmap="RdBu_r", vmin=-limit, vmax=limit, origin="lower", extent=(left, right, bottom, top)
    )
    if plane.count() and plane.min() < 0.0 < plane.max() and min(plane.shape) > 1:
        first, second = _across(grid.axes, axis)
        axes.contour(first, second, plane.T, levels=[0.0], colors="black", linewidths=1.0, zorder=3)
    across, up = _across(AXES, axis)
    axes.set(xlabel=across, ylabel=up)
    return image


def scene(
    mesh: Mesh | tuple[ArrayLike, ArrayLike],
    points: ArrayLike | None = None,
    *,
    normals: ArrayLike | None = None,
    values: ArrayLike | None = None,
    label: str = "value",
    opacity: float = 1.0,
    off_screen: bool | None = None,
) -> pyvista.Plotter:
    """A surface in three dimensions, with the points that it was reconstructed from.

    Args:
        mesh: such as ``Reconstruction.mesh``.
        points: ``(N, 3)``, drawn as dots.
        normals: ``(N, 3)`` of the points, drawn as arrows at 500 points at most.
        values: ``(V,)`` at the vertices, as colors.
        label: of these colors.
        opacity: of the surface: 0 for nothing, 1 for solid.
        off_screen: draw without a window, for ``plotter.screenshot("scene.png")``; by default ``pyvista.OFF_SCREEN``.

    Returns:
        A plotter: ``plotter.show()`` opens it, ``plotter.close()`` frees it.

    Raises:
        ImportError: PyVista is not installed.
        TypeError, ValueError: arrays of another type or shape, or a mesh without faces.
    """
    library = require("pyvista", "isograd.viz.scene", "isograd[viz]")
    mesh = _drawable(as_mesh(mesh))
    colors = None if values is None else floats(values, "values", (len(mesh.vertices),))
    dots = None if points is None else floats(points, "points", (None, 3))
    arrows = _arrows(dots, normals)
    if not 0.0 <= opacity <= 1.0:
        raise ValueError(f"opacity is {opacity!r}; give 0 to 1")

    plotter = library.Plotter(off_screen=off_screen)
    surface = to_polydata(mesh)
    if colors is None:
        plotter.add_mesh(surface, color=SURFACE_COLOR, opacity=opacity, smooth_shading=True)
    else:
        surface.point_data[label] = colors
        plotter.add_mesh(surface, scalars=label, opacity=opacity, smooth_shading=True)
    if dots is not None and len(dots):
        plotter.add_points(dots, color=POINT_COLOR, point_size=3.0, render_points_as_spheres=True)
        if arrows is not None:
            few = slice(None, None, -(-len(dots) // MOST_ARROWS))
            length = ARROW_LENGTH * surface.length
            plotter.add_arrows(dots[few], arrows[few], mag=length, color=POINT_COLOR, show_scalar_bar=False)
    plotter.show_axes()  # pyright: ignore[reportCallIssue]
    return plotter


def _drawable(mesh: Mesh) -> Mesh:
    """The mesh, after the checks that VTK leaves out."""
    if len(mesh.faces) == 0:
        raise ValueError("the mesh has no faces, so there is nothing to draw")
    check_faces(mesh.vertices, mesh.faces)
    if not np.isfinite(mesh.vertices).all():
        raise ValueError("the mesh has vertices that are not finite")
    return mesh


def _arrows(points: np.ndarray | None, normals: ArrayLike | None) -> np.ndarray | None:
    if normals is None:
        return None
    if points is None:
        raise ValueError("normals need points to be drawn at; give both")
    return floats(normals, "normals", (len(points), 3), points.dtype)
