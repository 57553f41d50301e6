"""What a fit may move beside the effects asked about: build tolerances, measuring errors, and how a model is constantly a little wrong.

Every nuisance parameter is counted in its own prior standard deviations, so that all priors are N(0, 1) at the reference widths.

`stiffness discrepancy` and `damping discrepancy` are the model's own constant errors (Kennedy & O'Hagan, *J. R. Statist. Soc. B* 63
(2001) 425), as a random symmetric matrix in the coordinates of the reference modes (Soize, *Probab. Eng. Mech.* 15 (2000) 277): K +
sum_ij e_ij w_i w_j (M f_i)(M f_j)^T with mass-normalised modes f of the reference condition. It is the same at every condition: it
moves frequencies and mixes shapes, never their changes, and it is smooth where modes coincide. A drifting discrepancy is a much
smaller one of each mode in each test: what laws that hold only nearly leave. The size of each is learned from the data.

Bearings differ among themselves: each has a stiffness and a damping of its own about those that all share with the drawing,
within the scene's tolerances. A constant discrepancy of modes cannot stand in for that: bearings soften with speed, and what one
of two is off by with them. So it is with how stiff balls are along the axis and in tilt beside across it, in which two honest
programs differ by a per cent or two: where the forces of a row are said to act, and what the races give. And what temperature
does to a contact, and speed to its balls, is known as far as the model of a bearing holds: a little of it is wrong, as much as
the data ask for, and not the same of each row. Balls orbit with their cage here, and each by itself in most programs.

A light resonance is one that the drawing lacks, of the table, a fixture or a cable: an oscillator
on some point of the machine, wherever that is, and so given by how much of it each reference mode
carries along. It is looked for where the data show the same misfit in every test.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from thermospindle.diagnosis.parameters.masses import mass_terms
from thermospindle.diagnosis.parameters.reference import ReferenceModes
from thermospindle.model.built.tolerance import LEAST, MOST, Toleranced
from thermospindle.model.machine import Spindle
from thermospindle.model.shaft import Shaft
from thermospindle.model.structure import MOVES
from thermospindle.model.types import Array

BUILD, TEMPERATURE, GAIN, DRIFT, EXPANSION = "build", "temperature", "gain", "gain drift", "thermal expansion"
COEFFICIENT, COEFFICIENT_SD = "coefficient of expansion", 0.01
"""Relative, of each material, the same at all temperatures: what tables give of one alloy differs by a per cent or two."""
APART = "stiffness apart", "damping apart"  # of bearings
HAMMER, HAMMER_DRIFT = "gain of a hammer", "drift of a hammer's gain"
"""Of the force at each hammer's point, in all tests and from test to test: its calibration, and the
cosine of how askew it hits (5 degrees are 0.4 %)."""
MISS, MISS_DRIFT, MISS_SD, MISS_DRIFT_SD = "miss of a hammer", "drift of a hammer's miss", 2e-4, 1e-4
"""How far (m) from its point a hammer hits on the mean: in all tests, and from test to test at the reference width.
By hand a tip meets its mark to some tenths of a millimetre, which at a radius of 12 mm is a per cent of the moment."""
WAYS = ("outwards, or upwards on a side", "around the axis")
PLACE, PLACE_SD = "place of a sensor", 3e-4
"""How far (m) a sensor sits from its point, the same in all tests: glued or aimed by eye, to some tenths of a millimetre."""
ASKEW, ASKEW_SD = "direction of a sensor", 0.02
"""By how much (rad) it is turned out of its direction, the same in all tests: a degree of glueing, and a transverse
sensitivity of one to three per cent by accelerometers' data sheets (at most 5 % is usual), which is the same to an FRF."""
LATE, LATE_SD = "delay of a channel", 2e-8
"""How much later (s) it is than the force, the same in all tests: of modules made for it two
channels differ by some thousandths of a degree a kHz, and by 0.045 (0.125 us) at most."""
BALLS = "stiffness of the balls"
FLUNG, FLUNG_SD = "inertia loads of the balls", 0.1
"""Relative, of centrifugal force and gyroscopic moment together: cage speeds by different assumptions (one race's control, both
contact angles, the half sum) differ by some per cent, and forces by twice that (Harris, *Rolling Bearing Analysis*, 1991, ch. 8)."""
BALLS_SD = 0.01  # in one direction beside that across the axis
DIRECTIONS = (("axial", (2,)), ("tilt", (3, 4)))
CHANGE, CHANGE_SD = "change of the balls' stiffness", 0.03
"""Relative, at the reference width, of what the balls' inertia does to their stiffness at speed:
where centrifugal force and gyroscopic moment are put, beside how large they are."""
CHANGES = ("across the axis", "along it and in tilt", "in tilt alone", "between tilt and moves across")
"""How all rows may be off alike, by number, the last two at speed alone; each row by itself follows, by its number and
theirs. Forces on heavy balls have no one line of action, and at what arm they tilt a ring programs differ in by a
thousandth (of the front rows of an internal grinding spindle at 45,000 rpm 0.6e-3 and 1.6e-3, where moves agree to 1e-7)."""
WITHOUT_SPEED = 2  # of these
CHANGE_APART = 0.3
"""Of it, of each row by itself: rows of other sizes and loads are not off by the same."""
ORBITS, ORBITS_SD = "orbits of the balls", 1.0
"""How far every ball orbits as fast as it rolls by itself (1), where here those of a row go with
its cage (0): most programs have the one (Jones 1960), and no row is either. Of the front rows of an
internal grinding spindle at 45,000 rpm it takes 5 % of the radial stiffness."""
CONTACT_SD = 1e-3
"""Relative, over `RANGE_K` and at the reference width of `CHANGE`, of what temperature does to the
contact itself, beside the load on it. Two honest programs keep the contact's constant, or let its
groove grow away from its ball: of ceramic balls in steel that is a thousandth."""
CONTACT_APART = 0.3  # of it, in each test by itself
LAW, LAW_SD = "law of the damping", 1.0
"""How far what is lost does not grow with frequency (1), where dampers lose in proportion to it (0), and loss factors are dampers of
each mode here: programs in the frequency domain have a complex stiffness, and most structures and joints lose as one (Bishop 1955)."""
LAWS = ("loss factors", "dampers")
UNEVEN = "stiffness of a joint uneven"  # about the axis
MASSES = "distribution of mass"  # of a rigid body, where no tolerance holds it
RECORD = "end of records"
RESONANCE = "light resonance"
STIFFNESS, DAMPING = "stiffness discrepancy", "damping discrepancy"
STIFFNESS_DRIFT, DAMPING_DRIFT = "drifting stiffness discrepancy", "drifting damping discrepancy"
DISCREPANCIES = (STIFFNESS, DAMPING, STIFFNESS_DRIFT, DAMPING_DRIFT)
STIFFNESS_SD = 1e-3  # relative error of a frequency at the reference width
DAMPING_SD = 0.03  # relative error of a damping ratio at the reference width
STIFFNESS_DRIFT_SD, DAMPING_DRIFT_SD = 1e-4, 0.01  # of one mode in one test, at the reference width
ACTION, OF_CONDITIONS = "action of effects", "action of temperature and speed"
"""No kinds of nuisances, but sizes that are learned: by what share effects, and temperature and
speed by themselves, do to a mode other than the model says."""
UNWRITTEN = (BALLS, *APART, UNEVEN, MASSES, EXPANSION, COEFFICIENT, FLUNG, ORBITS, CHANGE, STIFFNESS_DRIFT, DAMPING_DRIFT)
"""How a spindle may differ from its drawing without a place in the table `build` of a scene."""
DRIFT_SD = 1e-3  # of one channel's gain from test to test, at the reference width
SHARE_SD = 0.03  # root of the mass that a mode carries along in a light resonance, over its own modal mass
RESONANCE_SD = (0.02, 0.5)  # relative, of its frequency and of its damping ratio, about where it was seen
DRIFTS_SD = {False: 0.005, True: 0.02}  # of what ln frequency changes by with temperature: of a table, and of one that was seen to move
RANGE_K = 40.0  # over which that is told
EXPANSION_SD = {"radial motion of the rings": 3e-3, "axial motion of the rings": 3e-3, "growth of the grooves": 0.03}
"""Relative errors of thermal motions, the same at all temperatures, at the reference width: two honest finite-element
programs differ by a thousandth in the motions, and in whether a groove grows with its ring's free strain or follows
its face. What a ball gives for a movement is off by a per cent or two, so that how wide they are is learned (`ODDS`)."""


