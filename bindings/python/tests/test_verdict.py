"""The verdict of a reconstruction: in the report, in its text, and as a warning of Python."""

import pathlib
import re
import warnings

import numpy as np
import pytest

import isograd

ROOT = pathlib.Path(__file__).parents[3]
SPHERE = isograd.sample("sphere", 3000, radius=1.0).points
BOWL = SPHERE[SPHERE[:, 2] < 0.2]
GRID = isograd.Grid.fit(SPHERE, 32)


def recorded(call):
    """The result of a call, and its warnings."""
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        result = call()
    return result, [w for w in caught if w.category is isograd.ReconstructionWarning]


def test_a_good_result_says_so_and_nothing_else():
    result, said = recorded(lambda: isograd.reconstruct(SPHERE, GRID))
    assert result.verdict == result.report["verdict"] == "good"
    assert result.warnings == [] and said == []
    assert repr(result).endswith(": good")


@pytest.mark.parametrize("make", [isograd.reconstruct, isograd.Reconstructor], ids=["function", "plan"])
def test_a_bad_result_warns_once_at_the_line_of_the_caller(make):
    if make is isograd.reconstruct:
        result, said = recorded(lambda: isograd.reconstruct(BOWL, GRID))
    else:
        plan = isograd.Reconstructor(GRID)
        result, said = recorded(lambda: plan(BOWL))
    assert result.verdict == "bad" and repr(result).endswith(": bad")
    assert len(said) == 1 and said[0].filename == __file__
    text = str(said[0].message)
    assert text.startswith("the result is bad: open (try: ") and "sheet=" in text and "docs/bad-results.md" in text
    for warning, line in zip(result.report["warnings"], result.warnings):
        assert {"code", "severity", "text", "try"} < set(warning) or warning["code"] == "wall"
        assert warning["code"] in text and warning["try"] in text
        assert warning["text"] in line and warning["try"] in line
    assert result.report["warnings"][0]["samples"] > 20


def test_a_loop_shows_the_warning_once():
    plan = isograd.Reconstructor(isograd.Grid.fit(SPHERE, 32, padding=0.3))
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("default")
        for growth in (1.0, 1.02, 1.04):
            plan(growth * BOWL)
    assert [w.category for w in caught] == [isograd.ReconstructionWarning]


def test_without_checks_there_is_no_verdict():
    result, said = recorded(lambda: isograd.reconstruct(BOWL, GRID, checks=False))
    assert said == [] and result.verdict in (None, "bad")
    sound = isograd.reconstruct(SPHERE, GRID, checks=False)
    assert sound.verdict is None and repr(sound).endswith(": not checked")


def test_a_doubtful_result_is_to_be_checked():
    points = np.insert(SPHERE, 7, (500.0, 0.0, 3.0), axis=0)
    result, said = recorded(lambda: isograd.reconstruct(points, GRID))
    assert result.verdict == "check" and len(said) == 1
    assert [w["code"] for w in result.report["warnings"]] == ["outliers"]
    assert result.report["warnings"][0]["samples"] == 1


def test_options_to_try_exist():
    page = (ROOT / "docs/bad-results.md").read_text(encoding="utf-8")
    names = set(re.findall(r"`(\w+)=\"?[\w.]+\"?`", page)) - {"padding", "sensors"}
    assert names and names <= set(isograd.Options.__dataclass_fields__), names
