"""What is odd about a scene: sentences that refuse nothing, each from one thing that can be computed with and is seldom meant."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from itertools import combinations, pairwise

import numpy as np

from thermospindle.model import sense
from thermospindle.model.bearing.definitions import ToldAngle
from thermospindle.model.bearing.pair import joined
from thermospindle.model.bearing.roller import RollerState
from thermospindle.model.errors import NoEquilibrium, OutsideRange
from thermospindle.model.machine import Condition, LinearBearing, Point, Spindle
from thermospindle.model.pressure import OF_BALLS, OF_ROLLERS, pressures
from thermospindle.model.rotor.static import FREE
from thermospindle.model.shaft import SAME_HEIGHT, Shaft
from thermospindle.model.units import MM, RPM
from thermospindle.report.check.understood import free_angle
from thermospindle.sim.effects import of_scene
from thermospindle.sim.effects.effect import refusal
from thermospindle.sim.hammer.pulse import pulse_duration
from thermospindle.sim.operating import OperatingPoint, operating_point

WEAK = 0.1
"""Share of its force at low frequency below which a hammer hardly excites: 20 dB."""
UNDAMPED = 1e-5
"""Damping ratio below which a record cannot show how a mode dies out: of metals, 1e-4 and more."""
NEAR = 0.05
"""Of the speed, within which a natural frequency is called critical."""
CONFORMITY = (0.505, 0.58)
"""Groove radius over ball diameter of bearings that are made: 0.515 to 0.53 mostly (Harris, Rolling Bearing Analysis, ch. 2)."""
CONTACT_ANGLE = (5.0, 60.0)
"""Degrees: deep-groove bearings have 8 to 15 of their clearance, angular contact ones 12 to 40, thrust ones 60."""
SAG = 1.0 * MM
"""By which the weight of what turns would sink on one bearing alone: more than any gap between what turns and what stands, and seals and motors would rub."""
GRAVITY = 9.81
LEAST_EXPANSION = 0.01
"""um/m K: glass ceramics such as Zerodur have 0.02, and whoever writes 1/K has 1e-5."""
LEAST_DENSITY = 100.0
"""kg/m3: foams have more, and whoever writes g/cm3 has 1 to 20."""
OFF = 1.0 * MM
"""How far from its body's surface a point may lie: sensors have bases."""
MANY_STEPS = 1e6
"""Of integration in a virtual hammer test, some minutes of computing for a flexible shaft."""


@dataclass(frozen=True)
class Looked:
    """A spindle at its reference temperature at rest, and in its hottest state at rest and turning; in words where there is none."""

    spindle: Spindle
    reference: OperatingPoint
    hot: OperatingPoint | str
    turning: OperatingPoint | str


def looked(spindle: Spindle, reference: OperatingPoint) -> Looked:
    """The states that the questions below are asked of."""
    hottest = max(spindle.temperatures, key=lambda t: abs(t - spindle.reference_temperature))

    def at(temperature: float, speed: float) -> OperatingPoint | str:
        try:
            return operating_point(spindle, Condition(temperature, speed))
        except (NoEquilibrium, OutsideRange) as error:
            return f"at {temperature:g} C and {speed / RPM:.0f} rpm: {error}"

    turns = any(b.turns for b in spindle.structure.bodies)
    return Looked(spindle, reference, at(hottest, 0.0), at(spindle.reference_temperature, spindle.nominal_speed) if turns else "")


def odd(found: Looked) -> list[str]:
    """All that is odd, each once."""
    return list(dict.fromkeys(words for question in QUESTIONS for words in question(found)))


# ---------------------------------------------------------------- bearings


def _loose(found: Looked) -> Iterator[str]:
    for state in found.reference.state.linear:
        if isinstance(state, RollerState) and state.load == 0.0:
            yield f"bearing {state.name}: its rollers are loose by {1e6 * state.clearance:.3g} um, and no load presses them: it carries nothing"


