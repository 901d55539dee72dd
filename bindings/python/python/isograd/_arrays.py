"""Conversion of arguments to the arrays of the extension module; nothing is reinterpreted or truncated silently."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import fields, is_dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import DTypeLike


def floats(values: object, name: str, shape: tuple[int | None, ...], dtype: DTypeLike | None = None) -> np.ndarray:
    """A float32 or float64 array: C-contiguous, aligned, of the native byte order.

    float32 and float64 are unchanged, float16 becomes float32, integers become float64.

    Args:
        values: anything that NumPy converts to an array.
        name: name in error messages.
        shape: expected shape; ``None`` for any length.
        dtype: type of the result, such as that of the points; ``None`` for either.

    Raises:
        TypeError: numbers that would lose precision, or no array of numbers.
        ValueError: another shape.
    """
    if isinstance(values, np.ma.MaskedArray):
        raise TypeError(f"{name} is a masked array; fill it or drop what is masked")
    _check_memory(values, name)
    try:
        array = np.asarray(values)
    except (ValueError, TypeError, RuntimeError) as error:
        raise TypeError(f"{name} can't be read as an array: {error}") from None
    kind = array.dtype.kind
    if kind == "f" and array.dtype.itemsize in (4, 8):
        wanted = array.dtype.newbyteorder("=")
    elif kind == "f" and array.dtype.itemsize == 2:
        wanted = np.dtype(np.float32)
    elif kind in "iu":
        wanted = np.dtype(np.float64)
    else:
        raise TypeError(f"{name} is of {array.dtype}; give float32 or float64")
    if dtype is not None:
        wanted = np.dtype(dtype)
    _check_shape(array.shape, name, shape)
    return np.require(array, dtype=wanted, requirements=["C", "A"])


def cotangent(values: object, name: str, shape: tuple[int | None, ...], dtype: DTypeLike) -> np.ndarray:
    """The cotangent of a result, as :func:`floats`.

    Raises:
        TypeError, ValueError: as :func:`floats`, and a number that is not finite.
    """
    found = floats(values, name, shape, dtype)
    if not np.isfinite(found).all():
        index = tuple(int(i) for i in np.argwhere(~np.isfinite(found))[0])
        raise ValueError(f"{name} is not finite at entry {index}; correct the function that computes it")
    return found


def indices(values: object, name: str, shape: tuple[int | None, ...]) -> np.ndarray:
    """A uint32 array, C-contiguous and aligned, from whole numbers.

    Raises:
        TypeError: no array of whole numbers.
        ValueError: another shape, or numbers outside 0 to 2³² − 1.
    """
    array = np.asarray(values)
    if array.dtype.kind not in "iu" and array.size:
        raise TypeError(f"{name} is of {array.dtype}; give whole numbers")
    _check_shape(array.shape, name, shape)
    if array.size and (array.min() < 0 or array.max() > 0xFFFF_FFFF):
        raise ValueError(f"{name} has entries from {array.min()} to {array.max()}; give 0 to 2**32 - 1")
    return np.require(array, dtype=np.uint32, requirements=["C", "A"])


def known(
    cloud: np.ndarray, normals: object | None, sensors: Any
) -> tuple[np.ndarray | None, np.ndarray | None]:
    """``(N, 3)`` normals and ``(M, 3)`` sensors for a cloud, in its type; one sensor may be ``(3,)``.

    Raises:
        TypeError, ValueError: as :func:`floats`.
    """
    if normals is not None:
        normals = floats(normals, "normals", cloud.shape, cloud.dtype)
    if sensors is not None:
        sensors = [sensors] if np.ndim(sensors) == 1 else sensors
        sensors = floats(sensors, "sensors", (None, 3), cloud.dtype)
    return normals, sensors


def summary(record: object) -> str:
    """Text of a named tuple or a dataclass, with the shape and type of each array in place of its values."""
    values = (
        {field.name: getattr(record, field.name) for field in fields(record)}
        if is_dataclass(record)
        else record._asdict()  # type: ignore[attr-defined]
    )
    texts = ", ".join(f"{name}={_short(value)}" for name, value in values.items())
    return f"{type(record).__name__}({texts})"


def _short(value: object) -> str:
    if isinstance(value, np.ndarray):
        return f"{value.shape} {value.dtype}"
    if isinstance(value, Mapping):
        return "{" + ", ".join(f"{key!r}: {_short(entry)}" for key, entry in value.items()) + "}"
    return repr(value)


# DLPack device types with CPU memory: CPU, and memory shared with CUDA and ROCm devices.
_CPU_DEVICES = {1, 3, 11, 13}


def _check_memory(values: object, name: str) -> None:
    """Checks that an array with a known device is in memory that the CPU can read.

    Raises:
        TypeError: it is in the memory of a device.
    """
    where = getattr(values, "__dlpack_device__", None)
    if where is None or isinstance(values, np.ndarray):
        return
    try:
        kind = int(where()[0])
    except Exception:  # tracers, sharded arrays and others without a single device
        return
    if kind not in _CPU_DEVICES:
        raise TypeError(
            f"{name} is in the memory of a device, and this function takes arrays of the CPU: copy it, "
            "with .cpu() of PyTorch, numpy.asarray of JAX, .get() of CuPy"
        )


def _check_shape(found: tuple[int, ...], name: str, shape: tuple[int | None, ...]) -> None:
    fits = len(found) == len(shape) and all(n is None or n == m for n, m in zip(shape, found))
    if not fits:
        letters = iter("NMKL")
        wanted = ", ".join(next(letters) if n is None else str(n) for n in shape)
        comma = "," if len(shape) == 1 else ""
        raise ValueError(f"{name} has the shape {found} and must have ({wanted}{comma})")
