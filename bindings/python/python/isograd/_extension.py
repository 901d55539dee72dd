"""Attributes of the samples, extended to the surface and its neighborhood."""

from __future__ import annotations

from functools import cached_property
from typing import Any

import numpy as np

from . import _core
from ._grid import Grid
from ._stored import Stored


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
