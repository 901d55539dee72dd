"""Values on a surface at any places, for `isograd.torch`."""

from __future__ import annotations

import json
from typing import Any, Literal, NamedTuple, Optional, overload

import numpy as np

from ._grid import Grid
from ._options import Fill, Options, check_fill
from ._places import Offset, are_centers, axes_at, band_width, is_many, on_grids, shaped
from ._torch import DEVICES, Tensor, call, checked, grid_shape, in_batches, one_by_one, prepare, rows, torch


class Surface(NamedTuple):
    """Distance, normal, closest point and values of a surface at places of a shape ``S``."""

    sdf: Tensor
    """``S``: signed distance φ, in the unit of the points, negative inside."""
    normal: Tensor
    """``(*S, 3)``: ∇φ, a unit vector away from the surface outside and toward it inside; 0 beyond the band."""
    closest: Tensor
    """``(*S, 3)``: the closest point of the surface; beyond the band the place itself."""
    values: Tensor | None
    """``(*S, C)`` or ``S``: values at the closest point; 0 beyond the band. ``None`` if no values are given."""


@overload
def surface(
    points: Tensor,
    grid: Grid,
    places: Grid | Offset | Tensor | None = None,
    *,
    values: Tensor | None = ...,
    normals: Tensor | None = ...,
    band: float | Literal["auto", "full"] = ...,
    fill: Fill = ...,
    options: Options | None = ...,
) -> Surface: ...


@overload
def surface(
    points: Tensor,
    grid: Grid,
    places: tuple[Offset, ...],
    *,
    values: Tensor | None = ...,
    normals: Tensor | None = ...,
    band: float | Literal["auto", "full"] = ...,
    fill: Fill = ...,
    options: Options | None = ...,
) -> tuple[Surface, ...]: ...


@in_batches
def surface(
    points: Tensor,
    grid: Grid,
    places: Grid | Offset | tuple[Offset, ...] | Tensor | None = None,
    *,
    values: Tensor | None = None,
    normals: Tensor | None = None,
    band: float | Literal["auto", "full"] = "auto",
    fill: Fill = "inside",
    options: Options | None = None,
) -> Surface | tuple[Surface, ...]:
    """φ, normals, closest points and extended values of the surface through ``points``, at any places.

    Differentiable once in ``points``, ``values``, ``places`` that are a tensor, and ``normals`` with
    ``orient="given"``; what is held constant is listed at :func:`isograd.jax.surface`, which has the same arguments.

    Args:
        points: ``(N, 3)``, as for :func:`isograd.torch.signed_distance`.
        grid: the surface is found on it.
        places: ``None`` for cell centers, another grid, an offset in cells such as ``(1, 0.5, 0.5)``, a tuple of
            offsets, or an ``(M, 3)`` tensor of positions.
        values: ``(N, C)`` or ``(N,)``.
        normals: as for :func:`isograd.torch.signed_distance`.
        band: distance from the surface up to which places count; ``"auto"`` is 4 cells.
        fill: ``"inside"``: the inside has no band; ``"band"``: the band is that of both sides.
        options: options, without ``trim`` and ``sheet``.

    Raises:
        TypeError, ValueError, RuntimeError: as for :func:`isograd.torch.signed_distance`.
    """
    check_fill(fill)
    width = band_width(band, grid, 4, "full")
    regular = on_grids(places, grid)
    at_centers = are_centers(regular, grid)
    points, normals, settings = prepare(points, grid, normals, options, "cpu", sdf=at_centers)
    columns, is_scalar = rows(values, points)
    positions, shapes = _positions(places, regular, points)
    given = positions[:0] if at_centers else positions
    found = _surface(points, given, columns, normals, settings, float(width), len(positions))[:4]
    if fill == "band":
        far = found[0] < -width
        beyond = (torch.full_like(found[0], -width), torch.zeros_like(found[1]), positions, torch.zeros_like(found[3]))
        found = tuple(torch.where(far.reshape(-1, *[1] * (a.ndim - 1)), b, a) for a, b in zip(found, beyond))
    sizes = [int(np.prod(shape)) for shape in shapes]
    split = zip(*(array.split(sizes) for array in found))
    parts = [Surface(*shaped(part, shape, is_scalar)) for part, shape in zip(split, shapes)]
    return tuple(parts) if is_many(places) else parts[0]


def _positions(places: Any, regular: Any, points: Tensor) -> tuple[Tensor, list[tuple[int, ...]]]:
    """``(M, 3)`` positions of all places, of the type and on the device of the points, and the shape of each part."""
    if regular is None:
        positions = checked(places, "places").to(points.dtype)
        return positions, [tuple(positions.shape[:1])]
    each = []
    for grid, offset in regular:
        axes = [torch.from_numpy(axis).to(points) for axis in axes_at(grid, offset, np.float64)]
        each.append(torch.stack(torch.meshgrid(*axes, indexing="ij"), dim=-1).reshape(-1, 3))
    return torch.cat(each), [grid.shape for grid, _ in regular]


