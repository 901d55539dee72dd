"""One cloud to one file: whole or absent, the same bytes every time, and jobs that are killed and run again."""

import hashlib
import importlib.util
import os
import pathlib
import pickle
import re
import signal
import subprocess
import sys
import time
import warnings

import numpy as np
import pytest

import isograd

EXAMPLES = pathlib.Path(__file__).parents[1] / "examples"
KINDS = [".npz", ".vti"]


@pytest.fixture(scope="module")
def points():
    return isograd.sample("sphere", 800).points.astype(np.float32)


def run(points, out, **changes):
    return isograd.to_file(points, out, **{"resolution": 16, **changes})


@pytest.mark.parametrize("kind", KINDS)
def test_the_file_has_the_field_the_verdict_and_the_settings(points, tmp_path, kind):
    out = tmp_path / f"sphere{kind}"
    row = run(points, out)
    assert row.keys() == {"path", "verdict", "seconds", "skipped"}
    assert (row["path"], row["skipped"]) == (str(out), False) and row["seconds"] > 0
    result = isograd.reconstruct(points, isograd.Grid.fit(points, 16))
    assert row["verdict"] == result.verdict
    grid, sdf = isograd.read_sdf(out)
    assert sdf.dtype == np.float32 and (sdf == result.sdf).all()
    assert grid.shape == result.grid.shape and np.allclose(grid.lower, result.grid.lower)
    if kind == ".npz":
        with np.load(out) as file:
            assert str(file["verdict"]) == row["verdict"]
            assert '"orient": "auto"' in str(file["settings"])
    else:
        assert b'"orient": "auto"' in out.read_bytes()


@pytest.mark.parametrize("kind", KINDS)
def test_only_a_whole_file_of_the_same_input_and_settings_is_skipped(points, tmp_path, kind):
    out = tmp_path / f"sphere{kind}"
    run(points, out)
    whole = out.read_bytes()
    again = run(points, out)
    assert again["skipped"] and again["verdict"] == "good" and out.read_bytes() == whole
    for change in [{"resolution": 17}, {"smoothing": 2.0}, {"grid": isograd.Grid.fit(points, 18), "resolution": None}]:
        assert not run(points, out, **change)["skipped"]
        assert run(points, out, **change)["skipped"]
    assert not run(points[1:], out)["skipped"]
    assert not run(points.astype(np.float64), out)["skipped"]
    run(points, out)
    assert out.read_bytes() == whole
    # With the end of the file in place or not.
    for at in [0, 200, len(whole) // 2, len(whole) - 10]:
        for damaged in [whole[:at], whole[:at] + bytes([whole[at] ^ 1]) + whole[at + 1 :]]:
            out.write_bytes(damaged)
            run(points, out)
            assert out.read_bytes() == whole, at
    for other in [b"", b"PK\x03\x04", b"<VTKFile/>\n\n"]:
        out.write_bytes(other)
        assert not run(points, out)["skipped"]
    isograd.write_sdf(out, *isograd.read_sdf(out))
    assert not run(points, out)["skipped"], "a field without settings"


def test_clouds_are_read_from_files_with_the_normals_that_are_used(points, tmp_path):
    cloud, out = tmp_path / "sphere.ply", tmp_path / "sphere.npz"
    normals = points / np.linalg.norm(points, axis=1, keepdims=True)
    isograd.write_points(cloud, points, normals=normals)
    run(cloud, out)
    assert run(points, out)["skipped"]
    run(cloud, out, orient="given")
    assert run(points, out, orient="given", normals=normals)["skipped"]


def test_verdicts_are_returned_and_there_is_no_warning(tmp_path):
    cloud = np.random.default_rng(1).normal(size=(60, 3))
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert run(cloud, tmp_path / "noise.npz")["verdict"] in ("check", "bad")
        assert run(cloud, tmp_path / "noise.npz", checks=False)["verdict"] is None
        assert run(cloud, tmp_path / "noise.npz", checks=False)["skipped"]


def test_bad_input_leaves_no_file(points, tmp_path):
    for error, what, change, cloud in [
        (ValueError, "must end in .npz or .vti", {"out": tmp_path / "a.ply"}, points),
        (FileNotFoundError, "create it first", {"out": tmp_path / "none" / "a.npz"}, points),
        (ValueError, "not both", {"grid": isograd.Grid.fit(points, 16)}, points),
        (ValueError, "no normals", {"orient": "given"}, points),
        (TypeError, "did you mean", {"smothing": 1}, points),
        (ValueError, "not finite", {}, np.full((9, 3), np.nan)),
        (FileNotFoundError, "none.ply", {}, tmp_path / "none.ply"),
    ]:
        out = change.pop("out", tmp_path / "a.npz")
        with pytest.raises(error, match=re.escape(what)):
            run(cloud, out, **change)
    assert list(tmp_path.iterdir()) == []


def test_the_function_is_pickled_by_name():
    assert pickle.loads(pickle.dumps(isograd.to_file)) is isograd.to_file


# The pool of the standard library, with the arguments of the examples.
POOL = """
import sys
from concurrent.futures import ProcessPoolExecutor
from functools import partial
from multiprocessing import get_context
import numpy as np
import isograd

def process(number, folder):
    points = isograd.sample("torus", 800, seed=number + 1, minor=0.2 + 0.01 * number).points
    return isograd.to_file(points.astype(np.float32), f"{folder}/{number:06}.npz", resolution=24)

if __name__ == "__main__":
    with ProcessPoolExecutor(1, get_context("spawn")) as pool:
        rows = list(pool.map(partial(process, folder=sys.argv[1]), range(12)))
    print(f"{sum(row['skipped'] for row in rows)} were there")
"""


def hashes(folder):
    return {path.name: hashlib.sha256(path.read_bytes()).hexdigest() for path in folder.iterdir()}


@pytest.mark.skipif(sys.platform == "win32", reason="process groups as on POSIX")
@pytest.mark.parametrize("name", ["pool", "dask", "ray"])
def test_a_job_that_is_killed_and_run_again_gives_the_same_bits(tmp_path, name):
    """It is killed with all of its processes as soon as three files are there."""
    if name == "pool":
        script = tmp_path / "pool.py"
        script.write_text(POOL)
    else:
        for module in {"dask": ["dask", "distributed"], "ray": ["ray"]}[name]:
            if importlib.util.find_spec(module) is None:
                pytest.skip(f"SKIPPED: {module} is not installed")
        script = EXAMPLES / f"dataset_{name}.py"
    size = ["--clouds", "12", "--resolution", "24", "--points", "800", "--workers", "1"]

    def command(folder):
        return [sys.executable, script, folder, *(size if name != "pool" else [])]

    whole, parts = tmp_path / "whole", tmp_path / "parts"
    for folder in (whole, parts):
        folder.mkdir()
    subprocess.run(command(whole), check=True)
    with subprocess.Popen(command(parts), start_new_session=True) as process:
        while len(list(parts.glob("*.npz"))) < 3 and process.poll() is None:
            time.sleep(0.002)
        os.killpg(process.pid, signal.SIGKILL)
    assert 3 <= len(list(parts.glob("*.npz"))) <= 12
    again = subprocess.run(command(parts), check=True, capture_output=True, text=True)
    skipped = int(re.search(r"(\d+) were there", again.stdout)[1])
    assert 3 <= skipped <= 12
    assert len(hashes(whole)) == 12 and hashes(parts) == hashes(whole)
