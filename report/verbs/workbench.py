"""The verb `workbench`: a page in the browser on which effects and parameters are moved by hand."""

from __future__ import annotations

import os
import webbrowser
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from rich.console import Console

from thermospindle.report.progress import progress_bar
from thermospindle.report.verbs.answer import Answer
from thermospindle.report.workbench import words
from thermospindle.report.workbench.bench import open_bench
from thermospindle.report.workbench.explanations import read_explanations
from thermospindle.report.workbench.server import serve, server
from thermospindle.sim.campaign.beside import doubtful
from thermospindle.sim.campaign.campaign import read_campaign
from thermospindle.sim.campaign.likeness import likenesses


def workbench(
    scene: Path,
    campaign: Path | None = None,
    diagnosis: Path | None = None,
    port: int = 0,
    no_browser: bool = False,
    held_out_tests: Sequence[str] = (),
    effect_files: Sequence[Path] = (),
    out: Path | None = None,
) -> Answer:
    """A page on this machine alone, served until it is interrupted; what is saved there goes into
    folders of `out`. `port` 0 is any free one."""
    if campaign is None:
        bench = open_bench(scene, None, effect_files, left_out=held_out_tests)
    else:
        tests = read_campaign(campaign)
        with progress_bar(len(tests.tests)) as progress:
            bench = open_bench(scene, tests, effect_files, progress, held_out_tests)
    known = read_explanations(diagnosis, bench) if diagnosis else None
    doubts = [f"--diagnosis {diagnosis}: was made of another state of this scene; its tolerances may not fit"] if known and not known.of_scene else []
    doubts += [said for said in (words.not_shown(bench),) if said]
    if bench.campaign:
        doubts += [*doubtful(bench.spindle, bench.campaign), *likenesses(bench.spindle, bench.campaign)]
    out = Path("out") / f"{bench.spindle.name}_workbench" if out is None else out
    made, address = server(bench, out, known, port)
    values: dict[str, Any] = {"address": address, "token": address.rstrip("/").rpartition("/")[2], "pid": os.getpid(), "out": str(out), "warnings": doubts}

    def show(console: Console) -> None:
        console.print(f"The workbench of {bench.spindle.name} is at\n\n  {address}\n", highlight=False, soft_wrap=True)
        console.print(f"on this machine alone. Saved there goes to {out}. End it with Ctrl-C.", highlight=False, soft_wrap=True)

    def then() -> None:
        if not no_browser:
            webbrowser.open(address)
        serve(made)

    return Answer(values, show, then)
