"""docs/gradients.md."""

import charts
from text import minus, percent, scientific, shape, significant, table, thousands

# Targets: a measured value must not exceed its target, or fall below that of the speedup.
TARGETS = {"relative": 1e-3, "cost": 1.2, "speedup": 20, "fields": 3, "ratio": 0.02, "closed_form": 0.01}
MOTIONS = {
    "along": "translation along x",
    "oblique": "oblique translation",
    "offset": "growth along the normals",
    "scaling": "growth by scaling",
    "bending": "bending",
}
# Paper's weights, area weights, exact normals; the default first.
CHOICES = {
    (False, True, False): "B-spline",
    (False, True, True): "B-spline, exact normals",
    (False, False, False): "B-spline, no area weights",
    (True, True, False): "paper",
    (True, False, False): "paper, no area weights",
}
DEFAULT = next(iter(CHOICES))
FUNCTIONALS = ("volume", "shell")


def choice(row: dict) -> tuple:
    return row["paper_weights"], row["area"], row["exact_normals"]


def ratio(row: dict) -> float:
    """Pullback over differences across a cell."""
    return row["pullback"] / row["differences"]


def relative(row: dict) -> float:
    """Relative difference of the pullback and held differences."""
    return abs(row["pullback"] / row["held"] - 1)


def deviation(row: dict) -> float:
    return abs(ratio(row) - 1)


def closed_form_error(sphere: dict) -> float:
    return max(abs(sphere[name]) for name in ("area", "volume", "phi"))


def verdict(met: bool) -> str:
    return "met" if met else "**not met**"


def context(data: dict) -> dict:
    setting = data["parameters_setting"][0]
    defaults = [row for row in data["ratios"] if choice(row) == DEFAULT]
    finest = max(sphere["cells"] for sphere in data["spheres"])
    pulled = setting["pullback"] + setting["chain"]
    paper = [ratio(row) for row in data["ratios"] if row["paper_weights"] and row["motion"] == "along"]
    largest_residual = max(data["memory"], key=lambda row: row["residual"] / row["field"])
    fields = [largest_residual[name] / largest_residual["field"] for name in ("residual", "work")]
    spheres = [s for s in data["spheres"] if s["cells"] >= 64]
    sphere_error = max(map(closed_form_error, spheres))
    last_error = max(closed_form_error(s) for s in data["spheres"] if s["cells"] == finest)
    worst_parameter = max(data["parameters"], key=relative)
    costs = sorted(data["costs"], key=lambda row: row["ratio"])
    speedup = setting["differences"] / pulled
    return {
        "target": TARGETS,
        "setting": setting,
        "bodies": {row["body"]: row for row in data["costs"]},
        "parameters": data["parameters"],
        "worst_parameter": worst_parameter,
        "relative": relative,
        "costs": costs,
        "cost_name": lambda row: f"{row['body']}, {row['precision']}, {row['threads']} threads",
        "pulled": pulled,
        "speedup": [speedup, setting["differences"] / (pulled + setting["forward"])],
        "fields": [largest_residual, fields[0], sum(fields)],
        "worst_ratios": {
            name: max((row for row in defaults if row["functional"] == name), key=deviation) for name in FUNCTIONALS
        },
        "ratio": ratio,
        "place": lambda row: f"{row['body']}, {MOTIONS[row['motion']]}, {row['draw']} samples",
        "defaults": defaults,
        "beyond": [row for row in defaults if deviation(row) > TARGETS["ratio"]],
        "paper": [min(paper), max(paper)],
        "finest": finest,
        "sphere_errors": [percent(error).lstrip("+") for error in (sphere_error, last_error)],
        "met": {
            "relative": verdict(relative(worst_parameter) <= TARGETS["relative"]),
            "cost": verdict(costs[-1]["ratio"] <= TARGETS["cost"]),
            "speedup": verdict(speedup >= TARGETS["speedup"]),
            "fields": verdict(fields[0] <= TARGETS["fields"]),
            "closed_form": verdict(sphere_error <= TARGETS["closed_form"]),
        },
        "tables": {
            "parameters": parameters(data["parameters"]),
            "seconds": seconds(setting, pulled),
            "cost": cost(data["costs"]),
            "memory": memory(data["memory"]),
            "volume": ratios(data["ratios"], "volume"),
            "shell": ratios(data["ratios"], "shell"),
            "path": path(defaults),
            "spheres": spheres_table(data["spheres"]),
        },
    }


def parameters(rows: list[dict]) -> str:
    columns = ["pullback", "held", "relative difference", "across a cell", "pullback / across", "sign changes"]
    cells = [
        [
            row["name"],
            significant(row["pullback"], 5),
            significant(row["held"], 5),
            scientific(relative(row), 1),
            significant(row["real"], 4),
            f"{row['pullback'] / row['real']:.3f}",
            row["flipped"],
        ]
        for row in rows
    ]
    return table(["parameter"], columns, cells)


def seconds(setting: dict, pulled: float) -> str:
    differences, with_forward = setting["differences"], pulled + setting["forward"]
    rows = [
        [f"central differences: {setting['reconstructions']} reconstructions", significant(differences, 3), ""],
        ["pullback to the parameters", significant(pulled, 3), f"{differences / pulled:.0f}"],
        ["with its reconstruction", significant(with_forward, 3), f"{differences / with_forward:.0f}"],
    ]
    return table(["gradient of L"], ["seconds", "speedup"], rows)


