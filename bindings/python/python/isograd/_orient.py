"""Outward normals of a cloud, without a grid."""

from __future__ import annotations

import json
from dataclasses import asdict, dataclass
from typing import TYPE_CHECKING, Any, Literal

import numpy as np

from . import _core
from ._arrays import floats, known
from ._options import Options, Orient, OrientLike, check_known
from ._reconstruction import texts

if TYPE_CHECKING:
    from numpy.typing import ArrayLike


@dataclass(frozen=True, eq=False)
class Oriented:
    """Outward normals, in the order and the type of the points.

    Attributes:
        normals: ``(N, 3)`` unit vectors.
        confidence: ``(N,)`` confidence in the side of each, 0 to 1.
        report: numbers, with the names of :attr:`Reconstruction.report`; ``report["orientation"]["doubtful"]`` has
            the shares of the points whose side is doubtful, by reason.
    """

    normals: np.ndarray
    confidence: np.ndarray
    report: dict[str, Any]

    @property
    def warnings(self) -> list[str]:
        """Reasons not to trust the normals, the worst first, each with what to try."""
        return texts(self.report)


def orient(
    points: ArrayLike,
    *,
    normals: ArrayLike | None = None,
    sensors: ArrayLike | None = None,
    radius: float | Literal["auto"] = "auto",
    orient: OrientLike = Orient.AUTO,
) -> Oriented:
    """Outward unit normals of a cloud, and the confidence in the side of each.

    Args:
        points: ``(N, 3)`` samples of a surface; float32 or float64 decides the type of the result.
        normals: as :func:`reconstruct` takes them.
        sensors: as :func:`reconstruct` takes them.
        radius: of the neighborhoods, in the unit of the points, or ``"auto"``.
        orient: method that finds the sides; ``"previous"`` needs a plan, and is ``"auto"`` here.

    Raises:
        TypeError, ValueError: invalid points; the message says what is wrong and what to do.
        KeyboardInterrupt: at once, on Ctrl-C.
    """
    cloud = floats(points, "points", (None, 3))
    options = Options(radius=radius, orient=orient)
    normals, sensors = known(cloud, normals, sensors)
    check_known(options.orient, normals is not None, sensors is not None)
    normals, confidence, report = _core.orient(cloud, normals, sensors, json.dumps(asdict(options)))
    return Oriented(normals, confidence, json.loads(report))
