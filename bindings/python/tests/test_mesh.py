"""Measures and parts of meshes: against closed forms, and an oracle in plain Python."""

import numpy as np
import pytest

import isograd
from isograd import Mesh

TYPES = [np.float32, np.float64]
CUBE = Mesh(
    vertices=np.array([[x, y, z] for x in (0.0, 1.0) for y in (0.0, 1.0) for z in (0.0, 1.0)]),
    faces=np.array(
        # Two triangles for each of -x, +x, -y, +y, -z, +z.
        [[0, 1, 3], [0, 3, 2], [4, 6, 7], [4, 7, 5], [0, 4, 5], [0, 5, 1]]
        + [[2, 3, 7], [2, 7, 6], [0, 2, 6], [0, 6, 4], [1, 5, 7], [1, 7, 3]]
    ),
)


def moved(mesh, by=(0.0, 0.0, 0.0), scale=1.0, flip=False):
    faces = mesh.faces[:, ::-1] if flip else mesh.faces
    return Mesh(scale * mesh.vertices + np.asarray(by), faces)


def joined(*meshes):
    starts = np.cumsum([0] + [len(mesh.vertices) for mesh in meshes[:-1]])
    faces = [mesh.faces + start for mesh, start in zip(meshes, starts)]
    return Mesh(np.concatenate([mesh.vertices for mesh in meshes]), np.concatenate(faces))


def torus(major, minor, rows, columns):
    """A torus sampled at its angles, with its exact normals."""
    u, v = np.meshgrid(2 * np.pi * np.arange(rows) / rows, 2 * np.pi * np.arange(columns) / columns, indexing="ij")
    normals = np.stack([np.cos(v) * np.cos(u), np.cos(v) * np.sin(u), np.sin(v)], axis=-1).reshape(-1, 3)
    ring = np.stack([np.cos(u), np.sin(u), np.zeros_like(u)], axis=-1).reshape(-1, 3)
    number = np.arange(rows * columns).reshape(rows, columns)
    right, up = np.roll(number, -1, axis=0), np.roll(number, -1, axis=1)
    both = np.roll(right, -1, axis=1)
    faces = np.stack([number, right, both, number, both, up], axis=-1).reshape(-1, 3)
    return Mesh(major * ring + minor * normals, faces), normals


def oracle_components(faces):
    """Numbers of components, by first face: a flood fill over the faces of each vertex."""
    around = {}
    for face, corners in enumerate(faces):
        for vertex in corners:
            around.setdefault(int(vertex), []).append(face)
    numbers = [None] * len(faces)
    count = 0
    for start in range(len(faces)):
        if numbers[start] is None:
            stack, numbers[start] = [start], count
            while stack:
                for vertex in faces[stack.pop()]:
                    for face in around.pop(int(vertex), []):
                        if numbers[face] is None:
                            numbers[face] = count
                            stack.append(face)
            count += 1
    return numbers


def oracle_is_closed(faces):
    directed = [(a, b) for f in faces.tolist() for a, b in zip(f, f[1:] + f[:1])]
    single = len(set(directed)) == len(directed)
    return bool(directed) and single and all(a != b and (b, a) in directed for a, b in directed)


@pytest.mark.parametrize("dtype", TYPES)
def test_a_cube_has_its_area_volume_bounds_and_normals(dtype):
    mesh = Mesh(CUBE.vertices.astype(dtype), CUBE.faces)
    assert abs(mesh.area - 6) < 1e-12 and abs(mesh.volume - 1) < 1e-12
    assert mesh.is_closed and (mesh.bounds == [[0, 0, 0], [1, 1, 1]]).all()
    assert np.allclose(mesh.face_areas, 0.5) and mesh.face_areas.dtype == dtype
    outward = np.repeat([[-1, 0, 0], [1, 0, 0], [0, -1, 0], [0, 1, 0], [0, 0, -1], [0, 0, 1]], 2, axis=0)
    assert np.allclose(mesh.face_normals, outward) and mesh.face_normals.dtype == dtype
    # By angle each side of the cube counts alike, whether one or two triangles of it meet in a corner.
    assert np.allclose(mesh.normals, (2 * mesh.vertices - 1) / np.sqrt(3)) and mesh.normals.dtype == dtype
    assert mesh.normals.flags.c_contiguous and mesh.face_normals.flags.c_contiguous
    assert (mesh.bounds.dtype, mesh.components().tolist()) == (dtype, [0] * 12)


def test_measures_of_a_torus_are_closed_forms():
    major, minor = 1.0, 0.3
    mesh, normals = torus(major, minor, 300, 120)
    # Inscribed polygons of n corners: the error is (2π/n)²/6 at most, for each of the two circles.
    error = (2 * np.pi / 300) ** 2 + (2 * np.pi / 120) ** 2
    assert abs(mesh.area / (4 * np.pi**2 * major * minor) - 1) < error
    assert abs(mesh.volume / (2 * np.pi**2 * major * minor**2) - 1) < error
    assert np.abs(mesh.normals - normals).max() < 0.01
    assert mesh.is_closed and mesh.components().max() == 0


