"""Effects on the structure: what all of them keep to, moduli and joints, each against something it did not produce."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.special import jn_zeros

from tests.conftest import ROOT
from tests.effect_points import NONE, REST, at, frequencies, undamped
from thermospindle.model.bearing.row import contact_constants
from thermospindle.model.machine import Condition
from thermospindle.model.material import Law
from thermospindle.model.rotor.chain import Element, RotorBase
from thermospindle.model.scene.reading import load
from thermospindle.model.structure import Body
from thermospindle.sim.effects.structure import (
    added_disk,
    flange_fit_loosening,
    hub_flexibility,
    modulus_softening,
    mount_compliance,
    plate_prestress,
    sensor_mass,
    shaft_bending,
    support_anisotropy,
)
from thermospindle.sim.operating import operating_point
from thermospindle.thermal.expansion import expand

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
    shift = [frequencies(at(spindle, REST, module, **{size.name: x * size.typical}))[:5] - before for x in (0.01, 0.005)]
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
    point = at(spindle, REST, modulus_softening)
    assert list(joints_ratio(spindle, point).values()) == pytest.approx([1 - 40 * 22 * 23e-6] * 3, rel=1e-12)
    half = at(spindle, REST, modulus_softening, joint_share=0.5)
    assert list(joints_ratio(spindle, half).values()) == pytest.approx([1 - 20 * 22 * 23e-6] * 3, rel=1e-12)
    motion = expand(spindle, 60.0)["upper"]
    soft = contact_constants(point.spindle, point.spindle.bearing("upper"), motion, 0.43)
    hard = contact_constants(spindle, spindle.bearing("upper"), motion, 0.43)
    assert np.divide(soft, hard) == pytest.approx(1 - 40 * 22 * 11.5e-6, rel=1e-12)


@pytest.mark.parametrize("share", [0.0, 1.0, 2.0])
def test_modulus_softening_of_a_shaft_is_that_of_its_material(share):
    """However much of its material's fall a joint has: a steel shaft bent by nothing of it, or by twice that."""
    bending = load(ROOT / "scenes" / "five_bearing")
    ratio = joints_ratio(bending, at(bending, REST, modulus_softening, joint_share=share))
    fallen = modulus_softening.softening(bending.materials["steel"], REST.temperature, bending.reference_temperature)
    beams = [ratio[name] for s in bending.structure.shafts if s.turns for name in s.elements]
    assert fallen < 0.995
    assert beams == pytest.approx([fallen] * len(beams), rel=1e-12)


def test_modulus_softening_of_everything_alike_scales_all_frequencies(spindle):
    """One expansion coefficient: no ring motion, one fall E(T) for all stiffness, at rest f ~ sqrt(E)."""
    same = {n: replace(m, thermal_expansion=Law((), (12e-6,))) for n, m in spindle.materials.items()}
    uniform = replace(spindle, materials=same)
    cold, hot = (frequencies(at(uniform, Condition(t), modulus_softening), 1e5) for t in (20.0, 60.0))
    size = 1 + 12e-6 * 40  # deformation grows with size: Hertz stiffness ~ E sqrt(D delta), a tenth of what is looked at
    assert hot / cold == pytest.approx(np.sqrt(1 - 22 * 12e-6 * 40), abs=1.1 * (size - 1))


@pytest.mark.parametrize("temperature", [pytest.param(35.0, marks=pytest.mark.slow), 60.0])
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


def test_modulus_softening_of_rings_grows_as_the_square_of_the_temperature(spindle):
    """Strain times softening, each in proportion to what it is warmer: at 35 C (15 / 40)^2 of what it is at 60 C."""
    effect, change = modulus_softening.EFFECT, {}
    for temperature in (35.0, 60.0):
        before = expand(spindle, temperature)
        found = effect.motions(spindle, Condition(temperature), effect.typical(), before)
        change[temperature] = [getattr(found[name], end) - getattr(before[name], end) for name in before for end in ("inner_r", "inner_z", "outer_r", "outer_z")]
    assert max(np.abs(change[60.0])) > 1e-9
    assert change[35.0] == pytest.approx(np.array(change[60.0]) * (15 / 40) ** 2, rel=1e-4, abs=1e-13)


# ---------------------------------------------------------------- joints


