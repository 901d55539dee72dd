"""docs/orientation.md."""

import statistics
from pathlib import Path

import charts
import numpy as np
from text import significant, table, thousands

FAMILIES = {
    "real": "Real shapes",
    "sampled": "Built-in shapes with different samplings",
    "degraded": "Holes, noise and outliers",
    "thin": "Close sheets",
    "rounded": "Rounded coordinates",
    "lines": "Scan lines, so many times as far apart as their samples",
    "joined": "Cavities, touching bodies, open surfaces",
    "parts": "Parts with sharp edges",
}
# Share of wrong signs that counts as solved, in percent.
SOLVED = 0.5
# Samples of the picture, which the measurement leaves here.
SAMPLES = Path(__file__).resolve().parents[2] / "target/pages/orientation"
CLOUDS = ["airliner", "wing 0.02", "knot holes", "vessels noise 0.005", "hemisphere"]
METHODS = {"auto": "auto", "parity": "parity (the paper's method)"}


def context(data: dict) -> dict:
    rows, steps = data["rows"], data["steps"]
    following = [step for step in steps if step["follows"]]
    families = {}
    for family, title in FAMILIES.items():
        if members := [row for row in rows if row["family"] == family]:
            families[title] = family_table(members)
    return {
        "rows": rows,
        "families": families,
        "confidence": confidence_table(data["classes"], rows),
        "sure": sure(rows),
        "solved_limit": SOLVED,
        "solved": {m: sum(row[m]["wrong"] <= SOLVED for row in rows) for m in METHODS},
        "has_real": any(row["family"] == "real" for row in rows),
        "slowest": significant(max(row["time"] for row in rows), 2),
        "steps": len(steps) - 1,
        "following": len(following),
        "worst_step": share(max(step["wrong"] for step in steps)),
        "turned": max(step["turned"] for step in following),
        "time": significant(statistics.median_high(step["time"] for step in following), 2),
    }


def by_confidence(rows: list[dict]) -> np.ndarray:
    """Evaluated and wrong signs of all these clouds, in each class of confidence."""
    return np.sum([row["auto"]["by_confidence"] for row in rows], axis=0)


def is_noisy(row: dict) -> bool:
    return row["auto"]["lower_bound"] is not None


def confidence_table(classes: list[float], rows: list[dict]) -> str:
    groups = [[row for row in rows if not is_noisy(row)], [row for row in rows if is_noisy(row)]]
    counts = [by_confidence(rows) for rows in groups]
    bounds = [*classes[1:], None]
    cells = []
    for k, (low, high) in enumerate(zip(classes, bounds)):
        name = f"at least {low:g}" if high is None else f"{low:g} to {high:g}"
        cells.append([name])
        for count in counts:
            number, wrong = count[k]
            cells[-1] += [f"{100 * number / count[:, 0].sum():.2f}", significant(100 * wrong / number, 2) if wrong else "0"]
    columns = ["clean: signs, %", "wrong of these, %", "noisy: signs, %", "wrong of these, %"]
    return table(["confidence"], columns, cells)


def sure(rows: list[dict]) -> dict:
    """Of the signs of the highest class, and of the wrong ones, what the text says."""
    counts = by_confidence(rows)
    worst = max(rows, key=lambda row: row["auto"]["by_confidence"][-1][1])
    return {
        "share": f"{100 * counts[-1, 0] / counts[:, 0].sum():.0f}",
        "wrong": significant(100 * counts[-1, 1] / counts[-1, 0], 2),
        "caught": f"{100 * counts[0, 1] / counts[:, 1].sum():.0f}",
        "worst": worst["cloud"],
        "most": worst["auto"]["by_confidence"][-1][1],
    }


def share(percent: float) -> str:
    return f"{percent:.2f}" if percent else "0"


def family_table(rows: list[dict]) -> str:
    cells = []
    for row in rows:
        auto = row["auto"]
        # The last one of equal reasons.
        reason, most = max(reversed(auto["reasons"]), key=lambda entry: entry[1])
        cells.append(
            [
                row["cloud"],
                thousands(row["points"]),
                share(auto["wrong"]),
                "" if auto["lower_bound"] is None else share(auto["lower_bound"]),
                share(row["parity"]["wrong"]),
                f"{auto['axis_mean']:.1f}",
                f"{auto['axis_mean_narrow']:.1f}",
                share(auto["doubtful"]),
                reason if most > 0 else "",
                "" if auto["caught"] is None else f"{auto['caught']:.0f}",
                significant(row["time"], 2),
            ]
        )
    columns = ["points", "auto", "lower bound", "parity", "axis", "narrow", "doubtful", "main reason", "caught", "time"]
    return table(["cloud"], columns, cells)


def draw(data: dict, images) -> None:
    """Draws the samples of the last measurement; without them the committed picture stays."""
    if not SAMPLES.is_dir():
        print("SKIPPED images/orientation.png: its samples are made by `cargo xtask orientation`")
        return
    errors = {row["cloud"]: row for row in data["rows"] if row["family"] != "real"}
    path = images / "orientation.png"
    with charts.figure(path, len(CLOUDS), len(METHODS), size=(13, 2.7 * len(CLOUDS))) as (drawing, axes):
        for row, cloud in zip(axes, CLOUDS):
            for panel, method in zip(row, METHODS):
                entry = errors[cloud][method]
                draw_cloud(panel, np.fromfile(SAMPLES / f"{cloud}.{method}.f32", "<f4").reshape(-1, 7))
                panel.set_xlabel(f"{cloud}: {entry['wrong']:.2f} % wrong, {entry['doubtful']:.2f} % doubtful")
        for panel, title in zip(axes[0], METHODS.values()):
            panel.set_title(title)
        handles, labels = axes[0][0].get_legend_handles_labels()
        drawing.legend(handles, labels, loc="outside upper left", ncols=3, markerscale=6)


def draw_cloud(panel, samples: np.ndarray) -> None:
    """Visible samples in an orthographic view, colored by their signs; samples on the far side are hidden."""
    azimuth, elevation = np.radians(-60), np.radians(25)
    toward = np.array([np.cos(elevation) * np.cos(azimuth), np.cos(elevation) * np.sin(azimuth), np.sin(elevation)])
    right = np.array([-np.sin(azimuth), np.cos(azimuth), 0.0])
    up = np.cross(toward, right)
    samples = samples[samples[:, 3:6] @ toward > 0]
    points, signs = samples[:, :3], samples[:, 6]
    for sign, (name, color, size) in enumerate(
        [("right", "#a9b6c3", 0.8), ("doubtful", "#eda81f", 1.5), ("wrong", "#cc1a29", 1.5)]
    ):
        shown = points[signs == sign]
        panel.scatter(shown @ right, shown @ up, s=size, c=color, linewidths=0, label=name, rasterized=True)
    panel.set(aspect="equal", xticks=[], yticks=[])
    panel.spines[:].set_visible(False)
    panel.grid(visible=False)
