"""A grid that follows a body, and its place in the grid of the solver."""

from __future__ import annotations

from typing import TYPE_CHECKING

import jax
import jax.numpy as jnp

from ._body import Body

if TYPE_CHECKING:
    from collections.abc import Sequence

    from jax.typing import ArrayLike

    from .._grid import Grid


def window(center: ArrayLike, small: Grid, grid: Grid) -> jax.Array:
    """``(3,)`` int32: cells by which a small grid is moved so that its middle is near ``center``, inside ``grid``.

    Whole cells, so that places of the moved grid are places of the solver's. The body is then
    ``staggered(points − spacing · cells, velocity, small)``, at the cost of the small grid, and so are its blend and its
    loads with the velocities of :func:`crop`. :func:`paste` puts it on the whole grid. The cells have no derivative, and
    φ has none in them.

    Args:
        center: ``(3,)`` position of the body.
        small: static; grid of the solver's spacing, its lower corner whole cells from that of ``grid``.
        grid: static; grid of the solver.

    Raises:
        ValueError: grids that do not fit.
    """
    low = _first(small, grid)
    middle = jnp.asarray([x + small.spacing * n / 2 for x, n in zip(small.lower, small.shape)])
    cells = jnp.round((jnp.asarray(center) - middle) / small.spacing).astype(jnp.int32)
    least = jnp.asarray([-x for x in low], jnp.int32)
    most = jnp.asarray([n - m - x for n, m, x in zip(grid.shape, small.shape, low)], jnp.int32)
    return jax.lax.stop_gradient(jnp.clip(cells, least, most))


def paste(body: Body, cells: ArrayLike, small: Grid, grid: Grid, band: float) -> Body:
    """A body on the grid of the solver, from that on a small grid that was moved by ``cells``.

    Args:
        body: the body on ``small``, computed from points that were moved by ``−spacing · cells``.
        cells: ``(3,)`` from :func:`window`.
        small: static.
        grid: static; grid of the solver.
        band: φ off the small grid, where normals and velocities are 0: the band of :func:`isograd.jax.surface`. The
            margin of the small grid around the body must not be smaller.

    Raises:
        ValueError: grids that do not fit, or a body of another shape.
    """
    start = _start(cells, small, grid)
    _check_shapes("fields of the body", body.sdf, small, "small grid")

    def put(field: jax.Array, beyond: float) -> jax.Array:
        whole = jnp.full((*grid.shape, *field.shape[3:]), beyond, field.dtype)
        return jax.lax.dynamic_update_slice(whole, field, (*start, *(jnp.int32(0) for _ in field.shape[3:])))

    return Body(
        tuple(put(sdf, band) for sdf in body.sdf),
        tuple(put(normal, 0) for normal in body.normal),
        tuple(put(velocity, 0) for velocity in body.velocity),
    )


def crop(fields: Sequence[jax.Array], cells: ArrayLike, small: Grid, grid: Grid) -> tuple[jax.Array, ...]:
    """Fields of the solver, such as the components of the velocity, on a small grid that was moved by ``cells``.

    :func:`blend`, :func:`inner_momentum` and :func:`loads` of a body on that grid then cost as much as the small grid:
    off the body the blend is the fluid, and the loads are 0. Give the blend back with :func:`insert`.

    Args:
        fields: each of the shape of ``grid``.
        cells: ``(3,)`` from :func:`window`, or zeros.
        small: static.
        grid: static; grid of the solver.

    Raises:
        ValueError: grids that do not fit, or fields of another shape.
    """
    start = _start(cells, small, grid)
    _check_shapes("fields", fields, grid, "grid of the solver")
    return tuple(jax.lax.dynamic_slice(field, start, small.shape) for field in fields)


def insert(
    fields: Sequence[jax.Array], parts: Sequence[jax.Array], cells: ArrayLike, small: Grid, grid: Grid
) -> tuple[jax.Array, ...]:
    """The fields with other values on the small grid: the inverse of :func:`crop`.

    Args:
        fields: each of the shape of ``grid``.
        parts: as many, of the shape of ``small``.
        cells: as for :func:`crop`.
        small: static.
        grid: static; grid of the solver.

    Raises:
        ValueError: grids that do not fit, fields or parts of another shape, or another number of them.
    """
    start = _start(cells, small, grid)
    _check_shapes("fields", fields, grid, "grid of the solver")
    _check_shapes("parts", parts, small, "small grid")
    if len(fields) != len(parts):
        raise ValueError(f"there are {len(fields)} fields and {len(parts)} parts; give as many")
    return tuple(jax.lax.dynamic_update_slice(*pair, start) for pair in zip(fields, parts))


def _start(cells: ArrayLike, small: Grid, grid: Grid) -> tuple[jax.Array, ...]:
    """The cell of the grid at which the small grid begins.

    Raises:
        ValueError: grids that do not fit.
    """
    start = jnp.asarray(_first(small, grid), jnp.int32) + jnp.asarray(cells, jnp.int32)
    return start[0], start[1], start[2]


def _check_shapes(what: str, fields: Sequence[jax.Array], grid: Grid, name: str) -> None:
    shapes = {field.shape for field in fields}
    if shapes != {grid.shape}:
        raise ValueError(f"the {what} have the shapes {sorted(shapes)} and the {name} {grid.shape}; give those of the grid")


def _first(small: Grid, grid: Grid) -> tuple[int, ...]:
    """The cell of the grid at which the small grid begins before it is moved.

    Raises:
        ValueError: the grids differ in their spacing or by parts of a cell, or the small grid is larger.
    """
    shifts = [(a - b) / grid.spacing for a, b in zip(small.lower, grid.lower)]
    first = tuple(round(shift) for shift in shifts)
    off = max(abs(shift - whole) for shift, whole in zip(shifts, first))
    if abs(small.spacing / grid.spacing - 1) > 1e-9 or off > 1e-6:
        raise ValueError(
            f"the small grid has the spacing {small.spacing} and begins {shifts} cells from the other, of the spacing "
            f"{grid.spacing}; give the same spacing, and whole cells"
        )
    if any(m > n for m, n in zip(small.shape, grid.shape)):
        raise ValueError(f"the small grid has {small.shape} cells and the other {grid.shape}; give a smaller one")
    return first