def test_flange_fit_loosening_against_expansion(spindle):
    """A 5 mm aluminium bore on a steel shaft opens by 5 mm (23 - 11.5) 1e-6 40 = 2.3 um over 40 K."""
    assert flange_fit_loosening.opening(spindle, 60.0) == pytest.approx(2.3e-6, rel=1e-9)
    point = at(spindle, REST, flange_fit_loosening, contact_share=0.3, interference=4.6)
    ratio = joints_ratio(spindle, point)
    assert ratio["flange"] == pytest.approx(1 / (0.7 + 0.3 / 0.5), rel=1e-9)  # half the interference left
    assert (ratio["mount"], ratio["plate"]) == (1.0, 1.0)


@pytest.mark.parametrize(("temperature", "sign"), [(-20.0, 1), (20.0, 0), (60.0, -1)])
def test_flange_fit_loosening_tightens_when_cold(spindle, temperature, sign):
    point = at(spindle, Condition(temperature), flange_fit_loosening)
    assert np.sign(round(joints_ratio(spindle, point)["flange"] - 1, 12)) == sign


def test_flange_fit_that_opens_at_one_end(spindle):
    """2.3 of 4.6 um gone, 0.2 of it before the contact feels it: 0.375 of the contact's pressure gone; a fifth of what tilts feel along
    and across; the added compliance a = 0.3 (1 / 0.625 - 1) with its own loss factor."""
    values = {"contact_share": 0.3, "interference": 4.6, "closed": 0.2, "translation_share": 0.2, "loss_factor": 0.4}
    point = at(spindle, REST, flange_fit_loosening, **values)
    added = 0.3 * (1 / 0.625 - 1)
    ratio = np.diag(stiffness_of(point, "flange")) / np.diag(drawn(spindle, "flange"))
    assert ratio == pytest.approx([1 / (1 + 0.2 * added)] * 3 + [1 / (1 + added)] * 2, rel=1e-9)
    flange = next(e for e in point.chain.elements if e.name == "flange")
    zeta = next(j.damping_ratio for j in spindle.structure.joints if j.name == "flange")
    omega = 2 * np.pi * spindle.structure.damping_frequency
    stiff = drawn(spindle, "flange")[3, 3]
    series = 1 / (1 / stiff * (1 - 2j * zeta) + added / stiff * (1 - 0.4j))
    assert omega * flange.damping[3, 3] / flange.stiffness[3, 3] == pytest.approx(series.imag / series.real, rel=1e-9)


def test_flange_fit_loosening_needs_unlike_materials(spindle):
    steel = replace(spindle.materials["aluminium"], thermal_expansion=spindle.materials["steel"].thermal_expansion)
    alike = replace(spindle, materials={**spindle.materials, "aluminium": steel})
    assert flange_fit_loosening.opening(alike, 60.0) == 0.0


def test_flange_fit_loosening_ends_when_the_interference_is_gone(spindle):
    """Beyond the loose temperature the contact keeps 2 % of its stiffness, and no more is lost."""
    last = [
        joints_ratio(spindle, at(spindle, Condition(t), flange_fit_loosening, contact_share=0.5, interference=2.5))["flange"]
        for t in (60.0, 64.0, 70.0)
    ]
    assert last[0] == pytest.approx(1 / (0.5 + 0.5 / 0.08))  # 2.3 of 2.5 um gone
    assert last[1] == last[2] == pytest.approx(1 / (0.5 + 0.5 / 0.02))


@pytest.mark.parametrize(
    ("share", "temperature", "added"), [(0.0, 20.0, 0.2), (0.0, 60.0, 0.2), (1.0, 20.0, 0.0), (1.0, 60.0, 0.2), (0.5, 40.0, 1.2**0.75 - 1)]
)
def test_mount_compliance_is_a_spring_in_series(spindle, share, temperature, added):
    """Two springs in series carried by a body without mass: static compliance of both at the mount alone."""
    point = at(spindle, Condition(temperature), mount_compliance, compliance=0.2, thermal_share=share)
    k = drawn(spindle, "mount")[2, 2]
    assert 1 / stiffness_of(point, "mount")[2, 2] == pytest.approx(1 / k + added / k, rel=1e-12)
    assert stiffness_of(point, "flange") == pytest.approx(drawn(spindle, "flange"))
    plain = next(e.damping for e in operating_point(spindle, Condition(temperature), ()).chain.elements if e.name == "mount")
    ratio = next(e.damping for e in point.chain.elements if e.name == "mount")[2, 2] / plain[2, 2]
    assert ratio == pytest.approx(1 / (1 + added), rel=1e-12)


