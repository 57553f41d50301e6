"""The rotor-base chain: gyroscopic closed forms by matrices and by MuJoCo, FRFs, energies, the reference spindle's modes."""

import tomllib
from dataclasses import replace

import mujoco
import numpy as np
import pytest

from tests.conftest import ROOT
from tests.literature.test_rotors import chain as flexible
from tests.literature.test_rotors import rotor
from tests.mounting import sprung
from thermospindle.model.bearing.pair import solve
from thermospindle.model.bearing.row import reference_motion
from thermospindle.model.built.tolerance import toleranced
from thermospindle.model.machine import Condition
from thermospindle.model.rotor import mjcf
from thermospindle.model.rotor.chain import Element, Matrices, RotorBase, matrices, motion_rows, rotor_base
from thermospindle.model.rotor.chain import sprung as on_a_spring
from thermospindle.model.rotor.elements import ELEMENTS
from thermospindle.model.rotor.frf import frf, point_rows
from thermospindle.model.rotor.modes import group_energy, modes
from thermospindle.model.rotor.poles import poles
from thermospindle.model.scene.reading import build, load
from thermospindle.model.structure import Body
from thermospindle.model.units import RPM
from thermospindle.sim.operating import operating_point

NONE = np.zeros((5, 5))


def tilting_rotor(speed: float) -> RotorBase:
    body = Body("rotor", 0.05, (1e-5, 1e-5, 1.6e-5), 0.0, ("tilt_x", "tilt_y"), True, ())
    return RotorBase((body,), (Element("spring", "spring", "ground", "rotor", 0.0, np.diag([0, 0, 0, 1200.0, 1200.0]), NONE),), speed)


def rotor_on_bearings(speed: float) -> RotorBase:
    body = Body("rotor", 0.06, (1.2e-5, 1.2e-5, 1.8e-5), 0.0, ("x", "y", "tilt_x", "tilt_y"), True, ())
    radial = np.diag([12e6, 12e6, 0, 0, 0])
    springs = tuple(Element(n, "bearings", "ground", "rotor", z, radial, NONE) for n, z in (("a", 6e-3), ("b", -9e-3)))
    return RotorBase((body,), springs, speed)


TILTING = [(0, (1743.455,)), (7200, (1650.096, 1842.096)), (20000, (1497.064, 2030.398))]
TWO_BEARINGS = [(0, (1675.11,)), (7200, (1589.26, 1765.44, 3206.00, 3209.82)), (60000, (1093.07, 2542.05))]


def by_mujoco(chain: RotorBase):
    return mjcf.linearise(mjcf.chain_spec(chain, 5e-6).compile())


@pytest.mark.parametrize("path", [matrices, by_mujoco], ids=["matrices", "mujoco"])
@pytest.mark.parametrize(
    ("make", "rpm", "expected"), [(tilting_rotor, *c) for c in TILTING] + [(rotor_on_bearings, *c) for c in TWO_BEARINGS]
)
def test_gyroscopic_closed_forms(path, make, rpm, expected):
    """Natural frequencies of verification.md, 1e-5: the printed digits."""
    chain = make(rpm * RPM)
    found = [m.frequency for m in modes(chain, path(chain))]
    for value in expected:
        assert min(abs(f / value - 1) for f in found) < 5e-6


def test_forward_whirl_is_the_faster_one():
    low, high = modes(tilting_rotor(7200 * RPM))
    assert (low.whirl, high.whirl) == ("backward", "forward")
    low, high = modes(tilting_rotor(-7200 * RPM))
    assert (low.whirl, high.whirl) == ("backward", "forward")


def test_whirl_is_that_of_the_whole_axis():
    """A rotor on bearings soft in y at one end and in x at the other: the sense of a mode is that
    of its orbits wherever they are large, and mixed where both senses are."""
    spindle = rotor((211.0, 0.3, 7810.0), [(50, 1500)], [], [(500, 15.0, 0.1, 0.2), (1000, 25.0, 0.3, 0.6)], [(0, 1e7, 1e6), (1500, 1e6, 1e7)], longest=62.5)
    shaken = flexible(spindle, 6000 * RPM)
    found = [m for m in modes(shaken)[:9] if m.kind != "axial"]
    assert [m.whirl for m in found[:6]] == ["backward", "forward", *["mixed"] * 4]
    for mode in found[:6]:
        x, y = np.array([motion_rows(shaken, b.name, (0.0, 0.0, b.z))[:2] @ mode.shape for b in shaken.bodies if b.turns]).T
        area = 2 * (x * y.conj()).imag
        senses = {"forward" if a > 0 else "backward" for a in area[np.abs(area) > 0.05 * np.abs(area).max()]}
        assert senses == ({"forward", "backward"} if mode.whirl == "mixed" else {mode.whirl})
    assert {m.whirl for m in modes(flexible(spindle, 0.0))[:9]} == {"none"}


