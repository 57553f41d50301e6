"""Campaigns that cannot be used are refused by name: files, numbers, physics."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from tests.conftest import SCENE
from tests.made_campaign import FREQUENCY, POINTS, ascii_58, rotor_frf, sets_of
from thermospindle.model.errors import BadInput
from thermospindle.model.units import RPM
from thermospindle.sim.campaign.campaign import Limits, read_campaign
from thermospindle.sim.campaign.uff import write_frf
from thermospindle.sim.identification.frf import Frf, check_frf


def edit(file: str, old: str, new: str, count: int = 1) -> Callable[[Path], None]:
    def change(folder: Path) -> None:
        data = (folder / file).read_bytes()
        assert old.encode() in data
        (folder / file).write_bytes(data.replace(old.encode(), new.encode(), count))

    return change


def edit_set(number: int, change: Callable[[bytes], bytes]) -> Callable[[Path], None]:
    """Change set `number` (from 1; three sets a pair of nodes: FRF, coherence, standard error) of T20_n0.uff."""

    def apply(folder: Path) -> None:
        sets = sets_of(folder / "T20_n0.uff")
        sets[number - 1] = change(sets[number - 1])
        (folder / "T20_n0.uff").write_bytes(b"".join(sets))

    return apply


def put_nan(block: bytes) -> bytes:
    at = len(block) - len(b"    -1\n") - 16 * 301 + 16 * 50  # line 50, 450 Hz
    return block[:at] + np.float64(np.nan).tobytes() + block[at + 8 :]


def missing_line(folder: Path) -> None:
    keep = np.delete(np.arange(301), 120)
    (folder / "T20_n0.uff").write_bytes(ascii_58(FREQUENCY[keep], rotor_frf().value[0, 0, keep], 6, False))


TOML, UFF, CSV = "campaign.toml", "T20_n0.uff", "modes.csv"


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (edit(TOML, "speed_rpm = 7200", "spead_rpm = 7200"), "campaign.toml: tests.T20.5_n7200.spead_rpm: unknown key; allowed.*speed_rpm"),
        (edit(TOML, "spindle =", "spindel ="), "campaign.toml: spindel: unknown key; allowed.*spindle"),
        (edit(TOML, "of_value =", "value ="), "campaign.toml: noise.value: unknown key; allowed here: of_value"),
        (edit(TOML, "position_mm", "position"), "campaign.toml: points.1.position: unknown key; allowed.*position_mm"),
        (edit(TOML, "quantity = \"mobility\"\n", ""), "campaign.toml: quantity: missing"),
        (edit(TOML, "temperature_C = 20.5\n", ""), "campaign.toml: tests.T20.5_n7200.temperature_C: missing"),
        (edit(TOML, "= 20.5\n", "= \"20.5\"\n"), "tests.T20.5_n7200.temperature_C = '20.5': .*number"),
        (edit(TOML, "= 20.5\n", "= -300.0\n"), "tests.T20.5_n7200.temperature_C = -300.0: .*greater than -273.15"),
        (edit(TOML, "= 20.5\n", "= nan\n"), "tests.T20.5_n7200.temperature_C = nan: .*finite"),
        (edit(TOML, "repeat = 2", "repeat = 2\npretrigger_s = 2.5"), "tests.T20.5_n7200.pretrigger_s = 2.5: must be less than the record of lines .* Hz apart"),
        (edit(TOML, "repeat = 2", "repeat = 0"), "tests.T20.5_n7200.repeat = 0: .*greater than or equal to 1"),
        (edit(TOML, "hammer_level_N = 3.3", "hammer_level_N = 0.0"), "hammer_level_N = 0.0: .*greater than 0"),
        (edit(TOML, "\"mobility\"", "\"impedance\""), "quantity = 'impedance': .*'receptance', 'mobility', 'accelerance' or 'displacement'"),
        (edit(TOML, "\"+Z\"", "\"up\""), r"points.1.direction = 'up': must be one of \+X"),
        (edit(TOML, "hub_top0", "hub_top_left"), "points.1.name = 'hub_top_left': .*10"),
        (edit(TOML, "node = 3", "node = 1"), "points: node = 1 stands 2 times"),
        (edit(TOML, "id = \"T20_n0\"", "id = \"T20.5_n7200\""), "tests: id = 'T20.5_n7200' stands 2 times"),
        (edit(TOML, "T20.5_n7200.uff", "T20_n0.uff"), "file = 'T20_n0.uff' stands 2 times"),
        (edit(TOML, "\"T20_n0.uff\"", "\"../T20_n0.uff\""), "tests.T20_n0.frf = '../T20_n0.uff': must be letters"),
        (edit(TOML, "\"T20_n0.uff\"", "\"T99.uff\""), r"campaign.toml: tests.T20_n0.frf = 'T99.uff': .*T99.uff: no such file; allowed is a file"),
        (edit(TOML, "title =", "title"), "campaign.toml: not a TOML file"),
        (edit(TOML, "node = 6", "node = 7"), r"T20_n0.uff: set 7 .*response node 6 is no point of the campaign; allowed are \[1, 3, 7\]"),
        (edit(CSV, "rocking,1738.1", "rocking,-1738.1"), "modes.csv: line 3: frequency_Hz = '-1738.1': .*greater than 0"),
        (edit(CSV, "1738.1,0.1", "1738.1,"), "modes.csv: line 3: frequency_sd_Hz: missing"),
        (edit(CSV, "0.011", "1.1"), "modes.csv: line 3: damping_ratio = '1.1': .*less than 1"),
        (edit(CSV, "0.011", ""), "modes.csv: line 3: damping_ratio_sd = .*without a damping_ratio"),
        (edit(CSV, "T20.5_n7200,2", "T99,2"), "modes.csv: line 3: test = 'T99': no such test; allowed are T20_n0"),
        (edit(CSV, "T20.5_n7200,2", "T20.5_n7200,1"), "modes.csv: line 3: mode = 1: .*already"),
        (edit(CSV, "frequency_sd_Hz", "sd"), "modes.csv: line 1: the columns must be test,mode"),
        (edit(CSV, ",0.011", ""), "modes.csv: line 3: has 6 cells; 7 are needed"),
        (edit(UFF, " m/s  ", " knots"), "T20_n0.uff: set 1 .*numerator unit 'knots'; allowed for velocity are m/s, mm/s"),
        (edit(UFF, "        11    0", "        12    0"), r"set 1 .*numerator is acceleration \(type 12\); allowed is velocity \(type 11\)"),
        (edit(UFF, "        13    0", "         8    0"), r"set 1 .*denominator is displacement \(type 8\).*excitation force \(type 13\)"),
        (edit(UFF, "        11    0    0", "        11    1    1"), r"set 1 .*unit exponents \(1, 1, 0\)"),
        (edit(UFF, " N   ", " kgf "), "set 1 .*denominator unit 'kgf'; allowed for excitation force are N"),
        (edit(UFF, " Hz     ", " rad/s  "), "set 1 .*abscissa of type 18 in 'rad/s'"),
        (edit(UFF, "         6       301", "         6       305"), "T20_n0.uff: set 1: holds 301 values, its header says 305"),
        (edit(UFF, "58b     1     2", "58b     1     3"), "T20_n0.uff: set 1: floating point format 3"),
        (edit(UFF, "  -1   hub_top0", "   2   hub_top0"), r"set 4 .*response direction 2 is not along the point's; allowed are -1 and 1"),
        (edit_set(4, lambda b: b.replace(b"1.00000e+00", b"2.00000e+00")), "set 4 .*301 from 400 to 1000 Hz, but 301 from 400 to 700 Hz"),
        (edit_set(4, put_nan), r"T20_n0.uff: set 4 \(FRF of response 3, reference 1\): NaN or infinite at 450 Hz"),
        (edit_set(4, lambda b: b""), "T20_n0.uff: FRF of response 3, reference 1: is missing"),
        (edit_set(5, lambda b: b""), "T20_n0.uff: coherence of response 3, reference 1: is missing"),
        (edit_set(4, lambda b: b + b), "T20_n0.uff: set 5 .*stands twice"),
        (edit_set(18, lambda b: b[:-7]), "T20_n0.uff: does not end with a line"),
        (edit_set(18, lambda b: b[:-900]), "T20_n0.uff: does not end with a line"),
        (edit(UFF, "    4         0", "    2         0", 6), "T20_n0.uff: holds no FRF"),
        (missing_line, "T20_n0.uff: set 1 .*from 519 to 521 Hz among steps of 1 Hz"),
    ],
    ids=[
        "test-key", "top-key", "noise-key", "point-key", "no-quantity", "no-temperature", "text", "cold", "nan", "pretrigger", "repeat", "level",
        "quantity", "direction", "long-name", "node-twice", "id-twice", "file-twice", "path", "no-file", "no-toml", "unknown-node",
        "csv-negative", "csv-no-sd", "csv-damping", "csv-sd-alone", "csv-test", "csv-mode-twice", "csv-columns", "csv-cells",
        "unit-label", "numerator", "denominator", "exponents", "force-label", "abscissa", "count", "float-format", "axis",
        "other-lines", "frf-nan", "frf-missing", "coherence-missing", "frf-twice", "no-end", "cut-off", "no-frf", "gap",
    ],
)  # fmt: skip
def test_reading_refuses(folder: Path, change: Callable[[Path], None], words: str) -> None:
    read_campaign(folder)
    change(folder)
    with pytest.raises(BadInput, match=words) as refusal:
        read_campaign(folder)
    assert str(folder) in str(refusal.value)
    assert "\n" not in str(refusal.value)


def test_another_point_than_the_hammers_is_known_where_no_line_shows_power() -> None:
    """A beam of 0.05 Hz wide modes on lines of 1 Hz, by its own measurement: told for the driving
    point, the answer of another passed, and its reader sought 35 minutes."""
    f, at = np.arange(2.0, 1000.0), np.array([63.4, 175.4, 344.6, 570.5, 851.5])
    modes = 1 / (at[:, None] ** 2 - f**2 + 2j * 5e-5 * at[:, None] * f)
    driven, signs = np.array([1.0, 0.8, 0.9, 0.7, 0.8]), np.array([1.0, -1.0, 1.0, -1.0, 1.0])
    for quantity, power in (("accelerance", 2), ("mobility", 1), ("receptance", 0)):
        here, there = (((weights @ modes) * (2j * np.pi * f) ** power)[None, None] for weights in (driven, signs * driven))
        check_frf("file", Frf(f, here, (1,), (1,), quantity), 0.0)
        with pytest.raises(BadInput, match=r"H\(1,1\): between resonances .* falls on \d+% of the lines.*another point than the hammer's"):
            check_frf("file", Frf(f, there, (1,), (1,), quantity), 0.0)


def test_missing_folder_is_named(tmp_path: Path) -> None:
    with pytest.raises(BadInput, match=r"measured: no campaign there; expected a folder with campaign.toml; within it is jang_2003"):
        read_campaign(SCENE / "measured")
    with pytest.raises(BadInput, match="nowhere: no campaign there"):
        read_campaign(tmp_path / "nowhere")


def part(change: Callable[[np.ndarray], object], name: str = "value") -> Frf:
    frf = rotor_frf()
    array = getattr(frf, name).copy()
    change(array)
    return replace(frf, **{name: array})


def put(key: object, value: Callable[[np.ndarray], object]) -> Callable[[np.ndarray], None]:
    def change(array: np.ndarray) -> None:
        array[key] = value(array)  # type: ignore[index]

    return change


@pytest.mark.parametrize(
    ("frf", "words"),
    [
        (part(put((1, 0), lambda v: v[1, 0].conj())), r"file: H\(3,1\): .*before the blow: the FRF is conjugated; allowed is"),
        (part(put((0, 1), lambda v: 2 * np.pi * np.arange(v.shape[-1]))), r"H\(1,6\): real, and rising in even steps from 0 to .*: that is an axis, no FRF"),
        (part(put((0, 0), lambda v: -v[0, 0])), r"H\(1,1\): .*negative real part.*allowed is 1%"),
        (part(put((0, 0), lambda v: v[1, 0])), r"H\(1,1\): .*negative real part"),
        (part(put((0, 1), lambda v: 1.3 * v[0, 1])), r"H\(1,6\) and H\(6,1\) differ by 26% at rest; reciprocity allows 15%"),
        (part(put((0, 1), lambda v: -v[0, 1])), r"H\(1,6\) and H\(6,1\) differ by 200%"),
        (part(put((1, 0, slice(80, 90)), lambda v: 0)), r"H\(3,1\): zero on 10 lines, the first at 480 Hz"),
        (part(put((1, 0, slice(80, 90)), lambda v: v[1, 0, 80])), r"H\(3,1\): the same value on five lines from 480 Hz"),
        (part(put(1, lambda v: 0)), "response 3: zero on every line"),
        (part(put((1, 0), lambda c: 0.5), "coherence"), r"H\(3,1\): coherence = 0.5 .*at least 0.8"),
        (part(put((1, 0, 7), lambda c: 1.2), "coherence"), r"H\(3,1\): coherence from .* to 1.2; allowed is 0 to 1"),
        (part(put((1, 0, 7), lambda s: 0.0), "sd"), r"H\(3,1\): standard error = 0: must be positive"),
    ],
    ids=["conjugated", "axis", "polarity", "other-point", "gain", "sign", "zeros", "held", "dead", "coherence", "coherence-range", "sd"],
)  # fmt: skip
def test_physics_refuses(frf: Frf, words: str) -> None:
    check_frf("file", rotor_frf(), 0.0)
    with pytest.raises(BadInput, match=words):
        check_frf("file", frf, 0.0)


@pytest.mark.parametrize("quantity", ["receptance", "mobility", "accelerance"])
@pytest.mark.parametrize("gyroscopic", [0.0, 150.0], ids=["rest", "spinning"])
def test_time_and_power_for_every_quantity(quantity: str, gyroscopic: float) -> None:
    frf = rotor_frf(quantity=quantity, gyroscopic=gyroscopic, noise=0.0)
    check_frf("file", frf, gyroscopic)
    with pytest.raises(BadInput, match="conjugated"):
        check_frf("file", replace(frf, value=frf.value.conj()), gyroscopic)
    with pytest.raises(BadInput, match="negative real part"):
        check_frf("file", replace(frf, value=-frf.value), gyroscopic)


def test_reciprocity_is_asked_at_rest_only() -> None:
    frf = rotor_frf(gyroscopic=150.0)
    check_frf("file", frf, 7200 * RPM)
    with pytest.raises(BadInput, match="reciprocity"):
        check_frf("file", frf, 0.0)


def test_noise_alone_is_no_conjugated_frf() -> None:
    """Where symmetry forbids an answer an FRF is noise; either time direction must pass, at any length (400 draws)."""
    random = np.random.default_rng(3)
    for n in (20, 50, 200, 2601):
        for _ in range(100):
            noise = random.standard_normal((1, 1, n)) + 1j * random.standard_normal((1, 1, n))
            check_frf("file", Frf(np.arange(1.0, n + 1), noise, (3,), (1,), "mobility"), 0.0)


def test_drift_of_a_silent_sensor_is_no_conjugated_frf() -> None:
    """What a record without an answer holds, a straight line say, has no direction of time; an answer that can be heard has."""
    frf = rotor_frf()
    after = np.fft.fft(np.linspace(0.0, 1.0, len(frf.frequency)))  # its energy is largest just before the end, which is before the blow
    loud = np.linalg.norm(frf.value[:, 0], axis=-1).max() / np.linalg.norm(after)
    check_frf("file", part(put((1, 0), lambda v: 5e-4 * loud * after)), 0.0)
    with pytest.raises(BadInput, match=r"H\(3,1\): .*conjugated"):
        check_frf("file", part(put((1, 0), lambda v: 5e-3 * loud * after)), 0.0)


def test_low_coherence_at_antiresonances_is_accepted() -> None:
    frf = rotor_frf()
    size = np.abs(frf.value)
    coherence = np.where(size < np.quantile(size, 0.6, axis=-1, keepdims=True), 0.1, 0.99)  # most of the lines are poor
    check_frf("file", replace(frf, coherence=coherence), 0.0)
    with pytest.raises(BadInput, match=r"coherence = 0\.99"):
        check_frf("file", replace(frf, coherence=coherence), 0.0, Limits(coherence=0.995))


@pytest.mark.parametrize(("share", "least"), [(0.01, 0.0), (0.03, 0.05), (0.06, 0.35), (0.2, 0.75)])
def test_what_is_hardly_heard_may_be_less_coherent(share: float, least: float) -> None:
    """An FRF that symmetry nearly forbids, a fiftieth of the strongest to a tenth: no coherence is asked
    below, all of it above, and no step lies between. 0.64 was refused and 0.6 taken, of the same two points."""
    frf = rotor_frf()
    size = np.linalg.norm(frf.value[:, 0], axis=-1).max()
    value, coherence = frf.value.copy(), np.full(frf.value.shape, 0.99)
    value[1, 0] *= share * size / np.linalg.norm(value[1, 0])
    limits = Limits(reciprocity=np.inf)
    for own in (least, least + 0.1):
        coherence[1, 0] = own
        there = replace(frf, value=value, coherence=coherence.copy())
        if own > least or least == 0.0:
            check_frf("file", there, 0.0, limits)
        else:
            with pytest.raises(BadInput, match=rf"H\(3,1\): coherence = {own:g} "):
                check_frf("file", there, 0.0, limits)


def test_limits_reach_reading(folder: Path) -> None:
    value = rotor_frf().value
    value[0, 1] *= 1.1
    (folder / "T20_n0.uff").unlink()
    write_frf(folder / "T20_n0.uff", replace(rotor_frf(), value=value), POINTS, "title", "T20_n0")
    read_campaign(folder, Limits(reciprocity=0.15))
    with pytest.raises(BadInput, match=r"T20_n0.uff: H\(1,6\) and H\(6,1\) differ by 10%.*reciprocity allows 5%"):
        read_campaign(folder, Limits(reciprocity=0.05))


@pytest.mark.parametrize("told", [True, False], ids=["sd told", "no sd"])
def test_cross_frfs_of_noise_alone_are_reciprocal(told: bool) -> None:
    """Hammers along x and y of a symmetric machine: H(1,2) and H(2,1) are zero plus noise, which differs by more than itself."""
    random, one = np.random.default_rng(2), rotor_frf(noise=0.0).value[0, 0]
    value = np.zeros((2, 2, len(one)), complex)
    value[0, 0] = value[1, 1] = one
    sd = np.full(value.shape, 2e-4 * np.abs(one).max())
    value += sd * (random.standard_normal(value.shape) + 1j * random.standard_normal(value.shape)) / np.sqrt(2)
    frf = Frf(FREQUENCY, value, (1, 2), (1, 2), "mobility", sd=sd if told else None)
    check_frf("file", frf, 0.0)
    value[0, 1] += 0.2 * one
    with pytest.raises(BadInput, match=r"H\(1,2\) and H\(2,1\) differ by"):
        check_frf("file", replace(frf, value=value), 0.0)


def test_a_driving_point_that_does_not_answer_is_noise() -> None:
    """A point along which nothing moves in the band: no line of it stands clear of its noise."""
    random, frf = np.random.default_rng(3), rotor_frf()
    value, sd = frf.value.copy(), np.asarray(frf.sd)
    value[0, 0] = sd[0, 0] * (random.standard_normal(301) + 1j * random.standard_normal(301)) / np.sqrt(2)
    check_frf("file", replace(frf, value=value), 500.0)
