"""Force, torque and power on a body, from the momentum that immersion takes from the fluid."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import jax
import jax.numpy as jnp

from ._kernels import mu0

if TYPE_CHECKING:
    from collections.abc import Sequence

    from jax.typing import ArrayLike

    from ._body import Body


class Loads(NamedTuple):
    """Loads of the fluid on a body, divided by the density of the fluid."""

    force: jax.Array
    """``(3,)``, in length⁴/time²."""
    torque: jax.Array | None
    """``(3,)`` about the center, in length⁵/time²; ``None`` without positions."""
    power: jax.Array
    """``()``, in length⁵/time³: of the fluid on the body; that of the body on the fluid is its negative."""


def inner_momentum(velocity: Sequence[jax.Array], body: Body, width: float) -> tuple[jax.Array, ...]:
    """``(1 − μ₀) u``: velocity of the fluid inside the body, at the places of each component.

    Its integral is the momentum of the inner fluid, divided by the density.
    """
    return tuple((1 - mu0(sdf, width)) * u for u, sdf in zip(velocity, body.sdf))


def loads(
    predicted: Sequence[jax.Array],
    blended: Sequence[jax.Array],
    body: Body,
    *,
    spacing: float,
    dt: float,
    inner: tuple[Sequence[jax.Array], Sequence[jax.Array]] | None = None,
    positions: Sequence[jax.Array] | None = None,
    center: ArrayLike | tuple[float, float, float] = (0.0, 0.0, 0.0),
) -> Loads:
    """Force, torque and power of the fluid on the body over a step, divided by the density of the fluid.

    The momentum that the blend takes from the fluid goes into the body region, which holds the body and the fluid of the
    solver inside it: ``F = Σ (u* − u) h³/Δt + d/dt Σ (1 − μ₀) u h³``. Without the last term the force is that on the
    body and its inner fluid; the two agree for a body at rest in steady flow.

    Args:
        predicted: components of the velocity before the blend, after ``dt``.
        blended: components of the velocity that :func:`blend` made of it.
        body: the body.
        spacing: side of a cell.
        dt: time step.
        inner: :func:`inner_momentum` at the begin and at the end of the step.
        positions: ``(nx, ny, nz, 3)`` positions of the places of each component, for the torque: :func:`positions`.
        center: ``(3,)`` point that the torque is about.
    """
    density = [(before - after) / dt for before, after in zip(predicted, blended)]
    if inner is not None:
        density = [d + (after - before) / dt for d, before, after in zip(density, *inner)]
    volume = spacing**3
    force = jnp.stack([jnp.sum(d) for d in density]) * volume
    powers = [jnp.sum(d * v[..., k]) for k, (d, v) in enumerate(zip(density, body.velocity))]
    torque = None
    if positions is not None:
        axes = jnp.eye(3, dtype=force.dtype)
        arms = [jnp.tensordot(d, x - jnp.asarray(center), axes=d.ndim) for d, x in zip(density, positions)]
        torque = sum([jnp.cross(arm, axis) for arm, axis in zip(arms, axes)], jnp.zeros(3, force.dtype)) * volume
    return Loads(force, torque, sum(powers, jnp.zeros((), force.dtype)) * volume)
