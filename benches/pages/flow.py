"""The measured part of docs/flow.md, and its chart."""

from statistics import median

import charts
from text import number, percent, scientific, significant, table, thousands

TARGETS = {10: 0.0015, 16: 0.0008}


def context(data: dict) -> dict:
    """Cases that were not measured are left out of the page."""
    found = {"data": data}
    if "sphere" in data:
        found["sphere"] = sphere(data["sphere"])
    if "oscillation" in data:
        found["oscillation"] = oscillation(data["oscillation"]["rows"])
    if "strouhal" in data:
        rows = data["strouhal"]["rows"]
        found |= {"strouhal": strouhal(rows), "zero": significant(zero(rows), 2)}
    if "fish" in data:
        found["fish"] = fish(data["fish"])
    if "gradient" in data:
        rows = data["gradient"]["rows"]
        largest = max(abs(row["difference"]) for row in rows)
        relevant = [row for row in rows if abs(row["difference"]) > 0.05 * largest]
        ratios = [row["pullback"] / row["difference"] for row in relevant]
        found |= {"gradient": gradient(rows), "relevant": len(ratios), "agreeing": sum(r > 0 for r in ratios)}
        found["close"] = sum(abs(r - 1) < 0.25 for r in ratios)
        found["met"] = sum(abs(r - 1) < 0.02 for r in ratios)
        found["near"] = median(abs(row["pullback"] / row["near"] - 1) for row in relevant)
    if "cost" in data:
        found["cost"] = cost(data["cost"])
    if "optimization" in data:
        drags = [row["drag"] for row in data["optimization"]["rows"]]
        found |= {"fall": 1 - drags[-1] / drags[0], "iterations": len(drags) - 1}
    return found


def sphere(rows: list[dict]) -> str:
    columns = ["Cd from the cloud", "from the closed form", "difference, %", "target, %"]
    cells = [
        [
            f"{row['cells']} cells a diameter, {thousands(row['points'])} points, {row['duration']} diameters traveled",
            f"{row['cloud']:.4f}",
            f"{row['exact']:.4f}",
            percent(row["cloud"] / row["exact"] - 1),
            f"±{100 * TARGETS[row['cells']]:.2g}",
        ]
        for row in rows
    ]
    return table(["sphere at Re 100"], columns, cells)


def oscillation(rows: list[dict]) -> str:
    cells = [
        [row["surface"], percent(row["mean"]), number(100 * row["error"]), number(row["noise"])] for row in rows
    ]
    return table(["surface"], ["mean force, difference in %", "error of the force, %", "noise, ratio"], cells)


def strouhal(rows: list[dict]) -> str:
    cells = [[f"{row['strouhal']:.1f}", significant(row["force"], 3)] for row in rows]
    return table(["St"], ["mean force along the flow"], cells)


def zero(rows: list[dict]) -> float:
    """The Strouhal number of zero force, by linear interpolation between the two around it."""
    for low, high in zip(rows, rows[1:]):
        if low["force"] > 0 >= high["force"]:
            share = low["force"] / (low["force"] - high["force"])
            return low["strouhal"] + share * (high["strouhal"] - low["strouhal"])
    raise ValueError("the force does not change its sign")


def fish(rows: list[dict]) -> str:
    *_, fine = rows
    cells = [
        [
            f"{thousands(row['points'])} points, surface {row['surface']}",
            significant(row["drag"], 4),
            percent(row["drag"] / fine["drag"] - 1),
            percent(row["side"] / fine["side"] - 1),
            number(max(a / b for a, b in zip(row["noise"], fine["noise"]))),
        ]
        for row in rows
    ]
    return table(["fish"], ["mean force along x", "difference, %", "lateral force, rms, %", "noise, ratio"], cells)


def gradient(rows: list[dict]) -> str:
    largest = max(abs(row["difference"]) for row in rows)
    cells = [
        [
            row["name"],
            scientific(row["pullback"], 3),
            *(x for step in ("near", "difference") for x in against(row["pullback"], row[step])),
            f"{abs(row['difference']) / largest:.2f}",
        ]
        for row in rows
    ]
    return table(["motion"], ["pullback", "over 1/10 cell", "ratio", "over a cell", "ratio", "share"], cells)


def against(pullback: float, difference: float) -> list[str]:
    return [scientific(difference, 3), f"{pullback / difference:.3f}"]


def cost(rows: list[dict]) -> str:
    columns = ["geometry, %", "forward and backward, ratio", "memory, MiB", "without checkpoints, MiB"]
    cells = [
        [
            f"{thousands(row['points'])} points",
            number(100 * row["geometry"] / row["forward"]),
            number(row["checkpointed"]["seconds"] / row["forward"]),
            *(number(row[name]["bytes"] / 2**20) for name in ("checkpointed", "stored")),
        ]
        for row in rows
    ]
    return table(["samples"], columns, cells)


def draw(data: dict, folder) -> None:
    if "optimization" not in data:
        return
    rows = data["optimization"]["rows"]
    with charts.figure(folder / "flow-optimization.png", size=(5.5, 3.0)) as (_, axes):
        axes[0, 0].plot([row["drag"] for row in rows], "o-")
        axes[0, 0].set(xlabel="iteration", ylabel="mean force along the flow")