@dataclass(frozen=True)
class Nuisance:
    """One nuisance parameter; `sd` is one prior standard deviation in its own unit (relative or K).

    `index` is the number of the toleranced parameter (build), of the bearing (apart), the unevenness, the channel (gain and delay:
    sensors in the order in which tests first have them), the hammer, of a miss twice that and its way, of a sensor's place and direction
    four times its channel and one of four ways, the material (`Spindle.used_materials`), or unused; `modes` the pair of a discrepancy.
    """

    kind: str
    name: str
    sd: float
    test: int | None = None
    index: int = -1
    modes: tuple[int, int] = (-1, -1)

    def at(self, x: float) -> float:
        """Its value at `x` prior standard deviations; of a mass or a stiffness a tenth is left at least."""
        return float(np.clip(float(x) * self.sd, LEAST, MOST)) if self.kind == BUILD else float(x) * self.sd


@dataclass(frozen=True, eq=False)
class Unevenness:
    """How what is drawn alike may be built: joints whose stiffness is K + (P K + K P) / 2 times its
    share, to first order, with a `pattern` P (5, 5) each; `sd` is that of the share."""

    name: str
    sd: float
    patterns: tuple[tuple[str, Array], ...]


def unevennesses(spindle: Spindle) -> tuple[Unevenness, ...]:
    """Of every joint whose stiffness is drawn alike against both moves across the axis, or both tilts:
    no joint is built so. It is stiffer against one of the two, or against their sum. And of shafts that
    bend, section by section, whose steps and fits stiffen them otherwise than their diameters say."""
    found = []
    for joint in spindle.structure.own_joints:
        for first, second in ((0, 1), (3, 4)):
            if joint.stiffness[first] == joint.stiffness[second] > 0:
                one, other = (MOVES[m].replace("_", " ") for m in (first, second))
                plain, turned = np.zeros((2, 5, 5))
                plain[first, first], plain[second, second] = 1.0, -1.0
                turned[first, second] = turned[second, first] = 1.0
                sd = spindle.tolerances.structure / np.sqrt(2)  # of two that are off by as much each
                found += [
                    Unevenness(f"{joint.name} stiffer against {one} than {other}", sd, ((joint.name, plain),)),
                    Unevenness(f"{joint.name} stiffer against {one} + {other} than {one} - {other}", sd, ((joint.name, turned),)),
                ]
    return (*found, *(u for s in spindle.structure.shafts for u in _sections(s, spindle)))


