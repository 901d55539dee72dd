"""Places of a surface's values: cell centers, offsets in cells, other grids, and positions."""

from __future__ import annotations

from typing import Any

import numpy as np

from ._grid import Grid
from ._numbers import number
from ._options import length

Offset = tuple[float, float, float]
CENTER: Offset = (0.5, 0.5, 0.5)
NO_FACE = 0xFFFF_FFFF
"""Closest face of a place beyond the band."""


def band_width(band: object, grid: Grid, cells: float, *words: str) -> float:
    """Width of a band in the unit of the points: of ``"auto"`` so many cells, of ``"full"``, if allowed, infinite.

    Raises:
        ValueError: neither a finite number above 0 nor one of the words.
    """
    width = length(band, "band", "auto", *words)
    if isinstance(width, str):
        return cells * grid.spacing if width == "auto" else np.inf
    return width


def axes_at(grid: Grid, offset: Offset, dtype: np.typing.DTypeLike) -> list[np.ndarray]:
    """Coordinates along each axis of the places at an offset from the lower corner of each cell, in cells."""
    return [
        (low + grid.spacing * (np.arange(n) + shift)).astype(dtype)
        for low, n, shift in zip(grid.lower, grid.shape, offset)
    ]


def on_grids(places: object, grid: Grid) -> list[tuple[Grid, Offset]] | None:
    """Grid and offset of each part of the places; ``None`` for positions in an array.

    Raises:
        TypeError, ValueError: an offset that is not three finite numbers.
    """
    if places is None:
        return [(grid, CENTER)]
    if isinstance(places, Grid):
        return [(places, CENTER)]
    if not isinstance(places, tuple):
        return None
    return [(grid, _offset(offset)) for offset in (places if is_many(places) else (places,))]


def are_centers(parts: list[tuple[Grid, Offset]] | None, grid: Grid) -> bool:
    """Whether the places are the cell centers of the grid of φ, where a search is not needed."""
    return parts == [(grid, CENTER)]


def shaped(found: tuple[Any, ...], shape: tuple[int, ...], is_scalar: bool | None) -> tuple[Any, ...]:
    """Distances, normals, closest points and values ``(M, C)`` at ``M`` places, as arrays of their shape.

    Values lose their axis if they are scalars; ``None`` if that is ``None``, for no values.
    """
    sdf, normal, closest, values = found
    vector = (*shape, 3)
    if is_scalar is None:
        values = None
    else:
        values = values.reshape(shape if is_scalar else (*shape, values.shape[1]))
    return sdf.reshape(shape), normal.reshape(vector), closest.reshape(vector), values


def is_many(places: object) -> bool:
    """Whether the places are a tuple of offsets, with one result each."""
    return isinstance(places, tuple) and any(isinstance(offset, tuple) for offset in places)


def _offset(offset: object) -> Offset:
    if isinstance(offset, tuple) and len(offset) == 3:
        x, y, z = (number(shift, "places") for shift in offset)
        if np.isfinite([x, y, z]).all():
            return x, y, z
    raise ValueError(
        f"places has the offset {offset!r}; give three finite numbers, such as (1, 0.5, 0.5), or positions as an array"
    )
