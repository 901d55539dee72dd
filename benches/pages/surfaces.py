"""docs/surfaces.md."""

from text import number, table

PEER = "PoissonRecon"


def context(data: dict) -> dict:
    methods = list(data["rows"][0]["methods"])
    counts = sorted({row["cells"] for row in data["rows"]})
    return data | {
        "counts": counts,
        "tables": {cells: means(data, cells, methods) for cells in counts},
        "tails": {cells: tails(data, cells, methods) for cells in counts},
        "ratios": ratios(data, counts, methods),
    }


def rows_of(data: dict, cells: int) -> list[dict]:
    return [row for row in data["rows"] if row["cells"] == cells]


def means(data: dict, cells: int, methods: list[str]) -> str:
    rows = [
        [row["shape"], *(" / ".join(map(number, row["methods"][method]["means"])) for method in methods)]
        for row in rows_of(data, cells)
    ]
    return table(["shape"], methods, rows)


def tails(data: dict, cells: int, methods: list[str]) -> str:
    rows = [
        [row["shape"], *(" / ".join(map(number, row["methods"][method]["quantiles"])) for method in methods)]
        for row in rows_of(data, cells)
    ]
    return table(["shape"], methods, rows)


def ratios(data: dict, counts: list[int], methods: list[str]) -> str:
    """Mean and greatest ratio to the peer's mean distance, over both directions of all shapes."""
    rows = []
    for method in methods:
        if method == PEER:
            continue
        row = [method]
        for cells in counts:
            pairs = [
                ours / theirs
                for of in rows_of(data, cells)
                for ours, theirs in zip(of["methods"][method]["means"], of["methods"][PEER]["means"])
            ]
            row.append(f"{number(sum(pairs) / len(pairs))} / {number(max(pairs))}")
        rows.append(row)
    return table(["isograd"], [f"{cells} cells" for cells in counts], rows)
