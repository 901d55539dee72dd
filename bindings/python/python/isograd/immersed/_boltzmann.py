"""Links of lattice Boltzmann methods that a surface cuts."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np

if TYPE_CHECKING:
    from jax.typing import ArrayLike


class Links(NamedTuple):
    """Links from the nodes outside a body to their neighbors inside, for each of ``K`` directions."""

    fraction: jax.Array
    """``(nx, ny, nz, K)``: Bouzidi's q, the way to the surface divided by that to the neighbor, 0 to 1; 1 elsewhere."""
    is_cut: jax.Array
    """``(nx, ny, nz, K)`` bool: whether the surface cuts the link."""


def links(sdf: jax.Array, directions: ArrayLike, normal: jax.Array | None = None, spacing: float = 1.0) -> Links:
    """Link fractions for interpolated bounce-back (M. Bouzidi, M. Firdaouss and P. Lallemand, Phys. Fluids 13, 2001).

    Without normals φ is linear along a link, which is exact for planes, with an error of second order in the link for
    curved surfaces. With normals it is the cubic of φ and its slopes at both ends, with an error of fourth order.

    Args:
        sdf: ``(nx, ny, nz)``: φ at the nodes, negative inside.
        directions: ``(K, 3)`` whole numbers (static): the neighbor of each direction, such as those of D3Q19. Beyond
            the walls there are no links.
        normal: ``(nx, ny, nz, 3)``: ∇φ at the nodes.
        spacing: distance between nodes; only used with normals.

    Raises:
        ValueError: directions of another shape, or that are not whole.
    """
    wanted = np.asarray(directions)
    if wanted.ndim != 2 or wanted.shape[1] != 3 or (wanted != np.round(wanted)).any():
        raise ValueError(f"directions has the shape {wanted.shape} and must be (K, 3) whole numbers")
    ways = [tuple(map(int, way)) for way in wanted]
    start, end = sdf[..., None], jnp.stack([_neighbor(sdf, way, jnp.inf) for way in ways], axis=-1)
    is_cut = (start > 0) & (end <= 0)
    # Where there is no link, numbers that have one, so that no derivative is NaN.
    start, end = jnp.where(is_cut, start, 1), jnp.where(is_cut, end, -1)
    fraction = start / (start - end)
    if normal is not None:
        step = spacing * jnp.asarray(wanted, sdf.dtype)
        slopes = [jnp.sum(normal * along, axis=-1) for along in step]
        first = jnp.stack(slopes, axis=-1)
        last = jnp.stack([_neighbor(slope, way, 0) for slope, way in zip(slopes, ways)], axis=-1)
        first, last = jnp.where(is_cut, first, -2), jnp.where(is_cut, last, -2)
        fraction = _root(start, end, first, last, fraction)
    return Links(jnp.where(is_cut, fraction, 1), is_cut)


def _root(start: jax.Array, end: jax.Array, first: jax.Array, last: jax.Array, guess: jax.Array) -> jax.Array:
    """The root of the cubic with these values and slopes at 0 and 1, by Newton's method from ``guess``, within 0 to 1."""
    square = 3 * (end - start) - 2 * first - last
    cube = 2 * (start - end) + first + last
    t = guess
    for _ in range(4):
        value = start + t * (first + t * (square + t * cube))
        slope = first + t * (2 * square + 3 * t * cube)
        # φ falls from start > 0 to end ≤ 0; a slope that does not is that of a kink, and the chord replaces it.
        slope = jnp.minimum(slope, 0.25 * (end - start))
        t = t - value / slope
        # Not by `clip`, which halves the derivative of a link that ends on the surface.
        t = jnp.where(t < 0, 0, jnp.where(t > 1, 1, t))
    return t


def _neighbor(field: jax.Array, way: tuple[int, ...], beyond: float) -> jax.Array:
    """The field at the neighbor in a direction; ``beyond`` where it is off the grid."""
    return jax.lax.pad(field, jnp.asarray(beyond, field.dtype), [(-step, step, 0) for step in way])