def test_measures_of_a_sphere_are_those_of_the_report():
    points = isograd.sample("sphere", 2000).points
    result = isograd.reconstruct(points, isograd.Grid.fit(points, 32))
    mesh, surface = result.mesh, result.report["surface"]
    assert abs(mesh.area / surface["area"] - 1) < 1e-12 and abs(mesh.volume / surface["volume"] - 1) < 1e-12
    assert mesh.is_closed is surface["closed"] and mesh.components().max() + 1 == surface["components"]
    # Radius 0.5; the reconstruction is within a tenth of a cell.
    assert abs(mesh.volume / (np.pi / 6) - 1) < 0.01 and abs(mesh.area / np.pi - 1) < 0.01
    radial = mesh.vertices / np.linalg.norm(mesh.vertices, axis=1, keepdims=True)
    assert np.einsum("ij,ij->i", mesh.normals, radial).min() > 0.99


def test_turned_faces_have_negative_volume_and_inward_normals():
    turned = moved(CUBE, flip=True)
    assert abs(turned.volume + 1) < 1e-12 and turned.is_closed
    assert np.allclose(turned.normals, -CUBE.normals) and np.allclose(turned.face_normals, -CUBE.face_normals[:])


@pytest.mark.parametrize("scale", [1e-150, 1e-30, 1e30, 1e150])
def test_normals_and_areas_of_tiny_and_huge_meshes(scale):
    mesh = moved(CUBE, scale=scale)
    assert np.allclose(mesh.normals, CUBE.normals, rtol=0, atol=1e-12)
    assert np.allclose(mesh.face_areas / scale / scale, 0.5)


def test_a_distant_mesh_keeps_its_volume():
    # Coordinates of 1e6 are exact to 1e-10.
    assert abs(moved(CUBE, by=(1e6, -2e6, 3e6)).volume - 1) < 1e-9


@pytest.mark.parametrize("lone", [np.nan, 1e300])
def test_a_vertex_without_faces_does_not_change_the_volume(lone):
    mesh = Mesh(np.vstack([CUBE.vertices, [[lone, 0.0, 0.0]]]), CUBE.faces)
    assert mesh.volume == CUBE.volume


def test_degenerate_faces_and_lone_vertices_have_the_normal_0():
    vertices = np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [5.0, 5.0, 5.0], [2.0, 0.0, 0.0]])
    mesh = Mesh(vertices, np.array([[0, 1, 2], [0, 1, 4], [1, 1, 1]]))
    assert mesh.face_normals.tolist() == [[0, 0, 1], [0, 0, 0], [0, 0, 0]]
    assert mesh.normals.tolist() == [[0, 0, 1], [0, 0, 1], [0, 0, 1], [0, 0, 0], [0, 0, 0]]
    assert mesh.face_areas.tolist() == [0.5, 0, 0] and not mesh.is_closed


def test_one_wrong_face_makes_a_mesh_not_closed():
    faces = CUBE.faces
    flipped = faces.copy()
    flipped[3] = flipped[3, ::-1]
    for wrong in [faces[1:], np.concatenate([faces, faces[:1]]), flipped, np.concatenate([faces, [[1, 1, 2]]])]:
        assert not Mesh(CUBE.vertices, wrong).is_closed
    # Two closed bodies that share a corner, or an edge: that edge is in four faces.
    corner = joined(CUBE, moved(CUBE, by=(1, 1, 1)))
    corner.faces[corner.faces == 8] = 7
    assert corner.is_closed and corner.components().max() == 0
    edge = joined(CUBE, moved(CUBE, by=(0, 1, 1)))
    edge.faces[edge.faces == 8] = 3
    edge.faces[edge.faces == 12] = 7
    assert not edge.is_closed


@pytest.mark.parametrize("seed", range(20))
def test_components_and_closedness_of_random_faces_are_those_of_the_oracle(seed):
    rng = np.random.default_rng(seed)
    count = int(rng.integers(3, 400))
    faces = rng.integers(0, count, (int(rng.integers(0, 300)), 3))
    mesh = Mesh(rng.normal(size=(count, 3)), faces.reshape(-1, 3))
    assert mesh.components().tolist() == oracle_components(faces)
    assert mesh.is_closed == oracle_is_closed(faces)
    mixed = joined(CUBE, moved(CUBE, by=(3, 0, 0)))
    assert mixed.is_closed and oracle_is_closed(mixed.faces)


def test_components_of_a_long_strip_in_random_order():
    # The longest way between two vertices, with numbers in random order: the worst case of propagation.
    rng = np.random.default_rng(3)
    count = 300_000
    order = rng.permutation(count)
    strip = np.stack([order[:-2], order[1:-1], order[2:]], axis=1)
    cut = np.delete(strip, [100_000, 100_001], axis=0)
    numbers = Mesh(np.zeros((count, 3)), rng.permutation(cut)).components()
    assert numbers[0] == 0 and np.bincount(numbers).size == 2
    assert sorted(np.bincount(numbers).tolist()) == [100_000, count - 2 - 100_002]


