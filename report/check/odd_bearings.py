"""What is odd about the bearings of a scene, and what holds or presses them."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from itertools import combinations

import numpy as np

from thermospindle.model import sense
from thermospindle.model.bearing.definitions import ToldAngle
from thermospindle.model.bearing.movement import balances
from thermospindle.model.bearing.pressure import OF_BALLS, OF_ROLLERS, pressures
from thermospindle.model.bearing.roller import RollerState
from thermospindle.model.errors import listed
from thermospindle.model.machine import Bearing, Condition, LinearBearing
from thermospindle.model.shaft import SAME_HEIGHT
from thermospindle.model.units import MM, RPM
from thermospindle.report.check.looked import Looked
from thermospindle.report.check.understood import free_angle

CONFORMITY = (0.505, 0.58)
"""Groove radius over ball diameter of bearings that are made: 0.515 to 0.53 mostly (Harris, Rolling Bearing Analysis, ch. 2)."""
OF_CATALOGUE = (0.51, 0.55)
"""The same where it follows from a catalogue; of spindle bearings with balls as they are made it is 0.52 to 0.535."""
STIFFER = 1.3
"""Times Hertz' load-deflection constant, by which a catalogue's may differ either way: its rounding and models leave a tenth."""
CONTACT_ANGLE = (5.0, 60.0)
"""Degrees: deep-groove bearings have 8 to 15 of their clearance, angular contact ones 12 to 40, thrust ones 60."""
TIGHTEST, LOOSEST = -1.2e-4, 1e-3
"""Of the pitch diameter, between which mounted clearances lie: N and NN rows of machine tools are
set to between -5 and 5 um at 100 to 150 mm, and C3 of such a size is 90 um."""
OFF_MIDDLE = 0.4
"""Ball diameters by which the pitch diameter may differ from the middle of the raceways: those are
drawn as shoulders, or to the groove's bottom."""
SOFTEST = 1e3
"""N/m: a tenth of a millimetre changes the force of a softer spring by 0.1 N at most."""
SAG = 1.0 * MM
"""By which the weight of what turns would sink on one bearing alone: more than any gap between what
turns and what stands, and seals and motors would rub."""
GRAVITY = 9.81
HEAVY = 0.5e6
"""mm rev/min, speed times pitch diameter, from which balls are commonly taken with their inertia:
what grease allows (Harris, Rolling Bearing Analysis, ch. 8, on high speed)."""


def _loose(found: Looked) -> Iterator[str]:
    for state in found.reference.state.linear:
        if isinstance(state, RollerState) and state.load == 0.0:
            yield f"bearing {state.name}: its rollers are loose by {1e6 * state.clearance:.3g} um, and no load presses them: it carries nothing"


def _clearances(found: Looked) -> Iterator[str]:
    """Roller rows whose mounted clearance is of another order than such bearings have."""
    for b in found.spindle.roller_bearings:
        share = b.clearance / b.pitch_diameter
        if not TIGHTEST < share < LOOSEST:
            yield (
                f"bearing {b.name}: mounted_clearance_um = {1e6 * b.clearance:g} is {abs(share):.2g} of its pitch diameter; mounted rollers have between 0.1 of a thousandth "
                "of preload and a thousandth of clearance: a diametral clearance in um?"
            )


def _massless(found: Looked) -> Iterator[str]:
    """Balls without inertia at a speed at which they have too much of it to be left out."""
    spindle = found.reference.spindle
    reached = {b.name: sense.speed_factor(spindle, b, spindle.nominal_speed) for b in spindle.bearings}
    fast = [name for name, factor in reached.items() if factor > HEAVY]
    if fast and not spindle.ball_inertia:
        key = "bearing_pair.ball_inertia" if "bearing_pair.preload_N" in spindle.provenance else "ball_inertia"
        yield (
            f"{key} = 0: the balls of {listed(fast)} have no centrifugal force and no gyroscopic moment, so that speed changes no bearing; at the nominal speed, a speed factor n dm of "
            f"{max(reached.values()):.2g} mm rev/min, they count: 1 takes them in"
        )


def _same_place(found: Looked) -> Iterator[str]:
    carrier = found.spindle.structure.carrier
    for a, b in combinations(found.spindle.all_bearings, 2):
        same = {carrier(a.inner_body), carrier(a.outer_body)} == {carrier(b.inner_body), carrier(b.outer_body)}
        if same and abs(a.z - b.z) < 0.1 * MM:
            yield f"bearings {a.name} and {b.name} sit at the same place, z_mm = {a.z / MM:g}, between the same parts: one of them may be meant elsewhere"


def _raceways(found: Looked) -> Iterator[str]:
    """Raceways told wider than what is left of a ring about them."""
    for b in found.spindle.ringed:
        for ring in (b.inner_ring, b.outer_ring):
            low, high = found.spindle.region(ring).z
            if b.raceway_width is not None and (b.z - b.raceway_width / 2 < low - SAME_HEIGHT or b.z + b.raceway_width / 2 > high + SAME_HEIGHT):
                yield (
                    f"bearing {b.name}: a raceway of {b.raceway_width / MM:g} mm about z_mm = {b.z / MM:g} goes beyond its ring {ring!r}, which spans {low / MM:g} to {high / MM:g}, "
                    "and is taken to end there"
                )


def _contacts(found: Looked) -> Iterator[str]:
    for b in found.spindle.bearings:
        for ring, value in (("inner", b.inner_conformity), ("outer", b.outer_conformity)):
            if b.constant_factor == 1.0 and not CONFORMITY[0] <= value <= CONFORMITY[1]:
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


