"""Options of the reconstruction."""

from __future__ import annotations

from dataclasses import dataclass, fields, replace
from difflib import get_close_matches
from enum import Enum
from typing import Literal, TypedDict, TypeVar

from ._numbers import number


class Orient(str, Enum):
    """Methods that find the side of each normal.

    Attributes:
        AUTO: from enclosure, visibility, sheets and neighbors.
        PARITY: by counting crossings along the normal, as in the paper.
        GIVEN: the given normals, unchanged.
        SIGNS: estimated directions, each on the side of the given normal.
        SENSORS: estimated directions, each on the side of the sensor that saw its point.
        PREVIOUS: in a plan: estimated directions, each on the side of the normal of the same point in the previous
            call.
    """

    AUTO = "auto"
    PARITY = "parity"
    GIVEN = "given"
    SIGNS = "signs"
    SENSORS = "sensors"
    PREVIOUS = "previous"


class Splat(str, Enum):
    """Weights that spread a sample over the cells around it.

    Attributes:
        BSPLINE: quadratic B-spline.
        PAPER: the paper's weights.
    """

    BSPLINE = "bspline"
    PAPER = "paper"


class Level(str, Enum):
    """Value of the indicator at the surface.

    Attributes:
        THIN: the value at the samples nearby. Parts thinner than a cell are made about a cell thick, and automatic cells
            of the surface are halved where the solve is dense.
        LOCAL: like ``THIN``, without both: thin parts may be cut off.
        MEAN: the mean at all samples, as in the paper.
    """

    THIN = "thin"
    LOCAL = "local"
    MEAN = "mean"


class Solve(str, Enum):
    """Cells at which the indicator is computed.

    Attributes:
        AUTO: all of the surface's cells up to 2²⁵ of them, else as ``SPARSE``.
        DENSE: all of them.
        SPARSE: those near the samples and the surface; coarse cells elsewhere.
    """

    AUTO = "auto"
    DENSE = "dense"
    SPARSE = "sparse"


class Walls(str, Enum):
    """Condition of the indicator at the walls of the grid.

    Attributes:
        FREE: the surface may pass through a wall, at right angles: for half of a body that ends there.
        CLOSED: the surface never reaches a wall.
        AUTO: ``FREE`` if a sample lies within 3.5 cells of a wall, which is never so on a fitted grid, else ``CLOSED``.
    """

    FREE = "free"
    CLOSED = "closed"
    AUTO = "auto"


class Outliers(str, Enum):
    """Use of outliers: samples that are far from all others, or in mid-air.

    Attributes:
        IGNORE: left out, with a warning. Their gradients are 0.
        KEEP: samples like all others.
    """

    IGNORE = "ignore"
    KEEP = "keep"


Fill = Literal["inside", "band"]
OrientLike = Orient | Literal["auto", "parity", "given", "signs", "sensors", "previous"]
SplatLike = Splat | Literal["bspline", "paper"]
LevelLike = Level | Literal["thin", "local", "mean"]
SolveLike = Solve | Literal["auto", "dense", "sparse"]
WallsLike = Walls | Literal["free", "closed", "auto"]
OutliersLike = Outliers | Literal["ignore", "keep"]


@dataclass(frozen=True)
class Options:
    """Parameters of the reconstruction. The command line has the same names and units.

    Attributes:
        radius: neighborhood radius of the normals, in the unit of the points, or ``"auto"``: that of 24 samples, or of as many
            as reach the next lines, where samples lie along lines. ``"cut:R"`` is a radius with the paper's weights, which end
            at it with a jump. With ``"auto"`` alone, normals are refined by quadrics fitted to the samples of their side.
        orient: method that finds the side of each normal; see :class:`Orient`.
        splat: weights that spread a sample over the cells around it; see :class:`Splat`.
        area: whether a sample is weighted by the area that it stands for.
        smoothing: width of the smoothing of the indicator, in cells of the surface; 0 for none, ``"auto"`` for 0.8 of the
            typical distance between samples.
        screening: strength of the pull of the indicator to one value at the samples; 1 to 4 are usual, 0 is off.
        level: value of the indicator at the surface; see :class:`Level`.
        surface: cells that the surface is found on: ``"auto"`` for about the distance between samples,
            at most twice as fine as those of φ, or four times where these are at most 2²⁵ cells;
            ``"grid"`` for those of φ; a cell size in the unit of the points, or how many times as fine as φ's, such as
            ``"3x"``. φ stays on its own grid.
        solve: cells at which the indicator is computed; see :class:`Solve`.
        walls: condition of the indicator at the walls of the grid; see :class:`Walls`.
        trim: distance from all samples, in the unit of the points, beyond which faces of the mesh are removed; ``"auto"`` for
            4 times the typical distance between samples or, where they are sparse, 2.5 times that around the nearest one;
            ``"off"`` for none. φ is not changed by it.
        sheet: thickness of a membrane or sail, in the unit of the points, or ``"off"``: φ is the unsigned distance to the
            trimmed surface less half of it, and the mesh is the closed shell. ``trim`` is ``"auto"`` unless it is given.
        outliers: use of samples that are far from all others, or in mid-air; see :class:`Outliers`.
        band: distance from the surface up to which φ is computed, in the unit of the points, or ``"full"``.
        checks: whether to measure the result and to check whether it can be trusted.

    Raises:
        ValueError: a value outside its range.
    """

    radius: float | str = "auto"
    orient: OrientLike = Orient.AUTO
    splat: SplatLike = Splat.BSPLINE
    area: bool = True
    smoothing: float | Literal["auto"] = "auto"
    screening: float = 0.0
    level: LevelLike = Level.THIN
    surface: float | str = "auto"
    solve: SolveLike = Solve.AUTO
    walls: WallsLike = Walls.FREE
    trim: float | Literal["auto", "off"] = "off"
    sheet: float | Literal["off"] = "off"
    outliers: OutliersLike = Outliers.IGNORE
    band: float | Literal["full"] = "full"
    checks: bool = True

    def __post_init__(self) -> None:
        checked = {
            "radius": _radius(self.radius),
            "orient": choice(Orient, self.orient, "orient"),
            "splat": choice(Splat, self.splat, "splat"),
            "area": bool(self.area),
            "smoothing": self.smoothing,
            "screening": _not_negative(self.screening, "screening", "0 or more"),
            "level": choice(Level, self.level, "level"),
            "surface": _surface(self.surface),
            "solve": choice(Solve, self.solve, "solve"),
            "walls": choice(Walls, self.walls, "walls"),
            "trim": length(self.trim, "trim", "auto", "off"),
            "sheet": length(self.sheet, "sheet", "off"),
            "outliers": choice(Outliers, self.outliers, "outliers"),
            "band": length(self.band, "band", "full"),
            "checks": bool(self.checks),
        }
        if not (isinstance(self.smoothing, str) and self.smoothing == "auto"):
            checked["smoothing"] = _not_negative(self.smoothing, "smoothing", '0 or more cells, or "auto"')
        for name, value in checked.items():
            object.__setattr__(self, name, value)


