"""Effects on structure, inertia and the measuring chain: each against something it did not produce."""

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from scipy.integrate import quad
from scipy.special import jn_zeros

from model.machine import Body, Condition, Law
from model.modes import frf, modes, point_rows, poles
from model.pair import contact_constants
from model.rotor_base import Element, RotorBase, matrices, motion_rows
from sim.effects import (
    added_disk,
    channel_delay,
    flange_fit_loosening,
    hammer_position,
    hub_flexibility,
    modulus_softening,
    mount_compliance,
    plate_prestress,
    sensor_gain,
    sensor_mass,
    shaft_bending,
    support_anisotropy,
    window_damping,
)
from sim.effects.shaft_bending import Piece
from sim.operating import operating_point
from thermal.expansion import expand

RPM = np.pi / 30
REST, RUNNING = Condition(60.0), Condition(60.0, 7200 * RPM)
NONE = np.zeros((5, 5))
MODULES = (
    flange_fit_loosening,
    mount_compliance,
    plate_prestress,
    support_anisotropy,
    shaft_bending,
    hub_flexibility,
    added_disk,
    sensor_mass,
)


def with_effect(spindle, module, condition, **values):
    """The operating point with one effect, typical but for `values`."""
    return operating_point(spindle, condition, [(module.EFFECT, module.EFFECT.typical() | values)])


def frequencies(point, highest=3000.0):
    return np.array([m.frequency for m in modes(point.chain, highest=highest)])


def undamped(chain):
    """Natural frequencies (Hz) of a chain that need not turn."""
    value = poles(matrices(chain)).value
    return np.sort(np.abs(value[value.imag > 1e-6])) / (2 * np.pi)


def stiffness_of(point, name):
    return next(e.stiffness for e in point.chain.elements if e.name == name)


def drawn(spindle, name):
    return np.diag(next(j.stiffness for j in spindle.structure.joints if j.name == name))


def joints_ratio(spindle, point):
    """Axial stiffness of every joint over the drawing's."""
    return {j.name: stiffness_of(point, j.name)[2, 2] / j.stiffness[2] for j in spindle.structure.joints}


@pytest.mark.parametrize("module", MODULES, ids=lambda m: m.EFFECT.name)
def test_small_sizes_move_frequencies_in_proportion(spindle, module):
    """No jump at neutral, where a fit starts: halving a hundredth of the typical size halves every shift, to 3 % of the largest.

    Bearing modes are looked at apart from a close pair, which turns in its plane.
    """
    size = module.EFFECT.parameters[0]
    before = frequencies(operating_point(spindle, REST, ()))[:5]
    shift = [frequencies(with_effect(spindle, module, REST, **{size.name: x * size.typical}))[:5] - before for x in (0.01, 0.005)]
    assert np.abs(shift[0]).max() > 1e-4
    assert shift[0] / 2 == pytest.approx(shift[1], abs=0.03 * np.abs(shift[1]).max())


# ---------------------------------------------------------------- modulus


@pytest.mark.parametrize(
    ("material", "slope", "within"),
    [("aluminium", -5e-4, 1e-4), ("steel", -2.6e-4, 0.4e-4), ("steel", -3.28e-4, 0.8e-4)],
    ids=["aluminium", "steel", "Roark"],
)
def test_modulus_softening_against_handbook_slopes(spindle, material, slope, within):
    """d ln E / dT at room temperature; the range is that of alloys in handbooks. Roark's carbon steel: 203.4 GPa at 21 C, 198.6 at 93 C."""
    factor = modulus_softening.softening(spindle.materials[material], 21.0, 20.0)
    assert factor - 1 == pytest.approx(slope, abs=within)


def test_modulus_softening_scales_joints_and_contacts(spindle):
    """40 K: joints with aluminium, 1 - 40 x 5.06e-4; both contacts of steel on steel, and so the Hertz constant, with steel."""
    point = with_effect(spindle, modulus_softening, REST)
    assert list(joints_ratio(spindle, point).values()) == pytest.approx([1 - 40 * 22 * 23e-6] * 3, rel=1e-12)
    motion = expand(spindle, 60.0)["upper"]
    soft = contact_constants(point.spindle, point.spindle.bearing("upper"), motion, 0.43)
    hard = contact_constants(spindle, spindle.bearing("upper"), motion, 0.43)
    assert np.divide(soft, hard) == pytest.approx(1 - 40 * 22 * 11.5e-6, rel=1e-12)


