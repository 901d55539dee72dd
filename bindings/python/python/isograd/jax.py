"""Signed distance of a point cloud in JAX: inside ``jit``, ``grad``, ``vjp``, ``vmap``, ``scan`` and ``checkpoint``.

    >>> grid = isograd.Grid.fit(points)
    >>> loss = lambda points: jnp.mean(isograd.jax.signed_distance(points, grid) ** 2)
    >>> gradient = jax.jit(jax.grad(loss))(points)   # (N, 3)

Points and normals are traced; grid and options are static. float32 and float64 are unchanged (float64 needs
``jax_enable_x64``), half precision becomes float32, integers JAX's default float. XLA calls the handlers without Python.
With ``backend="cuda"`` or ``"vulkan"`` they compute on that device: arrays of the CPU are copied at every call; of
arrays on a CUDA device, which need ``backend="cuda"``, φ and its cotangent stay there. :func:`surface` and :func:`orient`
compute on the CPU, and copy such arrays at every call. Other arrays are errors, unless
the environment has ``ISOGRAD_JAX_CALLBACK=1``: then they are copied, and computed through ``jax.pure_callback``, with
the same bits.

Invalid types and shapes raise ``TypeError`` or ``ValueError`` at once. Invalid values (a point that is not finite or off
the grid) raise ``jax.errors.JaxRuntimeError`` or, as JAX chooses, ``ValueError``, with the message of the NumPy
functions, when the result is awaited.

Gradients are of reverse mode and first order; each function lists what is held constant. The clouds of a batch under
``vmap`` are computed one after the other, each on all cores. Under ``jax.shard_map`` pass ``check_vma=False``.
"""

from __future__ import annotations

import functools
import json
from collections.abc import Callable
from dataclasses import asdict, replace
from typing import TYPE_CHECKING, Any, Literal, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np

from ._numbers import size
from ._options import Fill, Options, Orient, check_fill
from ._jax_surface import Surface, sample_values, surface
from ._places import band_width
from ._shape_jax import Material
from ._xla import Plan, call, floats, like, pair, prepare

if TYPE_CHECKING:
    from jax.typing import ArrayLike

    from ._grid import Grid

__all__ = ["Extension", "Material", "Mesh", "Surface", "extend", "mesh", "orient", "query", "signed_distance", "surface"]


def signed_distance(
    points: ArrayLike,
    grid: Grid,
    *,
    normals: ArrayLike | None = None,
    options: Options | None = None,
    backend: str = "cpu",
) -> jax.Array:
    """The signed distance φ of the surface through ``points``, at the cell centers of ``grid``.

    Differentiable in ``points``, and in ``normals`` with ``orient="given"``. Held constant: the sides of
    the normals, where a change makes φ jump, and which face is closest to a cell.

    Args:
        points: ``(N, 3)``, at least 2 cells off the walls of the grid.
        grid: static.
        normals: ``(N, 3)``, outward, of any length but zero, where ``options.orient`` is ``"given"`` or ``"signs"``.
        options: static; ``checks`` has no effect, since there is no report.
        backend: static; as for :func:`isograd.reconstruct`.

    Returns:
        ``(nx, ny, nz)``, in the unit of the points, negative inside, of the type of the points.

    Raises:
        TypeError: an argument of another type.
        ValueError: another shape; normals that are missing or not used.
        RuntimeError: an unavailable backend.
        jax.errors.JaxRuntimeError: values from which no surface can be made.
    """
    plan, points, normals = prepare(points, grid, normals, options, backend)
    sdf: jax.Array = _distance(plan, (), points, None, normals)[0]
    return sdf


def query(
    points: ArrayLike,
    grid: Grid,
    queries: ArrayLike,
    *,
    normals: ArrayLike | None = None,
    options: Options | None = None,
    backend: str = "cpu",
) -> jax.Array:
    """The signed distance from any positions to the surface through ``points``: exact to each triangle of it.

    Differentiable in ``points``, ``queries`` and, with ``orient="given"``, ``normals``. Held constant: what
    :func:`signed_distance` holds, and which face is closest. Pass all queries at once: under ``vmap`` the surface
    is made for each member of the batch.

    Args:
        points: ``(N, 3)``, as for :func:`signed_distance`.
        grid: static; the surface is found on it.
        queries: ``(M, 3)``, on the grid or off it.
        normals: as for :func:`signed_distance`.
        options: as for :func:`signed_distance`.
        backend: as for :func:`signed_distance`; the surface is made there, and the distances to it on the CPU.

    Returns:
        ``(M,)``, in the unit of the points, negative inside; NaN for a query that is not finite.

    Raises:
        TypeError, ValueError, RuntimeError, jax.errors.JaxRuntimeError: as for :func:`signed_distance`.
    """
    plan, points, normals = prepare(points, grid, normals, options, backend, sdf=False)
    queries = floats(queries, "queries", (None, 3), points.dtype)
    distance: jax.Array = _query(plan, (), points, queries, normals)[0]
    return distance


