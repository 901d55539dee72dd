"""Copies and pickles of objects around a result in Rust: copies share it, and pickles leave it out."""

from __future__ import annotations

import copy
import hashlib
from typing import TYPE_CHECKING, Any, TypeVar

from . import _core
from ._settings import encode

if TYPE_CHECKING:
    from ._reconstruction import Reconstruction

    Self = TypeVar("Self", bound="Stored")


class Stored:
    """Base of objects around a result in Rust, the attribute ``_core``, which is never changed."""

    def __copy__(self: Self) -> Self:
        other = object.__new__(type(self))
        other.__dict__.update(self.__dict__)
        return other

    def __deepcopy__(self: Self, memo: dict[int, Any]) -> Self:
        other = object.__new__(type(self))
        memo[id(self)] = other
        for name, value in self.__dict__.items():
            other.__dict__[name] = value if name == "_core" else copy.deepcopy(value, memo)
        return other

    def _state(self, *names: str) -> dict[str, Any]:
        """All attributes but the result in Rust, among them those of these names."""
        for name in names:
            getattr(self, name)
        return {name: value for name, value in self.__dict__.items() if name != "_core"}


def checksum(result: _core.Result) -> str:
    """A checksum of φ and the vertices, bit by bit."""
    found = hashlib.sha256(result.array("sdf").data)
    found.update(result.array("vertices").data)
    return found.hexdigest()


def compute_again(result: Reconstruction, inputs: tuple[Any, ...], expected: str) -> _core.Result:
    """The result in Rust of an unpickled reconstruction.

    Raises:
        RuntimeError: the orientation depends on the calls before; this machine has no such backend, or gives other bits.
    """
    what = "this reconstruction was unpickled, and what was not stored in it can't be computed again"
    if result.report["orientation"]["method"] == "previous":
        raise RuntimeError(f'{what}: with orient="previous" it depends on the calls before; call the plan again')
    try:
        plan = _core.Plan(encode(result.grid, result.options, result._requested))
        found = plan.reconstruct(*inputs)
    except (RuntimeError, ValueError) as error:
        raise RuntimeError(f"{what}: {error}; reconstruct its points here") from error
    if checksum(found) != expected:
        raise RuntimeError(
            f"{what}: {found.backend()!r} of this machine gives other bits than {result.backend!r} of the one where it "
            "was made; reconstruct its points here"
        )
    return found
