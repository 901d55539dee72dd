"""Places of a surface's values: cell centers, offsets in cells, other grids, and positions."""

from __future__ import annotations

from typing import Literal

import numpy as np

from ._grid import Grid
from ._numbers import number

Offset = tuple[float, float, float]
Fill = Literal["inside", "band"]
CENTER: Offset = (0.5, 0.5, 0.5)
NO_FACE = 0xFFFF_FFFF
"""Closest face of a place beyond the band."""
AUTO_BAND = 4.0
"""Automatic width of the band, in cells."""


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
