"""Moves raw points until their signed distance field is that of a sphere, with an optimizer of PyTorch.

    python torch_points.py

The points start on a bumpy body. No parameters, no mesh: the loss is a field, and its gradient reaches every
point. φ has no slope along the surface, so points only move across it, and stay spread as they are.
"""

import numpy as np
import torch

import isograd
from isograd.torch import signed_distance

RADIUS = 1.0
STEPS = 30


def bumpy_sphere(count: int) -> torch.Tensor:
    """Points whose distance from the origin is 15 % off, up and down."""
    points = isograd.sample("sphere", count).points
    x, y, z = points.T
    bumps = 1.0 + 0.15 * np.sin(4.0 * x) * np.cos(3.0 * y + z)
    return torch.from_numpy(RADIUS * points / np.linalg.norm(points, axis=1)[:, None] * bumps[:, None])


def roughness(points: torch.Tensor) -> float:
    """Root mean square of how far the points are from the sphere."""
    return float((points.detach().norm(dim=1) - RADIUS).square().mean().sqrt())


def main() -> None:
    points = bumpy_sphere(800).requires_grad_()
    grid = isograd.Grid.fit(points.detach().numpy(), 32)
    centers = torch.from_numpy(grid.centers())
    target = centers.norm(dim=-1) - RADIUS

    # The radius of the neighborhoods stays what it was at the start: the loss is then smoother. Nothing evens out what
    # single points do: the loss should see it.
    options = isograd.Options(radius=0.3, smoothing=0, level="mean")
    # Plain descent: Adam would give all points steps of the same size, and scatter them.
    optimizer = torch.optim.SGD([points], lr=6.0, momentum=0.5)
    start, losses = roughness(points), []
    for step in range(STEPS):
        optimizer.zero_grad()
        # An integral over the grid: in the limit it does not depend on the size of the cells.
        difference = signed_distance(points, grid, options=options) - target
        loss = difference.square().sum() * grid.spacing**3
        loss.backward()
        optimizer.step()
        losses.append(loss.item())
        if step % 10 == 0 or step == STEPS - 1:
            print(f"step {step:3d}   loss {losses[-1]:.3e}   off the sphere by {roughness(points):.4f}")

    assert losses[-1] < losses[0] / 1000, "the field should be that of the sphere"
    assert roughness(points) < start / 8, "the points should lie on the sphere"


if __name__ == "__main__":
    main()
