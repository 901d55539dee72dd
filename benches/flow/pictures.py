"""The pictures of docs/flow.md: a film of the fish that swims, and what every point adds to its drag.

    python pictures.py
"""

import io

import isograd
import jax
import matplotlib.pyplot as plt
import numpy as np
from measure import PAGE, Mean, store
from PIL import Image
from swim import Swim

IMAGES = PAGE.parent / "images"


def film(n=48, count=8000, periods=3, frames=32):
    """Vorticity in the plane that the fish swims in, over its last period."""
    swim = Swim(n, count, lengths=(3, 1, 1))
    each = round(swim.fish.values["period"] / swim.tunnel.dt / frames)
    roll = jax.jit(swim.roll)
    state, pictures = swim.tunnel.start(), []
    for k in range(periods * frames):
        points, normals = swim.motion(1 + k * each, each)
        state, _ = roll(state, points, normals)
        if k >= (periods - 1) * frames:
            pictures.append(picture(swim, state, points[-2], normals[-1]))
    first, *rest = pictures
    duration = 2000 // frames
    first.save(IMAGES / "flow-fish.webp", save_all=True, append_images=rest, duration=duration, loop=0, quality=70, method=6)


def picture(swim, state, points, normals):
    """Vorticity in color, and the section of the body in black."""
    u, v = (np.asarray(x) for x in state[:2])
    h, middle = swim.grid.spacing, swim.grid.shape[2] // 2
    vorticity = (np.roll(v, -1, 0) - v - np.roll(u, -1, 1) + u)[:, :, middle] / h
    fine = isograd.Grid(swim.window.lower, h / 4, tuple(4 * cells for cells in swim.window.shape))
    sdf = isograd.reconstruct(points, fine, normals=normals, options=swim.options, surface="1x", checks=False).sdf
    section = sdf.shape[2] // 2
    x, y, _ = np.moveaxis(fine.centers()[:, :, section], -1, 0)
    figure, axes = plt.subplots(figsize=(7.5, 2.6), dpi=80)
    low, high = swim.grid.lower, swim.grid.upper
    extent = (low[0], high[0], low[1], high[1])
    axes.imshow(vorticity.T, "RdBu_r", origin="lower", extent=extent, vmin=-8, vmax=8, interpolation="bilinear")
    axes.contourf(x, y, sdf[:, :, section], levels=[-9, 0], colors="black")
    axes.set(xlim=(0.2, 2.6), ylim=(0.1, 0.9), xticks=[], yticks=[])
    figure.subplots_adjust(0, 0, 1, 1)
    buffer = io.BytesIO()
    figure.savefig(buffer)
    plt.close(figure)
    return Image.open(buffer).convert("RGB")


def drag(n=24, count=50_000, steps=96):
    """Change of the mean drag where the surface grows by a unit volume, at each of all points, from one reverse pass."""
    # Vertices have the velocity of samples within the radius; with a cell of the surface each sample has its share.
    swim = Swim(n, count, lengths=(2, 1, 1), radius=1 / (2 * n))
    points, normals = swim.motion(1, steps)
    _, bar = Mean(swim, steps).slope(points, normals)
    along = np.einsum("tnk,tnk->n", np.asarray(bar)[1:-1], normals) * count / swim.fish.area
    rest, _ = swim.fish.points_at(swim.coordinates)
    figure, axes = plt.subplots(2, 1, figsize=(9, 4.2), dpi=100)
    limit = np.quantile(np.abs(along), 0.97)
    for axis, (row, name) in zip(axes, ((1, "from above"), (2, "from the side"))):
        depth = rest[:, 3 - row]
        shown = np.argsort(depth)
        colors = {"c": along[shown], "cmap": "RdBu_r", "vmin": -limit, "vmax": limit}
        dots = axis.scatter(rest[shown, 0], rest[shown, row], s=2, linewidths=0, **colors)
        axis.set(aspect="equal", xticks=[], yticks=[], frame_on=False)
        axis.set_title(name, fontsize=9, loc="left")
    label = "change of the mean drag per volume added"
    figure.colorbar(dots, ax=axes, label=label, shrink=0.8)
    figure.savefig(IMAGES / "flow-drag.png", bbox_inches="tight")
    plt.close(figure)
    store("drag", {"cells": n, "points": count, "steps": steps})


if __name__ == "__main__":
    film()
    drag()
