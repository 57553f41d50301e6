"""The shaft as a beam, against beam theory, a sliced shaft and complex stiffness."""

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from scipy.integrate import quad

from tests.effect_points import NONE, REST, RUNNING, at, frequencies, undamped
from thermospindle.model.machine import Condition
from thermospindle.model.rotor.chain import Element, RotorBase, matrices
from thermospindle.model.rotor.modes import modes
from thermospindle.model.structure import Body, with_mass
from thermospindle.sim.effects.roles import in_series
from thermospindle.sim.effects.structure import shaft_bending, support_anisotropy
from thermospindle.sim.effects.structure.shaft_bending import Piece
from thermospindle.sim.operating import operating_point

STEEL = (208e9, 0.3)


def cantilever(length, bending, shear, tension):
    """Textbook flexibility of a beam clamped at its lower end: tip motion by tip loads, order x, y, z, tilt_x, tilt_y."""
    lateral, cross, tilt = length**3 / (3 * bending) + length / shear, length**2 / (2 * bending), length / bending
    found = np.diag([lateral, lateral, length / tension, tilt, tilt])
    found[0, 4] = found[4, 0] = cross  # a push along x tilts about y
    found[1, 3] = found[3, 1] = -cross  # a push along y tilts about -x
    return found


def test_shaft_bending_of_a_uniform_beam(spindle):
    """The reference shaft, 5 mm steel: EI = 6.381 N m2, kappa = 0.886 (Cowper's full circle, nu = 0.3), EA = 4.084e6 N."""
    beam = shaft_bending.pieces(spindle, 20.0)
    bending = STEEL[0] * np.pi / 4 * 2.5e-3**4
    tension = STEEL[0] * np.pi * 2.5e-3**2
    shear = 6 * 1.3 / (7 + 6 * 0.3) * tension / 2.6
    found = shaft_bending.flexibility(beam, 5e-3, 16.5e-3)
    assert found == pytest.approx(cantilever(11.5e-3, bending, shear, tension), rel=1e-9, abs=1e-20)


def test_the_far_bearing_is_met_through_the_bent_shaft(spindle):
    """Its compliance and 0.3 of that of the drawn 5 mm steel between the bearings add up; the near one is met as it is."""
    plain, bent = (at(spindle, Condition(20.0), shaft_bending, scale=scale).chain for scale in (0.0, 0.3))
    bending, tension = STEEL[0] * np.pi / 4 * 2.5e-3**4, STEEL[0] * np.pi * 2.5e-3**2
    near, far = sorted(spindle.bearings, key=lambda b: b.z)
    added = 0.3 * cantilever(far.z - near.z, bending, 6 * 1.3 / (7 + 6 * 0.3) * tension / 2.6, tension)
    (a, b), (c, d) = ([next(e.stiffness for e in own.elements if e.name == name) for own in (plain, bent)] for name in (far.name, near.name))
    assert np.linalg.inv(b) - np.linalg.inv(a) == pytest.approx(added, rel=1e-6, abs=1e-6 * np.abs(added).max())
    assert d == pytest.approx(c)


def test_shaft_bending_hanging_down_is_the_mirror_image(spindle):
    beam = shaft_bending.pieces(spindle, 20.0)
    up, down = shaft_bending.flexibility(beam, 5e-3, 16.5e-3), shaft_bending.flexibility(beam, 16.5e-3, 5e-3)
    mirror = np.diag([1, 1, -1, -1, -1])  # z -> -z turns tilts about x and y round
    assert down == pytest.approx(mirror @ up @ mirror, rel=1e-12)


def test_shaft_bending_of_a_stepped_beam():
    """Superposition by quadrature of the unit-load theorem over a beam of three pieces."""
    beam = [Piece((0.0, 4e-3), 6.0, 2e6, 4e6), Piece((4e-3, 9e-3), 2.0, 1e6, 2e6), Piece((9e-3, 15e-3), 9.0, 3e6, 6e6)]

    def inverse(name):
        return lambda z: 1 / getattr(next(p for p in beam if p.z[0] <= z <= p.z[1]), name)

    tip, steps = 12e-3, [4e-3, 9e-3]
    lateral = quad(lambda z: (tip - z) ** 2 * inverse("bending")(z) + inverse("shear")(z), 1e-3, tip, points=steps)[0]
    cross = quad(lambda z: (tip - z) * inverse("bending")(z), 1e-3, tip, points=steps)[0]
    found = shaft_bending.flexibility(beam, 1e-3, tip)
    assert found[0, 0] == pytest.approx(lateral, rel=1e-9)
    assert (found[0, 4], found[1, 3]) == pytest.approx((cross, -cross), rel=1e-9)


