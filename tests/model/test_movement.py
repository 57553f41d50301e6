"""How far rings move: Newton's method against bracketing, which shares no step with it."""

from dataclasses import replace

import numpy as np
import pytest

from thermospindle.model.bearing.ball_row import BallInertia, BallRow, respond
from thermospindle.model.bearing.centred import centred_axial
from thermospindle.model.bearing.movement import NEAR, REACH, Rings, Sleeve, _bracketed, _near, equilibrium

ROW = BallRow(16, 1.0e-3, 0.42e-3, 0.53e-3, 0.545e-3, 8e9, 9e9, 25e-3)
HEAVY = replace(ROW, inertia=BallInertia(7e-3, 50e-3, 7800.0, 2000.0, 0.0))


def mirrored(row: BallRow, more: float = 0.0) -> BallRow:
    """Loaded the other way, its groove centres farther apart by `more`."""
    return replace(row, axial=-row.axial - more)


def machines(row: BallRow) -> dict[str, Rings]:
    return {
        "opposed": Rings(((row, 1), (mirrored(row, 2e-6), 1)), (), 0.0),
        "under a load": Rings(((row, 1), (mirrored(row), 1)), (), 40.0),
        "carried the other way": Rings(((row, 1), (row, -1)), (), -25.0),
        "on a spring": Rings(((row, 1), (row, 1)), (Sleeve((mirrored(row),), 1, -300.0, 2e6),), 0.0),
        "on a constant force": Rings(((row, 1), (row, 1)), (Sleeve((mirrored(row), mirrored(row, 1e-6)), 1, -300.0, 0.0),), 10.0),
        "on two springs": Rings(((row, 1),), (Sleeve((mirrored(row),), 1, -200.0, 1e6), Sleeve((row,), -1, 150.0, 3e7)), 0.0),
    }


@pytest.mark.parametrize("row", [ROW, HEAVY], ids=["massless", "heavy"])
@pytest.mark.parametrize("name", list(machines(ROW)))
def test_steps_arrive_where_brackets_close(name, row):
    rings = machines(row)[name]
    nowhere = (0.0,) * (1 + len(rings.sleeves))
    bracketed = _bracketed(rings, nowhere, REACH, {})
    assert abs(bracketed[0]) > 1e-8
    stepped = _near(rings, equilibrium(rings.massless, {}), {})
    assert stepped == pytest.approx(bracketed, abs=2e-16)
    assert equilibrium(rings, {}) == pytest.approx(bracketed, abs=2e-16)
    assert _bracketed(rings, stepped, NEAR, {}) == pytest.approx(bracketed, abs=2e-16)


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
    monkeypatch.setattr("thermospindle.model.bearing.movement.centred_axial_force", None)
    for name, rings in machines(HEAVY).items():
        asked.clear()
        equilibrium(rings, {})
        rows = len(rings.fixed) + sum(len(s.rows) for s in rings.sleeves)
        assert len(asked) <= 16 * rows, name


def test_what_nothing_presses_is_found_by_brackets():
    """No slope tells where to go: two rows that their grooves leave some um of play each."""
    loose = replace(ROW, axial=ROW.axial - 30e-6)
    rings = Rings(((loose, 1), (mirrored(loose), 1)), (), 0.0)
    assert _near(rings, (0.0,), {}) is None
    (hub,) = equilibrium(rings, {})
    assert centred_axial(loose, hub)[0] + centred_axial(mirrored(loose), hub)[0] == pytest.approx(0.0, abs=1e-9)
    (pushed,) = equilibrium(replace(rings, load=30.0), {})
    assert centred_axial(loose, pushed)[0] + centred_axial(mirrored(loose), pushed)[0] == pytest.approx(30.0, rel=1e-9)
