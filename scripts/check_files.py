#!/usr/bin/env python3
"""Checks isograd's files against the programs that will read them, and the other way round.

    pip install numpy vtk pyvista trimesh meshio open3d
    python scripts/check_files.py [path/to/isograd]

Writes every format with the command line, reads it with VTK, PyVista, meshio, trimesh, Open3D and NumPy, and
compares values, positions and shapes with each other and with the body that was sampled. Then writes clouds
and meshes with those libraries and reads them with isograd. A library that is missing is named and skipped;
the exit status is 1 if anything differs.
"""

import importlib
import json
import subprocess
import sys
import tempfile
from pathlib import Path

import numpy as np

ISOGRAD = str(Path(sys.argv[1] if len(sys.argv) > 1 else "target/release/isograd").resolve())
MAJOR, MINOR = 0.7, 0.25
results = []


def library(name):
    try:
        return importlib.import_module(name)
    except ImportError:
        return None


def isograd(folder, *arguments):
    run = subprocess.run([ISOGRAD, *map(str, arguments)], cwd=folder, capture_output=True, text=True)
    if run.returncode != 0:
        raise AssertionError(f"isograd {arguments}: {run.stderr}")
    return run.stdout


def check(name, function, *arguments, needs=()):
    missing = [n for n in needs if library(n) is None]
    if missing:
        results.append(("SKIPPED", name, f"{', '.join(missing)} not installed"))
        return
    try:
        function(*arguments)
        results.append(("ok", name, ""))
    except Exception as error:  # noqa: BLE001 - every failure is reported, none stops the others
        results.append(("FAILED", name, f"{type(error).__name__}: {error}"))


def torus(points):
    x, y, z = np.moveaxis(np.asarray(points, dtype=float), -1, 0)
    return np.hypot(np.hypot(x, y) - MAJOR, z) - MINOR


def assert_equal(a, b, what):
    assert np.array_equal(np.asarray(a), np.asarray(b)), f"{what} differ"


def npz_field(folder):
    data = np.load(folder / "sdf.npz")
    assert set(data.files) == {"sdf", "origin", "spacing"}, data.files
    assert data["origin"].shape == (3,) and data["origin"].dtype == np.float64
    assert data["spacing"].shape == () and data["spacing"].dtype == np.float64
    return data["sdf"], data["origin"], float(data["spacing"])


def centers(sdf, origin, h):
    index = np.stack(np.meshgrid(*map(np.arange, sdf.shape), indexing="ij"), axis=-1)
    return origin + h * index


def check_npz(folder, dtype):
    sdf, origin, h = npz_field(folder)
    assert sdf.dtype == dtype and sdf.flags["C_CONTIGUOUS"], sdf.dtype
    error = np.abs(sdf - torus(centers(sdf, origin, h)))
    assert error.max() < 0.2 * h, f"φ is {error.max() / h:.3f} cells from the torus"
    report = json.loads((folder / "report.json").read_text())
    assert report["grid"]["shape"] == list(sdf.shape)
    assert np.allclose(report["grid"]["origin"], origin, rtol=0, atol=0)
    assert report["sdf"]["min"] == float(sdf.min()) and report["sdf"]["max"] == float(sdf.max())


def check_vti_vtk(folder, dtype):
    from vtkmodules.util.numpy_support import vtk_to_numpy
    from vtkmodules.vtkIOXML import vtkXMLImageDataReader

    reader = vtkXMLImageDataReader()
    reader.SetFileName(str(folder / "sdf.vti"))
    reader.Update()
    image = reader.GetOutput()
    sdf, origin, h = npz_field(folder)
    assert image.GetDimensions() == sdf.shape, image.GetDimensions()
    assert_equal(image.GetOrigin(), origin, "origins")
    assert_equal(image.GetSpacing(), [h] * 3, "spacings")
    values = vtk_to_numpy(image.GetPointData().GetScalars())
    assert values.dtype == dtype and image.GetPointData().GetScalars().GetName() == "sdf"
    assert_equal(values, sdf.ravel(order="F"), "values")
    # Position and value of single points, by VTK's own indexing.
    for cell in [(0, 0, 0), (3, 5, 7), tuple(n - 1 for n in sdf.shape)]:
        place = image.ComputePointId(cell)
        assert np.allclose(image.GetPoint(place), origin + h * np.array(cell), atol=1e-12)
        assert values[place] == sdf[cell]


