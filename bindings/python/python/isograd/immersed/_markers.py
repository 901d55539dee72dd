"""Lagrangian markers of a surface mesh."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import jax
import jax.numpy as jnp

if TYPE_CHECKING:
    from jax.typing import ArrayLike


class Markers(NamedTuple):
    """One marker for each face of a mesh."""

    points: jax.Array
    """``(F, 3)`` centroids of the faces."""
    areas: jax.Array
    """``(F,)``, in unit length²; 0 for a face without area, such as those behind the last of a padded mesh."""
    normals: jax.Array
    """``(F, 3)`` outward unit normals; 0 for a face without area."""
    velocities: jax.Array | None
    """``(F, C)`` means of the values at the corners; ``None`` without values."""


def markers(vertices: ArrayLike, faces: ArrayLike, values: ArrayLike | None = None) -> Markers:
    """Markers for direct forcing, from a mesh such as that of :func:`isograd.jax.mesh`.

    ``Σ area · f(point)`` is the integral of a linear function over the surface, without error.

    Args:
        vertices: ``(V, 3)``.
        faces: ``(F, 3)`` corners, counter-clockwise from outside.
        values: ``(V, C)`` values at the vertices, such as velocities: ``isograd.jax.surface(points, grid, vertices,
            values=velocity).values``.
    """
    vertices, faces = jnp.asarray(vertices), jnp.asarray(faces)
    a, b, c = (vertices[faces[:, k]] for k in range(3))
    double = jnp.cross(b - a, c - a)
    square = jnp.sum(double**2, axis=1)
    # The derivative of a root at 0 is unbounded.
    has_area = square > 0
    length = jnp.sqrt(jnp.where(has_area, square, 1))
    means = None if values is None else jnp.mean(jnp.asarray(values)[faces], axis=1)
    normals = jnp.where(has_area[:, None], double / length[:, None], 0)
    return Markers((a + b + c) / 3, jnp.where(has_area, length / 2, 0), normals, means)