def _outputs(points: Tensor, values: Tensor, settings: str, count: int) -> tuple[Tensor, ...]:
    """Empty results: distance, normal, closest point and values; faces and weights; φ, closest faces and normals."""
    shape = grid_shape(settings)
    return (
        points.new_empty(count),
        points.new_empty((count, 3)),
        points.new_empty((count, 3)),
        points.new_empty((count, values.shape[1])),
        points.new_empty(count, dtype=torch.int32),
        points.new_empty((count, 3)),
        points.new_empty(shape),
        points.new_empty(shape, dtype=torch.int32),
        points.new_empty(points.shape),
    )


# Operators say Optional and not `| None`: PyTorch reads their annotations, in every version the former.
@torch.library.custom_op("isograd::surface", mutates_args=(), device_types=DEVICES)
def _surface(
    points: Tensor,
    places: Tensor,
    values: Tensor,
    given: Optional[Tensor],
    settings: str,
    band: float,
    count: int,
) -> tuple[Tensor, Tensor, Tensor, Tensor, Tensor, Tensor, Tensor, Tensor, Tensor]:
    outputs = _outputs(points, values, settings, count)
    call("isograd_surface", [points, places, values, given], outputs, settings, band)
    return outputs  # pyright: ignore[reportReturnType]


@_surface.register_fake
def _(points: Tensor, places: Any, values: Tensor, given: Any, settings: str, band: Any, count: int) -> tuple[Tensor, ...]:
    return _outputs(points, values, settings, count)


@torch.library.custom_op("isograd::surface_pullback", mutates_args=(), device_types=DEVICES)
def _pullback(
    inputs: list[Tensor], saved: list[Tensor], bars: list[Tensor], settings: str, band: float
) -> list[Tensor]:
    """Cotangents of places, values, points and, where they are given, normals."""
    points, places, values, *given = inputs
    outputs = tuple(a.new_empty(a.shape) for a in (places, values, points, *given))
    call("isograd_surface_pullback", [points, places, values, *saved, *bars, *given], outputs, settings, band)
    return list(outputs)


@_pullback.register_fake
def _(inputs: list[Tensor], saved: list[Tensor], bars: list[Tensor], settings: str, band: float) -> list[Tensor]:
    points, places, values, *given = inputs
    return [a.new_empty(a.shape) for a in (places, values, points, *given)]


def _save(ctx: Any, inputs: tuple[Any, ...], output: tuple[Tensor, ...]) -> None:
    points, places, values, given, ctx.settings, ctx.band, _ = inputs
    ctx.is_given = given is not None
    sdf, normal, _closest, _values, *rest = output
    ctx.save_for_backward(points, places, values, *([given] if ctx.is_given else []), sdf, normal, *rest)
    ctx.mark_non_differentiable(*rest)


def _backward(ctx: Any, sdf_bar: Tensor, normal_bar: Tensor, closest_bar: Tensor, values_bar: Tensor, *_: Any) -> tuple[Any, ...]:
    inputs, saved = ctx.saved_tensors[: 3 + ctx.is_given], ctx.saved_tensors[3 + ctx.is_given :]
    points, places = inputs[:2]
    sdf, normal, faces, *rest = saved
    spacing = json.loads(ctx.settings)["grid"]["spacing"]
    # n = (q − p) / φ, so that dn = (I − n nᵀ) (dq − dp) / φ.
    turning = normal_bar - normal * (normal * normal_bar).sum(dim=1, keepdim=True)
    has_face = (faces != -1)[:, None]
    apart = has_face & (sdf.abs() > torch.finfo(sdf.dtype).eps ** 0.5 * spacing)[:, None]
    turning = torch.where(apart, turning / torch.where(apart, sdf[:, None], 1), 0)
    bars = [sdf_bar, closest_bar - turning, values_bar]
    places_bar, *others = _pullback(
        list(inputs), [normal, faces, *rest], [bar.contiguous() for bar in bars], ctx.settings, ctx.band
    )
    if len(places):
        places_bar = places_bar + turning + torch.where(has_face, 0, closest_bar)
    values_bar, points_bar, *given_bar = others
    return points_bar, places_bar, values_bar, given_bar[0] if given_bar else None, None, None, None


_surface.register_autograd(_backward, setup_context=_save)


def _twice(ctx: Any, *_bars: Any) -> None:
    raise RuntimeError("isograd.torch.surface can be differentiated once, not twice")


_pullback.register_autograd(_twice)
_surface.register_vmap(one_by_one(_surface))