class OptionChanges(TypedDict, total=False):
    """Fields of :class:`Options` as keyword arguments."""

    radius: float | str
    orient: OrientLike
    splat: SplatLike
    area: bool
    smoothing: float | Literal["auto"]
    screening: float
    level: LevelLike
    surface: float | str
    solve: SolveLike
    walls: WallsLike
    trim: float | Literal["auto", "off"]
    sheet: float | Literal["off"]
    outliers: OutliersLike
    band: float | Literal["full"]
    checks: bool


def resolve(options: Options | None, changes: OptionChanges) -> Options:
    """``options``, or the defaults, with some fields changed.

    Raises:
        TypeError: an unknown option, or ``options`` of another type.
    """
    if options is not None and not isinstance(options, Options):
        raise TypeError(f"options is a {type(options).__name__}; give an isograd.Options")
    names = [field.name for field in fields(Options)]
    for name in changes:
        if name not in names:
            similar = get_close_matches(name, names, 1)
            hint = f"did you mean {similar[0]!r}?" if similar else f"the options are {', '.join(names)}"
            raise TypeError(f"unknown option {name!r}; {hint}")
    return replace(options or Options(), **changes)


def check_known(orient: OrientLike, normals: bool, sensors: bool = False) -> None:
    """Checks that normals and sensors are given exactly where they are used.

    Raises:
        ValueError: they are missing, or not used.
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


def check_fill(fill: object, band: float | str = "full") -> Fill:
    """The region of extended values: ``"inside"`` or ``"band"``.

    Raises:
        ValueError: another name, or ``"inside"`` although φ has a ``band`` of its own.
    """
    if fill != "inside" and fill != "band":
        raise ValueError(f'fill is {fill!r}; give "inside" or "band"')
    if fill == "inside" and band != "full":
        raise ValueError(
            f"options.band is {band}, and the closest points of cells inside are unknown beyond it; "
            'give fill="band" or options with band="full"'
        )
    return "inside" if fill == "inside" else "band"


E = TypeVar("E", bound=Enum)


def choice(kind: type[E], value: object, name: str) -> E:
    """One of the values of ``kind``.

    Raises:
        ValueError: it is none of them.
    """
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


def _surface(value: object) -> float | str:
    text = str(value)
    if text in ("grid", "auto"):
        return text
    is_factor = isinstance(value, str) and text.endswith("x")
    try:
        found = float(text[:-1]) if is_factor else number(value, "surface")
    except (TypeError, ValueError):
        found = float("nan")
    if is_factor and 1 / 64 <= found <= 64.0:
        return text
    if not is_factor and 0.0 < found < float("inf"):
        return found
    raise ValueError(
        f'surface is {value!r}; give "grid", "auto", a cell size above 0, or a factor from 1/64 to 64, such as "3x"'
    )


def _radius(value: object) -> float | str:
    is_cut = isinstance(value, str) and value.startswith("cut:")
    try:
        length(float(str(value)[4:]) if is_cut else value, "radius", "auto")
    except ValueError:
        raise ValueError(
            f'radius is {value!r}; give a finite number above 0, "auto", or "cut:" and the number for the paper\'s weights'
        ) from None
    return value if isinstance(value, str) else number(value, "radius")


def length(value: object, name: str, *words: str) -> float | str:
    """A finite number above 0, or one of ``words``.

    Raises:
        ValueError: it is neither.
    """
    if isinstance(value, str) and value in words:
        return value
    if not isinstance(value, str):
        found = number(value, name)
        if 0.0 < found < float("inf"):
            return found
    others = " or ".join(f'"{word}"' for word in words)
    raise ValueError(f"{name} is {value!r}; give a finite number above 0, or {others}")