def check_vti_pyvista(folder):
    import pyvista

    image = pyvista.read(folder / "sdf.vti")
    sdf, _, h = npz_field(folder)
    contour = image.contour([0.0], scalars="sdf")
    error = np.abs(torus(contour.points))
    assert error.max() < 0.3 * h, f"VTK's contour is {error.max() / h:.3f} cells off"
    sampled = pyvista.PolyData(np.array([[MAJOR, 0.0, 0.0], [0.0, -MAJOR, 0.1]])).sample(image)
    assert np.abs(sampled["sdf"] - torus(sampled.points)).max() < 0.3 * h
    assert sdf.size == image.n_points


def reference_mesh(folder):
    """The PLY, read by hand: what other readers are compared with."""
    raw = (folder / "mesh.ply").read_bytes()
    end = raw.index(b"end_header\n") + len(b"end_header\n")
    header = raw[:end].decode()
    count = {w.split()[1]: int(w.split()[2]) for w in header.splitlines() if w.startswith("element")}
    real = np.dtype("<f8") if "property double x" in header else np.dtype("<f4")
    vertices = np.frombuffer(raw, real, 3 * count["vertex"], end).reshape(-1, 3)
    faces = np.frombuffer(raw, np.dtype([("n", "u1"), ("v", "<i4", 3)]), count["face"], end + vertices.nbytes)
    assert end + vertices.nbytes + faces.nbytes == len(raw) and (faces["n"] == 3).all()
    return vertices, faces["v"]


def check_mesh_vtk(folder):
    import pyvista

    vertices, faces = reference_mesh(folder)
    for name in ["mesh.vtp", "mesh.ply", "mesh.obj"]:
        mesh = pyvista.read(folder / name)
        assert_equal(mesh.regular_faces, faces, f"{name}: faces")
        # VTK's OBJ reader is single precision.
        exact = mesh.points if name == "mesh.vtp" else mesh.points.astype(np.float32)
        wanted = vertices if name == "mesh.vtp" else vertices.astype(np.float32)
        assert_equal(exact, wanted, f"{name}: vertices")
    mesh = pyvista.read(folder / "mesh.vtp")
    assert mesh.is_manifold and mesh.n_open_edges == 0
    assert abs(mesh.volume / (2 * np.pi**2 * MAJOR * MINOR**2) - 1) < 0.01
    stl = pyvista.read(folder / "mesh.stl")
    assert stl.n_cells == len(faces) and abs(stl.volume / mesh.volume - 1) < 1e-5


def check_mesh_trimesh(folder):
    import trimesh

    vertices, faces = reference_mesh(folder)
    for name in ["mesh.ply", "mesh.obj", "mesh.stl"]:
        mesh = trimesh.load(folder / name, process=name.endswith("stl"))
        assert mesh.is_watertight and mesh.is_winding_consistent and mesh.volume > 0, name
        assert len(mesh.faces) == len(faces), name
        if name != "mesh.stl":
            assert np.allclose(mesh.vertices, vertices, rtol=1e-7, atol=0), name
            assert_equal(mesh.faces, faces, name)


def check_mesh_meshio(folder):
    import meshio

    vertices, faces = reference_mesh(folder)
    for name in ["mesh.ply", "mesh.obj"]:
        mesh = meshio.read(folder / name)
        assert_equal(mesh.cells_dict["triangle"], faces, name)
        assert np.allclose(mesh.points, vertices, rtol=1e-7, atol=0), name
    image = meshio.read(folder / "mesh.stl")
    assert len(image.cells_dict["triangle"]) == len(faces)


def check_points(folder, dtype):
    data = np.load(folder / "points.npz")
    cloud = np.load(folder / "cloud.npz")
    assert data["points"].dtype == dtype and data["normals"].dtype == dtype
    assert_equal(data["points"], cloud["points"].astype(dtype), "points")
    assert data["confidence"].shape == (len(cloud["points"]),)
    agree = np.einsum("ij,ij->i", data["normals"], cloud["normals"])
    assert (agree > 0.9).mean() > 0.99, "normals point outwards"


