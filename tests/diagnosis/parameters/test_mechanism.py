"""Mechanisms, their laws as priors, and sizes beyond their limits."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from tests.conftest import ROOT
from tests.virtual_campaign import mode_campaign, model_of, virtual_campaign
from thermospindle.diagnosis.forward.rates import rates_of
from thermospindle.diagnosis.inference.freeform import alike, as_told_by, free_forms
from thermospindle.diagnosis.inference.problem import Problem
from thermospindle.diagnosis.parameters.mechanism import Mechanism, likeness, one_size, size_covariance, strongest, variants, with_own_laws
from thermospindle.diagnosis.parameters.nuisance import RECORD
from thermospindle.model.machine import Addition, Condition
from thermospindle.model.rotor.chain import motion_rows
from thermospindle.model.scene.reading import load
from thermospindle.model.units import RPM
from thermospindle.sim.effects import by_name, usable
from thermospindle.sim.operating import operating_point

CONDITIONS = [Condition(20.0), Condition(20.0), Condition(40.0, 7200 * RPM), Condition(60.0), Condition(60.0, 0.0, 100.0), Condition(60.0, 0.0, 1.0, 60.0)]


@pytest.mark.parametrize("departure", [0.0, 0.1, 1.0])
def test_sizes_have_a_proper_prior(departure):
    """Positive definite with repeats among the tests; without departures one number; correlation falls with distance, and is 1 at none."""
    covariance = size_covariance(CONDITIONS, 2.0, departure)
    assert np.array_equal(covariance, covariance.T)
    values = np.linalg.eigvalsh(covariance)
    assert values.min() > 0
    np.linalg.cholesky(covariance)
    assert np.diag(covariance) == pytest.approx(4.0 * (1 + departure**2), rel=1e-6)
    if departure == 0.0:
        assert values[-2] < 1e-8 * values[-1]
    else:
        assert values[-2] > 1e-3 * departure**2 * values[-1]


@pytest.mark.parametrize("departure", [0.0, 0.3, 1.0])
def test_what_grows_from_a_reference_is_nothing_there(departure):
    """Straight with temperature and with speed; departures are those of a process of the same likeness since the reference: x(c)
    - x(reference), of which the covariance follows from that of x at the tests and there. An offset is the same in all tests."""
    conditions = [Condition(20.0), Condition(40.0), Condition(60.0), Condition(0.0), Condition(60.0, 7200 * RPM), Condition(60.0, -7200 * RPM)]
    reference = conditions[0]
    found = size_covariance(conditions, 2.0, departure, 0.0, reference)
    assert found[0, 0] == pytest.approx(4.0 * (0.02 * departure**2 + 1e-9), rel=1e-9)
    t, n = np.array([0.0, 0.5, 1.0, -0.5, 1.0, 1.0]), np.array([0.0, 0.0, 0.0, 0.0, 1.2, 1.2])
    since = np.eye(6) - np.eye(6)[[0]]  # rows: x(c) - x(reference)
    expected = np.outer(t, t) + np.outer(n, n) + departure**2 * (0.98 * since @ likeness(conditions) @ since.T + 0.02 * np.eye(6))
    assert found == pytest.approx(4.0 * expected, abs=1e-7)
    assert np.linalg.eigvalsh(found).min() > 0
    assert size_covariance(conditions, 2.0, departure, 1.0, reference) - found == pytest.approx(4.0 * np.ones((6, 6)))


def test_one_size_is_of_the_tests_that_tell_it():
    """A test at the reference, where a law of the data's own is nothing by its definition, has the
    error of its prior and told nearly all; tests that tell count by their precision, and where the
    data tell of none all are alike. The root is that of what the sizes are counted in."""
    conditions = [Condition(20.0), Condition(45.0), Condition(60.0)]
    loss = next(m for m in variants(by_name("preload_loss")))
    prior = size_covariance(conditions, loss.size.prior_sd, 1.0, 0.0, conditions[0])
    root = np.linalg.cholesky(prior)
    told = np.diag([prior[0, 0], 0.02**2, 0.01**2])
    value, sd = one_size(loss, root, np.array([0.0, 0.10, 0.15]), told)
    precision = 1 / np.diag(told)[1:] - 1 / np.diag(prior)[1:]
    assert value == pytest.approx(precision @ [0.10, 0.15] / precision.sum(), rel=1e-6)
    assert sd == pytest.approx(np.sqrt(precision**2 @ np.diag(told)[1:]) / precision.sum(), rel=1e-6)
    assert one_size(loss, root, np.array([0.1, 0.1, 0.1]), prior)[0] == pytest.approx(0.1)
    assert one_size(loss, root, np.array([0.0, 9.0, 9.0]), told)[0] == loss.size.limits[1]


def test_departures_are_alike_where_conditions_are():
    like = likeness(CONDITIONS)
    assert like[0, 1] == 1.0
    assert like[0, 3] == pytest.approx(np.exp(-1.0))  # 40 K
    assert like[0, 2] < like[0, 3] * np.exp(0.5)  # 20 K and 7200 rpm
    assert like[3, 4] < 1
    assert like[3, 5] < 1
    assert np.linalg.eigvalsh(like).min() > -1e-12


def test_a_variant_for_every_choice(spindle):
    for e in usable(spindle):
        found = variants(e)
        chosen = [p for p in e.parameters[1:] if p.choices]
        shares = sum(p.limits == (0.0, 1.0) and p.prior_sd > 0 and p not in chosen for p in e.parameters[1:])
        assert len(found) == np.prod([len(p.choices) for p in chosen], dtype=int) + 2 * shares  # and each share at either end
        assert len({tuple(m.choices.items()) for m in found}) == len(found)
        for m in found:
            assert set(m.values(1.0, [0.0] * len(m.shape))) <= {p.name for p in e.parameters}
            assert m.values(1.5, [0.0] * len(m.shape))[e.parameters[0].name] == 1.5


def test_laws_of_the_datas_own_act_in_every_test_as_where_they_do_most(spindle):
    """Of all that asks for the condition, once for every choice that is none of its law; masses last, and joints ask for nothing."""
    at = strongest(spindle, CONDITIONS)
    assert at == Condition(60.0, 7200 * RPM, 100.0, 60.0)
    assert strongest(spindle, [Condition(20.0), Condition(-5.0)]) == Condition(-5.0, spindle.nominal_speed)
    named = [m for e in usable(spindle) for m in variants(e)]
    own = with_own_laws(named, spindle, CONDITIONS)
    names = [m.name for m in own]
    assert {"thermal_gradient", "grease_damping", "bond_softening", "soak_lag", "clearance_opening", "mount_compliance"} <= set(names)
    assert not {"added_disk", "sensor_mass", "support_anisotropy", "ball_material", "sensor_gain"} & set(names)
    assert "ball_inertia" in {m.name for m in named}
    assert "ball_inertia" not in names  # the balls' inertia goes with the square of the speed, whatever the data would like
    assert names.count("thermal_gradient") == 1
    assert all(m.kind == "own law" for m in own)
    of = {m.name: m for m in own}
    assert [q.name for q in of["flange_fit_loosening"].shape] == ["translation_share", "loss_factor"]  # its interference is but another size there
    assert of["flange_fit_loosening"].choices == {"interference": 7.0, "closed": 0.0}
    assert [q.name for q in of["thermal_gradient"].shape] == ["common_share", "level_share"]
    grows = {m.name for m in own if m.reference is not None}
    assert {"thermal_gradient", "modulus_softening", "plate_prestress", "lubricant_film", "soak_lag"} <= grows  # nothing at 20 C and at rest
    assert not {"preload_loss", "bond_softening", "mount_compliance", "window_damping"} & grows  # theirs may be there already
    assert {m.reference for m in own} == {None, Condition(20.0, 0.0, 0.0, np.inf)}
    warm = of["thermal_gradient"]
    by_region = {g.name: 20.0 for g in spindle.regions}
    values = warm.values(1.0, [q.neutral for q in warm.shape])
    at_rest = warm.effect.temperatures(spindle, Condition(20.0), values, by_region)
    assert at_rest == next(m for m in named if m.name == "thermal_gradient").effect.temperatures(spindle, at, values, by_region)
    assert max(at_rest.values()) > 20.1


def test_what_grows_does_so_beside_what_a_scene_has_already(spindle):
    """A preload that is lost at the reference too changed matrices there, and not what was asked beside it."""
    softer = by_name("modulus_softening")
    worn = replace(spindle, effects=(Addition("preload_loss", by_name("preload_loss").typical() | {"thermal_share": 0.0}),))
    for scene in (spindle, worn):
        (own,) = with_own_laws(variants(softer)[:1], scene, CONDITIONS)
        assert own.reference == Condition(20.0, 0.0, 0.0, np.inf)


@pytest.fixture(scope="module")
def model(spindle):
    campaign = virtual_campaign(spindle, [Condition(20.0), Condition(50.0, 7200 * RPM)], 1, frequency=np.arange(400.0, 6000.1, 80.0))
    return model_of(spindle, campaign)


def vector(problem: Problem, mechanism: Mechanism, sizes) -> np.ndarray:
    p = np.zeros(problem.length)
    z = np.linalg.solve(problem.roots[0], np.asarray(sizes) - mechanism.size.neutral)
    p[problem.nuisances : problem.nuisances + len(z)] = z
    return p


def test_neutral_sizes_change_nothing(spindle, model):
    """Exactly, for every effect of the catalogue and every free form."""
    for m in [*(v for e in usable(spindle) for v in variants(e)[:1]), *free_forms(spindle)]:
        problem = Problem(model, [m])
        for t in (0, 1):
            assert np.array_equal(problem.residual(t, np.zeros(problem.length)), model.residual(t, np.zeros(problem.nuisances), [])), m.name


def test_values_at_neutral_go_through_the_effect_unchanged(spindle, model):
    """A free form that is applied, not left out, at no change: the same to rounding."""
    for m in free_forms(spindle):
        for t in (0, 1):
            with_it = model.residual(t, np.zeros(len(model.parameters)), [(m.effect, m.values(0.0, []))])
            without = model.residual(t, np.zeros(len(model.parameters)), [])
            assert with_it == pytest.approx(without, abs=1e-6 * np.abs(without).max()), m.name


@pytest.mark.parametrize(
    ("form", "names"),
    [("preload", {"preload_loss"}), ("mount axial stiffness", {"mount_compliance"}), ("bearings damping", {"grease_damping"}), ("flange damping", set())],
)
def test_a_free_form_is_alike_to_effects_that_change_the_same(spindle, model, form, names):
    """Whatever their laws; an effect of the same bearings that changes them otherwise is another."""
    free = next(m for m in free_forms(spindle) if m.name == form)
    asked = ("preload_loss", "mount_compliance", "grease_damping", "clearance_opening", "soak_lag", "modulus_softening")
    named = [v for e in usable(spindle) if e.name in asked for v in variants(e)]
    assert {m.name for m in named if alike(model, np.zeros(len(model.parameters)), free, m)} == names


@pytest.mark.parametrize(("errors", "same"), [((0.02, 0.004), True), ((0.002, 4e-4), False), ((0.0, 0.0), False)])
def test_a_free_form_is_alike_to_an_effect_at_shapes_that_the_data_do_not_tell_from_those_fitted(spindle, model, errors, same):
    """Blind campaign 3426: a flange that was softer was found with 0.96 of it in translations, by noise, and then counted as something else."""
    x, free = np.zeros(len(model.parameters)), next(m for m in free_forms(spindle) if m.name == "flange stiffness")
    flange = with_own_laws(variants(by_name("flange_fit_loosening")), spindle, CONDITIONS)[0]
    assert [q.name for q in flange.shape] == ["translation_share", "loss_factor"]
    assert alike(model, x, free, flange, (1.0, 0.02))
    assert not alike(model, x, free, flange, (0.95, 0.015))
    assert alike(model, x, free, flange, (0.95, 0.015), np.array(errors)) == same


def test_a_free_form_says_how_much_of_an_effect_that_would_be(spindle, model):
    """A preload lower by 2 % and by 4 % (of ln) is a loss of so much, to first order; of what changes otherwise it says nothing."""
    x, free = np.zeros(len(model.parameters)), {m.name: m for m in free_forms(spindle)}
    own = with_own_laws([v for e in usable(spindle) if e.name == "preload_loss" for v in variants(e)], spindle, CONDITIONS)[0]
    told = as_told_by(model, x, free["preload"], own, np.array([-2.0, -4.0]))
    assert told == pytest.approx([0.02, 0.04], rel=0.02)
    assert as_told_by(model, x, free["flange damping"], own, np.array([-2.0, -4.0])) is None


def test_an_element_that_drifts_whole_is_the_sum_of_its_directions(spindle, model):
    found = {m.name: m for m in free_forms(spindle)}
    x = np.zeros(len(model.parameters))

    def column(name):
        m = found[name]
        return Problem(model, (m,)).by_size(1, x, [(m.effect, m.values(0.0, []))], 0)

    for element, whole, directions in [
        ("flange ", "", ("axial ", "lateral ", "tilt ")), ("flange ", "lateral ", ("x ", "y ")), ("flange ", "tilt ", ("tilt x ", "tilt y ")),
        ("bearings ", "", ("radial ", "axial ", "tilt ")), ("bearings ", "radial ", ("x ", "y ")),
    ]:  # fmt: skip
        parts = sum(column(f"{element}{direction}stiffness") for direction in directions)
        assert column(f"{element}{whole}stiffness") == pytest.approx(parts, abs=1e-3 * np.abs(parts).max()), (element, whole)


def test_cross_coupled_stiffness_feeds_one_whirl_and_damps_the_other():
    """Of a pair of modes that coincides (symmetric scene, at rest) one whirl loses the damping that the
    other gains, s -> s -+ i k_xy phi^2 / (2 i omega) to first order, and their mean frequency stays
    (Friswell and others, 2010, 7.3); what is exact of the residual's derivative is its difference."""
    scene = load(ROOT / "tests" / "scenes" / "symmetric")
    m = next(m for m in free_forms(scene) if m.name == "bearings cross-coupled stiffness")
    campaign = virtual_campaign(scene, [Condition(20.0)], 1, frequency=np.arange(400.0, 6000.1, 80.0))
    model, plain = model_of(scene, campaign), operating_point(scene, Condition(20.0))
    crossed = operating_point(scene, Condition(20.0), [(m.effect, m.values(0.2, []))])
    for before, after in zip(plain.state.bearings, crossed.state.bearings, strict=True):
        assert after.stiffness[0, 1] - before.stiffness[0, 1] == pytest.approx(np.expm1(2e-3) * before.stiffness[0, 0], rel=1e-9)
        assert after.stiffness[1, 0] - before.stiffness[1, 0] == pytest.approx(-np.expm1(2e-3) * before.stiffness[0, 0], rel=1e-9)
    lateral = [i for i, mode in enumerate(plain.modes) if mode.kind in ("rocking", "lateral")]
    pairs = [(i, i + 1) for i in lateral[::2]]
    moved = [[crossed.modes[i].damping_ratio - plain.modes[i].damping_ratio for i in pair] for pair in pairs]
    assert max(abs(a - b) for a, b in moved) > 1e-4  # of some pair the bearings hold enough
    for pair, (a, b) in zip(pairs, moved, strict=True):
        assert a + b == pytest.approx(0.0, abs=2e-3 * max(abs(a), 1e-6))
        rise = [crossed.modes[i].frequency / plain.modes[i].frequency - 1 for i in pair]
        assert sum(rise) == pytest.approx(0.0, abs=3e-6)  # second order
    x = np.zeros(len(model.parameters))
    by_size = Problem(model, (m,)).by_size(0, x, [(m.effect, m.values(0.0, []))], 0)
    ends = [model.residual(0, x, [(m.effect, m.values(size, []))]) for size in (-1e-4, 1e-4)]
    assert by_size == pytest.approx((ends[1] - ends[0]) / 2e-4, abs=1e-4 * np.abs(by_size).max())


