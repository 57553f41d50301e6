"""A reader tried in a forked process. Compiled libraries may end the process that reads a damaged file, so the program starts
another for each: half a second, where a fork takes some milliseconds. The code is the same; only how its process comes to be is not.
"""

from __future__ import annotations

import faulthandler
import json
import os
import resource
import signal
import subprocess
import sys
import traceback
from collections.abc import Callable
from tempfile import TemporaryFile
from typing import IO, Any

SECONDS, SOON = 30, 3


class Hangs(Exception):
    """More than `SECONDS` of the processor's time for one example, or much longer on a clock."""


def tried_apart(act: Callable[[], object], named: tuple[type[Exception], ...]) -> None:
    """`act()` in a forked process: ends well, or raises what it raised there where that is one of
    `named`; an AssertionError for anything else.

    This process must not have used what starts threads of its own (Rerun's reader does): a fork would wait for them.
    """

    def child(told: IO[bytes]) -> None:
        subprocess.run = started  # type: ignore[assignment]
        try:
            act()
        except named as error:
            kind = next(k for k, one in enumerate(named) if isinstance(error, one))
            told.write(json.dumps([kind, str(error)]).encode())
        except BaseException:
            told.write(json.dumps([-1, traceback.format_exc()]).encode())

    code, said = _forked(child)
    if code:
        raise AssertionError(f"ended by signal {-code}" if code < 0 else f"exit code {code}")
    if said:
        kind, text = json.loads(said)
        raise named[kind](text) if kind >= 0 else AssertionError(text)


def started(command: list[str], timeout: float | None = None, **_: Any) -> subprocess.CompletedProcess:
    """As `subprocess.run` of `python -P -c CODE ...`, in a fork of this process; its time is up after `SOON` where it has a limit."""
    assert command[:3] == [sys.executable, "-P", "-c"], command

    def child(told: IO[bytes]) -> int:
        sys.argv = ["-c", *command[4:]]
        with open(told.fileno(), "w", encoding="utf-8", errors="replace", closefd=False) as stream:
            sys.stderr = stream
            try:
                exec(command[3], {"__name__": "__main__"})
            except SystemExit as end:
                return int(end.code or 0)
            except BaseException:
                traceback.print_exc()
                return 1
        return 0

    try:
        code, said = _forked(child, SOON if timeout else SECONDS)
    except Hangs:
        raise subprocess.TimeoutExpired(command, timeout or SECONDS) from None
    return subprocess.CompletedProcess(command, code, "", said.decode(errors="replace"))


def _forked(child: Callable[[IO[bytes]], int | None], seconds: int = SECONDS) -> tuple[int, bytes]:
    """Exit code (a signal's is negative) and what was written of a `child`, which has so many `seconds` of the processor's time."""
    with TemporaryFile() as told:
        number = os.fork()
        if number == 0:
            code = 70
            try:
                faulthandler.disable()  # a library that breaks off is what is expected
                for which in (signal.SIGALRM, signal.SIGPROF):
                    signal.signal(which, signal.SIG_DFL)
                resource.setrlimit(resource.RLIMIT_CPU, (seconds, seconds + 5))
                code = child(told) or 0
                told.flush()
            finally:
                os._exit(code)
        try:
            _, status = os.waitpid(number, 0)
        except BaseException:
            os.kill(number, signal.SIGKILL)
            os.waitpid(number, 0)
            raise
        code = os.waitstatus_to_exitcode(status)
        if code == -signal.SIGXCPU:
            raise Hangs(f"still running after {seconds} s of the processor's time")
        told.seek(0)
        return code, told.read()
