"""What is said of a comparison: its verdict, what errors have in common, what is furthest off, and its terminal table."""

from __future__ import annotations

import warnings
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from rich.console import Console

from thermospindle.diagnosis.compare.compare import compare
from thermospindle.diagnosis.compare.constant import constant_errors
from thermospindle.diagnosis.compare.correlation import Correlation
from thermospindle.report.page.compare import sections
from thermospindle.report.text.compare import comparison_json, constant_words, show_comparison, verdict
from thermospindle.report.verbs.compare import _beyond, _by_law_of_damping, _louder
from thermospindle.sim.campaign.campaign import Campaign, Test
from thermospindle.sim.campaign.modes import ModeRow
from thermospindle.sim.identification.frf import Frf


def test_the_whole_is_one_percent_low(compared):
    for test in compared.tests:
        assert [100 * m.error / m.measured for m in test.modes] == pytest.approx([1.0] * len(test.modes), abs=0.15)
        assert len(test.modes) >= 7
        assert test.correlation.whole.shift == pytest.approx(0.01, abs=5e-4)
        assert test.missing == test.extra == ()


def test_what_is_the_same_at_all_conditions_is_said_with_its_figures(compared, compared_folder, capsys):
    """A scene that add had made of a diagnosis was 25 standard errors off where diagnose had told
    1.9: constant errors of modes are free there, and nothing said so."""
    constant = constant_errors(compared.tests)
    assert list(constant.frequency.values()) == pytest.approx([0.01] * len(constant.frequency), abs=1e-3)
    assert constant.share > 0.99
    assert constant.without < 0.1 * compared.rms_residual
    said = constant_words(compared)
    assert f"{constant.without:.3g} standard errors would be left: build tolerances and constant errors of modes do that" in said
    assert "build tolerances are fitted in this scene; diagnose leaves free, too, what no scene holds: constant errors of modes" in constant_words(replace(compared, built=True))
    show_comparison(Console(width=2000), compared)
    assert said in capsys.readouterr().out
    assert "of the squared errors are the same at all conditions" in (compared_folder / "report.html").read_text()
    assert comparison_json(compared)["constant_errors"]["rms_pull"] == constant.without
    cold, hot = compared.tests
    moving = replace(compared, tests=(cold, replace(hot, residuals=-hot.residuals)))
    assert constant_errors(moving.tests).share < 0.5
    assert constant_words(moving) == ""
    drifting = replace(compared, tests=(cold, replace(hot, residuals=0.5 * hot.residuals)))
    assert constant_errors(drifting.tests).share > 0.5
    assert constant_words(drifting) == ""  # half of it gone when hot: an effect may do that
    assert constant_errors([cold]) is None


def test_where_no_mode_was_found_frfs_alone_are_told(quiet, capsys):
    """It did not agree, by infinitely many standard errors, above a table of no rows."""
    assert [t.modes for t in quiet.tests] == [(), ()]
    whole = [t.correlation.whole for t in quiet.tests]
    said = (
        f"hdd_2003: no mode was found in the measured FRFs between {whole[0].low:.0f} and {whole[0].high:.0f} Hz, so there is none to compare; "
        f"FRFs are alike by {np.mean([w.csac for w in whole]):.3f} in shape (CSAC) and {np.mean([w.csf for w in whole]):.3f} with their size (CSF)"
    )
    show_comparison(Console(width=2000), quiet)
    told = capsys.readouterr().out
    assert said in told
    assert "computed - measured" not in told
    assert comparison_json(quiet)["rms_pull"] is None
    page = "".join(str(section) for section in sections(quiet))
    assert said.removeprefix("hdd_2003: ") in page
    assert "standard errors" not in page
    nothing = replace(quiet, tests=tuple(replace(t, correlation=None) for t in quiet.tests))
    assert verdict(nothing) == "hdd_2003: no mode was measured, so there is none to compare."


def test_errors_that_hang_together_are_told(compared):
    """Where every mode by itself is within what its test's temperature may do, and all of them at
    once are not, no mode is called the worst."""
    largest = max(abs(m.residual) for t in compared.tests for m in t.modes)
    together = replace(compared, tests=tuple(replace(t, missing=(), residuals=np.full_like(t.residuals, 100 * largest)) for t in compared.tests))
    words = f"no mode alone is off by more than {largest:.1f}, but their errors hang together"
    assert words in verdict(together)
    assert "furthest off" not in verdict(together)
    assert words not in verdict(compared)
    assert any("but their errors hang together" in str(section) for section in sections(together))


