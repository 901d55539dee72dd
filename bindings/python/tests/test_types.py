"""Types of the package, and the texts of ``help()``."""

import enum
import importlib.util
import os
import pathlib
import pydoc
import subprocess
import sys
import tempfile
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


@pytest.mark.skipif(importlib.util.find_spec("mypy") is None, reason="SKIPPED: mypy is not installed")
def test_mypy_passes_on_the_package_and_its_examples():
    # The package that is imported would be found before the sources.
    environment = {name: value for name, value in os.environ.items() if name != "PYTHONPATH"}
    with tempfile.TemporaryDirectory() as cache:
        command = [sys.executable, "-m", "mypy", "--no-color-output", "--cache-dir", cache]
        done = subprocess.run(command, cwd=ROOT, env=environment, capture_output=True, text=True)
    assert done.returncode == 0, done.stdout + done.stderr


@pytest.mark.skipif(importlib.util.find_spec("mypy") is None, reason="SKIPPED: mypy is not installed")
@pytest.mark.parametrize(
    ("call", "error"),
    [
        ("isograd.reconstruct(points, resolution=64, orient='signs', surface='2x', progress=True)", None),
        ("isograd.reconstruct(pathlib.Path('a.ply'), spacing=0.1)", None),
        ("isograd.reconstruct(isograd.sample('sphere', 9))", None),
        ("isograd.reconstruct(points, typo=3)", 'Unexpected keyword argument "typo"'),
        ("isograd.reconstruct(points, orient='left')", "incompatible type"),
        ("isograd.Reconstructor(isograd.Grid.fit(points), checks='no')", "incompatible type"),
    ],
)
def test_mypy_knows_the_keyword_options(call, error, tmp_path):
    script = tmp_path / "script.py"
    script.write_text(f"import pathlib\nimport numpy as np\nimport isograd\npoints = np.zeros((9, 3))\n{call}\n")
    environment = {**os.environ, "MYPYPATH": str(ROOT / "bindings/python/python")}
    command = [sys.executable, "-m", "mypy", "--no-color-output", "--follow-imports", "silent", "--config-file", os.devnull]
    command += ["--cache-dir", str(tmp_path.parent / "cache"), str(script)]
    done = subprocess.run(command, env=environment, capture_output=True, text=True, cwd=tmp_path)
    assert (done.returncode == 0) == (error is None) and (error or "Success") in done.stdout, done.stdout + done.stderr
