"""Grid and options as one text, the only form that every interface can pass."""

from __future__ import annotations

import json
import sys
import warnings

from . import _core
from ._grid import Grid
from ._options import Level, Options, Orient, Splat, check_known, resolve


def encode(grid: Grid, options: Options | None = None, backend: str | None = None) -> str:
    """The JSON text that the Rust side reads; numbers read back to the same bits.

    Raises:
        TypeError: for what is no grid or no options.
    """
    if not isinstance(grid, Grid):
        raise TypeError(f"grid is a {type(grid).__name__}; give an isograd.Grid, such as Grid.fit(points)")
    options = Options() if options is None else options
    if not isinstance(options, Options):
        raise TypeError(f"options is a {type(options).__name__}; give an isograd.Options")
    return json.dumps(
        {
            "lower": grid.lower,
            "spacing": grid.spacing,
            "shape": grid.shape,
            "radius": None if options.radius == "auto" else options.radius,
            "orient": Orient(options.orient).value,
            "splat": Splat(options.splat).value,
            "area": options.area,
            "smoothing": None if options.smoothing == "auto" else options.smoothing,
            "screening": options.screening,
            "level": Level(options.level).value,
            "band": options.band,
            "checks": options.checks,
            "backend": backend,
        }
    )


def encode_pure(
    grid: Grid, options: Options | None, normals_are_given: bool, backend: str, double: bool
) -> str:
    """The text for a function that returns arrays alone, in double precision or single: nobody sees a report, so
    nothing is checked for one.

    Raises:
        TypeError: for what is no grid, no options or no text.
        ValueError: for normals that are missing or not used, and for ways to orient that are no function of the
            points and normals alone.
        RuntimeError: for a backend that can't be had.
    """
    options = resolve(options, {"checks": False})
    check_pure(options)
    check_known(options.orient, normals_are_given)
    if check_backend(backend) == "cpu":
        return encode(grid, options)
    settings = encode(grid, options, backend)
    say_note(_core.open_backend(settings, double))
    return settings


def check_backend(backend: object) -> str:
    """The text.

    Raises:
        TypeError: for what is none.
    """
    if not isinstance(backend, str):
        raise TypeError(f"backend is a {type(backend).__name__}; give a text such as \"cpu\" or \"cuda\"")
    return str(backend)


def say_note(note: str | None) -> None:
    """Warns the first caller outside the package that the CPU computes, where that was left to it."""
    if note is None:
        return
    level, frame = 2, sys._getframe(1)
    while frame.f_back is not None and frame.f_globals.get("__package__") == __package__:
        level, frame = level + 1, frame.f_back
    warnings.warn(note, RuntimeWarning, stacklevel=level)


def check_pure(options: Options) -> None:
    """Whether the sides of the normals are a function of points and normals alone.

    Raises:
        ValueError: where not.
    """
    if options.orient is Orient.PREVIOUS:
        raise ValueError(
            'orient is "previous", which depends on the calls before, and this is a pure function; '
            'give the normals of the step before, with orient="signs"'
        )
    if options.orient is Orient.SENSORS:
        raise ValueError(
            'orient is "sensors", and this function takes no sensors; '
            'give isograd.orient(points, sensors=...).normals, with orient="signs"'
        )
