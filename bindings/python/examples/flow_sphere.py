"""Drag of a sphere at Re 100 from a cloud of its points, beside that of its closed form on the same grid.

    pip install "isograd[jax]" jax-cfd==0.2.1 && python flow_sphere.py [CELLS_PER_DIAMETER [POINTS [DURATION]]]

The box is 6.4 × 4.8 × 4.8 diameters, periodic, so that drag is above that of a sphere alone.
"""

import json
import sys
from typing import Any

import isograd
import jax
import jax.numpy as jnp
import numpy as np
from isograd import immersed


def main(host: Any, n: int = 6, count: int = 1000, duration: float = 0.6) -> tuple[float, float]:
    grid = isograd.Grid((0.0, 0.0, 0.0), 1 / n, (round(6.4 * n), round(4.8 * n), round(4.8 * n)))
    tunnel = host(grid, 0.01, 0.35 / n)
    center = np.array([1.92, 2.413, 2.393])
    sphere = isograd.sample("sphere", count, dtype=np.float32).points
    sphere = 0.5 * sphere / np.linalg.norm(sphere, axis=1, keepdims=True) + center.astype(np.float32)
    options = isograd.Options(surface="2x")
    cloud = jax.jit(lambda p: immersed.staggered(p, jnp.zeros_like(p), grid, tunnel.offsets, options=options))(sphere)
    away = [x - center for x in immersed.positions(grid, tunnel.offsets)]
    far = [jnp.linalg.norm(a, axis=-1) for a in away]
    normal = tuple(a / d[..., None] for a, d in zip(away, far))
    exact = immersed.Body(tuple(d - 0.5 for d in far), normal, tuple(0 * a for a in away))

    @jax.jit
    def drag(body):
        steps = round(duration / tunnel.dt)
        _, (force, _) = jax.lax.scan(lambda s, _: tunnel.step(s, body), tunnel.start(), length=steps)
        return force[-5:, 0].mean() / (0.5 * np.pi / 4)

    from_cloud, from_closed_form = float(drag(cloud)), float(drag(exact))
    print(f"{n} cells a diameter, {count} points, time {duration}: Cd {from_cloud:.5f} from the cloud, "
          f"{from_closed_form:.5f} from the closed form, {from_cloud / from_closed_form - 1:+.3%}")
    assert 0.5 < from_closed_form < 4 and abs(from_cloud / from_closed_form - 1) < 0.02
    return from_cloud, from_closed_form


if __name__ == "__main__":
    from flow_host.jax_cfd_tunnel import Tunnel

    main(Tunnel, *(json.loads(x) for x in sys.argv[1:]))
