"""The tailstock spindle, on cylindrical rollers in front: Palmgren's deflection of a line contact,
the nose by the force method over the shaft's drawing (Castigliano: bending and shear integrals, no
elements), Lame's rings for the clearance over temperature, and what verbs say of rollers."""

import csv
import json
from dataclasses import replace
from itertools import pairwise
from types import SimpleNamespace

import numpy as np
import pytest

from tests.conftest import ROOT
from thermospindle.cli import main
from thermospindle.model.bearing.roller import respond, roller_row, roller_state
from thermospindle.model.built.tolerance import deviated, toleranced
from thermospindle.model.errors import OutsideRange
from thermospindle.model.machine import Condition
from thermospindle.model.rotor.static import static
from thermospindle.model.scene.reading import load, shipped_rows
from thermospindle.model.units import RPM
from thermospindle.report.log.content import bearing_series
from thermospindle.report.page.report import bearing_figures
from thermospindle.sim import warmup
from thermospindle.sim.operating import operating_point
from thermospindle.thermal import conduction, friction, heat
from thermospindle.thermal.influence import influence
from thermospindle.thermal.readout import reading

SCENE = ROOT / "scenes" / "tailstock"
STEEL, NU, ALPHA = 210e9, 0.3, 11.5e-6
IRON, NU_IRON, ALPHA_IRON = 120e9, 0.26, 10.5e-6


@pytest.fixture(scope="module")
def tail():
    return load("tailstock")


@pytest.fixture(scope="module")
def stiff(tail):
    """Its races do not give under the rollers."""
    return replace(tail, roller_bearings=tuple(replace(b, race_give=0.0) for b in tail.roller_bearings))


@pytest.fixture(scope="module")
def cold(tail):
    return operating_point(tail, Condition(20.0))


@pytest.mark.parametrize("load_N", [500.0, 2000.0, 8000.0])
def test_the_rollers_give_as_palmgren_has_it(tail, load_N):
    """Without clearance the most loaded roller of Z i carries 4.08 F / (Z i), and the shaft moves
    by 7.68e-5 Q^0.9 / l^0.8 mm (Harris, Rolling Bearing Analysis, 4th ed., Eqs. 7.24 and 8.5:
    3.84e-5 a contact), which is within 5 % of the standard's that the program computes with."""
    [bearing] = tail.roller_bearings
    row = roller_row(tail, replace(bearing, clearance=0.0), None, 20.0)
    most = 4.08 * load_N / (26 * 2)
    moved = 7.68e-5 * most**0.9 / 8.2**0.8 * 1e-3
    assert -respond(row, np.array([-moved, 0, 0, 0, 0])).force[0] == pytest.approx(load_N, rel=0.05)


def press_fit_stiffness(interference_um: float) -> tuple[float, float]:
    """Radial (N/m) and tilting (N m/rad) stiffness of two rows of 26 rollers, each pressed by half
    the interference: 26 n c d^(1/9), n = 10/9."""
    constant = 35_948 * 8.2 ** (8 / 9) * 1e3 ** (10 / 9) * STEEL / 206e9
    radial = 26 * 10 / 9 * constant * (interference_um * 1e-6 / 2) ** (1 / 9)
    return radial, radial * (8.2e-3**2 / 12 + 12e-3**2 / 4)


def test_the_races_give_as_lames_rings_do(tail, cold):
    """What 1 N of all contact loads, spread over the 30 mm of the rings, widens the outer race and narrows
    the inner one by; and the clearance at which the rollers' load is what keeps the races that far apart."""
    [bearing] = tail.roller_bearings
    inner = 0.041 / STEEL * ((0.041**2 + 0.022**2) / (0.041**2 - 0.022**2) - NU)
    a, b, c = 0.050, 0.055, 0.075
    ring, iron = b / STEEL * ((b**2 + a**2) / (b**2 - a**2) - NU), b / IRON * ((c**2 + b**2) / (c**2 - b**2) + NU_IRON)
    between = 2 * a**2 * b / (b**2 - a**2) / STEEL / (ring + iron)  # of the pressure on the outer race, between ring and barrel
    outer = a / STEEL * ((b**2 + a**2) / (b**2 - a**2) + NU) - between * 2 * b**2 * a / (b**2 - a**2) / STEEL
    assert bearing.race_give == pytest.approx(2 * (inner / 0.041 + outer / 0.050) / (2 * np.pi * 0.030), rel=2e-3)
    state = cold.state.any_bearing("front1")
    constant = 35_948.0 * 8.2 ** (8 / 9) * 210 / 206  # N / mm^(10/9)
    load = 52 * constant * (-1e3 * state.clearance / 2) ** (10 / 9)
    assert state.load == pytest.approx(load, rel=1e-6)
    assert state.clearance == pytest.approx(-2.5e-6 + bearing.race_give * load, rel=1e-6)


