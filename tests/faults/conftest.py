"""How many processes are killed, and what was left of what they wrote: `make faults KILLS=100`; a handful in every run of the tests."""

import os
from collections import Counter

import pytest

from tests.counted import in_other_processes

if os.name == "nt":  # SIGKILL, mounts and limits of file size are not there
    collect_ignore_glob = ["test_*.py"]
KILLS = int(os.environ.get("FAULTS_KILLS", "0"))
SEED = int(os.environ.get("FAULTS_SEED", "0"))
COUNTS: dict[str, Counter] = {}


@pytest.fixture(scope="session")
def cache(tmp_path_factory):
    """Finite elements are computed once for all runs."""
    return tmp_path_factory.mktemp("cache")


def pytest_terminal_summary(terminalreporter):
    if not KILLS:
        return
    terminalreporter.section("faults")
    if in_other_processes(terminalreporter):
        return
    for what, count in COUNTS.items():
        terminalreporter.write_line(f"{what:14} {', '.join(f'{number} {name}' for name, number in count.most_common())}")
    landed = sum(n for count in COUNTS.values() for name, n in count.items() if name.startswith("killed"))
    terminalreporter.write_line(f"{'all':14} {landed} processes killed with SIGKILL")
