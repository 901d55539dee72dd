"""The generated part of docs/gpu.md."""

import math

from scaling import exponent
from text import table, thousands

# Fields that a stage reads and writes at least.
FIELDS = {"splat": 1, "poisson": 2, "isosurface": 1, "distance": 3}


def cells(size: dict) -> int:
    return math.prod(size["shape"])


def context(data: dict) -> dict:
    large = [size for size in data["cells"] if cells(size) >= 128**3 and size["both"]]
    return {"driver": None, "conformance": None, "sanitizer": None, "wheel": None} | data | {
        "cell_count": cells(data["fish"]),
        "power": exponent(large, cells, lambda size: size["both"]) if len(large) > 1 else None,
        "tables": {
            "stages": stages(data["fish"], data["bytes_per_second"]),
            "cells": sizes_table(data["cells"]),
            "points": sizes_table(data["points"]),
        },
    }


def stages(fish: dict, bandwidth: float | None) -> str:
    rows = []
    for name, seconds in fish["stages"]:
        share = 4 * FIELDS.get(name, 0) * cells(fish) / bandwidth / seconds
        rows.append([name, f"{1e3 * seconds:.3f}", f"{share:.2f}" if share else ""])
    return table(["stage"], ["ms", "share of that bandwidth"], rows)


def sizes_table(sizes: list[dict]) -> str:
    rows = [
        [
            "×".join(map(str, size["shape"])),
            thousands(size["points"]),
            f"{1e3 * size['forward']:.2f}",
            f"{1e3 * size['both']:.2f}",
            f"{size['bytes'] / cells(size):.0f}",
            size["forward_effort"]["launches"] + size["backward_effort"]["launches"],
            size["forward_effort"]["waits"] + size["backward_effort"]["waits"],
        ]
        for size in sizes
    ]
    columns = ["points", "forward, ms", "forward and backward, ms", "bytes per cell", "kernels", "waits"]
    return table(["cells"], columns, rows)
