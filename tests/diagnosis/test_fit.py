"""Fits of tolerances to modes: what was changed is found again, and a strange mode is no one's partner."""

from dataclasses import replace

import numpy as np

from tests.diagnosis.hidden_modes import hidden, theory_of
from thermospindle.diagnosis.data.observe import Observation
from thermospindle.diagnosis.fit.fit import fit, linearise
from thermospindle.diagnosis.prediction.theory import WITHOUT
from thermospindle.model.tolerance import toleranced


def test_tolerances_are_found_and_not_taken_for_physics(spindle):
    """A preload 2.5 sd low is absorbed by the tolerance on preload."""
    preload = next(p for p in toleranced(spindle) if p.name == "preload")
    about = theory_of(spindle, hidden(preload.apply(spindle, -0.075), [], 7))
    about = replace(about, spindle=spindle)
    found = fit(about, linearise(about))
    index = about.names.index("preload")
    assert found.nuisance[index] < -0.03
    assert found.misfit < 1.5 * len(about.data.value)


def test_a_mode_that_nobody_predicts_is_no_ones_partner(spindle):
    """A pole at 650 Hz in every test leaves the partners of all others as they were, and is missed whatever the parameters."""
    data = hidden(spindle, [], 4)
    extra = [with_pole(o, 650.0) for o in data]
    about, plain = theory_of(spindle, extra), theory_of(spindle, data)
    rows = [i for i, f in enumerate(about.data.features) if f.mode > 0]
    x = np.zeros(len(about.sd))
    np.testing.assert_allclose(about.features(x)[rows], plain.features(x))
    own = [i for i, f in enumerate(about.data.features) if f.mode == 0 and f.what == "frequency"]
    np.testing.assert_allclose((about.features(x) - about.data.value)[own] / about.data.sd[own], WITHOUT)


def with_pole(o: Observation, frequency: float) -> Observation:
    """The observation with one more mode at its beginning, of a shape like none of the others."""
    order = [len(o.frequency), *range(len(o.frequency))]
    both = np.ix_(*[[*order, *(np.array(order) + len(order))]] * 2)
    m = len(o.frequency)
    wider = np.zeros((2 * m + 2, 2 * m + 2))
    old = [*range(m), *range(m + 1, 2 * m + 1)]
    wider[np.ix_(old, old)] = o.covariance
    wider[m, m], wider[2 * m + 1, 2 * m + 1] = 1e-8, 1e-5
    odd = np.array([[1.0, -1.0, 0.5, -0.5, 0.8, -0.8, 0.3]], complex)
    return replace(
        o,
        frequency=np.append(o.frequency, frequency)[order],
        damping=np.append(o.damping, 0.01)[order],
        covariance=wider[both],
        shape=np.vstack([o.shape, odd])[order],
        shape_sd=np.vstack([o.shape_sd, np.full((1, 7), 1e-3)])[order],
        residue=np.vstack([o.residue, np.ones((1, o.residue.shape[1]))])[order],
        residue_sd=np.append(o.residue_sd, 3e-3)[order],
    )