def check_points_open3d(folder):
    import open3d

    data = np.load(folder / "points.npz")
    cloud = open3d.io.read_point_cloud(str(folder / "points.ply"))
    assert np.allclose(np.asarray(cloud.points), data["points"], rtol=1e-7, atol=0)
    assert np.allclose(np.asarray(cloud.normals), data["normals"], rtol=1e-6, atol=1e-12)


def check_points_meshio(folder):
    import meshio

    data = np.load(folder / "points.npz")
    cloud = meshio.read(folder / "points.ply")
    assert_equal(cloud.points, data["points"], "points")
    assert_equal(cloud.point_data["confidence"], data["confidence"], "confidence")
    assert_equal(cloud.point_data["nx"], data["normals"][:, 0], "normals")


def read_back(folder, name, points, atol=0.0):
    """What isograd reads from a file, through a cloud that it writes."""
    isograd(folder, "query", "mesh.ply", "--at", name, "-o", "back.npz", "-q")
    back = np.load(folder / "back.npz")["points"]
    assert back.shape == points.shape, f"{name}: {back.shape}"
    assert np.allclose(back, points, rtol=0, atol=atol), f"{name}: points differ"


def check_reading_numpy(folder):
    points = np.random.default_rng(1).normal(size=(50, 3))
    for name, array in {
        "c.npy": points,
        "fortran.npy": np.asfortranarray(points),
        "big.npy": points.astype(">f8"),
        "single.npy": points.astype(np.float32),
    }.items():
        np.save(folder / name, array)
        read_back(folder, name, array.astype(float))
    np.savez(folder / "plain.npz", points=points)
    np.savez_compressed(folder / "packed.npz", points=points, normals=points)
    for name in ["plain.npz", "packed.npz"]:
        read_back(folder, name, points)
    np.savetxt(folder / "spaces.txt", points, fmt="%.17g", header="x y z")
    np.savetxt(folder / "commas.csv", points, fmt="%.17g", delimiter=",", header="x,y,z", comments="")
    for name in ["spaces.txt", "commas.csv"]:
        read_back(folder, name, points)


def check_reading_vtk(folder):
    import pyvista
    import vtk

    sphere = pyvista.Sphere(theta_resolution=12, phi_resolution=10)
    sphere.points = sphere.points.astype(np.float64) * 1.25
    writer = vtk.vtkXMLPolyDataWriter()
    writer.SetInputData(sphere)
    for mode in ["Ascii", "Binary", "Appended"]:
        for compressor in ["None", "ZLib"]:
            for raw in [True, False]:
                for header in ["UInt32", "UInt64"]:
                    getattr(writer, f"SetDataModeTo{mode}")()
                    getattr(writer, f"SetCompressorTypeTo{compressor}")()
                    getattr(writer, f"SetHeaderTypeTo{header}")()
                    writer.SetEncodeAppendedData(not raw)
                    name = f"{mode}{compressor}{raw}{header}.vtp".lower()
                    writer.SetFileName(str(folder / name))
                    writer.Write()
                    # Ascii is written with six digits more than single precision needs.
                    read_back(folder, name, sphere.points, 1e-9 if mode == "Ascii" else 0)
                    text = isograd(folder, "info", name)
                    assert f"faces        {sphere.n_cells}" in text and "normals      yes" in text, text
    image = pyvista.read(folder / "sdf.vti")
    for name, binary in [("again.vti", True), ("again_ascii.vti", False)]:
        image.save(folder / name, binary=binary)
        text = isograd(folder, "info", name).replace("UInt32", "UInt64")
        original = isograd(folder, "info", "sdf.vti")
        lines = [line for line in original.splitlines() if "stored" not in line]
        if binary:
            assert all(line in text.splitlines() for line in lines), text


