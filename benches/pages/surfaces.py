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
        "noise_tables": {noise: noise_table(data, noise) for noise in noises(data)},
        "noise_ratios": noise_ratios(data),
        "outlier_shapes": len({row["shape"] for row in data["with_outliers"]}),
        "outlier_table": outlier_table(data),
        "outlier_counts": outlier_counts(data),
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


def noises(data: dict) -> list[float]:
    return sorted({row["noise"] for row in data["noisy"]})


def noise_table(data: dict, noise: float) -> str:
    """Mean distances in both directions, and the first quantile."""
    rows = [row for row in data["noisy"] if row["noise"] == noise]
    methods = list(rows[0]["methods"])

    def cell(of: dict) -> str:
        return " / ".join(map(number, of["means"])) + ", " + number(of["quantiles"][0])

    return table(["shape"], methods, [[row["shape"], *(cell(row["methods"][m]) for m in methods)] for row in rows])


def noise_ratios(data: dict) -> str:
    """Ratio of our mean distances to those of each peer, mean over the shapes, in both directions."""
    peers = [name for name in data["noisy"][0]["methods"] if name != "default"]
    rows = []
    for noise in noises(data):
        found = [row["methods"] for row in data["noisy"] if row["noise"] == noise]
        row = [f"{100 * noise:g} %"]
        for peer in peers:
            both = [[of["default"]["means"][k] / of[peer]["means"][k] for of in found] for k in (0, 1)]
            row.append(" / ".join(number(sum(ratios) / len(ratios)) for ratios in both))
        rows.append(row)
    return table(["noise"], peers, rows)


def by_share(data: dict) -> dict[float, dict[str, dict]]:
    """Methods of each shape, by the share of outliers."""
    found: dict[float, dict[str, dict]] = {}
    for row in data["with_outliers"]:
        found.setdefault(row["share"], {})[row["shape"]] = row["methods"]
    return found


def outlier_table(data: dict) -> str:
    """Our mean distances in both directions."""
    found = by_share(data)
    names = [f"{100 * share:g} %" for share in found]
    rows = [
        [shape, *(" / ".join(map(number, of[shape]["default"]["means"])) for of in found.values())] for shape in found[0.0]
    ]
    return table(["shape"], names, rows)


def outlier_counts(data: dict) -> str:
    """Of how many shapes the mean distances are at most twice those without outliers, by method."""
    found = by_share(data)
    clean = found.pop(0.0)

    def is_whole(of: dict, shape: str, method: str) -> bool:
        pairs = zip(of[shape][method]["means"], clean[shape][method]["means"])
        return all(after <= 2 * before for after, before in pairs)

    methods = list(next(iter(clean.values())))
    rows = [
        [f"{100 * share:g} %", *(sum(is_whole(of, shape, method) for shape in of) for method in methods)]
        for share, of in found.items()
    ]
    return table(["outliers"], methods, rows)


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
