"""Shafts of rectangular section: both planes against closed forms, mass, meshes, and what is refused."""

from __future__ import annotations

import tomllib

import numpy as np
import pytest

from tests.conftest import ROOT
from tests.literature.test_rotors import chain
from thermospindle.model.errors import BadInput
from thermospindle.model.rotor.chain import matrices
from thermospindle.model.rotor.distributed import spread
from thermospindle.model.rotor.look.meshes import shaft_meshes
from thermospindle.model.rotor.modes import modes
from thermospindle.model.rotor.poles import poles_below
from thermospindle.model.scene.reading import build
from thermospindle.model.units import RPM
from thermospindle.report.check.odd import off

E, NU, RHO, L, W, H = 207e9, 0.3, 7850.0, 1.3, 0.04, 0.01
BENDING = np.array([4.730040744862704, 7.853204624095838, 10.99560783800167])
"""Roots of cos x cosh x = 1: a free beam's wave numbers times its length."""


def bar(**keys):
    """The free shaft of the shipped scene as a flat bar that moves in both planes, and keys of the shaft."""
    path = ROOT / "scenes" / "free_shaft" / "spindle.toml"
    raw = tomllib.loads(path.read_text())
    shaft = raw["shafts"][0]
    del shaft["outer_mm"], shaft["moves"]
    shaft |= {"width_mm": [[1e3 * W, 1e3 * L]], "height_mm": [[1e3 * H, 1e3 * L]]} | keys
    raw["shafts"][0] = {k: v for k, v in shaft.items() if v is not None}
    return build(raw, path)


def bending(side: float) -> np.ndarray:
    """Bending frequencies (3,) Hz of a free Euler-Bernoulli bar with this side in the plane."""
    return BENDING**2 / (2 * np.pi * L**2) * np.sqrt(E * side**2 / 12 / RHO)


def in_plane(made, found, move: str) -> np.ndarray:
    """Frequencies of those of `found`, poles and vectors, that move this way most."""
    value, shape = found
    own = [i for i, (_, m) in enumerate(made.dofs) if m == move]
    across = [i for i, (_, m) in enumerate(made.dofs) if m in ("x", "y", "z")]
    share = (np.abs(shape[own]) ** 2).sum(0) / (np.abs(shape[across]) ** 2).sum(0)
    return np.abs(value[share > 0.5]) / (2 * np.pi)


@pytest.mark.parametrize(("move", "side"), [("x", W), ("y", H)], ids=["width", "height"])
def test_a_free_bar_bends_in_each_plane_as_its_closed_form(move, side):
    """With lumps at the nodes of 52 elements to 1e-3, with masses along 10 elements to 1e-4."""
    made = chain(bar())
    linear = matrices(made)
    assert in_plane(made, poles_below(linear, 2500.0), move)[:3] == pytest.approx(bending(side), rel=1e-3)
    spindle = bar(longest_element_mm=130.0)
    coarse = chain(spindle)
    between = spread(spindle.structure, spindle.materials, 20.0, coarse.layout)
    added = between[0], between[1], np.zeros_like(between[2])
    assert in_plane(coarse, poles_below(matrices(coarse), 1500.0, added), move)[:3] == pytest.approx(bending(side), rel=1e-4)


def test_an_element_is_timoshenkos_in_each_plane():
    """12 E I / (l^3 (1 + phi)) and E I / l with I = h w^3 / 12 and w h^3 / 12, Cowper's 10 (1 + nu) / (12 + 11 nu) for both, E A / l."""
    spindle = bar(beam="timoshenko", longest_element_mm=100.0)
    element, length = spindle.structure.joints[0], L / 13
    shear = 10 * (1 + NU) / (12 + 11 * NU) * E / (2 * (1 + NU)) * W * H
    across, tilts = [], []
    for moment in (H * W**3 / 12, W * H**3 / 12):
        across.append(12 * E * moment / (length**3 * (1 + 12 * E * moment / (shear * length**2))))
        tilts.append(E * moment / length)
    assert element.stiffness == pytest.approx((*across, E * W * H / length, tilts[1], tilts[0]), rel=1e-9)


def test_mass_and_rotary_inertia():
    spindle = bar(beam="timoshenko")
    bodies = spindle.structure.bodies
    assert sum(b.mass for b in bodies) == pytest.approx(RHO * W * H * L)
    for axis, second in ((0, H), (1, W)):  # about x what lies along y counts
        assert sum(b.inertia[axis] for b in bodies) == pytest.approx(RHO * L * W * H * second**2 / 12)
    assert bodies[3].inertia[2] == pytest.approx(bodies[3].inertia[0] + bodies[3].inertia[1])


def test_steps_have_nodes_and_volumes_are_exact():
    """A bar that becomes flatter at 333 mm, where no node would be."""
    spindle = bar(width_mm=[[40, 333], [30, 967]], height_mm=[[10, 333], [5, 967]])
    assert any(abs(z - 0.333) < 1e-9 for z in spindle.structure.shafts[0].nodes)
    volume = 0.0
    for mesh in shaft_meshes(spindle):
        a, b, c = (mesh.vertices[mesh.triangles[:, i]] for i in range(3))
        volume += float(np.sum(np.cross(a, b) * c)) / 6
    assert volume == pytest.approx(0.04 * 0.01 * 0.333 + 0.03 * 0.005 * 0.967)


def test_a_square_one_may_turn():
    spindle = bar(width_mm=[[20, 1300]], height_mm=[[20, 1300]], turns=True)
    low, high = [m for m in modes(chain(spindle, 6000 * RPM)) if m.kind == "lateral"][:2]
    assert (low.whirl, high.whirl) == ("backward", "forward")
    assert low.frequency * high.frequency == pytest.approx(bending(0.02)[0] ** 2, rel=2e-3)


def test_points_lie_on_its_sides():
    spindle = bar()
    p = spindle.points[0]
    for x, y, distance in ((20.0, 5.0, 0.0), (0.0, 9.0, 4.0), (23.0, 9.0, 5.0)):
        assert 1e3 * off(spindle, type(p)(**{**p.__dict__, "position": (1e-3 * x, 1e-3 * y, p.position[2])})) == pytest.approx(distance)


@pytest.mark.parametrize(
    ("keys", "said"),
    [
        ({"height_mm": None}, "width_mm told; allowed are outer_mm alone, or width_mm .* with height_mm"),
        ({"outer_mm": [[20, 1300]]}, "outer_mm and width_mm and height_mm told"),
        ({"width_mm": None, "height_mm": None}, "no section told"),
        ({"bore_mm": [[5, 1300]]}, "bore_mm is of a round section"),
        ({"width_mm": [[40, 30, 1300]]}, "a piece of a rectangular section is .side, length. in mm, without taper"),
        ({"height_mm": [[10, 1200]]}, "height_mm is 1200 mm long and width_mm 1300 mm"),
        ({"turns": True}, "width_mm and height_mm of a shaft that turns must be the same"),
    ],
    ids=["one side", "round too", "none", "bore", "taper", "short", "turning"],
)
def test_refused(keys, said):
    with pytest.raises(BadInput, match=said):
        bar(**keys)
