"""The resonance map: crossings against a closed form, exactness, direction and sense of whirl, strength."""

from dataclasses import replace
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest

from tests.sim.resonance.conftest import NOMINAL
from thermospindle.model.bearing.kinematics import lines, row_kinematics
from thermospindle.model.built.imperfections import Imperfections
from thermospindle.model.errors import BadInput
from thermospindle.model.machine import Condition
from thermospindle.model.rotor.modes import modes
from thermospindle.model.scene.reading import load
from thermospindle.model.units import RPM
from thermospindle.sim.operating import operating_point
from thermospindle.sim.resonance.between import passes_zero
from thermospindle.sim.resonance.found import strongest
from thermospindle.sim.resonance.grid import Grid
from thermospindle.sim.resonance.map import resonance_map
from thermospindle.sim.resonance.point import Exact, key, nrro_rms
from thermospindle.sim.running.excitation import harmonics, response
from thermospindle.sim.running.probes import hub_probes
from thermospindle.sim.running.runout import runout

SCENE = Path(__file__).parents[3] / "scenes" / "hdd_2003"


def test_every_coincidence_is_exact(spindle, found):
    """At the listed condition the line and a mode of that kind are within 0.1 Hz, seen by operating points of their own."""
    assert len(found.coincidences) > 80
    for c in found.coincidences[::3]:
        point = operating_point(spindle, c.condition)
        line = next(x for x in lines(point.spindle, row_kinematics(point.spindle, point.state), c.condition.speed) if key(x) == key(c.line))
        near = min(modes(point.chain), key=lambda m: abs(m.frequency - line.frequency))
        assert line.frequency == pytest.approx(c.frequency, abs=1e-6)
        assert near.frequency == pytest.approx(line.frequency, abs=0.1)
        assert (near.kind == "axial") == (line.direction == "axial")


def test_no_sign_change_is_missed_at_the_nominal_speed(light, met):
    """On a finer temperature axis, by modes sorted into kinds: as many radial crossings as the map lists, sense allowed."""
    listed = [c for c in met.coincidences if c.at_nominal_speed and c.line.direction == "radial"]
    seen = []
    for t in np.linspace(20, 58.5, 78):
        point = operating_point(light, Condition(t, NOMINAL.speed))
        here = {key(x): x.frequency for x in lines(light, row_kinematics(light, point.state), NOMINAL.speed) if x.direction == "radial"}
        across = {(m.kind, m.whirl): m.frequency for m in modes(point.chain)[:7] if m.kind != "axial"}
        seen.append({(k, m): here[k] - across[m] for k in here for m in across if k[4] == {"forward": 1, "backward": -1}[m[1]]})
    crossed = [pair for a, b in pairwise(seen) for pair in a if a[pair] * b[pair] < 0]
    assert sorted(crossed) == sorted((key(c.line), (c.mode.kind, c.mode.whirl)) for c in listed)
    assert {c.line.bearing for c in listed} == {"lower", "upper"}
    assert {(c.line.name, c.line.order, c.mode.number) for c in listed} == {("30 (fo-fc) + fo", 31, 4)}


def test_a_crossing_at_the_nominal_condition_is_listed_once(light, met):
    """Met along temperature at the nominal speed and along speed at the nominal temperature, 0.0001 K and 0.01 rpm apart."""
    c = next(c for c in met.coincidences if not c.at_nominal_speed and c.condition.speed > 0.5 * NOMINAL.speed)
    there = Condition(c.condition.temperature, c.condition.speed)
    around = resonance_map(light, [there.temperature - 4.0, there.temperature + 4.0], [0.5 * there.speed, 1.5 * there.speed], there)
    alike = [x for x in around.coincidences if key(x.line) == key(c.line) and x.mode.kind == c.mode.kind and abs(x.condition.speed / there.speed - 1) < 1e-3]
    assert [x.condition.temperature for x in alike] == [pytest.approx(there.temperature, abs=0.05)]
    assert alike[0].at_nominal_speed


def test_a_gap_that_stands_on_zero_is_passed_once():
    """A crossing on a place of the grid was none."""
    gap = np.array([[-2.0, -1.0, 0.0, 1.0], [2.0, -1.0, np.nan, 0.0], [0.0, 1.0, -1.0, 0.0]])
    assert passes_zero(gap).tolist() == [[False, True, False], [True, False, False], [False, True, True]]


