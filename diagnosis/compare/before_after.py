"""Whether an addition to the model paid: the error before and after it, over the tests it was fitted to and those it never saw."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

from rich.box import SIMPLE_HEAD
from rich.console import Console
from rich.table import Table

from thermospindle.diagnosis.compare.compare import Comparison, rms_pull
from thermospindle.model.errors import BadInput
from thermospindle.model.machine import Spindle
from thermospindle.sim.campaign.campaign import Campaign


@dataclass(frozen=True, eq=False)
class BeforeAfter:
    """A campaign beside two scenes; `held_out` are the ids of tests that the second was not fitted to."""

    before: Comparison
    after: Comparison
    held_out: tuple[str, ...]

    def errors(self) -> dict[str, float | None]:
        """Rms pulls of all tests, of fitted and of held-out ones, before and after; None where there are no such tests."""
        found: dict[str, float | None] = {}
        for when, comparison in (("before", self.before), ("after", self.after)):
            for which, wanted in (("", (True, False)), ("fitted_", (False,)), ("held_out_", (True,))):
                tests = [t for t in comparison.tests if (t.test.id in self.held_out) in wanted]
                found[f"{which}{when}"] = rms_pull(tests) if sum(t.count for t in tests) else None
        return found


def without(campaign: Campaign, ids: Sequence[str]) -> Campaign:
    """The campaign without some tests; `BadInput` for a test it has not, or where none would be left."""
    _known(campaign, ids)
    left = tuple(t for t in campaign.tests if t.id not in ids)
    if not left:
        raise BadInput("--held-out: holds out every test of the campaign; one at least must be left")
    return replace(campaign, tests=left)


def held_out(spindle: Spindle, campaign: Campaign, named: Sequence[str]) -> tuple[str, ...]:
    """Ids of the tests a scene was not fitted to: those named, or else those its `build` table does not list.

    A scene without that table tells nothing, and none is held out. `BadInput` for a named test that the table lists.
    """
    _known(campaign, named)
    fitted = spindle.build.tests if spindle.build else ()
    for test in named:
        if test in fitted:
            raise BadInput(f"--held-out {test}: {spindle.file or spindle.name} was fitted to it (build.tests)")
    if named:
        return tuple(dict.fromkeys(named))
    return tuple(t.id for t in campaign.tests if t.id not in fitted) if fitted else ()


def _known(campaign: Campaign, ids: Sequence[str]) -> None:
    for test in ids:
        if test not in (known := [t.id for t in campaign.tests]):
            raise BadInput(f"--held-out {test}: is no test of the campaign; allowed are {', '.join(known)}")


def show_before_after(console: Console, both: BeforeAfter) -> None:
    errors = both.errors()
    grid = Table(title="Error, rms in standard errors", title_justify="left", title_style="bold", box=SIMPLE_HEAD, show_edge=False)
    for column in ("", f"before\n{both.before.spindle}", f"after\n{both.after.spindle}"):
        grid.add_column(column, justify="right" if column else "left")
    for label, which in (("all tests", ""), ("fitted tests", "fitted_"), ("held-out tests", "held_out_")):
        values = [errors[f"{which}{when}"] for when in ("before", "after")]
        if which == "" or (both.held_out and None not in values):
            grid.add_row(label, *(f"{v:.3g}" for v in values if v is not None))
    console.print(grid)
    if both.held_out:
        console.print(f"held out: {', '.join(both.held_out)}", highlight=False)
