"""Hits of raw hammer records: found, judged, averaged to FRFs that are the exact answer of the
model that made them, and left out where a channel stood at its limit."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest

from tests.sim.importing.recorded import LENGTH, MAPPING, RATE, exact, hit
from thermospindle.report.verbs.importing import bring
from thermospindle.sim.campaign.campaign import read_campaign
from thermospindle.sim.hammer.pulse import PRE_TRIGGER
from thermospindle.sim.importing.mapping import RecordForm
from thermospindle.sim.importing.measured import End, Motion
from thermospindle.sim.importing.records.hits import Hit, _still, fault, limits_of
from thermospindle.sim.importing.records.spectra import frfs_of


@pytest.mark.parametrize("estimator", ["H1", "H2", "Hv"])
def test_hits_are_found_judged_and_averaged(hammered, tmp_path, estimator):
    (tmp_path / "m.toml").write_text(MAPPING + f'[records]\nestimator = "{estimator}"\nband_Hz = [50.0, 1000.0]\n')
    answer = bring([hammered / "hammer1.csv", hammered / "hammer2.csv"], mapping=tmp_path / "m.toml", out=tmp_path / "c")
    notes = "\n".join(answer.values["notes"])
    assert "hammer1.csv: hit 2: left out, double hit: 40% of the first pulse, 10 ms after it" in notes
    assert "hammer1.csv: hit 3: left out, overload" in notes
    assert "4 of 6 hits" in notes
    assert "6 of 6 hits" in notes
    test = read_campaign(tmp_path / "c").tests[0]
    frf = test.frf
    model = exact(frf.frequency, test.window_decay)
    assert np.abs(frf.value - model).max() < 3e-3 * np.abs(model).max()
    assert np.median(frf.coherence) > 0.98
    assert test.window_decay > 1
    assert test.pretrigger == pytest.approx(PRE_TRIGGER + 3e-4 + 0.5 / RATE, abs=1.5 / RATE)  # to the middle of a hit of 0.6 ms
    if estimator == "H1":  # what standard errors say comes true, within the bias of a force cut to its window
        ratio = np.abs(frf.value - model) / frf.sd
        assert 0.4 < np.sqrt(np.mean(ratio**2)) < 3


def test_hits_that_are_not_of_one_length_are_asked_about_where_the_form_can_be_answered(hammered, tmp_path):
    """The answer was said to be open in a form that had no line for it; what is proposed is long
    enough for no hit to be lost, and as long as all of them are."""
    head, *rows = (hammered / "hammer2.csv").read_text().splitlines()
    n, short = round(RATE * LENGTH), 6500
    kept = [row for k in range(6) for row in rows[k * n : k * n + short]]
    (tmp_path / "T20_n0_hammer1.csv").write_text((hammered / "hammer1.csv").read_text())
    (tmp_path / "T20_n0_hammer2.csv").write_text("\n".join([head, *(f"{k / RATE:.9g},{row.partition(',')[2]}" for k, row in enumerate(kept))]) + "\n")
    files, form = [tmp_path / f"T20_n0_hammer{q}.csv" for q in (1, 2)], tmp_path / "form.toml"
    bring(files, mapping=form)
    line = next(row for row in form.read_text().splitlines() if row.startswith('hit_length_s = "?"'))
    longest = re.search(r"one length for all hits, so that one window, and the same lines, fit all its FRFs; at most ([\d.]+), which all of them have", line)[1]
    assert 0.9 * short / RATE < float(longest) <= short / RATE  # what follows the last hit is shorter than a gap
    (tmp_path / "m.toml").write_text(MAPPING.replace("hammer*", "*") + form.read_text()[form.read_text().index("[records]") :].replace('"?"', longest))
    notes = "\n".join(bring(files, mapping=tmp_path / "m.toml", out=tmp_path / "c").values["notes"])
    assert "4 of 6 hits" in notes
    assert "6 of 6 hits" in notes


def test_estimators_of_noisy_records():
    """H1, H2 and Hv as Bendat & Piersol and Rocklin define them, of a response with so much noise that they
    differ by the coherence and its root. The force ends with its pulse, so that its window cuts nothing off."""
    random, n, hits, start = np.random.default_rng(2), 4096, 12, 200
    force = np.zeros((hits, n))
    force[:, start : start + 3] = random.uniform(50, 90, (hits, 1)) * [0.6, 1.0, 0.6]
    ringing = np.exp(-40 * np.arange(n) / RATE) * np.sin(2 * np.pi * 500 * np.arange(n) / RATE)
    response = np.array([np.convolve(f, ringing)[:n] for f in force]) + 12.0 * random.standard_normal((hits, n))
    cut = slice(start - round(PRE_TRIGGER * RATE), None)
    f, v = (np.fft.rfft(x[:, cut], axis=-1) for x in (force, response))
    sff, svv, svf = ((a * b.conj()).mean(axis=0) for a, b in ((f, f), (v, v), (v, f)))
    h1, h2 = svf / sff, svv / svf.conj()
    expected = {"H1": h1, "H2": h2, "Hv": np.sqrt(np.abs(h1) * np.abs(h2)) * np.exp(1j * np.angle(h1))}
    motions = [Motion(Path("a.npz"), "force", End(1), True, 1 / RATE, force, "N"), Motion(Path("a.npz"), "v", End(2), False, 1 / RATE, response, "m/s")]
    for estimator, value in expected.items():
        [curve] = frfs_of([(Path("a.npz"), motions)], End(1), RecordForm(estimator=estimator, band_Hz=[300.0, 700.0], exponential_end=1.0)).curves
        lines = np.rint(curve.frequency * (n - cut.start) / RATE).astype(int)
        assert len(lines) > 150
        assert curve.value == pytest.approx(value[lines], rel=1e-9)
        assert curve.coherence == pytest.approx((np.abs(svf) ** 2 / (sff * svv)).real[lines], rel=1e-9)
    assert np.median(curve.coherence) < 0.8


def test_drift_and_offset_are_taken_out_of_a_response():
    """An acceleration that is a straight line is drift alone; of a velocity what stood before the blow is taken out, and the
    change stays."""
    lead, before, n = 16, 80, 900
    ramp = 3.0 + 0.5 * np.arange(before - lead + n)
    asked = ramp[None, before - lead :], ramp[None, :before], lead
    still, share = _still(*asked, np.array([True]))
    assert np.abs(still).max() < 1e-9
    assert share[0] > 1
    still, _ = _still(*asked, np.array([False]))
    assert still[0] == pytest.approx(ramp[before - lead :] - ramp[:before].mean(), rel=1e-12)


def test_a_hit_a_row_and_no_hit(tmp_path):
    random = np.random.default_rng(5)
    force, answer = zip(*(hit(random) for _ in range(4)), strict=True)
    np.savez(tmp_path / "hammer1.npz", fs=RATE, force=np.array(force), velocity1=np.array(answer)[:, 0, 0], velocity2=np.array(answer)[:, 1, 0])
    told = MAPPING.replace('test = "T20"', 'test = "T20"\nreference = 1\ncolumns = { force = "force [N]", velocity1 = "velocity 1 [m/s]", velocity2 = "velocity 2 [m/s]" }', 1)
    (tmp_path / "m.toml").write_text(told + "[records]\nband_Hz = [50.0, 1000.0]\n")
    answer = bring([tmp_path / "hammer1.npz"], mapping=tmp_path / "m.toml", out=tmp_path / "c")
    assert "4 of 4 hits" in "\n".join(answer.values["notes"])
    test = read_campaign(tmp_path / "c").tests[0]
    model = exact(test.frf.frequency, test.window_decay)[:, :1]
    assert np.abs(test.frf.value - model).max() < 1e-3 * np.abs(model).max()


@pytest.mark.parametrize("clipped", [1.0, 0.85])
def test_a_hit_whose_force_was_clipped_is_told_by_the_others(tmp_path, clipped):
    """A pulse of a few samples stands at its limit once or twice, which no extreme tells: one hit
    of five was, and all FRFs were 4 % too large without a word."""
    random = np.random.default_rng(7)
    force, answer = zip(*(hit(random) for _ in range(5)), strict=True)
    force = np.array(force)
    force[1] = np.minimum(force[1], clipped * force[1].max())
    force += 0.02 * random.standard_normal(force.shape)
    np.savez(tmp_path / "hammer1.npz", fs=RATE, force=force, velocity1=np.array(answer)[:, 0, 0], velocity2=np.array(answer)[:, 1, 0])
    told = MAPPING.replace('test = "T20"', 'test = "T20"\nreference = 1\ncolumns = { force = "force [N]", velocity1 = "velocity 1 [m/s]", velocity2 = "velocity 2 [m/s]" }', 1)
    (tmp_path / "m.toml").write_text(told + "[records]\nband_Hz = [50.0, 1000.0]\n")
    notes = [n for n in bring([tmp_path / "hammer1.npz"], mapping=tmp_path / "m.toml", out=tmp_path / "c").values["notes"] if "off those of the other" in n]
    if clipped == 1.0:
        assert not notes
    else:
        (note,) = notes
        assert re.match(r"hammer1.npz: hit 2: its FRFs are \+\d+ % off those of the other 4 hits on all channels at all lines, as those of a force that was clipped are", note)


def recorded(sizes, limit=np.inf, quantum=0.0):
    """Hits of one record whose response rings from these sizes on, cut off at the limit of its channel and in steps of `quantum`."""
    random, t = np.random.default_rng(8), np.arange(4000) / RATE
    force = np.where(t < 1e-3, np.sin(np.pi * t / 1e-3), 0.0) + 1e-3 * random.standard_normal(len(t))
    hits = []
    for k, size in enumerate(sizes, 1):
        ringing = np.exp(-20 * t) * np.cos(2 * np.pi * 800 * t) * (1 + 1e-4 * random.standard_normal(len(t)))
        value = np.clip(size * ringing / np.abs(ringing).max(), -limit, limit)
        value = quantum * np.round(value / quantum) if quantum else value
        hits.append(Hit(f"a.csv: hit {k}", force, 1.0, value[None], value[None]))
    return hits


@pytest.mark.parametrize(
    ("sizes", "limit", "quantum", "left_out"),
    [
        ((1.001, 1.0005, 2.0, 0.8), 1.0, 0.0, [1, 2, 3]),  # the limit is where the third stands
        ((1.001, 1.0005, 0.8), 1.0, 0.0, []),  # it stands nowhere: two largest values that are the same
        ((1.001, 1.0005, 1.002), np.inf, 0.01, []),  # alike in coarse steps alone
    ],
)
def test_a_limit_that_one_hit_tells_holds_for_all_of_its_record(sizes, limit, quantum, left_out):
    """Those that reached it once were kept beside one that was cut off, and FRFs were 7 % wrong."""
    hits = recorded(sizes, limit, quantum)
    limits = limits_of(hits)
    said = {k: why for k, h in enumerate(hits, 1) if (why := fault(h, [End(1)], 1 / RATE, RecordForm(), limits))}
    assert [*said] == left_out
    if left_out:
        assert re.fullmatch(r"overload: response 1 reaches -?1, the limit at which hit 3 stands \d+ times", said[1])


def test_what_another_hit_exceeds_is_no_limit_of_the_record():
    hits = [*recorded((1.001, 2.0), 1.0), *recorded((1.5,))]
    assert limits_of(hits) == [None, None]
    assert [fault(h, [End(1)], 1 / RATE, RecordForm(), limits_of(hits)) is None for h in hits] == [True, False, True]
