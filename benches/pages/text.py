"""Numbers, tables and paragraphs in Markdown."""

import math
import re
import textwrap

WIDTH = 118
# A space that lines are not broken at.
FIXED = "\x00"


def number(value: float) -> str:
    """Two or three significant digits, but at most four decimals: 0.0132, 0.28, 5.6, 28."""
    size = abs(value)
    if size == 0:
        return "0"
    return minus(f"{value:.{0 if size >= 10 else 1 if size >= 1 else 2 if size >= 0.1 else 4}f}")


def significant(value: float, digits: int) -> str:
    """Significant digits, but no fewer than those before the decimal point: 0.03812, 3818."""
    if value == 0 or not math.isfinite(value):
        return number(value)
    before = math.floor(math.log10(abs(value))) + 1
    return minus(f"{value:.{max(digits - before, 0)}f}")


def percent(relative: float) -> str:
    """A relative error in percent, with its sign."""
    value = 100 * relative
    return minus(f"{value:+.{3 if abs(value) < 0.095 else 2}f}")


def scientific(value: float, decimals: int = 0) -> str:
    """4e-5."""
    mantissa, exponent = f"{value:.{decimals}e}".split("e")
    return f"{mantissa}e{int(exponent)}"


def thousands(value: float) -> str:
    """50,000."""
    return f"{int(value):,}"


def shape(cells: list[int]) -> str:
    """338 × 120 × 151."""
    return " × ".join(map(str, cells))


def minus(text: str) -> str:
    return text.replace("-", "−")


def pair(spread: dict) -> str:
    """Mean and maximum."""
    return f"{number(spread['mean'])} / {number(spread['max'])}"


def table(labels: list[str], columns: list[str], rows: list[list]) -> str:
    """A table whose first columns are labels and whose other columns are numbers."""
    rules = ["---"] * len(labels) + ["--:"] * len(columns)
    lines = [line(labels + columns), f"|{'|'.join(rules)}|"]
    return "\n".join(lines + [line(row) for row in rows])


def line(cells: list) -> str:
    return f"| {' | '.join(str(cell).replace('|', chr(92) + '|') for cell in cells)} |"


def reflow(page: str) -> str:
    """Wraps paragraphs and list items; headings, tables, images, comments and code stay as they are."""
    lines, block, in_code = [], [], False

    def flush():
        if block:
            item = block[0].startswith("- ")
            joined = " ".join(part.strip() for part in block)
            # No line break before a unit, around ×, or within code.
            joined = re.sub(r" (?=[%×])|(?<=×) |`[^`]*`", lambda m: m[0].replace(" ", FIXED), joined)
            indent = "  " if item else ""
            options = {"break_long_words": False, "break_on_hyphens": False}
            wrapped = textwrap.wrap(joined, WIDTH, subsequent_indent=indent, **options)
            lines.extend(row.replace(FIXED, " ") for row in wrapped)
            block.clear()

    for row in page.split("\n"):
        fence = row.startswith("```")
        if fence or in_code or not row.strip() or row[0] in "|#!<":
            flush()
            lines.append(row.rstrip())
            in_code ^= fence
        else:
            if row.startswith("- "):
                flush()
            block.append(row)
    flush()
    return "\n".join(lines).rstrip("\n") + "\n"
