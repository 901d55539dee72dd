"""Measures the page docs/flow.md: `python measure.py [CASE...]` writes docs/flow.json, all cases unless some are named.

Every case is a function below. Bodies come from clouds of their points, found anew at every step.
"""

import json
import statistics
import sys
import time
from pathlib import Path

import isograd
import jax
import jax.numpy as jnp
import numpy as np
import optax
from isograd import immersed
from swim import AMPLITUDE, SPEED, Swim, Tunnel

import flow_sphere

PAGE = Path(__file__).resolve().parents[2] / "docs/flow.json"
FREE = [*(f"width{k}" for k in range(1, 7)), *(f"height{k}" for k in range(1, 9))]


def sphere():
    """Drag at Re 100: cells a diameter, points, duration."""
    rows = []
    for n, count, duration in ((10, 500, 12), (10, 1000, 12), (16, 500, 4), (16, 2000, 4)):
        from_cloud, from_closed_form = flow_sphere.main(Tunnel, n, count, duration)
        rows.append({"cells": n, "points": count, "duration": duration, "cloud": from_cloud, "exact": from_closed_form})
    return rows


def oscillation(n=16, count=2000, steps=160, surfaces=("2x", "4x")):
    """Force on a sphere that moves along a line askew to the grid, beside that of its closed form."""
    grid = isograd.Grid((0.0, 0.0, 0.0), 1 / n, (4 * n, 3 * n, 3 * n))
    tunnel = Tunnel(grid, 0.01, 0.3 / n)
    cloud = isograd.sample("sphere", count, layout="even", dtype=np.float32).points
    cloud = jnp.asarray(0.5 * cloud / np.linalg.norm(cloud, axis=1, keepdims=True))
    way, rate = jnp.array([0.24, 0.28, 0.155]), 0.4 * np.pi

    def center(t):
        return jnp.array([1.4, 1.513, 1.493]) + way * jnp.sin(rate * t), way * rate * jnp.cos(rate * t)

    def sampled(t, surface):
        place, velocity = center(t)
        velocity = jnp.broadcast_to(velocity, cloud.shape)
        options = isograd.Options(orient="signs", surface=surface)
        return immersed.staggered(cloud + place, velocity, grid, normals=2 * cloud, options=options)

    def exact(t):
        place, velocity = center(t)
        away = [x - place for x in immersed.positions(grid)]
        far = [jnp.linalg.norm(a, axis=-1) for a in away]
        moving = tuple(jnp.broadcast_to(velocity, a.shape) for a in away)
        return immersed.Body(tuple(d - 0.5 for d in far), tuple(a / d[..., None] for a, d in zip(away, far)), moving)

    def force(body):
        times = tunnel.dt * jnp.arange(1, steps + 1)
        _, (found, _) = jax.lax.scan(lambda s, t: tunnel.step(s, body(t)), tunnel.start(), times)
        return np.asarray(found)[20:]

    wanted, rows = force(exact), []
    for surface in surfaces:
        ours = force(lambda t: sampled(t, surface))
        error = np.sqrt(np.mean((ours - wanted) ** 2)) / wanted[:, 1].std()
        rows.append({"surface": surface, "mean": float(ours[:, 0].mean() / wanted[:, 0].mean() - 1), "error": float(error),
                     "noise": float(noise(ours).max() / noise(wanted).max())})
    return {"cells": n, "points": count, "rows": rows}


def noise(force):
    """The part of a force that changes from step to step: of its fourth differences, as for white noise."""
    return np.diff(force, 4, axis=0).std(0) / np.sqrt(70.0)


def fish(n=40):
    """Forces of the swimming fish over a period with default settings, and with more samples and finer surfaces."""
    rows = []
    for count, surface in ((4000, "2x"), (16000, "2x"), (4000, "4x"), (16000, "4x"), (64000, "4x")):
        swim = Swim(n, count, lengths=(2, 1, 1), surface=surface)
        steps = round(swim.fish.values["period"] / swim.tunnel.dt)
        _, force = jax.jit(swim.roll)(swim.tunnel.start(), *swim.motion(1, steps))
        force = np.asarray(force)[10:]
        rows.append({"points": count, "surface": surface, "cells": n, "drag": float(force[:, 0].mean()),
                     "side": float(force[:, 1].std()), "noise": noise(force)[:2].tolist()})
    return rows


def strouhal(n=32, count=4000, duration=2.5, numbers=(0.6, 1.2, 1.8, 2.4)):
    """Mean force on the fish against its Strouhal number, which the period of the tail sets, and where the force is 0."""
    rows = []
    for number in numbers:
        period = 2 * AMPLITUDE / (number * SPEED)
        swim = Swim(n, count, lengths=(2, 1, 1), courant=0.25 / max(1, np.pi * number), period=period)
        steps, periods = round(period / swim.tunnel.dt), round(duration / period)
        state, roll = swim.tunnel.start(), jax.jit(swim.roll)
        for k in range(max(2, periods)):
            state, force = roll(state, *swim.motion(1 + k * steps, steps))
        rows.append({"strouhal": number, "force": float(force[:, 0].mean()), "steps": steps * max(2, periods)})
        print(rows[-1], flush=True)
    return {"cells": n, "points": count, "rows": rows}


def cost():
    """Seconds of a step, of its geometry, and of the gradient through all steps; bytes with and without checkpoints."""
    return [cost_of(count) for count in (1000, 4000)]


