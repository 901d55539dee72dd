"""Signed distance and surface of points for PyTorch: the functions of ``isograd.jax``, inside ``autograd``, ``vmap`` and
``torch.compile``.

Computations use the number type of the tensors. With another ``backend``, points, φ and their cotangents
are copied to the device and back at every call. Tensors on a CUDA device need ``backend="cuda"``: then φ and its cotangent
stay there, and the points, a few numbers each, are copied to the CPU. :func:`surface` and :func:`orient` compute on the
CPU, and copy such tensors at every call. The operators are registered with
``torch.library``, such as ``isograd::signed_distance`` and ``isograd::signed_distance_pullback``. ``torch.func.grad``
does not support custom operators: call ``torch.autograd.grad``. Needs PyTorch 2.5.

Of a batch of clouds ``(B, N, 3)`` the results are stacked. Normals, queries and positions are shared, or have the axis of
the batch too; ``values`` always have it.
"""

from __future__ import annotations

from typing import Any, Optional

from ._grid import Grid
from ._options import Options
from ._torch import DEVICES, Tensor, call, in_batches, one_by_one, prepare, torch
from ._torch_mesh import Extension, Mesh, extend, mesh, orient, query, saved
from ._torch_surface import Surface, surface

__all__ = ["Extension", "Mesh", "Surface", "extend", "mesh", "orient", "query", "signed_distance", "surface"]


@in_batches
def signed_distance(
    points: Tensor,
    grid: Grid,
    *,
    normals: Tensor | None = None,
    options: Options | None = None,
    backend: str = "cpu",
) -> Tensor:
    """φ: the signed distance to the surface through the points.

    Differentiable once in ``points``, and in ``normals`` with ``orient="given"``. Held constant: the sides of
    the normals, where a change makes φ jump, and which face is closest to a cell.

    Args:
        points: ``(N, 3)``, float32 or float64. float16 and bfloat16 become float32. A batch of clouds is
            ``(B, N, 3)``: they are computed one after the other, and the results are stacked.
        grid: grid of φ.
        normals: ``(N, 3)`` outward normals, for the orientations ``"given"`` and ``"signs"``; of a batch ``(B, N, 3)``, or
            the same for all.
        options: options; ``checks`` has no effect, since there is no report.
        backend: as for :func:`isograd.reconstruct`; ``"cuda"`` for tensors on a CUDA device.

    Returns:
        ``(nx, ny, nz)`` or ``(B, nx, ny, nz)`` tensor of φ at the centers of the cells, in the unit of the points: negative inside.

    Raises:
        TypeError: no tensor, or integers or complex numbers.
        ValueError: another shape or device; points from which no surface can be made: not finite, too few, or closer
            than two cells to a wall of the grid.
        RuntimeError: an unavailable backend.
    """
    points, normals, settings = prepare(points, grid, normals, options, backend)
    sdf: Tensor = _signed_distance(points, normals, settings)[0]
    return sdf


# Operators say Optional and not `| None`: PyTorch reads their annotations, in every version the former.
@torch.library.custom_op("isograd::signed_distance", mutates_args=(), device_types=DEVICES)
def _signed_distance(
    points: Tensor, given: Optional[Tensor], settings: str
) -> tuple[Tensor, Tensor, Tensor]:
    """φ, and what its pullback needs: closest faces and normals."""
    found = saved(points, settings)
    call("isograd_forward", [points, given], found, settings)
    return found


@_signed_distance.register_fake
def _(points: Tensor, given: Optional[Tensor], settings: str) -> tuple[Tensor, Tensor, Tensor]:
    return saved(points, settings)


@torch.library.custom_op("isograd::signed_distance_pullback", mutates_args=(), device_types=DEVICES)
def _pullback(
    points: Tensor,
    given: Optional[Tensor],
    sdf: Tensor,
    closest: Tensor,
    normals: Tensor,
    sdf_bar: Tensor,
    settings: str,
) -> tuple[Tensor, Tensor]:
    """Cotangents of the points and of the given normals; the latter has no rows where none were given."""
    points_bar, given_bar = _empty_bars(points, given)
    bars = [points_bar] if given is None else [points_bar, given_bar]
    call("isograd_pullback", [points, sdf, closest, normals, sdf_bar, given], bars, settings)
    return points_bar, given_bar


@_pullback.register_fake
def _empty_bars(points: Tensor, given: Optional[Tensor], *_others: Any) -> tuple[Tensor, Tensor]:
    given_shape = (0, 3) if given is None else given.shape
    return points.new_empty(points.shape), points.new_empty(given_shape)


def _save(ctx: Any, inputs: tuple[Any, ...], output: tuple[Tensor, ...]) -> None:
    points, given, ctx.settings = inputs
    sdf, closest, normals = output
    ctx.save_for_backward(points, given, sdf, closest, normals)
    # Only φ is pulled back; the others are there to be saved.
    ctx.mark_non_differentiable(closest, normals)


def _backward(ctx: Any, sdf_bar: Tensor, *_unused: Tensor) -> tuple[Tensor | None, Tensor | None, None]:
    points, given, *saved = ctx.saved_tensors
    points_bar, given_bar = _pullback(points, given, *saved, sdf_bar, ctx.settings)
    return points_bar, None if given is None else given_bar, None


_signed_distance.register_autograd(_backward, setup_context=_save)


def _twice(ctx: Any, *_bars: Tensor) -> None:
    raise RuntimeError("isograd.torch.signed_distance can be differentiated once, not twice")


_pullback.register_autograd(_twice)


_signed_distance.register_vmap(one_by_one(_signed_distance))
_pullback.register_vmap(one_by_one(_pullback))