def _catalogues(found: Looked) -> Iterator[str]:
    """Balls that a catalogue's preload, unloading force and axial rigidity do not fit; once a row
    of the scene's, whatever bearings have it."""
    of: dict[str, list[Bearing]] = {}
    for b in found.spindle.bearings:
        if b.constant_factor != 1.0:
            of.setdefault(b.told.row if b.told else b.name, []).append(b)
    for row, own in of.items():
        b, off = own[0], []
        if not 1 / STIFFER < b.constant_factor < STIFFER:
            off.append(f"contacts {b.constant_factor:.2g} times as stiff as Hertz has them of {b.balls} balls of {b.ball_diameter / MM:g} mm")
        if not OF_CATALOGUE[0] < b.inner_conformity < OF_CATALOGUE[1]:
            off.append(f"grooves of a radius of {b.inner_conformity:.3g} ball diameters, and bearings have 0.52 to 0.535")
        if off:
            yield (
                f"ball_rows.{row}.catalogue, of {', '.join(b.name for b in own)}: preload, unloading force and axial rigidity ask for {listed(off)}: "
                "number, diameter or material of the balls, or the catalogue's numbers, are of another bearing"
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
    yield from (f"bearing {b.name} carries nothing at the reference temperature, at rest" for b in found.reference.state.bearings if not b.in_contact)
    for state in (found.hot, found.turning):
        if isinstance(state, str):
            if state:
                yield f"no state {state}"
            continue
        where = f"at {state.condition.temperature:g} C" + (f" and {state.condition.speed / RPM:.0f} rpm" if state.condition.speed else "")
        pairs = [(b, state.state.bearing(b.name)) for b in found.reference.state.bearings if b.in_contact]
        yield from (f"bearing {b.name} has lost contact {where}" for b, now in pairs if not now.in_contact)
        for what, far in (("less than half", lambda ratio: ratio < 0.5), ("more than twice", lambda ratio: ratio > 2.0)):
            moved = [f"{b.name} {now.preload:.3g} of {b.preload:.3g} N" for b, now in pairs if now.in_contact and far(now.preload / b.preload)]
            if moved:
                yield f"{where} the preload is {what} that of the reference: {', '.join(moved)}"


def _pitch(found: Looked) -> Iterator[str]:
    """Balls whose circle is not between the raceways of the section."""
    for b in found.spindle.bearings:
        inner, outer = found.spindle.region(b.inner_ring).r[1], found.spindle.region(b.outer_ring).r[0]
        if abs(b.pitch_diameter - inner - outer) > OFF_MIDDLE * b.ball_diameter:
            yield (
                f"bearing {b.name}: pitch_diameter_mm = {b.pitch_diameter / MM:g}, and its rings leave the balls a circle of {(inner + outer) / MM:.4g} mm, between {inner / MM:g} and {outer / MM:g} mm of "
                "radius: is it the pitch diameter of another bearing?"
            )


def _springs(found: Looked) -> Iterator[str]:
    """Springs that keep a force whatever is asked of them, in which a unit may be another."""
    for s in found.spindle.sets:
        if s.spring is not None and s.spring.rate is not None and s.spring.rate < SOFTEST:
            yield f"set {s.name}: its spring has a rate of {s.spring.rate:g} N/m, which keeps its force whatever the rings do; preload springs have 1e4 to 1e8, and 2 N/um are 2e6 N/m"


def _half_sprung(found: Looked) -> Iterator[str]:
    """Rows that are loaded the same way, of which the spring moves some."""
    for s in found.spindle.sets:
        own = [found.spindle.bearing(n) for n in s.bearings]
        on = {b.name for b in own if s.spring is not None and b.name in s.spring.rings_of}
        beside = [b.name for b in own if b.name not in on and any(b.sense == found.spindle.bearing(n).sense for n in on)]
        if beside:
            yield f"set {s.name}: {listed(beside)} {'is' if len(beside) == 1 else 'are'} loaded the same way as {listed(sorted(on))}, and only the latter on the spring; sprung_bearings names all rows whose rings slide together"


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
    for group in balances(spindle):
        own = set(group.names)
        one_way = [s for s in spindle.sets if s.bearings[0] in own and spindle.one_way(s)]
        if not sum(spindle.bearing(s.bearings[0]).sense * s.preload for s in one_way):
            continue
        for s in (s for s in one_way if s.spring is not None):
            others = [name for name in group.names if name not in s.bearings]
            if others:
                push = spindle.bearing(s.bearings[0]).sense * s.preload
                yield (
                    f"set {s.name}: the {s.preload:g} N of its spring are held from outside, and nothing of them reaches {', '.join(others)}; "
                    f"axial_load_N = {-push:g} takes that outer force away, so that they hold the spring"
                )


def _sense(found: Looked) -> Iterator[str]:
    spindle = found.spindle
    yield from sense.of_conditions(spindle, [*(Condition(t) for t in (spindle.reference_temperature, *spindle.temperatures)), Condition(spindle.temperatures[0], spindle.nominal_speed)])
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


OF_BEARINGS: tuple[Callable[[Looked], Iterator[str]], ...] = (_loose, _clearances, _massless, _same_place, _raceways, _contacts, _angles, _catalogues, _soft, _preload, _pitch, _springs, _half_sprung, _pressed, _pushed, _sense, _tables)
