"""Signed distance of points for PyTorch: inside ``autograd``, ``vmap`` and ``torch.compile``.

Tensors are on the CPU, and computations use their number type. With another ``backend``, points, φ and their cotangents
are copied to the device and back at every call. The operators are registered with
``torch.library`` as ``isograd::signed_distance`` and ``isograd::signed_distance_pullback``. ``torch.func.grad``
does not support custom operators: call ``torch.autograd.grad``. Needs PyTorch 2.5.
"""

from __future__ import annotations

from typing import Any, Optional

import numpy as np

from . import _pure, _settings
from ._grid import Grid
from ._options import Options

try:
    import torch
    from torch import Tensor
except ImportError as error:
    raise ImportError(f"isograd.torch needs PyTorch ({error}); install it by `pip install torch`") from error

__all__ = ["signed_distance"]


def signed_distance(
    points: Tensor,
    grid: Grid,
    *,
    normals: Tensor | None = None,
    options: Options | None = None,
    backend: str = "cpu",
) -> Tensor:
    """φ: the signed distance to the surface through the points.

    Differentiable once in ``points``, and in ``normals`` with ``orient="given"``. Held constant: which points are
    neighbors, the sides of the normals, which face is closest to a cell, and with ``radius="auto"`` the radius.

    Args:
        points: ``(N, 3)``, float32 or float64, on the CPU. float16 and bfloat16 become float32.
        grid: grid of φ.
        normals: ``(N, 3)`` outward normals, for the orientations ``"given"`` and ``"signs"``.
        options: options; ``checks`` has no effect, since there is no report.
        backend: as for :func:`isograd.reconstruct`. On a device the pullback reconstructs again.

    Returns:
        ``grid.shape`` tensor of φ at the centers of the cells, in the unit of the points: negative inside.

    Raises:
        TypeError: no tensor, or integers or complex numbers.
        ValueError: another shape or device; points from which no surface can be made: not finite, too few, or closer
            than two cells to a wall of the grid.
        RuntimeError: an unavailable backend.
    """
    points = _checked(points, "points")
    if normals is not None:
        normals = _checked(normals, "normals").to(points.dtype)
    double = points.dtype == torch.float64
    settings = _encode(grid, options, normals is not None, backend, double)
    return _signed_distance(points, normals, settings)[0]


# The text is the same whenever grid and options are: the compiler need not look inside.
@torch.compiler.assume_constant_result
def _encode(
    grid: Grid, options: Options | None, normals_are_given: bool, backend: str, double: bool
) -> str:
    return _settings.encode_pure(grid, options, normals_are_given, backend, double)


def _checked(values: Tensor, name: str) -> Tensor:
    if not isinstance(values, Tensor):
        raise TypeError(f"{name} is a {type(values).__name__}; give a torch.Tensor")
    if values.device.type != "cpu":
        raise ValueError(f"{name} is on {values.device}; isograd takes tensors of the CPU: pass {name}.cpu()")
    if values.layout != torch.strided:
        raise ValueError(f"{name} is of the layout {values.layout}; pass {name}.to_dense()")
    if values.ndim != 2 or values.shape[1] != 3:
        raise ValueError(f"{name} has the shape {tuple(values.shape)} and must have (N, 3)")
    if values.dtype in (torch.float16, torch.bfloat16):
        return values.to(torch.float32)
    if values.dtype not in (torch.float32, torch.float64):
        raise TypeError(f"{name} is of {values.dtype}; give float32 or float64")
    return values


# Operators say Optional and not `| None`: PyTorch reads their annotations, in every version the former.
@torch.library.custom_op("isograd::signed_distance", mutates_args=(), device_types="cpu")
def _signed_distance(
    points: Tensor, given: Optional[Tensor], settings: str
) -> tuple[Tensor, Tensor, Tensor]:
    """φ, and what its pullback needs: closest faces and normals."""
    sdf, closest, normals = _pure.forward(settings, _array(points), _array(given))
    # PyTorch hardly supports uint32: the same bits as int32.
    arrays = (sdf, closest.view(np.int32), normals)
    return tuple(torch.from_numpy(array) for array in arrays)  # type: ignore[return-value]


@_signed_distance.register_fake
def _(points: Tensor, given: Optional[Tensor], settings: str) -> tuple[Tensor, Tensor, Tensor]:
    shape = _pure.grid_shape(settings)
    closest = points.new_empty(shape, dtype=torch.int32)
    return points.new_empty(shape), closest, points.new_empty(points.shape)


@torch.library.custom_op("isograd::signed_distance_pullback", mutates_args=(), device_types="cpu")
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
    saved = (_array(sdf), _array(closest).view(np.uint32), _array(normals))
    bars = _pure.pullback(settings, _array(points), _array(given), saved, _array(sdf_bar))
    given_bar = torch.from_numpy(bars[1]) if len(bars) > 1 else points.new_empty((0, 3))
    return torch.from_numpy(bars[0]), given_bar


@_pullback.register_fake
def _(
    points: Tensor,
    given: Optional[Tensor],
    sdf: Tensor,
    closest: Tensor,
    normals: Tensor,
    sdf_bar: Tensor,
    settings: str,
) -> tuple[Tensor, Tensor]:
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


def _one_by_one(operator: Any) -> Any:
    """A ``torch.vmap`` rule that calls an operator for one member of the batch after the other."""

    def apply(info: Any, axes: tuple[int | None, ...], *batch: Any) -> tuple[tuple[Tensor, ...], tuple[int, ...]]:
        if info.batch_size == 0:
            raise ValueError("vmap over an empty batch: give one cloud or more")
        calls = [
            operator(*(x if axis is None else x.select(axis, i) for x, axis in zip(batch, axes)))
            for i in range(info.batch_size)
        ]
        outputs = tuple(torch.stack(output) for output in zip(*calls))
        return outputs, (0,) * len(outputs)

    return apply


_signed_distance.register_vmap(_one_by_one(_signed_distance))
_pullback.register_vmap(_one_by_one(_pullback))


def _array(tensor: Tensor | None) -> np.ndarray | None:
    """The values in C order; a copy only where the tensor has another order."""
    return None if tensor is None else tensor.detach().resolve_neg().contiguous().numpy()