def test_strength_is_the_peak_of_the_response(spindle, found):
    """At a coincidence the mode's own part is most of what the exact linear model answers to that line, mode apart from others."""
    c = next(c for c in strongest(found.coincidences) if c.line.name == "2 fb" and c.mode.number == 1)
    point = operating_point(spindle, c.condition)
    forces = harmonics(point)
    n = next(n for n, line in enumerate(forces.line) if key(line) == key(c.line))
    axial = hub_probes(spindle)[2].row(point.chain)
    assert abs(response(point, forces)[n] @ axial) == pytest.approx(c.strength, rel=0.02)
    damping = min(modes(point.chain), key=lambda m: abs(m.frequency - c.frequency)).damping_ratio
    assert 0.003 < damping < 0.02
    off = operating_point(spindle, replace(c.condition, speed=c.condition.speed * 1.05))
    beside = abs(response(off, harmonics(off))[n] @ axial)
    assert beside == pytest.approx(c.strength * 2 * damping / (1.05**2 - 1), rel=0.3)


def test_growth_of_runout_through_a_crossing(met):
    """Radial NRRO rises towards the crossing at the nominal speed and falls beyond, and its peak is that of the coincidence."""
    c = next(c for c in met.coincidences if c.at_nominal_speed)
    place, radial, _ = met.nrro_temperature.T
    peak = int(np.argmax(radial))
    assert place[peak] == pytest.approx(c.condition.temperature, abs=0.5)
    assert radial[peak] == pytest.approx(c.nrro, rel=0.01)
    assert radial[peak] > 1.5 * radial[0]
    assert radial[-1] < 0.95 * radial[peak]


def test_nrro_by_the_sum_of_lines(spindle):
    """The same rms from phasors collected in another way: a dense record in time of one bearing's lines."""
    turning = NOMINAL.speed / (2 * np.pi)
    point = operating_point(spindle, Condition(35.0, NOMINAL.speed))
    own = point.imperfections
    only = replace(own, unbalance=0.0, couple_unbalance=0.0, bearings={"lower": own.bearings["lower"]})
    alone = replace(point, spindle=replace(spindle, imperfections=only))
    forces = harmonics(alone)
    seen = response(alone, forces) @ np.array([p.row(alone.chain) for p in hub_probes(spindle)]).T
    apart = [n for n, f in enumerate(forces.frequency) if abs(f / turning - round(f / turning)) > 1e-6]
    time = np.arange(200_000) / 20_011.0
    x, y, z = (sum((seen[n, k] * np.exp(2j * np.pi * forces.frequency[n] * time)).real for n in apart) for k in range(3))
    radial, axial = nrro_rms(Exact(alone, {}, {}, 3))
    assert radial == pytest.approx(np.sqrt((x.var() + y.var()) / 2), rel=5e-3)
    assert axial == pytest.approx(z.std(), rel=5e-3)


def test_axial_lines_leave_rocking_modes_alone(found):
    for c in found.coincidences:
        assert (c.line.direction == "axial") == (c.mode.kind == "axial")
        assert 0.01 <= c.sense <= 1.0


def test_sense_of_a_nearly_standing_mode(spindle):
    """The base holds the two rocking modes d = 26 Hz apart, turning drives them to s: of a mode's force
    the share (1 + sqrt(1 - d^2/s^2)) / 2 whirls with it, the rest against it (two coupled oscillators,
    Genta 2005, sec. 2.4). Slowly turning, lines of either sense excite both. So at the upper bearing,
    far from where the modes pivot; at the lower one the hub moves not quite alike about x and y."""
    slow = resonance_map(spindle, [20.0, 25.0], np.linspace(0, 3600, 7) * RPM, Condition(20.0, 1800 * RPM), multiples=8)
    standing = [c for c in slow.coincidences if c.mode.number in (3, 4) and c.line.bearing == "upper"]
    assert {(c.mode.number, c.line.whirl) for c in standing} == {(3, 1), (3, -1), (4, 1), (4, -1)}
    at_rest = np.subtract(*[slow.modes[m].frequency[0, 0] for m in (3, 2)])
    for c in standing:
        low, high = [m.frequency for m in modes(operating_point(spindle, c.condition).chain) if m.kind == "rocking"][:2]
        with_it = (1 + np.sqrt(1 - (at_rest / (high - low)) ** 2)) / 2
        assert c.sense == pytest.approx(with_it if c.line.whirl == (-1, 1)[c.mode.number - 3] else 1 - with_it, abs=0.015)


