"""Renders docs/PAGE.md and its charts from docs/PAGE.json: `python render.py [--check] [PAGE...]`. The page `readme` is the
table of README.md, from several of them.

The text of a page is templates/PAGE.md.jinja; its module computes tables and figures. `--check` draws no charts and fails
if a page differs from what its JSON gives, or a page that is written by hand from a figure in `claims.py`."""

import argparse
import importlib
import sys
from pathlib import Path

import claims
import jinja2
import text

HERE = Path(__file__).resolve().parent
DOCS = HERE.parents[1] / "docs"
README = DOCS.parent / "README.md"
PAGES = ["accuracy", "gradients", "orientation", "scaling", "fit", "gpu", "guarantees", "peers", "surfaces", "large", "flow"]
PAGES += ["datasets", "readme"]


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("pages", nargs="*", metavar="PAGE", help=f"one of {', '.join(PAGES)}; default: all")
    parser.add_argument("--check", action="store_true", help="compare the committed pages with their JSON")
    options = parser.parse_args()
    if unknown := set(options.pages) - set(PAGES):
        parser.error(f"unknown pages: {', '.join(sorted(unknown))}")
    different = []
    for name in options.pages or PAGES:
        module = importlib.import_module(name)
        path = README if name == "readme" else DOCS / f"{name}.md"
        data = {source: claims.read(DOCS, source) for source in getattr(module, "SOURCES", [name])}
        data = data.get(name, data)
        page = rendered(name, module.context(data), path)
        if not options.check:
            path.write_text(page, encoding="utf-8")
            if hasattr(module, "draw"):
                module.draw(data, DOCS / "images")
            print(f"wrote {path}")
        elif path.read_text(encoding="utf-8") != page:
            different.append(str(path))
    if different:
        print("not what their JSON gives; run `cargo xtask docs --render`:", *different, sep="\n  ", file=sys.stderr)
    stale = claims.missing(DOCS)
    if stale:
        print("figures that are not those of the JSON:", *stale, sep="\n  ", file=sys.stderr)
    return 1 if different or stale else 0


def rendered(name: str, context: dict, path: Path) -> str:
    """The page; for a page that is written by hand around a generated part, with that part replaced."""
    environment = jinja2.Environment(
        loader=jinja2.FileSystemLoader(HERE / "templates"),
        undefined=jinja2.StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
        keep_trailing_newline=True,
    )
    environment.filters |= {
        "number": text.number,
        "significant": text.significant,
        "percent": text.percent,
        "thousands": text.thousands,
        "scientific": text.scientific,
        "shape": text.shape,
    }
    page = text.reflow(environment.get_template(f"{name}.md.jinja").render(context))
    begin, end = page.split("\n", 1)[0], "<!-- End of the generated part. -->"
    if end not in page:
        return page
    written = path.read_text(encoding="utf-8")
    return written.split(begin)[0] + page.strip() + written.split(end)[1]


if __name__ == "__main__":
    sys.exit(main())
