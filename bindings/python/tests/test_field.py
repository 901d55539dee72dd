"""Fields of meshes and meshes of fields, against plain NumPy."""

import os
from types import SimpleNamespace

import numpy as np
import pytest

import isograd

GRID = isograd.Grid((-0.7, -0.65, -0.6), 0.1, (14, 13, 12))
CUBE = np.array([[x, y, z] for x in (0, 1) for y in (0, 1) for z in (0, 1)], float) - 0.5
CUBE_FACES = np.array(
    [[0, 1, 3], [0, 3, 2], [4, 6, 7], [4, 7, 5], [0, 4, 5], [0, 5, 1],
     [2, 3, 7], [2, 7, 6], [0, 2, 6], [0, 6, 4], [1, 5, 7], [1, 7, 3]]
)  # fmt: skip


def box(p, half=0.5):
    """Signed distance of a cube."""
    q = np.abs(p) - half
    return np.linalg.norm(np.maximum(q, 0), axis=-1) + np.minimum(q.max(axis=-1), 0)


def winding_numbers(vertices, faces, points):
    """Sum of the solid angles of all triangles, over 4π."""
    a, b, c = (vertices[faces[:, k]][None] - points[:, None] for k in range(3))
    la, lb, lc = (np.linalg.norm(v, axis=-1) for v in (a, b, c))
    y = np.einsum("pfa,pfa->pf", a, np.cross(b, c))
    x = la * lb * lc + (a * b).sum(-1) * lc + (b * c).sum(-1) * la + (c * a).sum(-1) * lb
    return (2 * np.arctan2(y, x)).sum(axis=1) / (4 * np.pi)


@pytest.mark.parametrize("dtype", [np.float32, np.float64])
def test_field_of_a_cube_is_its_distance(dtype):
    mesh = isograd.Mesh(CUBE.astype(dtype), CUBE_FACES)
    result = isograd.sdf_grid(mesh, GRID)
    assert result.sdf.dtype == dtype and result.sdf.shape == GRID.shape
    assert result.sign == "closed"
    assert np.allclose(result.sdf, box(GRID.centers()), atol=4 * np.finfo(dtype).eps)
    assert result.closest.dtype == np.uint32 and result.closest.max() < len(CUBE_FACES)
    hits = isograd.query(mesh, GRID.centers().reshape(-1, 3))
    assert np.allclose(result.sdf.ravel(), hits.distance, atol=4 * np.finfo(dtype).eps)


def test_vertices_need_not_be_shared_and_winding_is_free():
    expected = isograd.sdf_grid((CUBE, CUBE_FACES), GRID)
    soup = CUBE[CUBE_FACES].reshape(-1, 3)
    apart = isograd.sdf_grid((soup, np.arange(len(soup)).reshape(-1, 3)), GRID)
    turned = isograd.sdf_grid((CUBE, CUBE_FACES[:, ::-1]), GRID)
    for result in (apart, turned):
        assert result.sign == "closed"
        assert np.allclose(result.sdf, expected.sdf, atol=1e-15)


def test_open_mesh_takes_the_sign_of_the_winding_number():
    faces = CUBE_FACES[2:]
    result = isograd.sdf_grid((CUBE, faces), GRID)
    assert result.sign == "winding number"
    numbers = winding_numbers(CUBE, faces, GRID.centers().reshape(-1, 3))
    # Of cells on the faces rounding decides.
    clear = (np.abs(np.abs(numbers) - 0.5) > 0.03) & (np.abs(result.sdf.ravel()) > 1e-9)
    assert ((result.sdf.ravel() < 0) == (np.abs(numbers) > 0.5))[clear].all()
    assert (result.sdf < 0).any() and clear.mean() > 0.9


def test_band_has_its_width_beyond_it():
    full = isograd.sdf_grid((CUBE, CUBE_FACES), GRID)
    band = isograd.sdf_grid((CUBE, CUBE_FACES), GRID, band=0.12)
    assert np.allclose(band.sdf, full.sdf.clip(-0.12, 0.12), atol=1e-15)
    assert ((band.closest == 2**32 - 1) == (np.abs(full.sdf) > 0.12)).all()
    assert (band.pullback(np.ones(GRID.shape)).vertices != 0).any()


def test_pullback_of_the_field_is_the_transpose_of_its_derivative():
    rng = np.random.default_rng(1)
    vertices = CUBE + 0.05 * rng.standard_normal(CUBE.shape)
    bar = rng.standard_normal(GRID.shape)
    move, shift, growth = rng.standard_normal(CUBE.shape), rng.standard_normal(3), 0.3

    def loss(t):
        grid = isograd.Grid(np.add(GRID.lower, t * shift), GRID.spacing + t * growth, GRID.shape)
        return (isograd.sdf_grid((vertices + t * move, CUBE_FACES), grid).sdf * bar).sum()

    gradients = isograd.sdf_grid((vertices, CUBE_FACES), GRID).pullback(bar)
    step = 1e-6
    slope = (loss(step) - loss(-step)) / (2 * step)
    pulled = (gradients.vertices * move).sum() + np.dot(gradients.lower, shift) + gradients.spacing * growth
    assert abs(slope - pulled) < 1e-3 * max(1, abs(pulled))