def _sections(shaft: Shaft, spindle: Spindle) -> list[Unevenness]:
    """Of each segment of a shaft of several."""
    centre = {name: (a + b) / 2 for name, a, b in zip(shaft.elements, shaft.nodes, shaft.nodes[1:], strict=False)}
    found = []
    for n, segment in enumerate(shaft.segments, 1):
        low, high = segment.z
        own = tuple((name, np.eye(5)) for name, z in centre.items() if low <= z < high)
        if own and len(own) < len(centre):
            found.append(Unevenness(f"segment {n} of {shaft.name} stiffer", spindle.tolerances.structure, own))
    return found


@dataclass(frozen=True)
class Resonance:
    """A light resonance as it was seen, about which its parameters move: frequency in Hz at the reference temperature,
    damping ratio, and the roots of the masses that the first reference modes carry along in it, over their modal
    masses; `drift` is what ln frequency changes by over `RANGE_K`, in a straight line and with the square."""

    frequency: float
    damping: float
    shares: tuple[float, ...]
    drift: tuple[float, float] = (0.0, 0.0)

    @property
    def nuisances(self) -> tuple[Nuisance, ...]:
        """The share of each mode, its frequency, its damping and how its frequency drifts with temperature."""
        of = f"of the light resonance near {self.frequency:.0f} Hz"
        shares = [Nuisance(RESONANCE, f"share in mode {i + 1} {of}", SHARE_SD) for i in range(len(self.shares))]
        drifts = (DRIFTS_SD[any(self.drift)],) * 2
        shape = zip((f"frequency {of}", f"damping {of}", f"drift {of}", f"bent drift {of}"), (*RESONANCE_SD, *drifts), strict=True)
        return (*shares, *(Nuisance(RESONANCE, name, sd) for name, sd in shape))

    def at(self, values: Array) -> Resonance:
        """At `values` (k + 4,) of its parameters, in their units."""
        k = len(self.shares)
        shares = tuple(float(a + v) for a, v in zip(self.shares, values[:k], strict=True))
        frequency, damping = (float(v) for v in np.array([self.frequency, self.damping]) * np.exp(values[k : k + 2]))
        return Resonance(frequency, damping, shares, (self.drift[0] + float(values[k + 2]), self.drift[1] + float(values[k + 3])))

    def frequency_at(self, far: float) -> float:
        """Its frequency (Hz) so `far` from the reference temperature, in `RANGE_K`."""
        return self.frequency * float(np.exp(self.drift[0] * far + self.drift[1] * far**2))


