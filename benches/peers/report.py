"""docs/peers.json, from which benches/pages renders the page."""

import json
import os
import platform
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path

PACKAGES = [
    "libigl",
    "open3d",
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
    """Description of the machine."""
    return {
        "processor": processor(),
        "cores": os.cpu_count(),
        "system": f"{platform.system()} {platform.machine()}",
        "load_average": os.getloadavg()[0],
        "versions": {"Python": platform.python_version()} | installed(),
    }


def installed() -> dict:
    """Versions of the installed packages."""
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


def write(cases, repeats: int, path: Path) -> None:
    path.parent.mkdir(parents=True, exist_ok=True)
    about = machine() | {"repeats": repeats}
    path.write_text(json.dumps(as_data(cases, about), indent=1) + "\n")


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
