"""Runout diagnosed: lines with honest errors, hidden imperfections named by kind, ring and order, and nothing named where nothing hides."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pytest

from tests.conftest import SCENE
from thermospindle.cli import main
from thermospindle.diagnosis.runout.compare import compare_runout, rms_residual
from thermospindle.diagnosis.runout.lines import look
from thermospindle.diagnosis.runout.next_test import next_runout
from thermospindle.diagnosis.runout.verdict import RunoutDiagnosis, diagnose_runout
from thermospindle.model.built.drawn import drawn
from thermospindle.model.built.imperfections import Imperfections
from thermospindle.model.built.tolerance import toleranced
from thermospindle.model.errors import BadInput
from thermospindle.model.machine import Addition, Condition, Spindle
from thermospindle.model.units import RPM
from thermospindle.report.text.runout_diagnosis import runout_diagnosis_json
from thermospindle.sim.campaign.campaign import Campaign, read_campaign, write_campaign
from thermospindle.sim.campaign.runout_record import RunoutRecord
from thermospindle.sim.campaign.simulated import hub_points, runout_campaign
from thermospindle.sim.effects import CATALOGUE, by_name

CONDITIONS = [Condition(20.0, 3600 * RPM), Condition(20.0, 5400 * RPM), Condition(20.0, 7200 * RPM)]


def hidden(spindle: Spindle, effects: dict[str, dict[str, float]], seed: int, path: str = "linear", own: bool = False, conditions: Sequence[Condition] = CONDITIONS) -> Campaign:
    """A campaign of a spindle with hidden effects, built within its tolerances, with other imperfections of the scene's size unless `own`."""
    random = np.random.default_rng(seed)
    true = replace(spindle, effects=tuple(Addition(n, by_name(n).typical() | v) for n, v in effects.items()))
    if not own:
        races = {b.name: [w for w in spindle.imperfections.row(b.name).outer_radial if w.order == 1] for b in spindle.bearings}
        others = drawn(spindle, seed)
        rows = {b: replace(row, outer_radial=(*row.outer_radial, *races[b])) for b, row in others.bearings.items()}
        true = replace(true, imperfections=replace(others, bearings=rows))
    for parameter in toleranced(true):
        true = parameter.apply(true, parameter.sd * random.standard_normal())
    return runout_campaign(true, conditions, 0.5, seed=seed, path=path)


def found(spindle: Spindle, effects: dict[str, dict[str, float]], seed: int = 1, **options) -> RunoutDiagnosis:
    return diagnose_runout(spindle, hidden(spindle, effects, seed, **options))


HIDDEN = {
    "unbalance": {"amount": 1.5, "phase": 100.0},
    "race_waviness": {"amplitude": 100.0, "multiple": 1, "offset": 1, "ring": 0, "bearing": 1},
    "ball_size": {"difference": 1500.0, "bearing": 0},
    "ball_waviness": {"amplitude": 500.0, "half_order": 1, "bearing": 1},
    "cage_unbalance": {"amount": 0.6, "phase": 10.0, "bearing": 1},
}


@pytest.mark.parametrize("name", ["cage_unbalance", *(pytest.param(n, marks=pytest.mark.slow) for n in ("ball_size", "unbalance", "race_waviness", "ball_waviness"))])
def test_a_hidden_imperfection_is_named_with_its_size_and_place(spindle, name) -> None:
    values = HIDDEN[name]
    d = found(spindle, {name: values})
    assert (d.verdict, d.effects) == ("identified", (name,)), d.reason
    best = next(e for e in d.explanations if e.effects == (name,))
    main_one = by_name(name).parameters[0]
    assert best.size[0] == pytest.approx(values[main_one.name], abs=4 * best.size_sd[0])
    chosen = {p.name: best.variants[0].values[p.name] for p in by_name(name).parameters if p.choices}
    assert chosen == {k: values[k] for k in chosen}
    told = runout_diagnosis_json(d, CATALOGUE, spindle)["candidates"][0]["parameters"]
    rings = {k.split(".")[1]: v["called"] for k, v in told.items() if "called" in v}
    names = {"bearing": [b.name for b in spindle.bearings], "ring": ["inner", "outer"]}
    assert rings == {k: names[k][int(v)] for k, v in values.items() if k in names}
    assert best.size[0] > d.smallest[name]


