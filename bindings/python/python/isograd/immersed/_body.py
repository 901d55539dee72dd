"""Bodies: φ, normals and velocities at the places of the velocity components."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, NamedTuple

import jax
import jax.numpy as jnp

from .._jax_surface import Surface, positions_at, surface
from .._places import Offset

if TYPE_CHECKING:
    from collections.abc import Sequence

    from jax.typing import ArrayLike

    from .._grid import Grid

CENTERS: tuple[Offset, ...] = ((0.5, 0.5, 0.5),) * 3
"""Places of the components of a collocated velocity, in cells from the lower corner of each cell."""
FACES: tuple[Offset, ...] = ((1.0, 0.5, 0.5), (0.5, 1.0, 0.5), (0.5, 0.5, 1.0))
"""Places of the components of a staggered velocity: the upper face of each cell along the axis of the component."""


class Body(NamedTuple):
    """A body at the places of each velocity component: tuples with one entry for each component, of a shape ``S``."""

    sdf: tuple[jax.Array, ...]
    """``S``: signed distance, in the unit of the points, negative inside."""
    normal: tuple[jax.Array, ...]
    """``(*S, 3)``: ∇φ, of unit length; 0 where it is not known."""
    velocity: tuple[jax.Array, ...]
    """``(*S, 3)``: velocity of the closest surface point, all three components."""


def staggered(
    points: ArrayLike,
    velocity: ArrayLike,
    grid: Grid,
    offsets: Sequence[Offset] = FACES,
    **arguments: Any,
) -> Body:
    """The body of a moving cloud at the faces of a staggered grid.

    Args:
        points: ``(N, 3)``.
        velocity: ``(N, 3)`` velocity of each point.
        grid: static; cells of the solver.
        offsets: static; place of each component in its cell, in cells from its lower corner: ``(0, 0.5, 0.5)`` for a
            solver that stores the lower face of x.
        arguments: ``normals``, ``band``, ``fill`` and ``options`` of :func:`isograd.jax.surface`.

    Raises:
        TypeError, ValueError, jax.errors.JaxRuntimeError: as for :func:`isograd.jax.surface`; another shape of ``velocity``.
    """
    return _body(surface(points, grid, tuple(offsets), values=_checked(velocity), **arguments))


def collocated(points: ArrayLike, velocity: ArrayLike, grid: Grid, **arguments: Any) -> Body:
    """The body of a moving cloud at the cell centers, where all components are; arguments as for :func:`staggered`."""
    return _body((surface(points, grid, values=_checked(velocity), **arguments),) * 3)


def _checked(velocity: ArrayLike) -> ArrayLike:
    shape = jnp.shape(velocity)
    if len(shape) != 2 or shape[1] != 3:
        raise ValueError(f"velocity has the shape {shape} and must have (N, 3)")
    return velocity


def _body(found: Sequence[Surface]) -> Body:
    return Body(*(tuple(getattr(part, name) for part in found) for name in ("sdf", "normal", "values")))


def positions(grid: Grid, offsets: Sequence[Offset] = FACES, dtype: Any = None) -> tuple[jax.Array, ...]:
    """``(nx, ny, nz, 3)`` positions of the places of each component, in the unit of the points.

    Args:
        grid: static.
        offsets: static; place of each component in its cell.
        dtype: type of the result; JAX's default float if it is ``None``.
    """
    dtype = jnp.zeros(0).dtype if dtype is None else dtype
    return tuple(positions_at(grid, offset, dtype) for offset in offsets)


def sdf_rate(body: Body) -> tuple[jax.Array, ...]:
    """``∂φ/∂t = −v·n`` at fixed places, in unit length per unit time."""
    return tuple(-jnp.sum(v * n, axis=-1) for v, n in zip(body.velocity, body.normal))


def union(*bodies: Body) -> Body:
    """Several bodies as one: at each place the normal and the velocity of the one with the least φ.

    Outside all bodies φ is the distance to the closest; where bodies overlap, inside, it is an upper bound of its
    negative. The gradient of φ is that of the body chosen.

    Raises:
        ValueError: no body, or bodies with different numbers of components.
    """
    counts = {len(body.sdf) for body in bodies}
    if len(counts) != 1:
        raise ValueError(f"the bodies have {sorted(counts)} components; give one body or more, of the same layout")
    whole = bodies[0]
    for body in bodies[1:]:
        closer = tuple(b < a for a, b in zip(whole.sdf, body.sdf))
        whole = Body(*(_choose(closer, a, b) for a, b in zip(whole, body)))
    return whole


def _choose(
    closer: tuple[jax.Array, ...], first: tuple[jax.Array, ...], second: tuple[jax.Array, ...]
) -> tuple[jax.Array, ...]:
    wide = (mask.reshape(mask.shape + (1,) * (a.ndim - mask.ndim)) for mask, a in zip(closer, first))
    return tuple(jnp.where(mask, b, a) for mask, a, b in zip(wide, first, second))