def _same_place(found: Looked) -> Iterator[str]:
    carrier = found.spindle.structure.carrier
    for a, b in combinations(found.spindle.all_bearings, 2):
        same = {carrier(a.inner_body), carrier(a.outer_body)} == {carrier(b.inner_body), carrier(b.outer_body)}
        if same and abs(a.z - b.z) < 0.1 * MM:
            yield f"bearings {a.name} and {b.name} sit at the same place, z_mm = {a.z / MM:g}, between the same parts: one of them may be meant elsewhere"


def _seats(found: Looked) -> Iterator[str]:
    shafts = {s.name: s for s in found.spindle.structure.shafts}
    for b in found.spindle.bearings:
        shaft = shafts.get(found.spindle.structure.carrier(b.inner_body))
        if shaft is not None:
            bore, radii = found.spindle.region(b.inner_ring).r[0], _radii(shaft, b.z)[1]
            seat = max(radii)
            if min(abs(bore - r) for r in radii) > 0.05 * seat:  # what carries mass may be the ring itself
                yield f"bearing {b.name}: its inner ring {b.inner_ring!r} begins at a radius of {bore / MM:g} mm, and the shaft {shaft.name!r} has {seat / MM:g} mm there"


def _contacts(found: Looked) -> Iterator[str]:
    for b in found.spindle.bearings:
        for ring, value in (("inner", b.inner_conformity), ("outer", b.outer_conformity)):
            if not CONFORMITY[0] <= value <= CONFORMITY[1]:
                yield f"bearing {b.name}: the {ring} groove's radius is {value:g} ball diameters; bearings have {CONFORMITY[0]:g} to {CONFORMITY[1]:g}"
        if free_angle(b, found.reference.state.bearing(b.name)) is None:
            yield f"bearing {b.name}: its contact angle under the preload means that the rings would press the balls without any; a larger angle, or more preload, is meant"


def _angles(found: Looked) -> Iterator[str]:
    """Once a row of the scene's, whatever bearings have it."""
    of: dict[ToldAngle, list[str]] = {}
    for b in found.spindle.bearings:
        if b.told is not None and not CONTACT_ANGLE[0] <= b.told.value <= CONTACT_ANGLE[1]:
            of.setdefault(b.told, []).append(b.name)
    for told, names in of.items():
        yield (
            f"ball_rows.{told.row}.{told.key} = {told.value:g}, of {', '.join(names)}: angular contact bearings have 12 to 40 degrees, thrust bearings 60, "
            "and deep-groove ones 8 to 15; the key takes degrees"
        )


def _soft(found: Looked) -> Iterator[str]:
    """Of a bearing given by numbers its stiffness across the axis where it has any, else along it."""
    weight = found.spindle.turning_mass * GRAVITY
    for b in found.spindle.linear_bearings:
        x, y, axial = np.reshape(b.stiffness, (-1, 5, 5))[:, range(3), range(3)].max(axis=0)
        stiffness, way = (max(x, y), "radial") if max(x, y) > 0 else (axial, "axial")
        if 0 < stiffness * SAG < weight:
            yield (
                f"bearing {b.name}: its {way} stiffness is {stiffness:g} N/m at most, on which the {found.spindle.turning_mass:.3g} kg that turn would sink by "
                f"{weight / stiffness / MM:.3g} mm; bearings give way by less than {SAG / MM:g} mm, so that another unit may be meant (2e7 N/m are 20 N/um)"
            )


def _preload(found: Looked) -> Iterator[str]:
    for state in (found.hot, found.turning):
        if isinstance(state, str):
            if state:
                yield f"no state {state}"
            continue
        where = f"at {state.condition.temperature:g} C" + (f" and {state.condition.speed / RPM:.0f} rpm" if state.condition.speed else "")
        pairs = [(b, state.state.bearing(b.name)) for b in found.reference.state.bearings]
        yield from (f"bearing {b.name} loses contact {where}" for b, now in pairs if not now.in_contact)
        for what, far in (("less than half", lambda ratio: ratio < 0.5), ("more than twice", lambda ratio: ratio > 2.0)):
            moved = [f"{b.name} {now.preload:.3g} of {b.preload:.3g} N" for b, now in pairs if now.in_contact and far(now.preload / b.preload)]
            if moved:
                yield f"{where} the preload is {what} that of the reference: {', '.join(moved)}"