def test_one_end_does_not_tell_the_whirl():
    """The lowest end of a rotor moves along a line in a mode that circulates forward."""
    spindle = rotor((211.0, 0.3, 7810.0), [(50, 1500)], [], [(500, 15.0, 0.1, 0.2), (1000, 25.0, 0.3, 0.6)], [(400, 1e7, 1e6), (1100, 1e7, 1e6)], longest=62.5)
    mode = min(modes(flexible(spindle, 6000 * RPM)), key=lambda m: abs(m.frequency - 174.9))
    assert mode.whirl == "forward"


EXPECTED = [
    (20.0, 0.0, [1002.0, 1545.0, 1795.0, 1821.0, 2010.0, 4496.5, 4498.9, 5551.5]),
    (20.0, 7200.0, [1002.0, 1545.0, 1760.9, 1855.6, 2010.0, 4465.1, 4532.2, 5551.5]),
]


@pytest.mark.parametrize(("temperature", "rpm", "expected"), EXPECTED, ids=["20C-rest", "20C-7200rpm"])
def test_reference_spindle(spindle, temperature, rpm, expected):
    """Frequencies of the data sheet's independent calculation, 0.1 Hz."""
    still = {b.name: reference_motion(temperature) for b in spindle.bearings}
    chain = rotor_base(spindle, solve(spindle, Condition(temperature, rpm * RPM), still))
    found = modes(chain, highest=6000)
    assert [m.frequency for m in found] == pytest.approx(expected, abs=0.1)
    assert [m.kind for m in found] == ["axial", "axial", "rocking", "rocking", "axial", "lateral", "lateral", "rocking"]
    assert all(sum(m.energy.values()) == pytest.approx(1.0, rel=1e-12) for m in found)
    assert max(group_energy(chain, found[5]).items(), key=lambda e: e[1])[0] == "bearings"


def test_mass_and_stiffness_are_symmetric_and_positive(spindle, hot):
    linear = matrices(rotor_base(spindle, hot))
    for matrix in (linear.mass, linear.stiffness):
        assert np.abs(matrix - matrix.T).max() < 1e-14 * np.abs(matrix).max()
        scale = 1 / np.sqrt(np.diag(matrix))
        assert np.linalg.eigvalsh(matrix * np.outer(scale, scale)).min() > 1e-6


@pytest.mark.parametrize("kind", ["receptance", "mobility", "accelerance"])
@pytest.mark.parametrize("rpm", [0.0, 7200.0])
def test_frf_is_the_inverse_of_the_dynamic_stiffness(spindle, kind, rpm):
    still = {b.name: reference_motion(20.0) for b in spindle.bearings}
    chain = rotor_base(spindle, solve(spindle, Condition(20.0, rpm * RPM), still))
    linear = matrices(chain)
    rows, hammers = point_rows(spindle, chain), point_rows(spindle, chain, (1, 2))
    frequency = np.array([400.0, 1002.0, 1808.0, 4497.0, 6000.0])
    found = frf(linear, rows, hammers, frequency, kind)
    for i, w in enumerate(2 * np.pi * frequency):
        direct = rows @ np.linalg.solve(linear.stiffness - w**2 * linear.mass + 1j * w * linear.damping, hammers.T)
        direct *= (1j * w) ** ("receptance", "mobility", "accelerance").index(kind)
        assert found[:, :, i] == pytest.approx(direct, rel=1e-8, abs=1e-9 * np.abs(direct).max())


