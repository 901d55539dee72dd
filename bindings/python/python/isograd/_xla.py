"""Calls of the targets in Rust from JAX, for `isograd.jax`."""

from __future__ import annotations

import os
import threading
import warnings
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import jax
import jax.numpy as jnp
import numpy as np

from . import _core, _settings

if TYPE_CHECKING:
    from jax.typing import ArrayLike

    from ._grid import Grid
    from ._options import Options


@dataclass(frozen=True)
class Plan:
    """Static arguments: grid, options and backend as one text, and the shape of fields."""

    settings: str
    shape: tuple[int, int, int]
    band: float | None = None
    """Distance up to which an attribute is extended, in the unit of the points."""
    inside: bool = False
    """Whether an attribute is extended to all cells inside."""

    def saved(self, points: jax.Array) -> tuple[jax.ShapeDtypeStruct, ...]:
        """φ, closest faces and normals, which a pullback needs besides its inputs."""
        sdf = jax.ShapeDtypeStruct(self.shape, points.dtype)
        closest = jax.ShapeDtypeStruct(self.shape, np.uint32)
        return (sdf, closest, *like(points))


def like(*arrays: jax.Array | None) -> tuple[jax.ShapeDtypeStruct, ...]:
    """Shapes and types of those arrays that are not ``None``."""
    return tuple(jax.ShapeDtypeStruct(a.shape, a.dtype) for a in arrays if a is not None)


def pair(bars: Sequence[jax.Array]) -> tuple[jax.Array, jax.Array | None]:
    """Cotangents of points and normals; ``None`` for normals that are not inputs."""
    return bars[0], bars[1] if len(bars) > 1 else None


def prepare(
    points: ArrayLike,
    grid: Grid,
    normals: ArrayLike | None,
    options: Options | None,
    backend: str,
    sdf: bool = True,
) -> tuple[Plan, jax.Array, jax.Array | None]:
    """Checks the arguments that are known while tracing. Without ``sdf``, φ is not needed.

    Raises:
        TypeError: an argument of another type.
        ValueError: another shape; normals that are missing or not used.
        RuntimeError: an unavailable backend.
    """
    points = floats(points, "points", (None, 3))
    if normals is not None:
        normals = floats(normals, "normals", points.shape, points.dtype)
    double = points.dtype == jnp.float64
    settings = _settings.encode_pure(grid, options, normals is not None, backend, double, sdf)
    return Plan(settings, grid.shape), points, normals


def floats(
    values: ArrayLike, name: str, shape: tuple[int | None, ...], dtype: Any = None
) -> jax.Array:
    """An array of ``dtype``, or of float32 or float64 if there is none; ``None`` in the shape is any length.

    Raises:
        TypeError: no array of real numbers.
        ValueError: another shape.
    """
    try:
        array = jnp.asarray(values)
    except (TypeError, ValueError) as error:
        raise TypeError(f"{name} can't be read as an array: {error}") from None
    if jnp.issubdtype(array.dtype, jnp.integer):
        array = array.astype(float)
    elif not jnp.issubdtype(array.dtype, jnp.floating):
        raise TypeError(f"{name} is of {array.dtype}; give float32 or float64")
    elif array.dtype not in (jnp.float32, jnp.float64):
        array = array.astype(jnp.float32)
    fits = len(array.shape) == len(shape) and all(
        n in (None, m) for n, m in zip(shape, array.shape)
    )
    if not fits:
        wanted = ", ".join("NC"[axis] if n is None else str(n) for axis, n in enumerate(shape))
        batch = "; for a batch use jax.vmap" if array.ndim > len(shape) else ""
        raise ValueError(f"{name} has the shape {array.shape} and must have ({wanted}){batch}")
    return array if dtype is None else array.astype(dtype)


def call(
    name: str,
    plan: Plan,
    results: tuple[jax.ShapeDtypeStruct, ...],
    *arrays: jax.Array | None,
) -> tuple[jax.Array, ...]:
    """Calls a target: by XLA, or through Python if ``ISOGRAD_JAX_CALLBACK`` is set. Arrays on other devices are errors."""
    present = [array for array in arrays if array is not None]
    attributes: dict[str, Any] = {"settings": plan.settings}
    if plan.band is not None:
        attributes["band"] = np.float64(plan.band)
    if plan.inside:
        attributes["inside"] = np.float64(1)

    def by_callback(*arrays: jax.Array) -> tuple[jax.Array, ...]:
        callback = _Callback(name, results, plan)
        return tuple(jax.pure_callback(callback, results, *arrays, vmap_method="broadcast_all"))

    def by_handler(*arrays: jax.Array) -> tuple[jax.Array, ...]:
        handler = jax.ffi.ffi_call(name, results, vmap_method="broadcast_all")
        return tuple(handler(*arrays, **attributes))

    def by_refusal(*arrays: jax.Array) -> tuple[jax.Array, ...]:
        return tuple(jax.pure_callback(refuse, results, *arrays, vmap_method="broadcast_all"))

    platforms = _platforms()
    if not platforms:
        return by_callback(*present)
    handlers = dict.fromkeys(platforms, by_handler)
    return tuple(jax.lax.platform_dependent(*present, **handlers, default=by_refusal))


def refuse(*_arrays: ArrayLike) -> tuple[np.ndarray, ...]:
    """Rejects arrays on a device, since copies are made on request only.

    Raises:
        ValueError: always.
    """
    raise ValueError(
        "isograd.jax takes arrays of the CPU, and with CUDA built in those of a CUDA device, and these are on another one: "
        'put them on jax.devices("cpu")[0], or set ISOGRAD_JAX_CALLBACK=1 in the environment, and they are copied to the CPU '
        "and back at every call"
    )


@dataclass(frozen=True)
class _Callback:
    """A target as a function of NumPy arrays, with equality by value, so that JAX compiles once."""

    name: str
    results: tuple[jax.ShapeDtypeStruct, ...]
    plan: Plan

    def __call__(self, *arrays: ArrayLike) -> tuple[np.ndarray, ...]:
        inputs = [np.require(array, requirements=["C", "A"]) for array in arrays]
        batch = inputs[0].shape[:-2]
        outputs = [np.empty(batch + result.shape, result.dtype) for result in self.results]
        plan = self.plan
        _core.call_target(self.name, inputs, outputs, plan.settings, plan.band, plan.inside)
        return tuple(outputs)


_lock = threading.Lock()
_registered: tuple[str, ...] | None = None


def _platforms() -> tuple[str, ...]:
    """JAX's names of the platforms whose handlers are registered with XLA, which happens on the first call."""
    global _registered
    if os.environ.get("ISOGRAD_JAX_CALLBACK", "0") not in ("", "0"):
        return ()
    with _lock:
        if _registered is None:
            _registered = _register()
        return _registered


def _register() -> tuple[str, ...]:
    platforms = _core.xla_targets()
    try:
        for platform, targets in platforms.items():
            for name, capsule in targets.items():
                jax.ffi.register_ffi_target(name, capsule, platform=platform)
    except Exception as error:  # any exception of another version of JAX
        warnings.warn(
            f"this JAX does not take isograd's handlers ({error}); jax.pure_callback is used instead, "
            "with the same results",
            RuntimeWarning,
            stacklevel=2,
        )
        return ()
    # XLA says CUDA where JAX says cuda.
    return tuple(platform.lower() for platform in platforms)