def test_modulus_softening_of_everything_alike_scales_all_frequencies(spindle):
    """One expansion coefficient: no ring motion, one fall E(T) for all stiffness, at rest f ~ sqrt(E)."""
    same = {n: replace(m, thermal_expansion=Law((), (12e-6,))) for n, m in spindle.materials.items()}
    uniform = replace(spindle, materials=same)
    cold, hot = (frequencies(with_effect(uniform, modulus_softening, Condition(t)), 1e5) for t in (20.0, 60.0))
    size = 1 + 12e-6 * 40  # deformation grows with size: Hertz stiffness ~ E sqrt(D delta), a tenth of what is looked at
    assert hot / cold == pytest.approx(np.sqrt(1 - 22 * 12e-6 * 40), abs=1.1 * (size - 1))


@pytest.mark.parametrize("temperature", [35.0, 60.0])
def test_modulus_softening_of_rings_against_finite_elements(spindle, temperature):
    """Ring motions of a section whose moduli all fall: 0.2 nm, two thirds of the finite elements' own tolerance; they change by 8 nm."""
    material = {n: replace(modulus_softening.softened(m, 20.0, 1.0), name=n) for n, m in spindle.materials.items()}
    exact, before = expand(replace(spindle, materials=material), temperature), expand(spindle, temperature)
    effect = modulus_softening.EFFECT
    found = effect.motions(spindle, Condition(temperature), effect.typical(), before)
    for name in before:
        for end in ("inner_r", "inner_z", "outer_r", "outer_z"):
            assert getattr(found[name], end) == pytest.approx(getattr(exact[name], end), abs=2e-10)
    assert abs(exact["upper"].outer_r - before["upper"].outer_r) > 1e-9


# ---------------------------------------------------------------- joints


def test_flange_fit_loosening_against_expansion(spindle):
    """A 5 mm aluminium bore on a steel shaft opens by 5 mm (23 - 11.5) 1e-6 40 = 2.3 um over 40 K."""
    assert flange_fit_loosening.opening(spindle, 60.0) == pytest.approx(2.3e-6, rel=1e-9)
    point = with_effect(spindle, flange_fit_loosening, REST, contact_share=0.3, interference=4.6)
    ratio = joints_ratio(spindle, point)
    assert ratio["flange"] == pytest.approx(1 / (0.7 + 0.3 / 0.5), rel=1e-9)  # half the interference left
    assert (ratio["mount"], ratio["plate"]) == (1.0, 1.0)


@pytest.mark.parametrize(("temperature", "sign"), [(-20.0, 1), (20.0, 0), (60.0, -1)])
def test_flange_fit_loosening_tightens_when_cold(spindle, temperature, sign):
    point = with_effect(spindle, flange_fit_loosening, Condition(temperature))
    assert np.sign(round(joints_ratio(spindle, point)["flange"] - 1, 12)) == sign


def test_flange_fit_loosening_needs_unlike_materials(spindle):
    steel = replace(spindle.materials["aluminium"], thermal_expansion=spindle.materials["steel"].thermal_expansion)
    alike = replace(spindle, materials={**spindle.materials, "aluminium": steel})
    assert flange_fit_loosening.opening(alike, 60.0) == 0.0


def test_flange_fit_loosening_ends_when_the_interference_is_gone(spindle):
    """Beyond the loose temperature the contact keeps 2 % of its stiffness, and no more is lost."""
    last = [
        joints_ratio(spindle, with_effect(spindle, flange_fit_loosening, Condition(t), contact_share=0.5, interference=2.5))["flange"]
        for t in (60.0, 64.0, 70.0)
    ]
    assert last[0] == pytest.approx(1 / (0.5 + 0.5 / 0.08))  # 2.3 of 2.5 um gone
    assert last[1] == last[2] == pytest.approx(1 / (0.5 + 0.5 / 0.02))