def _pressed(found: Looked) -> Iterator[str]:
    """Of every bearing the state that presses it most."""
    states = [found.reference, *(p for p in (found.hot, found.turning) if not isinstance(p, str))]
    of = [pressures(p.spindle, p.state) for p in states]
    balls = {b.name for b in found.spindle.bearings}
    for name in of[0]:
        k = max(range(len(of)), key=lambda i: of[i][name])
        limit, what = (OF_BALLS, "balls") if name in balls else (OF_ROLLERS, "rollers")
        if of[k][name] > limit:
            at = states[k].condition
            yield (
                f"bearing {name}: its {what} press the races with {of[k][name] / 1e6:.0f} MPa at {at.temperature:g} C and {at.speed / RPM:.0f} rpm, under preload and the loads told; "
                f"{what} leave dents from {limit / 1e6:.0f} MPa, the static limit of ISO 76"
            )


def _pushed(found: Looked) -> Iterator[str]:
    """A spring behind rows that are all loaded one way pushes on what the other rows hold."""
    spindle = found.spindle
    if spindle.axial_load:
        return
    for group in joined(spindle):
        own = {b.name for b in group}
        one_way = [s for s in spindle.sets if s.bearings[0] in own and spindle.one_way(s)]
        if not sum(spindle.bearing(s.bearings[0]).sense * s.preload for s in one_way):
            continue
        for s in (s for s in one_way if s.spring is not None):
            others = [b.name for b in group if b.name not in s.bearings]
            if others:
                push = spindle.bearing(s.bearings[0]).sense * s.preload
                yield (
                    f"set {s.name}: the {s.preload:g} N of its spring are held from outside, and nothing of them reaches {', '.join(others)}; "
                    f"axial_load_N = {-push:g} takes that outer force away, so that they hold the spring"
                )


def _sense(found: Looked) -> Iterator[str]:
    spindle = found.spindle
    yield from sense.of_conditions(spindle, [*(Condition(t) for t in spindle.temperatures), Condition(spindle.temperatures[0], spindle.nominal_speed)])
    yield from sense.of_states(spindle, [p.state.bearings for p in (found.reference, found.hot, found.turning) if not isinstance(p, str)])


def _tables(found: Looked) -> Iterator[str]:
    spindle = found.spindle
    for b in spindle.linear_bearings:
        for what, unit, values, wanted in (
            ("temperatures", "C", b.temperature, spindle.temperatures),
            ("speeds", "rpm", tuple(s / RPM for s in b.speed), (0.0, spindle.nominal_speed / RPM)),
        ):
            if len(values) > 1 and (wanted[0] < values[0] - 1e-9 or wanted[1] > values[-1] + 1e-9):
                yield f"bearing {b.name}: its table holds {what} from {values[0]:g} to {values[-1]:g} {unit}, and the spindle runs from {wanted[0]:g} to {wanted[1]:g} {unit}"
    if spindle.linear_bearings and not spindle.bearings and not spindle.roller_bearings and all(_constant(b) for b in spindle.linear_bearings):
        yield "every bearing is given by constant numbers: temperature changes nothing here, and speed only what is gyroscopic"


def _constant(b: LinearBearing) -> bool:
    return len(b.temperature) * len(b.speed) == 1


def _materials(found: Looked) -> Iterator[str]:
    """Numbers that are of a material in other units than their keys'."""
    for m in found.spindle.materials.values():
        expansion = max(m.thermal_expansion.value) / 1e-6
        if expansion < LEAST_EXPANSION:
            yield f"material {m.name}: expands by {expansion:.2g} um/m in a kelvin, and even glass ceramics by 0.02; the key takes micrometres per metre and kelvin, of steel 11.5"
        if m.density < LEAST_DENSITY:
            yield f"material {m.name}: has {m.density:g} kg/m3, less than any solid part; of steel it is 7800"


# ---------------------------------------------------------------- structure


