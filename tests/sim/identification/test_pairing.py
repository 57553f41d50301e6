"""Which mode is which: the cost of a pair, pairs chosen at once, close modes, tracks."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import ArrayLike

from tests.sim.identification.test_modal import eigen, sensors, spindle
from thermospindle.model.units import RPM
from thermospindle.sim.identification.pairing import (
    BY_SHAPE,
    COMPARED,
    FOLLOWED_BY_KIND,
    IDENTIFIED,
    MEASURED,
    NEAREST,
    REPEATED,
    ModeSet,
    Policy,
    at_shared,
    cost,
    in_order,
    kept_in_order,
    mac,
    pairs,
    partners,
    track,
)


def known(frequency, shape, kind=()) -> ModeSet:
    return ModeSet(np.asarray(frequency, float), np.asarray(shape), kind)


def test_mac():
    a = np.array([[1, 1j, 0], [1, 1, 0]])
    assert mac(a, (2 - 3j) * a) == pytest.approx(np.array([[1, 0.5], [0.5, 1]]))
    assert mac(a, [[1, -1j, 5]]) == pytest.approx(np.array([[0], [1 / 27]]))


def test_pairing_through_speed():
    """At rest two tilts along fixed axes 0.05 % apart, at 7200 rpm two circles 1.5 % apart: each MAC is one half, the space is the same."""
    rest, turning = (known(*[x[:8] for x in eigen(*spindle(rpm * RPM), sensors())][::2]) for rpm in (0, 7200))
    assert mac(rest.shape, turning.shape)[5:7, 5:7] == pytest.approx(np.full((2, 2), 0.5), abs=0.1)
    assert pairs(rest, turning, MEASURED).tolist() == [[i, i] for i in range(8)]


def test_shapes_turned_within_their_pair():
    """Coincident modes come with any two shapes of their plane: the third mode, close to them, must not be drawn in."""
    plane, third = np.array([[1.0, 0, 0.3, 0], [0, 1.0, 0, 0.3]]), np.array([[0, 0, 1.0, 1.0]])
    turn = np.array([[np.cos(0.6), np.sin(0.6)], [-np.sin(0.6), np.cos(0.6)]])
    a, b = known([1000, 1001, 1005], np.vstack([plane, third])), known([990, 1000, 1001], np.vstack([third, turn @ plane]))
    assert pairs(a, b, MEASURED).tolist() == [[0, 1], [1, 2], [2, 0]]


def test_tracking_through_crossings():
    """Softening bearings drive the tilting modes (about x, about y) through the axial ones. By symmetry the three families never mix, and
    within a family modes do not cross: family and rank are the truth that tracks must keep."""
    families, conditions = [], []
    for softness in np.geomspace(1, 0.08, 15):
        frequency, _, shape = (x[:7] for x in eigen(*spindle(softness=softness), sensors()))
        part = np.abs(shape) ** 2
        names = np.where(part[:, 2] > 1e-12 * part.sum(1), "y", np.where(part[:, 3] > 1e-12 * part.sum(1), "x", "z"))
        families.append([f"{n}{(names[:i] == n).sum()}" for i, n in enumerate(names)])
        conditions.append(known(frequency, shape))
    assert families[0] != families[-1]
    table = track(conditions)
    assert table.shape == (15, 7)
    for column in table.T:
        assert len({names[i] for names, i in zip(families, column, strict=True)}) == 1


def test_lost_and_new_modes():
    shape = np.eye(4)
    table = track([known([100, 200], shape[:2]), known([201, 300], shape[1:3]), known([101, 202, 301], shape[:3])])
    assert table.tolist() == [[0, 1, -1], [-1, 0, 1], [0, 1, 2]]
    assert len(pairs(known([100], shape[:1]), known([100], shape[3:]), MEASURED)) == 0


# ---------------------------------------------------------------- policies


def test_the_cost_is_that_of_its_docstring():
    """1 - MAC = 1/2, a frequency ratio of one width, squared or not; another kind adds its penalty."""
    a, b = known([100.0], [[1.0, 0.0]], ["axial"]), known([100.0 * np.exp(0.2)], [[1.0, 1.0]], ["rocking"])
    assert cost(a, b, Policy(width=0.2)) == pytest.approx(np.array([[1.5]]))
    assert cost(a, b, Policy(width=0.1)) == pytest.approx(np.array([[4.5]]))
    assert cost(a, b, Policy(width=0.1, power=1)) == pytest.approx(np.array([[2.5]]))
    assert cost(a, b, Policy(width=0.2, other_kind=7.0)) == pytest.approx(np.array([[8.5]]))
    assert cost(a, b, Policy(width=0.2, mixing=0.03)) == pytest.approx(np.array([[1.75]]))  # nobody near: S is the MAC


def test_as_many_as_there_are_or_none_too_dear():
    """The same two modes, far apart: paired as numbers of a table, left alone by measured ones and
    by those of one model that are unlike, refused by a limit."""
    a, b = known([100.0], [[1.0, 0.0]]), known([200.0], [[0.0, 1.0]])
    assert pairs(a, b, NEAREST).tolist() == [[0, 0]]
    assert pairs(a, b, MEASURED).tolist() == pairs(a, b, BY_SHAPE).tolist() == pairs(a, b, IDENTIFIED).tolist() == []
    assert partners(a, known([], np.zeros((0, 2))), NEAREST).tolist() == [-1]


def test_axial_stays_axial():
    """An axial and a rocking mode that nearly coincide in frequency and shape at the sensors change places by shape, not by kind."""
    a = known([100.0, 101.0], [[1.0, 0.1], [0.1, 1.0]], ["axial", "rocking"])
    b = known([100.0, 101.0], [[0.1, 1.0], [1.0, 0.1]], ["axial", "rocking"])
    assert partners(a, b, BY_SHAPE).tolist() == [1, 0]
    assert partners(a, b, FOLLOWED_BY_KIND).tolist() == [0, 1]
    assert partners(a, known([100.0], [[0.1, 1.0]], ["axial"]), FOLLOWED_BY_KIND).tolist() == [0, -1]


def test_what_moves_far_goes_by_shape():
    """Modes that pass others on their way keep their shapes, pairs that lie close may turn in their
    plane, and what is like none has no partner."""
    a = known([100.0, 120.0, 200.0, 201.0], np.eye(5)[:4])
    turned = np.array([[1.0, 1.0], [1.0, -1.0]]) / np.sqrt(2)
    b = known([121.0, 150.0, 230.0, 230.5], np.block([[np.eye(5)[1:2]], [np.eye(5)[:1]], [np.zeros((2, 2)), turned, np.zeros((2, 1))]]))
    assert partners(a, b, BY_SHAPE)[:2].tolist() == [1, 0]
    assert sorted(partners(a, b, BY_SHAPE)[2:]) == [2, 3]
    other = known([121.0, 100.0], np.eye(5)[[1, 4]])
    assert partners(a, other, BY_SHAPE).tolist() == [-1, 0, -1, -1]


def test_kinds_stand_for_shapes_that_are_not_known():
    a = ModeSet(np.array([100.0, 104.0]), None, ["rocking", "axial"])
    b = known([101.0, 105.0], np.eye(2), ["axial", "rocking"])
    assert partners(a, b, COMPARED).tolist() == [1, 0]


def test_one_mode_far_off_does_not_move_all_by_one_place():
    """Shapes tell nothing and the first of three modes is 20 % low; by squares all would rather take the next one up."""
    shape = np.ones((4, 1))
    a, b = known([100.0, 110.0, 121.0], shape[:3]), known([80.0, 110.0, 121.0, 133.1], shape)
    assert partners(a, b, COMPARED).tolist() == [0, 1, 2]
    assert partners(a, b, Policy(width=0.08)).tolist() == [1, 2, 3]


BAR = np.array([51.5, 142.2, 278.7, 460.4, 687.2, 958.5])
"""A free bar's measured frequencies, Hz; a model of it has all 1.1 to 1.5 % too low."""
TOO_LOW = 1 - np.array([0.011, 0.0126, 0.0133, 0.0139, 0.0146, 0.0151])