@pytest.mark.parametrize(
    ("share", "temperature", "added"), [(0.0, 20.0, 0.2), (0.0, 60.0, 0.2), (1.0, 20.0, 0.0), (1.0, 60.0, 0.2), (0.5, 40.0, 1.2**0.75 - 1)]
)
def test_mount_compliance_is_a_spring_in_series(spindle, share, temperature, added):
    """Two springs in series carried by a body without mass: static compliance of both at the mount alone."""
    point = with_effect(spindle, mount_compliance, Condition(temperature), compliance=0.2, thermal_share=share)
    k = drawn(spindle, "mount")[2, 2]
    assert 1 / stiffness_of(point, "mount")[2, 2] == pytest.approx(1 / k + added / k, rel=1e-12)
    assert stiffness_of(point, "flange") == pytest.approx(drawn(spindle, "flange"))
    plain = next(e.damping for e in operating_point(spindle, Condition(temperature), ()).chain.elements if e.name == "mount")
    ratio = next(e.damping for e in point.chain.elements if e.name == "mount")[2, 2] / plain[2, 2]
    assert ratio == pytest.approx(1 / (1 + added), rel=1e-12)


def test_plate_prestress_against_buckling_loads():
    """Clamped disc: N_cr a^2 / D = j_1,1^2 without and j_2,1^2 with one nodal diameter; the plate of `source` fully held over 40 K."""
    first, second = jn_zeros(1, 1)[0] ** 2, jn_zeros(2, 1)[0] ** 2
    size, tilt = plate_prestress.EFFECT.parameters
    assert tilt.typical == pytest.approx(first / second, abs=0.005)
    modulus, poisson, thick, radius, strain = 70e9, 0.33, 3e-3, 30e-3, 23e-6 * 40
    critical = first * modulus * thick**3 / (12 * (1 - poisson**2)) / radius**2
    held = modulus * thick * strain / (1 - poisson) / critical
    assert held == pytest.approx(0.10, abs=0.005)
    assert size.typical == pytest.approx(held / 3, rel=0.15)


@pytest.mark.parametrize(("temperature", "axial"), [(20.0, 1.0), (60.0, 1.1), (40.0, 1.05), (0.0, 0.95)])
def test_plate_prestress_is_proportional_to_the_rise(spindle, temperature, axial):
    point = with_effect(spindle, plate_prestress, Condition(temperature), stiffening=0.1, tilt_share=0.5)
    ratio = np.diag(stiffness_of(point, "plate"))[2:] / np.diag(drawn(spindle, "plate"))[2:]
    assert ratio == pytest.approx([axial, (1 + axial) / 2, (1 + axial) / 2], rel=1e-12)
    assert stiffness_of(point, "mount") == pytest.approx(drawn(spindle, "mount"))


@pytest.mark.parametrize("direction", [0.0, 30.0, 90.0])
def test_support_anisotropy_has_two_planes(spindle, direction):
    """Flange: lateral and tilt stiffness along `direction` and across, at right angles to each other; means and axial stay."""
    point = with_effect(spindle, support_anisotropy, REST, split=0.2, direction=direction)
    found, before = stiffness_of(point, "flange"), drawn(spindle, "flange")
    a = np.radians(direction)
    along, across = np.array([np.cos(a), np.sin(a)]), np.array([-np.sin(a), np.cos(a)])
    for block, strong, weak in ((slice(0, 2), along, across), (slice(3, 5), across, along)):  # moving along is tilting about across
        part, k = found[block, block], before[block, block][0, 0]
        assert part @ strong == pytest.approx(1.1 * k * strong, abs=1e-9 * k)
        assert part @ weak == pytest.approx(0.9 * k * weak, abs=1e-9 * k)
    assert found[2, 2] == before[2, 2]
    assert np.trace(found) == pytest.approx(np.trace(before), rel=1e-12)


