"""Values on a surface at any places, for `isograd.jax`."""

from __future__ import annotations

import functools
from dataclasses import replace
from typing import TYPE_CHECKING, Any, Literal, NamedTuple, overload

import jax
import jax.numpy as jnp
import numpy as np

from ._options import Fill, check_fill
from ._places import NO_FACE, Offset, are_centers, axes_at, band_width, is_many, on_grids, shaped
from ._xla import Plan, call, floats, like, pair, prepare

if TYPE_CHECKING:
    from jax.typing import ArrayLike

    from ._grid import Grid
    from ._options import Options


class Surface(NamedTuple):
    """Distance, normal, closest point and values of a surface at places of a shape ``S``."""

    sdf: jax.Array
    """``S``: signed distance φ, in the unit of the points, negative inside."""
    normal: jax.Array
    """``(*S, 3)``: ∇φ, a unit vector away from the surface outside and toward it inside; 0 beyond the band."""
    closest: jax.Array
    """``(*S, 3)``: the closest point of the surface; beyond the band the place itself."""
    values: jax.Array | None
    """``(*S, C)`` or ``S``: values at the closest point; 0 beyond the band. ``None`` if no values are given."""


@overload
def surface(
    points: ArrayLike,
    grid: Grid,
    places: Grid | Offset | ArrayLike | None = None,
    *,
    values: ArrayLike | None = ...,
    normals: ArrayLike | None = ...,
    band: float | Literal["auto", "full"] = ...,
    fill: Fill = ...,
    options: Options | None = ...,
) -> Surface: ...


@overload
def surface(
    points: ArrayLike,
    grid: Grid,
    places: tuple[Offset, ...],
    *,
    values: ArrayLike | None = ...,
    normals: ArrayLike | None = ...,
    band: float | Literal["auto", "full"] = ...,
    fill: Fill = ...,
    options: Options | None = ...,
) -> tuple[Surface, ...]: ...


def surface(
    points: ArrayLike,
    grid: Grid,
    places: Grid | Offset | tuple[Offset, ...] | ArrayLike | None = None,
    *,
    values: ArrayLike | None = None,
    normals: ArrayLike | None = None,
    band: float | Literal["auto", "full"] = "auto",
    fill: Fill = "inside",
    options: Options | None = None,
) -> Surface | tuple[Surface, ...]:
    """φ, normals, closest points and extended values of the surface through ``points``, at any places.

    The distance is exact to each triangle of the surface. All results are differentiable in ``points``, in ``places``
    that are an array, and in ``normals`` with ``orient="given"``; the extended values also in ``values``, of which
    they are a linear function. Held constant: what :func:`isograd.jax.signed_distance` holds, which face is closest,
    and which places are in the band. On an edge or a corner of the surface the derivative of the normal is unbounded;
    closer than ``√ε`` cells to the surface (``ε`` of the number type) it is taken as zero.

    Args:
        points: ``(N, 3)``, as for :func:`isograd.jax.signed_distance`.
        grid: static; the surface is found on it.
        places: ``None`` for the cell centers of ``grid``; another :class:`isograd.Grid` (static) for its cell centers;
            a tuple of three numbers (static) for one place in each cell, at this offset from its lower corner in
            cells, such as ``(1, 0.5, 0.5)`` for the faces at the upper end of x; a tuple of such tuples for one
            result each, of a single surface; an ``(M, 3)`` array of positions, on the grid or off it.
        values: ``(N, C)`` or ``(N,)`` values of the samples, such as their velocities.
        normals: as for :func:`isograd.jax.signed_distance`.
        band: static; distance from the surface, in the unit of the points, up to which places count. Beyond it φ is
            ± this distance. ``"auto"`` is 4 cells, ``"full"`` is everywhere: at cell centers without extra cost, at
            other places one search each. At cell centers ``options.band`` limits it too.
        fill: static; ``"inside"``: the inside has no band, and its values are those of the closest point wherever it
            is; ``"band"``: the band is that of both sides.
        options: as for :func:`isograd.jax.signed_distance`, without ``trim`` and ``sheet``.

    Returns:
        A :class:`Surface` with results of the shape of the places: ``(nx, ny, nz)`` or ``(M,)``; NaN and zeros at a
        position that is not finite. A tuple of them for a tuple of offsets.

    Raises:
        TypeError, ValueError, jax.errors.JaxRuntimeError: as for :func:`isograd.jax.signed_distance`.
    """
    check_fill(fill)
    width = band_width(band, grid, 4, "full")
    regular = on_grids(places, grid)
    # At cell centers φ and the closest faces on the grid save the search.
    at_centers = are_centers(regular, grid)
    plan, points, normals = prepare(points, grid, normals, options, "cpu", sdf=at_centers)
    plan = replace(plan, band=width)
    values, is_scalar = sample_values(values, points)
    positions, shapes = _positions(places, regular, points.dtype)
    given = positions[:0] if at_centers else positions
    found: tuple[jax.Array, ...] = _surface(plan, (len(positions), grid.spacing), points, given, values, normals)
    found = _within(found, positions, width) if fill == "band" else found
    parts, start = [], 0
    for shape in shapes:
        end = start + int(np.prod(shape))
        part = tuple(array[start:end] for array in found)
        parts.append(Surface(*shaped(part, shape, is_scalar)))
        start = end
    return tuple(parts) if is_many(places) else parts[0]


