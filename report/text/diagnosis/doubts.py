"""What speaks against an explanation that a verdict names all the same: tests that it predicts worse, and sizes that it cannot have."""

from __future__ import annotations

import numpy as np

from thermospindle.diagnosis.decision.explanations import named_part
from thermospindle.diagnosis.parameters.mechanism import Mechanism
from thermospindle.diagnosis.verdict import Diagnosis
from thermospindle.model.types import Array
from thermospindle.report.typeset import plain, plain_error, unit_word

WORSE = 1.05  # times the error without what is named, from which conditions left out are said to speak against it
BEYOND = 2.0  # standard errors beyond a limit, from which a size is not one that scatters about it


def doubt_words(d: Diagnosis) -> list[str]:
    """Sentences, none where nothing does or no effect is named."""
    v = d.verdict
    if not v.effects:
        return []
    found = []
    if v.held_out_after > WORSE * v.held_out_before:
        names = "what is named" if v.word == "ambiguous" else " and ".join(v.effects)
        found.append(f"Tests that are left out speak against {names}: predicted from all others they are missed by {v.held_out_after:.3g} standard errors with it, by {v.held_out_before:.3g} without.")
    told = set[str]()
    for c in (*v.candidates, *v.free):
        if set(named_part(c)) <= set(v.effects):
            own = c.hypothesis.evidence
            for m, sizes, covariance in zip(c.hypothesis.mechanisms, own.sizes, own.size_covariance, strict=True):
                if not m.free and m.name not in told:
                    told.add(m.name)
                    found += _not_physical(m, sizes, np.sqrt(np.maximum(np.diag(covariance), 0.0)), [t.test.id for t in d.search.model.tests])
    return found


def _not_physical(m: Mechanism, sizes: Array, sd: Array, tests: list[str]) -> list[str]:
    """A sentence where some of the sizes (tests,) lie beyond the limits of a mechanism."""
    (low, high), unit = m.size.limits, unit_word(m.size.unit, " ")
    beyond = np.flatnonzero((sizes < low - BEYOND * sd) | (sizes > high + BEYOND * sd))
    if not len(beyond):
        return []
    which = ", ".join(f"{plain_error(float(sizes[t]), float(sd[t]))}{unit} in {tests[t]}" for t in beyond)
    return [f"Of {m.name} the data ask for a {m.size.name} that is not physical: {which}; possible is {plain(low)} to {plain(high)}{unit}."]
