"""Files, plots, and objects of other libraries from results."""

import base64
import importlib.util
import json
import re
import subprocess
import sys

import numpy as np
import pytest

import isograd

SAMPLES = isograd.sample("torus", 2000, dtype=np.float32)
GRID = isograd.Grid.fit(SAMPLES.points, 28)
RESULT = isograd.reconstruct(SAMPLES.points, GRID, attributes={"height": SAMPLES.points[:, 2]})
MESH = RESULT.mesh
EMPTY = isograd.Mesh(MESH.vertices, MESH.faces[:0])
BROKEN = isograd.Mesh(MESH.vertices[:-1], MESH.faces)


def library(name):
    """A library, or a skipped test that names it."""
    return pytest.importorskip(name, reason=f"SKIPPED: {name} is not installed")


# Files.


@pytest.mark.parametrize("name", ["φ.vti", "phi.NPZ"])
def test_a_field_is_saved_by_its_ending(tmp_path, name):
    RESULT.save(tmp_path / name)
    grid, values = isograd.read_sdf(tmp_path / name)
    assert np.array_equal(values, RESULT.sdf) and np.allclose(grid.lower, GRID.lower, rtol=1e-6)


@pytest.mark.parametrize("ending", [".ply", ".obj", ".stl", ".vtp"])
def test_a_mesh_is_saved_by_its_ending(tmp_path, ending):
    RESULT.save(str(tmp_path / f"result{ending}"))
    MESH.save(tmp_path / f"mesh{ending}")
    MESH.export(tmp_path / f"export{ending}")
    contents = [path.read_bytes() for path in sorted(tmp_path.iterdir())]
    # The mesh of the result has the attributes of the samples, where the format holds them.
    assert len(contents) == 3 and len(set(contents)) == (2 if ending in (".ply", ".vtp") else 1)
    for name in ("mesh", "result"):
        assert len(isograd.read_mesh(tmp_path / f"{name}{ending}").faces) == len(MESH.faces)


@pytest.mark.parametrize("ending", [".ply", ".vtp"])
def test_the_mesh_of_a_result_has_the_attributes_of_the_samples(tmp_path, ending):
    height = SAMPLES.points[:, 2].copy()
    holes = np.where(height > 0.9 * height.max(), np.nan, height)
    result = isograd.reconstruct(SAMPLES.points, GRID, attributes={"height": height, "holes": holes})
    with pytest.warns(UserWarning, match="'holes' is not written"):
        result.save(tmp_path / f"mesh{ending}")
    back = isograd.read_points(tmp_path / f"mesh{ending}")
    assert list(back.attributes) == ["height"] and len(back.points) == len(result.mesh.vertices)
    assert np.abs(back.attributes["height"][:, 0] - back.points[:, 2]).max() < GRID.spacing


@pytest.mark.parametrize("ending", [".ply", ".npz", ".xyz", ".csv"])
def test_a_cloud_is_saved_by_its_ending(tmp_path, ending):
    cloud = isograd.Cloud(SAMPLES.points, SAMPLES.normals, {"height": SAMPLES.points[:, 2:]})
    cloud.save(tmp_path / f"cloud{ending}")
    back = isograd.read_points(tmp_path / f"cloud{ending}")
    assert np.array_equal(back.points.astype(np.float32), cloud.points)
    assert np.array_equal(back.normals.astype(np.float32), cloud.normals) and list(back.attributes) == ["height"]


def test_the_cloud_of_a_result_has_outward_normals_and_attributes():
    cloud = RESULT.cloud
    assert np.array_equal(cloud.points, SAMPLES.points) and np.array_equal(cloud.normals, RESULT.normals)
    assert list(cloud.attributes) == ["confidence", "height"]
    assert np.array_equal(cloud.attributes["height"][:, 0], SAMPLES.points[:, 2])
    assert np.array_equal(cloud.attributes["confidence"][:, 0], RESULT.confidence)


def test_a_report_is_saved_as_json(tmp_path):
    RESULT.save(tmp_path / "report.json")
    report = json.loads((tmp_path / "report.json").read_text(encoding="utf-8"))
    assert report["verdict"] == RESULT.verdict and report["surface"] == RESULT.report["surface"]
    assert report["grid"]["shape"] == list(GRID.shape) and report["input"] == {"points": 2000}


