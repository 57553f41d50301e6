"""What a diagnosis answers of every explanation."""

from __future__ import annotations

from types import SimpleNamespace

import pytest

from tests.conftest import ROOT
from tests.virtual_campaign import effect, mode_campaign, model_of
from thermospindle.diagnosis.decision.explanations import Candidate
from thermospindle.diagnosis.inference.evidence import evidence, left_out
from thermospindle.diagnosis.inference.fit import fit
from thermospindle.diagnosis.inference.hypothesis import Hypothesis
from thermospindle.diagnosis.inference.problem import Problem
from thermospindle.diagnosis.parameters.mechanism import variants
from thermospindle.model.machine import Condition
from thermospindle.model.scene.reading import load
from thermospindle.report.text.diagnosis.answer import _candidate


@pytest.mark.parametrize("temperatures", [(20.0, 60.0), (20.0,)])
def test_errors_of_conditions_left_out_are_of_every_candidate(temperatures):
    """An explanation that is not accepted has the ratio that it would have if it were: that of conditions
    predicted from all others, not of the data that it was fitted to. Of one condition there is none."""
    scene, softer = load(ROOT / "tests" / "scenes" / "symmetric"), effect("bond_softening")
    model = model_of(scene, mode_campaign(scene, [Condition(t) for t in temperatures], 1, [(softer, softer.typical())], damping=False))
    mechanism = variants(softer)[0]

    def hypothesis(mechanisms):
        start = [Problem(model, mechanisms).start({0: softer.parameters[0].typical} if mechanisms else {})]
        return Hypothesis(found := fit(model, mechanisms, start), evidence(model, found))

    base, own = hypothesis(()), hypothesis((mechanism,))
    groups = [[t] for t in range(len(temperatures))]
    before, after = (left_out(model, h.fit, h.evidence, groups)[0] for h in (base, own))
    verdict = SimpleNamespace(held_out_before=before, held_out_after=before, accepted=base)
    candidate = Candidate(own, ("bond_softening",), False, own.evidence.ln - base.evidence.ln, 0.5)
    told = _candidate(candidate, SimpleNamespace(search=SimpleNamespace(model=model, base=base), verdict=verdict))["held_out_error_ratio"]
    if len(temperatures) == 1:
        assert told is None
    else:
        assert told == pytest.approx(after / before)
        assert told != pytest.approx((own.evidence.chi2 / base.evidence.chi2) ** 0.5, rel=0.1)  # in sample, as it once was
