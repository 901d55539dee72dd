"""Points in files, and in the classes of this package and of other libraries."""

import pathlib

import numpy as np
import pytest

import isograd

pytestmark = pytest.mark.filterwarnings("ignore::isograd.ReconstructionWarning")
SAMPLES = isograd.sample("fish", 1500)
POINTS, NORMALS = SAMPLES.points, SAMPLES.normals
SINGLE = POINTS.astype(np.float32)


def bits(array):
    return np.ascontiguousarray(array).tobytes()


def expect(cloud, points=POINTS, normals=NORMALS, attributes=()):
    """Checks that ``cloud`` is what an array is: for grids, for normals, and for the field with its attributes."""
    grid = isograd.Grid.fit(points, 24)
    assert isograd.Grid.fit(cloud, 24) == grid
    assert bits(isograd.orient(cloud).normals) == bits(isograd.orient(points).normals)
    result = isograd.reconstruct(cloud, resolution=24)
    expected = isograd.reconstruct(points, grid)
    assert result.grid == grid and result.sdf.dtype == points.dtype
    assert bits(result.sdf) == bits(expected.sdf)
    for name in attributes:
        assert len(result.extend(name, 3 * grid.spacing).values)
    with pytest.raises(ValueError, match="other"):
        result.extend("other", grid.spacing)
    # Normals are ignored unless the orientation uses them.
    plan = isograd.Reconstructor(grid, orient="given", checks=False)
    if normals is None:
        with pytest.raises(ValueError, match="there are no normals"):
            plan(cloud)
    else:
        assert bits(plan(cloud).sdf) == bits(plan(points, normals=normals).sdf)
        signs = isograd.orient(cloud, orient="signs").normals
        assert bits(signs) == bits(isograd.orient(points, normals=normals, orient="signs").normals)


def test_resolution_spacing_and_padding_are_those_of_the_fitted_grid():
    for how in ({}, {"resolution": 20}, {"spacing": 0.04}, {"resolution": 24, "padding": 0.3}):
        assert isograd.reconstruct(POINTS, **how, checks=False).grid == isograd.Grid.fit(POINTS, **how)
    far = np.vstack([POINTS, [[90.0, 0.0, 0.0]]])
    kept = isograd.reconstruct(far, resolution=24, outliers="keep", checks=False).grid
    assert kept == isograd.Grid.fit(far, 24, outliers="keep") != isograd.Grid.fit(far, 24)
    grid = isograd.Grid.fit(POINTS, 24)
    for error, text, how in [
        (ValueError, "resolution or spacing, not both", {"resolution": 20, "spacing": 0.1}),
        (ValueError, "resolution is 2.5", {"resolution": 2.5}),
        (ValueError, "padding", {"padding": -3.0}),
        (TypeError, "grid and resolution are given; leave out grid, or give Grid.fit", {"grid": grid, "resolution": 20}),
        (TypeError, "grid and spacing and padding", {"grid": grid, "spacing": 0.1, "padding": 0.2}),
        (TypeError, "grid is a int; give an isograd.Grid, such as Grid.fit", {"grid": 64}),
    ]:
        with pytest.raises(error, match=text):
            isograd.reconstruct(POINTS, **how)


def test_files_and_clouds_bring_their_normals_and_attributes(tmp_path):
    path = tmp_path / "fish.ply"
    attributes = {"speed": POINTS[:, 0]}
    isograd.write_points(path, SINGLE, normals=NORMALS, attributes=attributes)
    cloud = isograd.read_points(path)
    for given in (path, str(path), pathlib.PurePath(path), cloud):
        expect(given, SINGLE, NORMALS.astype(np.float32), attributes)
    result = isograd.reconstruct(cloud, resolution=24, attributes={"own": POINTS})
    with pytest.raises(ValueError, match="speed"):
        result.extend("speed", result.grid.spacing)
    for missing in ("none.ply", tmp_path / "none.ply"):
        with pytest.raises(FileNotFoundError, match="none.ply"):
            isograd.reconstruct(missing)


def test_samples_and_meshes_of_this_package():
    expect(SAMPLES, attributes=["velocity"])
    expect(isograd.sample("fish", 1500, dtype=np.float32), SINGLE, NORMALS.astype(np.float32))
    mesh = isograd.reconstruct(POINTS, resolution=32).mesh
    expect(mesh, mesh.vertices, None)


def test_given_normals_come_before_those_of_the_cloud():
    grid = isograd.Grid.fit(POINTS, 24)
    turned = isograd.reconstruct(SAMPLES, grid, normals=-NORMALS, orient="given", checks=False)
    expected = isograd.reconstruct(POINTS, grid, normals=-NORMALS, orient="given", checks=False)
    assert bits(turned.sdf) == bits(expected.sdf)


