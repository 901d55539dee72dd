"""Every example runs to its end; each ends with an assertion of its own."""

import importlib.util
import pathlib
import re
import subprocess
import sys

import pytest

# Data sets are small here.
SMALL = ["--clouds", "6", "--resolution", "24", "--points", "800", "--workers", "2"]
EXAMPLES = sorted((pathlib.Path(__file__).parents[1] / "examples").glob("*.py"))


def test_there_are_examples_and_they_are_short():
    assert len(EXAMPLES) >= 2
    for path in EXAMPLES:
        assert len(path.read_text().splitlines()) < 80, path.name


def imported(path):
    """Libraries that an example imports, also by modules beside it."""
    found = set()
    for name in re.findall(r"^ *(?:import|from) ([\w.]+)", path.read_text(), re.MULTILINE):
        beside = path.parent / (name.replace(".", "/") + ".py")
        found |= imported(beside) if beside.exists() else {name.partition(".")[0]}
    return found


@pytest.mark.parametrize("path", EXAMPLES, ids=lambda path: path.name)
def test_an_example_runs(path):
    for name in sorted(imported(path)):
        if importlib.util.find_spec(name) is None:
            pytest.skip(f"SKIPPED: {name} is not installed")
    arguments = SMALL if path.name.startswith("dataset_") else []
    subprocess.run([sys.executable, path, *arguments], check=True, timeout=None)
