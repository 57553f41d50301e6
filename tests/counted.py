"""Counts at the end of long tests."""

from __future__ import annotations

import pytest


def in_other_processes(reporter: pytest.TerminalReporter) -> bool:
    """Whether tests ran in processes whose counts are not here, which is then said."""
    apart = bool(reporter.config.getoption("numprocesses", None))
    if apart:
        reporter.write_line("counted without -n alone: each process has counts of its own")
    return apart
