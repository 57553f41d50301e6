"""Conduction against closed forms in space and time, coupling of the parts, friction feedback, and the balance of heat."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.optimize import brentq
from scipy.special import j0, j1

from tests.thermal.bodies import bare, material, nodes, two_rings
from thermospindle.model.drawing.heating import Convection, HeatSource
from thermospindle.model.drawing.section import PARTS, Region
from thermospindle.model.errors import OutsideRange
from thermospindle.model.material import Law
from thermospindle.model.units import RPM
from thermospindle.thermal import conduction, heat
from thermospindle.thermal.expansion import influence
from thermospindle.thermal.mesh import section_mesh

AT_REST = heat.Running(air=20.0, speed=0.0, loads={})


@pytest.fixture(scope="module")
def reference(spindle):
    return conduction.model(spindle, {part: section_mesh(spindle, part, 2e-3) for part in PARTS})


# ------------------------------------------------------------------ closed forms


def cylinder(spindle, size, shape="triangle", film=4000.0, radius=10e-3, height=16e-3):
    """A solid cylinder with convection all around; its slowest mode J0(x r / a) cos(y (z - l) / l) (Carslaw, Jaeger, sec. 8.4)
    decays at exactly diffusivity ((x / a)^2 + (y / l)^2), with x J1(x) = Bi J0(x) and y tan y = Bi, l half the height."""
    metal = material(conductivity=40.0, density=8000.0, capacity=500.0)
    part = Region("body", "stationary", "metal", (0, radius), (0, height))
    own = bare(spindle, part, metal=metal)
    own = replace(own, thermal=replace(own.thermal, convections=(Convection(("body",), film),)))
    model = conduction.model(own, {"stationary": section_mesh(own, "stationary", size, shape)})
    half, k = height / 2, metal.conductivity
    x = brentq(lambda v: v * j1(v) - film * radius / k * j0(v), 1e-6, 2.4)
    y = brentq(lambda v: v * np.tan(v) - film * half / k, 1e-6, 1.57)
    r, z = nodes(model, "stationary")
    mode = j0(x * r / radius) * np.cos(y * (z - half) / half)
    rate = k / (metal.density * metal.heat_capacity) * ((x / radius) ** 2 + (y / half) ** 2)
    return model, 20.0 + 30.0 * mode, rate


@pytest.mark.parametrize("shape", ["triangle", "quadrilateral"])
def test_cooling_cylinder_and_rate_in_space(spindle, shape):
    """The decay of the slowest mode, with time steps so small (error 2e-6) that space decides: third order in the mean."""
    errors = []
    for size in (5e-3, 2.5e-3):
        model, start, rate = cylinder(spindle, size, shape)
        last = heat.transient(model, AT_REST, model.field(start), np.linspace(0, 0.5 / rate, 41)).nodal[-1]
        volume = model.capacity.sum(axis=1)
        errors.append(np.sqrt(np.average((last - 20 - (start - 20) * np.exp(-0.5)) ** 2, weights=volume)) / 30)
    assert errors[1] < 3e-5
    assert np.log2(errors[0] / errors[1]) > 2.8


def test_rate_in_time(spindle):
    """TR-BDF2 is of second order: half the step, a quarter of the error (seen on a mesh that errs 100 times less)."""
    model, start, rate = cylinder(spindle, 1e-3)
    errors = []
    for steps in (4, 8, 16):
        last = heat.transient(model, AT_REST, model.field(start), np.linspace(0, 2 / rate, steps + 1)).nodal[-1]
        errors.append(np.abs(last - 20 - (start - 20) * np.exp(-2)).max())
    assert np.log2(np.array(errors[:-1]) / errors[1:]) == pytest.approx([2, 2], abs=0.25)


def test_one_huge_step_does_not_ring(spindle):
    """L-stability: a step a million times the time constant lands on the air temperature from a rough start."""
    model, start, rate = cylinder(spindle, 4e-3)
    rough = start + np.random.default_rng(2).uniform(-5, 5, start.size)
    assert heat.transient(model, AT_REST, model.field(rough), [0.0, 1e6 / rate]).nodal[-1] == pytest.approx(20.0, abs=1e-3)


def test_hollow_cylinder_with_internal_heat_and_convection(spindle):
    """Mid-plane of a long tube, heat q in its volume, film h on both faces (Carslaw, Jaeger, sec. 7.2):
    T = A + B ln r - q r^2 / 4k. The ends are felt to exp(-100 mm / 5 mm)."""
    a, b, film, k, length = 10e-3, 20e-3, 5000.0, 40.0, 200e-3
    own = bare(spindle, Region("tube", "stationary", "metal", (a, b), (0, length)), metal=material(conductivity=k))
    volume = np.pi * (b**2 - a**2) * length
    source = HeatSource("heater", ("tube",), power=volume * 5e6, speed=100.0, exponent=2.0)
    own = replace(own, thermal=replace(own.thermal, convections=(Convection(("tube",), film),), sources=(source,)))
    model = conduction.model(own, {"stationary": section_mesh(own, "stationary", 1.25e-3)})
    field = heat.steady(model, heat.Running(25.0, 200.0, {}))  # twice the speed, so four times the heat
    q = 4 * 5e6
    inner = [film, film * np.log(a) - k / a, film * 25.0 + film * q * a**2 / (4 * k) - q * a / 2]
    outer = [film, film * np.log(b) + k / b, film * 25.0 + film * q * b**2 / (4 * k) + q * b / 2]
    constant, factor = np.linalg.solve([inner[:2], outer[:2]], [inner[2], outer[2]])
    r, z = nodes(model, "stationary")
    middle = np.isclose(z, length / 2)
    expected = constant + factor * np.log(r[middle]) - q * r[middle] ** 2 / (4 * k)
    rise = np.ptp(expected)
    assert field.nodal["stationary"][middle] == pytest.approx(expected, abs=1e-4 * rise)


def test_soak_at_rest_is_uniform(reference):
    """No heat: everything at the temperature of the air, through bearings and gap as well."""
    field = heat.steady(reference, replace(AT_REST, air=60.0))
    for part in PARTS:
        assert field.nodal[part] == pytest.approx(60.0, abs=1e-9)


# ------------------------------------------------------------------ coupling of the parts


def test_all_heat_passes_the_bearing(spindle):
    """2 W through 0.25 W/K: 8 K between the raceways; the film carries them at 2 W / (50 W/m2K x surface without raceway)."""
    model = two_rings(spindle, conductance=0.25)
    drive = heat.running(model.spindle, 25.0, 100.0)
    field = heat.steady(model, drive)
    means = field.region_means()
    surface = 2 * np.pi * (9e-3 * 7e-3 + (9e-3**2 - 6e-3**2))
    assert means["inner"] - means["outer"] == pytest.approx(8.0, rel=1e-3)
    assert means["outer"] - 25.0 == pytest.approx(2.0 / (50 * surface), rel=1e-3)
    assert heat.flows(model, field, drive).crossing == pytest.approx(-2.0, rel=3e-8)


def lubricated(model, **friction):
    """The same rings whose bearing makes heat."""
    thermal = model.spindle.thermal
    return replace(model, spindle=replace(model.spindle, thermal=replace(thermal, friction=replace(thermal.friction, **friction))))


def test_slowest_decay_of_two_lumps(spindle):
    """Each ring is one lump: C T' = -(K - H' b b^T) T with b = (1/2, 1/2); Palmgren's H goes with
    nu^(2/3), so H' = 2/3 H nu' / nu, a fifth of the film."""
    conductance, omega = 0.25, 7200 * RPM
    model = lubricated(two_rings(spindle, conductance), f0=2.0, f1=0.0, viscosity=Law((20.0, 60.0), (100e-6, 40e-6)))
    friction_at_40 = 1e-10 * 2.0 * (70 * 7200) ** (2 / 3) * 9.1**3 * omega  # W, nu = 70 mm2/s, d_m = 9.1 mm
    fall = 2 / 3 * friction_at_40 * -1.5 / 70  # W/K
    film = 50.0 * 2 * np.pi * (9e-3 * 7e-3 + (9e-3**2 - 6e-3**2))
    stiff = np.array([[conductance, -conductance], [-conductance, conductance + film]]) - fall / 4
    capacity = 8000.0 * 500.0 * np.pi * np.array([(4e-3**2 - 2e-3**2) * 6e-3, (9e-3**2 - 6e-3**2) * 7e-3])
    expected = 1 / np.linalg.eigvals(stiff / capacity[:, None]).real.min()
    assert -fall > 0.2 * film
    found = heat.slowest(model, model.field(np.full(model.film.size, 40.0)), heat.running(model.spindle, 20.0, omega))
    assert found == pytest.approx(expected, rel=1e-3)


@pytest.mark.parametrize("back", [0.5, 0.97])
def test_loads_that_nearly_run_away_settle_at_the_sum_of_their_series(spindle, back):
    """A load of 10 N grows with the heat it makes; of what is added the share `back` returns: 10 N / (1 - back). Of 97 % plain
    repetition leaves 0.2 % after all its rounds."""
    omega = 100.0
    model = lubricated(two_rings(spindle, 0.25), f0=0.0, f1=0.01)
    (b,), (weight,) = model.spindle.bearings, model.bearing
    per_newton = 0.01 * 9.1e-3 * omega * weight @ np.linalg.solve(model.conductance.toarray(), weight)  # K/N
    still = model.nodal(heat.steady(model, heat.Running(20.0, omega, {b.name: 0.0}))) @ weight

    def drive(nodal):
        return heat.Running(20.0, omega, {b.name: 10.0 + back / per_newton * float(weight @ nodal - still)})

    field = heat.settled(model, drive, 20.0)
    assert drive(model.nodal(field)).loads[b.name] == pytest.approx(10.0 / (1 - back), rel=1e-6)
    assert heat.feedback(model, field, drive) == pytest.approx(back, rel=1e-4)


# ------------------------------------------------------------------ the reference spindle running


def test_balance_of_heat_steady(spindle, reference):
    """What the motor and the bearings make leaves by convection; friction is that of the temperature it makes."""
    drive = heat.running(spindle, 25.0, 7200 * RPM)
    field = heat.steady(reference, drive)
    flow = heat.flows(reference, field, drive)
    assert flow.motor == pytest.approx(0.5)
    assert flow.friction > 0.5
    assert flow.stored == pytest.approx(0.0, abs=1e-9)
    nodal = reference.nodal(field)
    made = heat.friction_heat(reference, nodal, drive)
    cold = heat.friction_heat(reference, np.full(nodal.size, 25.0), drive)
    assert np.all(made < 0.85 * cold)
    source = reference.film * 25.0 + heat.motor_heat(reference, drive) @ reference.motor + made @ reference.bearing
    assert reference.conductance @ nodal == pytest.approx(source, abs=1e-9)


def test_balance_of_heat_in_time(spindle, reference):
    """The heat of every step, added as the scheme does, is what the step stores; run-up and stop, unequal steps."""

    def drive(t):
        return heat.running(spindle, 25.0 + t / 100, 7200 * RPM * (t < 300))

    history = heat.transient(reference, drive, 25.0, [0, 20, 60, 140, 300, 600, 1000])
    stored = np.diff(history.nodal @ reference.capacity.sum(axis=1))
    assert [h.stored for h in history.heat] == pytest.approx(stored, abs=1e-7 * np.abs(stored).max())
    assert history.heat[0].motor == pytest.approx(0.5 * 20)
    assert history.heat[-1].friction == 0.0


def test_a_jacket_takes_heat_at_its_own_temperature(spindle, reference):
    """Motor, friction and what a coolant 15 K below the air takes in balance, steady and in every
    step; a coolant as warm as the air is air; what lies behind an air gap feels neither."""
    drive = heat.running(spindle, 25.0, 7200 * RPM)

    def jacketed(coolant):
        films = tuple(replace(c, coolant=coolant) for c in spindle.thermal.convections[:1])
        own = replace(spindle, thermal=replace(spindle.thermal, convections=(*films, *spindle.thermal.convections[1:])))
        return conduction.model(own, reference.sections)

    air, same, cold = (jacketed(c) for c in (None, 25.0, 10.0))
    fields = [m.nodal(heat.steady(m, drive)) for m in (air, same, cold)]
    assert fields[1] == pytest.approx(fields[0], abs=1e-9)
    assert np.all(fields[2] < fields[0])
    assert heat.flows(cold, fields[2], drive).stored == pytest.approx(0.0, abs=1e-9)
    area = float((air.film - cold.film).sum())  # W/K of the jacket
    assert cold.bath.sum() == pytest.approx(10.0 * area, rel=1e-12)
    assert area > 0
    history = heat.transient(cold, drive, 25.0, [0, 20, 60, 140, 300])
    stored = np.diff(history.nodal @ cold.capacity.sum(axis=1))
    assert [h.stored for h in history.heat] == pytest.approx(stored, abs=1e-7 * np.abs(stored).max())
    assert heat.transient(cold, drive, 25.0, np.linspace(0, 7200, 21)).nodal[-1] == pytest.approx(fields[2], abs=1e-3)


def test_a_coolant_at_zero_cools(spindle):
    """All faces at 0 C of water, whatever the air: a disc without heat goes there."""
    part = Region("body", "stationary", "metal", (0, 10e-3), (0, 16e-3))
    own = bare(spindle, part, metal=material())
    own = replace(own, thermal=replace(own.thermal, convections=(Convection(("body",), 50.0, coolant=0.0),)))
    model = conduction.model(own, {"stationary": section_mesh(own, "stationary", 4e-3)})
    assert model.nodal(heat.steady(model, heat.Running(air=30.0, speed=0.0, loads={}))) == pytest.approx(0.0, abs=1e-9)


def test_running_up_ends_steady_and_is_second_order_with_friction(spindle, reference):
    drive = heat.running(spindle, 25.0, 7200 * RPM)
    steady = reference.nodal(heat.steady(reference, drive))
    assert heat.transient(reference, drive, 25.0, np.linspace(0, 7200, 21)).nodal[-1] == pytest.approx(steady, abs=1e-3)
    warm = reference.field(25.0 + 0.3 * (steady - 25.0))  # a smooth start
    ends = [heat.transient(reference, drive, warm, np.linspace(0, 240, n + 1)).bearings[-1] for n in (12, 24, 48)]
    ratio = (ends[0] - ends[1]) / (ends[1] - ends[2])
    assert ratio == pytest.approx([4, 4], abs=1.2)


@pytest.mark.slow
def test_mesh_of_the_influence_is_fine_enough_for_heat(spindle):
    """Every element divided in four changes no temperature rise by more than 1e-4."""
    drive = heat.running(spindle, 25.0, 7200 * RPM)
    sections = influence(spindle).sections
    once = heat.steady(conduction.model(spindle, sections), drive).region_means()
    twice = heat.steady(conduction.model(spindle, {p: s.refined() for p, s in sections.items()}), drive).region_means()
    assert [once[n] - 25 for n in twice] == pytest.approx([t - 25 for t in twice.values()], rel=1e-4)


@pytest.mark.parametrize("load", [0.0, 200.0])
def test_load_and_speed_drive_friction(spindle, reference, load):
    """Forty times the speed overheats the grease, and is refused; load adds f1 P1 d_m times speed."""
    with pytest.raises(OutsideRange):
        heat.steady(reference, heat.running(spindle, 25.0, 40 * 7200 * RPM))
    nodal = np.full(reference.film.size, 40.0)
    drive = heat.running(spindle, 25.0, 754.0, {b.name: load for b in spindle.bearings})
    base = heat.friction_heat(reference, nodal, heat.running(spindle, 25.0, 754.0, {b.name: 0.0 for b in spindle.bearings}))
    assert heat.friction_heat(reference, nodal, drive) - base == pytest.approx(0.0003 * load * 9.1e-3 * 754, abs=1e-12)


def test_without_convection_there_is_no_steady_state(spindle):
    own = bare(spindle, Region("a", "stationary", "m", (0, 5e-3), (0, 5e-3)), m=material())
    with pytest.raises(ValueError, match="convection"):
        heat.steady(conduction.model(own, {"stationary": section_mesh(own, "stationary", 2e-3)}), AT_REST)


def test_times_must_rise(reference):
    with pytest.raises(ValueError, match="rise"):
        heat.transient(reference, AT_REST, 20.0, [0.0, 1.0, 1.0])