@pytest.mark.parametrize(("form", "kept"), [("hub mass", ()), ("hub transverse inertia", ("mass", "polar"))])
def test_what_turns_that_drifts_is_a_drawing_of_another_mass(spindle, form, kept):
    """By a tenth (of ln), at speed: the poles of a drawing whose hub weighs so much more, or is only harder to tilt."""
    m, f = next(m for m in free_forms(spindle) if m.name == form), np.exp(0.1)
    hub = spindle.turning
    x, y, z = hub.inertia
    other = replace(hub, mass=hub.mass * (1 if "mass" in kept else f), inertia=(f * x, f * y, z * (1 if "polar" in kept else f)))
    bodies = tuple(other if b is hub else b for b in spindle.structure.bodies)
    drawn = operating_point(replace(spindle, structure=replace(spindle.structure, bodies=bodies)), CONDITIONS[2], ())
    drifted = operating_point(spindle, CONDITIONS[2], [(m.effect, m.values(10.0, []))])
    assert [m.frequency for m in drifted.modes] == pytest.approx([m.frequency for m in drawn.modes], rel=1e-9)


@pytest.mark.parametrize(("label", "moves"), [("", (1, 1, 1)), (" across the axis", (1, 1, 0)), (" along the axis", (0, 0, 1))])
def test_what_turns_may_be_held_from_outside(spindle, label, moves):
    """By so many N/um at the hub's centre, either way: what the motion of the hub's centre makes of
    K, and nothing else; no effect changes the same."""
    m = next(m for m in free_forms(spindle) if m.name == f"spring from hub to ground{label}")
    plain = operating_point(spindle, CONDITIONS[2], ())
    rows = motion_rows(plain.chain, "hub", [0.0, 0.0, spindle.turning.z])[:3]
    for change in (0.25, -0.25):
        held = operating_point(spindle, CONDITIONS[2], [(m.effect, m.values(change, []))])
        expected = 1e6 * change * rows.T @ np.diag(moves) @ rows
        assert held.linear.stiffness - plain.linear.stiffness == pytest.approx(expected, abs=1e-9 * np.abs(plain.linear.stiffness).max())
        assert np.array_equal(held.linear.damping, plain.linear.damping)


