"""A grid that follows a body, and its place in the grid of the solver."""

from __future__ import annotations

from typing import TYPE_CHECKING

import jax
import jax.numpy as jnp

from ._body import Body

if TYPE_CHECKING:
    from jax.typing import ArrayLike

    from .._grid import Grid


def window(center: ArrayLike, small: Grid, grid: Grid) -> jax.Array:
    """``(3,)`` int32: cells by which a small grid is moved so that its middle is near ``center``, inside ``grid``.

    Whole cells, so that places of the moved grid are places of the solver's. The body is then
    ``paste(staggered(points − spacing · cells, velocity, small), cells, small, grid, band)``, at the cost of the small
    grid. The cells have no derivative, and φ has none in them.

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
    start = jnp.asarray(_first(small, grid), jnp.int32) + jnp.asarray(cells, jnp.int32)
    shapes = {sdf.shape for sdf in body.sdf}
    if shapes != {small.shape}:
        raise ValueError(f"the body has the shapes {sorted(shapes)} and the small grid {small.shape}; give its own grid")

    def put(field: jax.Array, beyond: float) -> jax.Array:
        whole = jnp.full((*grid.shape, *field.shape[3:]), beyond, field.dtype)
        index = (start[0], start[1], start[2], *(jnp.int32(0) for _ in field.shape[3:]))
        return jax.lax.dynamic_update_slice(whole, field, index)

    return Body(
        tuple(put(sdf, band) for sdf in body.sdf),
        tuple(put(normal, 0) for normal in body.normal),
        tuple(put(velocity, 0) for velocity in body.velocity),
    )


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