def cost(costs: list[dict]) -> str:
    rows = [
        [f"{row['body']}, {shape(row['shape'])}", row["precision"], row["threads"]]
        + [significant(row["forward"], 3), significant(row["backward"], 3), f"{row['ratio']:.2f}"]
        + [significant(time, 2) for _, time in row["stages"]]
        for row in costs
    ]
    stages = [f"{stage}, s" for stage, _ in costs[0]["stages"]]
    columns = ["threads", "forward, s", "backward, s", "backward / forward"]
    return table(["body", "type"], columns + stages, rows)


def memory(rows: list[dict]) -> str:
    def shown(row: dict, name: str) -> str:
        return f"{row[name] / 1e6:.1f} MB ({row[name] / row['field']:.2f})"

    names = ("residual", "work", "first", "later")
    cells = [
        [row["body"], row["precision"], f"{row['field'] / 1e6:.1f} MB"] + [shown(row, name) for name in names]
        for row in rows
    ]
    columns = ["one field", "residual", "workspace", "first pullback, peak", "later pullbacks, peak"]
    return table(["body", "type"], columns, cells)


def labels(row: dict) -> list[str]:
    return [row["body"], row["draw"], MOTIONS[row["motion"]]]


def three(value: float) -> str:
    return minus(f"{value:.3f}")


def ratios(rows: list[dict], functional: str) -> str:
    groups = {}
    for row in rows:
        if row["functional"] == functional:
            groups.setdefault((row["body"], row["draw"], row["motion"]), {})[choice(row)] = row
    cells = [
        labels(group[DEFAULT]) + [three(ratio(group[c])) for c in CHOICES] for group in groups.values()
    ]
    return table(["body", "samples", "motion"], list(CHOICES.values()), cells)


def path(defaults: list[dict]) -> str:
    pairs = zip(*([row for row in defaults if row["functional"] == name] for name in FUNCTIONALS))
    cells = [
        labels(volume)
        + [three(row["path"] / row["differences"]) for row in (volume, shell)]
        + [thousands(volume["flipped"]), thousands(volume["changed"])]
        for volume, shell in pairs
    ]
    columns = ["volume", "shell", "sign changes", "neighborhood changes"]
    return table(["body", "samples", "motion"], columns, cells)


def spheres_table(spheres: list[dict]) -> str:
    rows = [
        [f"{thousands(s['samples'])} {s['draw']}", s["cells"]] + [percent(s[n]) for n in ("area", "volume", "phi")]
        for s in spheres
    ]
    return table(["samples"], ["cells", "d(area)/dr, %", "d(volume)/dr, %", "mean dφ/dr, %"], rows)


def draw(data: dict, images) -> None:
    draw_parameters(data["parameters"], images / "gradients-parameters.png")
    draw_cost(data["costs"], images / "gradients-cost.png")
    draw_ratios(data["ratios"], images / "gradients-ratios.png")


def draw_parameters(rows: list[dict], path) -> None:
    with charts.figure(path, columns=2) as (drawing, axes):
        for panel, kind in zip(axes[0], ("width", "height")):
            group = [row for row in rows if row["name"].startswith(kind)]
            series = [[row["pullback"] for row in group], [row["held"] for row in group]]
            notes = [scientific(relative(row)) for row in group]
            bars = charts.grouped_bars(panel, [row["name"] for row in group], series, notes)
            panel.set_title(f"{kind}s (above: relative difference)")
        axes[0][0].set_ylabel("∂L/∂p")
        drawing.legend(bars, ["pullback", "held differences"], loc="outside lower center", ncols=2)


def draw_cost(costs: list[dict], path) -> None:
    bodies = list(dict.fromkeys(row["body"] for row in costs))
    with charts.figure(path, columns=len(bodies)) as (drawing, axes):
        for panel, body in zip(axes[0], bodies):
            rows = [row for row in costs if row["body"] == body]
            names = [f"{row['precision']}, {row['threads']} thread{'s' * (row['threads'] > 1)}" for row in rows]
            series = [[row["forward"] for row in rows], [row["backward"] for row in rows]]
            bars = charts.grouped_bars(panel, names, series, [f"{row['ratio']:.2f}" for row in rows])
            panel.set_title(f"{body} (above: backward / forward)")
        axes[0][0].set_ylabel("seconds")
        drawing.legend(bars, ["forward", "backward"], loc="outside lower center", ncols=2)


def draw_ratios(rows: list[dict], path) -> None:
    bodies = list(dict.fromkeys(row["body"] for row in rows))
    shown = (DEFAULT, (True, True, False))
    with charts.figure(path, columns=len(bodies), sharey=True) as (drawing, axes):
        for panel, body in zip(axes[0], bodies):
            series = []
            for wanted in shown:
                fixed = {"body": body, "draw": "random", "functional": "volume"}
                kept = [r for r in rows if choice(r) == wanted and all(r[k] == v for k, v in fixed.items())]
                series.append([ratio(next(r for r in kept if r["motion"] == motion)) for motion in MOTIONS])
            notes = [f"{a:.3f}, {b:.3f}" for a, b in zip(*series)]
            bars = charts.grouped_bars(panel, [name.replace(" ", "\n", 1) for name in MOTIONS.values()], series, notes)
            panel.axhline(1, color=charts.GRAY, linewidth=0.8, linestyle="--")
            panel.set_title(f"{body}, volume, random samples")
        axes[0][0].set_ylabel("pullback / difference across a cell")
        drawing.legend(bars, ["B-spline", "paper's weights"], loc="outside lower center", ncols=2)