def test_values_that_are_no_numbers_of_the_samples_are_left_out():
    names = {"name": ["a"] * 1500, "flag": NORMALS[:, 0] > 0, "short": POINTS[:9], "flat": np.zeros((1500, 0))}
    cloud = isograd.Cloud(POINTS, None, {**names, "count": np.arange(1500)})
    result = isograd.reconstruct(cloud, resolution=24)
    assert len(result.extend("count", result.grid.spacing).values)
    for name in names:
        with pytest.raises(ValueError, match=name):
            result.extend(name, result.grid.spacing)


def test_open3d():
    open3d = pytest.importorskip("open3d")
    vectors = open3d.utility.Vector3dVector
    cloud = open3d.geometry.PointCloud(vectors(SINGLE))
    # Open3D's are float64.
    expect(cloud, SINGLE.astype(float), None)
    cloud.normals, cloud.colors = vectors(NORMALS), vectors(abs(NORMALS))
    expect(cloud, SINGLE.astype(float), NORMALS, ["colors"])
    faces = open3d.utility.Vector3iVector([[0, 1, 2]])
    mesh = open3d.geometry.TriangleMesh(vectors(POINTS), faces)
    expect(mesh, POINTS, None)
    mesh.vertex_normals = vectors(NORMALS)
    expect(mesh, POINTS, NORMALS)
    for kind, name in ((open3d.t.geometry.PointCloud, "point"), (open3d.t.geometry.TriangleMesh, "vertex")):
        cloud = kind()
        arrays = getattr(cloud, name)
        arrays["positions"] = open3d.core.Tensor(SINGLE)
        expect(cloud, SINGLE, None)
        arrays["normals"] = open3d.core.Tensor(NORMALS.astype(np.float32))
        arrays["labels"] = open3d.core.Tensor(np.arange(1500)[:, None])
        expect(cloud, SINGLE, NORMALS.astype(np.float32), ["labels"])
    expect(open3d.core.Tensor(SINGLE), SINGLE, None)


def test_trimesh():
    trimesh = pytest.importorskip("trimesh")
    expect(trimesh.PointCloud(POINTS), POINTS, None)
    body = isograd.reconstruct(POINTS, resolution=32).mesh
    mesh = trimesh.Trimesh(body.vertices, body.faces, process=False, vertex_attributes={"x": body.vertices[:, 0]})
    expect(mesh, np.asarray(mesh.vertices), np.asarray(mesh.vertex_normals), ["x"])


def test_pyvista_and_vtk():
    pyvista = pytest.importorskip("pyvista")
    vtk = pytest.importorskip("vtkmodules.vtkCommonDataModel")
    for kind in (pyvista.PolyData, pyvista.PointSet):
        cloud = kind(SINGLE)
        expect(cloud, SINGLE, None)
        cloud["count"], cloud["name"] = np.arange(1500), ["a"] * 1500
        cloud.point_data.active_normals = NORMALS.astype(np.float32)
        expect(cloud, SINGLE, NORMALS.astype(np.float32), ["count"])
    plain = vtk.vtkPolyData()
    with pytest.raises(ValueError, match="vtkPolyData without points"):
        isograd.reconstruct(plain)
    plain.ShallowCopy(pyvista.PolyData(SINGLE))
    expect(plain, SINGLE, None)


class Frame:
    """A data frame as that of pandas and Polars, as far as it counts here."""

    def __init__(self, columns):
        self.columns = list(columns)
        self._arrays = dict(columns)

    def __getitem__(self, name):
        return self._arrays[name]

    def __array__(self, dtype=None, copy=None):
        return np.stack([self._arrays[name] for name in self.columns], axis=1)


@pytest.mark.parametrize("library", [None, "pandas", "polars"])
def test_data_frames(library):
    make = pytest.importorskip(library).DataFrame if library else Frame
    columns = dict(zip("abc", SINGLE.T))
    expect(make(columns), SINGLE, None)
    # By name, in any order.
    named = dict(zip(["Z", "y", "x"], SINGLE.T[::-1]))
    expect(make(named), SINGLE, None)
    named |= dict(zip(["nx", "ny", "nz"], NORMALS.T)) | {"name": ["a"] * 1500, "speed": POINTS[:, 0]}
    expect(make(named), SINGLE, NORMALS, ["speed"])
    with pytest.raises(ValueError, match=r"\(1500, 2\)"):
        isograd.reconstruct(make(dict(zip("xy", SINGLE.T))))


@pytest.mark.parametrize("library", ["jax.numpy", "torch"])
def test_arrays_of_other_libraries(library):
    module = pytest.importorskip(library)
    expect(module.asarray(SINGLE), SINGLE, None)


def test_a_tensor_with_a_gradient_is_an_error_with_the_remedy():
    torch = pytest.importorskip("torch")
    with pytest.raises(TypeError, match="detach"):
        isograd.reconstruct(torch.from_numpy(POINTS).requires_grad_())
