"""`spindle` and `python -m thermospindle`: the command line, also when it is stopped before it is loaded."""

from __future__ import annotations

import signal
import sys


def main() -> int:
    """Run the verb of the command line; returns its exit code, 130 when stopped at any moment, by
    Ctrl-C or by who asks a process to end (`timeout`, a batch system)."""
    try:
        signal.signal(signal.SIGTERM, signal.default_int_handler)
        from thermospindle.cli import main as command_line

        return command_line()
    except KeyboardInterrupt:
        print("spindle: stopped; nothing was left half written", file=sys.stderr)
        return 130


if __name__ == "__main__":
    sys.exit(main())
