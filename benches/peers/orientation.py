"""Outward normals from points only: isograd and PyMeshLab."""

import numpy as np
import pymeshlab

import torus
from case import Case, peer
from normals import degrees
from stage import stages, write_input


def case(stack, program, folder, count: int, threads: int) -> Case:
    """Each entry gets points and returns normals with signs; isograd the areas of the samples as well."""
    folder = folder / f"orientation-{count}"
    points, truth = torus.samples(count)
    points = points.astype(np.float32)
    write_input(folder, {}, points=points)
    entries = [stage.entry("normals") for stage in stages(stack, program, "orient", folder, threads)]
    entries.append(peer("PyMeshLab, k = 18", "float64", 1, meshlab(points)))

    def check() -> list[str]:
        return [shown(e.name, e.result().reshape(-1, 3), truth) for e in entries[-2:]]

    title = f"Oriented normals, {count:,} points"
    what = "neighbors, planes and signs; PyMeshLab: compute_normal_for_point_clouds"
    return Case(title, what, ("point", count), entries, check)


def meshlab(points):
    def work():
        meshes = pymeshlab.MeshSet(verbose=False)
        meshes.add_mesh(pymeshlab.Mesh(vertex_matrix=points))
        meshes.compute_normal_for_point_clouds(k=18)
        return meshes.current_mesh().vertex_normal_matrix()

    return work


def shown(name: str, normals: np.ndarray, truth: np.ndarray) -> str:
    """Angle of the axes and share of wrong signs."""
    wrong = np.mean(np.sum(normals * truth, axis=1) < 0)
    return f"{name}: {degrees(normals, truth)} from the true axis, {100 * wrong:.2f} % turned inward"
