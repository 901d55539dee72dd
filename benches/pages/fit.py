"""docs/fit.md."""

from text import minus, table


def context(data: dict) -> dict:
    rows = [
        [p["name"], f"{p['target']:.4f}", f"{p['start']:.4f}", error(p, "start", 1), f"{p['end']:.5f}", error(p, "end", 2)]
        for p in data["parameters"]
    ]
    starts = [
        [s["seed"], f"{100 * s['worst'][0]:.0f} %", f"{100 * s['worst'][1]:.2f} %", f"{s['mean_error']:.4f}", s["epochs"]]
        for s in data["other_starts"]
    ]
    return data | {
        "worst": max(abs(p["end"] / p["target"] - 1) for p in data["parameters"]),
        "tables": {
            "parameters": table(["parameter"], ["target", "start", "error", "end", "error"], rows),
            "starts": table([], ["seed", "largest error at the start", "at the end", "mean difference, cells", "epochs"], starts),
        },
    }


def error(parameter: dict, when: str, decimals: int) -> str:
    return minus(f"{100 * (parameter[when] / parameter['target'] - 1):+.{decimals}f} %")
