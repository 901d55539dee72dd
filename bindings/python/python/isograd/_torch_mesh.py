"""Distances, surface, extended values and normals of a cloud, for `isograd.torch`."""

from __future__ import annotations

import json
from collections.abc import Callable, Sequence
from dataclasses import asdict
from typing import Any, Literal, NamedTuple

from ._grid import Grid
from ._numbers import size
from ._options import Fill, Options, Orient, check_fill
from ._places import band_width
from ._torch import DEVICES, Tensor, call, checked, grid_shape, in_batches, one_by_one, prepare, rows, torch


class Mesh(NamedTuple):
    """A surface."""

    vertices: Tensor
    """``(V, 3)``, or ``(max_vertices, 3)`` with zeros behind the last one."""
    faces: Tensor
    """``(F, 3)`` int64, counter-clockwise from outside, or ``(max_faces, 3)`` with ``(0, 0, 0)`` behind the last one."""
    vertex_count: Tensor
    """``()`` int64: vertices of the surface, whether they fit or not."""
    face_count: Tensor
    """``()`` int64: faces of the surface, whether they fit or not."""


class Extension(NamedTuple):
    """φ and extended values at the cells, as solvers with immersed boundaries need them."""

    sdf: Tensor
    """``(nx, ny, nz)``, as :func:`isograd.torch.signed_distance` returns it."""
    values: Tensor
    """``(nx, ny, nz, C)`` or ``(nx, ny, nz)``: inside and in the band the value at the closest surface point, else 0."""


@in_batches
def query(
    points: Tensor,
    grid: Grid,
    queries: Tensor,
    *,
    normals: Tensor | None = None,
    options: Options | None = None,
    backend: str = "cpu",
) -> Tensor:
    """The signed distance from any positions to the surface through ``points``: exact to each triangle of it.

    Differentiable once in ``points``, ``queries`` and, with ``orient="given"``, ``normals``. Held constant: what
    :func:`isograd.torch.signed_distance` holds, and which face is closest.

    Args:
        points: ``(N, 3)``, or a batch, as for :func:`isograd.torch.signed_distance`.
        grid: the surface is found on it.
        queries: ``(M, 3)``, on the grid or off it; ``(B, M, 3)`` for different ones for each cloud of a batch.
        normals: as for :func:`isograd.torch.signed_distance`.
        options: as for :func:`isograd.torch.signed_distance`.
        backend: as for :func:`isograd.torch.signed_distance`; the distances to the surface are computed on the CPU.

    Returns:
        ``(M,)``, in the unit of the points, negative inside; NaN for a query that is not finite.

    Raises:
        TypeError, ValueError, RuntimeError: as for :func:`isograd.torch.signed_distance`.
    """
    points, normals, settings = prepare(points, grid, normals, options, backend, sdf=False)
    queries = checked(queries, "queries").to(points.dtype)
    distance: Tensor = _query(points, queries, normals, settings, 0.0, False, [])[0]
    return distance


@in_batches
def mesh(
    points: Tensor,
    grid: Grid,
    *,
    max_vertices: int | None = None,
    max_faces: int | None = None,
    normals: Tensor | None = None,
    options: Options | None = None,
    backend: str = "cpu",
) -> Mesh:
    """The surface through ``points`` as triangles.

    The vertices are differentiable once in ``points`` and, where they are used, ``normals``.

    Args:
        points: ``(N, 3)``, or a batch, as for :func:`isograd.torch.signed_distance`.
        grid: grid of φ.
        max_vertices: size of the array of vertices, which a batch, ``torch.vmap`` and ``torch.compile`` need. Without it
            the arrays have the sizes of the surface. Where a surface has more vertices or faces than fit, the counts exceed
            the sizes: the arrays hold the first ones, and a face with a vertex that is not there is ``(0, 0, 0)``. No error
            is raised: check the counts. A closed surface has about twice as many faces as vertices.
        max_faces: size of the array of faces, given together with ``max_vertices``.
        normals: as for :func:`isograd.torch.signed_distance`.
        options: as for :func:`isograd.torch.signed_distance`.
        backend: as for :func:`isograd.torch.signed_distance`.

    Raises:
        TypeError, ValueError, RuntimeError: as for :func:`isograd.torch.signed_distance`.
    """
    points, normals, settings = prepare(points, grid, normals, options, backend, sdf=False)
    if (max_vertices is None) != (max_faces is None):
        raise ValueError("give both max_vertices and max_faces, or neither")
    if max_vertices is not None and max_faces is not None:
        sizes = [size(max_vertices, "max_vertices"), size(max_faces, "max_faces")]
        return _mesh_of(points, normals, settings, sizes)
    # Enough for most surfaces; others are found again.
    nx, ny, nz = grid.shape
    guess = 8 * (nx * ny + ny * nz + nz * nx)
    found = _mesh_of(points, normals, settings, [guess, 2 * guess])
    sizes = [int(found.vertex_count), int(found.face_count)]
    if sizes[0] > guess or sizes[1] > 2 * guess:
        found = _mesh_of(points, normals, settings, sizes)
    return found._replace(vertices=found.vertices[: sizes[0]], faces=found.faces[: sizes[1]])


