"""Errors of isograd and Open3D's PoissonRecon with the same samples, exact normals and cell size: `python benches/peers/accuracy.py --isograd PROGRAM [--data FOLDER]`.

The torus is that of the other comparisons. FOLDER holds NAME.points.ply, with normals, and NAME.mesh.ply, the exact
surface; missing ones are skipped. Distances are in cells: from the reconstruction to the exact surface (*precision*) and
back (*completeness*), each the mean over 100,000 random points and the 99th percentile."""

import argparse
import subprocess
import tempfile
from pathlib import Path

import numpy as np
import open3d as o3d
import torus

PLACES = 100_000
# Room on every side of Open3D's cube: its scale is 1.1.
SCALE = 1.1


def main() -> None:
    options = arguments()
    with tempfile.TemporaryDirectory() as folder:
        torus_field(options, Path(folder))
        clouds(options, Path(folder))


def arguments() -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--isograd", type=Path, required=True, help="the program")
    parser.add_argument("--data", type=Path, default=None, help="a folder of clouds and meshes")
    parser.add_argument("--depth", type=int, default=7, help="of Open3D's octree: 2^depth cells")
    parser.add_argument("--settings", default="", help="more arguments for isograd")
    return parser.parse_args()


def torus_field(options, folder: Path) -> None:
    """φ within three cells of the torus' surface."""
    cells = 128
    centers = torus.centers(cells)
    spacing = 2 * torus.HALF / cells
    exact = torus.distance(centers).ravel()
    near = np.abs(exact) < 3 * spacing
    points, normals = torus.samples(50_000)
    depth = 7
    for name, (vertices, faces) in surfaces(options, folder, points, normals, spacing, depth):
        scene = scene_of(vertices, faces)
        there = o3d.core.Tensor(centers.reshape(-1, 3)[near].astype(np.float32))
        error = np.abs(scene.compute_signed_distance(there).numpy() - exact[near]) / spacing
        print(f"torus        {name:8} |error of φ| {error.mean():.4f}, most {error.max():.4f}", flush=True)


def clouds(options, folder: Path) -> None:
    files = sorted(options.data.glob("*.points.ply")) if options.data else []
    if not files:
        print("SKIPPED clouds: no folder given (--data)")
    for path in files:
        truth = path.with_name(path.name.replace(".points.ply", ".mesh.ply"))
        cloud = o3d.io.read_point_cloud(str(path))
        if not truth.is_file() or not cloud.has_normals():
            continue
        points, normals = np.asarray(cloud.points), np.asarray(cloud.normals)
        mesh = o3d.io.read_triangle_mesh(str(truth))
        body = np.asarray(mesh.vertices), np.asarray(mesh.triangles)
        spacing = SCALE * np.ptp(points, axis=0).max() / 2**options.depth
        for name, surface in surfaces(options, folder, points, normals, spacing, options.depth):
            there = [distances(body, random_places(*surface)), distances(surface, random_places(*body))]
            shown = [f"{np.mean(d) / spacing:.4f}, {np.quantile(d, 0.99) / spacing:.3f}" for d in there]
            print(f"{path.name.removesuffix('.points.ply'):12} {name:8} precision {shown[0]}   completeness {shown[1]}", flush=True)


def surfaces(options, folder: Path, points, normals, spacing: float, depth: int):
    """Vertices and faces of each reconstruction."""
    cloud = o3d.geometry.PointCloud(o3d.utility.Vector3dVector(points))
    cloud.normals = o3d.utility.Vector3dVector(normals)
    mesh, _ = o3d.geometry.TriangleMesh.create_from_point_cloud_poisson(cloud, depth=depth, scale=SCALE)
    yield "Open3D", (np.asarray(mesh.vertices), np.asarray(mesh.triangles))
    source, result = folder / "cloud.ply", folder / "mesh.ply"
    o3d.io.write_point_cloud(str(source), cloud)
    command = [options.isograd, "reconstruct", source, "--orient", "given", "--mesh", result]
    command += ["--spacing", repr(float(spacing)), "-q", *options.settings.split()]
    subprocess.run([str(part) for part in command], check=True)
    mesh = o3d.io.read_triangle_mesh(str(result))
    yield "isograd", (np.asarray(mesh.vertices), np.asarray(mesh.triangles))


def random_places(vertices, faces) -> np.ndarray:
    """Reproducible points, uniform by area."""
    random = np.random.default_rng(0)
    a, b, c = (vertices[faces[:, k]] for k in range(3))
    area = np.linalg.norm(np.cross(b - a, c - a), axis=1)
    face = random.choice(len(faces), PLACES, p=area / area.sum())
    u, v = np.sqrt(random.random((PLACES, 1))), random.random((PLACES, 1))
    return a[face] * (1 - u) + b[face] * u * (1 - v) + c[face] * u * v


def scene_of(vertices, faces):
    scene = o3d.t.geometry.RaycastingScene()
    tensors = vertices.astype(np.float32), faces.astype(np.uint32)
    scene.add_triangles(*(o3d.core.Tensor(array) for array in tensors))
    return scene


def distances(surface, places) -> np.ndarray:
    there = o3d.core.Tensor(places.astype(np.float32))
    return scene_of(*surface).compute_distance(there).numpy()


if __name__ == "__main__":
    main()
