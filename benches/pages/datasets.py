"""docs/datasets.md."""

from statistics import fmean

from text import significant, table, thousands

HOUR = 3600
# Cores of a usual machine.
CORES = 64


def context(data: dict) -> dict:
    rows, costs = [], []
    for row in data["rows"]:
        estimated, given = (fmean(row["seconds"][way]) for way in ("estimated", "given"))
        # Of each cloud in turn, so that other load cancels.
        ratio = fmean(a / b for a, b in zip(row["seconds"]["estimated"], row["seconds"]["given"]))
        rates = [thousands(rounded(HOUR / seconds)) for seconds in (estimated, given)]
        hours = [thousands(rounded(1e6 * seconds / HOUR)) for seconds in (estimated, given)]
        rows.append([thousands(row["samples"]), *rates, significant(ratio, 2), *hours])
        costs.append((row["samples"], 1e6 * estimated / HOUR))
    columns = ["estimated normals", "given normals", "ratio", "10⁶ clouds, estimated", "given"]
    middle = costs[len(costs) // 2]
    return {
        "machine": data["machine"],
        "cells": data["cells"],
        "shapes": data["shapes"],
        "seeds": data["seeds"],
        "table": table(["samples"], columns, rows),
        "samples": middle[0],
        "hours": rounded(middle[1]),
        "parallel": rounded(middle[1] / CORES),
        "cores": CORES,
    }


def rounded(value: float) -> float:
    """To two digits: the load of the machine changes the third."""
    return float(f"{value:.2g}")