@pytest.mark.parametrize("own", [pytest.param(True, id="own", marks=pytest.mark.slow), pytest.param(False, id="drawn")])
def test_nothing_is_named_where_nothing_hides(spindle, own) -> None:
    d = found(spindle, {}, seed=4, own=own)
    assert (d.verdict, d.effects) == ("none", ()), d.reason
    assert all(e.delta_evidence < 12 for e in d.explanations)


@pytest.mark.parametrize("ring", [pytest.param(0, id="inner"), pytest.param(1, id="outer", marks=pytest.mark.slow)])
def test_waviness_of_the_other_ring_is_not_named(spindle, ring) -> None:
    """The outer ring turns: the same order is another line on either ring."""
    d = found(spindle, {"race_waviness": {"amplitude": 60.0, "multiple": 2, "offset": 0, "ring": ring, "bearing": 0}}, seed=6)
    assert (d.verdict, d.effects) == ("identified", ("race_waviness",)), d.reason
    rings = {e.variants[0].values["ring"] for e in d.explanations if e.effects[0] == "race_waviness" and e.delta_evidence > 12}
    assert rings == {ring}


@pytest.mark.slow
def test_two_effects_are_both_named(spindle) -> None:
    d = found(spindle, {n: HIDDEN[n] for n in ("race_waviness", "ball_size")}, seed=2)
    assert d.verdict == "two effects", d.reason
    assert set(d.effects) == {"race_waviness", "ball_size"}


def test_a_line_that_no_imperfection_has_is_unexplained(spindle) -> None:
    made = hidden(spindle, {}, 3)
    time = made.tests[1].runout.axis
    hum = replace(made.tests[1].runout, value=made.tests[1].runout.value + 3e-8 * np.cos(2 * np.pi * 150.0 * time))
    d = diagnose_runout(spindle, replace(made, tests=(made.tests[0], replace(made.tests[1], runout=hum), made.tests[2])))
    assert (d.verdict, d.effects) == ("unexplained", ())
    assert d.unexplained[0].frequency == pytest.approx(150.0, abs=1.0)
    assert d.unexplained[0].test == made.tests[1].id
    answer = runout_diagnosis_json(d, CATALOGUE, spindle)
    assert answer["unexplained_lines"][0]["order"] == pytest.approx(150 / 90, rel=0.01)
    assert "150.0 Hz" in answer["reason"] or f"{d.unexplained[0].frequency:.1f} Hz" in answer["reason"]


HEAVY_CAGE = {"cage_unbalance": {"amount": 6.0, "phase": 0.0, "bearing": 1}}


@pytest.fixture(scope="module")
def heavy_cage(spindle) -> tuple[Campaign, RunoutDiagnosis]:
    """Tests at three speeds, and the diagnosis of the last alone."""
    made = hidden(spindle, HEAVY_CAGE, 5)
    return made, diagnose_runout(spindle, replace(made, tests=made.tests[2:]))


@pytest.mark.slow
def test_with_one_speed_the_cage_and_the_balls_are_not_told_apart_for_certain(spindle, heavy_cage) -> None:
    """Both whirl the hub at fc; only speed tells them apart, and the balls' size is the likelier: a
    cage so heavy is 30 of its standard deviations."""
    made, d = heavy_cage
    assert d.verdict == "ambiguous", d.reason
    assert set(d.effects) == {"ball_size", "cage_unbalance"}
    several = diagnose_runout(spindle, made)
    assert several.effects == ("cage_unbalance",)


# ---------------------------------------------------------------- lines


