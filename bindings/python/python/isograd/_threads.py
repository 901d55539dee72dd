"""Number of threads of the work."""

from __future__ import annotations

from . import _core
from ._numbers import whole


def set_num_threads(n: int) -> None:
    """Sets the number of threads of all work that begins later, also in ``isograd.jax`` and ``isograd.torch``. Results
    have the same bits for any number.

    Raises:
        ValueError: no whole number of 1 or more.
        RuntimeError: so many threads can't be started.
    """
    _core.set_num_threads(check_threads(n, "n"))


def check_threads(threads: int, name: str) -> int:
    """The number of threads.

    Raises:
        TypeError, ValueError: no whole number of 1 or more.
    """
    found = whole(threads, name)
    if found < 1:
        raise ValueError(f"{name} is {found}; give 1 thread or more")
    return found


def get_num_threads() -> int:
    """Number of threads of the work: that of :func:`set_num_threads`, or else ``RAYON_NUM_THREADS`` of the environment, or
    else the number of cores."""
    return _core.get_num_threads()
