"""Checks and rules that the operators of `isograd.torch` share."""

from __future__ import annotations

from typing import Any

import numpy as np

from . import _settings
from ._grid import Grid
from ._options import Options

try:
    import torch
    from torch import Tensor
except ImportError as error:
    raise ImportError(f"isograd.torch needs PyTorch ({error}); install it by `pip install torch`") from error


# The text is the same whenever grid and options are: the compiler need not look inside.
@torch.compiler.assume_constant_result
def encode(
    grid: Grid, options: Options | None, normals_are_given: bool, backend: str, double: bool
) -> str:
    """Grid, options and backend as one text: see :func:`isograd._settings.encode_pure`."""
    return _settings.encode_pure(grid, options, normals_are_given, backend, double)


def checked(values: Tensor, name: str, columns: int | None = 3) -> Tensor:
    """A tensor of rows, of float32 or float64; half precision becomes float32.

    Raises:
        TypeError: no tensor, or of other numbers.
        ValueError: another device, layout or shape.
    """
    if not isinstance(values, Tensor):
        raise TypeError(f"{name} is a {type(values).__name__}; give a torch.Tensor")
    if values.device.type != "cpu":
        raise ValueError(f"{name} is on {values.device}; isograd takes tensors of the CPU: pass {name}.cpu()")
    if values.layout != torch.strided:
        raise ValueError(f"{name} is of the layout {values.layout}; pass {name}.to_dense()")
    if values.ndim != 2 or columns not in (None, values.shape[1]):
        wanted = "C" if columns is None else columns
        raise ValueError(f"{name} has the shape {tuple(values.shape)} and must have (N, {wanted})")
    if values.dtype in (torch.float16, torch.bfloat16):
        return values.to(torch.float32)
    if values.dtype not in (torch.float32, torch.float64):
        raise TypeError(f"{name} is of {values.dtype}; give float32 or float64")
    return values


def one_by_one(operator: Any) -> Any:
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


def array(tensor: Tensor | None) -> np.ndarray | None:
    """The values in C order; a copy only where the tensor has another order."""
    return None if tensor is None else tensor.detach().resolve_neg().contiguous().numpy()
