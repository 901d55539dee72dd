"""Reconstruction and pullback as a pair of pure functions of NumPy arrays, over the targets in Rust: what JAX and PyTorch
are compared with."""

from __future__ import annotations

import json

import numpy as np

from isograd import _core

Saved = tuple[np.ndarray, np.ndarray, np.ndarray]
"""φ, closest faces and normals: what the pullback needs besides its inputs."""


def forward(settings: str, points: np.ndarray, normals: np.ndarray | None = None) -> Saved:
    """φ, closest faces and normals of a cloud.

    Raises:
        TypeError, ValueError, RuntimeError: errors of the settings, the arrays and the device.
    """
    shape = grid_shape(settings)
    saved = (np.empty(shape, points.dtype), np.empty(shape, np.uint32), np.empty_like(points))
    _core.call_target("isograd_forward", _given(points, normals), saved, settings)
    return saved


def pullback(
    settings: str, points: np.ndarray, normals: np.ndarray | None, saved: Saved, sdf_bar: np.ndarray
) -> list[np.ndarray]:
    """Cotangents of the points and, where they are given, of the normals, from the cotangent of φ.

    Raises:
        TypeError, ValueError, RuntimeError: as :func:`forward`.
    """
    bars = [np.empty_like(array) for array in _given(points, normals)]
    inputs = [points, *saved, sdf_bar, *_given(normals)]
    _core.call_target("isograd_pullback", inputs, bars, settings)
    return bars


def grid_shape(settings: str) -> tuple[int, int, int]:
    """Cells along each axis."""
    return tuple(json.loads(settings)["grid"]["shape"])


def _given(*arrays: np.ndarray | None) -> list[np.ndarray]:
    return [array for array in arrays if array is not None]