def test_support_anisotropy_scales_a_whole_bending_plane():
    """A square beam made a rectangular one: the xz cantilever has EI (1 + s/2), the yz one EI (1 - s/2)."""
    s = 0.3
    square, strong, weak = (cantilever(11e-3, ei, 1e15, 1e15) for ei in (5.0, 5.0 * (1 + s / 2), 5.0 * (1 - s / 2)))
    uneven = support_anisotropy.unevenness(s, 0.0)
    found = uneven @ np.linalg.inv(square) @ uneven
    for plane, exact in (([0, 4], strong), ([1, 3], weak)):
        assert found[np.ix_(plane, plane)] == pytest.approx(np.linalg.inv(exact)[np.ix_(plane, plane)], rel=1e-6)


def test_support_anisotropy_splits_a_rotor_as_its_springs():
    """A body on one uneven support: f_x / f_y = sqrt((1 + s/2) / (1 - s/2))."""
    body = Body("rotor", 0.05, (1e-5, 1e-5, 1.6e-5), 0.0, ("x", "y"), False, ())
    uneven = support_anisotropy.unevenness(0.2, 0.4)
    spring = Element("spring", "spring", "ground", "rotor", 0.0, uneven @ np.diag([1e6, 1e6, 0, 0, 0]) @ uneven, NONE)
    low, high = undamped(RotorBase((body,), (spring,), 0.0))
    assert high / low == pytest.approx(np.sqrt(1.1 / 0.9), rel=1e-9)


# ---------------------------------------------------------------- the shaft as a beam

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
    found = undamped(RotorBase((body,), (shaft_bending.in_series(stiff, flexible),), 0.0))[0]
    assert found == pytest.approx(np.sqrt(3 * bending / (mass * length**3)) / (2 * np.pi), rel=1e-6)


def test_shaft_bending_damping_against_complex_stiffness(spindle):
    """(K + i w D)^-1 and F in series: the imaginary part of the inverse of their sum, for damping so small that first order is all."""
    bearing = next(e for e in operating_point(spindle, REST, ()).chain.elements if e.name == "upper")
    flexible = shaft_bending.flexibility(shaft_bending.pieces(spindle, 60.0), 5e-3, 16.5e-3)
    found = shaft_bending.in_series(bearing, flexible)
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
                body = added_disk.with_mass(body, mass, (a + b) / 2, (across, across, mass * (g.r[0] ** 2 + g.r[1] ** 2) / 2))
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
    """Compliance in series and mass in one piece against twelve slices with their own: 4 % of the largest shift below 3 kHz."""
    rigid = frequencies(operating_point(spindle, condition, ()))
    exact = np.array([m.frequency for m in modes(sliced(spindle, condition, 0.3), highest=3000)])[: len(rigid)]
    found = frequencies(with_effect(spindle, shaft_bending, condition, scale=0.3))[: len(rigid)]
    assert np.abs(exact - rigid).max() > 50
    assert np.abs(found - exact).max() < 0.04 * np.abs(exact - rigid).max()


# ---------------------------------------------------------------- inertia


@pytest.mark.parametrize("speed", [0.0, 7200 * RPM])
@pytest.mark.parametrize("share", [0.3, 0.63])
def test_hub_flexibility_against_two_tilting_discs(spindle, share, speed):
    """With theta = theta_x + i theta_y: I_h t_h'' - i G_h t_h' + (K + k) t_h - k t_r = 0, I_r t_r'' - i G_r t_r' + k (t_r - t_h) = 0.

    Whirl frequencies are the real roots of a polynomial of fourth degree; no damping.
    """
    across, polar, support, compliance = 2.7e-6, 3.6e-6, 1500.0, 150e-6
    hub = Body("hub", 0.026, (across, across, polar), 0.0, ("tilt_x", "tilt_y"), True, ())
    spring = Element("support", "bearings", "ground", "hub", 0.0, np.diag([0, 0, 0, support, support]), NONE)
    chain = hub_flexibility.EFFECT.chain(
        spindle, REST, {"compliance": compliance * 1e6, "rim_share": share}, RotorBase((hub,), (spring,), speed)
    )
    web = chain.elements[-1]
    found = undamped(replace(chain, elements=(spring, replace(web, damping=NONE))))
    k, rim = 1 / compliance, share * polar
    middle = np.poly1d([-(across - rim / 2), (polar - rim) * speed, support + k])
    outer = np.poly1d([-rim / 2, rim * speed, k])
    exact = sorted(np.abs((middle * outer - k**2).roots.real) / (2 * np.pi))
    assert found == pytest.approx(exact, rel=1e-8)


