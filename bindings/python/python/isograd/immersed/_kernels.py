"""Boundary data immersion: moments of its kernel, and the blend of the velocities of fluid and body.

G. D. Weymouth and D. K. P. Yue, *Boundary data immersion method for Cartesian-grid simulations of fluid-body interaction
problems*, J. Comput. Phys. 230, 2011; second order: A. P. Maertens and G. D. Weymouth, *Accurate Cartesian-grid
simulations of near-body flows at intermediate Reynolds numbers*, Comput. Methods Appl. Mech. Eng. 283, 2015.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Literal

import jax.numpy as jnp

if TYPE_CHECKING:
    from collections.abc import Sequence

    import jax

    from ._body import Body

Boundary = Literal["edge", "periodic"]


def mu0(sdf: jax.Array, width: float) -> jax.Array:
    """Zeroth moment of the kernel ``(1 + cos(π s/ε))/(2 ε)``, ``|s| < ε``, over the fluid: its smoothed share.

    ``μ₀ = (1 + r + sin(π r)/π)/2``, ``r = φ/ε`` cut off at ±1: 0 inside, 1/2 on the surface, 1 outside.

    Args:
        sdf: φ, negative inside.
        width: ε, half the width of the kernel, in the unit of φ; usually 1 to 2 cells.
    """
    r = jnp.clip(sdf / width, -1, 1)
    return (1 + r + jnp.sin(jnp.pi * r) / jnp.pi) / 2


def mu1(sdf: jax.Array, width: float) -> jax.Array:
    """First moment of the kernel over the fluid, in the unit of φ; 0 beyond ``width``.

    ``μ₁ = ε ((1 − r²)/4 − (r sin(π r) + (1 + cos(π r))/π)/(2 π))``, ``r = φ/ε`` cut off at ±1.

    Args:
        sdf: φ, negative inside.
        width: ε, half the width of the kernel, in the unit of φ.
    """
    r = jnp.clip(sdf / width, -1, 1)
    turn = r * jnp.sin(jnp.pi * r) + (1 + jnp.cos(jnp.pi * r)) / jnp.pi
    return width * ((1 - r**2) / 4 - turn / (2 * jnp.pi))


def fluid_share(body: Body, width: float) -> tuple[jax.Array, ...]:
    """μ₀ at the places of each component: 1 in the fluid, 0 in the body."""
    return tuple(mu0(sdf, width) for sdf in body.sdf)


def derivative(
    field: jax.Array, direction: jax.Array, spacing: float, boundary: Boundary = "edge"
) -> jax.Array:
    """Derivative of a field along a direction, by central differences: ``d·∇f``.

    Args:
        field: ``(nx, ny, nz)``.
        direction: ``(nx, ny, nz, 3)``.
        spacing: side of a cell.
        boundary: ``"edge"``: one-sided differences at the ends of each axis; ``"periodic"``: differences across them.

    Raises:
        ValueError: another boundary.
    """
    slopes = zip(range(3), _slopes(field, spacing, boundary))
    return sum((direction[..., axis] * slope for axis, slope in slopes), jnp.zeros_like(field))


def unit_gradient(sdf: jax.Array, spacing: float, boundary: Boundary = "edge") -> jax.Array:
    """``(nx, ny, nz, 3)`` normals from central differences of φ: ``∇φ/|∇φ|``, 0 where φ is constant.

    They are continuous as the points move, since φ is; the exact normals of a :class:`Body` are those of triangles, which
    jump from one to the next.

    Args:
        sdf: ``(nx, ny, nz)``: φ.
        spacing: side of a cell.
        boundary: see :func:`derivative`.
    """
    slope = jnp.stack(_slopes(sdf, spacing, boundary), axis=-1)
    square = jnp.sum(slope**2, axis=-1, keepdims=True)
    has_slope = square > 0
    return jnp.where(has_slope, slope / jnp.sqrt(jnp.where(has_slope, square, 1)), 0)


def _slopes(field: jax.Array, spacing: float, boundary: Boundary) -> list[jax.Array]:
    if boundary == "periodic":
        return [(jnp.roll(field, -1, axis) - jnp.roll(field, 1, axis)) / (2 * spacing) for axis in range(3)]
    if boundary == "edge":
        slopes = jnp.gradient(field, spacing, axis=(0, 1, 2))
        return list(slopes)
    raise ValueError(f'boundary is {boundary!r}; give "edge" or "periodic"')


def blend(
    fluid: Sequence[jax.Array],
    body: Body,
    *,
    width: float,
    spacing: float,
    order: Literal[1, 2] = 2,
    boundary: Boundary = "edge",
) -> tuple[jax.Array, ...]:
    """The velocity of fluid and body together: ``u_b + μ₀ (u_f − u_b) + μ₁ ∂(u_f − u_b)/∂n``.

    It is that of the body inside, that of the fluid outside, with a transition of ``width`` on both sides of the
    surface. Call it on the predicted velocity of each stage, before its pressure projection. The normals of the last
    term are those of :func:`unit_gradient`.

    Args:
        fluid: components of the velocity, each at the places of the body's.
        body: the body, or the :func:`union` of several; its band must be a cell wider than ``width``.
        width: half the width of the transition, in the unit of φ.
        spacing: side of a cell.
        order: 2 with the last term, 1 without it.
        boundary: differences at the walls: see :func:`derivative`.

    Raises:
        ValueError: another order, or another number of components.
    """
    if order not in (1, 2):
        raise ValueError(f"order is {order!r}; give 1 or 2")
    if len(fluid) != len(body.sdf):
        raise ValueError(f"the fluid has {len(fluid)} components and the body {len(body.sdf)}; give as many")
    out = []
    for k, (component, sdf, velocity) in enumerate(zip(fluid, body.sdf, body.velocity)):
        own = velocity[..., k]
        slip = component - own
        blended = own + mu0(sdf, width) * slip
        if order == 2:
            normal = unit_gradient(sdf, spacing, boundary)
            blended = blended + mu1(sdf, width) * derivative(slip, normal, spacing, boundary)
        out.append(blended)
    return tuple(out)