@pytest.mark.parametrize("makes_folder", [True, False])
def test_a_folder_gets_the_files_of_the_command(tmp_path, makes_folder):
    cloud, theirs, ours = tmp_path / "cloud.npz", tmp_path / "theirs", tmp_path / "a" / "b"
    np.savez(cloud, points=SAMPLES.points, height=SAMPLES.points[:, 2])
    command = [sys.executable, "-m", "isograd", "reconstruct", cloud, "-o", theirs, "--resolution", "28", "-q"]
    subprocess.run(list(map(str, command)), check=True)
    if makes_folder:
        RESULT.save(f"{ours}/")
    else:
        ours.mkdir(parents=True)
        RESULT.save(ours)
    names = sorted(path.name for path in theirs.iterdir())
    assert names == sorted(path.name for path in ours.iterdir()) and len(names) == 5
    mine, other = (isograd.read_mesh(folder / "mesh.ply") for folder in (ours, theirs))
    assert np.array_equal(mine.vertices, other.vertices) and np.array_equal(mine.faces, other.faces)
    for name in names:
        if name != "report.json":
            assert (ours / name).read_bytes() == (theirs / name).read_bytes(), name
    reports = [json.loads((folder / "report.json").read_text(encoding="utf-8")) for folder in (ours, theirs)]
    # The name of the input, and what the process has allocated, belong to the command.
    assert set(reports[1]) - set(reports[0]) == {"peak_memory_bytes"} and set(reports[0]) <= set(reports[1])
    for name in ("version", "backend", "surface", "verdict", "warnings", "orientation"):
        assert reports[0][name] == reports[1][name], name
    # The command fits its grid in single precision.
    for name, value in reports[1]["grid"].items():
        assert np.allclose(reports[0]["grid"][name], value, rtol=1e-6), name


def test_unknown_endings_are_refused_with_a_list(tmp_path):
    for name in ["mesh.xlsx", "mesh", "out.vtu", ".ply"]:
        with pytest.raises(ValueError, match=r"must end in \.ply or .* for the mesh, \.vti or \.npz .* give a folder"):
            RESULT.save(tmp_path / name)
    with pytest.raises(ValueError, match=r"must end in \.ply or \.obj or"):
        MESH.save(tmp_path / "mesh.vti")
    with pytest.raises(ValueError, match=r"must end in \.ply or \.npz"):
        isograd.Cloud(SAMPLES.points, None, {}).save(tmp_path / "cloud.vti")
    with pytest.raises(FileNotFoundError, match="missing"):
        RESULT.save(tmp_path / "missing" / "mesh.ply")
    (tmp_path / "file").write_text("")
    with pytest.raises(NotADirectoryError, match="is a file; give a folder"):
        RESULT.save(f"{tmp_path}/file/")
    assert [path.name for path in tmp_path.iterdir()] == ["file"]


# Objects of other libraries.


def test_trimesh_gets_vertices_and_faces_in_order():
    library("trimesh")
    for body in (MESH.to_trimesh(), RESULT.to_trimesh()):
        assert np.array_equal(body.vertices, MESH.vertices) and np.array_equal(body.faces, MESH.faces)
        assert body.is_watertight and abs(body.volume / MESH.volume - 1) < 1e-6
    body.vertices[:] = 0
    assert RESULT.mesh.area > 0


def test_pyvista_gets_the_mesh():
    library("pyvista")
    surface = MESH.to_pyvista()
    assert np.array_equal(surface.points, MESH.vertices) and np.array_equal(surface.regular_faces, MESH.faces)
    assert surface.is_manifold and abs(surface.volume / MESH.volume - 1) < 1e-5
    surface.points[:] = 0
    assert MESH.area > 0


def test_pyvista_gets_the_field_as_its_file_has_it(tmp_path):
    pyvista = library("pyvista")
    RESULT.save(tmp_path / "sdf.vti")
    image, read = RESULT.to_pyvista(), pyvista.read(tmp_path / "sdf.vti")
    assert image.dimensions == read.dimensions and np.allclose(image.origin, read.origin, rtol=1e-6)
    assert np.array_equal(image["sdf"], read["sdf"]) and image["sdf"].dtype == np.float32
    contour = image.contour([0.0])
    assert np.abs(isograd.signed_distance(MESH, contour.points)).max() < 0.3 * GRID.spacing


def test_pyvista_gets_the_field_in_cells_on_demand():
    library("pyvista")
    image = RESULT.to_pyvista(cells=True)
    assert np.allclose(image.bounds, np.stack([GRID.lower, GRID.upper], axis=1).ravel())
    assert image.cell_data.keys() == ["sdf"] and image.active_scalars_name == "sdf"
    centers = image.cell_centers().points
    order = GRID.centers().reshape(-1, 3)
    place = np.ravel_multi_index(np.rint((centers - GRID.origin) / GRID.spacing).astype(int).T, GRID.shape)
    assert np.allclose(order[place], centers) and np.array_equal(image["sdf"], RESULT.sdf.ravel()[place])


def test_xarray_gets_the_field_with_coordinates(tmp_path):
    library("xarray")
    array = RESULT.to_xarray()
    assert array.dims == ("x", "y", "z") and array.name == "sdf" and array.dtype == np.float32
    assert np.array_equal(array.values, RESULT.sdf)
    x, y, z = GRID.centers()[3, 4, 5]
    assert array.sel(x=x, y=y, z=z, method="nearest") == RESULT.sdf[3, 4, 5]
    assert array.attrs["verdict"] == RESULT.verdict and array.attrs["spacing"] == GRID.spacing
    array[:] = 0
    assert RESULT.sdf.any()


