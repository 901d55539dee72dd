"""Grids of cubic cells."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from . import _core
from ._arrays import floats
from ._inputs import read_input
from ._numbers import number, whole
from ._options import Outliers, OutliersLike, choice

if TYPE_CHECKING:
    from numpy.typing import DTypeLike

    from ._inputs import CloudLike


@dataclass(frozen=True)
class Grid:
    """A box of cubic cells. Fields have one value for each cell, at its center.

    Attributes:
        lower: corner of the box, ``(x, y, z)``, in the unit of the points.
        spacing: side of a cell, in the unit of the points.
        shape: number of cells along each axis, ``(nx, ny, nz)``.

    The center of cell ``(i, j, k)`` is ``lower + spacing * (i + 0.5, j + 0.5, k + 0.5)``.

    Raises:
        ValueError: a number is not finite, or there are no cells.
    """

    lower: tuple[float, float, float]
    spacing: float
    shape: tuple[int, int, int]

    def __post_init__(self) -> None:
        lower = tuple(number(x, "lower") for x in _three(self.lower, "lower"))
        shape = tuple(whole(n, "shape") for n in _three(self.shape, "shape"))
        object.__setattr__(self, "lower", lower)
        object.__setattr__(self, "spacing", number(self.spacing, "spacing"))
        object.__setattr__(self, "shape", shape)
        _core.check_grid(self.lower, self.spacing, self.shape)

    @classmethod
    def fit(
        cls,
        points: CloudLike,
        resolution: int | None = None,
        *,
        spacing: float | None = None,
        padding: float = 0.1,
        outliers: OutliersLike = Outliers.IGNORE,
    ) -> Grid:
        """A grid around a cloud.

        Args:
            points: ``(N, 3)``, or what else :func:`reconstruct` takes.
            resolution: cells on the longest side; 128 unless ``spacing`` is given.
            spacing: cell size, in the unit of the points, instead of a resolution.
            padding: distance to every wall, as a fraction of the longest side (at least 4 cells).
            outliers: whether samples that are far from all others, or in mid-air, count; see :class:`Outliers`.

        Raises:
            ValueError: no valid grid results, or both ``resolution`` and ``spacing`` are given.
        """
        if resolution is not None and spacing is not None:
            raise ValueError("give resolution or spacing, not both")
        if resolution is None and spacing is None:
            resolution = 128
        if resolution is not None:
            resolution = whole(resolution, "resolution")
        if spacing is not None:
            spacing = number(spacing, "spacing")
        padding = number(padding, "padding")
        kept = choice(Outliers, outliers, "outliers")
        cloud = floats(read_input(points).points, "points", (None, 3))
        return cls(*_core.fit_grid(cloud, resolution, spacing, padding, kept.value))

    @property
    def upper(self) -> tuple[float, float, float]:
        """The opposite corner of the box."""
        x, y, z = (low + self.spacing * n for low, n in zip(self.lower, self.shape))
        return (x, y, z)

    @property
    def origin(self) -> tuple[float, float, float]:
        """The center of cell ``(0, 0, 0)``."""
        x, y, z = (low + 0.5 * self.spacing for low in self.lower)
        return (x, y, z)

    @property
    def axes(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Coordinates of the cell centers along each axis: ``(nx,)`` x, ``(ny,)`` y and ``(nz,)`` z."""
        x, y, z = (
            low + self.spacing * (np.arange(n) + 0.5) for low, n in zip(self.lower, self.shape)
        )
        return (x, y, z)

    def centers(self, dtype: DTypeLike = np.float64) -> np.ndarray:
        """``(nx, ny, nz, 3)`` centers of all cells."""
        return np.stack(np.meshgrid(*self.axes, indexing="ij"), axis=-1).astype(dtype)


def _three(values: object, name: str) -> tuple[object, ...]:
    found: tuple[object, ...]
    try:
        found = tuple(values)  # type: ignore[arg-type]
    except TypeError:
        found = ()
    if len(found) != 3:
        raise ValueError(f"{name} is {values!r}; give three numbers, one for each axis")
    return found


def as_grid(grid: object) -> Grid:
    """The grid itself.

    Raises:
        TypeError: another type.
    """
    if isinstance(grid, Grid):
        return grid
    raise TypeError(f"grid is a {type(grid).__name__}; give an isograd.Grid")