def beam_chain(length, bending, density_area, count):
    """A slender cantilever of `count` rigid slices joined by the effect's beam elements between their middles."""
    beam = [Piece((0.0, length), bending, 1e15, 1e15)]
    edges = np.linspace(0, length, count + 1)
    nodes = (edges[1:] + edges[:-1]) / 2
    slice_mass = density_area * length / count
    tilt = slice_mass * (length / count) ** 2 / 12
    bodies = tuple(Body(f"s{i}", slice_mass, (tilt, tilt, tilt), z, ("x", "tilt_y"), False, ()) for i, z in enumerate(nodes))
    ends = ["ground", *(b.name for b in bodies)]
    elements = tuple(
        Element(f"e{i}", "beam", ends[i], ends[i + 1], b, np.linalg.inv(shaft_bending.flexibility(beam, a, b)), NONE)
        for i, (a, b) in enumerate(zip([0.0, *nodes[:-1]], nodes, strict=True))
    )
    return RotorBase(bodies, elements, 0.0)


@pytest.mark.parametrize(("mode", "root"), [(0, 1.875104), (1, 4.694091), (2, 7.854757)])
def test_shaft_bending_against_euler_bernoulli(mode, root):
    """f = root^2 / 2 pi sqrt(EI / rho A L^4); the error of 24 rigid slices grows as (root / 24)^2, a twentieth of it."""
    length, bending, line = 0.3, 6.4, 0.15
    found = undamped(beam_chain(length, bending, line, 24))[mode]
    assert found == pytest.approx(root**2 / (2 * np.pi) * np.sqrt(bending / (line * length**4)), rel=0.05 * (root / 24) ** 2)


def test_shaft_bending_slices_converge_at_second_order():
    exact = 1.875104**2 / (2 * np.pi) * np.sqrt(6.4 / (0.15 * 0.3**4))
    error = [abs(undamped(beam_chain(0.3, 6.4, 0.15, n))[0] / exact - 1) for n in (6, 12, 24)]
    assert error[0] / error[1] == pytest.approx(4, rel=0.1)
    assert error[1] / error[2] == pytest.approx(4, rel=0.1)


def test_shaft_bending_with_a_mass_at_its_end():
    """sqrt(3 EI / m L^3) for a point mass, by the same series rule that meets a bearing: a stiff spring at the tip changes nothing."""
    mass, length, bending = 0.05, 0.1, 6.0
    flexible = shaft_bending.flexibility([Piece((0.0, length), bending, 1e15, 1e15)], 0.0, length)
    stiff = Element("tip", "beam", "ground", "mass", length, np.diag([1e13, 1e13, 1e13, 0, 0]), NONE)
    body = Body("mass", mass, (0.0, 0.0, 0.0), length, ("x",), False, ())
    found = undamped(RotorBase((body,), (in_series(stiff, flexible),), 0.0))[0]
    assert found == pytest.approx(np.sqrt(3 * bending / (mass * length**3)) / (2 * np.pi), rel=1e-6)


def test_shaft_bending_damping_against_complex_stiffness(spindle):
    """(K + i w D)^-1 and F in series: the imaginary part of the inverse of their sum, for damping so small that first order is all."""
    bearing = next(e for e in operating_point(spindle, REST, ()).chain.elements if e.name == "upper")
    flexible = shaft_bending.flexibility(shaft_bending.pieces(spindle, 60.0), 5e-3, 16.5e-3)
    found = in_series(bearing, flexible)
    small = 1e-6
    exact = np.linalg.inv(np.linalg.inv(bearing.stiffness + 1j * small * bearing.damping) + flexible)
    assert found.stiffness == pytest.approx(exact.real, rel=1e-9, abs=1e-6)
    assert found.damping == pytest.approx(exact.imag / small, rel=1e-6, abs=1e-9)
    assert found.damping[0, 0] < 0.8 * bearing.damping[0, 0]


def test_shaft_bending_moves_elements_without_changing_them(spindle):
    """The flange told at another height is the same element: equal matrices."""
    chain = operating_point(spindle, REST, ()).chain
    elements = tuple(shaft_bending.moved(e, 7e-3) if e.name == "flange" else e for e in chain.elements)
    one, other = matrices(chain), matrices(replace(chain, elements=elements))
    assert other.stiffness == pytest.approx(one.stiffness, rel=1e-12, abs=1e-9 * one.stiffness.max())
    assert other.damping == pytest.approx(one.damping, rel=1e-12, abs=1e-9 * one.damping.max())


