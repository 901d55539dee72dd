"""A reconstruction and its gradient on the first NVIDIA device, with the wheel of the kit."""

import numpy as np

import isograd

points = np.random.default_rng(1).normal(size=(5000, 3)).astype(np.float32)
points /= np.linalg.norm(points, axis=1, keepdims=True)
grid = isograd.Grid.fit(points, 48)
cpu = isograd.Reconstructor(grid)(points)
device = isograd.Reconstructor(grid, backend="cuda")(points)
assert np.allclose(device.sdf, cpu.sdf, atol=1e-4)
assert np.isfinite(device.pullback(sdf=device.sdf).points).all()
print(device.backend)
