"""Single numbers that users pass."""

from __future__ import annotations

import numbers
import operator

import numpy as np


def number(value: object, name: str) -> float:
    """A real number; no text, and nothing complex.

    Raises:
        ValueError: for anything else.
    """
    if isinstance(value, np.ndarray) and value.ndim == 0:
        value = value[()]
    if not isinstance(value, numbers.Real):
        raise ValueError(f"{name} is {value!r}; give a number")
    return float(value)


def whole(value: object, name: str) -> int:
    """A whole number.

    Raises:
        ValueError: for anything else, or one beyond 64 bits.
    """
    try:
        found = operator.index(value)  # type: ignore[arg-type]
    except TypeError:
        raise ValueError(f"{name} is {value!r}; give a whole number") from None
    if not -(2**63) <= found < 2**63:
        raise ValueError(f"{name} is {found}; give a smaller number")
    return found
