"""Figures on pages that are written by hand: each sentence must be there as the JSON of a measured page gives it."""

import json
from pathlib import Path

import gradients


def differentiable(docs: Path) -> list[str]:
    """Sentences of docs/differentiable.md."""
    data = read(docs, "gradients")
    defaults = [row for row in data["ratios"] if gradients.choice(row) == gradients.DEFAULT]
    target = gradients.TARGETS["ratio"]
    met = sum(gradients.deviation(row) <= target for row in defaults)
    moved = gradients.ratio(max(defaults, key=gradients.deviation))
    parameter = max(data["parameters"], key=lambda row: abs(row["pullback"] / row["real"] - 1))
    costs = [row["ratio"] for row in data["costs"]]
    return [
        f"agrees with the change of smooth losses to {target:.0%} in {met} of {len(defaults)} cases".replace("%", " %"),
        f"the pullback is {moved:.2f} of the change across a cell for a motion of the whole body",
        f"{parameter['pullback'] / parameter['real']:.2f} for a single parameter ({parameter['name']}",
        f"where {parameter['flipped']} normals change sides",
        f"A pullback takes {min(costs):.1f} to {max(costs):.1f} of a reconstruction",
    ]


CLAIMS = {"differentiable": differentiable}


def missing(docs: Path) -> list[str]:
    """A line for each sentence that a page lacks."""
    lines = []
    for name, sentences in CLAIMS.items():
        page = " ".join((docs / f"{name}.md").read_text(encoding="utf-8").split())
        lines += [f"docs/{name}.md must say \"{text}\"" for text in sentences(docs) if text not in page]
    return lines


def read(docs: Path, name: str) -> dict:
    return json.loads((docs / f"{name}.json").read_text(encoding="utf-8"))
