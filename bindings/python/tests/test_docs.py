"""Every block of Python code on the pages runs. The blocks of a page run in their order and share their names; a
block that needs a library beyond NumPy has a copy of these, so that the others never need that library. So does the code
in the table of features."""

import ast
import importlib.util
import pathlib
import re
import sys

import numpy
import pytest

import isograd

ROOT = pathlib.Path(__file__).parents[3]
PAGES = ["README.md", "docs/python.md", "docs/differentiable.md", "docs/coming-from.md", "docs/flow.md", "docs/datasets.md"]
OPTIONAL = {"h5py", "jax", "matplotlib", "open3d", "optax", "pyvista", "rtree", "torch", "trimesh", "warp", "xarray"}


class Page:
    """The blocks of a page, and the names that they have made so far."""

    def __init__(self, path):
        self.path = ROOT / path
        self.blocks = blocks(self.path.read_text(encoding="utf-8"))
        self.names = {}
        self.done = 0

    def run(self, index):
        """Runs a block after those before it."""
        while self.done < index:
            self.done += 1
            if not needs(self.blocks[self.done - 1][1]):
                self.execute(self.done - 1, self.names)
        source = self.blocks[index][1]
        self.execute(index, dict(self.names) if needs(source) else self.names)
        self.done = index + 1

    def execute(self, index, names):
        line, source = self.blocks[index]
        # Errors then name the page and its line.
        exec(compile("\n" * line + source, str(self.path), "exec"), names)


def blocks(text):
    """Line and source of each block of Python."""
    found = re.finditer(r"^```python\n(.*?)^```$", text, re.MULTILINE | re.DOTALL)
    return [(text.count("\n", 0, match.start(1)), match.group(1)) for match in found]


def needs(source):
    """The libraries beyond NumPy that a block imports."""
    imported = set()
    for node in ast.walk(ast.parse(source)):
        if isinstance(node, ast.Import):
            imported |= {alias.name.partition(".")[0] for alias in node.names}
        elif isinstance(node, ast.ImportFrom) and node.module:
            imported.add(node.module.partition(".")[0])
    return sorted(imported & OPTIONAL)


PAGE = {path: Page(path) for path in PAGES}
EVERY = [(path, index) for path, page in PAGE.items() for index in range(len(page.blocks))]


def test_blocks_are_found_with_their_lines():
    text = "a\n```python\nx = 1\n```\n```sh\nls\n```\n```python\nimport torch.nn\nfrom jax import jit\n```\n"
    assert blocks(text) == [(2, "x = 1\n"), (8, "import torch.nn\nfrom jax import jit\n")]
    assert [needs(source) for _, source in blocks(text)] == [[], ["jax", "torch"]]
    assert len(PAGE["docs/python.md"].blocks) > 10
    assert all(page.blocks for page in PAGE.values())


@pytest.mark.parametrize(("path", "index"), EVERY, ids=[f"{path}-{index}" for path, index in EVERY])
def test_a_block_of_a_page_runs(path, index, monkeypatch):
    # Paths on the pages begin at the root of the repository.
    monkeypatch.chdir(ROOT)
    page = PAGE[path]
    for library in needs(page.blocks[index][1]):
        if importlib.util.find_spec(library) is None:
            line = page.blocks[index][0]
            pytest.skip(f"SKIPPED: {path}, line {line}: {library} is not installed")
    page.run(index)


def features():
    """Name and code of each line of the table of features."""
    text = (ROOT / "docs/coming-from.md").read_text(encoding="utf-8")
    rows = re.findall(r"^\| (.+?) \| .*\| (.+) \|$", text.partition("## What is there")[2], re.MULTILINE)
    return [(name, code) for name, cell in rows for code in re.findall("`([^`]+)`", cell)]


@pytest.fixture(scope="module")
def sphere():
    """The names that the table of features uses."""
    points = isograd.sample("sphere", 1000, radius=1.0).points
    result = isograd.reconstruct(points, resolution=24)
    names = {"isograd": isograd, "numpy": numpy, "points": points, "result": result, "mesh": result.mesh}
    return names | {"grid": result.grid, "queries": points[:5] / 2, "values": points}


@pytest.mark.parametrize(("name", "code"), features())
def test_a_feature_of_the_table_is_there(name, code, sphere, request, monkeypatch, tmp_path):
    monkeypatch.chdir(tmp_path)
    sphere["result"].cloud.save("cloud.ply")
    if "plot(" in code and "mesh" in code:
        request.getfixturevalue("pyvista")
    imported = {}
    for module in re.findall(r"\b(isograd\.[a-z]+|scipy\.[a-z]+|jax|torch)\b", code):
        library, _, part = module.partition(".")
        if library != "isograd" or not hasattr(isograd, part):
            pytest.importorskip(module, reason=f"SKIPPED: {module} can't be imported", exc_type=ImportError)
            imported[library] = sys.modules[library]
    try:
        exec(code, sphere | imported)
    except ImportError as error:
        pytest.skip(f"SKIPPED: {name}: {error}")
