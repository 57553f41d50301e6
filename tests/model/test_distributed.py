"""Mass that is spread along shafts: what it weighs, and how closely a coarse mesh then answers, against closed forms and finer meshes."""

from __future__ import annotations

from dataclasses import replace
from itertools import product

import numpy as np
import pytest
from scipy.linalg import eigh

from tests.model.test_beam import EULER, RHO, STEEL, E, shaft
from tests.model.test_beam import frequencies as at_nodes
from thermospindle.model.rotor.beam import with_shafts
from thermospindle.model.rotor.chain import Element, RotorBase, joint_element, matrices
from thermospindle.model.rotor.distributed import spread
from thermospindle.model.shaft import Shaft
from thermospindle.model.structure import Structure


def whole(s: Shaft, spring: float = 0.0, speed: float = 0.0):
    """M, N, C + G, K of a shaft, on a spring at its middle node where asked, and its chain."""
    structure = with_shafts(Structure((), (), 100.0, shafts=(s,)), STEEL, 20.0)
    joints = [joint_element(structure, i) for i in range(len(structure.joints))]
    middle = s.nodes[len(s.nodes) // 2]
    seat = Element("seat", "bearings", "ground", s.node_at(middle), middle, np.diag([spring, spring, 0.0, 0.0, 0.0]), np.zeros((5, 5)))
    chain = RotorBase(structure.bodies, (*joints, seat), speed)
    linear = matrices(chain)
    mass, quartic, gyroscopic = spread(structure, STEEL, 20.0, chain.layout)
    return linear.mass + mass, quartic, linear.damping + speed * gyroscopic, linear.stiffness, chain


def frequencies(s: Shaft, spring: float = 0.0) -> np.ndarray:
    """Hz in the x-z plane, without rigid motion: K v = w^2 (M + w^2 N) v, mode by mode."""
    m, n, _, k, chain = whole(s, spring)
    own = [i for i, (_, move) in enumerate(chain.dofs) if move in ("x", "tilt_y")]
    m, n, k = (a[np.ix_(own, own)] for a in (m, n, k))
    found = []
    for i in range(2, 8):
        square = 0.0
        for _ in range(30):
            square = eigh(k, m + square * n, eigvals_only=True, subset_by_index=[i, i])[0]
        found.append(np.sqrt(square) / (2 * np.pi))
    return np.array(found)


@pytest.mark.parametrize(("radius", "shear"), list(product([(0.02, 0.02), (0.03, 0.015)], [0.0, 1.0])))
def test_it_weighs_and_resists_turning_as_the_shaft_does(radius, shear):
    """Mass, first moment and moment of inertia about the lower end, of a cylinder and of a cone: a rigid motion knows no mesh."""
    s = replace(shaft(radius=radius, count=3, shear=shear, rotary=1.0), turns=True)
    m, n, g, _, chain = whole(s, speed=100.0)
    rigid = np.zeros((len(chain.dofs), 4))
    for k, (body, move) in enumerate(chain.dofs):
        z = chain.body(body).z
        rigid[k] = {"x": (1, z, 0, 0), "tilt_y": (0, 1, 0, 0), "y": (0, 0, 1, z), "tilt_x": (0, 0, 0, -1)}.get(move, (0, 0, 0, 0))
    z = (np.arange(20000) + 0.5) / 20000 * 1.3
    r = radius[0] + (radius[1] - radius[0]) * z / 1.3
    line, about = RHO * np.pi * r**2 * 1.3 / 20000, RHO * np.pi / 4 * r**4 * 1.3 / 20000
    expected = [[line.sum(), (line * z).sum()], [(line * z).sum(), (line * z**2 + about).sum()]]
    assert rigid[:, :2].T @ m @ rigid[:, :2] == pytest.approx(np.array(expected), rel=1e-4)
    polar = rigid[:, 3] @ g @ rigid[:, 1]  # the moment about x that tilting about y makes
    assert abs(polar) == pytest.approx(100.0 * 2 * about.sum(), rel=1e-4)
    assert g == pytest.approx(-g.T)
    assert np.linalg.eigvalsh(n).min() > -1e-9 * np.linalg.norm(n)


def test_free_beam_of_few_elements():
    """The closed form, which lumps of as many elements miss by a hundredth (`test_beam`)."""
    d, length = 0.04, 1.3
    exact = np.sqrt(E * np.pi * d**4 / 64 / (RHO * np.pi * d**2 / 4)) / (2 * np.pi * length**2) * np.array(EULER["free"]) ** 2
    assert frequencies(shaft(count=10))[:4] == pytest.approx(exact, rel=5e-5)


@pytest.mark.parametrize("spring", [0.0, 5e9])
def test_a_thick_beam_converges_with_the_fourth_power(spring):
    """Free, and on a spring in its middle, at which it shears: halving elements takes 11 at least
    off every mode's error; lumps are of the second power."""
    thick = {"radius": (0.06, 0.06), "bore": (0.02, 0.02), "length": 0.6, "shear": 1.0, "rotary": 1.0}
    fine = frequencies(shaft(count=160, **thick), spring)
    errors = [np.abs(frequencies(shaft(count=n, **thick), spring) / fine - 1) for n in (10, 20, 40)]
    assert np.all(errors[0][1:] > 11 * errors[1][1:])
    assert np.all(errors[1][1:] > 11 * errors[2][1:])
    assert errors[2].max() < 1.5e-4
    if not spring:
        assert np.all(20 * errors[2] < np.abs(at_nodes(shaft(count=40, **thick))[:6] / fine - 1))


def test_shafts_that_move_in_one_direction_alone():
    """A housing without moves across gets mass along the axis only."""
    s = shaft(count=4)
    axial = Shaft("s", s.segments, s.nodes, False, 1.0, 0.0, moves=("z",))
    structure = with_shafts(Structure((), (), 100.0, shafts=(axial,)), STEEL, 20.0)
    chain = RotorBase(structure.bodies, (), 0.0)
    mass, quartic, gyroscopic = spread(structure, STEEL, 20.0, chain.layout)
    assert not gyroscopic.any()
    assert mass.shape == quartic.shape == (5, 5)
    assert mass.sum() == pytest.approx(0.0, abs=1e-9)  # what lumps weigh together already
