"""Types of the package, and the texts of ``help()``."""

import enum
import importlib.util
import os
import pathlib
import pydoc
import subprocess
import sys
import typing

import pytest

import isograd
from isograd._options import OptionChanges

ROOT = pathlib.Path(__file__).parents[3]


def test_keyword_options_are_the_fields_of_options():
    assert typing.get_type_hints(OptionChanges) == typing.get_type_hints(isograd.Options)
    assert OptionChanges.__optional_keys__ == set(isograd.Options.__dataclass_fields__)


def test_help_says_what_each_member_means():
    kinds = [kind for kind in vars(isograd).values() if isinstance(kind, enum.EnumMeta)]
    assert len(kinds) == 6
    for kind in kinds:
        text = pydoc.plain(pydoc.render_doc(kind))
        assert all(f"{member.name}: " in text for member in kind), kind


needs_mypy = pytest.mark.skipif(importlib.util.find_spec("mypy") is None, reason="SKIPPED: mypy is not installed")


def mypy(*arguments):
    # A package beside the sources would be found first. The cache is that of the project: types of libraries take longest.
    environment = {name: value for name, value in os.environ.items() if name != "PYTHONPATH"}
    command = [sys.executable, "-m", "mypy", "--no-color-output", "--cache-dir", str(ROOT / "target/xtask/mypy")]
    done = subprocess.run([*command, *arguments], cwd=ROOT, env=environment, capture_output=True, text=True)
    return done.returncode, done.stdout + done.stderr


@needs_mypy
def test_mypy_passes_on_the_package_and_its_examples():
    status, output = mypy()
    assert status == 0, output


@needs_mypy
def test_mypy_knows_the_keyword_options(tmp_path):
    calls = {
        "isograd.reconstruct(points, resolution=64, orient='signs', surface='2x', progress=True)": None,
        "isograd.reconstruct(pathlib.Path('a.ply'), spacing=0.1)": None,
        "isograd.reconstruct(isograd.sample('sphere', 9))": None,
        "isograd.reconstruct(points, typo=3)": 'Unexpected keyword argument "typo"',
        "isograd.reconstruct(points, orient='left')": "Literal['left']",
        "isograd.Reconstructor(isograd.Grid.fit(points), checks='no')": 'expected "bool"',
    }
    script = tmp_path / "script.py"
    lines = ["import pathlib", "import numpy as np", "import isograd", "points = np.zeros((9, 3))", *calls]
    script.write_text("\n".join(lines))
    status, output = mypy(str(script))
    assert status == 1, output
    for line, error in enumerate(calls.values(), 5):
        found = [text for text in output.splitlines() if f"script.py:{line}:" in text]
        assert any(error in text for text in found) if error else not found, output
