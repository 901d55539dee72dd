"""Every example runs to its end; each ends with an assertion of its own."""

import importlib.util
import pathlib
import re
import subprocess
import sys

import isograd
import numpy as np
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


def test_fluxes_of_the_tunnel_are_those_of_jax_cfd(monkeypatch):
    pytest.importorskip("jax_cfd", reason="SKIPPED: jax-cfd is not installed")
    monkeypatch.syspath_prepend(EXAMPLES[0].parent)
    from flow_host.jax_cfd_tunnel import Tunnel
    from jax_cfd.base import advection, diffusion

    tunnel = Tunnel(isograd.Grid((0.0, 0.0, 0.0), 0.1, (8, 6, 7)), viscosity=0.03, dt=0.02)
    velocity = [np.random.default_rng(k).standard_normal((8, 6, 7)).astype(np.float32) for k in range(3)]
    variables = tunnel.variables(velocity, tunnel.grid.cell_faces)
    for i, u in enumerate(variables):
        # Its `advect_van_leer` takes the correction from the next cell along the component.
        carried = advection.advect_van_leer_using_limiters(u, variables, tunnel.dt).data
        expected = carried + diffusion.diffuse(u, tunnel.viscosity).data
        np.testing.assert_allclose(tunnel.rate(velocity, i), expected, atol=1e-4 * np.abs(expected).max())
