"""The verb `ladder`: model forms, tolerances and effects taken in one after the other."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from rich.console import Console

from thermospindle.diagnosis.ladder.ladder import ladder as climb
from thermospindle.report.progress import going_on
from thermospindle.report.text.ladder_table import growing, ladder_json, show_ladder
from thermospindle.report.verbs.answer import Answer, answered, check_out, with_effects, write_json
from thermospindle.sim.campaign.beside import doubtful
from thermospindle.sim.campaign.campaign import read_campaign
from thermospindle.sim.campaign.likeness import likenesses
from thermospindle.sim.effects import by_name


def ladder(
    scene: Path,
    campaign: Path,
    effects: Sequence[str] | None = None,
    effect_files: Sequence[Path] = (),
    out: Path | None = None,
) -> Answer:
    """The error of a scene against a campaign at every step, with `effects` in their order (those that `diagnose` names by default)."""
    asked = dict(locals()) | {"verb": "ladder"}
    check_out(out)
    (spindle, catalogue), tests = with_effects(scene, effect_files), read_campaign(campaign)
    chosen = None if effects is None else [by_name(name, catalogue) for name in effects]
    with going_on(asked, spindle, tests), growing(Console(stderr=True, markup=False)) as live:
        found = climb(spindle, tests, chosen, catalogue, live.step, live.progress)

    def pictures(folder: Path) -> None:
        from thermospindle.report.page.ladder import write_ladder  # matplotlib takes its time to load

        write_ladder(found, folder)

    write = write_json("ladder.json", pictures)
    return answered(ladder_json(found), lambda console: show_ladder(console, found), out, asked, write, [*doubtful(spindle, tests), *likenesses(spindle, tests)])