class Mesh(NamedTuple):
    """A surface in arrays of fixed size."""

    vertices: jax.Array
    """``(max_vertices, 3)``, zeros behind the last one."""
    faces: jax.Array
    """``(max_faces, 3)`` uint32, counter-clockwise from outside, ``(0, 0, 0)`` behind the last one."""
    vertex_count: jax.Array
    """``()`` uint32: vertices of the surface, whether they fit or not."""
    face_count: jax.Array
    """``()`` uint32: faces of the surface, whether they fit or not."""


def mesh(
    points: ArrayLike,
    grid: Grid,
    *,
    max_vertices: int,
    max_faces: int,
    normals: ArrayLike | None = None,
    options: Options | None = None,
    backend: str = "cpu",
) -> Mesh:
    """The surface through ``points`` as triangles.

    The vertices are differentiable in ``points`` and, where they are used, ``normals``. Where a surface has more
    vertices or faces than fit, the counts exceed the sizes of the arrays: these hold the first ones, and a face with
    a vertex that is not there is ``(0, 0, 0)``. No error is raised: check the counts. A closed surface has about
    twice as many faces as vertices.

    Faces ``(0, 0, 0)`` have no area, and sums of products of their corners, such as the volume, need no mask. A norm
    of their normal does, since the derivative of a norm at 0 is NaN.

    Args:
        points: ``(N, 3)``, as for :func:`signed_distance`.
        grid: static.
        max_vertices: static; capacity for vertices.
        max_faces: static; capacity for faces.
        normals: as for :func:`signed_distance`.
        options: as for :func:`signed_distance`.
        backend: as for :func:`signed_distance`.

    Raises:
        TypeError, ValueError, RuntimeError, jax.errors.JaxRuntimeError: as for :func:`signed_distance`.
    """
    plan, points, normals = prepare(points, grid, normals, options, backend, sdf=False)
    sizes = (size(max_vertices, "max_vertices"), size(max_faces, "max_faces"))
    vertices, faces, counts = _mesh(plan, sizes, points, None, normals)
    return Mesh(vertices, faces, counts[0], counts[1])


def orient(
    points: ArrayLike, before: ArrayLike, *, radius: float | str = "auto"
) -> jax.Array:
    """``(N, 3)`` unit normals, estimated from the points, each on the side of a given normal.

    For a cloud that moves inside ``jit`` or ``scan``: ``before`` are the normals of the same points in the step before,
    at first those of :func:`isograd.orient`. Pass the result as ``normals`` with ``orient="signs"``, and as ``before``
    to the next step. Sides are kept while a normal turns by less than 90° a step. The result has no derivative: with
    ``orient="signs"`` normals only choose sides.

    Args:
        points: ``(N, 3)``.
        before: ``(N, 3)``, of any length but zero.
        radius: static; of the neighborhoods, in the unit of the points.

    Raises:
        TypeError, ValueError, jax.errors.JaxRuntimeError: as for :func:`signed_distance`.
    """
    points = jax.lax.stop_gradient(floats(points, "points", (None, 3)))
    before = jax.lax.stop_gradient(floats(before, "before", points.shape, points.dtype))
    settings = json.dumps(asdict(Options(radius=radius, orient=Orient.SIGNS)))
    (normals,) = call("isograd_orient", Plan(settings, (0, 0, 0)), like(points), points, before)
    return normals


class Extension(NamedTuple):
    """φ and extended values at the cells, as solvers with immersed boundaries need them."""

    sdf: jax.Array
    """``(nx, ny, nz)``, as :func:`signed_distance` returns it."""
    values: jax.Array
    """``(nx, ny, nz, C)`` or ``(nx, ny, nz)``: inside and in the band the value at the closest surface point, else 0."""


def extend(
    points: ArrayLike,
    values: ArrayLike,
    grid: Grid,
    *,
    band: float | Literal["auto"] = "auto",
    fill: Fill = "inside",
    normals: ArrayLike | None = None,
    options: Options | None = None,
    backend: str = "cpu",
) -> Extension:
    """φ, and values of the samples (a surface velocity, a temperature) at the cells inside and around the surface.

    At other places, such as the faces of a staggered grid, use :func:`surface`. Both are differentiable in ``points`` and, where they are used, ``normals``; the extended values also in
    ``values``, of which they are a linear function. Held constant: what :func:`signed_distance` holds, and which
    cells are in the band.

    Args:
        points: ``(N, 3)``, as for :func:`signed_distance`.
        values: ``(N, C)`` or ``(N,)``.
        grid: static.
        band: static; distance from the surface up to which values are extended, in the unit of the points, at most
            ``options.band``; ``"auto"`` for 3 cells.
        fill: static; ``"inside"``: all cells inside get values, however far from the surface; ``"band"``: only those of
            the band, so that the core of a body thicker than two bands has the value 0.
        normals: as for :func:`signed_distance`.
        options: as for :func:`signed_distance`.
        backend: as for :func:`signed_distance`.

    Raises:
        TypeError, ValueError, RuntimeError, jax.errors.JaxRuntimeError: as for :func:`signed_distance`.
    """
    plan, points, normals = prepare(points, grid, normals, options, backend)
    width = band_width(band, grid, 3)
    is_inside = check_fill(fill, "full" if options is None else options.band) == "inside"
    plan = replace(plan, band=width, inside=is_inside)
    if values is None:
        raise ValueError("values is None; give the values of the samples")
    values, is_scalar = sample_values(values, points)
    field, sdf = _extend(plan, (), points, values, normals)
    return Extension(sdf, field[..., 0] if is_scalar else field)