def test_furthest_off_says_in_what(compared):
    """The largest error in standard errors need not be that in Hz, and a mode of another shape is neither."""
    modes = list(compared.tests[0].modes)
    modes[0], modes[1], modes[2] = replace(modes[0], sd=1e-4), replace(modes[1], computed=1.05 * modes[1].measured), replace(modes[2], sd=1e-5, mac=0.0)
    told = verdict(replace(compared, tests=(replace(compared.tests[0], modes=tuple(modes)),)))
    assert f"furthest off in standard errors is the {modes[0].kind} mode at {modes[0].measured:.0f} Hz of T20" in told
    assert f"({abs(modes[0].residual):.3g} standard errors); in Hz it is the {modes[1].kind} mode at {modes[1].measured:.0f} Hz of T20" in told
    agreeing = [replace(t, missing=(), residuals=0 * t.residuals) for t in compared.tests]
    exact = [replace(t, modes=tuple(replace(m, computed=m.measured) for m in t.modes)) for t in agreeing]
    assert verdict(replace(compared, tests=tuple(exact))).endswith("0 standard errors.")
    agreeing[0] = replace(agreeing[0], modes=tuple(replace(m, mac=0.03 if k == 2 else m.mac) for k, m in enumerate(agreeing[0].modes)))
    said = verdict(replace(compared, tests=tuple(agreeing)))
    assert f"; but the shape measured at {modes[2].measured:.0f} Hz of T20 has nothing of the computed one (MAC below 0.1)." in said
    lost = verdict(replace(compared, tests=(replace(compared.tests[0], missing=(3000.0,)),)))
    assert "no computed mode is within 8% of the measured one at 3000 Hz of T20, which counts as that much; of the others furthest off in standard errors is" in lost
    strange = tuple(replace(m, mac=0.0) for m in modes)
    assert "no computed mode near a measured one has its shape" in verdict(replace(compared, tests=(replace(compared.tests[0], modes=strange),)))


def test_a_mode_that_is_off_alone_where_all_agree_together_is_told(compared):
    """What errors of a test have in common makes up for much: a mode that stands 2 to 3 standard
    errors off in every test was said to agree."""
    moved = [
        replace(t, missing=(), residuals=0 * t.residuals, modes=tuple(replace(m, computed=m.measured + (2.5 * m.sd if m.number == 3 else 0.0)) for m in t.modes))
        for t in compared.tests
    ]
    (third,) = {m.kind for m in moved[0].modes if m.number == 3}
    said = verdict(replace(compared, tests=tuple(moved)))
    mean = np.mean([m.error for t in moved for m in t.modes if m.number == 3])
    assert "agrees with the tests within their errors: rms residual 0 standard errors, taken together, for what errors of one test have in common" in said
    assert f"taken alone, frequencies of mode 3 ({third}) are off by 2.5 rms, in the mean by {mean:+.3g} Hz." in said


def test_a_damping_that_is_far_off_is_named(compared):
    """No frequency is off by much and the dampings are: it was told as errors of the temperature that hang together."""
    largest = max(abs(m.residual) for t in compared.tests for m in t.modes)
    far = [replace(t, missing=(), residuals=np.full_like(t.residuals, 100 * largest), modes=tuple(replace(m, damping_sd=1e-9) for m in t.modes)) for t in compared.tests]
    said = verdict(replace(compared, tests=tuple(far)))
    assert f"no frequency alone is off by more than {largest:.1f}, but dampings are, most that of " in said
    assert "hang together" not in said


def test_kelvin_for_celsius_is_told_and_warns_of_no_overflow(spindle, low):
    """At 293 C both bearings lose contact: the hub moves freely, and its FRFs are not compared."""
    kelvin = replace(low, tests=(replace(low.tests[0], temperature=293.0),))
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        other = compare(spindle, kelvin)
    assert other.tests[0].correlation is None
    (told,) = _beyond(other)
    assert "at 293 C and 0 rpm the lower and upper bearing lost contact" in told


@pytest.mark.parametrize(("frequencies", "said"), [((1.0025, 1.545), "none of the 2 measured modes has a computed partner"), ((1.545,), "the one measured mode has no computed partner")])
def test_no_scene_agrees_with_modes_of_which_none_is_paired(spindle, frequencies, said):
    """In kHz, to 0.3 Hz: each counted as 8 % of its frequency, a quarter of its standard error, and the scene was said to agree."""
    rows = tuple(ModeRow("t", k, "axial", f, 0.3) for k, f in enumerate(frequencies, 1))
    compared = compare(spindle, Campaign("table", spindle.name, "mobility", spindle.points, (Test("t", 20.0, 0.0, modes=rows),)))
    assert compared.tests[0].modes == ()
    told = verdict(compared)
    assert "does not agree with the tests" in told
    assert f"{said} within 8% of its frequency: are frequencies in another unit" in told


