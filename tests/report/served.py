"""`spindle workbench` in a process of its own, for tests that speak to it."""

import json
import subprocess
import sys
from pathlib import Path

from tests.conftest import ROOT


def started(folder: Path, *more: object) -> tuple[subprocess.Popen, dict]:
    """The process, and what it printed."""
    command = [sys.executable, "-m", "thermospindle", "workbench", *map(str, more), "--json", "--no-browser", "--out", str(folder / "saved")]
    process = subprocess.Popen(command, cwd=ROOT, stdout=subprocess.PIPE, stderr=(folder / "stderr").open("w"), text=True)
    line = process.stdout.readline()
    assert line, (folder / "stderr").read_text()
    return process, json.loads(line)
