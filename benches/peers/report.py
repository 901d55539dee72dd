"""docs/peers.md, docs/peers.json and docs/images/peers.png."""

import json
import os
import platform
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt  # noqa: E402

PACKAGES = [
    "libigl",
    "open3d-cpu",
    "warp-lang",
    "pymeshlab",
    "pysdf",
    "scikit-image",
    "jax",
    "scipy",
    "numpy",
]


def machine() -> dict:
    """What the figures were measured on."""
    return {
        "processor": processor(),
        "cores": os.cpu_count(),
        "system": f"{platform.system()} {platform.machine()}",
        "load_average": os.getloadavg()[0],
        "versions": {"Python": platform.python_version()} | installed(),
    }


def installed() -> dict:
    """Versions of the packages that are there."""
    versions = {}
    for package in PACKAGES:
        try:
            versions[package] = version(package)
        except PackageNotFoundError:
            continue
    return versions


def processor() -> str:
    info = Path("/proc/cpuinfo")
    if info.exists():
        for line in info.read_text().splitlines():
            if line.startswith("model name"):
                return line.split(":", 1)[1].strip()
    return platform.processor()


def write(cases, repeats: int, docs: Path, command: str) -> None:
    (docs / "images").mkdir(parents=True, exist_ok=True)
    about = machine() | {"repeats": repeats}
    (docs / "peers.json").write_text(json.dumps(as_data(cases, about), indent=1) + "\n")
    (docs / "peers.md").write_text(page(cases, about, command))
    picture(cases, docs / "images" / "peers.png")


def as_data(cases, about: dict) -> dict:
    return {
        "machine": about,
        "cases": [
            {
                "title": case.title,
                "what": case.what,
                "per": case.per[0],
                "count": case.per[1],
                "checks": case.checks,
                "entries": [
                    {
                        "name": entry.name,
                        "type": entry.dtype,
                        "threads": entry.threads,
                        "seconds": entry.seconds,
                        "median": entry.median,
                    }
                    for entry in case.entries
                ],
            }
            for case in cases
        ],
    }


def page(cases, about: dict, command: str) -> str:
    versions = ", ".join(f"{name} {number}" for name, number in about["versions"].items())
    lines = [
        "# Beside other libraries",
        "",
        f"Made by `{command}`, which installs the peers from PyPI and runs everything in one go. "
        f"Times are medians of {about['repeats']} runs after one that is not counted; the entries of a "
        "table run in turn (A, B, C, A, B, C, …). All data is in memory at the start and at the end. "
        "Every raw time is in [peers.json](peers.json).",
        "",
        f"{about['processor']}, {about['cores']} cores, {about['system']}; load average at the end "
        f"{about['load_average']:.1f}. {versions}.",
        "",
        "“Times ours” is the peer's time over that of isograd with the same number type (where both have it) "
        "and number of threads. Warp's CPU kernels, scikit-image and PyMeshLab run on one thread.",
        "",
        "![Times of isograd and its peers](images/peers.png)",
    ]
    for case in cases:
        lines += table(case)
    return "\n".join(lines) + "\n"


def table(case) -> list[str]:
    unit, count = case.per
    per_item = f" ns a {unit} |" if count > 1 else ""
    rule = "--:|" if count > 1 else ""
    lines = ["", f"## {case.title}", "", case.what[0].upper() + case.what[1:] + ".", ""]
    lines.append(f"| | type | threads | seconds |{per_item} times ours |")
    lines.append(f"|---|---|--:|--:|{rule}--:|")
    for entry in case.entries:
        item = f" {entry.median / count * 1e9:,.1f} |" if count > 1 else ""
        ratio = "" if entry.ours else f"**{times_ours(case, entry):.3g}**"
        lines.append(
            f"| {entry.name} | {entry.dtype} | {entry.threads} | {entry.median:.4g} |{item} {ratio} |"
        )
    return lines + [""] + [f"- {check}" for check in case.checks]


def times_ours(case, entry) -> float:
    return entry.median / case.ours(entry.dtype, entry.threads).median


def picture(cases, path: Path) -> None:
    """One bar an entry, one panel a case."""
    figure, panels = plt.subplots(
        len(cases),
        1,
        figsize=(8, sum(0.7 + 0.26 * len(case.entries) for case in cases)),
        height_ratios=[1 + 0.4 * len(case.entries) for case in cases],
        layout="constrained",
        squeeze=False,
    )
    for panel, case in zip(panels[:, 0], cases):
        names = [f"{e.name}, {e.dtype}, {e.threads} thr." for e in case.entries]
        colors = ["#1b6ca8" if e.ours else "#b8b8b8" for e in case.entries]
        bars = panel.barh(names, [e.median for e in case.entries], color=colors)
        panel.bar_label(bars, [f"{e.median:.3g} s" for e in case.entries], padding=3, fontsize=7)
        panel.set_title(case.title, fontsize=9, loc="left")
        panel.margins(x=0.15)
        panel.invert_yaxis()
        panel.tick_params(labelsize=7)
        panel.spines[["top", "right"]].set_visible(False)
    figure.savefig(path, dpi=120)
    plt.close(figure)
