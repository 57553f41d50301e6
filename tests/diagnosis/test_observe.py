"""What of a test's poles is taken for a mode of the machine."""

from dataclasses import replace

import numpy as np

from tests.diagnosis.hidden_modes import hidden
from thermospindle.diagnosis.data.observe import _repeated
from thermospindle.diagnosis.prediction.modes import predict
from thermospindle.diagnosis.prediction.partners import numbered, paired, partners
from thermospindle.sim.identification.frf import Frf


def with_pole(o, like, off):
    """One pole more, nearly of the shape of mode `like` and at (1 + off) times its frequency."""
    m, order = len(o.frequency), np.append(np.arange(len(o.frequency)), like)
    both = np.concatenate([order, order + m])
    covariance = o.covariance[np.ix_(both, both)] + 1e-12 * np.eye(len(both))
    frequency = o.frequency[order]
    frequency[-1] *= 1 + off
    shape = o.shape[order]
    shape[-1, 0] *= 1.05
    return replace(
        o, frequency=frequency, damping=o.damping[order], covariance=covariance, shape=shape, shape_sd=o.shape_sd[order],
        residue=o.residue[order], residue_sd=o.residue_sd[order],
    )  # fmt: skip


def test_a_pole_that_splits_a_peak_is_left_out(spindle):
    """It has the shape and nearly the frequency of a mode that the other tests show once; one that they show too stays."""
    tests = hidden(spindle, [], 5)
    split = with_pole(tests[0], 0, 0.01)
    found = _repeated(split, tests[1:])
    assert len(found.frequency) == len(tests[0].frequency)
    also = [with_pole(o, 0, 0.01) for o in tests[1:]]
    assert len(_repeated(split, also).frequency) == len(split.frequency)


def test_a_mode_that_nobody_predicts_is_no_ones_partner(spindle):
    """A pole at 650 Hz, of the shape of no mode there, has no partner within reach and leaves those of all others as they were."""
    for o in hidden(spindle, [], 4):
        p = predict(spindle, o, ())
        m = len(o.frequency)
        order = [m, *range(m)]
        odd = np.array([[1.0, -1.0, 0.5, -0.5, 0.8, -0.8, 0.3]], complex)
        strange = replace(o, frequency=np.append(o.frequency, 650.0)[order], shape=np.vstack([o.shape, odd])[order], residue=o.residue[[0, *range(m)]])
        assert partners(strange, p)[0] == -1
        assert paired(strange, p)[1:].tolist() == paired(o, p).tolist()


def at_points(o, order):
    """A test whose sensors stood at these of its points alone, in this order."""
    nodes = tuple(10 + i for i in order)
    frf = Frf(np.array([100.0]), np.zeros((len(nodes), 1, 1), complex), nodes, (nodes[0],), "mobility")
    return replace(o, test=replace(o.test, frf=frf), shape=o.shape[:, order], shape_sd=o.shape_sd[:, order])


def test_tests_may_have_sensors_at_other_points(spindle):
    """A mode shows again, and has its number, by its shape at the points that both tests have, whichever of their channels these are."""
    some, every = [6, 0, 3, 5, 1], list(range(7))
    first, *others = hidden(spindle, [], 5)
    predicted = [predict(spindle, o, ()) for o in (first, *others)]
    here, alike, moved = at_points(first, every), [at_points(o, every) for o in others], [at_points(o, some) for o in others]
    assert _repeated(here, moved).frequency.tolist() == _repeated(here, alike).frequency.tolist() == first.frequency.tolist()
    seen = [predicted[0], *(replace(p, shape=p.shape[:, some]) for p in predicted[1:])]
    assert numbered([here, *moved], seen) == numbered([here, *alike], predicted)
