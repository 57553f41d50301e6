"""Runs a verb of spindle, and kills itself with SIGKILL at its n-th act on the files of a folder.

    python -m tests.faults.launch FOLDER N COUNT VERB ...      N = 0: never; how many acts there were is written to the file COUNT

With N = -1 it lives, and copies the folder to COUNT.copies/K before its K-th act: what a SIGKILL there would leave,
for every K of one run. An act is what the interpreter's audit hooks tell: a file opened to be written, a folder
made, something renamed or removed. `save` is no verb of the command line but the workbench's: SCENE CAMPAIGN OUT.
"""

from __future__ import annotations

import os
import shutil
import signal
import sys
from pathlib import Path

WRITES = os.O_WRONLY | os.O_RDWR | os.O_CREAT | os.O_TRUNC
ACTS = {"os.rename", "os.mkdir", "os.remove", "os.rmdir", "os.truncate"}


def watch(folder: str, last: int, copies: Path | None = None) -> list[int]:
    """Counts from now on, in a list of one; this process is killed before act number `last` happens, or the folder copied before every one."""
    count = [0]
    me = os.getpid()

    def hook(event: str, arguments: tuple) -> None:
        if event == "open":
            path, _, flags = arguments
            if not isinstance(flags, int) or not flags & WRITES:
                return
        elif event in ACTS:
            path = arguments[0]
        else:
            return
        if isinstance(path, str | bytes | os.PathLike) and os.fsdecode(path).startswith(folder) and os.getpid() == me:
            count[0] += 1
            if copies is not None:
                shutil.copytree(folder, copies / str(count[0]))
            if count[0] == last:
                os.kill(me, signal.SIGKILL)

    sys.addaudithook(hook)
    return count


def save(scene: str, campaign: str, out: str) -> int:
    """What the workbench's button does."""
    from thermospindle.report.workbench import bench as benches
    from thermospindle.report.workbench.save import save as saved
    from thermospindle.report.workbench.state import Setting, set_deviation
    from thermospindle.sim.campaign.campaign import read_campaign

    bench = benches.open_bench(Path(scene), read_campaign(Path(campaign)))
    s = set_deviation(Setting(), "hub mass", 0.004)
    try:
        saved(bench, s, benches.errors(bench, s), (), Path(out))
    except OSError as error:  # the workbench shows it (report/workbench/work.py)
        print(f"spindle: {error}", file=sys.stderr)
        return 2
    return 0


def main() -> int:
    folder, last, told, *command = sys.argv[1:]
    if command[0] == "save":
        run = lambda: save(*command[1:])  # noqa: E731
    else:
        from thermospindle.cli import main as spindle

        run = lambda: spindle(command)  # noqa: E731
    count = watch(folder, int(last), Path(f"{told}.copies") if last == "-1" else None)
    try:
        code = run()
    finally:
        Path(told).write_text(str(count[0]), encoding="utf-8")
    return code


if __name__ == "__main__":
    sys.exit(main())
