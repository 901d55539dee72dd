"""Signed distance from one mesh at every center of a grid: isograd, libigl, Open3D, Warp, pysdf; and in a band
of 3 cells: isograd, OpenVDB."""

import subprocess
from pathlib import Path

import igl
import numpy as np
import open3d as o3d
import warp as wp

import torus
from case import Case, peer

try:
    import pysdf
except ImportError:
    # Built on installation, which needs the headers of Eigen.
    pysdf = None
from stage import Stage, stages, write_input


@wp.kernel
def warp_signed_distance(
    mesh: wp.uint64, points: wp.array(dtype=wp.vec3), out: wp.array(dtype=wp.float32)
):
    i = wp.tid()
    query = wp.mesh_query_point_sign_normal(mesh, points[i], 1.0e6)
    closest = wp.mesh_eval_position(mesh, query.face, query.u, query.v)
    out[i] = query.sign * wp.length(points[i] - closest)


def case(stack, program, folder, cells: int, threads: int) -> Case:
    """Each entry gets the mesh and the centers and returns the distances: building its tree counts."""
    folder = folder / "distance"
    centers = torus.centers(cells)
    field = torus.distance(centers)
    write_input(folder, torus.grid(cells), chi=field)
    write_input(folder, torus.grid(cells), chi=field.astype(np.float32))
    single, double = (
        stages(stack, program, "distance", folder, threads, dtype) for dtype in (np.float32, np.float64)
    )
    ours = [stage.entry("phi") for stage in single + double]
    double[-1].run()
    vertices = double[-1].result("vertices").reshape(-1, 3)
    faces = double[-1].result("faces", np.uint32).reshape(-1, 3).astype(np.int64)
    peers = [
        peer("libigl, pseudonormal", "float64", threads, libigl(centers, vertices, faces)),
        peer("Open3D RaycastingScene", "float32", threads, open3d(centers, vertices, faces, threads)),
        peer("Warp mesh query, CPU", "float32", 1, warp(centers, vertices, faces)),
    ]
    if pysdf:
        work = nearby(centers, vertices, faces, threads)
        peers.append(peer("pysdf (faces of the nearest vertex)", "float32", threads, work))
    spacing = 2 * torus.HALF / cells

    def check() -> list[str]:
        exact = ours[-1].result()
        return [agreement(entry, exact, spacing) for entry in [*ours[:-1], *peers]]

    title = f"Distance, {cells}³ cells"
    what = f"signed distance from {len(faces):,} triangles at every cell center, tree included"
    return Case(title, what, ("cell", cells**3), ours + peers, check)


def band(stack, program, folder, cells: int, threads: int) -> Case | None:
    """Only within 3 cells of the surface. `None` where OpenVDB's Python module is not installed."""
    python = "/usr/bin/python3"
    if not has_openvdb(python):
        print("SKIPPED OpenVDB: install Debian's python3-openvdb", flush=True)
        return None
    folder = folder / "band"
    field = torus.distance(torus.centers(cells)).astype(np.float32)
    write_input(folder, torus.grid(cells), chi=field)
    single = stages(stack, program, "band", folder, threads)
    ours = [stage.entry("phi") for stage in single]
    # Saves the mesh that OpenVDB reads.
    single[-1].run()
    faces = len(single[-1].result("faces", np.uint32)) // 3
    script = [python, Path(__file__).with_name("vdb.py")]
    vdb = stack.enter_context(Stage(script, "band", folder, np.float32, threads))
    peers = [vdb.entry("phi", "OpenVDB createLevelSetFromPolygons")]
    spacing = 2 * torus.HALF / cells

    def check() -> list[str]:
        # Both save to the same file, so one after the other; OpenVDB's band ends a little before 3 cells.
        mine, theirs = ours[-1].result(), peers[0].result()
        inside = np.abs(mine) < 2.9 * spacing
        apart = np.abs(mine - theirs)[inside].max() / spacing
        return [f"φ of OpenVDB within {apart:.1e} cell of isograd, where |φ| < 2.9 cells"]

    title = f"Distance in a band, {cells}³ cells"
    what = f"signed distance from {faces:,} triangles within 3 cells, tree included"
    return Case(title, what, ("cell", cells**3), ours + peers, check)


def has_openvdb(python: str) -> bool:
    try:
        result = subprocess.run([python, "-c", "import pyopenvdb"], capture_output=True)
    except OSError:
        return False
    return result.returncode == 0


def agreement(entry, exact: np.ndarray, spacing: float) -> str:
    """Difference of a field from ours in double precision, in cells: of the lengths, and of the signs."""
    field = entry.result()
    lengths = np.abs(np.abs(field) - np.abs(exact)).max() / spacing
    signs = int(np.sum((field < 0) != (exact < 0)))
    name = f"{entry.name}, {entry.dtype}, {entry.threads} threads"
    return (
        f"{name}: |φ| within {lengths:.1e} cell of isograd in float64, "
        f"different sign at {signs} cells"
    )


def libigl(centers, vertices, faces):
    kind = igl.SignedDistanceType.SIGNED_DISTANCE_TYPE_PSEUDONORMAL
    return lambda: igl.signed_distance(centers, vertices, faces, sign_type=kind)[0]


def open3d(centers, vertices, faces, threads):
    points = o3d.core.Tensor(centers.astype(np.float32))
    positions = o3d.core.Tensor(vertices.astype(np.float32))
    triangles = o3d.core.Tensor(faces.astype(np.uint32))

    def work():
        scene = o3d.t.geometry.RaycastingScene(nthreads=threads)
        scene.add_triangles(positions, triangles)
        return scene.compute_signed_distance(points, nthreads=threads).numpy()

    return work


def warp(centers, vertices, faces):
    points = wp.array(centers.astype(np.float32), dtype=wp.vec3, device="cpu")
    positions = wp.array(vertices.astype(np.float32), dtype=wp.vec3, device="cpu")
    indices = wp.array(faces.astype(np.int32).ravel(), dtype=wp.int32, device="cpu")
    out = wp.zeros(len(centers), dtype=wp.float32, device="cpu")

    def work():
        mesh = wp.Mesh(positions, indices)
        wp.launch(warp_signed_distance, len(centers), [mesh.id, points, out], device="cpu")
        return out.numpy()

    return work


def nearby(centers, vertices, faces, threads):
    """pysdf: positive inside."""
    points = centers.astype(np.float32)
    positions = vertices.astype(np.float32)
    triangles = faces.astype(np.uint32)
    return lambda: -pysdf.SDF(positions, triangles)(points, n_threads=threads)
