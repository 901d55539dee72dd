"""The measured part of docs/flow.md, and its chart."""

import charts
from text import number, percent, scientific, significant, table, thousands

TARGETS = {10: 0.0015, 16: 0.0008}


def context(data: dict) -> dict:
    """Cases that were not measured are left out of the page."""
    found = {"data": data}
    if "sphere" in data:
        found["sphere"] = sphere(data["sphere"])
    if "fish" in data:
        found["fish"] = fish(data["fish"])
    if "gradient" in data:
        found["gradient"] = gradient(data["gradient"]["rows"])
    if "cost" in data:
        cost = data["cost"]
        found["share"] = cost["geometry"] / cost["forward"]
        found["backward"] = cost["checkpointed"]["seconds"] / cost["forward"]
        found["megabytes"] = [cost[name]["bytes"] / 2**20 for name in ("checkpointed", "stored")]
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
            scientific(row["difference"], 3),
            f"{row['pullback'] / row['difference']:.3f}",
            f"{abs(row['difference']) / largest:.2f}",
        ]
        for row in rows
    ]
    return table(["motion"], ["pullback", "difference", "ratio", "share of the largest"], cells)


def draw(data: dict, folder) -> None:
    if "optimization" not in data:
        return
    rows = data["optimization"]["rows"]
    with charts.figure(folder / "flow-optimization.png", size=(5.5, 3.0)) as (_, axes):
        axes[0, 0].plot([row["drag"] for row in rows], "o-")
        axes[0, 0].set(xlabel="iteration", ylabel="mean force along the flow")
