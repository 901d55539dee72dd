"""The package as it is installed."""

import re
import signal
import subprocess
import sys
import time
from importlib import metadata, resources

import pytest

import isograd

COMMAND = [sys.executable, "-m", "isograd"]


def run(*arguments):
    return subprocess.run([*COMMAND, *map(str, arguments)], capture_output=True, text=True)


def test_the_version_is_that_of_the_crates():
    assert isograd.__version__ == metadata.version("isograd")


def test_types_are_part_of_the_package():
    assert resources.files(isograd).joinpath("py.typed").is_file()


def test_the_package_brings_the_command():
    (script,) = metadata.entry_points(group="console_scripts", name="isograd")
    assert callable(script.load())
    assert run("--version").stdout.split() == ["isograd", isograd.__version__]


def test_the_command_writes_files_and_returns_its_status(tmp_path):
    cloud, sdf = tmp_path / "sphere.ply", tmp_path / "sdf.npz"
    assert run("sample", "sphere", "-n", 800, "-o", cloud).returncode == 0
    done = run("reconstruct", cloud, "--sdf", sdf, "--resolution", 24)
    assert done.returncode == 0 and re.search("closed, 1 piece", done.stdout), done
    grid, values = isograd.read_sdf(sdf)
    expected = isograd.reconstruct(isograd.read_points(cloud).points, grid)
    assert (values == expected.sdf).all()
    missing = run("reconstruct", tmp_path / "none.ply", "--sdf", sdf)
    assert missing.returncode == 1 and "none.ply" in missing.stderr
    assert run("reconstruct", cloud, "--resolution", 0).returncode == 2


@pytest.mark.skipif(sys.platform != "linux", reason="signals as on Linux")
def test_ctrl_c_ends_the_command(tmp_path):
    cloud = tmp_path / "sphere.ply"
    assert run("sample", "sphere", "-n", 20_000, "-o", cloud).returncode == 0
    command = [*COMMAND, "reconstruct", cloud, "--sdf", tmp_path / "sdf.vti", "--resolution", "400", "-v"]
    # A process in the background, or under nohup, starts with this signal ignored, and so would its child.
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    with subprocess.Popen(command, stderr=subprocess.PIPE, text=True) as process:
        # The first line comes after the signal handler.
        process.stderr.readline()
        time.sleep(0.1)
        process.send_signal(signal.SIGINT)
        assert process.wait() == 130
    signal.signal(signal.SIGINT, before)
    assert [path.name for path in tmp_path.iterdir()] == ["sphere.ply"]