def _of_distance(plan: Plan, _sizes: tuple[int, ...], points: jax.Array, _none: None) -> tuple[jax.ShapeDtypeStruct, ...]:
    return plan.saved(points)


def _of_query(plan: Plan, _sizes: tuple[int, ...], points: jax.Array, queries: jax.Array) -> tuple[jax.ShapeDtypeStruct, ...]:
    """Distances; gradients, faces and weights."""
    distance = jax.ShapeDtypeStruct(queries.shape[:1], queries.dtype)
    faces = jax.ShapeDtypeStruct(queries.shape[:1], np.uint32)
    (vectors,) = like(queries)
    return distance, vectors, faces, vectors, *plan.saved(points)


def _of_mesh(plan: Plan, sizes: tuple[int, ...], points: jax.Array, _none: None) -> tuple[jax.ShapeDtypeStruct, ...]:
    """Vertices, faces, and the numbers of both."""
    vertices = jax.ShapeDtypeStruct((sizes[0], 3), points.dtype)
    faces = jax.ShapeDtypeStruct((sizes[1], 3), np.uint32)
    return vertices, faces, jax.ShapeDtypeStruct((2,), np.uint32), *plan.saved(points)


def _of_extend(plan: Plan, _sizes: tuple[int, ...], points: jax.Array, values: jax.Array) -> tuple[jax.ShapeDtypeStruct, ...]:
    """Values at all cells."""
    return jax.ShapeDtypeStruct((*plan.shape, values.shape[1]), points.dtype), *plan.saved(points)


def _operator(
    targets: tuple[str, str],
    outputs: Callable[..., tuple[jax.ShapeDtypeStruct, ...]],
    results: int,
    bars: int,
    kept: int,
    asked: int | None,
) -> Any:
    """A target and its pullback as a differentiable function of points, another input or ``None``, and normals or ``None``.

    Args:
        outputs: shapes and types of all outputs of the target.
        results: number of outputs that are returned, the first ones.
        bars: number of outputs with a derivative, the first ones.
        kept: first of the outputs that the pullback needs.
        asked: number of outputs that the target is asked for without a derivative; ``None`` for all.
    """
    target, target_of_pullback = targets

    @functools.partial(jax.custom_vjp, nondiff_argnums=(0, 1))
    def operator(plan: Plan, sizes: tuple[int, ...], *arrays: jax.Array | None) -> tuple[jax.Array, ...]:
        return call(target, plan, outputs(plan, sizes, *arrays[:2])[:asked], *arrays)[:results]

    def forward(plan: Plan, sizes: tuple[int, ...], *arrays: jax.Array | None) -> tuple[Any, ...]:
        found = call(target, plan, outputs(plan, sizes, *arrays[:2]), *arrays)
        return found[:results], (arrays, found[kept:])

    def pullback(plan: Plan, _sizes: tuple[int, ...], residuals: tuple[Any, ...], cotangents: tuple[Any, ...]) -> tuple[Any, ...]:
        (points, other, normals), saved = residuals
        arrays = (points, other, *saved, *cotangents[:bars], normals)
        found = list(call(target_of_pullback, plan, like(other, points, normals), *arrays))
        other_bar = None if other is None else found.pop(0)
        points_bar, normals_bar = pair(found)
        return points_bar, other_bar, normals_bar

    operator.defvjp(forward, pullback)
    return operator


_distance = _operator(("isograd_forward", "isograd_pullback"), _of_distance, results=1, bars=1, kept=0, asked=1)
_query = _operator(("isograd_query", "isograd_query_pullback"), _of_query, results=1, bars=1, kept=1, asked=1)
_mesh = _operator(("isograd_mesh", "isograd_mesh_pullback"), _of_mesh, results=3, bars=1, kept=3, asked=3)
# The target of an extension has no shorter list of outputs.
_extend = _operator(("isograd_extend", "isograd_extend_pullback"), _of_extend, results=2, bars=2, kept=1, asked=None)