def _free(found: Looked) -> Iterator[str]:
    linear = found.reference.linear
    root = np.sqrt(np.diag(linear.mass))
    value = np.linalg.eigvalsh(linear.stiffness / np.outer(root, root))
    count = int(np.sum(value < FREE * value[-1]))
    if count:
        what = "a motion" if count == 1 else f"{count} motions"
        yield f"nothing holds the spindle against {what}, as of a shaft that hangs free or floats along its axis"


def _undamped(found: Looked) -> Iterator[str]:
    modes = [m for m in found.reference.modes if m.frequency <= found.spindle.hammer.band[1] and m.damping_ratio < UNDAMPED]
    if modes:
        yield f"{_count(len(modes), 'mode')} up to {found.spindle.hammer.band[1]:g} Hz {'is' if len(modes) == 1 else 'are'} undamped, the lowest at {modes[0].frequency:.0f} Hz: a record does not show how it dies out"


def _damping(found: Looked) -> Iterator[str]:
    for m in found.reference.modes:
        if m.frequency <= found.spindle.hammer.band[1] and m.damping_ratio > 0.3:
            yield f"the mode at {m.frequency:.0f} Hz is damped to {m.damping_ratio:.0%} of critical: a peak cannot be seen of it"


def _critical(found: Looked) -> Iterator[str]:
    if isinstance(found.turning, str):
        return
    speed = found.turning.condition.speed
    for m in found.turning.modes:
        if abs(m.frequency * 2 * np.pi / speed - 1) < NEAR:
            yield f"a natural frequency of {m.frequency:.0f} Hz lies at the nominal speed of {speed / RPM:.0f} rpm: unbalance drives it"


# ---------------------------------------------------------------- measuring


def _points(found: Looked) -> Iterator[str]:
    for p in found.spindle.points:
        distance = off(found.spindle, p)
        if distance > OFF:
            yield f"point {p.name}: lies {distance / MM:.3g} mm off {found.spindle.structure.carrier(p.body)!r}, which it is on"


def off(spindle: Spindle, p: Point) -> float:
    """Distance (m) of a point from its body; 0 on the axis, where sensors of plain models are, and where nothing is known of the body's shape."""
    r, z = float(np.hypot(*p.position[:2])), p.position[2]
    shaft = next((s for s in spindle.structure.shafts if p.body in s.bodies), None)
    if r == 0.0:
        return 0.0
    if shaft is not None and (sides := [s.sides for s in shaft.segments if s.sides and s.z[0] - SAME_HEIGHT <= z <= s.z[1] + SAME_HEIGHT]):
        return min(float(np.hypot(max(abs(p.position[0]) - w / 2, 0.0), max(abs(p.position[1]) - h / 2, 0.0))) for w, h in sides)
    if shaft is not None:
        inner, outer = _radii(shaft, z)
        return max(r - max(outer), min(inner) - r, 0.0)
    names = spindle.structure.body(p.body).regions
    spans = [(spindle.region(name).r, spindle.region(name).z) for name in names]
    return min((float(np.hypot(max(a[0] - r, r - a[1], 0.0), max(b[0] - z, z - b[1], 0.0))) for a, b in spans), default=0.0)


def _radii(shaft: Shaft, z: float) -> tuple[list[float], list[float]]:
    """Bore and outer radii (m) of a shaft at a height, of both pieces where two meet."""
    inner, outer = [], []
    for s in shaft.segments:
        if s.z[0] - SAME_HEIGHT <= z <= s.z[1] + SAME_HEIGHT:
            share = (z - s.z[0]) / (s.z[1] - s.z[0])
            inner.append(s.bore[0] + share * (s.bore[1] - s.bore[0]))
            outer += [a[0] + share * (a[1] - a[0]) for a in (s.outer, s.mass_outer)]
    return inner, outer