@pytest.mark.parametrize("offset", [0.0, 0.01])
@pytest.mark.parametrize("kind", ["receptance", "mobility", "accelerance"])
def test_what_nothing_holds_moves_as_a_free_body(kind, offset):
    """F = m a of a hub on bearings that have lost contact, beside a plate on a spring: poles at
    zero are double and have one vector, of which a sum over poles made 1e276."""
    mass, inertia, plate, spring = 0.018, 4e-6, 0.3, 1e7
    linear = Matrices(np.diag([mass, inertia, plate]), np.zeros((3, 3)), np.diag([0.0, 0.0, spring]), (("hub", "z"), ("hub", "tilt_x"), ("plate", "z")))
    assert poles(linear).parallel
    frequency = np.array([20.0, 500.0, 1000.0])
    s = 2j * np.pi * frequency
    row = np.array([1.0, offset, 0.0])
    found = frf(linear, np.stack([row, [0, 0, 1.0]]), row[None], frequency, kind)
    power = {"receptance": 0, "mobility": 1, "accelerance": 2}[kind]
    assert found[0, 0] == pytest.approx(s ** (power - 2) * (1 / mass + offset**2 / inertia), rel=1e-12)
    assert found[1, 0] == pytest.approx(np.zeros(3), abs=1e-12)


def test_heavily_damped_poles_keep_the_frf_exact():
    """A joint damped beyond critical has real poles, which the paired sum must not lose."""
    chain = tilting_rotor(0.0)
    damped = replace(chain, elements=(replace(chain.elements[0], damping=np.diag([0, 0, 0, 5.0, 0.01])),))
    linear = matrices(damped)
    assert np.sum(np.abs(poles(linear).value.imag) < 1e-9) == 2
    rows = np.eye(2)
    w = 2 * np.pi * 300
    direct = np.linalg.inv(linear.stiffness - w**2 * linear.mass + 1j * w * linear.damping)
    assert frf(linear, rows, rows, np.array([300.0]))[:, :, 0] == pytest.approx(direct, rel=1e-9)


@pytest.mark.parametrize("element", ELEMENTS)
@pytest.mark.parametrize("rpm", [0.0, 7200.0])
def test_mujoco_agrees_with_the_matrices(spindle, hot, element, rpm):
    """Both bearing elements linearise to the table's 5x5 matrices within 1e-6, spin and base included."""
    state = replace(hot, condition=Condition(60.0, rpm * RPM))
    chain = rotor_base(spindle, state)
    own, found = matrices(chain), mjcf.linearise(mjcf.spec(spindle, state, element).compile())
    assert found.dofs == own.dofs
    scale = np.sqrt(np.outer(np.diag(own.stiffness), np.diag(own.stiffness)))
    assert np.abs(found.mass - own.mass).max() < 1e-9 * own.mass.max()
    assert np.abs((found.stiffness - own.stiffness) / scale).max() < 1e-6
    assert np.abs(found.damping - own.damping).max() < 1e-9 * np.abs(own.damping).max()


@pytest.mark.parametrize("rpm", [0.0, 8000.0])
def test_rows_of_a_flexible_shaft_are_those_of_its_beam_model(rpm):
    """Five rows in two sets, ball by ball on a shaft of beams (`five_bearing`): within 1e-6 as the pair of a rigid hub is; 4e-10 at rest."""
    point = operating_point(load(ROOT / "scenes" / "five_bearing"), Condition(40.0, rpm * RPM))
    own, found = matrices(point.chain), mjcf.linearise(point.spec("ball-by-ball").compile())
    assert found.dofs == own.dofs
    scale = np.sqrt(np.outer(np.diag(own.stiffness), np.diag(own.stiffness)))
    assert np.abs((found.stiffness - own.stiffness) / scale).max() < 1e-6
    assert np.abs(found.mass - own.mass).max() < 1e-9 * own.mass.max()


@pytest.mark.parametrize("beam", ["timoshenko", "euler-bernoulli"])
def test_short_elements_without_rotary_inertia_have_none_in_mujoco(beam):
    """The least that MuJoCo wants of a body was there in directions that move, too: five times what the nodes of 15 mm have."""
    file = ROOT / "scenes" / "templates" / "rotor.toml"
    raw = tomllib.loads(file.read_text(encoding="utf-8"))
    raw["shafts"][0] |= {"beam": beam, "longest_element_mm": 15.0}
    point = operating_point(build(raw, file), Condition(20.0, 3000 * RPM))
    own, found = matrices(point.chain), mjcf.linearise(point.model)
    assert np.diag(found.mass) == pytest.approx(np.diag(own.mass), rel=1e-9)


