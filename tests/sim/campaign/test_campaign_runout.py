"""Runout in campaigns: what is written reads back, other programs' files read correctly, bad files
are refused by name; virtual ones are physical."""

from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import pyuff

from tests.conftest import ROOT
from thermospindle.diagnosis.runout.lines import look
from thermospindle.model.built.imperfections import Imperfections, RowImperfections, Wave
from thermospindle.model.drawing.measuring import Point
from thermospindle.model.errors import BadInput
from thermospindle.model.machine import Condition
from thermospindle.model.scene.reading import load
from thermospindle.model.units import RPM
from thermospindle.sim.campaign.campaign import Campaign, Test, read_campaign, write_campaign
from thermospindle.sim.campaign.runout_record import RunoutRecord, read_runout, same, write_runout
from thermospindle.sim.campaign.simulated import excited, hub_points, runout_campaign, set_down
from thermospindle.sim.operating import operating_point
from thermospindle.sim.running.excitation import harmonics, response

SPEED = 7200 * RPM
POINTS = (
    Point(1, "hub_x", "hub", (0.0125, 0.0, 0.019), (1.0, 0.0, 0.0)),
    Point(2, "hub_y", "hub", (0.0, 0.0125, 0.019), (0.0, 1.0, 0.0)),
)


def record(kind: str = "time", phased: bool = True) -> RunoutRecord:
    time = np.arange(2000) / 10000.0
    value = 1e-7 * np.array([np.cos(2 * np.pi * 120 * time), np.sin(2 * np.pi * 120 * time) + 0.3 * np.cos(2 * np.pi * 69.5 * time)])
    if kind == "time":
        return RunoutRecord((1, 2), kind, time, value)
    window = np.hanning(2001)[:-1]
    spectrum = np.fft.rfft(value * window) * 2 / window.sum() + 1e-12
    return RunoutRecord((1, 2), kind, np.fft.rfftfreq(2000, 1e-4), spectrum, "hann", phased)


def campaign(*records: RunoutRecord) -> Campaign:
    tests = tuple(Test(f"t{i}", 20.0, SPEED, runout=r) for i, r in enumerate(records))
    return Campaign("runout", "hdd_2003", "displacement", POINTS, tests)


def test_records_and_spectra_read_back(tmp_path: Path) -> None:
    written = campaign(record(), record("spectrum"), record("spectrum", phased=False))
    write_campaign(written, tmp_path / "c")
    found = read_campaign(tmp_path / "c")
    assert [t.runout.kind for t in found.tests] == ["time", "spectrum", "spectrum"]
    for a, b in zip(found.tests, written.tests, strict=True):
        assert same(a.runout, b.runout)
    assert found.tests[0].runout.value == pytest.approx(written.tests[0].runout.value, rel=1e-10, abs=1e-20)
    assert not found.tests[2].runout.phased
    assert sorted(p.name for p in (tmp_path / "c").iterdir()) == ["campaign.toml", "t0_runout.csv", "t1_runout.csv", "t2_runout.csv"]
    assert not same(found.tests[0].runout, found.tests[1].runout)
    assert not same(replace(found.tests[0].runout, value=1.001 * found.tests[0].runout.value), written.tests[0].runout)


def test_units_of_columns_are_those_of_their_names(tmp_path: Path) -> None:
    write_runout(tmp_path / "a.csv", record())
    lines = (tmp_path / "a.csv").read_text().splitlines()
    for unit, factor in (("nm", 1e-3), ("mm", 1e3), ("m", 1e6)):
        (tmp_path / "b.csv").write_text("\n".join([f"time_s,1_{unit},2_{unit}", *lines[1:]]))
        found = read_runout(tmp_path / "b.csv", POINTS, SPEED, None)
        assert found.value == pytest.approx(factor * record().value, rel=1e-9, abs=1e-12)