def test_hub_flexibility_keeps_the_hub_whole(spindle):
    """A web a million times stiffer than typical: the rigid hub's modes, mass and gyroscopic terms, to 1e-6."""
    rigid = frequencies(operating_point(spindle, RUNNING, ()))
    assert frequencies(with_effect(spindle, hub_flexibility, RUNNING, compliance=1e-4)) == pytest.approx(rigid, rel=1e-5)


def test_hub_flexibility_damping_of_the_web(spindle):
    """A rim alone on its web, tuned to the structure's damping frequency (1500 Hz), has a damping ratio of 0.2 %."""
    rim = 1e-6
    compliance = 1 / (rim * (2 * np.pi * 1500) ** 2)
    values = {"compliance": 1e6 * compliance, "rim_share": 0.5}
    hub = Body("hub", 0.03, (rim, rim, 4 * rim), 0.0, ("tilt_x", "tilt_y"), True, ())
    web = hub_flexibility.EFFECT.chain(spindle, REST, values, RotorBase((hub,), (), 0.0)).elements[0]
    alone = RotorBase((Body("hub rim", 0.01, (rim, rim, 2 * rim), 0.0, ("tilt_x", "tilt_y"), True, ()),), (replace(web, a="ground"),), 0.0)
    assert [m.damping_ratio for m in modes(alone)] == pytest.approx([0.002, 0.002], rel=1e-9)
    assert [m.frequency for m in modes(alone)] == pytest.approx([1500, 1500], rel=1e-9)


def test_hub_flexibility_typical_web_against_plate_theory():
    """Both edges clamped, w = (A r + B / r + C r^3 + D r ln r) cos: k = 4 pi D_plate D. 37 urad/(N m), a half to a third of typical."""
    b, a, plate = 7.5e-3, 14.5e-3, 70e9 * 3e-3**3 / 12 / (1 - 0.33**2)
    shapes = [[r, 1 / r, r**3, r * np.log(r)] for r in (b, a)]
    slopes = [[1, -1 / r**2, 3 * r**2, np.log(r) + 1] for r in (b, a)]
    coefficient = np.linalg.solve([shapes[0], slopes[0], shapes[1], slopes[1]], [0, 0, a, 1])[3]
    compliance = 1e6 / (4 * np.pi * plate * coefficient)
    assert compliance == pytest.approx(37, abs=0.5)
    assert 2 < hub_flexibility.EFFECT.parameters[0].typical / compliance < 3


def test_hub_flexibility_rim_share_against_the_section(spindle):
    """Polar inertia of yoke, magnet and the plate beyond 12.5 mm over that of the whole hub."""
    rings = [(14.5, 16, 4, 7700), (13, 14.5, 4, 7500), (12.5, 16, 3, 2700)]
    rim = sum(np.pi / 2 * rho * h * 1e-3 * ((r1 * 1e-3) ** 4 - (r0 * 1e-3) ** 4) for r0, r1, h, rho in rings)
    share = rim / spindle.structure.body("hub").inertia[2]
    assert hub_flexibility.EFFECT.parameters[1].typical == pytest.approx(share, abs=0.02)


def test_added_disk_against_its_points(spindle):
    """Hub and disk as clouds of points: mass, centre and all three inertias by summing over the points."""
    mass, radius, height = 4e-3, 30e-3, 5e-3
    hub = spindle.structure.body("hub")
    point = with_effect(spindle, added_disk, REST, mass=4.0, outer_radius=30.0, height=5.0)
    found = point.chain.body("hub")
    r = np.sqrt((np.arange(200) + 0.5) / 200) * radius  # equal areas
    angle = 2 * np.pi * (np.arange(12) + 0.5) / 12
    x, y = (np.outer(r, f(angle)).ravel() for f in (np.cos, np.sin))
    z = 20e-3 + height
    centre = (hub.mass * hub.z + mass * z) / (hub.mass + mass)
    assert (found.mass, found.z) == pytest.approx((hub.mass + mass, centre), rel=1e-12)
    cloud = [np.mean(y**2) + (z - centre) ** 2, np.mean(x**2) + (z - centre) ** 2, np.mean(x**2 + y**2)]
    own = np.array(hub.inertia) + hub.mass * (hub.z - centre) ** 2 * np.array([1, 1, 0])
    assert found.inertia == pytest.approx(own + mass * np.array(cloud), rel=1e-5)


