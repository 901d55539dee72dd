"""Checks of numbers passed by the user."""

from __future__ import annotations

import numbers
import operator

import numpy as np


def number(value: object, name: str) -> float:
    """A real number as ``float``.

    Raises:
        ValueError: it is no real number.
    """
    if isinstance(value, np.ndarray) and value.ndim == 0:
        value = value[()]
    if not isinstance(value, numbers.Real):
        raise ValueError(f"{name} is {value!r}; give a number")
    return float(value)


def whole(value: object, name: str) -> int:
    """A whole number as ``int``.

    Raises:
        ValueError: it is no whole number of 64 bits.
    """
    try:
        found = operator.index(value)  # type: ignore[arg-type]
    except TypeError:
        raise ValueError(f"{name} is {value!r}; give a whole number") from None
    if not -(2**63) <= found < 2**63:
        raise ValueError(f"{name} is {found}; give a smaller number")
    return found


def size(value: object, name: str) -> int:
    """The fixed length of an array as ``int``.

    Raises:
        ValueError: it is no whole number, or not from 1 to 2³¹ - 1.
    """
    if isinstance(value, bool) or not 0 < (found := whole(value, name)) < 2**31:
        raise ValueError(f"{name} is {value!r}; give a whole number from 1 to 2**31 - 1")
    return found