@pytest.fixture(scope="module")
def machine_tool():
    return load(ROOT / "scenes" / "five_bearing")


def test_of_a_flexible_shaft_the_whole_drifts(machine_tool):
    names = [m.name for m in free_forms(machine_tool)]
    assert [n for n in names if "mass" in n or "inertia" in n] == ["spindle mass", "spindle transverse inertia"]
    assert [n.removeprefix("spring from spindle to ground") for n in names if n.startswith("spring")] == [
        "", " across the axis", " along the axis", *(f" across the axis at {place}" for place in ("nose", "flange", "middle", "end")),
    ]  # fmt: skip


def test_a_flexible_shaft_that_is_harder_to_tilt_is_a_drawing_whose_sections_are(machine_tool):
    m, f = next(m for m in free_forms(machine_tool) if m.name == "spindle transverse inertia"), np.exp(0.1)
    bodies = tuple(
        replace(b, inertia=(f * b.inertia[0], f * b.inertia[1], b.inertia[2])) if b.turns else b for b in machine_tool.structure.bodies
    )
    at = Condition(20.0, 4000 * RPM)
    drawn = operating_point(replace(machine_tool, structure=replace(machine_tool.structure, bodies=bodies)), at, ())
    drifted = operating_point(machine_tool, at, [(m.effect, m.values(10.0, []))])
    assert [m.frequency for m in drifted.modes] == pytest.approx([m.frequency for m in drawn.modes], rel=1e-9)
    lower = [b.frequency - a.frequency for a, b in zip(drifted.modes, operating_point(machine_tool, at, ()).modes, strict=True)]
    assert min(lower) > -1e-6  # not at all of the axial ones
    assert max(lower) > 1.0