def test_added_disk_at_the_axis_of_a_mass_is_that_mass(spindle):
    """A point mass at the hub's own centre adds no inertia."""
    hub = spindle.structure.body("hub")
    found = with_effect(spindle, added_disk, REST, mass=10.0, outer_radius=0.0, height=1e3 * hub.z - 20.0).chain.body("hub")
    assert (found.mass, found.z, found.inertia) == (pytest.approx(hub.mass + 0.01), pytest.approx(hub.z), pytest.approx(hub.inertia))


def test_sensor_mass_against_rayleigh(spindle):
    """A milligram at all points: d ln f = -sum mass |phi|^2 / 2 phi^T M phi with every point's motion in space, first moments included.

    The chain leaves these out; 2 % of the largest shift says how little they matter at rest. Equal masses on all parts.
    """
    point = operating_point(spindle, Condition(20.0), ())
    linear, mass = matrices(point.chain), 1e-6
    heavier = with_effect(spindle, sensor_mass, Condition(20.0), mass=mass * 1e3, turning_share=1.0)
    shift = frequencies(heavier) / frequencies(point) - 1
    for i, mode in enumerate(modes(point.chain, linear, highest=3000)[:5]):
        phi = mode.shape
        moved = sum(np.sum(np.abs(motion_rows(point.chain, p.body, p.position)[:3] @ phi) ** 2) for p in spindle.points)
        exact = -mass * moved / (2 * np.real(phi.conj() @ linear.mass @ phi))
        assert shift[i] == pytest.approx(exact, abs=0.02 * np.abs(shift).max())


def test_sensor_mass_of_one_sensor(spindle):
    """A gram at (20, 0, 0) mm on the seat: one gram, none about x, 1e-3 x 0.02^2 about y and z."""
    seat = spindle.structure.body("seat")
    found = sensor_mass.loaded(seat, spindle.point(5), 1e-3)
    assert found.mass - seat.mass == pytest.approx(1e-3)
    assert np.subtract(found.inertia, seat.inertia) == pytest.approx([0, 4e-7, 4e-7], abs=1e-15)


# ---------------------------------------------------------------- measuring chain

LINES = np.linspace(500.0, 2500.0, 41)


def ideal(spindle):
    return operating_point(spindle, RUNNING, ()).frf(LINES)


def test_sensor_gain_multiplies_its_channels(spindle):
    ratio = with_effect(spindle, sensor_gain, RUNNING, hub_gain=0.1, base_gain=-0.05).frf(LINES) / ideal(spindle)
    on_hub = [p.body == "hub" for p in spindle.points]
    assert ratio[on_hub] == pytest.approx(1.1, rel=1e-12)
    assert ratio[np.invert(on_hub)] == pytest.approx(0.95, rel=1e-12)


@pytest.mark.parametrize(("skew", "last"), [(0.0, 50e-6), (0.1, 80e-6)])
def test_channel_delay_turns_the_phase(spindle, skew, last):
    """A quarter of a period late is a quarter turn back: 50 us at 5 kHz; slope -2 pi tau over the band, first and seventh channel."""
    point = with_effect(spindle, channel_delay, RUNNING, delay=50.0, skew=skew)
    quarter = np.array([5000.0])
    assert point.frf(quarter)[0] == pytest.approx(-1j * operating_point(spindle, RUNNING, ()).frf(quarter)[0], rel=1e-9)
    turn = np.unwrap(np.angle(point.frf(LINES)[[0, 6]] / ideal(spindle)[[0, 6]]))
    slope = np.polyfit(LINES, turn[:, 0].T, 1)[0]
    assert slope == pytest.approx(-2 * np.pi * np.array([50e-6, last]), rel=1e-9)


