"""Modes come out of noisy FRFs by themselves, all and no others, with standard errors that come true, and are followed across conditions.

The reference is the matrix model of `matrices`: nothing of `model` or `sim` but the code under test.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import pyuff
import scipy.stats as st

from tests.conftest import ROOT, SCENE
from tests.sim.identification.matrices import (
    WIDE,
    distance,
    eigen,
    mobility,
    noisy,
    reference,
    sensors,
    spindle,
)
from thermospindle.model.built.tolerance import toleranced
from thermospindle.model.machine import Condition
from thermospindle.model.scene.reading import load
from thermospindle.model.units import RPM
from thermospindle.sim.identification.modal import extract, noise_model, scatter
from thermospindle.sim.identification.pairing import mac
from thermospindle.sim.identification.poles import Lines, project
from thermospindle.sim.identification.rank_one import merge
from thermospindle.sim.operating import operating_point
from thermospindle.thermal.expansion import expand

DATA = Path(__file__).parents[2] / "data"


# ---- the reference scene


def test_matrix_model_is_the_data_sheets():
    """Table 2, analysed column at 20 C."""
    frequency, *_ = eigen(*spindle(), sensors())
    assert frequency[:5] == pytest.approx([1002, 1545, 1795, 1821, 2010], abs=0.5)


CASES = [(r, s, e) for r in (0, 7200) for s, e in ((1, 0.005), (3, 0.005), (1, 0.02), (3, 0.02))]
FIRST = [(0, 3, 0.02), (7200, 3, 0.005)]


@pytest.mark.parametrize(("rpm", "step", "relative"), [pytest.param(*c, marks=[pytest.mark.slow] * (c not in FIRST)) for c in CASES])
def test_reference_scene(rpm, step, relative):
    """All eight modes of the band and no other, the five of Table 2 within 0.5 Hz and 5 %, and all within their covariance (p = 1e-5)."""
    frequency, damping, shape = (x[:8] for x in eigen(*spindle(rpm * RPM), sensors()))
    lines = WIDE[::step]
    modes = extract(lines, *noisy(reference(lines, rpm * RPM), 1, relative))
    assert len(modes.frequency) == 8
    assert modes.rank_one
    assert np.abs(modes.frequency - frequency)[:5].max() < 0.5
    assert np.abs(modes.damping / damping - 1)[:5].max() < 0.05
    assert distance(modes, frequency, damping) < st.chi2.ppf(1 - 1e-5, 16)
    assert modes.chi2 == pytest.approx(1, abs=5 * np.sqrt(2 / (28 * len(lines))) + 2 * relative)  # weights come from noisy values
    single = [0, 1, 2, 3, 4, 7]
    assert np.diag(mac(modes.shape, shape))[single].min() > 0.99
    pair_found, pair_known = (np.linalg.qr(x[5:7].T)[0] for x in (modes.shape, shape))  # noise turns a close pair within its space
    assert np.linalg.svd(pair_found.conj().T @ pair_known)[1].min() > 0.99


@pytest.mark.parametrize(("seeds", "within"), [(4, 0.35), pytest.param(12, 0.2, marks=pytest.mark.slow)])
def test_standard_errors_come_true(seeds, within):
    """Realisations in a narrower band (seven modes, one pair of them 2.4 Hz apart at 5 % damping): the squared errors in units of the
    stated covariance are chi-square of 14 degrees of freedom each, so that with twelve errors stated 20 % wrong either way are caught."""
    lines = np.arange(1150.0, 6001.0, 5.0)
    exact = reference(lines)
    frequency, damping, shape = (x[1:8] for x in eigen(*spindle(), sensors()))
    total, shapes = 0.0, []
    for seed in range(seeds):
        modes = extract(lines, *noisy(exact, seed))
        assert len(modes.frequency) == 7
        total += distance(modes, frequency, damping)
        largest = (np.arange(7), np.abs(modes.shape).argmax(1))
        error = np.abs(modes.shape - shape / shape[largest][:, None])
        shapes.append((error / np.where(modes.shape_sd > 0, modes.shape_sd, np.inf)) ** 2)
    low, high = st.chi2.ppf([0.001, 0.999], 14 * seeds)
    assert low < total < high
    assert np.mean(shapes) * 7 / 6 == pytest.approx(1, abs=within)  # one of seven components is 1 by definition; some 90 numbers each


@pytest.mark.parametrize("seeds", [range(2), pytest.param(range(2, 12), marks=pytest.mark.slow)], ids=["two", "ten"])
def test_a_pair_near_the_end_of_a_narrow_band(seeds):
    """1650 to 5000 Hz: modes at 1002, 1545 and 5551 Hz lie outside, and the pair 2.4 Hz apart, as wide as
    5 % of its frequency, near the upper end. It is never told as one mode (in 5 of 12 realisations it was,
    before `split` left poles with free residues unrefined), and the errors cover what modes outside do."""
    lines = np.arange(1650.0, 5001.0, 5.0)
    exact = reference(lines)
    frequency, damping, _ = (x[2:7] for x in eigen(*spindle(), sensors()))
    total = 0.0
    for seed in seeds:
        modes = extract(lines, *noisy(exact, seed))
        assert len(modes.frequency) == 5
        total += distance(modes, frequency, damping)
    low, high = st.chi2.ppf([0.001, 0.999], 10 * len(seeds))
    assert low < total < high


@pytest.mark.parametrize(("hammer", "excited"), [(0, [0, 1, 3, 4, 6]), (1, [0, 1, 2, 4, 5, 7])])
def test_one_hammer_gives_what_it_excites(hammer, excited):
    """By symmetry a hammer on the x axis leaves tilts about x alone, and the reverse: those modes cannot be found and must not be."""
    frequency, damping, _ = (x[excited] for x in eigen(*spindle(), sensors()))
    exact = mobility(WIDE, spindle(), sensors(), sensors()[[hammer]])
    modes = extract(WIDE, *noisy(exact, 2))
    assert len(modes.frequency) == len(excited)
    assert distance(modes, frequency, damping) < st.chi2.ppf(1 - 1e-5, 2 * len(excited))


@pytest.mark.parametrize(
    ("band", "inside"),
    [((400, 1990), 4), ((400, 2020), 5), ((1010, 2000), 3), ((1700, 1900), 2), ((4000, 5000), 2), ((2100, 2300), 0), ((600, 800), 0)],
)
def test_modes_outside_the_band_are_not_reported(band, inside):
    """Even if a mode lies only 8 Hz (a quarter of its width) beyond the edge; it must not spoil the others either."""
    frequency, damping, _ = eigen(*spindle(), sensors())
    known = (frequency > band[0]) & (frequency < band[1])
    modes = extract(WIDE, *noisy(reference(WIDE), 3), band=band)
    assert len(modes.frequency) == inside == known.sum()
    if inside:
        assert distance(modes, frequency[known], damping[known]) < st.chi2.ppf(1 - 1e-5, 2 * inside)


def test_noise_alone_has_no_modes():
    frf, _ = noisy(np.ones((7, 2, len(WIDE))), 4, 1.0, 0.0)
    assert len(extract(WIDE, frf - 1, np.ones(frf.shape)).frequency) == 0


@pytest.mark.slow
def test_noise_that_is_not_known_is_taken_from_the_lines():
    frequency, damping, _ = (x[:8] for x in eigen(*spindle(), sensors()))
    modes = extract(WIDE, noisy(reference(WIDE), 5)[0])
    assert len(modes.frequency) == 8
    assert "estimated" in modes.status
    assert distance(modes, frequency, damping) < st.chi2.ppf(1 - 1e-5, 16)


# ---- closed forms


@pytest.mark.parametrize("damping", [0.01, 1e-4])
def test_of_very_many_lines_those_that_tell_do(monkeypatch, damping):
    """4000 lines where 1000 are many: all of those at a peak, however narrow, and one in four
    elsewhere; to the errors that all would give, nearly."""
    lines, at = np.arange(100.0, 900.0, 0.2), np.array([310.03, 540.0])
    s = 2j * np.pi * lines
    value = sum(s / (s**2 + 2 * damping * (w := 2 * np.pi * f) * s + w**2) for f in at)[None, None]
    sd = 1e-5 * np.abs(value).max() + 1e-3 * np.abs(value)
    noise = np.random.default_rng(1).standard_normal((2, *value.shape))
    whole = extract(lines, value + sd / np.sqrt(2) * (noise[0] + 1j * noise[1]), sd)
    monkeypatch.setattr("thermospindle.sim.identification.modal.MOST_LINES", 1000)
    few = extract(lines, value + sd / np.sqrt(2) * (noise[0] + 1j * noise[1]), sd)
    for modes in (whole, few):
        assert modes.frequency == pytest.approx(at, abs=4 * float(modes.frequency_sd.max()))
    assert np.all(few.frequency_sd < 2.1 * whole.frequency_sd)
    assert 1000 <= few.lines[2] < 2000
    assert f"{few.lines[2]} of 4000 lines" in few.status
    assert "4000" not in whole.status


@pytest.mark.parametrize("decay", [0.0, 15.0])
@pytest.mark.parametrize(("kind", "power"), [("receptance", 0), ("mobility", 1), ("accelerance", 2)])
def test_one_mass_on_a_spring(kind, power, decay):
    """f = sqrt(k/m) / 2 pi, zeta = c / (2 sqrt(k m)), R = 1 / (2 i m w_d), also under an exponential window: exp(-decay t) x(t) has the
    Laplace transform X(s + decay)."""
    m, c, k = 0.3, 12.0, 0.3 * (2 * np.pi * 500) ** 2
    f = np.arange(300.0, 800.0)
    s = decay + 2j * np.pi * f
    frf = (s**power / (m * s**2 + c * s + k))[None, None]
    modes = extract(f, frf, noise_model(frf, 1e-3, 1e-4), kind=kind, window_decay=decay)
    zeta = c / (2 * np.sqrt(k * m))
    assert modes.frequency == pytest.approx([500], rel=1e-6)
    assert modes.damping == pytest.approx([zeta], rel=1e-4)
    assert modes.residues[0, 0, 0] == pytest.approx(1 / (2j * m * np.sqrt(k / m * (1 - zeta**2))), rel=1e-4)


def tilting(speed, f, stiffness=(1200.0, 1200.0), c=4e-3):
    """Rigid rotor, It 1e-5, Ip 1.6e-5 kg m2, on tilt springs: three sensors, two exciters."""
    rows = np.array([[1.0, 0.0], [0.0, 1.0], [0.6, 0.8]])
    matrices = (1e-5 * np.eye(2), c * np.eye(2) + 1.6e-5 * speed * np.array([[0, 1], [-1, 0]]), np.diag(stiffness))
    return matrices, rows, mobility(f, matrices, rows, rows[:2])


def test_gyroscopic_pair():
    """1842.096 / 1650.096 Hz at 7200 rpm (verification.md, undamped), whirling in circles against and with the rotation."""
    _, _, frf = tilting(7200 * RPM, WIDE, c=4e-4)
    modes = extract(WIDE, *noisy(frf, 6))
    assert modes.frequency == pytest.approx([1650.096, 1842.096], abs=0.02)
    assert np.abs(modes.shape[:, 1] / modes.shape[:, 0]) == pytest.approx([1, 1], abs=0.01)
    assert (modes.shape[:, 1] / modes.shape[:, 0]).imag[0] * (modes.shape[:, 1] / modes.shape[:, 0]).imag[1] == pytest.approx(-1, abs=0.02)


@pytest.mark.parametrize("apart", [0.0, 0.002])
def test_two_modes_at_one_place(apart):
    """A pole with residues of rank two is two modes: exactly coincident, or 1.7 Hz apart with half-widths of 32 Hz."""
    matrices, rows, frf = tilting(0.0, WIDE, (1200.0, 1200.0 * (1 + apart)))
    modes = extract(WIDE, *noisy(frf, 7))
    frequency, damping, _ = eigen(*matrices, rows)
    assert len(modes.frequency) == 2
    assert np.abs(modes.frequency - frequency).max() < 5 * modes.frequency_sd.max() < 0.5
    assert np.abs(modes.damping / damping - 1).max() < 0.01


def test_mode_that_moves_between_hammers_is_one_mode():
    """A 0.5 Hz drift while the hammer changes place must not make two modes, and the error must own up to it."""
    f = np.arange(300.0, 800.0)
    s = 2j * np.pi * f
    one = np.array([1.0, -0.4, 0.7])
    h = [s / (s**2 + 0.01 * w * s + w**2) for w in (2 * np.pi * 500.0, 2 * np.pi * 500.5)]
    modes = extract(f, *noisy(np.stack([np.outer(one, h[0]), np.outer(0.8 * one, h[1])], 1), 8))
    assert len(modes.frequency) == 1
    assert 500 < modes.frequency[0] < 500.5
    assert modes.frequency_sd[0] > 0.2
    assert modes.damping_sd[0] > 0.2 / 500  # of whirl at 1555 and 1562 Hz, told as one mode, it was off by 37 of its errors
    assert "two places" in modes.status


def test_a_second_pole_that_the_data_do_not_ask_for_is_no_drift():
    """The search may leave two poles on one mode. One alone fits as well: then nothing moved, and the error is that of one mode."""
    f = np.arange(300.0, 800.0)
    s = 2j * np.pi * f
    one = np.array([1.0, -0.4, 0.7])
    w = 2 * np.pi * 500.0
    frf, sd = noisy(np.stack([np.outer(one, s / (s**2 + 0.01 * w * s + w**2))] * 2, 1), 9)
    lines = Lines(s / w, frf, np.sqrt(2) / sd, 1)
    pole = -0.005 + 1j * np.sqrt(1 - 0.005**2)
    kept, spread = merge(lines, project(lines, pole + np.array([-4e-4j, 4e-4j])))
    assert len(kept.poles) == 1
    assert kept.poles[0] == pytest.approx(pole, abs=2e-5)
    assert spread == []


def test_noise_model_and_scatter():
    frf = np.array([[[3 + 4j, 0.1], [1, 2]]])
    assert noise_model(frf, 0.01, 0.002)[0, 0] == pytest.approx([np.hypot(0.05, 0.01), np.hypot(0.001, 0.01)])
    e = np.random.default_rng(0).standard_normal((2, 3, 1, 20001))
    assert scatter(2 * (e[0] + 1j * e[1]), 401).mean((1, 2)) == pytest.approx([2 * np.sqrt(2)] * 3, rel=0.03)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"kind": "stiffness"}, "kind 'stiffness'"),
        ({"frequency": np.arange(5.0)}, "responses, references, lines"),
        ({"band": (10.0, 15.0)}, "at least 12"),
        ({"frf_sd": np.zeros((1, 1, 100))}, "positive"),
        ({"frf": np.full((1, 1, 100), np.nan)}, "finite"),
    ],
)
def test_unusable_input_is_refused(change, message):
    given = {"frequency": np.arange(100.0), "frf": np.ones((1, 1, 100)), "frf_sd": np.ones((1, 1, 100))} | change
    with pytest.raises(ValueError, match=message):
        extract(**given)


# ---- measurements of others


@pytest.mark.parametrize(("campaign", "test"), [("foreign_bond", "T60_n7200"), ("foreign_bond", "T60_n0"), ("foreign_none", "T20_n0")])
def test_campaigns_of_another_program(campaign, test):
    """Noise as in its data sheet (which gives one a weight to a few per cent: weights come from noisy values)."""
    sets = pyuff.UFF(str(DATA / campaign / f"{test}.uff")).read_sets()
    frf = np.zeros((7, 2, len(sets[0]["x"])), complex)
    for x in sets:
        frf[x["rsp_node"] - 1, [1, 2].index(x["ref_node"])] = x["data"]
    modes = extract(sets[0]["x"], frf, noise_model(frf, 0.004, 0.0002))
    assert len(modes.frequency) == 8
    assert modes.rank_one
    assert modes.chi2 == pytest.approx(1, abs=0.03)
    assert modes.chi2_function == pytest.approx(np.ones((7, 2)), abs=5 / np.sqrt(len(sets[0]["x"])))


def test_measured_beam():
    """Six bending modes; a seventh, at 901 Hz and in the third FRF mainly, is in the data and not in beam theory. Damping is so small that
    most peaks are two lines wide."""
    path = DATA / "pyuff" / "beam_frf"
    frf = np.array([[[complex(x) for x in (path / f"meas_point_{i}.txt").read_text().split()]] for i in (1, 2, 3)])
    modes = extract(np.arange(frf.shape[2]), frf, kind="accelerance", band=(20, 999))
    bending = np.abs(modes.frequency - 901) > 2
    assert modes.frequency[bending] == pytest.approx([52, 142, 279, 460, 687, 959], abs=1)
    assert (modes.frequency_sd[bending] < 0.02).all()
    assert "estimated" in modes.status


# ---- which mode is which


def warm_spindle_off_its_drawing():
    """Noisy FRFs at 30 C of a spindle drawn from its tolerances, whose turning part lags 2 % behind; the seed is the one it was met with."""
    spindle = built = load(SCENE)
    random = np.random.default_rng([1004, 29])
    for parameter in toleranced(spindle):
        built = parameter.apply(built, parameter.sd * random.standard_normal())
    gain = 1 + 0.01 * random.standard_normal(len(spindle.points))
    for told in (20.0, 30.0):  # the test before it took its share of the random numbers
        true = told + spindle.tolerances.temperature * random.standard_normal()
        lag = 0.005 * 50**0.382 * (true - 20)
        regions = {g.name: true - lag * (g.part == "rotating") for g in spindle.regions}
        exact = operating_point(built, Condition(true), (), lambda s, regions=regions: expand(s, regions)).frf(WIDE)
        own, common = (random.standard_normal((2, *exact.shape)) / np.sqrt(2) for _ in range(2))
        largest = np.abs(exact).max(axis=(0, 2), keepdims=True)
        value = exact + 0.004 * np.abs(exact) * (own[0] + 1j * own[1]) + 0.0002 * largest * (common[0] + 1j * common[1])
    return value * gain[:, None, None]


def test_a_pair_with_nearly_the_same_frequency_stays_two():
    """Eight modes, two of them 1.8 Hz apart: free residues of such a pair are mixed and look alike, its rank-one shapes do not.

    The test at 30 C of a virtual campaign in which it was met; expected are the poles of the model behind the FRF.
    """
    value = warm_spindle_off_its_drawing()
    found = extract(WIDE, value, noise_model(value, 0.004, 0.0002), kind="mobility")
    assert found.rank_one
    assert len(found.frequency) == 8
    assert found.frequency[6] - found.frequency[5] == pytest.approx(1.8, abs=1.0)
    assert found.chi2 < 1.1


@pytest.mark.parametrize("seed", [0, 2])
def test_faint_modes_do_not_bend_those_that_overlap(seed):
    """Of a machine-tool spindle at 6000 rpm: modes at 1759, 1762 and 1802 Hz with 3 to 4 % of damping, beside axial ones
    that hardly show. Without these, which free residues are too dear for, they were off by up to 11 of their errors."""
    five = load(ROOT / "scenes" / "five_bearing")
    point = operating_point(five, Condition(20.0, 6000 * RPM))
    frequency = np.arange(*five.hammer.band, 4.0)
    exact = point.frf(frequency)
    sd = noise_model(exact, 0.004, 0.0002)
    random = np.random.default_rng(seed)
    found = extract(frequency, exact + sd / np.sqrt(2) * (random.standard_normal(sd.shape) + 1j * random.standard_normal(sd.shape)), sd)
    poles = np.array([m.pole for m in point.modes_below(five.hammer.band[1])])
    own = np.stack([np.abs(poles) / (2 * np.pi), -poles.real / np.abs(poles)])
    told = np.stack([found.frequency, found.damping])
    nearest = np.abs(poles - 2 * np.pi * (told[0] * (1j * np.sqrt(1 - told[1] ** 2) - told[1]))[:, None]).argmin(axis=1)
    assert len(set(nearest)) == len(found.frequency) >= 11
    assert np.abs((told - own[:, nearest]) / np.stack([found.frequency_sd, found.damping_sd])).max() < 3