def check_reading_meshes(folder):
    import meshio
    import trimesh

    body = trimesh.creation.icosphere(subdivisions=2, radius=0.75)
    body.export(folder / "t.ply")
    body.export(folder / "t_ascii.ply", encoding="ascii")
    body.export(folder / "t.obj")
    body.export(folder / "t.stl")
    (folder / "t_ascii.stl").write_text(trimesh.exchange.stl.export_stl_ascii(body))
    mesh = meshio.Mesh(body.vertices, [("triangle", body.faces)])
    for name, options in {
        "m.ply": {"binary": True},
        "m_ascii.ply": {"binary": False},
        "m.stl": {"binary": True},
        "m_ascii.stl": {"binary": False},
        "m.obj": {},
    }.items():
        mesh.write(folder / name, **options)
    for path in sorted(folder.glob("[tm]_ascii.*")) + [folder / n for n in ["t.ply", "t.obj", "t.stl", "m.ply", "m.stl", "m.obj"]]:
        text = isograd(folder, "info", path.name)
        assert f"faces        {len(body.faces)}" in text, f"{path.name}: {text}"
        assert f"points       {len(body.vertices)}" in text, f"{path.name}: {text}"
        assert "closed       yes" in text, f"{path.name}: {text}"


def check_reading_open3d(folder):
    import open3d

    points = np.random.default_rng(2).normal(size=(60, 3))
    cloud = open3d.geometry.PointCloud(open3d.utility.Vector3dVector(points))
    cloud.normals = open3d.utility.Vector3dVector(points / np.linalg.norm(points, axis=1)[:, None])
    cloud.colors = open3d.utility.Vector3dVector(np.random.default_rng(3).uniform(size=(60, 3)))
    for name, ascii_ in [("o.ply", False), ("o_ascii.ply", True)]:
        open3d.io.write_point_cloud(str(folder / name), cloud, write_ascii=ascii_)
        read_back(folder, name, points, 1e-5 if ascii_ else 0)
        text = isograd(folder, "info", name)
        assert "normals      yes" in text and "attribute    red" in text, text


def check_folder(folder, precision):
    dtype = np.dtype({"f32": "float32", "f64": "float64"}[precision])
    isograd(folder, "sample", "torus", "-n", 8000, "-o", "cloud.npz", "--precision", "f64", "-q",
            "--param", f"major={MAJOR}", "--param", f"minor={MINOR}")
    for mesh, sdf, points in [("ply", "vti", "ply"), ("obj", "npz", "npz"), ("stl", "npz", "npz"), ("vtp", "npz", "npz")]:
        isograd(folder, "reconstruct", "cloud.npz", "--resolution", 64, "--precision", precision, "-q",
                "--mesh", f"mesh.{mesh}", "--sdf", f"sdf.{sdf}", "--points", f"points.{points}",
                "--report", "report.json")
    title = lambda text: f"{precision}: {text}"  # noqa: E731
    check(title("NPZ field, NumPy"), check_npz, folder, dtype)
    check(title("VTI, VTK"), check_vti_vtk, folder, dtype, needs=["vtk"])
    check(title("VTI, PyVista"), check_vti_pyvista, folder, needs=["pyvista"])
    check(title("meshes, PyVista"), check_mesh_vtk, folder, needs=["pyvista"])
    check(title("meshes, trimesh"), check_mesh_trimesh, folder, needs=["trimesh"])
    check(title("meshes, meshio"), check_mesh_meshio, folder, needs=["meshio"])
    check(title("points, NumPy"), check_points, folder, dtype)
    check(title("points, Open3D"), check_points_open3d, folder, needs=["open3d"])
    check(title("points, meshio"), check_points_meshio, folder, needs=["meshio"])


def main():
    for precision in ["f32", "f64"]:
        with tempfile.TemporaryDirectory() as name:
            folder = Path(name)
            check_folder(folder, precision)
            if precision == "f64":
                check("reading NumPy's files", check_reading_numpy, folder)
                check("reading VTK's files", check_reading_vtk, folder, needs=["vtk", "pyvista"])
                check("reading meshes", check_reading_meshes, folder, needs=["trimesh", "meshio"])
                check("reading Open3D's files", check_reading_open3d, folder, needs=["open3d"])
    for status, name, detail in results:
        print(f"{status:8} {name}{': ' if detail else ''}{detail}")
    return 1 if any(status == "FAILED" for status, _, _ in results) else 0


if __name__ == "__main__":
    sys.exit(main())