@in_batches
def extend(
    points: Tensor,
    values: Tensor,
    grid: Grid,
    *,
    band: float | Literal["auto"] = "auto",
    fill: Fill = "inside",
    normals: Tensor | None = None,
    options: Options | None = None,
    backend: str = "cpu",
) -> Extension:
    """φ, and values of the samples (a surface velocity, a temperature) at the cells inside and around the surface.

    Both are differentiable once in ``points`` and, where they are used, ``normals``; the extended values also in
    ``values``, of which they are a linear function. Held constant: what :func:`isograd.torch.signed_distance` holds, and
    which cells are in the band.

    Args:
        points: ``(N, 3)``, or a batch, as for :func:`isograd.torch.signed_distance`.
        values: ``(N, C)`` or ``(N,)``; of a batch ``(B, N, C)`` or ``(B, N)``.
        grid: grid of φ.
        band: distance from the surface up to which values are extended, in the unit of the points, at most
            ``options.band``; ``"auto"`` for 3 cells.
        fill: ``"inside"``: all cells inside get values, however far from the surface; ``"band"``: only those of the band.
        normals: as for :func:`isograd.torch.signed_distance`.
        options: as for :func:`isograd.torch.signed_distance`.
        backend: as for :func:`isograd.torch.signed_distance`.

    Raises:
        TypeError, ValueError, RuntimeError: as for :func:`isograd.torch.signed_distance`.
    """
    points, normals, settings = prepare(points, grid, normals, options, backend)
    width = float(band_width(band, grid, 3))
    is_inside = check_fill(fill, "full" if options is None else options.band) == "inside"
    if values is None:
        raise ValueError("values is None; give the values of the samples")
    columns, is_scalar = rows(values, points)
    field, sdf = _extend(points, columns, normals, settings, width, is_inside, [])[:2]
    return Extension(sdf, field[..., 0] if is_scalar else field)


@in_batches
def orient(points: Tensor, before: Tensor, *, radius: float | str = "auto") -> Tensor:
    """``(N, 3)`` unit normals, estimated from the points, each on the side of a given normal.

    For a cloud that moves: ``before`` are the normals of the same points in the step before, at first those of
    :func:`isograd.orient`. Pass the result as ``normals`` with ``orient="signs"``, and as ``before`` to the next step. The
    result has no derivative: with ``orient="signs"`` normals only choose sides.

    Args:
        points: ``(N, 3)``, or a batch.
        before: ``(N, 3)``, of any length but zero; of a batch ``(B, N, 3)``.
        radius: of the neighborhoods, in the unit of the points.

    Raises:
        TypeError, ValueError: as for :func:`isograd.torch.signed_distance`.
    """
    points = checked(points, "points").detach()
    before = checked(before, "before").detach().to(points.dtype)
    if before.shape != points.shape:
        raise ValueError(f"before has the shape {tuple(before.shape)} and must have {tuple(points.shape)}")
    normals: Tensor = _orient(points, before, json.dumps(asdict(Options(radius=radius, orient=Orient.SIGNS))))
    return normals


def _mesh_of(points: Tensor, normals: Tensor | None, settings: str, sizes: list[int]) -> Mesh:
    vertices, faces, counts = _mesh(points, None, normals, settings, 0.0, False, sizes)[:3]
    counts = counts.long()
    return Mesh(vertices, faces.long(), counts[0], counts[1])


def saved(points: Tensor, settings: str) -> tuple[Tensor, Tensor, Tensor]:
    """φ, closest faces and normals, which a pullback needs besides its inputs."""
    shape = grid_shape(settings)
    return points.new_empty(shape), points.new_empty(shape, dtype=torch.int32), points.new_empty(points.shape)


def _of_query(points: Tensor, queries: Tensor, settings: str, _sizes: Sequence[int]) -> tuple[Tensor, ...]:
    """Distances; gradients, faces and weights."""
    count = len(queries)
    vectors = points.new_empty((count, 3)), points.new_empty((count, 3))
    faces = points.new_empty(count, dtype=torch.int32)
    return points.new_empty(count), vectors[0], faces, vectors[1], *saved(points, settings)


def _of_mesh(points: Tensor, _none: None, settings: str, sizes: Sequence[int]) -> tuple[Tensor, ...]:
    """Vertices, faces, and the numbers of both."""
    faces = points.new_empty((sizes[1], 3), dtype=torch.int32)
    counts = points.new_empty(2, dtype=torch.int32)
    return points.new_empty((sizes[0], 3)), faces, counts, *saved(points, settings)


