"""Outward normals of a cloud, without a grid."""

from __future__ import annotations

import json
from dataclasses import asdict, dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from . import _core
from ._inputs import read_input
from ._options import Options, Orient, OrientLike
from ._reconstruction import texts

if TYPE_CHECKING:
    from numpy.typing import ArrayLike

    from ._inputs import CloudLike


@dataclass(frozen=True, eq=False)
class Oriented:
    """Outward normals, in the order and the type of the points.

    Attributes:
        normals: ``(N, 3)`` unit vectors.
        confidence: ``(N,)`` confidence in the side of each, 0 to 1: below 0.1 it is doubtful, from 0.9 on sure.
        report: numbers, with the names of :attr:`Reconstruction.report`; ``report["orientation"]["doubtful"]`` has
            the shares of the points whose side is doubtful, by reason, and ``["regions"]`` the largest regions of
            such points: their number of samples, reason, and bounding box (``low``, ``high``).
    """

    normals: np.ndarray
    confidence: np.ndarray
    report: dict[str, Any]

    @property
    def warnings(self) -> list[str]:
        """Reasons not to trust the normals, the worst first, each with what to try."""
        return texts(self.report)


def orient(
    points: CloudLike,
    *,
    normals: ArrayLike | None = None,
    sensors: ArrayLike | None = None,
    radius: float | str = "auto",
    orient: OrientLike = Orient.AUTO,
) -> Oriented:
    """Outward unit normals of a cloud, and the confidence in the side of each.

    Args:
        points: ``(N, 3)`` samples of a surface, or what else :func:`reconstruct` takes; float32 or float64 decides the
            type of the result.
        normals: as for :func:`reconstruct`.
        sensors: as for :func:`reconstruct`.
        radius: of the neighborhoods, in the unit of the points, or ``"auto"``.
        orient: method that finds the sides; ``"previous"`` needs a plan, and is ``"auto"`` here.

    Raises:
        TypeError, ValueError: invalid points; the message says what is wrong and what to do.
        KeyboardInterrupt: at once, on Ctrl-C.
    """
    options = Options(radius=radius, orient=orient)
    cloud, given, places = read_input(points).arrays(normals, sensors, options.orient)
    found, confidence, report = _core.orient(cloud, given, places, json.dumps(asdict(options)))
    return Oriented(found, confidence, json.loads(report))
