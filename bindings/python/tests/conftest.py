"""Fixtures of several tests."""

import subprocess
import sys

import pytest


@pytest.fixture(scope="session")
def pyvista():
    """PyVista, where it can draw. VTK may end the process where it can't: another one tries first."""
    module = pytest.importorskip("pyvista", reason="PyVista is not here: no scene is drawn")
    attempt = (
        "import pyvista as pv; p = pv.Plotter(off_screen=True); p.add_mesh(pv.Sphere()); "
        "assert p.screenshot(return_img=True).std() > 0"
    )
    done = subprocess.run([sys.executable, "-c", attempt], capture_output=True, check=False)
    if done.returncode != 0:
        pytest.skip("PyVista can't draw without a screen here (no EGL or OSMesa): no scene is drawn")
    return module