def test_a_flexible_shaft_may_be_held_where_it_is_measured(machine_tool):
    """Across the axis, at the node that the sensor sits on."""
    m = next(m for m in free_forms(machine_tool) if m.name == "spring from spindle to ground across the axis at end")
    plain = operating_point(machine_tool, Condition(20.0, 4000 * RPM), ())
    end = machine_tool.structure.body(next(p.body for p in machine_tool.points if p.name == "end"))
    rows = motion_rows(plain.chain, end.name, [0.0, 0.0, end.z])[:2]
    held = operating_point(machine_tool, Condition(20.0, 4000 * RPM), [(m.effect, m.values(-2.0, []))])
    change = held.linear.stiffness - plain.linear.stiffness
    assert change == pytest.approx(-2e6 * rows.T @ rows, abs=1e-9 * np.abs(plain.linear.stiffness).max())


@pytest.mark.parametrize("name", ["preload_loss", "lubricant_film", "thermal_gradient"])
def test_beyond_its_limits_a_size_goes_straight_on(spindle, model, name):
    """Continuous at the limit, and three equal steps beyond it change the matrices equally, along the
    slope inside; residuals are those of such matrices, whose derivative by the size is their difference
    beyond the limit too. Of residuals that went straight on themselves a damping a fifth beyond was
    wrong by many errors, and fits stalled (campaign 728 of the blind study: 1800 in ln evidence short)."""
    found = {e.name: e for e in usable(spindle)}
    m = variants(found[name])[0]
    problem = Problem(model, [m])
    limit, step = m.size.limits[0], m.size.prior_sd
    if m.size.limits[0] < m.size.neutral - 5 * step:
        step = 0.02 * abs(limit)
    x = np.zeros(len(model.parameters))

    def stiffness(size):
        return model.linear(1, x, [(m.effect, m.values(size, [q.neutral for q in m.shape]))]).matrices.stiffness

    k = [stiffness(limit - n * step) for n in (0, 1, 2, 3, 1e-6)]
    first, second, third = k[1] - k[0], k[2] - k[1], k[3] - k[2]
    assert np.linalg.norm(first) > 0
    assert second == pytest.approx(first, abs=1e-6 * np.abs(first).max())
    assert third == pytest.approx(first, abs=1e-6 * np.abs(first).max())
    assert k[4] == pytest.approx(k[0], abs=1e-5 * np.abs(first).max())
    slope, beyond = (stiffness(limit + 0.02 * m.size.prior_sd) - k[0]) / (0.02 * m.size.prior_sd), (k[0] - k[1]) / step
    assert np.linalg.norm(slope - beyond) < 0.05 * np.linalg.norm(slope)

    def residual(size):
        return problem.residual(1, vector(problem, m, [m.size.neutral, size]))

    at, d = limit - step / 2, 1e-4 * step
    by_size = problem.by_size(1, x, [(m.effect, m.values(at, [q.neutral for q in m.shape]))], 0)
    assert by_size == pytest.approx((residual(at + d) - residual(at - d)) / (2 * d), abs=1e-4 * np.abs(by_size).max())


