"""What to compute, and how."""

from __future__ import annotations

from dataclasses import dataclass, fields
from enum import Enum
from typing import Literal

from ._numbers import number


class Orient(str, Enum):
    """How the side of each normal is found."""

    AUTO = "auto"
    """From enclosure, sky, sheets and neighbors."""
    PARITY = "parity"
    """By counting crossings along the normal, as the paper prints it."""
    GIVEN = "given"
    """The normals that are given, as they are."""
    SIGNS = "signs"
    """The directions found, each on the side of the normal that is given."""
    SENSORS = "sensors"
    """The directions found, each on the side from which its point was seen."""
    PREVIOUS = "previous"
    """In a plan: the directions found, each on the side of the normal that the same point had in the call before."""


class Splat(str, Enum):
    """How a sample is spread over the cells round it."""

    BSPLINE = "bspline"
    """Quadratic B-spline."""
    PAPER = "paper"
    """The paper's weights."""


class Level(str, Enum):
    """Which value of the indicator the surface is at."""

    LOCAL = "local"
    """What it is at the samples near by."""
    THIN = "thin"
    """The same, also where the body is thinner than a cell, and made a cell thick; gradients go up and down there."""
    MEAN = "mean"
    """The mean at all samples, as in the paper."""


OrientLike = Orient | Literal["auto", "parity", "given", "signs", "sensors", "previous"]
SplatLike = Splat | Literal["bspline", "paper"]
LevelLike = Level | Literal["local", "thin", "mean"]


@dataclass(frozen=True)
class Options:
    """What to compute, and how.

    Attributes:
        radius: neighborhood radius of the normals, in the unit of the points, or ``"auto"``.
        orient: see :class:`Orient`.
        splat: see :class:`Splat`.
        area: whether a sample counts by the area that it stands for.
        smoothing: width of the smoothing of the indicator, in cells; 0 for none, ``"auto"`` for 0.8 of the
            typical distance between samples.
        screening: how strongly the indicator is drawn to one value at the samples; 1 to 4 are usual, 0 is off.
        level: see :class:`Level`.
        band: how far from the surface φ is computed, in cells; ``None`` for everywhere.
        checks: whether to measure the result and look for reasons not to trust it.

    Raises:
        ValueError: for a value that makes no sense.
    """

    radius: float | Literal["auto"] = "auto"
    orient: OrientLike = Orient.AUTO
    splat: SplatLike = Splat.BSPLINE
    area: bool = True
    smoothing: float | Literal["auto"] = "auto"
    screening: float = 0.0
    level: LevelLike = Level.LOCAL
    band: float | None = None
    checks: bool = True

    def __post_init__(self) -> None:
        object.__setattr__(self, "orient", _choice(Orient, self.orient, "orient"))
        object.__setattr__(self, "splat", _choice(Splat, self.splat, "splat"))
        if not isinstance(self.radius, str) or self.radius != "auto":
            object.__setattr__(self, "radius", _above_zero(self.radius, "radius", '"auto"'))
        if self.band is not None:
            object.__setattr__(self, "band", _above_zero(self.band, "band", "None"))
        object.__setattr__(self, "level", _choice(Level, self.level, "level"))
        if not isinstance(self.smoothing, str) or self.smoothing != "auto":
            object.__setattr__(self, "smoothing", _not_negative(self.smoothing, "smoothing", '0 or more cells, or "auto"'))
        object.__setattr__(self, "screening", _not_negative(self.screening, "screening", "0 or more"))
        object.__setattr__(self, "area", bool(self.area))
        object.__setattr__(self, "checks", bool(self.checks))


def resolve(options: Options | None, changes: dict[str, object]) -> Options:
    """``options``, or the defaults, with some fields changed.

    Raises:
        TypeError: for a name that is no option.
    """
    if options is not None and not isinstance(options, Options):
        raise TypeError(f"options is a {type(options).__name__}; give an isograd.Options")
    names = [field.name for field in fields(Options)]
    for name in changes:
        if name not in names:
            raise TypeError(f"{name!r} is no option; the options are {', '.join(names)}")
    values = {name: getattr(options or Options(), name) for name in names}
    return Options(**{**values, **changes})


def check_known(orient: OrientLike, normals: bool, sensors: bool = False) -> None:
    """Whether normals and sensors are there where they are used, and only there.

    Raises:
        ValueError: where not.
    """
    orient = Orient(orient)
    users = {"normals": (Orient.GIVEN, Orient.SIGNS), "sensors": (Orient.SENSORS,)}
    for name, are_given in (("normals", normals), ("sensors", sensors)):
        are_used = orient in users[name]
        if are_used and not are_given:
            raise ValueError(f"orient is {orient.value!r} and there are no {name}; give {name}")
        if are_given and not are_used:
            wanted = " or ".join(f'orient="{user.value}"' for user in users[name])
            raise ValueError(
                f"{name} are given and orient is {orient.value!r}, which does not use them; "
                f"give none, or options with {wanted}"
            )


def _choice(kind: type[Enum], value: object, name: str) -> Enum:
    try:
        return kind(value)
    except ValueError:
        choices = ", ".join(repr(choice.value) for choice in kind)
        raise ValueError(f"{name} is {value!r}; give one of {choices}") from None


def _not_negative(value: object, name: str, wanted: str) -> float:
    found = number(value, name)
    if not 0.0 <= found < float("inf"):
        raise ValueError(f"{name} is {value!r}; give {wanted}")
    return found


def _above_zero(value: object, name: str, other: str) -> float:
    found = number(value, name)
    if not 0.0 < found < float("inf"):
        raise ValueError(f"{name} is {value!r}; give a finite number above 0, or {other}")
    return found