def test_errors_of_lines_come_true(spindle) -> None:
    """Noise alone on a perfect spindle: phasors over their standard errors scatter as they should, in every line."""
    perfect = replace(spindle, imperfections=Imperfections())
    made = runout_campaign(perfect, [CONDITIONS[2]] * 6, 0.4, seed=1, noise=1e-8, path="linear")
    looked = [look(spindle, t) for t in made.tests]
    pulls = np.concatenate([np.abs(line.phasor / line.sd) for seen in looked for line in seen.seen])
    assert np.mean(pulls**2) == pytest.approx(1.0, abs=0.25)
    assert not any(seen.unexplained for seen in looked)


def as_spectrum(record: RunoutRecord, phased: bool) -> RunoutRecord:
    """Amplitude spectrum of a record through a Hann window."""
    n = record.value.shape[1]
    window = np.hanning(n + 1)[:-1]
    spectrum = np.fft.rfft((record.value - record.value.mean(axis=1, keepdims=True)) * window) * 2 / window.sum()
    return RunoutRecord(
        record.nodes, "spectrum", np.fft.rfftfreq(n, record.step), spectrum if phased else np.abs(spectrum) + 0j, "hann", phased
    )


def test_spectra_show_the_lines_of_the_records_they_were_made_from(spindle) -> None:
    made = hidden(spindle, {"race_waviness": HIDDEN["race_waviness"]}, 1)
    seen = as_spectrum(made.tests[2].runout, True)
    exact, summed = look(spindle, made.tests[2]), look(spindle, replace(made.tests[2], runout=seen))
    for frequency in (120.0, 695.27):
        a, b = (next(g for g in s.seen if abs(g.frequency - frequency) < 2) for s in (exact, summed))
        radial = [0, 1, 3, 4]
        assert np.abs(b.phasor)[radial] == pytest.approx(np.abs(a.phasor)[radial], rel=0.05)
        assert np.angle(b.phasor[1] / b.phasor[0]) == pytest.approx(np.angle(a.phasor[1] / a.phasor[0]), abs=0.1)


@pytest.mark.slow
def test_amplitudes_without_phases_name_the_effect_but_not_the_sense_of_its_whirl(spindle) -> None:
    """Orders 9 and 11 of a standing race differ in nothing but the sense of the whirl, which amplitudes do not show."""
    made = hidden(spindle, {"race_waviness": HIDDEN["race_waviness"]}, 1)
    tests = tuple(replace(t, runout=as_spectrum(t.runout, False)) for t in made.tests)
    d = diagnose_runout(spindle, replace(made, tests=tests))
    assert (d.verdict, d.effects) == ("identified", ("race_waviness",)), d.reason
    near = [
        e.variants[0].values for e in d.explanations if len(e.variants) == 1 and d.explanations[0].delta_evidence - e.delta_evidence < 5
    ]
    assert {(v["multiple"], v["ring"], v["bearing"]) for v in near} == {(1, 0, 1)}
    assert {v["offset"] for v in near} == {-1, 1}
    (test,) = [t for t in d.next if set(t.separates) == {"race_waviness (offset -1)", "race_waviness (offset 1)"}]
    assert test.plan.changed == "with the phases of all probes"


def test_a_contact_angle_a_little_off_is_found_from_the_record(spindle) -> None:
    made = hidden(spindle, {}, 8, own=True)
    assert all(abs(look(spindle, t).slip) < 1e-4 for t in made.tests)
    lower = replace(spindle, bearings=tuple(replace(b, pitch_diameter=b.pitch_diameter * 1.003) for b in spindle.bearings))
    moved = np.mean([look(lower, t).slip - look(spindle, t).slip for t in made.tests])
    assert moved == pytest.approx(0.003, abs=1e-4)  # d / D of the scene is that much too small


def test_noise_moves_no_cage_further_than_its_angle_is_uncertain(spindle) -> None:
    """One line and noise on two probes: the least that a record leaves is then found anywhere."""
    test, found = hidden(spindle, {}, 8, own=True).tests[2], []
    random, time = np.random.default_rng(0), test.runout.axis
    for _ in range(6):
        value = 1e-8 * np.cos(2 * np.pi * 120 * time) + 1e-9 * random.standard_normal((2, len(time)))
        found.append(look(spindle, replace(test, runout=replace(test.runout, value=value, nodes=test.runout.nodes[:2]))).slip)
    assert np.sqrt(np.mean(np.square(found))) < 0.002


