"""First scripts of someone who knows Open3D, trimesh and PyVista, and no documentation of isograd."""

import pytest

import isograd

# How a library reads a cloud, and how it measures the area of its own mesh.
LIBRARIES = {
    "open3d": (lambda o3d, path: o3d.io.read_point_cloud(path), lambda mesh: mesh.to_open3d().get_surface_area()),
    "trimesh": (lambda trimesh, path: trimesh.load(path), lambda mesh: mesh.to_trimesh().area),
    "pyvista": (lambda pv, path: pv.read(path), lambda mesh: mesh.to_pyvista().area),
    "meshio": (lambda meshio, path: meshio.read(path), lambda mesh: mesh.area),
}


@pytest.mark.parametrize("name", LIBRARIES)
def test_a_script_with_habits_of_other_libraries_works(name, tmp_path, monkeypatch):
    library = pytest.importorskip(name, reason=f"SKIPPED: {name} is not installed")
    monkeypatch.chdir(tmp_path)
    isograd.write_points("scan.ply", isograd.sample("torus", 3000).points)
    read, area = LIBRARIES[name]
    result = isograd.reconstruct(read(library, "scan.ply"), resolution=48)
    mesh = result.mesh
    print(result, mesh)
    assert mesh.is_watertight and mesh.volume > 0 and area(mesh) == pytest.approx(mesh.area)
    assert mesh.vertices[mesh.faces].mean(axis=1).shape == mesh.face_normals.shape
    assert mesh.vertex_normals.shape == mesh.vertices.shape and (mesh.bounds[0] < mesh.bounds[1]).all()
    assert max(mesh.split(), key=lambda part: part.area).volume == pytest.approx(mesh.volume)
    assert not mesh.contains([[0, 0, 0]])[0] and isograd.signed_distance(mesh, [[0, 0, 0]])[0] > 0
    for file in ("mesh.ply", "mesh.stl", "mesh.obj", "sdf.vti", "sdf.npz", "report.json", "everything/"):
        result.save(file)
    mesh.save("saved.ply"), mesh.export("exported.stl")


def test_plots_work_as_in_pyvista_and_xarray(pyvista, tmp_path):
    result = isograd.reconstruct(isograd.sample("torus", 3000), resolution=48)
    result.plot().savefig(tmp_path / "slices.png")
    result.mesh.plot(off_screen=True, screenshot=tmp_path / "mesh.png")
    assert pyvista.read(tmp_path / "mesh.png").dimensions[0] > 100
