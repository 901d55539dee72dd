"""Marching cubes of one field: isograd and scikit-image."""

import numpy as np
from skimage.measure import marching_cubes, mesh_surface_area

import torus
from case import Case, peer
from stage import stages, write_input


def case(stack, program, folder, cells: int, threads: int) -> Case:
    """Each entry gets the field and returns vertices and faces."""
    folder = folder / f"isosurface-{cells}"
    field = torus.distance(torus.centers(cells)).astype(np.float32).reshape([cells] * 3)
    write_input(folder, torus.grid(cells), chi=field)
    ours = stages(stack, program, "isosurface", folder, threads)
    theirs = peer("scikit-image, Lewiner", "float32", 1, scikit_image(field, cells))

    def check() -> list[str]:
        vertices = ours[0].result("vertices").reshape(-1, 3)
        faces = ours[0].result("faces", np.uint32).reshape(-1, 3).astype(np.int64)
        return [
            f"isograd: {shown(vertices, faces)}",
            f"scikit-image: {shown(*theirs.result()[:2])}",
        ]

    title = f"Marching cubes, {cells}³ cells"
    what = (
        "vertices and faces at a level; isograd names the edge that each vertex lies on as well, "
        "scikit-image a normal and a value for each vertex"
    )
    entries = [stage.entry("vertices") for stage in ours] + [theirs]
    return Case(title, what, ("cell", cells**3), entries, check)


def scikit_image(field, cells):
    spacing = [2 * torus.HALF / cells] * 3
    return lambda: marching_cubes(field, 0.0, spacing=spacing)


def shown(vertices: np.ndarray, faces: np.ndarray) -> str:
    true = 4 * np.pi**2 * torus.MAJOR * torus.MINOR
    area = mesh_surface_area(vertices.astype(np.float64), faces) / true - 1
    return f"{len(vertices):,} vertices, {len(faces):,} faces, area {100 * area:+.3f} % off the torus"
