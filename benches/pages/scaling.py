"""docs/scaling.md."""

import math

import charts
from text import significant, table, thousands

# Minimum bytes that a stage reads and writes, per point and per cell, in single precision.
TRAFFIC = {
    # Points in, normals and areas out.
    "normals": (28, 0),
    # Axes in, normals and confidence out.
    "orient": (28, 0),
    # Samples in, a field out.
    "splat": (28, 4),
    # A field in, a field out.
    "poisson": (0, 8),
    # A field in.
    "isosurface": (0, 4),
    # A field in for the signs; φ and the closest faces out.
    "distance": (0, 12),
}


def cells(size: dict) -> int:
    return math.prod(size["shape"])


def points(size: dict) -> int:
    return size["points"]


def exponent(sizes: list[dict], x, y) -> float:
    """Exponent of the power law y = c xᵏ that fits best: least squares of the logarithms."""
    logarithms = [(math.log(x(size)), math.log(y(size))) for size in sizes]
    mean = [sum(column) / len(sizes) for column in zip(*logarithms)]
    offsets = [(a - mean[0], b - mean[1]) for a, b in logarithms]
    return sum(a * b for a, b in offsets) / sum(a * a for a, _ in offsets)


def context(data: dict) -> dict:
    def power(sizes, x, name):
        return significant(exponent(sizes, x, lambda size: size[name]), 2)

    def slope(sizes, x, name):
        """Bytes of one more cell or point, from the two largest sizes."""
        a, b = sizes[-2:]
        return significant((b[name] - a[name]) / (x(b) - x(a)), 2)

    series = {"cells": cells, "points": points}
    return {
        "powers": {k: {n: power(data[k], x, n) for n in ("forward", "backward")} for k, x in series.items()},
        "last_powers": {k: power(data[k][-2:], x, "forward") for k, x in series.items()},
        "bytes": {
            k: [slope(data[k], x, f"{n}_bytes") for n in ("forward", "backward")] for k, x in series.items()
        },
        "fish": data["fish"][0],
        "copy": data["copy_bytes_per_second"][0],
        "tables": {
            "cells": sizes_table(data["cells"]),
            "points": sizes_table(data["points"]),
            "stages": stages_table(data["fish"][0], data["copy_bytes_per_second"][0]),
        },
    }


def sizes_table(sizes: list[dict]) -> str:
    rows = [
        [
            "×".join(map(str, size["shape"])),
            thousands(size["points"]),
            significant(size["forward"], 3),
            significant(size["backward"], 3),
            significant(1e9 * size["forward"] / cells(size), 3),
            significant(1e6 * size["forward"] / size["points"], 3),
            significant(size["forward_bytes"] / 2**20, 3),
            significant(size["backward_bytes"] / 2**20, 3),
        ]
        for size in sizes
    ]
    columns = ["points", "forward, s", "backward, s", "ns per cell", "µs per point", "forward, MiB"]
    return table(["cells"], columns + ["with the pullback, MiB"], rows)


def stages_table(fish: dict, copy: float) -> str:
    rows = []
    for stage, seconds in fish["stages"]:
        per_point, per_cell = TRAFFIC[stage]
        traffic = per_point * fish["points"] + per_cell * cells(fish)
        shown = [significant(seconds, 3), thousands(traffic), significant(traffic / copy, 2)]
        rows.append([stage] + shown + [significant(seconds * copy / traffic, 2)])
    return table(["stage"], ["seconds", "minimum bytes", "seconds at copy speed", "ratio"], rows)


def draw(data: dict, images) -> None:
    rows = [("cells", data["cells"], cells), ("points", data["points"], points)]
    with charts.figure(images / "scaling.png", rows=2, columns=2, size=(13, 8.6)) as (_, axes):
        for (time, memory), (name, sizes, x) in zip(axes, rows):
            places = [x(size) for size in sizes]
            time.plot(places, [size["forward"] for size in sizes], "o-", label="forward")
            time.plot(places, [size["backward"] for size in sizes], "o-", label="backward")
            for stage in ("poisson", "distance", "orient"):
                time.plot(places, [dict(size["stages"])[stage] for size in sizes], "o--", linewidth=1, label=stage)
            for key, label in (("forward_bytes", "forward"), ("backward_bytes", "with the pullback")):
                memory.plot(places, [size[key] / 2**20 for size in sizes], "o-", label=label)
            time.set(title=f"time against {name}", ylabel="seconds")
            memory.set(title=f"memory against {name}", ylabel="peak, MiB")
            for panel in (time, memory):
                charts.log_axes(panel)
                panel.set_xlabel(name)
                panel.legend()
