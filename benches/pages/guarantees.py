"""The generated part of docs/guarantees.md."""

from text import table, thousands

# Rows of the summary, in the words of the page.
NAMES = {
    "killed": "signals at random moments",
    "full disk": "a disk that fills up",
    "standard output": "a full or closed standard output",
    "bad input": "mutated, missing and unreadable files",
}


def context(data: dict) -> dict:
    parts = data["parts"]
    readers = [
        [row["name"], *counts(row), f"{row['memory_ratio']:.0f}", f"{row['ns_per_byte']:.0f}"]
        for row in parts["readers"]
    ]
    runs = [[NAMES[row["name"]], thousands(row["inputs"]), thousands(row["failures"])] for row in parts["program"]]
    return data | {
        "inputs": {name: sum(row["inputs"] for row in rows) for name, rows in parts.items()},
        "failures": sum(row["failures"] for rows in parts.values() for row in rows),
        "tables": {
            "readers": table(
                ["reader"], ["inputs", "accepted", "failures", "largest memory, bytes per byte", "longest time, ns per byte"], readers
            ),
            "library": table(
                ["numbers"], ["inputs", "accepted", "failures"], [[row["name"], *counts(row)] for row in parts["library"]]
            ),
            "program": table(["runs of the program"], ["inputs", "failures"], runs),
        },
    }


def counts(row: dict) -> list[str]:
    return [thousands(row[name]) for name in ("inputs", "accepted", "failures")]