def test_people_read_likeness_by_test(compared):
    console = Console(width=120, record=True, file=open("/dev/null", "w"))  # noqa: SIM115
    show_comparison(console, compared)
    text = console.export_text()
    assert "CSAC" in text
    assert "+1.00" in text


def test_errors_are_told_in_percent_of_what_was_measured(compared):
    """In the table, of the frequencies beside them, and in JSON."""
    console = Console(width=200, record=True, file=open("/dev/null", "w"))  # noqa: SIM115
    show_comparison(console, compared)
    rows = [line.split() for line in console.export_text().splitlines()]
    first = compared.tests[0].modes[0]
    row = next(row for row in rows if row[:3] == [compared.tests[0].test.id, str(first.number), first.kind])
    measured, computed, hertz, percent = (float(row[k]) for k in (3, 5, 6, 7))
    assert hertz == pytest.approx(computed - measured, abs=0.0151)
    assert percent == pytest.approx(100 * (computed - measured) / measured, abs=0.0061)
    for test in comparison_json(compared)["tests"]:
        for mode in test["modes"]:
            assert mode["error_percent"] == pytest.approx(100 * (mode["computed_Hz"] - mode["measured_Hz"]) / mode["measured_Hz"], rel=1e-9)


def test_many_tests_are_a_row_a_mode(compared):
    """Three times the same tests: the mean error of a mode is that of one, its worst that of its worst test; --verbose shows every one."""
    many = replace(compared, tests=compared.tests * 3)
    console = Console(width=120, record=True, file=open("/dev/null", "w"))  # noqa: SIM115
    show_comparison(console, many, verbose=False)
    text = console.export_text()
    every = [(m, t.test.id) for t in compared.tests for m in t.modes if m.number == 1]
    worst, test = max(every, key=lambda row: abs(row[0].residual))
    (row,) = [line.split() for line in text.splitlines() if line.split()[:2] == ["1", worst.kind]]
    assert row[2] == str(3 * len(every))
    assert float(row[4]) == pytest.approx(np.mean([m.error for m, _ in every]), abs=0.006)
    assert (row[6], row[7]) == (f"{worst.error:+.2f}", test)
    show_comparison(console, many)
    assert console.export_text().count(f"{worst.measured:.2f}") == 3


def test_hysteretic_damping_is_said_where_modes_are_damped_much():
    """A mode at 4800 Hz with 12.5 % of critical, of which a complex stiffness has the pole 1.6 %
    higher: it was called a constant error of the drawing."""

    def said(measured, damping, sd=5.0):
        mode = SimpleNamespace(number=9, measured=measured, computed=4727.0, sd=sd, damping_computed=damping, error=4727.0 - measured)
        return _by_law_of_damping(SimpleNamespace(tests=[SimpleNamespace(modes=(mode,))]))

    exact = 4727.0 * abs(np.sqrt(1 + 0.25j))
    [told] = said(exact, 0.125)
    assert told.startswith("mode 9: is damped by up to 12 % of critical, and measured higher than computed: poles of hysteretic damping (a complex stiffness, as of rubber) lie up to 1.6 % above")
    assert said(4727.0, 0.125) == said(4600.0, 0.125) == said(exact, 0.02) == said(exact, 0.125, sd=50.0) == said(5200.0, 0.125) == []


@pytest.mark.parametrize(("factor", "told"), [(10.0, "20 dB larger than computed ones"), (0.5**4, "24 dB smaller than computed ones"), (1.2, "")])
def test_a_factor_of_all_frfs_is_told_with_its_dB(factor, told):
    """20 dB are ten times an amplitude; 24 dB a sixteenth."""
    computed = np.ones((3, 2, 4), complex)
    frf = Frf(np.arange(1.0, 5.0), factor * computed, (1, 2, 3), (1, 2), "mobility")
    correlation = Correlation(SimpleNamespace(measured=frf), computed, np.ones(4), np.ones(4), None, ())
    said = _louder(SimpleNamespace(tests=[SimpleNamespace(correlation=correlation), SimpleNamespace(correlation=None)]))
    assert [s.partition(", all alike")[0] for s in said] == ([f"measured FRFs are {told}"] if told else [])
    assert not told or said[0].endswith(f"off by a factor of about {max(factor, 1 / factor):.0f}")