def bar(disturbance: float, strength: ArrayLike, above: ArrayLike = ()) -> tuple[ModeSet, ModeSet]:
    """A bar measured at three points near one end, which all its modes move alike, with a pole that
    is none of its, and a model of it with modes above the band."""
    f, computed = np.append(BAR, disturbance), np.append(BAR * TOO_LOW, above)
    order = np.argsort(f)
    measured = ModeSet(f[order], np.ones((7, 3), complex), (), np.append(np.ones(6), strength)[order])
    return measured, ModeSet(computed, np.ones((len(computed), 3), complex), ["lateral"] * len(computed), np.full(len(computed), 40.0))


def test_where_shapes_do_not_tell_what_all_modes_share_does():
    """900.9 Hz lies 4.8 % from a computed mode, 958.5 Hz 1.5 % as all others, and would else be left to one 31 % above it."""
    measured, computed = bar(900.9, 1.0, (1254.0, 1607.0))
    assert partners(measured, computed, replace(COMPARED, alike=-1.0)).tolist() == list(range(7))
    assert partners(measured, computed, COMPARED).tolist() == [0, 1, 2, 3, 4, -1, 5]


def test_where_frequencies_do_not_tell_either_strength_does():
    """0.2 % apart, one of them a hundred times weaker; another unit makes all stronger alike, and says nothing."""
    for disturbance, partner in ((956.5, [0, 1, 2, 3, 4, -1, 5]), (960.5, [0, 1, 2, 3, 4, 5, -1])):
        assert partners(*bar(disturbance, 0.01), COMPARED).tolist() == partner
    assert partners(*bar(956.5, 0.9), COMPARED).tolist() == [0, 1, 2, 3, 4, 5, -1]  # as strong: the nearest stays


