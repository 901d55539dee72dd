"""Progress, and the number of threads."""

import os
import pickle
import subprocess
import sys

import numpy as np
import pytest

import isograd

POINTS = isograd.sample("sphere", 1500).points
GRID = isograd.Grid.fit(POINTS, 20)
STAGES = ["normals", "orient", "splat", "poisson", "isosurface", "distance", "checks", "done"]


@pytest.mark.parametrize("checks", [True, False])
def test_progress_is_called_before_every_stage_and_at_the_end(checks):
    calls = []
    expected = isograd.reconstruct(POINTS, GRID, checks=checks)
    result = isograd.reconstruct(POINTS, GRID, checks=checks, progress=lambda *call: calls.append(call))
    assert (result.sdf == expected.sdf).all()
    names, fractions = zip(*calls)
    assert list(names) == STAGES
    assert fractions[0] == 0 and fractions[-1] == 1 and list(fractions) == sorted(set(fractions))


def test_an_exception_of_progress_ends_the_work():
    plan = isograd.Reconstructor(GRID)

    def fail(stage, _fraction):
        if stage == "splat":
            raise KeyError(stage)

    with pytest.raises(KeyError, match="splat"):
        plan(POINTS, progress=fail)
    assert plan(POINTS).sdf.shape == GRID.shape
    with pytest.raises(TypeError, match="progress is a int; give True or a function"):
        plan(POINTS, progress=3)


@pytest.mark.parametrize("library", ["tqdm", None])
def test_a_bar_is_drawn_on_standard_error(library, monkeypatch, capfd):
    if library:
        pytest.importorskip(library)
    else:
        monkeypatch.setitem(sys.modules, "tqdm", None)
    isograd.reconstruct(POINTS, GRID, progress=True)
    out, err = capfd.readouterr()
    assert out == "" and "done" in err and "100%" in err and err.endswith("\n")
    isograd.reconstruct(POINTS, GRID, progress=False)
    assert capfd.readouterr() == ("", "")


def test_the_number_of_threads_changes_no_bit():
    before = isograd.get_num_threads()
    expected = isograd.reconstruct(POINTS, GRID)
    try:
        for n in (1, np.int64(3), 2):
            isograd.set_num_threads(n)
            assert isograd.get_num_threads() == n
            result = isograd.reconstruct(POINTS, GRID)
            assert (result.sdf == expected.sdf).all()
            assert (result.pullback(result.sdf).points == expected.pullback(expected.sdf).points).all()
        for bad in (0, -1, 1.5, "4", None):
            with pytest.raises(ValueError, match="n is"):
                isograd.set_num_threads(bad)
        assert isograd.get_num_threads() == 2
    finally:
        isograd.set_num_threads(before)


def test_a_call_and_a_plan_have_threads_of_their_own():
    before, expected = isograd.get_num_threads(), isograd.reconstruct(POINTS, GRID)
    plan = pickle.loads(pickle.dumps(isograd.Reconstructor(GRID, threads=np.int64(3))))
    for result in (isograd.reconstruct(POINTS, GRID, threads=1), plan(POINTS)):
        assert (result.sdf == expected.sdf).all()
        assert (result.pullback(result.sdf).points == expected.pullback(expected.sdf).points).all()
    assert plan.threads == 3 and isograd.get_num_threads() == before
    for bad in (0, 1.5, "4"):
        with pytest.raises(ValueError, match="threads is"):
            isograd.reconstruct(POINTS, GRID, threads=bad)


def test_the_environment_sets_the_number_of_threads():
    code = "import isograd; print(isograd.get_num_threads())"
    environment = {**os.environ, "RAYON_NUM_THREADS": "5"}
    found = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, env=environment)
    assert found.stdout.strip() == "5", found


@pytest.mark.skipif(sys.platform != "linux", reason="threads as on Linux")
@pytest.mark.parametrize(("before", "argument"), [("isograd.set_num_threads(3)", ""), ("", ", threads=3")])
def test_work_runs_on_so_many_threads(before, argument):
    code = f"""
import os, isograd, numpy
{before}
points = numpy.random.default_rng(1).normal(size=(1500, 3))
points /= numpy.linalg.norm(points, axis=1, keepdims=True)
result = isograd.reconstruct(points, resolution=20{argument})
result.pullback(result.sdf)
print(len(os.listdir("/proc/self/task")) - 1)
"""
    environment = {**os.environ, "RAYON_NUM_THREADS": "7", "OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1"}
    found = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, env=environment)
    # Without the seven of the pool that was not used.
    assert 3 <= int(found.stdout) < 7, found
