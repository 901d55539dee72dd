"""Grid, options and backend as one text, the only form that every interface can pass."""

from __future__ import annotations

import json
import sys
import warnings
from dataclasses import asdict

from . import _core
from ._grid import Grid
from ._options import Options, Orient, check_known, resolve


def encode(grid: Grid, options: Options | None = None, backend: str = "cpu", sdf: bool = True) -> str:
    """The JSON text that the extension module reads; numbers read back to the same bits. Without ``sdf`` the CPU finds the
    surface alone.

    Raises:
        TypeError: ``grid`` or ``options`` is of another type.
    """
    if not isinstance(grid, Grid):
        raise TypeError(f"grid is a {type(grid).__name__}; give an isograd.Grid, such as Grid.fit(points, 128)")
    options = Options() if options is None else options
    if not isinstance(options, Options):
        raise TypeError(f"options is a {type(options).__name__}; give an isograd.Options")
    return json.dumps({"grid": asdict(grid), "options": {**asdict(options), "sdf": sdf}, "backend": backend})


def encode_pure(
    grid: Grid, options: Options | None, normals_are_given: bool, backend: str, double: bool, sdf: bool = True
) -> str:
    """The text for a function that returns arrays only, in double or single precision: there is no report, so checks
    are off.

    Raises:
        TypeError: an argument of another type.
        ValueError: normals that are missing or not used; an orientation that depends on more than points and normals.
        RuntimeError: an unavailable backend.
    """
    options = resolve(options, {"checks": False})
    check_pure(options)
    check_known(options.orient, normals_are_given)
    if check_backend(backend) == "cpu":
        return encode(grid, options, sdf=sdf)
    settings = encode(grid, options, backend, sdf)
    warn_note(_core.open_backend(settings, double))
    return settings


def check_backend(backend: object) -> str:
    """The backend as a plain ``str``.

    Raises:
        TypeError: it is no ``str``.
    """
    if not isinstance(backend, str):
        raise TypeError(f"backend is a {type(backend).__name__}; give a text such as \"cpu\" or \"cuda\"")
    return str(backend)


def warn_note(note: str | None) -> None:
    """Warns the first caller outside the package that ``backend="auto"`` selected the CPU."""
    if note is not None:
        warn_caller(note, RuntimeWarning)


def warn_caller(message: str, category: type[Warning]) -> None:
    """Warns the first caller outside the package."""
    level, frame = 1, sys._getframe()
    while frame.f_back is not None and is_ours(frame.f_globals.get("__package__")):
        level, frame = level + 1, frame.f_back
    warnings.warn(message, category, stacklevel=level)


def is_ours(package: str | None) -> bool:
    """Whether this is the package, or one below it."""
    return (package or "").partition(".")[0] == __package__


def check_pure(options: Options) -> None:
    """Checks that the orientation is a function of points and normals only.

    Raises:
        ValueError: it is not.
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
