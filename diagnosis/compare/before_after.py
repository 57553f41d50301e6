"""Whether an addition to the model paid: the error before and after it, over the tests it was fitted to and those it never saw."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Protocol, TypeVar

from thermospindle.diagnosis.compare.compare import Comparison, rms_residual
from thermospindle.model.errors import BadInput
from thermospindle.model.machine import Spindle
from thermospindle.sim.campaign.campaign import Campaign, Test


@dataclass(frozen=True, eq=False)
class BeforeAfter:
    """A campaign beside two scenes; `held_out` are the ids of tests that the second was not fitted to."""

    before: Comparison
    after: Comparison
    held_out: tuple[str, ...]

    def errors(self) -> dict[str, float | None]:
        return errors(self.before.tests, self.after.tests, self.held_out, lambda tests: rms_residual(tests) if any(t.count for t in tests) else None)


class OfTest(Protocol):
    """What was found of one test."""

    @property
    def test(self) -> Test: ...


Found = TypeVar("Found", bound=OfTest)


def errors(
    before: Sequence[Found], after: Sequence[Found], held_out: Sequence[str], rms: Callable[[Sequence[Found]], float | None]
) -> dict[str, float | None]:
    """Rms residuals of all tests, of fitted and of held-out ones, before and after; None where there are no such tests."""
    found: dict[str, float | None] = {}
    for when, tests in (("before", before), ("after", after)):
        for which, wanted in (("", (True, False)), ("fitted_", (False,)), ("held_out_", (True,))):
            found[f"{which}{when}"] = rms([t for t in tests if (t.test.id in held_out) in wanted])
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

    A scene without that table says nothing, and none is held out. `BadInput` for a named test that the table lists.
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
