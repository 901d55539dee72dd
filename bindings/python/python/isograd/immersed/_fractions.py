"""Volume fractions of cells and apertures of faces that a plane cuts."""

from __future__ import annotations

from typing import TYPE_CHECKING

import jax.numpy as jnp
import numpy as np

if TYPE_CHECKING:
    import jax


def volume_fraction(sdf: jax.Array, normal: jax.Array, spacing: float) -> jax.Array:
    """Share of each cell that is outside the body, 0 to 1: exact where the surface is a plane.

    The formula is that of R. Scardovelli and S. Zaleski, *Analytical relations connecting linear interfaces and volume
    fractions in rectangular grids*, J. Comput. Phys. 164, 2000. Where the plane is nearly parallel to an axis of the
    grid, the component of its normal along it is held at ``ε^(1/3)`` (``ε`` of the number type) of the largest, so that
    rounding stays small and derivatives are bounded.

    Args:
        sdf: ``S``: φ at the centers of the cells, in the unit of the points.
        normal: ``(*S, 3)``: ∇φ there; it need not be of unit length. A cell with the normal 0 is on the side of φ.
        spacing: side of a cell.
    """
    (a, b, c), level = _widths(sdf, normal, spacing)
    half = jnp.where(level > 0.5, 1 - level, level)
    two = a + b
    corner = half**3 / (6 * a * b * c)
    edge = half * (half - a) / (2 * b * c) + a**2 / (6 * b * c)
    prism = half**2 * (3 * two - half) + a**2 * (a - 3 * half) + b**2 * (b - 3 * half)
    # Where the plane has passed the third corner too.
    prism = (prism - jnp.maximum(half - c, 0) ** 3) / (6 * a * b * c)
    slab = (2 * half - two) / (2 * c)
    share = jnp.where(half < a, corner, jnp.where(half < b, edge, prism))
    share = jnp.where((half >= two) & (half <= c), slab, share)
    share = jnp.where(level > 0.5, 1 - share, share)
    return _outside(share, level, sdf, normal)


def apertures(sdf: jax.Array, normal: jax.Array, spacing: float, axis: int) -> jax.Array:
    """Share of each face that is outside the body, 0 to 1: exact where the surface is a plane.

    Args:
        sdf: ``S``: φ at the centers of the faces, in the unit of the points.
        normal: ``(*S, 3)``: ∇φ there, in the length that φ has it; 0 for a face on the side of φ.
        spacing: side of a cell.
        axis: axis to which the faces are normal: 0, 1 or 2.

    Components in the plane of the face are bounded as for :func:`volume_fraction`. Where a face is parallel to the
    surface, the share is a step of φ, ``ε^(1/3)`` cells wide.

    Raises:
        ValueError: another axis.
    """
    if axis not in (0, 1, 2):
        raise ValueError(f"axis is {axis!r}; give 0, 1 or 2")
    inside = [k for k in range(3) if k != axis]
    (a, b), level = _widths(sdf, normal[..., jnp.array(inside)], spacing)
    half = jnp.where(level > 0.5, 1 - level, level)
    share = jnp.where(half < a, half**2 / (2 * a * b), (2 * half - a) / (2 * b))
    share = jnp.where(level > 0.5, 1 - share, share)
    return _outside(share, level, sdf, normal)


def _widths(sdf: jax.Array, normal: jax.Array, spacing: float) -> tuple[jax.Array, jax.Array]:
    """``(K, *S)`` extents of φ along the axes of the box, ascending, and φ at its highest corner, divided by their sum."""
    smallest = np.finfo(sdf.dtype).eps ** (1 / 3)
    extent = jnp.abs(normal) * spacing
    largest = jnp.maximum(jnp.max(extent, axis=-1, keepdims=True), smallest * spacing)
    # As one array, or XLA computes them again for every use in the gradient.
    extents = jnp.stack(_ascending(jnp.maximum(extent, smallest * largest)))
    total = jnp.sum(extents, axis=0)
    return extents / total, jnp.clip(sdf / total + 0.5, 0, 1)


def _ascending(extent: jax.Array) -> list[jax.Array]:
    """The two or three components, sorted: many times faster than a sort along so short an axis."""
    ordered: list[jax.Array] = []
    for part in jnp.moveaxis(extent, -1, 0):
        for k, other in enumerate(ordered):
            ordered[k], part = jnp.minimum(other, part), jnp.maximum(other, part)
        ordered.append(part)
    return ordered


def _outside(share: jax.Array, level: jax.Array, sdf: jax.Array, normal: jax.Array) -> jax.Array:
    """The share, but 0 or 1 where the plane misses the box or has no direction."""
    share = jnp.where(level <= 0, 0, jnp.where(level >= 1, 1, share))
    return jnp.where(jnp.any(normal != 0, axis=-1), share, (sdf > 0).astype(share.dtype))
