"""Files of the command line, read by VTK, PyVista, trimesh, meshio and NumPy, and theirs read by isograd."""

import json
import os
import subprocess

import numpy as np
import pytest

pytest.importorskip("pyvista")
meshio = pytest.importorskip("meshio")
trimesh = pytest.importorskip("trimesh")

# `cargo xtask test` sets it to the program that it has built.
PROGRAM = os.environ.get("ISOGRAD_PROGRAM")
pytestmark = pytest.mark.skipif(PROGRAM is None, reason="ISOGRAD_PROGRAM is not set")

MAJOR, MINOR = 0.7, 0.25


def isograd(folder, *arguments):
    run = subprocess.run([PROGRAM, *map(str, arguments)], cwd=folder, capture_output=True, text=True, check=False)
    assert run.returncode == 0, f"isograd {arguments}: {run.stderr}"
    return run.stdout


def torus(points):
    x, y, z = np.moveaxis(np.asarray(points, dtype=float), -1, 0)
    return np.hypot(np.hypot(x, y) - MAJOR, z) - MINOR


@pytest.fixture(scope="module", params=["float32", "float64"])
def case(request, tmp_path_factory):
    """A folder with a torus, written in every format, and the number type of its files."""
    if PROGRAM is None:
        pytest.skip("ISOGRAD_PROGRAM is not set")
    folder = tmp_path_factory.mktemp(request.param)
    precision = {"float32": "f32", "float64": "f64"}[request.param]
    isograd(folder, "sample", "torus", "-n", 8000, "-o", "cloud.npz", "--precision", "f64", "-q",
            "--param", f"major={MAJOR}", "--param", f"minor={MINOR}")
    for mesh, sdf, points in [("ply", "vti", "ply"), ("obj", "npz", "npz"), ("stl", "npz", "npz"), ("vtp", "npz", "npz")]:
        isograd(folder, "reconstruct", "cloud.npz", "--resolution", 64, "--precision", precision, "-q",
                "--mesh", f"mesh.{mesh}", "--sdf", f"sdf.{sdf}", "--points", f"points.{points}",
                "--report", "report.json")
    return folder, np.dtype(request.param)


def npz_field(folder):
    data = np.load(folder / "sdf.npz")
    assert set(data.files) == {"sdf", "origin", "spacing"}
    assert data["origin"].shape == (3,) and data["origin"].dtype == np.float64
    assert data["spacing"].shape == () and data["spacing"].dtype == np.float64
    return data["sdf"], data["origin"], float(data["spacing"])


def test_npz_fields_are_signed_distances(case):
    folder, dtype = case
    sdf, origin, h = npz_field(folder)
    assert sdf.dtype == dtype and sdf.flags["C_CONTIGUOUS"]
    centers = origin + h * np.moveaxis(np.indices(sdf.shape), 0, -1)
    assert np.abs(sdf - torus(centers)).max() < 0.2 * h
    report = json.loads((folder / "report.json").read_text())
    assert report["grid"]["shape"] == list(sdf.shape)
    assert np.array_equal(report["grid"]["origin"], origin)
    assert report["sdf"]["min"] == float(sdf.min()) and report["sdf"]["max"] == float(sdf.max())


def test_vtk_reads_fields(case):
    from vtkmodules.util.numpy_support import vtk_to_numpy
    from vtkmodules.vtkIOXML import vtkXMLImageDataReader

    folder, dtype = case
    reader = vtkXMLImageDataReader()
    reader.SetFileName(str(folder / "sdf.vti"))
    reader.Update()
    image = reader.GetOutput()
    sdf, origin, h = npz_field(folder)
    assert image.GetDimensions() == sdf.shape
    assert np.array_equal(image.GetOrigin(), origin)
    assert np.array_equal(image.GetSpacing(), [h] * 3)
    values = vtk_to_numpy(image.GetPointData().GetScalars())
    assert values.dtype == dtype and image.GetPointData().GetScalars().GetName() == "sdf"
    assert np.array_equal(values, sdf.ravel(order="F"))
    # Position and value of single points, by VTK's own indexing.
    for cell in [(0, 0, 0), (3, 5, 7), tuple(n - 1 for n in sdf.shape)]:
        place = image.ComputePointId(cell)
        assert np.allclose(image.GetPoint(place), origin + h * np.array(cell), atol=1e-12)
        assert values[place] == sdf[cell]