@pytest.mark.parametrize("lower", [0.0, -0.5, -0.62], ids=["8 N", "1.8 N", "0.7 N"])
def test_balls_that_hardly_touch_are_linearised_as_well(spindle, lower):
    """Preload mounted too low leaves 0.13 um of deformation at 60 C, where a plain central difference by 2 nm is off by 1e-5."""
    preload = next(p for p in toleranced(spindle) if p.name == "preload")
    point = operating_point(preload.apply(spindle, lower), Condition(60.0))
    own, found = matrices(point.chain), mjcf.linearise(point.spec("ball-by-ball").compile())
    scale = np.sqrt(np.outer(np.diag(own.stiffness), np.diag(own.stiffness)))
    assert np.abs((found.stiffness - own.stiffness) / scale).max() < 1e-8


def test_the_saved_model_is_the_same_model(spindle, hot):
    """Ball-by-ball XML read back gives the same linearisation: six digits would not do."""
    spec = mjcf.spec(spindle, hot, "ball-by-ball")
    first = mjcf.linearise(spec.compile())
    again = mjcf.linearise(mujoco.MjModel.from_xml_string(mjcf.xml(spec)))
    assert again.stiffness == pytest.approx(first.stiffness, rel=1e-9, abs=1e-6)


def undamped(state):
    return replace(state, bearings=tuple(replace(b, damping=NONE) for b in state.bearings))


@pytest.mark.parametrize("element", ELEMENTS)
def test_energy_is_conserved_without_damping(spindle, cold, element):
    """A blow on the spinning, undamped spindle: RK4 keeps kinetic plus elastic energy to 1e-6 over 5 ms."""
    joints = tuple(replace(j, damping_ratio=0.0) for j in spindle.structure.joints)
    still = replace(spindle, structure=replace(spindle.structure, joints=joints))
    spec = mjcf.spec(still, undamped(replace(cold, condition=Condition(20.0, 7200 * RPM))), element)
    spec.option.enableflags |= int(mujoco.mjtEnableBit.mjENBL_ENERGY)
    spec.option.timestep = 1e-6
    model = spec.compile()
    data = mujoco.MjData(model)
    mujoco.mj_resetDataKeyframe(model, data, 0)
    mujoco.mj_forward(model, data)
    rest = data.energy.sum()
    data.qvel[[model.joint(f"hub.{m}").dofadr[0] for m in ("x", "z", "tilt_x")]] = 3e-3, 2e-3, 0.3
    mujoco.mj_forward(model, data)
    start = data.energy.sum() - rest
    assert start > 1e-7
    mujoco.mj_step(model, data, nstep=5000)
    mujoco.mj_forward(model, data)
    assert data.energy.sum() - rest == pytest.approx(start, rel=1e-4)


def test_a_ball_cannot_push(spindle, cold):
    """Hub pressed far to one side: the ball-by-ball model loses contact there and is softer than its tangent says."""
    model = mjcf.spec(spindle, cold, "ball-by-ball").compile()
    data = mujoco.MjData(model)
    data.qpos[model.joint("hub.x").qposadr[0]] = 3e-6
    mujoco.mj_forward(model, data)
    balls = [model.tendon(f"{b}.ball{j}").id for b in ("lower", "upper") for j in range(10)]
    slack = data.ten_length[balls] < model.tendon_lengthspring[balls, 1]
    assert 0 < slack.sum() < 20
    linear = mjcf.spec(spindle, cold, "linear").compile()
    other = mujoco.MjData(linear)
    other.qpos[linear.joint("hub.x").qposadr[0]] = 3e-6
    mujoco.mj_forward(linear, other)
    hub = model.joint("hub.x").dofadr[0]
    assert abs(data.qfrc_spring[hub] / other.qfrc_spring[hub] - 1) > 0.02


# ---------------------------------------------------------------- a ring on its preload spring


def behind_a_spring(spindle, rate, mass=0.0):
    return sprung(spindle, "upper", rate, mass)


def axial_stiffness(chain):
    """Between shaft and hub, all rings massless: force for a unit axial movement of the hub with everything else held."""
    k = matrices(chain).stiffness
    hub = chain.dofs.index(("hub", "z"))
    free = [i for i, (name, _) in enumerate(chain.dofs) if "sprung ring" in name]
    if not free:
        return k[hub, hub]
    return k[hub, hub] - k[hub, free] @ np.linalg.solve(k[np.ix_(free, free)], k[free, hub])


