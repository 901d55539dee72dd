"""The command line: ``isograd …``, or ``python -m isograd …``."""

import sys

from . import _core


def main() -> int:
    """Runs the command line of this process and returns its exit status."""
    return _core.run_command(["isograd", *sys.argv[1:]])


if __name__ == "__main__":
    sys.exit(main())