def sections() -> list[tuple[float, float, float]]:
    """End (m), bending stiffness EI and shear stiffness kappa GA of the drawing's pieces; kappa of a thick ring by Cowper (1966)."""
    outer = [(0.028, 0.095), (0.045, 0.082), (0.090, 0.070), (0.245, 0.064), (0.365, 0.050)]
    bore = [(0.130, 0.044), (0.365, 0.020)]
    found = []
    for end in sorted({z for z, _ in outer + bore}):
        d, b = (next(v for z, v in pieces if z >= end) for pieces in (outer, bore))
        share = (b / d) ** 2
        kappa = 6 * (1 + NU) * (1 + share) ** 2 / ((7 + 6 * NU) * (1 + share) ** 2 + (20 + 12 * NU) * share)
        found.append((end, STEEL * np.pi / 64 * (d**4 - b**4), kappa * STEEL / (2 * (1 + NU)) * np.pi / 4 * (d**2 - b**2)))
    return found


def compliance_by_forces(springs: list[tuple[float, np.ndarray]]) -> float:
    """Motion of the nose (m) by 1 N there, of the shaft on springs (z, (2, 2) of x and tilt): loads
    at the springs unknown, the shaft held at its end."""
    loads = [(0.0, 0), *((z, kind) for z, _ in springs for kind in (0, 1))]  # a force, or a moment, at z
    flexibility, start = np.zeros((len(loads), len(loads))), 0.0
    for end, bending, shearing in sections():
        cuts = sorted({start, end, *(z for z, _ in loads if start < z < end)})
        for low, high in pairwise(cuts):
            place, weight = np.polynomial.legendre.leggauss(3)
            for z, w in zip((low + high) / 2 + (high - low) / 2 * place, (high - low) / 2 * weight, strict=True):
                past = np.array([float(z > at) for at, _ in loads])
                moment = past * np.array([1.0 if kind else z - at for at, kind in loads])
                shear = past * np.array([0.0 if kind else 1.0 for _, kind in loads])
                flexibility += w * (np.outer(moment, moment) / bending + np.outer(shear, shear) / shearing)
        start = end
    length, own = start, slice(1, None)
    # a moment turns the section about y by dx/dz; a force at z and the held end's motion (x, tilt) move z by x - (L - z) tilt
    rigid = np.array([[0.0, 1.0] if kind else [1.0, at - length] for at, kind in loads])
    flexibility = flexibility * np.outer([-1 if k else 1 for _, k in loads], [-1 if k else 1 for _, k in loads])
    stiffness = np.zeros((len(loads) - 1, len(loads) - 1))
    for k, (_, matrix) in enumerate(springs):
        stiffness[2 * k : 2 * k + 2, 2 * k : 2 * k + 2] = matrix
    # u = F p + R q, p of the springs = -K u, R^T p = 0 as nothing holds the end
    size = len(loads) - 1
    system = np.block([[np.eye(size) + stiffness @ flexibility[own, own], stiffness @ rigid[own]], [rigid[own].T, np.zeros((2, 2))]])
    answer = np.linalg.solve(system, -np.concatenate([stiffness @ flexibility[own, 0], rigid[0]]))
    return float(flexibility[0, 0] + flexibility[0, own] @ answer[:size] + rigid[0] @ answer[size:])


def test_the_nose_by_the_force_method(tail, cold):
    """The rollers by their closed form, the ball rows' matrices as computed, the barrel rigid on its clamp 220 mm behind the nose."""
    radial, tilt = press_fit_stiffness(-1e6 * cold.state.any_bearing("front1").clearance)
    front = cold.state.any_bearing("front1").stiffness
    assert (front[0, 0], front[4, 4]) == pytest.approx((radial, tilt), rel=1e-6)
    springs = [(0.060, np.diag([radial, tilt])), *((b.z, b.stiffness[np.ix_([0, 4], [0, 4])]) for b in cold.state.bearings)]
    clamp = 1 / 2.4e9 + 0.220**2 / 5.0e7
    nose = static(tail, cold.chain, tail.points[0])
    assert 1 / nose.stiffness == pytest.approx(compliance_by_forces(springs) + clamp, rel=2e-3)
    assert nose.reactions["front1"] < -1  # as a lever: more than the force itself