def test_spring_and_bearing_stand_in_series(spindle, cold):
    lower, upper = (b.stiffness[2, 2] for b in cold.bearings)
    for rate in (1e4, 5e6):
        expected = lower + upper * rate / (upper + rate)
        for mass in (0.0, 0.4e-3):
            chain = rotor_base(behind_a_spring(spindle, rate, mass), cold)
            assert axial_stiffness(chain) == pytest.approx(expected, rel=1e-12)
    assert axial_stiffness(rotor_base(behind_a_spring(spindle, None), cold)) == pytest.approx(lower + upper, rel=1e-12)


def test_the_rings_own_mode_and_the_rest_unmoved(spindle, cold):
    """A ring between spring and balls: sqrt((k_s + k_b) / m) once everything else is heavy; tilts and radial motion know no spring."""
    mass, rate = 0.4e-3, 5e6
    chain = rotor_base(behind_a_spring(spindle, rate, mass), cold)
    found = max((m for m in modes(chain) if m.kind == "axial"), key=lambda m: m.frequency)
    alone = np.sqrt((rate + cold.bearing("upper").stiffness[2, 2]) / mass) / (2 * np.pi)
    assert found.frequency == pytest.approx(alone, rel=0.02)
    plain, k = matrices(rotor_base(spindle, cold)), matrices(chain).stiffness
    for i, (body, move) in enumerate(plain.dofs):
        for j, (other, with_) in enumerate(plain.dofs):
            if move != "z" and with_ != "z":
                assert k[i, j] == pytest.approx(plain.stiffness[i, j], rel=1e-12, abs=1e-6), (body, other)


@pytest.mark.parametrize("mass", [0.0, 0.4e-3])
@pytest.mark.parametrize("element", mjcf.ELEMENTS)
def test_mujoco_has_the_sprung_ring_too(spindle, cold, mass, element):
    own = behind_a_spring(spindle, 5e6, mass)
    chain = rotor_base(own, cold)
    found, expected = mjcf.linearise(mjcf.spec(own, cold, element).compile()), matrices(chain)
    assert found.dofs == expected.dofs
    size = np.sqrt(np.abs(np.outer(np.diag(expected.stiffness), np.diag(expected.stiffness))))
    assert (np.abs(found.stiffness - expected.stiffness) <= 1e-6 * size).all()
    assert found.mass == pytest.approx(expected.mass, rel=1e-9, abs=1e-12)


def test_an_impossible_inertia_is_refused_and_not_clipped(spindle, cold):
    hub = spindle.structure.body("hub")
    odd = replace(hub, inertia=(hub.inertia[0], hub.inertia[1], 3 * hub.inertia[0]))
    chain = rotor_base(spindle, cold)
    with pytest.raises(ValueError, match=r"'hub' turns and has inertia .* which no body has"):
        mjcf.chain_spec(replace(chain, bodies=tuple(odd if b is hub else b for b in chain.bodies)), 1e-6)


@pytest.mark.parametrize("outer", ["housing", "ground"])
def test_a_ring_on_its_spring_may_slide_on_what_stands_still(outer):
    """A shaft of 2 kg on a bearing whose ring of 0.1 kg slides on a spring: two masses and two
    springs in a row, whatever carries the spring; the ground is no body."""
    bodies = [Body("shaft", 2.0, (1.0, 1.0, 1.0), 0.0, ("z",), False, ())]
    if outer != "ground":
        bodies.append(Body(outer, 1.0, (1.0, 1.0, 1.0), 0.0, (), False, ()))
    bearing = Element("b", "bearings", "shaft", outer, 0.0, np.diag([0.0, 0.0, 5e7, 0.0, 0.0]), np.zeros((5, 5)))
    found = matrices(on_a_spring(RotorBase(tuple(bodies), (bearing,), 0.0), ["b"], 1e6, 0.1))
    assert found.dofs == (("shaft", "z"), ("b sprung ring", "z"))
    assert found.mass == pytest.approx(np.diag([2.0, 0.1]))
    assert found.stiffness == pytest.approx(np.array([[5e7, -5e7], [-5e7, 5.1e7]]))