def _of_extend(points: Tensor, values: Tensor, settings: str, _sizes: Sequence[int]) -> tuple[Tensor, ...]:
    """Values at all cells."""
    return points.new_empty((*grid_shape(settings), values.shape[1])), *saved(points, settings)


def operator(
    name: str,
    outputs: Callable[..., tuple[Tensor, ...]],
    count: int,
    bars: int,
    kept: int,
    targets: tuple[str, str] | None = None,
) -> Any:
    """A target as a differentiable operator of points, another input or ``None``, and normals or ``None``.

    Args:
        outputs: empty results.
        count: number of results.
        bars: number of results with a derivative, the first ones.
        kept: first of the results that the pullback needs.
        targets: that of the operator and that of its pullback, if not named like it.
    """
    target, target_of_pullback = targets or (f"isograd_{name}", f"isograd_{name}_pullback")
    inputs = "Tensor points, Tensor? other, Tensor? given, "
    how = "str settings, float band, bool inside"
    results = ", ".join(["Tensor"] * count)
    # No lists, of which `is_grads_batched` of `torch.autograd.grad` makes no batches: what is kept, then the cotangents.
    saved = ", ".join(f"Tensor saved_{i}" for i in range(count - kept + bars))

    @torch.library.custom_op(
        f"isograd::{name}",
        mutates_args=(),
        device_types=DEVICES,
        schema=f"({inputs}{how}, int[] sizes) -> ({results})",
    )
    def forward(
        points: Tensor, other: Any, given: Any, settings: str, band: float, inside: bool, sizes: Sequence[int]
    ) -> tuple[Tensor, ...]:
        found = outputs(points, other, settings, sizes)
        call(target, [points, other, given], found, settings, band, inside)
        return found

    @torch.library.custom_op(
        f"isograd::{name}_pullback",
        mutates_args=(),
        device_types=DEVICES,
        schema=f"({inputs}{saved}, {how}) -> (Tensor, Tensor, Tensor)",
    )
    def pullback(points: Tensor, other: Any, given: Any, *rest: Any) -> tuple[Tensor, ...]:
        *saved, settings, band, inside = rest
        bars = empty_bars(points, other, given)
        found = [bar for bar, x in zip(bars, (other, points, given)) if x is not None]
        call(target_of_pullback, [points, other, *saved, given], found, settings, band, inside)
        return bars

    def empty_bars(points: Tensor, other: Any, given: Any, *_rest: Any) -> tuple[Tensor, ...]:
        return tuple(points.new_empty(0 if x is None else x.shape) for x in (other, points, given))

    def save(ctx: Any, inputs: tuple[Any, ...], output: tuple[Tensor, ...]) -> None:
        points, other, given, *ctx.how = inputs
        ctx.save_for_backward(points, other, given, *output[kept:])
        ctx.mark_non_differentiable(*output[bars:])

    def backward(ctx: Any, *cotangents: Tensor) -> tuple[Tensor | None, ...]:
        points, other, given, *saved = ctx.saved_tensors
        settings, band, inside, _ = ctx.how
        found = pullback(points, other, given, *saved, *cotangents[:bars], settings, band, inside)
        other_bar, points_bar, given_bar = found
        return points_bar, None if other is None else other_bar, None if given is None else given_bar, None, None, None, None

    def twice(_ctx: Any, *_bars: Any) -> None:
        raise RuntimeError(f"isograd.torch.{name} can be differentiated once, not twice")

    forward.register_fake(lambda points, other, _given, settings, _band, _inside, sizes: outputs(points, other, settings, sizes))
    forward.register_autograd(backward, setup_context=save)
    forward.register_vmap(one_by_one(forward))
    pullback.register_fake(empty_bars)
    pullback.register_autograd(twice)
    pullback.register_vmap(one_by_one(pullback))
    return forward


_query = operator("query", _of_query, count=7, bars=1, kept=1)
_mesh = operator("mesh", _of_mesh, count=6, bars=1, kept=3)
_extend = operator("extend", _of_extend, count=4, bars=2, kept=1)


@torch.library.custom_op("isograd::orient", mutates_args=(), device_types=DEVICES)
def _orient(points: Tensor, before: Tensor, settings: str) -> Tensor:
    normals = torch.empty_like(points, memory_format=torch.contiguous_format)
    call("isograd_orient", [points, before], [normals], settings)
    return normals


@_orient.register_fake
def _(points: Tensor, before: Tensor, settings: str) -> Tensor:
    return torch.empty_like(points, memory_format=torch.contiguous_format)


@_orient.register_vmap
def _(info: Any, axes: tuple[int | None, ...], *batch: Any) -> tuple[Tensor, int]:
    (normals,), (axis,) = one_by_one(lambda *inputs: (_orient(*inputs),))(info, axes, *batch)
    return normals, axis
