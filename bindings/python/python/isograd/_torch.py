"""Checks and rules that the operators of `isograd.torch` share."""

from __future__ import annotations

import functools
import inspect
import json
from collections.abc import Callable, Sequence
from typing import Any, TypeVar, cast

import numpy as np

from . import _core, _settings
from ._grid import Grid
from ._options import Options

try:
    import torch
    from torch import Tensor
    from torch.autograd import forward_ad
except ImportError as error:
    raise ImportError(f"isograd.torch needs PyTorch ({error}); install it by `pip install torch`") from error

__all__ = ["DEVICES", "Tensor", "array", "call", "checked", "grid_shape", "in_batches", "one_by_one", "prepare", "rows", "torch"]

Function = TypeVar("Function", bound=Callable[..., Any])

# Types of the devices whose tensors operators take.
DEVICES = ("cpu", "cuda") if hasattr(_core, "call_target_on_cuda") else ("cpu",)


# The text is the same whenever grid and options are: the compiler need not look inside.
@torch.compiler.assume_constant_result
def encode(
    grid: Grid, options: Options | None, normals_are_given: bool, backend: str, double: bool, sdf: bool
) -> str:
    """Grid, options and backend as one text: see :func:`isograd._settings.encode_pure`."""
    return _settings.encode_pure(grid, options, normals_are_given, backend, double, sdf)


def checked(values: Tensor, name: str, columns: int | None = 3) -> Tensor:
    """A tensor of rows, of float32 or float64; half precision becomes float32.

    Raises:
        TypeError: no tensor, or of other numbers.
        ValueError: another device, layout or shape.
        NotImplementedError: a derivative in forward mode, which PyTorch would take for 0.
    """
    if not isinstance(values, Tensor):
        raise TypeError(f"{name} is a {type(values).__name__}; give a torch.Tensor")
    if values.device.type not in DEVICES:
        has = " and of CUDA devices" if "cuda" in DEVICES else ""
        raise ValueError(f"{name} is on {values.device}; isograd takes tensors of the CPU{has}: pass {name}.cpu()")
    if values.layout != torch.strided:
        raise ValueError(f"{name} is of the layout {values.layout}; pass {name}.to_dense()")
    if values.ndim != 2 or columns not in (None, values.shape[1]):
        wanted = "C" if columns is None else columns
        raise ValueError(f"{name} has the shape {tuple(values.shape)} and must have (N, {wanted})")
    if not torch.compiler.is_compiling() and forward_ad.unpack_dual(values).tangent is not None:
        raise NotImplementedError(
            f"{name} has a tangent; isograd has no derivatives in forward mode (torch.func.jvp, jacfwd, linearize): "
            "use backward or torch.autograd.grad"
        )
    if values.dtype in (torch.float16, torch.bfloat16):
        return values.to(torch.float32)
    if values.dtype not in (torch.float32, torch.float64):
        raise TypeError(f"{name} is of {values.dtype}; give float32 or float64")
    return values


def prepare(
    points: Tensor, grid: Grid, normals: Tensor | None, options: Options | None, backend: str, sdf: bool = True
) -> tuple[Tensor, Tensor | None, str]:
    """Points and normals as :func:`checked`, and grid, options and backend as one text. Without ``sdf``, φ is not needed.

    Raises:
        TypeError, ValueError, RuntimeError: as :func:`checked` and :func:`encode`.
    """
    points = checked(points, "points")
    if normals is not None:
        normals = checked(normals, "normals").to(points.dtype)
    return points, normals, encode(grid, options, normals is not None, backend, points.dtype == torch.float64, sdf)


def rows(values: Tensor | None, points: Tensor) -> tuple[Tensor, bool | None]:
    """Values as ``(N, C)``, and whether they were ``(N,)``; ``(N, 0)`` and ``None`` for none.

    Raises:
        TypeError, ValueError: as :func:`checked`; another number of rows.
    """
    if values is None:
        return points.new_empty((len(points), 0)), None
    is_scalar = isinstance(values, Tensor) and values.ndim == 1
    found = checked(values[:, None] if is_scalar else values, "values", None).to(points.dtype)
    if len(found) != len(points) or found.shape[1] == 0:
        raise ValueError(f"values has the shape {tuple(values.shape)} and must have one row for each point")
    return found, is_scalar