def test_the_clearance_of_rollers_is_a_tolerance(stiff):
    """Of rigid races: the load of all rollers goes with the 10/9th power of what they are pressed by, their stiffness with the 9th root."""
    own = next(p for p in toleranced(stiff) if p.name == "front1 clearance")
    assert own.sd == stiff.tolerances.preload == 0.1
    before, after = (roller_state(s, s.roller_bearings[0], None, 20.0) for s in (stiff, own.apply(stiff, 0.1)))
    assert after.clearance == pytest.approx(-2.75e-6, rel=1e-12)
    assert after.load / before.load == pytest.approx(1.1 ** (10 / 9), rel=1e-9)
    assert after.radial_stiffness / before.radial_stiffness == pytest.approx(1.1 ** (1 / 9), rel=1e-9)
    assert deviated(stiff, {"front1 clearance": 0.1}).roller_bearings == own.apply(stiff, 0.1).roller_bearings


@pytest.mark.slow
@pytest.mark.parametrize(("standing", "alpha"), [("steel", ALPHA), ("cast iron", ALPHA_IRON)])
def test_the_clearance_of_whole_parts_over_temperature(stiff, standing, alpha):
    """What turns is one steel and what stands one material: every radius grows by its own alpha dT,
    50 mm outside, 41 and twice 4.5 mm inside."""
    regions = tuple(replace(g, material=standing if g.part == "stationary" else g.material) for g in stiff.regions)
    warm = operating_point(replace(stiff, regions=regions), Condition(60.0)).state.any_bearing("front1")
    assert warm.clearance == pytest.approx(-2.5e-6 + 2 * 40.0 * 0.050 * (alpha - ALPHA), abs=1e-9)


def test_the_clearance_over_temperature_lies_between_lames(stiff):
    """The steel outer ring, 50 to 55 mm, in a barrel of iron to 75 mm that grows less: the pressure between them by
    Lame (plane stress), of a barrel as long as the ring and of a rigid one. The drawn barrel is longer than the ring."""
    warm, dT = operating_point(stiff, Condition(60.0)).state.any_bearing("front1"), 40.0
    a, b, c = 0.050, 0.055, 0.075
    ring = b / STEEL * ((b**2 + a**2) / (b**2 - a**2) - NU)  # m a Pa, of the ring's outside inward
    as_long = b / IRON * ((c**2 + b**2) / (c**2 - b**2) + NU_IRON)  # of the barrel's bore outward
    change = []
    for iron in (as_long, 0.0):
        pressure = (ALPHA - ALPHA_IRON) * dT * b / (ring + iron)
        race = ALPHA * dT * a - 2 * pressure * a * b**2 / (STEEL * (b**2 - a**2))
        change.append(2 * (race - ALPHA * dT * 0.041) - 2 * ALPHA * dT * 0.009)

    assert change[1] < warm.clearance + 2.5e-6 < change[0]
    assert change[0] - change[1] < 2e-6
    assert warm.radial_stiffness == pytest.approx(press_fit_stiffness(-1e6 * warm.clearance)[0], rel=1e-6)


def test_table_and_check_tell_the_clearance(tmp_path, capsys):
    assert main(["table", "tailstock", "--temperatures", "20", "60", "--out", str(tmp_path / "out"), "--json"]) == 0
    bearings = json.loads(capsys.readouterr().out)["bearings"]
    assert bearings["front1"]["clearance_um"] == pytest.approx([-1.40, -3.13], abs=0.02)
    assert bearings["rear1"]["clearance_um"] == [None, None]
    [file] = (tmp_path / "out").glob("*.csv")
    rows = list(csv.DictReader(file.read_text(encoding="utf-8").splitlines()[2:]))
    assert [float(r["clearance_um"]) for r in rows if r["bearing"] == "front1"] == bearings["front1"]["clearance_um"]
    assert main(["table", "tailstock", "--temperatures", "20"]) == 0
    assert "clear-" in capsys.readouterr().out
    assert main(["table", "five_bearing", "--temperatures", "20"]) == 0
    assert "clear-" not in capsys.readouterr().out
    assert main(["check", "tailstock"]) == 0
    said = " ".join(capsys.readouterr().out.split())
    assert "Rollers of front1: 2 rows of 26, 9 mm and 8.2 mm long, pressed by 1.4 um across, 74 N each; free along the axis." in said
    assert "Odd: - nothing" in said


def heated(tail, rpm):
    """The heat model of the drawing, and what drives it at the nodal temperatures: the loads of the bearings there."""
    model = conduction.model(tail, influence(tail).sections)
    machine, speed = warmup._Machine(tail, rpm * RPM, (), reading(model)), rpm * RPM
    return model, lambda nodal: heat.Running(20.0, speed, friction.loads(tail, machine.point(nodal).state))