def test_open3d_gets_the_mesh_with_normals():
    # Heavy, and so not among the requirements of the tests.
    library("open3d")
    for body in (MESH.to_open3d(), RESULT.to_open3d()):
        assert np.array_equal(np.asarray(body.vertices), MESH.vertices)
        assert np.array_equal(np.asarray(body.triangles), MESH.faces)
        assert np.allclose(np.asarray(body.vertex_normals), MESH.normals)
        assert np.allclose(np.asarray(body.triangle_normals), MESH.face_normals)
        assert body.is_edge_manifold(allow_boundary_edges=False) and body.is_vertex_manifold() and body.is_orientable()
        assert abs(body.get_surface_area() / MESH.area - 1) < 1e-5


@pytest.mark.parametrize("name", ["trimesh", "pyvista", "open3d"])
def test_meshes_with_missing_vertices_are_not_converted(name):
    library(name)
    with pytest.raises(ValueError, match="names vertex"):
        getattr(BROKEN, f"to_{name}")()


@pytest.mark.parametrize(
    ("module", "use", "command"),
    [
        ("trimesh", RESULT.to_trimesh, "pip install trimesh"),
        ("pyvista", RESULT.to_pyvista, r"pip install isograd\[viz\]"),
        ("pyvista", MESH.to_pyvista, r"pip install isograd\[viz\]"),
        ("pyvista", MESH.plot, r"pip install isograd\[viz\]"),
        ("matplotlib.pyplot", RESULT.plot, r"pip install isograd\[viz\]"),
        ("open3d", MESH.to_open3d, "pip install open3d"),
        ("xarray", RESULT.to_xarray, "pip install xarray"),
    ],
)
def test_a_missing_library_is_an_error_with_the_command_that_installs_it(monkeypatch, module, use, command):
    monkeypatch.setitem(sys.modules, module, None)
    with pytest.raises(ImportError, match=f"needs {module.partition('.')[0]} .*`{command}`"):
        use()


def test_nothing_is_imported_before_it_is_needed():
    heavy = ["matplotlib", "open3d", "pyvista", "trimesh", "xarray"]
    code = f"import sys, isograd; print([name for name in {heavy} if name in sys.modules])"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"


# Plots and notebooks.


def test_a_plot_of_a_result_is_its_slices_with_samples():
    pyplot = library("matplotlib.pyplot")
    figure = RESULT.plot(title="a torus")
    assert len(figure.axes) == 4 and figure.get_suptitle() == "a torus"
    assert any(line.get_marker() == "." for axes in figure.axes[:3] for line in axes.lines)
    bare = RESULT.plot(points=None)
    assert not any(line.get_marker() == "." for axes in bare.axes[:3] for line in axes.lines)
    pyplot.close("all")


def test_a_plot_of_a_mesh_is_shown(pyvista, tmp_path):
    MESH.plot(points=SAMPLES.points, off_screen=True, screenshot=tmp_path / "mesh.png")
    assert pyvista.read(tmp_path / "mesh.png")["PNGImage"].std() > 1
    with pytest.raises(ValueError, match="no faces"):
        EMPTY.plot()


def test_a_notebook_shows_the_verdict_and_slices():
    text = RESULT._repr_html_()
    assert "Reconstruction of 2000 points" in text and ">good</b>" in text
    if importlib.util.find_spec("matplotlib") is None:
        pytest.skip("SKIPPED: matplotlib is not installed")
    from matplotlib import pyplot

    picture = base64.b64decode(re.search('src="data:image/png;base64,([^"]+)"', text)[1])
    assert picture.startswith(b"\x89PNG") and len(picture) > 5000
    # A figure of pyplot would be shown a second time.
    assert pyplot.get_fignums() == []


def test_a_notebook_works_without_matplotlib(monkeypatch):
    monkeypatch.setitem(sys.modules, "matplotlib.figure", None)
    text = RESULT._repr_html_()
    assert "<img" not in text and ">good</b>" in text


def test_texts_of_a_notebook_are_escaped(monkeypatch):
    monkeypatch.setattr(isograd.Reconstruction, "warnings", ["<script>alert('1 & 2')</script>"])
    text = RESULT._repr_html_()
    assert "<script>" not in text and "<li>&lt;script&gt;alert(&#x27;1 &amp; 2&#x27;)" in text


def test_a_notebook_shows_the_measures_of_a_mesh():
    text = MESH._repr_html_()
    assert f"<td>{len(MESH.faces):,}</td>" in text and f"<td>{MESH.area:.6g}</td>" in text and "<td>yes</td>" in text
    assert "<td>0</td>" in EMPTY._repr_html_() and "names vertex" in BROKEN._repr_html_()
