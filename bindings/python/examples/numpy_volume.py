"""A loss in φ, and its gradient in every point: move the points downhill with NumPy alone.

The loss asks a bumpy sphere for its volume: a solver would give the slope of drag in φ in the same place.
"""

import numpy as np

import isograd


def soft_volume(sdf, spacing):
    """Volume with an edge two cells wide, and its derivative in φ."""
    inside = 1 / (1 + np.exp(sdf / spacing))
    return inside.sum() * spacing**3, -inside * (1 - inside) * spacing**2


def main():
    sphere = isograd.sample("sphere", 4000, radius=0.5).points
    points = sphere * (1 + 0.1 * np.sin(6 * sphere).prod(axis=1, keepdims=True))
    grid = isograd.Grid.fit(points, 40, padding=0.2)
    plan = isograd.Reconstructor(grid)
    wanted = 4 / 3 * np.pi * 0.55**3
    volume = 0.0

    for step in range(20):
        result = plan(points)
        volume, slope = soft_volume(result.sdf, grid.spacing)
        print(f"step {step:2}: volume {volume:.5f}, wanted {wanted:.5f}")
        if abs(volume / wanted - 1) < 1e-6:
            break
        gradient = result.pullback(slope).points
        # Newton's step along the gradient: the volume is nearly linear in it.
        points = points - (volume - wanted) / (gradient**2).sum() * gradient

    assert abs(volume / wanted - 1) < 1e-6, volume


if __name__ == "__main__":
    main()
