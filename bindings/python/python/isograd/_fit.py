"""Inverse shape optimization: the parameters of a shape, or points, are fitted to a target field."""

from __future__ import annotations

import json
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Literal

import numpy as np

from . import _core
from ._arrays import floats
from ._grid import Grid, as_grid
from ._mesh import Mesh, as_mesh
from ._numbers import number, whole
from ._options import Options, length, resolve
from ._settings import check_backend, check_pure, encode, warn_note
from ._shapes import Shape

if TYPE_CHECKING:
    from numpy.typing import ArrayLike


@dataclass(frozen=True, eq=False)
class Fit:
    """Result of a fit.

    Attributes:
        outcome: ``"met"`` (the tolerance), ``"minimum"`` (no lower point was found), ``"epochs"`` (the maximum) or
            ``"stopped"`` (by the callback).
        backend: name of the backend: ``"cpu"``, or a backend and its device.
        shape: shape at the end; ``None`` for points.
        points: ``(N, 3)`` points at the end.
        sdf: ``(nx, ny, nz)`` field at the end, negative inside.
        mesh: surface at the end.
        history: one dictionary for each epoch, the start first: ``epoch``, ``evaluations``, ``loss`` and its parts,
            ``gradient_norm``, ``mean_error`` (mean difference of φ, in cells) and ``parameters``.
    """

    outcome: str
    backend: str
    shape: Shape | None
    points: np.ndarray
    sdf: np.ndarray
    mesh: Mesh
    history: list[dict[str, Any]]


def fit(
    target: ArrayLike | Mesh,
    grid: Grid,
    *,
    shape: Shape | None = None,
    points: ArrayLike | None = None,
    kind: Literal["sdf", "cloud"] | None = None,
    only: Sequence[str] | None = None,
    samples: int = 20_000,
    seed: int = 1,
    resample: int | None = None,
    random_start: float | None = None,
    smoothness: float = 0.01,
    optimizer: Literal["lbfgs", "adam"] = "lbfgs",
    rate: float | None = None,
    epochs: int = 500,
    tolerance: float = 1e-6,
    band: float | Literal["auto", "full"] = "auto",
    options: Options | None = None,
    backend: str = "cpu",
    callback: Callable[[dict[str, Any]], bool | None] | None = None,
) -> Fit:
    """Fits the parameters of ``shape``, or each of ``points``, so that the field matches ``target``, in double precision.

    Args:
        target: a field ``(nx, ny, nz)`` on ``grid``, a closed :class:`Mesh` (or other object with ``vertices`` and ``faces``),
            or a cloud ``(N, 3)``.
        grid: where the fields are compared; it must have room for start and target.
        kind: kind of the target array, where its shape is ambiguous.
        only: of a shape: names of the fitted parameters; by default all but time and whole numbers.
        samples: of a shape: number of its samples.
        seed: of the samples, and of the random start.
        resample: of a shape: number of epochs after which new samples are drawn.
        random_start: of a shape: each initial value is multiplied or divided by up to ``1 + random_start``.
        smoothness: of points: weight of the smoothness of their displacement; 0 for none.
        rate: length of the first steps, relative to the parameters, or in cells for points.
        tolerance: mean difference of φ, in cells, at which the fit ends.
        band: compare up to this distance from the target's surface, in the unit of the points; ``"auto"`` for 8 cells,
            ``"full"`` for everywhere.
        backend: backend, as for :func:`reconstruct`; the device must support float64.
        callback: called with each epoch; the fit stops where it returns ``False``.

    Raises:
        TypeError, ValueError: an invalid target or start; the message says what is wrong and what to do.
        RuntimeError: an unavailable backend.
    """
    if (shape is None) == (points is None):
        raise ValueError("give a shape or points to fit, and not both")
    if shape is not None and not isinstance(shape, Shape):
        raise TypeError(f"shape is a {type(shape).__name__}; give an isograd.Shape")
    if optimizer not in ("lbfgs", "adam"):
        raise ValueError(f"optimizer is {optimizer!r}; give 'lbfgs' or 'adam'")
    for name, value in (("only", only), ("resample", resample), ("random_start", random_start)):
        if points is not None and value is not None:
            raise ValueError(f"{name} is for a shape, not for points; leave it out")
    options = resolve(options, {})
    check_pure(options)
    target_kind, arrays = _target(target, grid, kind)
    how = {
        "settings": json.loads(encode(grid, options, check_backend(backend))),
        "kind": target_kind,
        "optimizer": optimizer,
        "rate": None if rate is None else number(rate, "rate"),
        "epochs": _count(epochs, "epochs"),
        "tolerance": number(tolerance, "tolerance"),
        "band": str(length(band, "band", "auto", "full")),
        "only": None if only is None else [str(name) for name in only],
        "samples": _count(samples, "samples"),
        "seed": _count(seed, "seed"),
        "resample": None if resample is None else max(1, _count(resample, "resample")),
        "random_start": None if random_start is None else number(random_start, "random_start"),
        "smoothness": number(smoothness, "smoothness"),
    }
    start = None if points is None else floats(points, "points", (None, 3), np.float64)
    outcome, who, note, history, values, found, sdf, vertices, faces = _core.run_fit(
        json.dumps(how, allow_nan=False),
        arrays,
        None if shape is None else shape._core,
        start,
        None if callback is None else (lambda epoch: callback(json.loads(epoch))),
    )
    warn_note(note)
    fitted = None if shape is None else Shape(shape.name, **dict(values))
    return Fit(outcome, who, fitted, found, sdf, Mesh(vertices, faces), json.loads(history))


def _target(target: object, grid: Grid, kind: str | None) -> tuple[str, list[np.ndarray]]:
    as_grid(grid)
    if hasattr(target, "faces"):
        mesh = as_mesh(target)
        return "mesh", [floats(mesh.vertices, "vertices", (None, 3), np.float64), mesh.faces]
    if kind is None:
        kind = "sdf" if np.ndim(target) == 3 else "cloud"  # type: ignore[arg-type]
    if kind not in ("sdf", "cloud"):
        raise ValueError(f"kind is {kind!r}; give 'sdf' or 'cloud'")
    shape = grid.shape if kind == "sdf" else (None, 3)
    return kind, [floats(target, "the target", shape, np.float64)]


def _count(value: object, name: str) -> int:
    found = whole(value, name)
    if found < 0:
        raise ValueError(f"{name} is {found}; give 0 or more")
    return found