@pytest.mark.parametrize("function", [1, 12])
def test_uff_files_of_other_programs(tmp_path: Path, function: int) -> None:
    """In micrometres, y measured against its direction, whether time responses or complex spectra."""
    made = record("time" if function == 1 else "spectrum")
    for node, value in zip(made.nodes, made.value, strict=True):
        sets = {
            "type": 58, "func_type": 1 if function == 1 else 4, "rsp_node": node, "rsp_dir": 1 if node == 1 else -2, "ref_node": 0, "ref_dir": 0, "rsp_ent_name": "hub",
            "id1": "runout", "data": (1e6 if node == 1 else -1e6) * value, "x": made.axis, "abscissa_spacing": 1, "binary": 0,
            "abscissa_spec_data_type": 17 if function == 1 else 18, "abscissa_axis_units_lab": "s" if function == 1 else "Hz",
            "ordinate_spec_data_type": 8, "ordinate_axis_units_lab": "um", "orddenom_spec_data_type": 0, "orddenom_axis_units_lab": "NONE",
        }  # fmt: skip
        pyuff.UFF(str(tmp_path / "a.uff")).write_sets(sets, mode="add")
    if function == 12:  # which pyuff does not write
        text = (tmp_path / "a.uff").read_text()
        assert len(re.findall("^    4 ", text, re.MULTILINE)) == 2
        (tmp_path / "a.uff").write_text(re.sub("^    4 ", "   12 ", text, flags=re.MULTILINE))
    found = read_runout(tmp_path / "a.uff", POINTS, SPEED, None if function == 1 else "hann")
    assert found.kind == made.kind
    assert found.value == pytest.approx(made.value, rel=1e-4, abs=1e-12)
    text = (tmp_path / "a.uff").read_text()
    for old, new, words in (
        ("um ", "kg ", "set 1 .*numerator unit 'kg'; allowed for displacement"),
        ("         2  -2", "         7  -2", "node 7 is no point of the campaign"),
        ("         1   1 ", "         1   3 ", "response direction 3 is not along the point's"),
    ):
        assert old in text
        (tmp_path / "b.uff").write_text(text.replace(old, new))
        with pytest.raises(BadInput, match=words):
            read_runout(tmp_path / "b.uff", POINTS, SPEED, None if function == 1 else "hann")


def changed(line: int, old: str, new: str):
    def change(lines: list[str]) -> list[str]:
        assert old in lines[line]
        return [*lines[:line], lines[line].replace(old, new, 1), *lines[line + 1 :]]

    return change


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (changed(0, "1_um", "1_V"), "line 1: '1_V': allowed are <node>_um, _nm, _mm or _m"),
        (changed(0, "1_um", "9_um"), r"line 1: '9_um': node '9' is no point of the campaign; allowed are \[1, 2\]"),
        (changed(0, "1_um", "2_um"), "node 2 stands twice"),
        (changed(0, "time_s", "t"), "the first column is 't'; allowed are time_s and frequency_Hz"),
        (changed(7, ",", ",nan,", ), "line 8: has 4 cells; 3 are needed"),
        (lambda lines: [*lines[:5], "0.0004,nan,0", *lines[6:]], "line 6: NaN or infinite"),
        (lambda lines: [*lines[:5], "0.0004,x,0", *lines[6:]], "line 6: .*every cell must be a number"),
        (lambda lines: [*lines[:5], "0.0004,1_0,0", *lines[6:]], "line 6: .*every cell must be a number"),
        (lambda lines: [*lines[:5], *lines[6:]], "time_s: from 0.0003 to 0.0005 among steps of 0.0001; no sample may be missing"),
        (lambda lines: lines[:300], "3.59 revolutions at 7200 rpm; at least 4 whole ones are needed"),
        (lambda lines: [lines[0], *lines[1::50]], "holds nothing above 100 Hz"),
        (lambda lines: [lines[0], *(line[: line.rfind(",")] + ",0.5" for line in lines[1:])], "node 2: the same value throughout; a dead channel"),
        (lambda lines: [*lines[:100], *(re.sub(",[^,]*$", ",0.1", x) for x in lines[100:110]), *lines[110:]], "node 2: 8 equal samples from 0.0099 s"),
        (lambda lines: lines[:9], "holds 8 samples"),
    ],
)  # fmt: skip
def test_bad_files_are_refused_by_name(tmp_path: Path, change, words: str) -> None:
    file = tmp_path / "a.csv"
    write_runout(file, record())
    read_runout(file, POINTS, SPEED, None)
    file.write_text("\n".join(change(file.read_text().splitlines())) + "\n")
    with pytest.raises(BadInput, match=words) as refusal:
        read_runout(file, POINTS, SPEED, None)
    assert str(file) in str(refusal.value)