def test_at_the_printed_most_speed_there_is_a_steady_state(tail):
    """3500 rpm are printed as the most. Loads put in for the loads they heat up, round by round, come nearer by the same share each
    time, which is what comes back of a load; the sum of that series is the steady state. All heat that is made goes out there."""
    model, drive = heated(tail, 3500)
    field = heat.settled(model, drive, 20.0)
    nodal = model.nodal(field)
    steady = drive(nodal)
    flows = heat.flows(model, field, steady)
    assert flows.friction == pytest.approx(flows.convection, rel=1e-6)
    assert flows.friction == pytest.approx(378, rel=0.02)
    rounds = [steady.loads["front1"] * 1.001]
    for _ in range(3):
        rounds.append(drive(model.nodal(heat.steady(model, replace(steady, loads={**steady.loads, "front1": rounds[-1]})))).loads["front1"])
    shares = np.diff(rounds)[1:] / np.diff(rounds)[:-1]
    assert heat.feedback(model, field, drive) == pytest.approx(shares[-1], abs=0.01)
    assert 0.7 < shares[-1] < 0.85


def test_beyond_it_rollers_run_away(tail):
    with pytest.raises(OutsideRange, match=r"it runs away, or nearly: of a load that is added \d+% come back through its heat"):
        heat.settled(*heated(tail, 4500), 20.0)


@pytest.mark.slow
def test_a_warm_up_presses_the_rollers(tmp_path, capsys):
    """The inner ring is the hottest: the clearance falls, and text, table and picture tell it."""
    assert main(["warmup", "tailstock", "--speed", "1500", "--minutes", "5", "--out", str(tmp_path / "out")]) == 0
    said = capsys.readouterr().out
    assert "clearance" in said
    rows = list(csv.DictReader((tmp_path / "out" / "warmup.csv").read_text(encoding="utf-8").splitlines()[1:]))
    clearance = [float(r["clearance of front1 bearing_um"]) for r in rows]
    assert clearance[0] == pytest.approx(-1.40, abs=0.02)
    assert -2.5 < clearance[-1] < -1.6
    assert float(rows[-1]["friction of front1 bearing_W"]) > sum(float(rows[-1][f"friction of rear{k} bearing_W"]) for k in (1, 2, 3, 4))


def on_rollers_alone(tmp_path, clearance_um=-2.5):
    """The scene with a bearing given by numbers in place of its ball rows."""
    raw = (SCENE / "spindle.toml").read_text(encoding="utf-8")
    head, tail = raw.split("[bearings.rear1]")
    numbers = """[bearings.rear1]
origin = "assumed"
source = "test"
z_mm = 255.0
[bearings.rear1.numbers]
radial_stiffness_N_per_um = 100.0
axial_stiffness_N_per_um = 300.0
damping_ratio = 0.03

# """
    own = shipped_rows()["roller_rows"]["NN3014ASK"] | {"mounted_clearance_um": clearance_um}
    rows = "[roller_rows.own]\n" + "".join(f"{key} = {json.dumps(value)}\n" for key, value in own.items() if key != "origins")
    text = head.replace('row = "NN3014ASK"', 'row = "own"') + numbers + tail.split("# ------", 1)[1]
    (tmp_path / "spindle.toml").write_text(text + rows, encoding="utf-8")
    return str(tmp_path)


@pytest.mark.slow
def test_a_spindle_on_rollers_alone_warms_up(tmp_path, capsys):
    """Nothing in it has a preload; words, numbers and picture do without."""
    scene = on_rollers_alone(tmp_path)
    assert main(["warmup", scene, "--speed", "500", "--minutes", "0.5", "--out", str(tmp_path / "out")]) == 0
    said = capsys.readouterr().out
    assert "preload" not in said
    assert "clearance" in said
    assert main(["warmup", scene, "--speed", "500", "--minutes", "0.5", "--json"]) == 0
    answer = json.loads(capsys.readouterr().out)
    assert answer["preload_N"] is None
    assert answer["bearings"]["front1"]["clearance_um"][-1] < -1.4
    assert main(["check", scene]) == 0
    assert "constant numbers" not in capsys.readouterr().out


@pytest.mark.slow
def test_loose_rollers_are_told_in_a_warm_up(tmp_path, capsys):
    assert main(["warmup", on_rollers_alone(tmp_path, 5.0), "--speed", "100", "--minutes", "0.5"]) == 0
    assert "From 0 min on the rollers of front1 are loose: they carry nothing then." in " ".join(capsys.readouterr().out.split())


def test_the_report_and_the_log_of_a_run_have_the_rollers(tail, cold):
    """Their figures and series are read of the operating points; nothing of a hammer test is in them."""
    steps = [SimpleNamespace(point=point) for point in (cold, operating_point(tail, Condition(60.0)))]
    run = SimpleNamespace(spindle=tail, steps=steps)
    captions = [caption for caption, _ in bearing_figures(run)]
    assert "Clearance of rollers across, negative where they are pressed." in captions
    assert "Preload, the axial force of a bearing." in captions
    assert bearing_series(run, "front1")["clearance", "µm"] == pytest.approx([-1.40, -3.13], abs=0.02)
    assert ("preload", "N") in bearing_series(run, "rear1")
