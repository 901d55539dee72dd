"""Cloud to signed distance field: isograd and the chain of Open3D's functions."""

import numpy as np
import open3d as o3d

import torus
from case import Case, peer
from stage import stages, write_input


def case(stack, program, folder, count: int, cells: int, threads: int) -> Case:
    """Points in memory to the field in memory, without normals."""
    folder = folder / "whole"
    points, _ = torus.samples(count)
    write_input(folder, torus.grid(cells), points=points.astype(np.float32))
    centers = torus.centers(cells)
    entries = [stage.entry("phi") for stage in stages(stack, program, "whole", folder, threads)]
    entries.append(peer("Open3D chain", "float32", threads, chain(points, centers, threads)))

    def check() -> list[str]:
        exact = torus.distance(centers)
        return [f"{e.name}: {accuracy(e.result(), exact, cells)}" for e in entries[-2:]]

    title = f"Whole pipeline, {count:,} points, {cells}³ cells"
    what = (
        "points to signed distance at every cell. The chain: estimate_normals, "
        "orient_normals_consistent_tangent_plane, Poisson of depth 7, RaycastingScene"
    )
    return Case(title, what, ("run", 1), entries, check)


def accuracy(field: np.ndarray, exact: np.ndarray, cells: int) -> str:
    """|φ − exact| in cells, within three cells of the surface, with the better sign of the whole field."""
    spacing = 2 * torus.HALF / cells
    near = np.abs(exact) < 3 * spacing
    field, exact = field[near], exact[near]
    error = min((np.abs(s * field - exact) for s in (1, -1)), key=np.mean) / spacing
    return f"|error| of φ near the surface: mean {error.mean():.3f}, most {error.max():.2f} cell"


def chain(points, centers, threads):
    queries = o3d.core.Tensor(centers.astype(np.float32))

    def work():
        cloud = o3d.geometry.PointCloud(o3d.utility.Vector3dVector(points))
        cloud.estimate_normals(o3d.geometry.KDTreeSearchParamKNN(knn=24))
        cloud.orient_normals_consistent_tangent_plane(24)
        mesh, _ = o3d.geometry.TriangleMesh.create_from_point_cloud_poisson(
            cloud, depth=7, n_threads=threads
        )
        scene = o3d.t.geometry.RaycastingScene(nthreads=threads)
        scene.add_triangles(o3d.t.geometry.TriangleMesh.from_legacy(mesh))
        return scene.compute_signed_distance(queries, nthreads=threads).numpy()

    return work