def test_a_spectrum_says_its_window_and_a_test_turns(tmp_path: Path) -> None:
    write_runout(tmp_path / "s.csv", record("spectrum"))
    write_runout(tmp_path / "t.csv", record())
    with pytest.raises(BadInput, match="needs spectrum_window in its test's table; allowed are none, hann, flattop"):
        read_runout(tmp_path / "s.csv", POINTS, SPEED, None)
    with pytest.raises(BadInput, match="a time record has none"):
        read_runout(tmp_path / "t.csv", POINTS, SPEED, "hann")
    with pytest.raises(BadInput, match="speed_rpm = 0: a spindle at rest has no runout"):
        read_runout(tmp_path / "t.csv", POINTS, 0.0, None)
    with pytest.raises(BadInput, match="no such file"):
        read_runout(tmp_path / "u.csv", POINTS, SPEED, None)


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ('runout = "t0_runout.csv"', 'frf = "t0_runout.csv"', "tests.t0: frf: a campaign of displacement holds runout"),
        ('runout = "t0_runout.csv"', "", "tests.t0: has neither frf nor rows in a table of modes nor runout"),
        ('runout = "t0_runout.csv"', 'runout = "gone.csv"', "gone.csv: no such file"),
        ('quantity = "displacement"', 'quantity = "receptance"\nspectrum_window = "hann"', "spectrum_window"),
    ],
)
def test_bad_tables_are_refused(tmp_path: Path, old: str, new: str, words: str) -> None:
    write_campaign(campaign(record()), tmp_path / "c")
    file = tmp_path / "c" / "campaign.toml"
    text = file.read_text()
    assert old in text
    file.write_text(text.replace(old, new))
    with pytest.raises(BadInput, match=words):
        read_campaign(tmp_path / "c")


@pytest.mark.parametrize(
    ("window", "terms", "bins"),
    [("hann", (0.5, -0.5), 1.5), ("flattop", (0.21557895, -0.41663158, 0.277263158, -0.083578947, 0.006947368), 3.7702)],
)
def test_a_sine_in_noise_has_its_amplitude_through_a_window(tmp_path: Path, window: str, terms: tuple[float, ...], bins: float) -> None:
    """250 nm once a revolution, a third of a bin beside one, zero to peak by the coherent gain a_0;
    the squares of its bins add up to 1 + sum a_k^2 / 2 a_0^2 of its own.

    Without a line there is no more than the standard errors say of noise."""
    spindle = load(ROOT / "scenes" / "mk7702")  # one line at all: its bearings are numbers
    n, step = 2900, 1e-3
    time = step * np.arange(n)
    shape = sum(a * np.cos(2 * np.pi * k * np.arange(n) / n) for k, a in enumerate(terms))
    assert n * np.sum(shape**2) / np.sum(shape) ** 2 == pytest.approx(bins, rel=1e-4)
    value = 2.5e-7 * np.cos(2 * np.pi * 2000 / 60 * time + 0.4) * np.array([[1.0], [0.0]]) + 5e-8 * np.random.default_rng(1).standard_normal((2, n))
    spectrum = np.fft.rfft(value * shape) * 2 / (n * terms[0])
    write_runout(tmp_path / "s.csv", RunoutRecord((1, 2), "spectrum", np.fft.rfftfreq(n, step), spectrum, window))
    seen = look(spindle, Test("t", 20.0, 2000 * RPM, runout=read_runout(tmp_path / "s.csv", POINTS, 2000 * RPM, window)))
    [line] = seen.seen
    assert line.frequency == pytest.approx(2000 / 60)
    assert abs(line.phasor[0]) == pytest.approx(2.5e-7, rel=0.03)
    assert abs(line.phasor[1]) < 3 * line.sd[1] < 2e-8


# ---------------------------------------------------------------- virtual ones


