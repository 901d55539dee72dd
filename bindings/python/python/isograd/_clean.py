"""Cleaning and thinning of a cloud before its reconstruction."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from . import _core
from ._arrays import floats
from ._files import Cloud
from ._numbers import number, whole
from ._reconstruction import _attributes

if TYPE_CHECKING:
    from numpy.typing import ArrayLike


@dataclass(frozen=True, eq=False)
class Cleaned:
    """The samples of a cloud that are kept, unchanged and in their order.

    Attributes:
        indices: ``(K,)`` uint32, ascending: indices of the samples that are kept.
        points: ``(K, 3)``.
        normals: ``(K, 3)``, or ``None``.
        attributes: by name, ``(K,)`` or ``(K, components)``.
        removed: number of samples that each step removed, by its name, in the order of the steps.
    """

    indices: np.ndarray
    points: np.ndarray
    normals: np.ndarray | None
    attributes: dict[str, np.ndarray]
    removed: dict[str, int]


def clean(
    points: ArrayLike | Cloud,
    *,
    normals: ArrayLike | None = None,
    attributes: Mapping[str, ArrayLike] | None = None,
    drop_not_finite: bool = False,
    duplicates: float | bool | None = None,
    statistical: tuple[int, float] | None = None,
    radius: tuple[float, int] | None = None,
    voxel: float | None = None,
    poisson_disk: float | None = None,
) -> Cleaned:
    """Removes duplicates and outliers of a cloud, and thins it. Steps are applied in the order of the arguments.

    The set of kept points depends neither on the order of the input nor on the number of threads; of equal points the
    first one is kept. There is no pullback: the cotangent of a removed sample is zero.

    Args:
        points: ``(N, 3)``, or a :class:`Cloud` with its normals and attributes. Lengths are in their unit.
        normals: ``(N, 3)``, to go along.
        attributes: ``(N,)`` or ``(N, components)`` by name, to go along.
        drop_not_finite: removes points that are not finite, which are an error otherwise, and points whose normal is not.
        duplicates: removes all but one of the samples within this distance of each other; 0 or True: of equal ones.
        statistical: ``(neighbors, ratio)``: removes samples whose mean distance to so many nearest neighbors is above the
            mean of all by more than ``ratio`` standard deviations. As in PCL; Open3D's ``nb_neighbors`` is one more.
        radius: ``(radius, neighbors)``: removes samples with fewer than so many others within the radius. As in PCL and
            Open3D.
        voxel: keeps one sample in each cube of this size that begins at a multiple of it: the one nearest to their mean.
            Open3D and PCL return the means, which lie beside a curved surface.
        poisson_disk: keeps samples more than this distance apart, such that each removed one has a kept one within it.

    Raises:
        TypeError, ValueError: arrays of another type or shape, points that are not finite, or invalid numbers.
        KeyboardInterrupt: at once, on Ctrl-C.
    """
    if isinstance(points, Cloud):
        normals = points.normals if normals is None else normals
        attributes = {**points.attributes, **(attributes or {})}
        points = points.points
    cloud = floats(points, "points", (None, 3))
    if normals is not None:
        normals = floats(normals, "normals", cloud.shape, cloud.dtype)
    columns = {name: array for name, _, array in _attributes(attributes, cloud)}
    steps: _core._Steps = {
        "drop_not_finite": bool(drop_not_finite),
        "duplicates": _duplicates(duplicates),
        "statistical": _pair(statistical, "statistical", (_count, number)),
        "radius": _pair(radius, "radius", (number, _count)),
        "voxel": None if voxel is None else number(voxel, "voxel"),
        "poisson_disk": None if poisson_disk is None else number(poisson_disk, "poisson_disk"),
    }
    rows = cloud
    if drop_not_finite and normals is not None:
        rows = np.where(np.isfinite(normals).all(axis=1, keepdims=True), cloud, cloud.dtype.type(np.nan))
    kept, removed = _core.clean_points(rows, steps)
    return Cleaned(
        kept,
        cloud[kept],
        None if normals is None else normals[kept],
        {name: array[kept] for name, array in columns.items()},
        dict(removed),
    )


def _duplicates(value: float | bool | None) -> float | None:
    if value is None or value is False:
        return None
    return 0.0 if value is True else number(value, "duplicates")


def _count(value: object, name: str) -> int:
    found = whole(value, name)
    if found < 0:
        raise ValueError(f"{name} has {found} neighbors; give 0 or more")
    return found


def _pair(values: object, name: str, kinds: tuple[Any, Any]) -> tuple[Any, Any] | None:
    if values is None:
        return None
    if not isinstance(values, (tuple, list)) or len(values) != 2:
        form = {"statistical": "(neighbors, ratio)", "radius": "(radius, neighbors)"}[name]
        raise ValueError(f"{name} is {values!r}; give {form}")
    first, second = (kind(value, name) for kind, value in zip(kinds, values))
    return first, second
