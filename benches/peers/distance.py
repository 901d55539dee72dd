"""Signed distance from one mesh at every centre of a grid: isograd, libigl, Open3D, Warp."""

import igl
import numpy as np
import open3d as o3d
import warp as wp

import torus
from case import Case, peer
from stage import Stage, write_input


@wp.kernel
def warp_signed_distance(
    mesh: wp.uint64, points: wp.array(dtype=wp.vec3), out: wp.array(dtype=wp.float32)
):
    i = wp.tid()
    query = wp.mesh_query_point_sign_normal(mesh, points[i], 1.0e6)
    closest = wp.mesh_eval_position(mesh, query.face, query.u, query.v)
    out[i] = query.sign * wp.length(points[i] - closest)


def case(stack, program, folder, cells: int, threads: int) -> Case:
    """Each entry gets the mesh and the centres and returns the distances: building its tree counts."""
    folder = folder / "distance"
    centres = torus.centres(cells)
    field = torus.distance(centres)
    write_input(folder, torus.grid(cells), chi=field)
    write_input(folder, torus.grid(cells), chi=field.astype(np.float32))
    stages = [
        stack.enter_context(Stage(program, "distance", folder, dtype, count))
        for dtype in (np.float32, np.float64)
        for count in sorted({1, threads})
    ]
    ours = [stage.entry("phi") for stage in stages]
    stages[-1].run()
    vertices = stages[-1].result("vertices").reshape(-1, 3)
    faces = stages[-1].result("faces", np.uint32).reshape(-1, 3).astype(np.int64)
    peers = [
        peer("libigl, pseudonormal", "float64", threads, libigl(centres, vertices, faces)),
        peer("Open3D RaycastingScene", "float32", threads, open3d(centres, vertices, faces, threads)),
        peer("Warp mesh query, CPU", "float32", 1, warp(centres, vertices, faces)),
    ]
    spacing = 2 * torus.HALF / cells

    def check() -> list[str]:
        exact = ours[-1].result()
        return [agreement(entry, exact, spacing) for entry in [*ours[:-1], *peers]]

    title = f"Distance, {cells}³ cells"
    what = f"signed distance from {len(faces):,} triangles at every cell centre, tree included"
    return Case(title, what, ("cell", cells**3), ours + peers, check)


def agreement(entry, exact: np.ndarray, spacing: float) -> str:
    """How far a field is from ours in double precision, in cells, signs apart from lengths."""
    field = entry.result()
    lengths = np.abs(np.abs(field) - np.abs(exact)).max() / spacing
    signs = int(np.sum((field < 0) != (exact < 0)))
    name = f"{entry.name}, {entry.dtype}, {entry.threads} threads"
    return (
        f"{name}: |φ| within {lengths:.1e} cell of isograd in float64, "
        f"another sign at {signs} cells"
    )


def libigl(centres, vertices, faces):
    kind = igl.SignedDistanceType.SIGNED_DISTANCE_TYPE_PSEUDONORMAL
    return lambda: igl.signed_distance(centres, vertices, faces, sign_type=kind)[0]


def open3d(centres, vertices, faces, threads):
    points = o3d.core.Tensor(centres.astype(np.float32))
    positions = o3d.core.Tensor(vertices.astype(np.float32))
    triangles = o3d.core.Tensor(faces.astype(np.uint32))

    def work():
        scene = o3d.t.geometry.RaycastingScene(nthreads=threads)
        scene.add_triangles(positions, triangles)
        return scene.compute_signed_distance(points, nthreads=threads).numpy()

    return work


def warp(centres, vertices, faces):
    points = wp.array(centres.astype(np.float32), dtype=wp.vec3, device="cpu")
    positions = wp.array(vertices.astype(np.float32), dtype=wp.vec3, device="cpu")
    indices = wp.array(faces.astype(np.int32).ravel(), dtype=wp.int32, device="cpu")
    out = wp.zeros(len(centres), dtype=wp.float32, device="cpu")

    def work():
        mesh = wp.Mesh(positions, indices)
        wp.launch(warp_signed_distance, len(centres), [mesh.id, points, out], device="cpu")
        return out.numpy()

    return work
