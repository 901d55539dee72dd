"""The table on the first screen of README.md."""

from statistics import mean

import gradients
from text import line, number, scientific

SOURCES = ["surfaces", "peers", "gradients"]
CELLS = 128
OURS, PEER = "default", "PoissonRecon"


def context(data: dict) -> dict:
    rows = [row["methods"] for row in data["surfaces"]["rows"] if row["cells"] == CELLS]
    whole, distance = (case(data["peers"], title) for title in ("Whole pipeline", f"Distance, {CELLS}³ cells"))
    costs = [row["ratio"] for row in data["gradients"]["costs"]]
    relative = max(map(gradients.relative, data["gradients"]["parameters"]))
    cells = [
        ["surface → truth, mean", f"**{accuracy(rows, OURS)}** cells", f"{accuracy(rows, PEER)}", "none"],
        ["truth → surface, 99.9 % within", f"**{tail(rows, OURS)}** cells", f"{tail(rows, PEER)}", "none"],
        ["time, points → φ", "**1**", times(whole, "Open3D chain"), "none"],
        ["time, mesh → φ", "**1**", times(distance, "Open3D RaycastingScene"), times(distance, "Warp mesh query, CPU")],
        [
            "gradients",
            f"whole chain, {scientific(relative)} from differences, in {min(costs):.1f}–{max(costs):.1f} of the time of points → φ",
            "none",
            "of single kernels",
        ],
    ]
    return {"cells": CELLS, "shapes": len(rows), "rows": "\n".join(map(line, cells))}


def accuracy(rows: list[dict], method: str) -> str:
    return number(mean(row[method]["means"][0] for row in rows))


def tail(rows: list[dict], method: str) -> str:
    return number(mean(row[method]["quantiles"][1] for row in rows))


def case(peers: dict, title: str) -> dict:
    return next(case for case in peers["cases"] if case["title"].startswith(title))


def times(case: dict, name: str) -> str:
    """Time of another library over that of isograd with its number of threads; both with float32."""
    other = next(found for found in case["entries"] if found["name"] == name)
    same = ("isograd", other["type"], other["threads"])
    ours = next(found for found in case["entries"] if (found["name"], found["type"], found["threads"]) == same)
    return f"{other['median'] / ours['median']:.0f}"
