"""Signed distance and surface of points for PyTorch: the functions of ``isograd.jax``, inside ``autograd``, ``vmap`` and
``torch.compile``.

Computations use the number type of the tensors. With another ``backend``, points, φ and their cotangents
are copied to the device and back at every call. Tensors on a CUDA device need ``backend="cuda"``: then φ and its cotangent
stay there, and the points, a few numbers each, are copied to the CPU. :func:`surface` and :func:`orient` compute on the
CPU, and copy such tensors at every call. The operators are registered with
``torch.library``, such as ``isograd::signed_distance`` and ``isograd::signed_distance_pullback``. ``torch.func.grad``
does not support custom operators: call ``torch.autograd.grad``. Needs PyTorch 2.5.

Of a batch of clouds ``(B, N, 3)`` the results are stacked. Normals, queries and positions are shared, or have the axis of
the batch too; ``values`` always have it.
"""

from __future__ import annotations

from ._grid import Grid
from ._options import Options
from ._torch import Tensor, in_batches, prepare
from ._torch_mesh import Extension, Mesh, extend, mesh, operator, orient, query, saved
from ._torch_surface import Surface, surface

__all__ = ["Extension", "Mesh", "Surface", "extend", "mesh", "orient", "query", "signed_distance", "surface"]


@in_batches
def signed_distance(
    points: Tensor,
    grid: Grid,
    *,
    normals: Tensor | None = None,
    options: Options | None = None,
    backend: str = "cpu",
) -> Tensor:
    """φ: the signed distance to the surface through the points.

    Differentiable once in ``points``, and in ``normals`` with ``orient="given"``. Held constant: the sides of
    the normals, where a change makes φ jump, and which face is closest to a cell.

    Args:
        points: ``(N, 3)``, float32 or float64. float16 and bfloat16 become float32. A batch of clouds is
            ``(B, N, 3)``: they are computed one after the other, and the results are stacked.
        grid: grid of φ.
        normals: ``(N, 3)`` outward normals, for the orientations ``"given"`` and ``"signs"``; of a batch ``(B, N, 3)``, or
            the same for all.
        options: options; ``checks`` has no effect, since there is no report.
        backend: as for :func:`isograd.reconstruct`; ``"cuda"`` for tensors on a CUDA device.

    Returns:
        ``(nx, ny, nz)`` or ``(B, nx, ny, nz)`` tensor of φ at the centers of the cells, in the unit of the points: negative inside.

    Raises:
        TypeError: no tensor, or integers or complex numbers.
        ValueError: another shape or device; points from which no surface can be made: not finite, too few, or closer
            than two cells to a wall of the grid.
        RuntimeError: an unavailable backend.
    """
    points, normals, settings = prepare(points, grid, normals, options, backend)
    sdf: Tensor = _signed_distance(points, None, normals, settings, 0.0, False, [])[0]
    return sdf


_signed_distance = operator(
    "signed_distance",
    lambda points, _none, settings, _sizes: saved(points, settings),
    count=3,
    bars=1,
    kept=0,
    targets=("isograd_forward", "isograd_pullback"),
)