def in_batches(function: Function) -> Function:
    """The function, also of a batch of clouds ``(B, N, 3)``: its results are then stacked. The other tensors are shared or,
    with one axis more, of one cloud each; ``values`` are always of one cloud each."""
    signature = inspect.signature(function)

    @functools.wraps(function)
    def apply(points: Tensor, *arguments: Any, **keywords: Any) -> Any:
        if not isinstance(points, Tensor) or points.ndim != 3:
            return function(points, *arguments, **keywords)
        if len(points) == 0:
            raise ValueError(f"points has the shape {tuple(points.shape)}; a batch has one cloud or more")
        given = signature.bind(points, *arguments, **keywords).arguments
        tensors = {name: value for name, value in given.items() if isinstance(value, Tensor)}
        batch = {name: value for name, value in tensors.items() if value.ndim == 3 or name == "values"}
        for name, value in batch.items():
            if len(value) != len(points):
                raise ValueError(f"{name} has the shape {tuple(value.shape)} in a batch of {len(points)} clouds")
        shared = {name: value for name, value in given.items() if name not in batch}
        clouds = [{name: value[i] for name, value in batch.items()} for i in range(len(points))]
        return _stacked([function(**cloud, **shared) for cloud in clouds])

    return cast(Function, apply)


def _stacked(results: Sequence[Any]) -> Any:
    """Results of the same structure, with all their tensors stacked."""
    first = results[0]
    if first is None:
        return None
    if not isinstance(first, Tensor):
        parts = [_stacked(column) for column in zip(*results)]
        return type(first)(*parts) if hasattr(first, "_fields") else tuple(parts)
    if any(result.shape != first.shape for result in results):
        raise ValueError("the surfaces of a batch differ in size: give max_vertices and max_faces")
    return torch.stack(list(results))


def call(
    name: str,
    inputs: Sequence[Tensor | None],
    outputs: Sequence[Tensor],
    settings: str,
    band: float | None = None,
    inside: bool = False,
) -> None:
    """Calls a target, on a GPU in the current stream. PyTorch hardly supports uint32: faces are int32 with the same bits.

    Raises:
        ValueError: tensors on different devices.
    """
    everything = [*(tensor for tensor in inputs if tensor is not None), *outputs]
    devices = {tensor.device for tensor in everything}
    if len(devices) > 1:
        raise ValueError(f"the tensors are on {' and '.join(sorted(map(str, devices)))}; move them to one device")
    if everything[0].is_cuda:
        _call_on_cuda(name, inputs, outputs, settings, band, inside)
        return

    def bits(tensor: Tensor) -> np.ndarray:
        found = array(tensor)
        return found.view(np.uint32) if found.dtype == np.int32 else found

    given = [bits(tensor) for tensor in inputs if tensor is not None]
    _core.call_target(name, given, [bits(tensor) for tensor in outputs], settings, band, inside)


def _call_on_cuda(
    name: str,
    inputs: Sequence[Tensor | None],
    outputs: Sequence[Tensor],
    settings: str,
    band: float | None,
    inside: bool,
) -> None:
    # Kept until the call is done.
    given = [_dense(tensor) for tensor in inputs if tensor is not None]
    kinds = {torch.float32: "float32", torch.float64: "float64", torch.int32: "uint32"}

    def described(tensor: Tensor) -> tuple[int, list[int], str]:
        return tensor.data_ptr(), list(tensor.shape), kinds[tensor.dtype]

    stream = torch.cuda.current_stream(outputs[0].device).cuda_stream
    written = [described(tensor) for tensor in outputs]
    _core.call_target_on_cuda(
        name, [described(tensor) for tensor in given], written, stream, settings, band, inside
    )


def grid_shape(settings: str) -> tuple[int, int, int]:
    """Cells along each axis."""
    return tuple(json.loads(settings)["grid"]["shape"])


def one_by_one(operator: Any) -> Any:
    """A ``torch.vmap`` rule that calls an operator for one member of the batch after the other."""

    def apply(info: Any, axes: tuple[int | None, ...], *batch: Any) -> tuple[tuple[Tensor, ...], tuple[int, ...]]:
        if info.batch_size == 0:
            raise ValueError("vmap over an empty batch: give one cloud or more")
        calls = [
            operator(*(x.select(axis, i) if isinstance(axis, int) else x for x, axis in zip(batch, axes)))
            for i in range(info.batch_size)
        ]
        outputs = tuple(torch.stack(output) for output in zip(*calls))
        return outputs, (0,) * len(outputs)

    return apply


def array(tensor: Tensor) -> np.ndarray:
    """The values in C order; a copy only where the tensor has another order."""
    found: np.ndarray = _dense(tensor).numpy()
    return found


def _dense(tensor: Tensor) -> Tensor:
    return tensor.detach().resolve_neg().contiguous()