def cost_of(count, n=40, steps=8):
    swim = Swim(n, count, lengths=(2.4, 1, 1))
    points, normals = map(jnp.asarray, swim.motion(1, steps))
    start = swim.tunnel.start()

    def drag(points, step):
        return jnp.mean(swim.roll(start, points, normals, step)[1][:, 0])

    def geometry(points):
        bodies = jax.lax.scan(lambda _, x: (0.0, sum(p.sum() for p in swim.body(x[0], 0 * x[0], x[1]).sdf)), 0.0,
                              (points[1:-1], normals))
        return bodies[1].sum()

    kept = jax.checkpoint(swim.step)
    found = {"cells": n, "points": count, "steps": steps, "grid": list(swim.grid.shape), "window": list(swim.window.shape)}
    found["forward"] = seconds(jax.jit(lambda p: drag(p, None)), points)
    found["geometry"] = seconds(jax.jit(geometry), points)
    for name, step in (("checkpointed", kept), ("stored", swim.step)):
        function = jax.jit(jax.value_and_grad(lambda p: drag(p, step))).lower(points).compile()
        found[name] = {"seconds": seconds(function, points), "bytes": function.memory_analysis().temp_size_in_bytes}
    return found


def seconds(function, argument, repeats=5):
    jax.block_until_ready(function(argument))
    taken = []
    for _ in range(repeats):
        begin = time.perf_counter()
        jax.block_until_ready(function(argument))
        taken.append(time.perf_counter() - begin)
    return statistics.median(taken)


class Mean:
    """Mean drag of the fish, of the later three quarters of the steps, and its cotangents of the points at all times."""

    def __init__(self, swim, steps):
        self.swim, self.steps = swim, steps
        step = jax.checkpoint(swim.step)

        def drag(points, normals):
            _, force = swim.roll(swim.tunnel.start(), points, normals, step)
            return jnp.mean(force[steps // 4 :, 0])

        self.value, self.slope = jax.jit(drag), jax.jit(jax.value_and_grad(drag))


def gradient(n=24, count=3000, steps=200):
    """Derivatives of the mean drag in parameters and along random smooth motions, and differences over two steps."""
    swim = Swim(n, count, lengths=(2, 1, 1))
    mean = Mean(swim, steps)
    points, normals = swim.motion(1, steps)
    value, bar = mean.slope(points, normals)
    bar, rows = np.asarray(bar, np.float64), []
    for name, way in ways(swim, steps, points):
        way = way * (0.5 * swim.grid.spacing / np.linalg.norm(way, axis=-1).max())
        row = {"name": name, "pullback": float(np.sum(bar * way))}
        for step, size in (("near", 0.1), ("difference", 1.0)):  # in half cells
            ends = [float(mean.value((points + s * size * way).astype(np.float32), normals)) for s in (-1, 1)]
            row[step] = (ends[1] - ends[0]) / (2 * size)
        rows.append(row)
        print(rows[-1], flush=True)
    return {"cells": n, "points": count, "steps": steps, "drag": float(value), "finite": bool(np.isfinite(bar).all()),
            "rows": rows}


def ways(swim, steps, points):
    """Motions of all points at all times: by parameters, and random smooth ones of the body."""
    for name in (*FREE, "amplitude"):
        by = 1e-4 * swim.fish.values[name]
        ends = [swim.motion(1, steps, {name: swim.fish.values[name] + s * by})[0].astype(float) for s in (-1, 1)]
        yield name, (ends[1] - ends[0]) / (2 * by)
    random = np.random.default_rng(1)
    rest = points[0] - swim.place
    for k in range(20):
        waves, phases = random.normal(size=(3, 3, 3)) * 4, random.uniform(0, 2 * np.pi, (3, 3))
        yield f"random {k + 1}", np.broadcast_to(np.sin(np.einsum("nj,kaj->nka", rest, waves) + phases).sum(1), points.shape)


def optimization(n=24, count=3000, steps=200, iterations=12):
    """Descent of the mean drag in 14 parameters of the body at fixed volume, by one reverse pass a step."""
    swim = Swim(n, count, lengths=(2, 1, 1))
    mean = Mean(swim, steps)
    start = np.array([swim.fish.values[name] for name in FREE])
    volume = swim.fish.volume

    def shape(logarithms):
        values = dict(zip(FREE, start * np.exp(logarithms)))
        scale = volume / swim.fish.replace(**values).volume
        return values | {name: value * scale for name, value in values.items() if name.startswith("width")}

    adam, place, rows = optax.adam(0.03), np.zeros(len(FREE)), []
    state = adam.init(place)
    for _ in range(iterations + 1):
        values = shape(place)
        points, normals = swim.motion(1, steps, values)
        drag, bar = mean.slope(points, normals)
        rows.append({"drag": float(drag), "volume": swim.fish.replace(**values).volume, "values": values})
        print(rows[-1]["drag"], flush=True)
        slope = sum(
            np.array([pulled[name] for name in FREE])
            for time, part in zip(swim.times(1, steps), np.asarray(bar))
            for pulled in [swim.at(time, values).pullback(swim.coordinates, part)]
        )
        ends = [[shape(place + way) for way in s * 1e-4 * np.eye(len(FREE))] for s in (1, -1)]
        jacobian = [[(up[name] - down[name]) / 2e-4 for name in FREE] for up, down in zip(*ends)]
        slope = np.array(jacobian) @ slope
        update, state = adam.update(slope, state)
        place = place + np.asarray(update)
    return {"cells": n, "points": count, "steps": steps, "rows": rows}


CASES = {function.__name__: function for function in (sphere, oscillation, fish, strouhal, cost, gradient, optimization)}


def store(name, found):
    """Puts the results of a case into docs/flow.json."""
    data = json.loads(PAGE.read_text(encoding="utf-8")) if PAGE.exists() else {}
    PAGE.write_text(json.dumps(data | {name: found}, indent=1) + "\n", encoding="utf-8")


def main(names):
    for name in names or CASES:
        print(name, flush=True)
        store(name, CASES[name]())


if __name__ == "__main__":
    main(sys.argv[1:])
