"""docs/peers.md."""

import charts


def context(data: dict) -> dict:
    return data | {"table": table}


def table(case: dict) -> str:
    per_item = case["count"] > 1
    lines = [
        f"| | type | threads | seconds |{' ns per ' + case['per'] + ' |' if per_item else ''} ratio |",
        f"|---|---|--:|--:|{'--:|' if per_item else ''}--:|",
    ]
    for entry in case["entries"]:
        item = f" {entry['median'] / case['count'] * 1e9:,.1f} |" if per_item else ""
        ratio = "" if is_ours(entry) else f"**{entry['median'] / ours(case, entry)['median']:.3g}**"
        lines.append(
            f"| {entry['name']} | {entry['type']} | {entry['threads']} | {entry['median']:.4g} |{item} {ratio} |"
        )
    return "\n".join(lines)


def is_ours(entry: dict) -> bool:
    return entry["name"] == "isograd"


def ours(case: dict, entry: dict) -> dict:
    """Our entry with the same number type, if there is one, and the same number of threads."""
    every = [other for other in case["entries"] if is_ours(other)]
    same_type = [other for other in every if other["type"] == entry["type"]] or every
    same_threads = [other for other in same_type if other["threads"] == entry["threads"]]
    return (same_threads or same_type)[-1]


def draw(data: dict, images) -> None:
    """One bar for each entry, one panel for each case."""
    cases = data["cases"]
    heights = [0.7 + 0.26 * len(case["entries"]) for case in cases]
    options = {"height_ratios": [1 + 0.4 * len(case["entries"]) for case in cases]}
    with charts.figure(images / "peers.png", rows=len(cases), size=(8, sum(heights)), **options) as (_, axes):
        for panel, case in zip(axes[:, 0], cases):
            entries = case["entries"]
            names = [f"{e['name']}, {e['type']}, {e['threads']} thr." for e in entries]
            colors = [charts.COLORS[0] if is_ours(e) else "#b8b8b8" for e in entries]
            bars = panel.barh(names, [e["median"] for e in entries], color=colors)
            panel.bar_label(bars, [f"{e['median']:.3g} s" for e in entries], padding=3, fontsize=7)
            panel.set_title(case["title"], fontsize=9, loc="left")
            panel.margins(x=0.15)
            panel.invert_yaxis()
            panel.tick_params(labelsize=7)
            panel.grid(axis="y", visible=False)
