"""How far rings move: Newton's method against brackets within brackets, which share no step with it."""

from dataclasses import dataclass, replace

import numpy as np
import pytest
from scipy.optimize import brentq

from thermospindle.model.bearing.ball_row import BallInertia, BallRow, respond
from thermospindle.model.bearing.centred import centred_axial, centred_axial_force
from thermospindle.model.bearing.movement import Balance, balanced

ROW = BallRow(16, 1.0e-3, 0.42e-3, 0.53e-3, 0.545e-3, 8e9, 9e9, 25e-3)
HEAVY = replace(ROW, inertia=BallInertia(7e-3, 50e-3, 7800.0, 2000.0, 0.0))


def mirrored(row: BallRow, more: float = 0.0) -> BallRow:
    """Loaded the other way, its groove centres farther apart by `more`."""
    return replace(row, axial=-row.axial - more)


@dataclass(frozen=True)
class Sleeve:
    """Rows whose rings slide together on a spring: whether they go with the hub (1) or against it (-1), its push (N) and its rate (N/m)."""

    rows: tuple[BallRow, ...]
    towards: int
    push: float
    rate: float


@dataclass(frozen=True)
class Rings:
    """What one movement of a hub balances: rows whose outer rings it moves with it (1) or against
    it (-1), rows on sleeves, and the load on it (N)."""

    fixed: tuple[tuple[BallRow, int], ...]
    sleeves: tuple[Sleeve, ...] = ()
    load: float = 0.0

    @property
    def rows(self) -> dict[str, BallRow]:
        return {str(k): row for k, row in enumerate([*(row for row, _ in self.fixed), *(row for s in self.sleeves for row in s.rows)])}

    @property
    def balance(self) -> Balance:
        n = 1 + len(self.sleeves)
        ways = np.eye(n)
        motion, stiffness, force = [towards * ways[0] for _, towards in self.fixed], np.zeros((n, n)), self.load * ways[0]
        for way, s in zip(ways[1:], self.sleeves, strict=True):
            motion += [way] * len(s.rows)
            squeezed = way - s.towards * ways[0]
            stiffness += s.rate * np.outer(squeezed, squeezed)
            force += s.push * squeezed
        return Balance(tuple(self.rows), np.array(motion), stiffness, force)

    def bracketed(self) -> list[float]:
        """Movement (m) of every row: forces rise with their movement."""

        def root(imbalance) -> float:
            return brentq(imbalance, -1e-4, 1e-4, xtol=1e-17, rtol=1e-14)

        def slid(s: Sleeve, hub: float) -> float:
            return root(lambda r: sum(centred_axial_force(row, r, {}) for row in s.rows) + s.rate * (r - s.towards * hub) - s.push)

        def pull(s: Sleeve, hub: float) -> float:
            return s.push - s.rate * (slid(s, hub) - s.towards * hub)

        hub = root(lambda h: sum(w * centred_axial_force(row, w * h, {}) for row, w in self.fixed) + sum(s.towards * pull(s, h) for s in self.sleeves) - self.load)
        return [*(w * hub for _, w in self.fixed), *(slid(s, hub) for s in self.sleeves for _ in s.rows)]

    def stepped(self) -> list[float]:
        return list(balanced(self.balance, self.rows, {}).values())


def machines(row: BallRow) -> dict[str, Rings]:
    return {
        "opposed": Rings(((row, 1), (mirrored(row, 2e-6), 1))),
        "under a load": Rings(((row, 1), (mirrored(row), 1)), load=40.0),
        "carried the other way": Rings(((row, 1), (row, -1)), load=-25.0),
        "on a spring": Rings(((row, 1), (row, 1)), (Sleeve((mirrored(row),), 1, -300.0, 2e6),)),
        "on a constant force": Rings(((row, 1), (row, 1)), (Sleeve((mirrored(row), mirrored(row, 1e-6)), 1, -300.0, 0.0),), 10.0),
        "on two springs": Rings(((row, 1),), (Sleeve((mirrored(row),), 1, -200.0, 1e6), Sleeve((row,), -1, 150.0, 3e7))),
    }


@pytest.mark.parametrize("row", [ROW, HEAVY], ids=["massless", "heavy"])
@pytest.mark.parametrize("name", list(machines(ROW)))
def test_steps_arrive_where_brackets_close(name, row):
    rings = machines(row)[name]
    bracketed = rings.bracketed()
    assert abs(bracketed[0]) > 1e-8
    assert rings.stepped() == pytest.approx(bracketed, abs=2e-16)


@pytest.mark.parametrize("row", [ROW, HEAVY], ids=["massless", "heavy"])
@pytest.mark.parametrize("movement", [-1e-6, 0.0, 5e-6])
def test_the_slope_is_the_forces_derivative(row, movement):
    _, slope = centred_axial(row, movement)
    ends = [centred_axial(row, movement + step)[0] for step in (-1e-10, 1e-10)]
    assert slope == pytest.approx(np.diff(ends)[0] / 2e-10, rel=1e-6)
    assert slope == pytest.approx(respond(replace(row, axial=row.axial + movement)).tangent[2, 2], rel=1e-9)


def test_few_places_are_asked(monkeypatch):
    """Sleeves within a hub: brackets within brackets ask for their forces hundreds of times."""
    asked = []
    monkeypatch.setattr("thermospindle.model.bearing.movement.centred_axial", lambda *given: asked.append(given) or centred_axial(*given))
    for name, rings in machines(HEAVY).items():
        asked.clear()
        rings.stepped()
        assert len(asked) <= 16 * len(rings.rows), name


LOOSE = replace(ROW, axial=ROW.axial - 30e-6)


def test_what_nothing_presses_stays():
    """Two rows that their grooves leave some um of play each: any place within it is in balance."""
    assert Rings(((LOOSE, 1), (mirrored(LOOSE), 1))).stepped() == [0.0, 0.0]


@pytest.mark.parametrize("pressed", [1e-6, 20e-6])
def test_what_has_play_hangs_loose(pressed):
    """One row is pressed, and its play is the other's: it leaves it for good, and no stiffness of a
    few N/m stays. Of steps that come near its end none reached it."""
    row = replace(ROW, axial=ROW.axial + pressed)
    rings = Rings(((row, 1), (replace(mirrored(ROW), axial=-ROW.axial + 100e-6), 1)))
    moved = rings.stepped()
    for row, m in zip(rings.rows.values(), moved, strict=True):
        assert centred_axial(row, m) == (0.0, 0.0)


@pytest.mark.parametrize("load", [30.0, -30.0, 1e-3])
def test_what_hangs_loose_goes_where_it_is_pushed(load):
    """No slope tells how far. Of many carriers such rows were said to be in balance where they hung."""
    rings = Rings(((LOOSE, 1), (mirrored(LOOSE), 1)), load=load)
    moved = rings.stepped()
    assert sum(centred_axial(row, m)[0] for row, m in zip(rings.rows.values(), moved, strict=True)) == pytest.approx(load, rel=1e-9)
    assert moved == pytest.approx(rings.bracketed(), abs=1e-15)


def test_a_loose_sleeve_is_pushed_by_its_spring():
    rings = Rings(((LOOSE, 1),), (Sleeve((mirrored(LOOSE),), 1, -120.0, 0.0),))
    assert [abs(centred_axial(row, m)[0]) for row, m in zip(rings.rows.values(), rings.stepped(), strict=True)] == pytest.approx([120.0, 120.0], rel=1e-9)
