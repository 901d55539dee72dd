"""The body of every comparison: a torus, R = 0.7, r = 0.25, in a cube of side 2.4."""

import numpy as np

MAJOR, MINOR, HALF = 0.7, 0.25, 1.2


def grid(cells: int) -> dict:
    """Settings of a cubic grid of `cells`³."""
    return {"shape": [cells] * 3, "lower": [-HALF] * 3, "spacing": 2 * HALF / cells}


def centers(cells: int) -> np.ndarray:
    """(cells³, 3) centers of the cells, in C order."""
    axis = -HALF + 2 * HALF / cells * (np.arange(cells) + 0.5)
    return np.stack(np.meshgrid(axis, axis, axis, indexing="ij"), axis=-1).reshape(-1, 3)


def distance(points: np.ndarray) -> np.ndarray:
    """Exact signed distance."""
    ring = np.hypot(points[:, 0], points[:, 1]) - MAJOR
    return np.hypot(ring, points[:, 2]) - MINOR


def samples(count: int, seed: int = 1) -> tuple[np.ndarray, np.ndarray]:
    """Points uniform by area, and their outward normals."""
    random = np.random.default_rng(seed)
    around, tube, keep = random.uniform(0, 1, (3, 4 * count))
    tube = 2 * np.pi * tube
    # Accepted in proportion to the circumference at that angle of the tube.
    tube = tube[keep * (MAJOR + MINOR) < MAJOR + MINOR * np.cos(tube)][:count]
    around = 2 * np.pi * around[:count]
    outward = np.stack(
        [np.cos(tube) * np.cos(around), np.cos(tube) * np.sin(around), np.sin(tube)], axis=1
    )
    ring = np.stack([np.cos(around), np.sin(around), np.zeros(count)], axis=1)
    return MAJOR * ring + MINOR * outward, outward