def test_a_record_sampled_too_slowly_for_the_balls_is_refused(spindle) -> None:
    made = hidden(spindle, {}, 1).tests[2]
    slow = replace(made.runout, axis=made.runout.axis[::16], value=made.runout.value[:, ::16])  # 22.2 kHz / 16
    with pytest.raises(BadInput, match=r"holds nothing above 694\.4 Hz; the first lines of the balls reach 739\.8 Hz"):
        look(spindle, replace(made, runout=slow))


# ---------------------------------------------------------------- compare and the command line


def test_the_scene_that_made_the_records_agrees_with_them_and_another_does_not(spindle) -> None:
    conditions = CONDITIONS[1:]
    made = runout_campaign(spindle, conditions, 0.5, seed=3, path="linear")
    right, wrong = compare_runout(spindle, made), compare_runout(replace(spindle, imperfections=drawn(spindle, 9)), made)
    exactly = [[abs(a.computed - a.measured) for t in them for a in t.lines] for them in (right, wrong)]
    assert np.mean(exactly[0]) < 0.5 * np.mean(exactly[1])
    assert rms_residual(right) < rms_residual(wrong) < 2.0  # other spindles of the drawing are believable too
    line = next(g for g in right[0].lines if g.causes[0].cause == "outer waviness" and g.causes[0].order == 1)
    assert line.frequency == pytest.approx(90.0)
    assert line.computed == pytest.approx(line.measured, rel=0.03)
    for part, within in (
        (right[0].rro[0], 0.05),
        (right[0].rro[1], 0.05),
        (right[0].nrro[0], 0.6),
        (right[0].nrro[1], 0.6),
    ):  # balls beat by chance
        assert part.computed_rms == pytest.approx(part.measured_rms, rel=within)
        assert part.measured is not None
        assert part.measured > 2 * part.measured_rms


@pytest.mark.slow
def test_command_line_from_hidden_effect_to_error_that_falls(spindle, tmp_path, capsys) -> None:
    made = hidden(spindle, {"race_waviness": HIDDEN["race_waviness"]}, 1)
    write_campaign(made, tmp_path / "c")

    def run(*arguments: object):
        assert main([*map(str, arguments), "--json"]) == 0
        return json.loads(capsys.readouterr().out)

    told = run("diagnose", SCENE, tmp_path / "c", "--out", tmp_path / "d")
    keys = {"verdict", "effects", "candidates", "invisible", "detectable", "error", "where", "next_test"}
    assert keys <= told.keys()
    assert (told["verdict"], told["effects"]) == ("identified", ["race_waviness"])
    assert told["candidates"][0]["parameters"]["race_waviness.amplitude"]["unit"] == "nm"
    assert "sensor_gain" in told["invisible"]
    assert set(told["detectable"]) == set(HIDDEN)
    assert told["error"]["after"] < told["error"]["before"]
    assert told["where"][0]["element"] == "upper bearing, inner waviness of order 11"
    run("add", SCENE, "race_waviness", "--from", tmp_path / "d" / "diagnosis.json", "--out", tmp_path / "s")
    compared = run("compare", tmp_path / "s", tmp_path / "c", "--before", SCENE, "--out", tmp_path / "e")
    assert compared["error"]["after"] < 0.6 * compared["error"]["before"]
    assert {"lines", "rro", "nrro"} <= compared["tests"][0].keys()
    assert run("diagnose", tmp_path / "s", tmp_path / "c")["verdict"] == "none"


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["--runout", "--speeds", "0"], "a spindle at rest has no runout"),
        (["--runout", "--speeds", "7200", "--seconds", "-1"], "--seconds -1: must be positive"),
        (["--speeds", "7200"], "--speeds: is for --runout"),
    ],
)
def test_simulate_refuses(tmp_path, capsys, arguments, words) -> None:
    assert main(["simulate", str(SCENE), "--out", str(tmp_path / "c"), *arguments]) == 2
    assert words in capsys.readouterr().err
    assert not (tmp_path / "c").exists()