def test_bad_meshes_and_grids_are_refused_with_a_reason():
    vertices = CUBE.copy()
    vertices[3, 1] = np.nan
    for mesh, text in [
        ((vertices, CUBE_FACES), "vertex 3 is not finite"),
        ((CUBE, [[0, 1, 8]]), "names vertex 8"),
        ((CUBE, np.zeros((0, 3), int)), "no triangle"),
        ((CUBE * 1e200, CUBE_FACES), "squared"),
    ]:
        with pytest.raises(ValueError, match=text):
            isograd.sdf_grid(mesh, GRID)
    with pytest.raises(TypeError, match=r"isograd\.Grid"):
        isograd.sdf_grid((CUBE, CUBE_FACES), 64)
    for band in (0, -1.0, np.nan, np.inf):
        with pytest.raises(ValueError, match="band"):
            isograd.sdf_grid((CUBE, CUBE_FACES), GRID, band=band)
    result = isograd.sdf_grid((CUBE, CUBE_FACES), GRID)
    with pytest.raises(ValueError, match="sdf_bar has the shape"):
        result.pullback(np.ones(3))
    with pytest.raises(ValueError, match=r"sdf_bar is not finite at entry \(0, 0, 0\)"):
        result.pullback(np.full(GRID.shape, np.nan))
    with pytest.raises(TypeError, match="mesh is a ndarray"):
        isograd.sdf_grid(CUBE, GRID)


def test_a_mesh_may_be_any_object_with_vertices_and_faces():
    other = SimpleNamespace(vertices=CUBE, faces=np.asarray(CUBE_FACES, np.int64))
    assert (isograd.sdf_grid(other, GRID).sdf == isograd.sdf_grid((CUBE, CUBE_FACES), GRID).sdf).all()


@pytest.mark.skipif(
    not hasattr(os, "sysconf") or os.sysconf("SC_PHYS_PAGES") * os.sysconf("SC_PAGE_SIZE") > 47 * 2**30,
    reason="this machine may hold the grid",
)
def test_a_grid_that_memory_can_not_hold_is_refused():
    # About as many cells as can be indexed, of 12 bytes.
    with pytest.raises(ValueError, match="needs about 47"):
        isograd.sdf_grid((CUBE, CUBE_FACES), isograd.Grid((0, 0, 0), 1, (1620, 1620, 1620)))


def test_faces_without_area_change_nothing():
    faces = np.vstack([CUBE_FACES, [[0, 0, 1], [5, 5, 5]]])
    result = isograd.sdf_grid((CUBE, faces), GRID)
    assert np.allclose(result.sdf, box(GRID.centers()), atol=1e-15)
    assert result.sign == "closed"


@pytest.mark.parametrize("dtype", [np.float32, np.float64])
def test_surface_of_a_field_is_at_its_level_and_outward(dtype):
    field = (np.linalg.norm(GRID.centers(), axis=-1) - 0.3).astype(dtype)
    found = isograd.isosurface(field, GRID, level=0.1)
    mesh = found.mesh
    assert mesh.vertices.dtype == dtype and not np.any(found.walls)
    # The error of linear interpolation: h² / 8 r.
    assert np.abs(np.linalg.norm(mesh.vertices, axis=1) - 0.4).max() < 0.1**2 / (8 * 0.3)
    a, b, c = (mesh.vertices[mesh.faces[:, k]].astype(float) for k in range(3))
    volume = np.einsum("fa,fa->", a, np.cross(b, c)) / 6
    assert 0.85 * 4 / 3 * np.pi * 0.4**3 < volume < 4 / 3 * np.pi * 0.4**3
    assert isograd.signed_distance(mesh, [[0.0, 0.0, 0.0]])[0] < 0


def test_pullback_of_the_surface_is_the_transpose_of_its_derivative():
    rng = np.random.default_rng(2)
    field = np.linalg.norm(GRID.centers(), axis=-1) - 0.3 + 0.02 * rng.standard_normal(GRID.shape)
    found = isograd.isosurface(field, GRID)
    bar = rng.standard_normal(found.mesh.vertices.shape)
    change, lift, shift, growth = rng.standard_normal(GRID.shape), 0.7, rng.standard_normal(3), 0.3

    def loss(t):
        grid = isograd.Grid(np.add(GRID.lower, t * shift), GRID.spacing + t * growth, GRID.shape)
        moved = isograd.isosurface(field + t * change, grid, t * lift).mesh
        return (moved.vertices * bar).sum()

    step = 1e-7
    slope = (loss(step) - loss(-step)) / (2 * step)
    gradients = found.pullback(bar)
    pulled = (gradients.field * change).sum() + gradients.level * lift
    pulled += np.dot(gradients.lower, shift) + gradients.spacing * growth
    assert abs(slope - pulled) < 1e-5 * max(1, abs(pulled))
    assert gradients.guarded == 0


def test_surface_is_open_at_the_walls_that_it_reaches():
    found = isograd.isosurface(GRID.centers()[..., 0], GRID, level=0.13)
    assert found.walls == ((True, False), (True, True), (True, True))


def test_bad_fields_are_refused_with_a_reason():
    field = np.ones(GRID.shape)
    with pytest.raises(ValueError, match="no cell is below"):
        isograd.isosurface(field, GRID)
    with pytest.raises(ValueError, match="every cell is below"):
        isograd.isosurface(-field, GRID)
    with pytest.raises(ValueError, match="level"):
        isograd.isosurface(field, GRID, np.nan)
    with pytest.raises(ValueError, match="field has the shape"):
        isograd.isosurface(field[1:], GRID)
    field[1, 2, 3] = np.nan
    with pytest.raises(ValueError, match=r"cell \[1, 2, 3\]"):
        isograd.isosurface(field, GRID)


def test_a_mesh_goes_through_its_field_and_back():
    sphere = isograd.isosurface(np.linalg.norm(GRID.centers(), axis=-1) - 0.4, GRID).mesh
    back = isograd.isosurface(isograd.sdf_grid(sphere, GRID).sdf, GRID).mesh
    assert np.abs(isograd.signed_distance(sphere, back.vertices)).max() < 0.1 * GRID.spacing