def test_split_gives_each_part_with_its_own_vertices():
    small, large = moved(CUBE, by=(9, 0, 0), scale=0.5), moved(CUBE, by=(0, 9, 0), scale=3.0)
    mesh = joined(CUBE, small, large)
    shuffled = Mesh(mesh.vertices, np.concatenate([mesh.faces[::2], mesh.faces[1::2]]))
    parts = shuffled.split()
    assert [round(part.volume, 12) for part in parts] == [1.0, 0.125, 27.0]
    assert all(part.is_closed and len(part.vertices) == 8 for part in parts)
    assert sorted(map(tuple, parts[1].vertices)) == sorted(map(tuple, small.vertices))


def test_the_largest_part_is_that_of_the_largest_area():
    # A cavity has a negative volume; a sheet has none.
    cavity = moved(CUBE, scale=3.0, flip=True)
    sheet = Mesh(np.array([[0.0, 0, 9], [20, 0, 9], [0, 20, 9]]), np.array([[0, 1, 2]]))
    assert joined(CUBE, cavity).keep_largest().volume < 0
    largest = joined(CUBE, cavity, sheet).keep_largest()
    assert largest.area == 200 and len(largest.vertices) == 3


def test_an_empty_mesh_measures_nothing():
    for vertices in [np.zeros((0, 3)), np.ones((4, 3))]:
        mesh = Mesh(vertices, np.zeros((0, 3), int))
        assert (mesh.area, mesh.volume, mesh.is_closed, mesh.split()) == (0.0, 0.0, False, [])
        assert mesh.normals.shape == vertices.shape and mesh.face_normals.shape == (0, 3)
        assert mesh.components().shape == (0,) and mesh.keep_largest().vertices.shape == (0, 3)
    assert np.isnan(Mesh(np.zeros((0, 3)), np.zeros((0, 3), int)).bounds).all()


@pytest.mark.parametrize(
    "use",
    ["normals", "face_normals", "face_areas", "area", "volume", "is_closed", "components", "split", "keep_largest"],
)
def test_faces_that_name_missing_vertices_are_refused(use):
    mesh = Mesh(CUBE.vertices[:7], CUBE.faces)
    with pytest.raises(ValueError, match="face 2 names vertex 7, but there are only 7"):
        found = getattr(mesh, use)
        found()


def test_faces_of_another_shape_or_type_are_refused():
    with pytest.raises(ValueError, match=r"faces has the shape \(12, 2\) and must have \(N, 3\)"):
        Mesh(CUBE.vertices, CUBE.faces[:, :2])
    with pytest.raises(TypeError, match="faces is of float64; give whole numbers"):
        Mesh(CUBE.vertices, CUBE.faces.astype(float))
    with pytest.raises(ValueError, match="entries from -1"):
        Mesh(CUBE.vertices, CUBE.faces.astype(int) - 1)


def test_arrays_may_be_modified():
    mesh = moved(CUBE)
    assert abs(mesh.volume - 1) < 1e-12
    mesh.vertices[:] *= 2
    assert abs(mesh.volume - 8) < 1e-12 and abs(mesh.area - 24) < 1e-12


def test_points_inside_are_contained():
    assert CUBE.contains([[0.5, 0.5, 0.5], [0.5, 0.5, 1.5]]).tolist() == [True, False]


def test_names_of_trimesh_mean_the_same():
    assert CUBE.is_watertight is True and (CUBE.vertex_normals == CUBE.normals).all()
    trimesh = pytest.importorskip("trimesh", reason="SKIPPED: trimesh is not installed")
    theirs = trimesh.Trimesh(CUBE.vertices, CUBE.faces, process=False)
    for name in ["vertex_normals", "face_normals", "bounds", "area", "volume", "is_watertight"]:
        assert np.allclose(getattr(CUBE, name), getattr(theirs, name)), name
    assert np.allclose(CUBE.face_areas, theirs.area_faces)


def test_texts_have_shapes_in_place_of_values():
    assert repr(CUBE) == "Mesh(vertices=(8, 3) float64, faces=(12, 3) uint32)"
    samples = isograd.sample("sphere", 500)
    assert repr(samples.coordinates) == "Coordinates(patch=(500,) uint32, uv=(500, 2) float64)"
    assert repr(samples).startswith("Samples(points=(500, 3) float64, normals=(500, 3) float64, velocity=None, ")
    cloud = isograd.Cloud(samples.points, None, {"heat": samples.points[:, :1]})
    assert repr(cloud) == "Cloud(points=(500, 3) float64, normals=None, attributes={'heat': (500, 1) float64})"
    assert len(repr(isograd.query(CUBE, samples.points))) < 200
    gradients = isograd.reconstruct(samples.points, resolution=24, checks=False).pullback(vertices=None)
    assert repr(gradients).startswith("Gradients(points=(500, 3) float64, normals=None, attributes={}, lower=")
    grid = isograd.Grid.fit(samples.points, 32)
    assert eval(repr(grid), {"Grid": isograd.Grid}) == grid and len(repr(grid)) < 200
