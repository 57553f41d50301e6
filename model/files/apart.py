"""Files read by another process: the compiled libraries that read some kinds break off the process
that they are in on damaged ones, or never come to an end."""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Sequence
from pathlib import Path

from thermospindle.model.errors import BadInput

LONGEST, SLOWEST = 60.0, 1e6
"""s that reading a file may take, and bytes a second beyond that: a hundred times as long as a whole one takes on a busy machine."""


def read_apart(file: Path, what: str, code: str, *arguments: str, ends: Sequence[int] = (0,)) -> subprocess.CompletedProcess[str]:
    """How the Python `code` ended that reads a file of a kind (`what`, in the plural), with one of
    the exit codes `ends`. Raises `BadInput` for any other end, and for none."""
    limit = LONGEST + file.stat().st_size / SLOWEST
    try:
        done = subprocess.run([sys.executable, "-P", "-c", code, *arguments], capture_output=True, text=True, errors="replace", timeout=limit)
    except subprocess.TimeoutExpired:
        raise BadInput(f"{file}: is damaged; the library that reads {what} comes to no end on it within {limit:.0f} s") from None
    if done.returncode not in ends:
        raise BadInput(f"{file}: is damaged; the library that reads {what} breaks off on it")
    return done