def sample_values(values: ArrayLike | None, points: jax.Array) -> tuple[jax.Array, bool | None]:
    """Values as ``(N, C)``, and whether they were ``(N,)``; ``(N, 0)`` and ``None`` for none.

    Raises:
        TypeError, ValueError: no array of numbers, another shape, or no component.
    """
    if values is None:
        return jnp.zeros((points.shape[0], 0), points.dtype), None
    values = jnp.asarray(values)
    is_scalar = values.ndim == 1
    shape = (points.shape[0],) if is_scalar else (points.shape[0], None)
    values = floats(values, "values", shape, points.dtype)
    values = values[:, None] if is_scalar else values
    if values.shape[1] == 0:
        raise ValueError(f"values has the shape {values.shape}; give at least one component")
    return values, is_scalar


def positions_at(grid: Grid, offset: Offset, dtype: np.typing.DTypeLike) -> jax.Array:
    """``(nx, ny, nz, 3)`` positions at an offset from the lower corner of each cell, in cells."""
    axes = [jnp.asarray(axis) for axis in axes_at(grid, offset, dtype)]
    return jnp.stack(jnp.meshgrid(*axes, indexing="ij"), axis=-1)


def _positions(
    places: Any, parts: list[tuple[Grid, Offset]] | None, dtype: np.typing.DTypeLike
) -> tuple[jax.Array, list[tuple[int, ...]]]:
    """``(M, 3)`` positions of all places, and the shape of each part."""
    if parts is None:
        positions = floats(places, "places", (None, 3), dtype)
        return positions, [positions.shape[:1]]
    each = [positions_at(*part, dtype).reshape(-1, 3) for part in parts]
    return jnp.concatenate(each), [grid.shape for grid, _ in parts]


def _within(found: tuple[jax.Array, ...], positions: jax.Array, width: float) -> tuple[jax.Array, ...]:
    """The results without those inside beyond the band."""
    sdf, normal, closest, values = found
    far = sdf < -width
    row = far[:, None]
    return (
        jnp.where(far, -width, sdf),
        jnp.where(row, 0, normal),
        jnp.where(row, positions, closest),
        jnp.where(row, 0, values),
    )


@functools.partial(jax.custom_vjp, nondiff_argnums=(0, 1))
def _surface(
    plan: Plan,
    size: tuple[int, float],
    points: jax.Array,
    places: jax.Array,
    values: jax.Array,
    normals: jax.Array | None,
) -> tuple[jax.Array, ...]:
    found: tuple[jax.Array, ...] = _forward(plan, size, points, places, values, normals)[0]
    return found


def _forward(
    plan: Plan,
    size: tuple[int, float],
    points: jax.Array,
    places: jax.Array,
    values: jax.Array,
    normals: jax.Array | None,
) -> tuple[Any, ...]:
    count, _ = size
    scalar = jax.ShapeDtypeStruct((count,), points.dtype)
    vector = jax.ShapeDtypeStruct((count, 3), points.dtype)
    rows = jax.ShapeDtypeStruct((count, values.shape[1]), points.dtype)
    faces = jax.ShapeDtypeStruct((count,), np.uint32)
    results = (scalar, vector, vector, rows, faces, vector, *plan.saved(points))
    arrays = (points, places, values, normals)
    sdf, normal, closest, at, *saved = call("isograd_surface", plan, results, *arrays)
    return (sdf, normal, closest, at), (arrays, sdf, normal, saved)


def _pullback(plan: Plan, size: tuple[int, float], residuals: tuple[Any, ...], bars: tuple[jax.Array, ...]) -> tuple[Any, ...]:
    (points, places, values, normals), sdf, normal, saved = residuals
    sdf_bar, normal_bar, closest_bar, values_bar = bars
    smallest = jnp.sqrt(np.finfo(sdf.dtype).eps) * size[1]
    # n = (q − p) / φ, so that dn = (I − n nᵀ) (dq − dp) / φ.
    turning = normal_bar - normal * jnp.sum(normal * normal_bar, axis=1, keepdims=True)
    has_face = (saved[0] != np.uint32(NO_FACE))[:, None]
    apart = has_face & (jnp.abs(sdf) > smallest)[:, None]
    turning = jnp.where(apart, turning / jnp.where(apart, sdf[:, None], 1), 0)
    results = like(places, values, points, normals)
    cotangents = (sdf_bar, closest_bar - turning, values_bar)
    arrays = (points, places, values, normal, *saved, *cotangents, normals)
    places_bar, values_bar, *cloud_bars = call("isograd_surface_pullback", plan, results, *arrays)
    if places.shape[0]:
        places_bar = places_bar + turning + jnp.where(has_face, 0, closest_bar)
    points_bar, normals_bar = pair(cloud_bars)
    return points_bar, places_bar, values_bar, normals_bar


_surface.defvjp(_forward, _pullback)