def test_contours_of_vtk_are_the_surface(case):
    import pyvista

    folder, _ = case
    image = pyvista.read(folder / "sdf.vti")
    _, _, h = npz_field(folder)
    assert np.abs(torus(image.contour([0.0], scalars="sdf").points)).max() < 0.3 * h
    sampled = pyvista.PolyData(np.array([[MAJOR, 0.0, 0.0], [0.0, -MAJOR, 0.1]])).sample(image)
    assert np.abs(sampled["sdf"] - torus(sampled.points)).max() < 0.3 * h


def reference_mesh(folder):
    """The PLY mesh, read without a library."""
    raw = (folder / "mesh.ply").read_bytes()
    end = raw.index(b"end_header\n") + len(b"end_header\n")
    header = raw[:end].decode()
    count = {w.split()[1]: int(w.split()[2]) for w in header.splitlines() if w.startswith("element")}
    real = np.dtype("<f8") if "property double x" in header else np.dtype("<f4")
    vertices = np.frombuffer(raw, real, 3 * count["vertex"], end).reshape(-1, 3)
    faces = np.frombuffer(raw, np.dtype([("n", "u1"), ("v", "<i4", 3)]), count["face"], end + vertices.nbytes)
    assert end + vertices.nbytes + faces.nbytes == len(raw) and (faces["n"] == 3).all()
    return vertices, faces["v"]


def test_pyvista_reads_meshes(case):
    import pyvista

    folder, _ = case
    vertices, faces = reference_mesh(folder)
    for name in ["mesh.vtp", "mesh.ply", "mesh.obj"]:
        mesh = pyvista.read(folder / name)
        assert np.array_equal(mesh.regular_faces, faces), name
        # VTK's OBJ reader is single precision.
        dtype = vertices.dtype if name == "mesh.vtp" else np.float32
        assert np.array_equal(mesh.points.astype(dtype), vertices.astype(dtype)), name
    mesh = pyvista.read(folder / "mesh.vtp")
    assert mesh.is_manifold and mesh.n_open_edges == 0
    assert abs(mesh.volume / (2 * np.pi**2 * MAJOR * MINOR**2) - 1) < 0.01
    stl = pyvista.read(folder / "mesh.stl")
    assert stl.n_cells == len(faces) and abs(stl.volume / mesh.volume - 1) < 1e-5


def test_trimesh_reads_meshes(case):
    folder, _ = case
    vertices, faces = reference_mesh(folder)
    for name in ["mesh.ply", "mesh.obj", "mesh.stl"]:
        mesh = trimesh.load(folder / name, process=name.endswith("stl"))
        assert mesh.is_watertight and mesh.is_winding_consistent and mesh.volume > 0, name
        assert len(mesh.faces) == len(faces), name
        if name != "mesh.stl":
            assert np.allclose(mesh.vertices, vertices, rtol=1e-7, atol=0), name
            assert np.array_equal(mesh.faces, faces), name


def test_meshio_reads_meshes_and_points(case):
    folder, _ = case
    vertices, faces = reference_mesh(folder)
    for name in ["mesh.ply", "mesh.obj"]:
        mesh = meshio.read(folder / name)
        assert np.array_equal(mesh.cells_dict["triangle"], faces), name
        assert np.allclose(mesh.points, vertices, rtol=1e-7, atol=0), name
    assert len(meshio.read(folder / "mesh.stl").cells_dict["triangle"]) == len(faces)
    data = np.load(folder / "points.npz")
    cloud = meshio.read(folder / "points.ply")
    assert np.array_equal(cloud.points, data["points"])
    assert np.array_equal(cloud.point_data["confidence"], data["confidence"])
    assert np.array_equal(cloud.point_data["nx"], data["normals"][:, 0])


def test_points_keep_their_order(case):
    folder, dtype = case
    data, cloud = np.load(folder / "points.npz"), np.load(folder / "cloud.npz")
    assert data["points"].dtype == dtype and data["normals"].dtype == dtype
    assert np.array_equal(data["points"], cloud["points"].astype(dtype))
    assert data["confidence"].shape == (len(cloud["points"]),)
    agreement = np.einsum("ij,ij->i", data["normals"], cloud["normals"])
    assert (agreement > 0.9).mean() > 0.99