@pytest.mark.parametrize("table", [False, True])
def test_derivatives_by_sizes(spindle, model, table):
    """Whitened sizes of two mechanisms beside each other, the second test's depending on the first's: against differences."""
    used = model_of(spindle, mode_campaign(spindle, [Condition(20.0), Condition(50.0, 7200 * RPM)], 1)) if table else model
    named = next(v for e in usable(spindle) if e.name == "preload_loss" for v in variants(e))
    free = next(m for m in free_forms(spindle) if m.name == "bearings damping")
    problem = Problem(used, [named, free])
    random = np.random.default_rng(4)
    p = 0.1 * random.standard_normal(problem.length)
    p[[i for i, q in enumerate(used.parameters) if q.kind == RECORD]] = 0.0  # beside which other derivatives are nearly right only
    p[problem.nuisances :] = np.abs(p[problem.nuisances :])  # within limits: at one of them derivatives are those from inside
    rates = rates_of(used, problem.parts(p)[0], problem.effects_of(p))
    for t in (0, 1):
        by = problem.linearised(t, p, rates)[1]
        for i in by.numbers[by.numbers >= problem.nuisances]:
            up, down = p.copy(), p.copy()
            up[i] += 1e-3
            down[i] -= 1e-3
            wanted = (problem.residual(t, up) - problem.residual(t, down)) / 2e-3
            found = by.whole[list(by.numbers).index(i)]
            assert np.linalg.norm(found - wanted) <= 2e-2 * np.linalg.norm(wanted) + 1e-9
