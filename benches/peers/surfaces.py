"""Surfaces of real clouds against their true meshes, isograd beside PoissonRecon: `cargo xtask surfaces`.

isograd gets the points alone; PoissonRecon, in Open3D, gets the true normals. Both have the same cell size. Some of the samples are
also moved by noise, or have random points of a box among them; there PoissonRecon gets the normals of isograd."""

import argparse
import json
import subprocess
import tempfile
from pathlib import Path

import numpy as np
import open3d as o3d
import report

SHAPES = [
    "airliner",
    "aorta",
    "blub_fish",
    "bwb",
    "c172_wing",
    "featuretype",
    "scorpion",
    "spot_cow",
    "tray_plate",
    "wingnut",
]
CELLS = [64, 128, 256]
METHODS = {
    "default": [],
    "local": ["--level", "local"],
    "local, grid": ["--level", "local", "--surface", "grid"],
}
SAMPLES = 200_000
QUANTILES = [0.99, 0.999]
# Clouds with noise, a share of the longest side, and with outliers, a share of the samples: samples, cells.
NOISE = [0.0025, 0.005, 0.01]
OUTLIERS = [0.0, 0.001, 0.01, 0.05]
# Size of the box that the outliers are in, in that of the cloud.
BOX = 1.6
NOISY_SAMPLES = 30_000
NOISY_CELLS = 128


def main() -> None:
    options = arguments()
    rows = []
    for shape in options.shapes:
        truth = o3d.io.read_triangle_mesh(str(options.data / f"{shape}.mesh.ply"))
        cloud = options.data / f"{shape}.points.ply"
        for cells in options.cells:
            row = {"shape": shape, "cells": cells, "methods": {}}
            for name, arguments_of in METHODS.items():
                mesh, cell = isograd(options.program, cloud, cells, arguments_of)
                row["methods"][name] = compared(mesh, truth, cell)
            row["methods"]["PoissonRecon"] = compared(poisson_recon(cloud, cell), truth, cell)
            print(shape, cells, {k: [f"{x:.4f}" for x in v["means"]] for k, v in row["methods"].items()}, flush=True)
            rows.append(row)
    noisy = [row for shape in options.shapes for row in noisy_rows(options, shape)]
    spoilt = [row for shape in options.shapes for row in rows_with_outliers(options, shape)]
    data = {"machine": report.machine(), "samples": SAMPLES, "quantiles": QUANTILES, "rows": rows}
    data |= {"noisy": noisy, "noisy_samples": NOISY_SAMPLES, "noisy_cells": NOISY_CELLS}
    data |= {"with_outliers": spoilt, "outlier_box": BOX}
    options.json.parent.mkdir(parents=True, exist_ok=True)
    options.json.write_text(json.dumps(data, indent=1) + "\n")
    print(f"wrote {options.json}")


def noisy_rows(options, shape: str) -> list[dict]:
    rows = []
    for noise in NOISE:
        truth, cloud, random = some_samples(options, shape)
        size = max(cloud.get_max_bound() - cloud.get_min_bound())
        points = np.asarray(cloud.points)
        cloud.points = o3d.utility.Vector3dVector(points + noise * size * random.standard_normal(points.shape))
        with tempfile.TemporaryDirectory() as folder:
            path = write(cloud, folder)
            mesh, cell = isograd(options.program, path, NOISY_CELLS, [])
            methods = {
                "default": compared(mesh, truth, cell),
                "PoissonRecon": compared(poisson_recon(path, cell), truth, cell),
                "PoissonRecon, our normals": compared(poisson_recon(oriented(options.program, path), cell), truth, cell),
            }
        print(shape, noise, {k: [f"{x:.4f}" for x in v["means"]] for k, v in methods.items()}, flush=True)
        rows.append({"shape": shape, "noise": noise, "methods": methods})
    return rows


def rows_with_outliers(options, shape: str) -> list[dict]:
    rows = []
    for share in OUTLIERS:
        truth, cloud, random = some_samples(options, shape)
        low, high = cloud.get_min_bound(), cloud.get_max_bound()
        outliers = BOX * (high - low) * (random.random((round(share * NOISY_SAMPLES), 3)) - 0.5)
        points = np.concatenate([np.asarray(cloud.points), (low + high) / 2 + outliers])
        cloud = o3d.geometry.PointCloud(o3d.utility.Vector3dVector(points))
        with tempfile.TemporaryDirectory() as folder:
            path = write(cloud, folder)
            mesh, cell = isograd(options.program, path, NOISY_CELLS, [])
            kept, _ = isograd(options.program, path, NOISY_CELLS, ["--outliers", "keep"])
            methods = {
                "default": compared(mesh, truth, cell),
                "kept": compared(kept, truth, cell),
                "PoissonRecon": compared(poisson_recon(oriented(options.program, path), cell), truth, cell),
            }
            # Open3D counts the sample itself.
            cleaned, _ = cloud.remove_statistical_outlier(17, 2.0)
            path = oriented(options.program, write(cleaned, folder))
            methods["PoissonRecon, cleaned"] = compared(poisson_recon(path, cell), truth, cell)
        print(shape, share, {k: [f"{x:.4f}" for x in v["means"]] for k, v in methods.items()}, flush=True)
        rows.append({"shape": shape, "share": share, "methods": methods})
    return rows