def sliced(spindle, condition, scale, slices=10):
    """The reference spindle with its shaft as rigid slices with their own masses on beam elements; the flange at 1 mm holds the first."""
    point = operating_point(spindle, condition, ())
    drawn_shaft = point.chain.body("shaft")
    beam = shaft_bending.pieces(spindle, condition.temperature)
    nodes = np.unique(np.append(np.linspace(1e-3, 16.5e-3, slices + 1), 5e-3))
    edges = np.concatenate([[-3e-3], (nodes[1:] + nodes[:-1]) / 2, [19e-3]])
    shaft, rings = spindle.region("shaft"), [spindle.region(n) for n in ("lower inner ring", "upper inner ring")]
    density = spindle.materials["steel"].density
    bodies = []
    for i, node in enumerate(nodes):
        body = Body(f"slice{i}", 0.0, (0.0, 0.0, 0.0), node, drawn_shaft.moves, False, ())
        for g in (shaft, *rings):
            a, b = max(edges[i], g.z[0]), min(edges[i + 1], g.z[1])
            if b > a:
                mass = density * np.pi * (g.r[1] ** 2 - g.r[0] ** 2) * (b - a)
                across = mass / 12 * (3 * (g.r[0] ** 2 + g.r[1] ** 2) + (b - a) ** 2)
                body = with_mass(body, mass, (a + b) / 2, (across, across, mass * (g.r[0] ** 2 + g.r[1] ** 2) / 2))
        bodies.append(body)
    assert sum(b.mass for b in bodies) == pytest.approx(drawn_shaft.mass, rel=1e-9)
    at = {z: bodies[int(np.argmin(np.abs(nodes - z)))].name for z in (1e-3, 5e-3, 16.5e-3)}
    elements = [
        Element(
            f"span{i}", "shaft", bodies[i].name, bodies[i + 1].name, b, np.linalg.inv(scale * shaft_bending.flexibility(beam, a, b)), NONE
        )
        for i, (a, b) in enumerate(pairwise(nodes))
    ]
    for e in point.chain.elements:
        name = at[{"flange": 1e-3, "lower": 5e-3, "upper": 16.5e-3}.get(e.name, 1e-3)]
        elements.append(replace(e, a=name if e.a == "shaft" else e.a, b=name if e.b == "shaft" else e.b))
    others = tuple(b for b in point.chain.bodies if b.name != "shaft")
    return replace(point.chain, bodies=(*others, *bodies), elements=tuple(elements))


@pytest.mark.parametrize("condition", [Condition(20.0), RUNNING], ids=["20C", "60C-7200rpm"])
def test_shaft_bending_against_a_sliced_shaft(spindle, condition):
    """Compliance in series and mass in one piece against twelve slices with their own: 6 % of the largest shift below 3 kHz."""
    rigid = frequencies(operating_point(spindle, condition, ()))
    exact = np.array([m.frequency for m in modes(sliced(spindle, condition, 0.3), highest=3000)])[: len(rigid)]
    found = frequencies(at(spindle, condition, shaft_bending, scale=0.3))[: len(rigid)]
    assert np.abs(exact - rigid).max() > 50
    assert np.abs(found - exact).max() < 0.06 * np.abs(exact - rigid).max()


def test_support_anisotropy_scales_a_whole_bending_plane():
    """A square beam made a rectangular one: the xz cantilever has EI (1 + s/2), the yz one EI (1 - s/2)."""
    s = 0.3
    square, strong, weak = (cantilever(11e-3, ei, 1e15, 1e15) for ei in (5.0, 5.0 * (1 + s / 2), 5.0 * (1 - s / 2)))
    uneven = support_anisotropy.unevenness(s, 0.0)
    found = uneven @ np.linalg.inv(square) @ uneven
    for plane, exact in (([0, 4], strong), ([1, 3], weak)):
        assert found[np.ix_(plane, plane)] == pytest.approx(np.linalg.inv(exact)[np.ix_(plane, plane)], rel=1e-6)


def test_a_shaft_in_series_with_a_flange_that_has_a_loss_factor_loses_nothing(spindle):
    """K (1 + i eta) and F in series: 1 / (1 / K (1 + i eta) + F), to first order eta K_s^2 / K,
    less than eta K_s by the share of the strain that is the shaft's."""
    eta, bent = 0.02, {"scale": 5.0}
    joints = tuple(replace(j, damping_ratio=0.0, loss_factor=eta if j.role == "flange" else 0.0) for j in spindle.structure.joints)
    lossy = replace(spindle, structure=replace(spindle.structure, joints=joints))
    point = operating_point(lossy, Condition(20.0), [(shaft_bending.EFFECT, bent)])
    [flange] = [e for e in point.chain.elements if e.loss_factor]
    rigid = operating_point(lossy, Condition(20.0), []).chain
    own = shaft_bending.moved(next(e for e in rigid.elements if e.name == flange.name), flange.z)
    series = np.linalg.inv(np.linalg.inv(own.stiffness * (1 + 1e-6j * eta)) + flange.lossless)
    assert flange.stiffness == pytest.approx(series.real, rel=1e-6, abs=1e-9 * np.abs(series).max())
    assert flange.lossy == pytest.approx(1e6 * series.imag, rel=1e-5, abs=1e-9 * np.abs(series).max())
    assert flange.lossy[3, 3] < 0.95 * eta * flange.stiffness[3, 3]
    uneven = operating_point(lossy, Condition(20.0), [(shaft_bending.EFFECT, bent), (support_anisotropy.EFFECT, support_anisotropy.EFFECT.neutral() | {"split": 0.5})])
    loss = next(e for e in uneven.chain.elements if e.loss_factor).lossy
    assert np.linalg.eigvalsh(loss)[0] > 0