def test_window_damping_against_a_windowed_impulse_response(spindle):
    """h(t) as a sum of decaying exponentials, times exp(-decay t), Fourier-integrated by quadrature: the FRF without correction."""
    decay = 8.0
    point = operating_point(spindle, RUNNING, ())
    linear = matrices(point.chain)
    p = poles(linear)
    response, force = point_rows(spindle, point.chain, (1,))[0], point_rows(spindle, point.chain, (6,))[0]
    weight = (response @ p.right) * (p.left @ force) * p.value  # of the velocity's impulse response
    slow = np.abs(p.value) < 2 * np.pi * 6000
    dt = 2e-6
    time = np.arange(0.0, 0.5, dt)
    h = np.real(np.exp(np.outer(time, p.value[slow])) @ weight[slow])
    windowed = h * np.exp(-decay * time)
    windowed[0] /= 2
    lines = np.array([1003.0, 1750.0, 1996.0])
    by_time = np.array([np.sum(windowed * np.exp(-2j * np.pi * f * time)) * dt for f in lines])
    fast = np.sum(weight[~slow] / (2j * np.pi * lines[:, None] + decay - p.value[~slow]), axis=1)
    found = with_effect(spindle, window_damping, RUNNING, decay=decay).frf(lines)[0, 1]
    assert found == pytest.approx(by_time + fast, rel=1e-4)
    assert np.abs(found / point.frf(lines)[0, 1] - 1).min() > 1e-3


def test_hammer_position_is_a_force_and_its_moment(spindle):
    """A unit force along z at (12 + 2, 0, 20) mm on the hub: 1 N along z and r x F about the hub's centre; seat likewise at (0, 22, 0)."""
    point = with_effect(spindle, hammer_position, RUNNING, offset=2.0, direction=0.0)
    rows = point.measurement.reference_rows
    for row, body, place in zip(rows, ("hub", "seat"), ([14e-3, 0, 20e-3], [0, 22e-3, 0.0]), strict=True):
        arm = np.array(place) - [0, 0, point.chain.body(body).z]
        moment = np.cross(arm, [0, 0, 1.0])
        expected = {"z": 1.0, "tilt_x": moment[0], "tilt_y": moment[1]}
        loads = {move: row[i] for i, (name, move) in enumerate(point.chain.dofs) if name == body}
        assert {m: v for m, v in loads.items() if abs(v) > 1e-12} == pytest.approx({m: v for m, v in expected.items() if abs(v) > 1e-12})
        assert not any(row[i] for i, (name, _) in enumerate(point.chain.dofs) if name != body)


def test_hammer_position_sideways_on_a_side_face(spindle):
    """Hits along x at (12.5, 0, 15) mm: 0 deg is up, 90 deg tangential along y."""
    aimed = spindle.point(3)
    assert hammer_position.off(aimed, 1e-3, 0.0).position == pytest.approx((12.5e-3, 0.0, 16e-3))
    assert hammer_position.off(aimed, 1e-3, np.pi / 2).position == pytest.approx((12.5e-3, 1e-3, 15e-3))


def test_hammer_position_breaks_reciprocity(spindle):
    """At rest H(1, 6) = H(6, 1) for true hits; hits beside their nodes, round the axis, break it; poles stay."""
    still = operating_point(spindle, Condition(20.0), ())
    missed = with_effect(spindle, hammer_position, Condition(20.0), offset=4.0, direction=90.0)
    first, second = (0, 1), (5, 0)  # (point 1, hammer 6) and (point 6, hammer 1)
    a, b = (point.frf(LINES) for point in (still, missed))
    assert a[first] == pytest.approx(a[second], rel=1e-9)
    assert np.abs(b[first] - b[second]).max() > 0.01 * np.abs(b[first]).max()
    rows = (missed.measurement.response_rows, missed.measurement.reference_rows)
    assert b == pytest.approx(frf(matrices(still.chain), *rows, LINES, "mobility"), rel=1e-6)