def test_without_imperfections_a_plausible_set_is_drawn(spindle):
    from thermospindle.model.built.imperfections import Imperfections

    plain = resonance_map(replace(spindle, imperfections=Imperfections()), [20.0, 60.0], [0.0, 14400 * RPM], NOMINAL)
    assert plain.drawn_from == 0
    assert max(c.strength for c in plain.coincidences) > 1e-9


def test_grids_that_make_no_map(spindle):
    with pytest.raises(BadInput, match="two different"):
        resonance_map(spindle, [20.0, 30.0], [NOMINAL.speed], NOMINAL)
    with pytest.raises(BadInput, match="negative"):
        resonance_map(spindle, [20.0, 30.0], [-700.0, 700.0], NOMINAL)


@pytest.mark.slow
def test_runout_grows_when_simulated(light, met):
    """MuJoCo's time domain at the nominal condition and at the crossing shows what the linear model
    says of the same record, and that grows as the map tells.

    The map adds the two bearings' lines as squares, which is the mean over all places of the cages. In one record they stand
    somewhere: where two bearings at one temperature have lines at one frequency, these beat for far longer than the record.
    """
    c = next(c for c in met.coincidences if c.at_nominal_speed)
    seen = []
    for condition in (NOMINAL, c.condition):
        point = operating_point(light, condition)
        simulated, exact = (runout(point, 0.5, path=path).by_lines.nonrepeatable[:2].std() for path in ("simulated", "linear"))
        assert simulated == pytest.approx(exact, rel=0.005)
        seen.append(simulated)
    start = int(np.argmin(np.abs(met.nrro_temperature[:, 0] - NOMINAL.temperature)))
    assert seen[1] / seen[0] == pytest.approx(c.nrro / met.nrro_temperature[start, 1], rel=0.1)


def test_map_takes_the_mean_over_the_places_of_the_cages(spindle):
    """At 6050 rpm and 20 C, 30 fc of both bearings is one frequency near the backward rocking mode.
    Where one cage stands against the other turns the phases of its lines: the mean square over all
    of that is the map's, and one place can differ from it by more than a tenth."""
    point = operating_point(spindle, Condition(20.0, 6050 * RPM))
    forces, turning = harmonics(point), 6050 / 60
    seen = response(point, forces) @ np.array([p.row(point.chain) for p in hub_probes(spindle)[:2]]).T
    squares = []
    for angle in np.linspace(0, 2 * np.pi, 24, endpoint=False):
        together: dict[float, np.ndarray] = {}
        for line, frequency, one in zip(forces.line, forces.frequency, seen, strict=True):
            if abs(frequency / turning - round(frequency / turning)) > 1e-6:
                at = round(float(frequency), 6)
                together[at] = together.get(at, 0) + one * np.exp(1j * angle * (line.bearing == "upper"))
        squares.append(sum((np.abs(x) ** 2).sum() / 4 for x in together.values()))
    assert np.sqrt(np.mean(squares)) == pytest.approx(nrro_rms(Exact(point, {}, {}, 3))[0], rel=1e-6)
    assert np.abs(np.sqrt(squares) / np.sqrt(np.mean(squares)) - 1).max() > 0.1


def test_few_speeds_are_followed_as_many_are():
    """Modes of a grinding spindle at rest and at 60,000 rpm alone: axial ones fall past others,
    with which they changed places by frequency."""
    grinding, told = load(SCENE.parent / "templates" / "grinding.toml"), []
    for count in (2, 21):
        grid = Grid(grinding, Condition(22.0), 1, grinding.hammer.band[1], Imperfections(unbalance=1e-9))
        tracks, _ = grid.follow(np.array([22.0]), np.linspace(0, 60000, count) * RPM, lambda words: None)
        told.append({axial: sorted(float(t.frequency[0, -1]) for t in tracks if (t.kind == "axial") == axial) for axial in (True, False)})
    assert (len(told[0][True]), len(told[0][False])) == (2, 8)
    assert told[0] == {axial: pytest.approx(own, rel=1e-9) for axial, own in told[1].items()}