def changes_of(tests: Sequence[str], far: Sequence[float], rows: Sequence[str], faster: Sequence[Array]) -> list[Nuisance]:
    """By what the change of the balls' stiffness may be off in tests so `far` (`RANGE_K`) from the
    reference temperature, where speed makes that of each of the `rows` `faster` (rows,) (relative) another."""
    found = [Nuisance(CHANGE, f"{CHANGE} with temperature", CONTACT_SD)] if any(far) else []
    for t, (name, f, n) in enumerate(zip(tests, far, faster, strict=True)):
        if sd := CONTACT_APART * CONTACT_SD * abs(f) + CHANGE_SD * abs(float(np.mean(n))):
            found += [Nuisance(CHANGE, f"{CHANGE} {way} in {name}", sd, t, i) for i, way in enumerate(CHANGES if np.any(n) else CHANGES[:WITHOUT_SPEED])]
        if len(rows) > 1 and np.any(n):
            found += [Nuisance(CHANGE, f"{CHANGE} of {row} in {name}", CHANGE_APART * CHANGE_SD * abs(float(k)), t, len(CHANGES) + i) for i, (row, k) in enumerate(zip(rows, n, strict=True))]
    return found


def nuisances(
    spindle: Spindle, build: Sequence[Toleranced], tests: Sequence[str], with_lines: bool, channels: int, hammers: int, modes: ReferenceModes, changes: Sequence[Nuisance] = ()
) -> tuple[Nuisance, ...]:
    """All nuisance parameters of a campaign with `tests` (ids): those of FRF lines only where a
    test has any, `changes` of the balls' stiffness among them (`changes_of`)."""
    t = spindle.tolerances
    found = [Nuisance(BUILD, p.name, p.sd, index=i) for i, p in enumerate(build)]
    found += [Nuisance(EXPANSION, name, sd, index=i) for i, (name, sd) in enumerate(EXPANSION_SD.items())]
    if spindle.ringed:
        found += [Nuisance(COEFFICIENT, f"expansion of {name}", COEFFICIENT_SD, index=i) for i, name in enumerate(spindle.used_materials)]
    every = [b.name for b in spindle.all_bearings]
    for kind, own, sd in zip(APART, ([b.name for b in spindle.rolling], every), (t.structure, t.damping), strict=True):  # given ones have stiffnesses of their own
        if len(own) > 1:
            found += [Nuisance(kind, f"{kind.removesuffix(' apart')} of {b} beside the others", sd, index=every.index(b)) for b in own]
    if spindle.bearings:
        found += [Nuisance(BALLS, f"{name} stiffness of the balls", BALLS_SD, index=i) for i, (name, _) in enumerate(DIRECTIONS)]
    found += changes
    if spindle.bearings and spindle.ball_inertia:
        found += [Nuisance(FLUNG, FLUNG, FLUNG_SD), Nuisance(ORBITS, ORBITS, ORBITS_SD)]
    found += [Nuisance(UNEVEN, u.name, u.sd, index=i) for i, u in enumerate(unevennesses(spindle))]
    found += [Nuisance(MASSES, m.name, m.sd) for m in mass_terms(spindle)]
    found += [Nuisance(TEMPERATURE, f"temperature of {name}", t.temperature, test=k) for k, name in enumerate(tests)]
    for i in range(len(modes.omega) if with_lines else modes.seen):
        for j in range(i, len(modes.omega) if with_lines else i + 1):
            of = f"mode {i + 1}" if i == j else f"modes {i + 1} and {j + 1}"
            found.append(Nuisance(STIFFNESS, f"stiffness discrepancy of {of}", STIFFNESS_SD, modes=(i, j)))
            if i < modes.seen:  # beyond the band a mode is a spring
                found.append(Nuisance(DAMPING, f"damping discrepancy of {of}", DAMPING_SD, modes=(i, j)))
    drifting = list(enumerate(tests)) if len(tests) > 1 else []  # one test shows no drift
    for k, name in drifting:
        for i in range(modes.seen):
            found.append(Nuisance(STIFFNESS_DRIFT, f"frequency of mode {i + 1} in {name}", STIFFNESS_DRIFT_SD, test=k, modes=(i, i)))
            found.append(Nuisance(DAMPING_DRIFT, f"damping of mode {i + 1} in {name}", DAMPING_DRIFT_SD, test=k, modes=(i, i)))
    if with_lines:
        found += [Nuisance(LAW, f"{LAW} of {which}", LAW_SD, index=i) for i, (which, there) in enumerate(zip(LAWS, _losses(spindle), strict=True)) if there]
        found += [Nuisance(GAIN, f"gain of channel {c + 1}", t.gain, index=c) for c in range(channels)]
        found += [Nuisance(DRIFT, f"gain of channel {c + 1} in {name}", DRIFT_SD, test=k, index=c) for k, name in drifting for c in range(channels)]
        found += [Nuisance(HAMMER, f"gain of hammer {h + 1}", t.gain, index=h) for h in range(hammers) if hammers > 1]  # of one alone that of all channels
        found += [Nuisance(HAMMER_DRIFT, f"gain of hammer {h + 1} in {name}", DRIFT_SD, test=k, index=h) for k, name in drifting for h in range(hammers)]
        for c in range(channels):
            found += [Nuisance(PLACE, f"place of channel {c + 1} {way}", PLACE_SD, index=4 * c + i) for i, way in enumerate(WAYS)]
            found += [Nuisance(ASKEW, f"direction of channel {c + 1} {way}", ASKEW_SD, index=4 * c + 2 + i) for i, way in enumerate(WAYS)]
            found.append(Nuisance(LATE, f"delay of channel {c + 1}", LATE_SD, index=c))
        ways = [(2 * h + i, f"miss of hammer {h + 1} {way}") for h in range(hammers) for i, way in enumerate(WAYS)]
        found += [Nuisance(MISS, of, MISS_SD, index=i) for i, of in ways]
        found += [Nuisance(MISS_DRIFT, f"{of} in {name}", MISS_DRIFT_SD, test=k, index=i) for k, name in drifting for i, of in ways]
        found.append(Nuisance(RECORD, "end of the records, before answers have died away", 1.0))
    return tuple(found)


def _losses(spindle: Spindle) -> tuple[bool, bool]:
    """Whether the scene has loss factors, and dampers."""
    joints = spindle.structure.joints
    return any(j.loss_factor for j in joints), any(j.damping_ratio for j in joints) or bool(spindle.all_bearings)