def test_setting_the_balls_down_elsewhere_changes_phases_alone(spindle) -> None:
    """Each imperfection by itself: the amplitude of its lines stays, and the phases of one row's lines of one frequency move together."""
    row = RowImperfections(
        inner_radial=tuple(Wave(n, 2e-8, 0.3) for n in (9, 10, 11, 19)),
        outer_radial=tuple(Wave(n, 3e-8, 0.4) for n in (1, 9, 10, 11)),
        ball_diameter=(1e-6, *[0.0] * 9),
        ball_waves=((Wave(2, 1e-7, 0.2),), *[()] * 9),
        cage_unbalance=1e-7,
    )
    made = Imperfections(1e-6, 0.01, bearings={"upper": row})
    point = operating_point(spindle, Condition(20.0, SPEED))
    other = set_down(made, {"upper": 10}, np.random.default_rng(3))
    assert other != made
    one, two = (excited(point, m) for m in (made, other))
    before, after = ({g: r for g, r in zip(h.line, response(p, h), strict=True)} for p, h in ((p, harmonics(p)) for p in (one, two)))
    assert before.keys() == after.keys()
    turned = {}
    for line, moved in before.items():
        ratio = np.vdot(moved, after[line]) / np.vdot(moved, moved)
        assert abs(ratio) == pytest.approx(1.0, abs=1e-9)
        assert after[line] == pytest.approx(ratio * moved, rel=1e-9, abs=1e-9 * np.abs(moved).max())
        turned.setdefault((line.bearing, round(line.frequency, 6)), []).append(ratio)
    for ratios in turned.values():
        assert ratios == pytest.approx([ratios[0]] * len(ratios), abs=1e-9)
    still = [r for (_, f), ratios in turned.items() for r in ratios if f == pytest.approx(120.0)]
    assert still == pytest.approx([1.0] * len(still), abs=1e-9)  # what turns with the hub keeps its place on it
    assert len(turned) > 8


def test_the_balls_of_one_row_stay_in_it() -> None:
    """Of a bearing with two rows they went from one to the other."""
    row = RowImperfections(ball_diameter=(1e-6, 2e-6, 3e-6, 11e-6, 12e-6, 13e-6))
    seen = [set_down(Imperfections(bearings={"front": row}), {"front": 3}, np.random.default_rng(seed)).bearings["front"].ball_diameter for seed in range(8)]
    assert len(set(seen)) > 1
    for of in seen:
        assert (set(of[:3]), set(of[3:])) == (set(row.ball_diameter[:3]), set(row.ball_diameter[3:]))


def test_five_probes_see_the_hub_in_two_planes(spindle) -> None:
    points = hub_points(spindle)
    assert [p.node for p in points] == [8, 9, 10, 11, 12]
    assert [p.direction[2] for p in points] == [0, 0, 1, 0, 0]
    heights = {p.position[2] for p in points if p.direction[2] == 0}
    assert max(heights) - min(heights) > 0.01


def test_a_virtual_campaign_is_the_same_for_the_same_seed_and_reads_back(spindle, tmp_path: Path) -> None:
    conditions = [Condition(20.0, SPEED), Condition(20.0, SPEED)]
    first, second, other = (runout_campaign(spindle, conditions, 0.05, seed=s, path="linear") for s in (1, 1, 2))
    assert [t.id for t in first.tests] == ["T20_n7200", "T20_n7200_2"]
    assert [t.repeat for t in first.tests] == [1, 2]
    assert all(same(a.runout, b.runout) for a, b in zip(first.tests, second.tests, strict=True))
    assert not same(first.tests[0].runout, other.tests[0].runout)
    assert not same(first.tests[0].runout, first.tests[1].runout)
    write_campaign(first, tmp_path / "c")
    assert all(same(a.runout, b.runout) for a, b in zip(first.tests, read_campaign(tmp_path / "c").tests, strict=True))
    with pytest.raises(BadInput, match="a spindle at rest has no runout"):
        runout_campaign(spindle, [Condition(20.0, 0.0)], 0.05)


def test_mujoco_and_the_linear_answer_make_the_same_campaign(spindle) -> None:
    conditions = [Condition(20.0, SPEED)]
    ran, linear = (runout_campaign(spindle, conditions, 0.04, seed=5, noise=1e-15, path=p).tests[0].runout for p in ("simulated", "linear"))
    assert ran.value == pytest.approx(linear.value, abs=5e-3 * np.abs(linear.value).max())