def test_simulate_writes_a_runout_campaign(tmp_path, capsys) -> None:
    options = ["--runout", "--temperatures", "20", "--speeds", "7200", "--seconds", "0.05", "--out", str(tmp_path / "c"), "--json"]
    assert main(["simulate", str(SCENE), *options]) == 0
    assert json.loads(capsys.readouterr().out)["tests"] == ["T20_n7200"]
    found = read_campaign(tmp_path / "c")
    assert found.quantity == "displacement"
    assert found.tests[0].runout.nodes == tuple(p.node for p in found.points) == (8, 9, 10, 11, 12)


# ---------------------------------------------------------------- by another path: MuJoCo in time


@pytest.mark.slow
@pytest.mark.parametrize("name", [*HIDDEN, "none"])
def test_hidden_in_a_running_simulation(spindle, name) -> None:
    values = HIDDEN.get(name, {}) | (
        {"amount": 2.5} if name == "cage_unbalance" else {}
    )  # square to the balls' eccentricity a small one hardly shows
    d = found(spindle, {name: values} if name in HIDDEN else {}, seed=11, path="simulated")
    expected = ("identified", (name,)) if name in HIDDEN else ("none", ())
    assert (d.verdict, d.effects) == expected, d.reason


def test_probes_of_the_hub_are_points_that_a_campaign_can_name(spindle) -> None:
    assert len({p.node for p in (*spindle.points, *hub_points(spindle))}) == len(spindle.points) + 5


# ---------------------------------------------------------------- the next test


def test_the_test_that_is_proposed_parts_look_alikes_and_decides_for_the_true_one(spindle, heavy_cage) -> None:
    """A heavy cage and a large ball show one line at fc; at one speed its size could be either's."""
    made, before = heavy_cage
    assert before.verdict == "ambiguous"
    (test,) = runout_diagnosis_json(before, CATALOGUE, spindle)["next_test"]
    assert set(test["separates"]) == set(test["predicted"]) == {"ball_size", "cage_unbalance"}
    assert test["condition"]["speed_rpm"] != 7200
    assert test["odds"] > 1e3
    proposed = hidden(spindle, HEAVY_CAGE, 5, conditions=[CONDITIONS[2], before.next[0].plan.condition]).tests[1]
    after = diagnose_runout(spindle, replace(made, tests=(*made.tests[2:], proposed)))
    assert (after.verdict, after.effects) == ("identified", ("cage_unbalance",)), after.reason
    predicted = {name: rows[0] for name, rows in test["predicted"].items()}
    seen = min(look(spindle, proposed).seen, key=lambda s: abs(s.frequency - predicted["ball_size"]["frequency_Hz"]))
    measured = 1e6 * abs(seen.phasor[seen_at(proposed, predicted["ball_size"]["node"])])
    assert measured == pytest.approx(predicted["cage_unbalance"]["amplitude_um"], rel=0.2)
    assert abs(measured / predicted["ball_size"]["amplitude_um"] - 1) > 0.3


def seen_at(test, node: int) -> int:
    return test.runout.nodes.index(node)


def test_what_no_test_parts_is_said_to_be_so(spindle) -> None:
    """An explanation and itself under another name: nothing can tell them apart."""
    made = hidden(spindle, {"unbalance": HIDDEN["unbalance"]}, 1)
    d = diagnose_runout(spindle, replace(made, tests=made.tests[2:]))
    lead = d.explanations[0]
    alias = replace(lead, variants=tuple(replace(v, effect=replace(v.effect, name="another")) for v in lead.variants))
    tests, words = next_runout(spindle, d.seen, made.points, [lead, alias], lambda done: None)
    assert tests == ()
    assert words.startswith("No test of those tried")
    assert f"{lead.effects[0]} from another: at best odds of 1 to 1" in words
