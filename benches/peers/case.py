"""A comparison of several implementations of one task, run in turn."""

import statistics
import time
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any


@dataclass
class Entry:
    """One implementation: `run` executes it once and returns seconds, `result` returns its output."""

    name: str
    dtype: str
    threads: int
    run: Callable[[], float]
    result: Callable[[], Any] = lambda: None
    seconds: list[float] = field(default_factory=list)

    @property
    def median(self) -> float:
        return statistics.median(self.seconds)


@dataclass
class Case:
    """One task. `per` is the unit and number of items, e.g. ("cell", 2097152); `check` compares results."""

    title: str
    what: str
    per: tuple[str, int]
    entries: list[Entry]
    check: Callable[[], list[str]]
    checks: list[str] = field(default_factory=list)

    def measure(self, repeats: int) -> None:
        """Runs A, B, C, A, B, C, …, so that other load affects all of them. The first round, which also compiles kernels
        and fills caches, is not counted."""
        for entry in self.entries:
            entry.run()
        for _ in range(repeats):
            for entry in self.entries:
                entry.seconds.append(entry.run())
        self.checks = self.check()


def peer(name: str, dtype: str, threads: int, work: Callable[[], Any]) -> Entry:
    """An entry that calls `work` and keeps its result."""
    results = []

    def run() -> float:
        results.clear()
        start = time.perf_counter()
        result = work()
        seconds = time.perf_counter() - start
        results.append(result)
        return seconds

    return Entry(name, dtype, threads, run, result=lambda: results[0])