def assert_reads(folder, name, points, atol=0.0):
    """isograd reads these points from a file, judged by a cloud that it writes."""
    isograd(folder, "query", "mesh.ply", "--at", name, "-o", "back.npz", "-q")
    back = np.load(folder / "back.npz")["points"]
    assert back.shape == points.shape, name
    assert np.allclose(back, points, rtol=0, atol=atol), name


def test_files_of_numpy_are_read(case):
    folder, _ = case
    points = np.random.default_rng(1).normal(size=(50, 3))
    for name, array in {
        "c.npy": points,
        "fortran.npy": np.asfortranarray(points),
        "big.npy": points.astype(">f8"),
        "single.npy": points.astype(np.float32),
    }.items():
        np.save(folder / name, array)
        assert_reads(folder, name, array.astype(float))
    np.savez(folder / "plain.npz", points=points)
    np.savez_compressed(folder / "packed.npz", points=points, normals=points)
    np.savetxt(folder / "spaces.txt", points, fmt="%.17g", header="x y z")
    np.savetxt(folder / "commas.csv", points, fmt="%.17g", delimiter=",", header="x,y,z", comments="")
    for name in ["plain.npz", "packed.npz", "spaces.txt", "commas.csv"]:
        assert_reads(folder, name, points)


@pytest.mark.parametrize("mode", ["Ascii", "Binary", "Appended"])
@pytest.mark.parametrize("compressor", ["None", "ZLib"])
def test_meshes_of_vtk_are_read(case, mode, compressor):
    import pyvista
    import vtk

    folder, _ = case
    sphere = pyvista.Sphere(theta_resolution=12, phi_resolution=10)
    sphere.points = sphere.points.astype(np.float64) * 1.25
    writer = vtk.vtkXMLPolyDataWriter()
    writer.SetInputData(sphere)
    getattr(writer, f"SetDataModeTo{mode}")()
    getattr(writer, f"SetCompressorTypeTo{compressor}")()
    for raw in [True, False]:
        for header in ["UInt32", "UInt64"]:
            getattr(writer, f"SetHeaderTypeTo{header}")()
            writer.SetEncodeAppendedData(not raw)
            writer.SetFileName(str(folder / "sphere.vtp"))
            writer.Write()
            # VTK's ASCII has six digits more than single precision needs.
            assert_reads(folder, "sphere.vtp", sphere.points, 1e-9 if mode == "Ascii" else 0)
            text = isograd(folder, "info", "sphere.vtp")
            assert f"faces        {sphere.n_cells}" in text and "normals      yes" in text, text


def test_fields_of_vtk_are_read(case):
    import pyvista

    folder, _ = case
    image = pyvista.read(folder / "sdf.vti")
    image.save(folder / "again.vti", binary=True)
    text = isograd(folder, "info", "again.vti").replace("UInt32", "UInt64").splitlines()
    for line in isograd(folder, "info", "sdf.vti").splitlines():
        assert "stored" in line or line in text
    image.save(folder / "ascii.vti", binary=False)
    isograd(folder, "info", "ascii.vti")


def test_meshes_of_trimesh_and_meshio_are_read(case):
    folder, _ = case
    body = trimesh.creation.icosphere(subdivisions=2, radius=0.75)
    body.export(folder / "t.ply")
    body.export(folder / "t_ascii.ply", encoding="ascii")
    body.export(folder / "t.obj")
    body.export(folder / "t.stl")
    (folder / "t_ascii.stl").write_text(trimesh.exchange.stl.export_stl_ascii(body))
    mesh = meshio.Mesh(body.vertices, [("triangle", body.faces)])
    mesh.write(folder / "m.ply", binary=True)
    mesh.write(folder / "m_ascii.ply", binary=False)
    mesh.write(folder / "m.stl", binary=True)
    mesh.write(folder / "m_ascii.stl", binary=False)
    mesh.write(folder / "m.obj")
    for path in [*sorted(folder.glob("[tm]_ascii.*")), *sorted(folder.glob("[tm].???"))]:
        text = isograd(folder, "info", path.name)
        for line in [f"faces        {len(body.faces)}", f"points       {len(body.vertices)}", "closed       yes"]:
            assert line in text, f"{path.name}: {text}"
