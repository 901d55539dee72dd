"""Types of the package, and the texts of ``help()``."""

import enum
import pathlib
import pydoc
import typing

import isograd
from isograd._options import OptionChanges


def test_keyword_options_are_the_fields_of_options():
    assert typing.get_type_hints(OptionChanges) == typing.get_type_hints(isograd.Options)
    assert OptionChanges.__optional_keys__ == set(isograd.Options.__dataclass_fields__)


def test_help_says_what_each_member_means():
    kinds = [kind for kind in vars(isograd).values() if isinstance(kind, enum.EnumMeta)]
    assert len(kinds) == 6
    for kind in kinds:
        text = pydoc.plain(pydoc.render_doc(kind))
        assert all(f"{member.name}: " in text for member in kind), kind
