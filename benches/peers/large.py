"""A large cloud: the sparse solve at an effective 2048³ beside PoissonRecon at depth 11: `cargo xtask large`.

Both get the same samples with true normals, and surface cells of the same size. Each runs in a process of its own."""

import argparse
import json
import os
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy as np
import open3d as o3d
import report
from scipy.spatial import cKDTree

SHAPE = ["vessels", "--param", "generations=7"]
FACTOR = 4
PADDING = 0.05
BAND = 4
PROBES = 200_000


def main() -> None:
    options = arguments()
    with tempfile.TemporaryDirectory(dir=options.folder) as folder:
        folder = Path(folder)
        cloud, truth = folder / "cloud.ply", folder / "truth.ply"
        for path, count, seed in ((cloud, options.samples, 1), (truth, options.samples, 2)):
            sampled = [*SHAPE, "-n", count, "--seed", seed, "--layout", "random", "-o", path, "-q"]
            subprocess.run([str(a) for a in (options.program, "sample", *sampled)], check=True)
        rows = [isograd(options, cloud, folder)]
        cell = rows[0]["cell"]
        print(rows[-1], flush=True)
        rows.append(poisson_recon(options, cloud, folder))
        print(rows[-1], flush=True)
        points = o3d.io.read_point_cloud(str(truth))
        points, normals = np.asarray(points.points), np.asarray(points.normals)
        tree = cKDTree(points)
        for row in rows:
            row["means"] = compared(folder / f"{row['name']}.ply", points, normals, tree, cell)
            print(row["name"], row["means"], flush=True)
    about = {"samples": options.samples, "cells": options.cells, "factor": FACTOR, "band": BAND, "shape": " ".join(SHAPE)}
    data = {"machine": report.machine(), "about": about, "rows": rows}
    options.json.write_text(json.dumps(data, indent=1) + "\n")


def measured(command: list, name: str) -> dict:
    """Seconds, CPU seconds and peak bytes of a process, and CPU seconds of all others meanwhile."""
    begin, busy = time.monotonic(), busy_seconds()
    process = subprocess.Popen([str(a) for a in command], stdout=subprocess.DEVNULL)
    _, status, usage = os.wait4(process.pid, 0)
    if status != 0:
        raise SystemExit(f"{name} failed")
    seconds, cpu = time.monotonic() - begin, usage.ru_utime + usage.ru_stime
    others = max(busy_seconds() - busy - cpu, 0.0)
    return {"name": name, "seconds": seconds, "cpu": cpu, "others": others, "bytes": usage.ru_maxrss * 1024}


def busy_seconds() -> float:
    """CPU seconds of all processes since the start of a Linux machine: user, nice, system, interrupts."""
    ticks = Path("/proc/stat").read_text().splitlines()[0].split()[1:]
    return sum(int(ticks[k]) for k in (0, 1, 2, 5, 6)) / os.sysconf("SC_CLK_TCK")


def isograd(options, cloud: Path, folder: Path) -> dict:
    low, high = (np.asarray(x) for x in bounds(cloud))
    band = BAND * (high - low).max() * (1 + 2 * PADDING) / options.cells
    about = folder / "report.json"
    grid = ["--resolution", options.cells, "--padding", PADDING, "--surface", f"{FACTOR}x", "--solve", "sparse"]
    rest = ["--band", band, "--orient", "given", "--mesh", folder / "isograd.ply", "--report", about, "--quiet"]
    row = measured([options.program, "reconstruct", cloud, *grid, *rest], "isograd")
    about = json.loads(about.read_text())
    return row | {"stages": about["seconds"], "cell": about["surface_spacing"], "shape": about["grid"]["shape"]}


def bounds(cloud: Path):
    box = o3d.io.read_point_cloud(str(cloud)).get_axis_aligned_bounding_box()
    return box.min_bound, box.max_bound


def poisson_recon(options, cloud: Path, folder: Path) -> dict:
    depth = round(np.log2(options.cells * FACTOR))
    command = [sys.executable, __file__, "--poisson", cloud, folder / "PoissonRecon.ply", depth]
    return measured(command, "PoissonRecon") | {"depth": depth}


def run_poisson(cloud: str, mesh: str, depth: str) -> None:
    points = o3d.io.read_point_cloud(cloud)
    find = o3d.geometry.TriangleMesh.create_from_point_cloud_poisson
    found, _ = find(points, depth=int(depth), scale=1 + 2 * PADDING, n_threads=os.cpu_count())
    o3d.io.write_triangle_mesh(mesh, found)


def compared(path: Path, points, normals, tree, cell: float) -> list[float]:
    """Mean distances in cells: surface to the tangent plane of the nearest true sample, and true samples to surface."""
    random = np.random.default_rng(7)
    mesh = o3d.io.read_triangle_mesh(str(path))
    corners, faces = np.asarray(mesh.vertices), np.asarray(mesh.triangles)
    edges = [corners[faces[:, k]] - corners[faces[:, 0]] for k in (1, 2)]
    areas = np.linalg.norm(np.cross(*edges), axis=1)
    chosen = faces[random.choice(len(faces), PROBES, p=areas / areas.sum())]
    u, v = np.sqrt(random.random(PROBES)), random.random(PROBES)
    weights = np.stack([1 - u, u * (1 - v), u * v], axis=1)
    probes = np.einsum("nk,nkd->nd", weights, corners[chosen])
    _, nearest = tree.query(probes, workers=-1)
    there = np.abs(np.einsum("nd,nd->n", probes - points[nearest], normals[nearest]))
    some = points[random.choice(len(points), PROBES)]
    low, size = corners.min(axis=0), float(np.ptp(corners, axis=0).max())
    scene = o3d.t.geometry.RaycastingScene()
    scene.add_triangles(((corners - low) / size).astype(np.float32), faces.astype(np.uint32))
    back = scene.compute_distance(((some - low) / size).astype(np.float32)).numpy().astype(float) * size
    return [float(there.mean() / cell), float(back.mean() / cell)]


def arguments() -> argparse.Namespace:
    root = Path(__file__).resolve().parents[2]
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--program", type=Path, required=True, help="the program isograd")
    parser.add_argument("--json", type=Path, default=root / "docs" / "large.json", help="results")
    parser.add_argument("--samples", type=int, default=10_000_000)
    parser.add_argument("--cells", type=int, default=512, help="cells of φ on the longest side")
    parser.add_argument("--folder", type=Path, help="of temporary files")
    return parser.parse_args()


if __name__ == "__main__":
    if sys.argv[1:2] == ["--poisson"]:
        run_poisson(*sys.argv[2:])
    else:
        main()
