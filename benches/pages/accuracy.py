"""docs/accuracy.md."""

import math

import charts
from text import number, pair, percent, table, thousands

DRAWS = {"random": "random", "even": "even", "density10": "10:1 density"}
SMOOTHINGS = [None, 0.0]
# Level, smoothing, screening.
LEVELS = [
    ("mean", 0.0, 0.0),
    ("local", None, 0.0),
    ("mean", None, 0.0),
    ("local", 0.0, 0.0),
    ("mean", 0.0, 1.0),
    ("mean", 0.0, 4.0),
    ("local", None, 4.0),
]
# Grid with as many samples in a series with constant samples per cell.
REFERENCE = 128


class Results:
    """Rows of the study, by their settings."""

    def __init__(self, data: dict):
        self.data = data
        self.bodies = [body["body"] for body in data["bodies"]]
        self.cells = sorted({row["cells"] for row in data["rows"]})
        self.middle = self.cells[len(self.cells) // 2]
        self.first = self.bodies[0]
        self.samples = max(row["samples"] for row in data["rows"] if row["normals"] == "exact")

    def row(self, cells: int, body: str | None = None, **settings) -> dict:
        """Results on one grid; settings that are not given have their defaults, the body is the first."""
        wanted = {
            "body": body or self.first,
            "cells": cells,
            "draw": "random",
            "samples": self.samples,
            "normals": "estimated",
            "splat": "bspline",
            "area": True,
            "smoothing": None,
            "screening": 0.0,
            "level": "local",
            "precision": "f32",
        } | settings
        return next(row for row in self.data["rows"] if all(row[name] == value for name, value in wanted.items()))

    def scaled(self, cells: int, body: str | None = None, **settings) -> dict:
        """Results with constant samples per cell."""
        return self.row(cells, body, samples=self.scaled_samples(cells), **settings)

    def scaled_samples(self, cells: int) -> int:
        return self.samples * cells**2 // REFERENCE**2

    def weighted(self, cells: int, draw: str, splat: str, area: bool) -> dict:
        """Results for one choice of the splat, without local level and smoothing."""
        return self.row(
            cells, draw=draw, splat=splat, area=area, normals="exact", level="mean", smoothing=0.0
        )

    def leveled(self, cells: int, level: str, smoothing: float | None, screening: float) -> dict:
        """Results for one combination of level, smoothing and screening."""
        return self.row(cells, normals="exact", level=level, smoothing=smoothing, screening=screening)

    def floor(self, body: str, cells: int) -> dict:
        """Marching cubes of the exact φ."""
        floors = self.data["floors"]
        return next(f["surface"] for f in floors if (f["body"], f["cells"]) == (body, cells))


def vertices(row: dict) -> dict:
    return row["surface"]["vertices"]


def order(coarse: dict, fine: dict) -> float:
    """Observed order of the mean error at the vertices, as a length."""
    lengths = [vertices(row)["mean"] * row["cell"] for row in (coarse, fine)]
    return math.log(lengths[0] / lengths[1]) / math.log(coarse["cell"] / fine["cell"])


def context(data: dict) -> dict:
    results = Results(data)
    return {
        "results": results,
        "bodies": data["bodies"],
        "tables": {
            "surfaces": surfaces(results),
            "fields": fields(results),
            "normals": normals(results),
            "sampling": sampling(results),
            "levels": levels(results),
            "weights": weights(results),
            "gradient": gradient(results),
            "precision": precision(results),
        },
        "pair": pair,
        "vertices": vertices,
        "orders": ", ".join(
            number(order(results.scaled(a), results.scaled(b))) for a, b in zip(results.cells, results.cells[1:])
        ),
        "worst": max(
            (results.row(results.middle, body) for body in results.bodies), key=lambda row: vertices(row)["max"]
        ),
        "precision_difference": bound(
            *(vertices(results.row(results.middle, precision=p))["mean"] for p in ("f32", "f64"))
        ),
    }


def bound(a: float, b: float) -> str:
    """Difference of two numbers: the next power of ten if it is small."""
    difference = abs(a - b)
    bounds = [f"less than 1e{e}" for e in (-6, -5, -4, -3) if difference < 10**e]
    return bounds[0] if bounds else number(difference)


def surfaces(results: Results) -> str:
    rows = []
    for body in results.bodies:
        before = None
        for row in [results.row(n, body) for n in results.cells] + [results.scaled(results.cells[-1], body)]:
            surface, floor = row["surface"], results.floor(body, row["cells"])
            scaled = row["samples"] != results.samples
            rows.append(
                [
                    body,
                    f"{row['cells']}, {thousands(row['samples'])} samples" if scaled else row["cells"],
                    number(row["sample_spacing"]),
                    pair(surface["vertices"]),
                    number(order(before, row)) if before and not scaled else "",
                    pair(surface["faces"]),
                    pair(floor["vertices"]),
                    pair(floor["faces"]),
                    percent(surface["area"]),
                    percent(surface["volume"]),
                ]
            )
            before = row
    columns = ["sample spacing, cells", "vertices", "order", "faces", "exact φ: vertices", "exact φ: faces"]
    return table(["body", "cells"], columns + ["area, %", "volume, %"], rows)


def fields(results: Results) -> str:
    rows = []
    for body in results.bodies:
        cases = [results.row(n, body) for n in results.cells]
        rows.append(
            [body] + [pair(row["band"]) for row in cases] + [pair(row["field"]["gradient"]) for row in cases]
        )
    columns = [f"{name}, {n} cells" for name in ("φ", "∇φ") for n in results.cells]
    return table(["body"], columns, rows)


def normals(results: Results) -> str:
    rows = []
    for body in results.bodies:
        cells = [body]
        for draw in DRAWS:
            errors = results.row(results.cells[0], body, draw=draw)["normal_errors"]
            degrees = errors["degrees"]
            cells += [f"{pair_p99(degrees)}", number(100 * errors["wrong_signs"])]
        rows.append(cells)
    columns = [column for draw in DRAWS.values() for column in (draw, "wrong signs, %")]
    return table(["body"], columns, rows)


def pair_p99(spread: dict) -> str:
    return " / ".join(number(spread[name]) for name in ("mean", "p99", "max"))


def over_grids(results: Results, labels: list[str], rows: list) -> str:
    """Errors of the vertices on all grids; a row is its labels and a function of the cells."""
    cells = [row[:-1] + [pair(vertices(row[-1](n))) for n in results.cells] for row in rows]
    return table(labels, [f"{n} cells" for n in results.cells], cells)


def width(smoothing: float | None) -> str:
    return "auto" if smoothing is None else f"{smoothing:g}"


def sampling(results: Results) -> str:
    rows = [
        [name, kind, width(s), lambda n, d=draw, k=kind, s=s: results.row(n, draw=d, normals=k, smoothing=s)]
        for draw, name in DRAWS.items()
        for kind in ("exact", "estimated")
        for s in SMOOTHINGS
    ]
    for draw in ("random", "even"):
        name = f"{draw}, constant per cell"
        rows.append([name, "estimated", "auto", lambda n, d=draw: results.scaled(n, draw=d)])
    return over_grids(results, ["samples", "normals", "smoothing"], rows)


def levels(results: Results) -> str:
    rows = []
    for level, smoothing, screening in LEVELS:
        cases = [results.leveled(n, level, smoothing, screening) for n in results.cells]
        errors = [pair(vertices(row)) for row in cases] + [pair(row["band"]) for row in cases]
        rows.append([level, width(smoothing), f"{screening:g}"] + errors)
    columns = [f"{n} cells" for n in results.cells] + [f"φ, {n} cells" for n in results.cells]
    return table(["level", "smoothing", "screening"], columns, rows)


def weights(results: Results) -> str:
    rows = [
        [name, splat, "on" if area else "off", lambda n, d=draw, s=splat, a=area: results.weighted(n, d, s, a)]
        for draw, name in DRAWS.items()
        for splat in ("bspline", "paper")
        for area in (True, False)
    ]
    return over_grids(results, ["samples", "splat", "area"], rows)


def gradient(results: Results) -> str:
    rows = []
    for body in results.bodies:
        for n in results.cells:
            field = results.row(n, body)["field"]
            slopes = [field[where][what] for where in ("slope_all", "slope_near") for what in ("mean", "p05", "p95")]
            rows.append([body, n] + [f"{slope:.4f}" for slope in slopes])
    return table(["body", "cells"], ["all: mean", "5 %", "95 %", "near: mean", "5 %", "95 %"], rows)


def precision(results: Results) -> str:
    rows = []
    for name in ("f32", "f64"):
        row = results.row(results.middle, precision=name)
        surface, degrees = row["surface"], row["normal_errors"]["degrees"]
        errors = [surface["vertices"], surface["faces"], row["band"], row["field"]["gradient"], degrees]
        rows.append([name] + [pair(e) for e in errors] + [percent(surface[m]) for m in ("area", "volume")])
    return table(["type"], ["vertices", "faces", "φ", "∇φ", "normals", "area, %", "volume, %"], rows)


def draw(data: dict, images) -> None:
    results = Results(data)
    draw_convergence(results, images / "accuracy-convergence.png")
    draw_weights(results, images / "accuracy-weights.png")
    draw_gradient(results, images / "accuracy-gradient.png")


def draw_convergence(results: Results, path) -> None:
    cells = results.cells
    with charts.figure(path, columns=3) as (_, axes):
        fixed, scaled, per_cell = axes[0]
        for panel, row in ((fixed, results.row), (scaled, results.scaled)):
            for body in results.bodies:
                panel.plot(cells, [vertices(row(n, body))["mean"] / n for n in cells], "o-", label=body)
            exact = [results.floor(results.first, n)["vertices"]["mean"] / n for n in cells]
            panel.plot(cells, exact, "k--", linewidth=1, label=f"{results.first}, exact φ")
            for power in (1, 2):
                line = [5e-3 * (cells[0] / n) ** power for n in cells]
                panel.plot(cells, line, ":", color=charts.GRAY, linewidth=1)
                panel.annotate(f"order {power}", (cells[-2], line[-2]), (3, 3), textcoords="offset points", color=charts.GRAY)
            panel.set(ylim=(1.5e-6, 1e-2), ylabel="mean |error of the zero set| / longest side")
        fixed.set_title(f"{thousands(results.samples)} random samples")
        scaled.set_title("constant number of random samples per cell")
        fixed.legend(loc="lower left")
        for color, (draw, name) in enumerate(DRAWS.items()):
            for smoothing, style in ((None, "o-"), (0.0, "o--")):
                values = [vertices(results.row(n, draw=draw, smoothing=smoothing))["mean"] for n in cells]
                label = name if smoothing is None else f"{name}, no smoothing"
                per_cell.plot(cells, values, style, color=charts.COLORS[color], label=label)
        per_cell.set(title=f"{results.first}, {thousands(results.samples)} samples")
        per_cell.set(ylabel="mean |error of the zero set|, cells")
        per_cell.legend()
        for panel in axes[0]:
            charts.log_axes(panel, cells)
            panel.set_xlabel("cells on the longest side")
        charts.label(per_cell.yaxis, [0.004, 0.006, 0.01, 0.02])


def draw_weights(results: Results, path) -> None:
    with charts.figure(path, columns=3, sharey=True) as (_, axes):
        for panel, (draw, name) in zip(axes[0], DRAWS.items()):
            for color, splat in enumerate(("bspline", "paper")):
                for area, style in ((True, "o-"), (False, "o--")):
                    values = [vertices(results.weighted(n, draw, splat, area))["mean"] for n in results.cells]
                    label = f"{splat}, area {'on' if area else 'off'}"
                    panel.plot(results.cells, values, style, color=charts.COLORS[color], label=label)
            charts.log_axes(panel, results.cells)
            panel.set(title=f"{results.first}, samples: {name}", xlabel="cells on the longest side")
        axes[0][0].set_ylabel("mean |error of the zero set|, cells")
        axes[0][0].legend()


def draw_gradient(results: Results, path) -> None:
    histograms = results.data["histograms"]
    with charts.figure(path, columns=2, sharey=True) as (_, axes):
        for panel, where in zip(axes[0], ("all", "near")):
            for histogram in histograms:
                low, high = histogram["bins"]
                shares = histogram[where]
                step = (high - low) / len(shares)
                edges = [low + step * i for i in range(len(shares) + 1)]
                panel.stairs([share / step for share in shares], edges, label=histogram["body"], linewidth=1.4)
            panel.set(yscale="log", ylim=(1e-4, 2e2), xlim=(0, 1.25), xlabel="|∇φ|")
        cells = histograms[0]["cells"]
        axes[0][0].set(title=f"all cells, {cells} on the longest side", ylabel="probability density")
        axes[0][1].set_title("cells with |φ| < 3h")
        axes[0][0].legend(loc="upper left")