def test_shapes_that_tell_are_not_overruled():
    """The same frequencies, but the disturbance alone has the shape of the computed mode."""
    measured, computed = bar(900.9, 1.0)
    shape = np.array(measured.shape)
    shape[6] = [1.0, -1.0, 0.0]
    assert partners(replace(measured, shape=shape), computed, COMPARED).tolist() == [0, 1, 2, 3, 4, 5, -1]


def test_close_modes_keep_their_order_unless_their_shapes_are_trusted():
    """Two rocking modes 1 % apart with swapped shapes: by order, or by shape; an axial mode between them is no part of the pair."""
    a = known([100.0, 101.0, 150.0], np.eye(3), ["rocking", "rocking", "axial"])
    b = known([100.0, 101.0, 150.0], np.eye(3)[[1, 0, 2]], ["rocking", "rocking", "axial"])
    by_shape = partners(a, b, IDENTIFIED)
    assert by_shape.tolist() == [1, 0, 2]
    assert in_order(by_shape, a, b, close=0.03).tolist() == [0, 1, 2]
    assert in_order(by_shape, a, b, close=0.03, trusted=0.3).tolist() == [1, 0, 2]
    assert in_order(by_shape, a, b, close=0.005).tolist() == [1, 0, 2]
    assert by_shape.tolist() == [1, 0, 2]  # the argument stays as it was


def test_a_pair_that_has_come_apart_is_not_put_in_order():
    """Close in both sets, shapes that turned in their plane are chance and the order of frequencies counts; apart in one, shapes count."""
    a = known([1000.0, 1001.0], np.eye(2), ["tilt", "tilt"])
    close, apart = (known([1000.0, f], np.eye(2), ["tilt", "tilt"]) for f in (1002.0, 1100.0))
    crossed = np.array([1, 0])
    assert kept_in_order(crossed, a, close, close=0.03).tolist() == [0, 1]
    assert kept_in_order(crossed, a, apart, close=0.03).tolist() == [1, 0]
    axial = known([1000.0, 1002.0], np.eye(2), ["axial", "tilt"])
    assert kept_in_order(crossed, a, axial, close=0.03).tolist() == [1, 0]


def test_repeats_ask_for_a_likeness_of_shape():
    """A MAC of 0.36 makes two modes the same, of 0.25 not; nor does any far away in frequency."""
    a = known([1000.0], np.array([[1.0, 0.0]]))
    like, unlike = (known([1000.0], np.array([[c, np.sqrt(1 - c**2)]])) for c in (0.6, 0.5))
    assert pairs(a, like, REPEATED).tolist() == [[0, 0]]
    assert pairs(a, unlike, REPEATED).tolist() == []
    assert pairs(a, known([1400.0], np.array([[1.0, 0.0]])), REPEATED).tolist() == []


def test_shapes_are_compared_at_the_points_that_both_have():
    """In one order, whatever points else a test has; nothing where none is shared."""
    a, b = known([100.0], np.array([[1.0, 2.0, 3.0]])), known([100.0], np.array([[9.0, 3.0, 1.0]]))
    first, second = at_shared(a, b, (11, 12, 13), (20, 13, 11))
    assert first.shape.tolist() == second.shape.tolist() == [[1.0, 3.0]]
    assert [m.shape for m in at_shared(a, b, (11, 12, 13), (1, 2, 3))] == [None, None]
    assert at_shared(a, b, (11, 12, 13), (11, 12, 13)) == (a, b)
