"""Parametric shapes with exact points, normals and derivatives."""

from __future__ import annotations

from functools import partial
from typing import TYPE_CHECKING, Any, Literal, NamedTuple

import numpy as np

from . import _core
from ._arrays import floats, indices, summary
from ._numbers import number, whole

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from numpy.typing import ArrayLike, DTypeLike

    from ._shape_jax import Material


class Coordinates(NamedTuple):
    """Surface coordinates of ``N`` samples: the same material points for any parameters."""

    patch: np.ndarray
    """``(N,)`` uint32."""
    uv: np.ndarray
    """``(N, 2)`` from 0 to 1."""

    def __repr__(self) -> str:
        return summary(self)


class Samples(NamedTuple):
    """Samples of a shape."""

    points: np.ndarray
    """``(N, 3)``."""
    normals: np.ndarray
    """``(N, 3)`` outward unit normals."""
    velocity: np.ndarray | None
    """``(N, 3)`` velocity of a moving shape; ``None`` for others."""
    coordinates: Coordinates
    """Surface coordinates of the samples."""

    def __repr__(self) -> str:
        return summary(self)


class Parameter(NamedTuple):
    """A parameter of a shape."""

    name: str
    meaning: str
    unit: str
    default: float
    min: float
    max: float
    whole: bool


class Shape:
    """A parametric shape: ``Shape("fish", width1=0.04)``. :func:`shapes` lists all. Shapes of the same name and values are
    equal.

    Raises:
        ValueError: an unknown shape or parameter, or a value out of range; the message lists the valid ones.
    """

    def __init__(self, name: str, **parameters: float) -> None:
        values = [(key, number(value, key)) for key, value in parameters.items()]
        self._core = _core.Shape(str(name), values)

    def __repr__(self) -> str:
        return f"Shape({self.name!r})"

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, Shape):
            return NotImplemented
        return self.name == other.name and self.values == other.values

    def __hash__(self) -> int:
        return hash((self.name, *self.values.items()))

    def __reduce__(self) -> tuple[Any, ...]:
        return partial(type(self), self.name, **self.values), ()

    @property
    def name(self) -> str:
        """Its name."""
        return self._core.name()

    @property
    def parameters(self) -> dict[str, Parameter]:
        """Descriptions of the parameters, in order."""
        return {entry[0]: Parameter(*entry) for entry in self._core.parameters()}

    @property
    def values(self) -> dict[str, float]:
        """The values of its parameters, in order."""
        return dict(self._core.values())

    @property
    def area(self) -> float:
        """Area of its surface."""
        return self._core.area()

    @property
    def volume(self) -> float:
        """Its volume."""
        return self._core.volume()

    def replace(self, **parameters: float) -> Shape:
        """A copy with some parameters changed."""
        return Shape(self.name, **{**self.values, **parameters})

    def sample(
        self,
        n: int,
        *,
        seed: int = 1,
        layout: Literal["even", "random"] = "even",
        density: tuple[int, float] | None = None,
        dtype: DTypeLike = np.float64,
    ) -> Samples:
        """``n`` samples of the surface; the same seed gives the same samples.

        Args:
            layout: ``"even"`` (blue noise) or ``"random"``.
            density: ``(axis, ratio)``: ratio of the samples per area at the high and the low end of an axis.
            dtype: float32 or float64.
        """
        if layout not in ("even", "random"):
            raise ValueError(f"layout is {layout!r}; give 'even' or 'random'")
        dtype = np.dtype(dtype)
        if dtype not in (np.float32, np.float64):
            raise TypeError(f"dtype is {dtype}; give float32 or float64")
        n, seed = whole(n, "n"), whole(seed, "seed")
        if n < 1 or seed < 0:
            raise ValueError(f"{n} samples with seed {seed}; give at least 1, and a seed of 0 or more")
        single = dtype == np.float32
        points, normals, velocity, patch, uv = self._core.sample(
            n, seed, layout == "even", density, single
        )
        return Samples(points, normals, velocity, Coordinates(patch, uv))

    def points_at(self, coordinates: Coordinates) -> tuple[np.ndarray, np.ndarray]:
        """``(N, 3)`` points and outward normals at surface coordinates, float64."""
        return self._core.points_at(*_checked(coordinates))

    def pullback(self, coordinates: Coordinates, points_bar: ArrayLike) -> dict[str, float]:
        """Cotangent of each parameter, from those of the points ``(N, 3)`` at fixed coordinates."""
        patch, uv = _checked(coordinates)
        bar = floats(points_bar, "points_bar", (len(patch), 3))
        return dict(zip(self.values, self._core.pullback(patch, uv, bar)))

    def jax(self, coordinates: Coordinates, free: Sequence[str] = ()) -> Callable[..., Material]:
        """A JAX function of the values of ``free`` parameters and the time: material points, normals and velocities.

        ``f(values, time)`` with ``(len(free),)`` values gives an ``isograd.jax.Material`` of three ``(N, 3)`` arrays, in
        JAX's default float type. It works inside ``jit``, ``scan`` and ``vmap``, and is differentiable in both arguments
        in reverse mode. It is computed on the host in double precision; velocities are central differences over ±1e-4
        units of time, and so are cotangents of normals over ±1e-5 of the surface coordinates.

        Args:
            coordinates: those of samples, such as ``shape.sample(1000).coordinates``.
            free: names of the parameters that are given as values; the others keep those of this shape.

        Raises:
            ValueError: an unknown or whole parameter, ``"time"``, or coordinates of another shape.
        """
        from ._shape_jax import function

        return function(self, coordinates, free)


def _checked(coordinates: Coordinates) -> tuple[np.ndarray, np.ndarray]:
    patch, uv = coordinates
    patch = indices(patch, "patch", (None,))
    return patch, floats(uv, "uv", (len(patch), 2), np.float64)


def shapes() -> dict[str, str]:
    """Name and summary of every shape."""
    return dict(_core.shapes())


def sample(shape: str, n: int, **parameters: object) -> Samples:
    """``n`` samples of a shape: ``sample("fish", 20_000, seed=3, width1=0.04)``; see :meth:`Shape.sample`."""
    drawing = {"seed", "layout", "density", "dtype"}
    how = {key: value for key, value in parameters.items() if key in drawing}
    of = {key: value for key, value in parameters.items() if key not in drawing}
    return Shape(shape, **of).sample(n, **how)  # type: ignore[arg-type]
