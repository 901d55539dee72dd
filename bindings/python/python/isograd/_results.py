"""Parts of the results of a reconstruction: extended attributes, and cotangents."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from . import _core
from ._arrays import summary
from ._grid import Grid
from ._stored import Stored


@dataclass(frozen=True, eq=False)
class Gradients:
    """Cotangents of the inputs of a reconstruction: the derivative of a loss in each input.

    Attributes:
        points: ``(N, 3)``.
        normals: ``(N, 3)`` of the given normals; ``None`` where normals were estimated.
        attributes: of each extended attribute, ``(N, components)``.
        lower: of the grid's corner, at fixed points.
        spacing: of the grid's cell size, at fixed points.
        guarded: number of places where a derivative is undefined or unbounded and was replaced by a bounded one.
    """

    points: np.ndarray
    normals: np.ndarray | None
    attributes: dict[str, np.ndarray]
    lower: tuple[float, float, float]
    spacing: float
    guarded: int

    def __repr__(self) -> str:
        return summary(self)


class Extension(Stored):
    """An attribute of the samples, extended to the surface and to the cells inside and near it.

    A pickle has its arrays, but no pullback.
    """

    def __init__(self, core: _core.Extension, name: str, grid: Grid) -> None:
        self._core = core
        self.name = name
        """Name of the attribute."""
        self.grid = grid
        """The grid."""

    def __getstate__(self) -> dict[str, Any]:
        return self._state("vertices", "cells", "values")

    @cached_property
    def _core(self) -> _core.Extension:
        raise RuntimeError(
            "this extension was unpickled, and has no pullback; give what extend() of the reconstruction returns"
        )

    @cached_property
    def vertices(self) -> np.ndarray:
        """``(V, components)`` at the vertices of the mesh (of ``closest_mesh``)."""
        return self._core.array("vertices")

    @cached_property
    def cells(self) -> np.ndarray:
        """``(B,)`` flat indices of the cells: ``numpy.unravel_index(cells, grid.shape)``."""
        return self._core.array("cells")

    @cached_property
    def values(self) -> np.ndarray:
        """``(B, components)`` at those cells."""
        return self._core.array("values")

    def dense(self, fill: float = 0.0) -> np.ndarray:
        """``(nx, ny, nz, components)``, with ``fill`` at the other cells."""
        components = self.values.shape[1]
        out = np.full((*self.grid.shape, components), fill, dtype=self.values.dtype)
        out.reshape(-1, components)[self.cells] = self.values
        return out