def some_samples(options, shape: str):
    """The true mesh, random samples of the cloud, and a source of random numbers."""
    truth = o3d.io.read_triangle_mesh(str(options.data / f"{shape}.mesh.ply"))
    cloud = o3d.io.read_point_cloud(str(options.data / f"{shape}.points.ply"))
    random = np.random.default_rng(11)
    return truth, cloud.select_by_index(random.permutation(len(cloud.points))[:NOISY_SAMPLES]), random


def write(cloud, folder: str) -> Path:
    path = Path(folder) / "cloud.ply"
    o3d.io.write_point_cloud(str(path), cloud)
    return path


def oriented(program: Path, cloud: Path) -> Path:
    """The cloud with the normals that isograd finds."""
    path = cloud.with_name("oriented.ply")
    command = [program, "orient", cloud, "-o", path, "--quiet"]
    subprocess.run(list(map(str, command)), check=True, stderr=subprocess.DEVNULL)
    return path


def isograd(program: Path, cloud: Path, cells: int, arguments_of: list[str]):
    """The surface, and the cell size of the grid of φ."""
    with tempfile.TemporaryDirectory() as folder:
        mesh, about = Path(folder) / "mesh.ply", Path(folder) / "report.json"
        command = [program, "reconstruct", cloud, "--resolution", str(cells), "--mesh", mesh, "--report", about, "--quiet"]
        subprocess.run([*map(str, command), *arguments_of], check=True, stderr=subprocess.DEVNULL)
        return o3d.io.read_triangle_mesh(str(mesh)), json.loads(about.read_text())["grid"]["spacing"]


def poisson_recon(cloud: Path, cell: float):
    points = o3d.io.read_point_cloud(str(cloud))
    mesh, _ = o3d.geometry.TriangleMesh.create_from_point_cloud_poisson(points, width=cell, n_threads=1)
    return mesh


def compared(mesh, truth, cell: float) -> dict:
    """Mean distances in cells, surface to truth and truth to surface, and upper quantiles of the latter."""
    there, back = (distances(a, b) / cell for a, b in ((mesh, truth), (truth, mesh)))
    return {"means": [there.mean(), back.mean()], "quantiles": [float(np.quantile(back, q)) for q in QUANTILES]}


def distances(start, target) -> np.ndarray:
    """Distance to `target` of random points of `start`, uniform by area."""
    random = np.random.default_rng(7)
    corners = np.asarray(start.vertices)[np.asarray(start.triangles)]
    areas = np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1)
    faces = random.choice(len(corners), SAMPLES, p=areas / areas.sum())
    u, v = np.sqrt(random.random(SAMPLES)), random.random(SAMPLES)
    weights = np.stack([1 - u, u * (1 - v), u * v], axis=1)
    points = np.einsum("nk,nkd->nd", weights, corners[faces])
    scene = o3d.t.geometry.RaycastingScene()
    # The scene computes in single precision: the box of the target is made a unit cube.
    low = target.get_min_bound()
    size = float((target.get_max_bound() - low).max())
    vertices = ((np.asarray(target.vertices) - low) / size).astype(np.float32)
    scene.add_triangles(vertices, np.asarray(target.triangles).astype(np.uint32))
    return scene.compute_distance(((points - low) / size).astype(np.float32)).numpy().astype(float) * size


def arguments() -> argparse.Namespace:
    root = Path(__file__).resolve().parents[2]
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--program", type=Path, required=True, help="the program isograd")
    parser.add_argument("--data", type=Path, default=root.parent / "shared" / "data", help="NAME.mesh.ply, NAME.points.ply")
    parser.add_argument("--json", type=Path, default=root / "docs" / "surfaces.json", help="results")
    parser.add_argument("--shapes", nargs="*", default=SHAPES)
    parser.add_argument("--cells", nargs="*", type=int, default=CELLS)
    options = parser.parse_args()
    if not options.data.is_dir():
        parser.error(f"{options.data} is not there; give the folder of the shapes with --data")
    return options


if __name__ == "__main__":
    main()
