"""D-PCA normals and area weights with Warp's hash grid and the same sums."""

import numpy as np
import warp as wp

import torus
from case import Case, peer
from stage import stages, write_input

# ε over the radius, as in isograd.
GUARD = 0.2


@wp.kernel
def warp_normals(
    grid: wp.uint64,
    points: wp.array(dtype=wp.vec3),
    radius: float,
    guard: float,
    out: wp.array(dtype=wp.vec3),
    areas: wp.array(dtype=float),
):
    # Neighboring threads take neighboring points, as recommended by Warp's manual.
    i = wp.hash_grid_point_id(grid, wp.tid())
    x = points[i]
    total = float(0.0)
    density = float(0.0)
    first = wp.vec3()
    second = wp.mat33()
    query = wp.hash_grid_query(grid, x, radius)
    j = int(0)
    while wp.hash_grid_query_next(query, j):
        d = points[j] - x
        r = wp.length(d)
        if r <= radius:
            w = 1.0 / (r + guard)
            total += w
            rise = 1.0 - r * r / (radius * radius)
            density += rise * rise
            first += w * d
            second += w * wp.outer(d, d)
    m = first / total
    vectors, values = wp.eig3(second / total - wp.outer(m, m))
    least = wp.argmin(values)
    out[i] = wp.vec3(vectors[0, least], vectors[1, least], vectors[2, least])
    areas[i] = wp.pi * radius * radius / (3.0 * density)


def case(stack, program, folder, count: int, threads: int) -> Case:
    """Each entry gets points and a radius and returns normals and areas: its grid or index counts."""
    folder = folder / f"normals-{count}"
    points, truth = torus.samples(count)
    points = points.astype(np.float32)
    area = 4 * np.pi**2 * torus.MAJOR * torus.MINOR
    radius = float(np.sqrt(24 * area / (np.pi * count)))
    write_input(folder, {"radius": radius}, points=points)
    ours = stages(stack, program, "normals", folder, threads)
    entries = [stage.entry("normals") for stage in ours]
    entries.append(peer("Warp hash grid, CPU", "float32", 1, warp(points, radius)))

    def check() -> list[str]:
        mine = entries[0].result().reshape(-1, 3)
        theirs, their_areas = entries[-1].result()
        areas = ours[0].result("areas")
        return [
            f"isograd: {degrees(mine, truth)} from the true axis",
            f"Warp: {degrees(theirs, truth)} from the true axis",
            f"isograd and Warp: {degrees(mine, theirs)} apart",
            f"areas add up to {areas.sum() / area:.4f} and {their_areas.sum() / area:.4f} of the torus",
        ]

    title = f"D-PCA and areas, {count:,} points"
    what = "neighbors within a radius (24 at the mean), weighted sums, least eigenvector, area"
    return Case(title, what, ("point", count), entries, check)


def degrees(a: np.ndarray, b: np.ndarray) -> str:
    """Median angle between two sets of axes."""
    cross = np.linalg.norm(np.cross(a.astype(np.float64), b.astype(np.float64)), axis=1)
    angle = np.degrees(np.arcsin(np.clip(cross, 0, 1)))
    return f"{np.median(angle):.2g}° at the median"


def warp(points, radius):
    positions = wp.array(points, dtype=wp.vec3, device="cpu")
    out = wp.zeros(len(points), dtype=wp.vec3, device="cpu")
    areas = wp.zeros(len(points), dtype=float, device="cpu")
    grid = wp.HashGrid(128, 128, 128, device="cpu")

    def work():
        grid.build(positions, radius)
        inputs = [grid.id, positions, radius, GUARD * radius, out, areas]
        wp.launch(warp_normals, len(points), inputs, device="cpu")
        return out.numpy(), areas.numpy()

    return work
