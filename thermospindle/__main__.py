"""`spindle` and `python -m thermospindle`: the command line, also when it is stopped before it is loaded."""

from __future__ import annotations

import sys


def main() -> int:
    """Run the verb of the command line; returns its exit code, 130 when stopped at any moment."""
    try:
        from thermospindle.cli import main as command_line

        return command_line()
    except KeyboardInterrupt:
        print("spindle: stopped; nothing was left half written", file=sys.stderr)
        return 130


if __name__ == "__main__":
    sys.exit(main())