def test_plate_prestress_against_buckling_loads():
    """Clamped disc: N_cr a^2 / D = j_1,1^2 without and j_2,1^2 with one nodal diameter; the plate of `source` fully held over 40 K."""
    first, second = jn_zeros(1, 1)[0] ** 2, jn_zeros(2, 1)[0] ** 2
    size, tilt, _ = plate_prestress.EFFECT.parameters
    assert tilt.typical == pytest.approx(first / second, abs=0.005)
    modulus, poisson, thick, radius, strain = 70e9, 0.33, 3e-3, 30e-3, 23e-6 * 40
    critical = first * modulus * thick**3 / (12 * (1 - poisson**2)) / radius**2
    held = modulus * thick * strain / (1 - poisson) / critical
    assert held == pytest.approx(0.10, abs=0.005)
    assert size.typical == pytest.approx(held / 3, rel=0.15)


@pytest.mark.parametrize(("temperature", "axial"), [(24.0, 1.0), (16.0, 1.0), (60.0, 1.08), (-20.0, 0.92)])
def test_a_plate_with_play_is_held_only_beyond_it(spindle, temperature, axial):
    point = at(spindle, Condition(temperature), plate_prestress, stiffening=0.1, play=8.0)
    assert stiffness_of(point, "plate")[2, 2] / drawn(spindle, "plate")[2, 2] == pytest.approx(axial, rel=1e-12)


@pytest.mark.parametrize(("temperature", "axial"), [(20.0, 1.0), (60.0, 1.1), (40.0, 1.05), (0.0, 0.95)])
def test_plate_prestress_is_proportional_to_the_rise(spindle, temperature, axial):
    point = at(spindle, Condition(temperature), plate_prestress, stiffening=0.1, tilt_share=0.5)
    ratio = np.diag(stiffness_of(point, "plate"))[2:] / np.diag(drawn(spindle, "plate"))[2:]
    assert ratio == pytest.approx([axial, (1 + axial) / 2, (1 + axial) / 2], rel=1e-12)
    assert stiffness_of(point, "mount") == pytest.approx(drawn(spindle, "mount"))


@pytest.mark.parametrize("direction", [0.0, 30.0, 90.0])
def test_support_anisotropy_has_two_planes(spindle, direction):
    """Flange: lateral and tilt stiffness along `direction` and across, at right angles to each other; means and axial stay."""
    point = at(spindle, REST, support_anisotropy, split=0.2, direction=direction)
    found, before = stiffness_of(point, "flange"), drawn(spindle, "flange")
    a = np.radians(direction)
    along, across = np.array([np.cos(a), np.sin(a)]), np.array([-np.sin(a), np.cos(a)])
    for block, strong, weak in ((slice(0, 2), along, across), (slice(3, 5), across, along)):  # moving along is tilting about across
        part, k = found[block, block], before[block, block][0, 0]
        assert part @ strong == pytest.approx(1.1 * k * strong, abs=1e-9 * k)
        assert part @ weak == pytest.approx(0.9 * k * weak, abs=1e-9 * k)
    assert found[2, 2] == before[2, 2]
    assert np.trace(found) == pytest.approx(np.trace(before), rel=1e-12)


def test_support_anisotropy_splits_a_rotor_as_its_springs():
    """A body on one uneven support: f_x / f_y = sqrt((1 + s/2) / (1 - s/2))."""
    body = Body("rotor", 0.05, (1e-5, 1e-5, 1.6e-5), 0.0, ("x", "y"), False, ())
    uneven = support_anisotropy.unevenness(0.2, 0.4)
    spring = Element("spring", "spring", "ground", "rotor", 0.0, uneven @ np.diag([1e6, 1e6, 0, 0, 0]) @ uneven, NONE)
    low, high = undamped(RotorBase((body,), (spring,), 0.0))
    assert high / low == pytest.approx(np.sqrt(1.1 / 0.9), rel=1e-9)
