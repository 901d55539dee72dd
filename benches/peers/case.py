"""A comparison: several ways to do one job, run in turn."""

import statistics
import time
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any


@dataclass
class Entry:
    """One way to do the job: `run` does it once and returns seconds, `result` is what that run made."""

    name: str
    dtype: str
    threads: int
    run: Callable[[], float]
    ours: bool = False
    result: Callable[[], Any] = lambda: None
    seconds: list[float] = field(default_factory=list)

    @property
    def median(self) -> float:
        return statistics.median(self.seconds)


@dataclass
class Case:
    """One job. `per` is what a time is divided by, e.g. ("cell", 2097152); `check` compares results."""

    title: str
    what: str
    per: tuple[str, int]
    entries: list[Entry]
    check: Callable[[], list[str]]
    checks: list[str] = field(default_factory=list)

    def measure(self, repeats: int) -> None:
        """Runs A, B, C, A, B, C, …: what slows the machine down slows all of them. The first round,
        which also compiles kernels and fills caches, is not counted."""
        for entry in self.entries:
            entry.run()
        for _ in range(repeats):
            for entry in self.entries:
                entry.seconds.append(entry.run())
        self.checks = self.check()

    def ours(self, dtype: str, threads: int) -> Entry:
        """Our entry of the same type, where there is one, with as many threads as the peer had."""
        all_mine = [entry for entry in self.entries if entry.ours]
        mine = [entry for entry in all_mine if entry.dtype == dtype] or all_mine
        same = [entry for entry in mine if entry.threads == threads]
        return (same or mine)[-1]


def peer(name: str, dtype: str, threads: int, work: Callable[[], Any]) -> Entry:
    """An entry that calls `work` and keeps what it returns."""
    kept = []

    def run() -> float:
        kept.clear()
        start = time.perf_counter()
        result = work()
        seconds = time.perf_counter() - start
        kept.append(result)
        return seconds

    return Entry(name, dtype, threads, run, result=lambda: kept[0])
