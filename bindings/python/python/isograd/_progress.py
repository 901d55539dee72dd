"""Progress of a reconstruction."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from itertools import accumulate
from typing import Any

Progress = Callable[[str, float], object]
"""Called with the name of a stage that begins, and the fraction of the work before it."""

# Measured on shapes of 5,000 to 50,000 points at resolutions of 64 to 128.
_SHARES = {
    "normals": 0.11,
    "orient": 0.19,
    "splat": 0.05,
    "poisson": 0.10,
    "isosurface": 0.06,
    "distance": 0.34,
    "checks": 0.15,
}
_BEFORE = dict(zip(_SHARES, accumulate(_SHARES.values(), initial=0.0)))


@contextmanager
def observe(progress: Progress | bool | None) -> Iterator[Callable[[str], object] | None]:
    """A function that is called with the name of each stage and calls ``progress``, or draws a bar for ``True``; ``None``
    for no progress. At the end ``progress`` is called with ``"done"``.

    Raises:
        TypeError: ``progress`` can't be called.
    """
    if progress is None or progress is False:
        yield None
        return
    bar = _bar() if progress is True else None
    call = progress if bar is None else bar.show
    if not callable(call):
        raise TypeError(f"progress is a {type(progress).__name__}; give True or a function of stage and fraction")
    try:
        yield lambda stage: call(stage, _BEFORE[stage])
        call("done", 1.0)
    finally:
        if bar is not None:
            bar.close()


class _Line:
    """A line on standard error that is written again for each stage."""

    def show(self, stage: str, fraction: float) -> None:
        sys.stderr.write(f"\r{fraction:4.0%} {stage:<12}")
        sys.stderr.flush()

    def close(self) -> None:
        sys.stderr.write("\n")


class _Tqdm:
    """A bar of tqdm on standard error."""

    def __init__(self, tqdm: Any) -> None:
        self._bar = tqdm(total=100, bar_format="{l_bar}{bar}| {elapsed}")

    def show(self, stage: str, fraction: float) -> None:
        self._bar.set_description(stage, refresh=False)
        self._bar.update(round(100 * fraction) - self._bar.n)
        self._bar.refresh()

    def close(self) -> None:
        self._bar.close()


def _bar() -> _Line | _Tqdm:
    try:
        from tqdm import tqdm
    except ImportError:
        return _Line()
    return _Tqdm(tqdm)
