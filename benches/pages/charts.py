"""Style and helpers of the charts."""

from contextlib import contextmanager
from pathlib import Path

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt  # noqa: E402
from matplotlib.ticker import FixedLocator, NullFormatter, NullLocator  # noqa: E402

# Distinguishable with color vision deficiencies.
COLORS = ["#1f5ca6", "#d95f0e", "#2b8c47", "#8c4099", "#b81f2e"]
GRAY = "#8a8a8e"

plt.rcParams.update(
    {
        "axes.prop_cycle": plt.cycler(color=COLORS),
        "axes.grid": True,
        "axes.axisbelow": True,
        "axes.spines.top": False,
        "axes.spines.right": False,
        "axes.titlesize": 11,
        "axes.labelsize": 10,
        "font.size": 9,
        "grid.color": "#e4e4e8",
        "grid.linewidth": 0.7,
        "legend.frameon": False,
        "lines.markersize": 4.5,
    }
)


@contextmanager
def figure(path: Path, rows: int = 1, columns: int = 1, size=(13, 4.6), **options):
    """Axes of a figure that is written to `path` at the end."""
    drawing, axes = plt.subplots(rows, columns, figsize=size, layout="constrained", squeeze=False, **options)
    yield drawing, axes
    # No software version in the file, so that the same chart has the same bytes.
    drawing.savefig(path, dpi=120, metadata={"Software": None})
    plt.close(drawing)


def log_axes(panel, ticks=None, vertical: str = "log") -> None:
    """A logarithmic x axis with labels at `ticks`, and a y axis."""
    panel.set_xscale("log")
    panel.set_yscale(vertical)
    panel.xaxis.set_minor_formatter(NullFormatter())
    if ticks:
        label(panel.xaxis, ticks)


def label(axis, ticks: list[float]) -> None:
    """Replaces the ticks of an axis."""
    axis.set_major_locator(FixedLocator(ticks))
    axis.set_major_formatter(lambda value, _: f"{value:g}")
    axis.set_minor_locator(NullLocator())


def grouped_bars(panel, groups: list[str], series: list[list[float]], notes: list[str]) -> list:
    """Bars side by side for each group, with a note above each."""
    width = 0.76 / len(series)
    bars = []
    for k, values in enumerate(series):
        places = [i + (k - 0.5 * (len(series) - 1)) * width for i in range(len(groups))]
        bars.append(panel.bar(places, values, width))
    for i, note in enumerate(notes):
        top = max(0, *(values[i] for values in series))
        panel.annotate(note, (i, top), xytext=(0, 3), textcoords="offset points", ha="center", fontsize=7.5)
    panel.set_xticks(range(len(groups)), groups)
    panel.grid(axis="x", visible=False)
    panel.axhline(0, color="#333333", linewidth=0.8)
    panel.margins(y=0.12)
    return bars
