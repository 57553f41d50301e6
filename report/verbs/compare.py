"""The verb `compare`: a campaign beside a scene."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

from rich.console import Console

from thermospindle.diagnosis.compare.before_after import BeforeAfter, errors, held_out
from thermospindle.diagnosis.compare.compare import Comparison
from thermospindle.diagnosis.compare.compare import compare as beside
from thermospindle.diagnosis.compare.correlation import in_common, off_alone
from thermospindle.diagnosis.data.observe import observe
from thermospindle.diagnosis.runout.compare import RunoutBeside, compare_runout, rms_residual
from thermospindle.diagnosis.runout.lines import modal_tests
from thermospindle.model.errors import listed
from thermospindle.model.machine import Spindle
from thermospindle.model.units import RPM
from thermospindle.report.progress import progress_bar
from thermospindle.report.text.compare import comparison_json, show_before_after, show_comparison
from thermospindle.report.text.runout_compare import runout_comparison_json, show_errors, show_runout_comparison
from thermospindle.report.verbs.answer import Answer, answered, check_out, with_effects, write_json
from thermospindle.sim.campaign.beside import check_points, doubtful
from thermospindle.sim.campaign.campaign import Campaign, read_campaign
from thermospindle.sim.campaign.likeness import likenesses

SURE = 3.0  # standard errors


def compare(
    scene: Path,
    campaign: Path,
    before: Path | None = None,
    held_out_tests: Sequence[str] = (),
    verbose: bool = False,
    effect_files: Sequence[Path] = (),
    out: Path | None = None,
) -> Answer:
    """Modes, dampings, shapes and FRFs of a campaign beside the scene; with `before`, another scene, whether the error fell."""
    asked = dict(locals()) | {"verb": "compare"}
    check_out(out)
    spindle, whole = with_effects(scene, effect_files)[0], read_campaign(campaign)
    earlier = with_effects(before, effect_files)[0] if before else None
    for s in filter(None, (spindle, earlier)):
        check_points(s, whole)  # before modes of minutes are found for nothing
    unseen = held_out(spindle, whole, held_out_tests)
    own = replace(whole, spindle=spindle.name) if earlier is not None and earlier.name == whole.spindle else whole  # what effects were added to is that machine still
    turning = _of_runout(spindle, earlier, whole, unseen, verbose)
    tests = modal_tests(whole)
    if turning and not tests.tests:
        values = {"spindle": spindle.name, "campaign": whole.title, **turning[0]}
        alone = write_json("comparison.json", lambda folder: _write(None, spindle, folder, *turning[2:], whole.title, name=whole.name))
        return answered(values, turning[1], out, asked, alone, doubtful(spindle, own))
    with progress_bar((3 if earlier else 2) * len(tests.tests)) as progress:
        observed = observe(tests, spindle, progress)
        comparison = beside(spindle, tests, observed, progress)
        both = BeforeAfter(beside(earlier, tests, observed, progress) if earlier else comparison, comparison, unseen)
    values = comparison_json(comparison)
    if earlier:
        values |= {"error": both.errors(), "held_out": list(unseen)}
    if turning:
        values |= {"runout": turning[0]}

    def show(console: Console) -> None:
        show_comparison(console, comparison, verbose)
        if earlier:
            show_before_after(console, both)
        if turning:
            turning[1](console)

    write = write_json("comparison.json", lambda folder: _write(comparison, spindle, folder, *(turning[2:] if turning else ()), name=whole.name, both=both if earlier else None))
    return answered(values, show, out, asked, write, [*doubtful(spindle, own), *_beyond(comparison), *_by_law_of_damping(comparison), *(likenesses(spindle, whole) or [*_louder(comparison), *_alone(comparison, whole)])])


def _beyond(c: Comparison) -> list[str]:
    """Tests at conditions that the model does not bear."""
    return [
        f"tests.{t.test.id}: at {t.test.temperature:g} C and {t.test.speed / RPM:g} rpm the {t.beyond}: this is beyond what the model bears, and its FRFs are not compared; "
        "is the temperature right, and in C?"
        for t in c.tests
        if t.beyond
    ]


def _by_law_of_damping(c: Comparison) -> list[str]:
    """Modes damped so much that it matters whether loss grows with frequency: the pole i w sqrt(1 +
    2 i z) of a complex stiffness is (1 + z^2) times as large as that of a damper of the same loss."""
    high = [m for t in c.tests for m in t.modes if m.damping_computed**2 * m.computed > max(SURE * m.sd, -m.error / 2, m.error)]
    higher = sorted({m.number for m in high if m.error < -0.3 * m.damping_computed**2 * m.computed})
    if not higher:
        return []
    most = max(m.damping_computed for m in high if m.number in higher)
    return [
        f"mode{'s' * (len(higher) > 1)} {listed([str(n) for n in higher])}: {'is' if len(higher) == 1 else 'are'} damped by up to {100 * most:.2g} % of critical, and measured higher than computed: poles of hysteretic damping (a complex "
        f"stiffness, as of rubber) lie up to {100 * most**2:.2g} % above those of viscous damping, which is computed here; diagnose finds which of the two the data have"
    ]


def _louder(c: Comparison) -> list[str]:
    """A factor that all measured FRFs have beside the computed ones."""
    by = in_common([t.correlation for t in c.tests if t.correlation])
    if by is None:
        return []
    size = f"{abs(by):.0f} dB {'larger' if by > 0 else 'smaller'} than computed ones"
    return [f"measured FRFs are {size}, all alike: a unit, a sensor's or the hammer's sensitivity, or the mass of the drawing is off by a factor of about {10 ** (abs(by) / 20):.2g}"]


def _alone(c: Comparison, campaign: Campaign) -> list[str]:
    """Sensors whose FRFs are larger or smaller than computed, where those of the others are not: no likeness of shapes tells of it."""
    names = {p.node: f"{p.node} ({p.name})" for p in campaign.points}
    return [
        f"FRFs measured at point {names[node]} are {abs(off):.0%} {'larger' if off > 0 else 'smaller'} than computed, beside those of the other points, which differ by {others:.0%} at most: "
        "is that its sensor's sensitivity?"
        for node, (off, others) in off_alone([t.correlation for t in c.tests if t.correlation]).items()
    ]


def _write(*what: Any, name: str, both: BeforeAfter | None = None) -> None:
    from thermospindle.report.page.compare import write_comparison  # matplotlib and rerun take their time to load

    write_comparison(*what, name=name, both=both)


def _of_runout(
    spindle: Spindle, before: Spindle | None, campaign: Campaign, unseen: Sequence[str], verbose: bool
) -> tuple[dict[str, Any], Callable[[Console], None], list[RunoutBeside], dict[str, float | None] | None] | None:
    """The runout tests of a campaign beside the scene, None where it has none: JSON, how it is
    told, and what the page needs; with `before` the errors of both scenes."""
    if not any(test.runout for test in campaign.tests):
        return None
    with progress_bar(len(campaign.tests) * (2 if before else 1)) as progress:
        found = compare_runout(spindle, campaign, progress)
        earlier = compare_runout(before, campaign, progress) if before else None
    values = runout_comparison_json(found)
    before_after = errors(earlier, found, unseen, rms_residual) if earlier else None
    if before_after:
        values |= {"error": before_after, "held_out": list(unseen)}

    def show(console: Console) -> None:
        show_runout_comparison(console, found, verbose)
        if before_after:
            show_errors(console, before_after)

    return values, show, found, before_after
