"""docs/large.md."""

from text import significant, table


# Stages of a reconstruction without checks.
FORWARD = ["normals", "orient", "splat", "poisson", "isosurface", "distance"]


def context(data: dict) -> dict:
    rows = [
        [row["name"]]
        + [significant(row[key], 3) for key in ("seconds", "cpu")]
        + [significant(row["bytes"] / 1e9, 3)]
        + [significant(mean, 2) for mean in row["means"]]
        for row in data["rows"]
    ]
    columns = ["seconds", "CPU seconds", "peak, GB", "surface to truth", "truth to surface"]
    isograd = data["rows"][0]
    stages = [[name, significant(seconds, 3)] for name, seconds in isograd["stages"].items()]
    return {
        "about": data["about"],
        "machine": data["machine"],
        "shape": isograd["shape"],
        "depth": data["rows"][1]["depth"],
        "forward": sum(isograd["stages"][name] for name in FORWARD),
        "checks": isograd["stages"]["checks"],
        "others": [row["others"] for row in data["rows"]],
        "table": table([""], columns, rows),
        "stages": table(["stage"], ["seconds"], stages),
    }