def _hammer(found: Looked) -> Iterator[str]:
    test = found.spindle.hammer
    low, high = test.band
    x = high * pulse_duration(test)
    if x >= 1.5:
        yield f"the hammer gives no force above {1.5 / pulse_duration(test):.0f} Hz, and its band goes to {high:g} Hz: a stiffer tip or a lighter hammer is needed"
    elif abs(np.cos(np.pi * x) / (1 - 4 * x**2) if abs(x - 0.5) > 1e-9 else np.pi / 4) < WEAK:
        yield f"at the upper end of its band, {high:g} Hz, the hammer gives less than a tenth of its force at low frequency"
    if pulse_duration(test) * test.sample_rate < 1:
        yield (
            f"the hammer's pulse of {1e6 * pulse_duration(test):.3g} us is shorter than a sample of {1e6 / test.sample_rate:.3g} us: records show its impulse, "
            f"and a lower peak than its {test.level:g} N; a softer tip or a higher sample_rate_Hz shows it"
        )
    inside = [m for m in found.reference.modes if low <= m.frequency <= high]
    if not inside:
        yield f"no natural frequency lies within the band of the hammer test, {low:g} to {high:g} Hz"
    below = [m for m in found.reference.modes if m.frequency < low]
    if below and inside:
        yield f"{_count(len(below), 'natural frequency', 'natural frequencies')} below the band of the hammer test, the lowest at {below[0].frequency:.0f} Hz: no test will show {'it' if len(below) == 1 else 'them'}"
    decay = min((m.damping_ratio * 2 * np.pi * m.frequency for m in inside if m.damping_ratio >= UNDAMPED), default=np.inf)
    if decay * test.record_length < 3 and test.exponential_end == 1.0:
        yield f"the slowest mode has not died out when the record of {test.record_length:g} s ends; a longer one, or an exponential window, is needed"
    steps = test.hits * len(test.hammer_nodes) * test.record_length / test.step
    if steps > MANY_STEPS and found.spindle.structure.shafts:
        yield f"a virtual hammer test takes {steps / 1e6:.1f} million steps of {1e6 * test.step:.2g} us, for the shortest elements of the shaft; longest_element_mm makes them longer"


def _running(found: Looked) -> Iterator[str]:
    spindle = found.spindle
    own = spindle.imperfections
    if any(b.turns for b in spindle.structure.bodies) and not (own.unbalance or own.couple_unbalance or own.bearings):
        yield "no imperfections are told, so that the turning spindle has no runout; imperfections.seed and grade draw plausible ones"
    turning = {b.name for b in spindle.structure.bodies if b.turns}
    for joint in spindle.structure.joints:
        for one, other in (joint.bodies, joint.bodies[::-1]):
            if one in turning and other not in turning:
                yield f"joint {joint.name}: {one!r} turns and {other!r} does not, so that what hangs on it has no gyroscopic moment"
    if spindle.regions and spindle.bearings and not spindle.thermal.sources and not spindle.thermal.convections:
        yield "nothing cools the section"


def _effects(found: Looked) -> Iterator[str]:
    for effect, _ in of_scene(found.spindle):
        if why := refusal(effect, found.spindle):
            yield f"effect {effect.name}: {why}"


def _sections(found: Looked) -> Iterator[str]:
    """Neighbouring diameters that differ so much that a beam is no longer one."""
    for shaft in found.spindle.structure.shafts:
        for a, b in pairwise(shaft.segments):
            if max(a.outer[1], b.outer[0]) > 4 * min(a.outer[1], b.outer[0]):
                yield f"shaft {shaft.name!r}: its diameter jumps from {2 * a.outer[1] / MM:g} to {2 * b.outer[0] / MM:g} mm at z_mm = {a.z[1] / MM:g}; a disc as a body of its own is nearer the truth"


def _count(n: int, one: str, many: str = "") -> str:
    return f"{n} {one}" if n == 1 else f"{n} {many or one + 's'}"


QUESTIONS: tuple[Callable[[Looked], Iterator[str]], ...] = (
    _loose, _same_place, _seats, _contacts, _angles, _soft, _materials, _preload, _pressed, _pushed, _sense, _tables, _free, _undamped, _damping, _critical, _sections, _points, _hammer, _running, _effects,
)  # fmt: skip
