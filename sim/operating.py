"""The operating point: from a spindle and a condition to bearing states and the linearised rotor-base chain."""

from __future__ import annotations

import reprlib
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from importlib.metadata import version
from itertools import pairwise
from numbers import Real

import mujoco
import numpy as np
import scipy
from numpy.typing import ArrayLike

from thermospindle.model import sense
from thermospindle.model.bearing.pair import PairState, solve
from thermospindle.model.bearing.pressure import pressures
from thermospindle.model.built.imperfections import Imperfections
from thermospindle.model.errors import BadInput, NoEquilibrium
from thermospindle.model.files.stiffness_table import StiffnessTable, tabulate
from thermospindle.model.machine import Condition, RingMotion, Spindle
from thermospindle.model.rotor import mjcf
from thermospindle.model.rotor.beam import at_temperature
from thermospindle.model.rotor.chain import Matrices, RotorBase, matrices, rotor_base
from thermospindle.model.rotor.distributed import spread
from thermospindle.model.rotor.frf import frf, point_rows
from thermospindle.model.rotor.loaded import loaded
from thermospindle.model.rotor.modes import Mode, modes
from thermospindle.model.rotor.poles import Between, Poles, poles
from thermospindle.model.scene.reading import content_hash
from thermospindle.model.sensors import with_sensors
from thermospindle.model.types import Array, ComplexArray
from thermospindle.model.units import RPM
from thermospindle.sim.effects import of_scene
from thermospindle.sim.effects.effect import Effect, Measurement, Values
from thermospindle.thermal.expansion import expand


@dataclass(frozen=True, eq=False)
class OperatingPoint:
    """One spindle at one condition; what follows from it is computed when first asked.

    `spindle` is the drawing as the effects of the scene leave it at this condition. `condition` is what
    was asked for, and that which effects make of it (`thermometer_error`) the state's own. `regions` are
    the temperatures (C) of the section, one of all or by region, and `motions` the rings', by bearing.
    """

    spindle: Spindle
    condition: Condition
    state: PairState
    regions: float | Mapping[str, float]
    motions: Mapping[str, RingMotion]
    effects: tuple[tuple[Effect, Values], ...] = ()

    def __repr__(self) -> str:
        speed = self.condition.speed / RPM
        return f"<{type(self).__name__} {self.spindle.name} at {self.condition.temperature:g} C, {speed:.6g} rpm, {self.state.words}>"

    @cached_property
    def chain(self) -> RotorBase:
        chain = rotor_base(self.spindle, self.state)
        for effect, values in self.effects:
            if effect.chain:
                chain = effect.chain(self.spindle, self.state.condition, values, chain)
        return chain

    @cached_property
    def measurement(self) -> Measurement:
        """How the scene's points and hammers are measured, without noise."""
        rows = point_rows(self.spindle, self.chain)
        hammers = point_rows(self.spindle, self.chain, self.spindle.hammer.hammer_nodes)
        chain = Measurement(rows, hammers, np.ones(len(rows)), np.zeros(len(rows)), 0.0)
        for effect, values in self.effects:
            if effect.measurement:
                chain = effect.measurement(self.spindle, self.state.condition, values, self.chain, chain)
        return chain

    @cached_property
    def imperfections(self) -> Imperfections:
        """What the running spindle is excited by: the scene's imperfections, and those of effects."""
        found = self.spindle.imperfections
        for effect, values in self.effects:
            if effect.imperfections:
                found = effect.imperfections(self.spindle, self.state.condition, values, found)
        return found

    def spec(self, element: str = "linear", looks: bool = False) -> mujoco.MjSpec:
        """The MuJoCo specification of this point; MuJoCo's own `to_xml` of it rounds to six digits, which `xml` does not."""
        return mjcf.spec(self.spindle, self.state, element, looks, self.chain)

    def xml(self, element: str = "linear", looks: bool = False) -> str:
        """The same as MJCF in full precision, which `mujoco.MjModel.from_xml_string` and the viewer open."""
        return mjcf.xml(self.spec(element, looks))

    @cached_property
    def model(self) -> mujoco.MjModel:
        """The compiled MuJoCo model with linear bearing elements."""
        return self.spec().compile()

    @cached_property
    def linear(self) -> Matrices:
        """M, C + G, K assembled of the chain, which the MuJoCo model linearises to (`mjcf.linearise`; a rule of every effect)."""
        return matrices(self.chain)

    @cached_property
    def poles(self) -> Poles:
        """All poles of `linear` and their vectors."""
        return poles(self.linear)

    @cached_property
    def modes(self) -> list[Mode]:
        """All oscillating modes, in order of frequency."""
        return modes(self.chain, self.linear)

    def modes_below(self, highest: float) -> list[Mode]:
        """Oscillating modes below `highest` (Hz); of a flexible shaft quicker than all `modes`."""
        if not isinstance(highest, Real) or not highest > 0:
            raise BadInput(f"highest = {highest!r}: must be a positive number")
        return modes(self.chain, self.linear, highest) if "modes" not in self.__dict__ else [m for m in self.modes if m.frequency < highest]

    def frf(self, frequency: ArrayLike, window_decay: float = 0.0, between: Between | None = None) -> ComplexArray:
        """Exact mobility (n_resp, n_ref, n) of the linear model at `frequency` (Hz), as the measuring chain shows it.

        BadInput for frequencies that are no row of numbers, zero or more. `window_decay` (1/s) is that of an exponential window that is
        known and still in the FRFs; with the mass `between` nodes of shafts (`mass_between`) where it is, as MuJoCo does not step it.
        """
        m, frequency = self.measurement, lines_of("frequency", frequency, zero=True)
        s: ComplexArray = np.asarray(frequency - 1j * (m.decay + window_decay) / (2 * np.pi), complex)
        value = frf(self.linear, m.response_rows, m.reference_rows, s, "mobility", between)
        return value * (m.gain[:, None] * np.exp(-2j * np.pi * frequency * m.delay[:, None]))[:, None, :]


def lines_of(name: str, frequency: ArrayLike, zero: bool = False) -> Array:
    """Frequencies (n,) in Hz of an argument called `name`; `BadInput` where they are no row of positive numbers, or `zero`."""
    try:
        lines = np.atleast_1d(np.asarray(frequency))
    except (TypeError, ValueError):
        lines = np.zeros(0)
    if lines.dtype.kind not in "iuf" or lines.ndim != 1 or not lines.size or not np.all(np.isfinite(lines)) or np.any(lines < 0 if zero else lines <= 0):
        raise BadInput(f"{name} = {reprlib.repr(frequency)}: must be one row of positive numbers{' or zero' * zero}")
    return np.asarray(lines, float)


def mass_between(point: OperatingPoint, drawing: Spindle) -> Between | None:
    """What the mass between the nodes of shafts adds at an operating point, with the drawing's
    materials at the reference temperature: what an effect changes of so little is left out."""
    structure = point.spindle.structure
    if not structure.shafts:
        return None
    mass, quartic, gyroscopic = spread(structure, drawing.materials, drawing.reference_temperature, point.chain.layout)
    return mass, quartic, point.chain.speed * gyroscopic


def operating_point(
    spindle: Spindle,
    condition: Condition,
    effects: Sequence[tuple[Effect, Values]] | None = None,
    expansion: Callable[[Spindle], dict[str, RingMotion]] | None = None,
) -> OperatingPoint:
    """Region temperatures, thermal expansion, axial equilibrium of the bearings, and what hangs on them.

    `effects` are the scene's by default. `expansion` gives the ring motions of the drawing under a temperature field of its own, by
    default that of the condition's temperature in all regions, as effects change it; ValueError for effects that then prescribe region
    temperatures.
    """
    present = tuple(of_scene(spindle) if effects is None else effects)
    return acted_on(equilibrium(spindle, condition, present, expansion), present)


SETTLING = ("condition", "spindle", "temperatures", "motions")
"""Hooks of an effect that `equilibrium` asks."""


def equilibrium(
    spindle: Spindle, condition: Condition, effects: Sequence[tuple[Effect, Values]], expansion: Callable[[Spindle], dict[str, RingMotion]] | None = None
) -> OperatingPoint:
    """The operating point where the rings have settled, before any of the `effects` changes what bearings are there, or joints."""
    asked = condition
    for effect, values in effects:
        if effect.condition:
            condition = effect.condition(spindle, condition, values)
    spindle = drawing(spindle, condition, effects)
    if expansion and (prescribing := [effect.name for effect, _ in effects if effect.temperatures]):
        raise ValueError(f"region temperatures are given, and {', '.join(prescribing)} would prescribe them")
    regions = _region_temperatures(spindle, condition, effects)
    motions = expansion(spindle) if expansion else expand(spindle, regions)
    for effect, values in effects:
        if effect.motions:
            motions = effect.motions(spindle, condition, values, motions)
    try:
        return OperatingPoint(spindle, asked, loaded(spindle, solve(spindle, condition, motions)), regions, motions)
    except NoEquilibrium as error:
        raise NoEquilibrium(f"at {condition.temperature:g} C and {condition.speed / RPM:g} rpm {'; '.join([str(error), *sense.of_conditions(spindle, [condition])])}") from None


def acted_on(settled: OperatingPoint, effects: Sequence[tuple[Effect, Values]]) -> OperatingPoint:
    """The operating point of an `equilibrium` under the same effects."""
    state = settled.state
    for effect, values in effects:
        if effect.pair:
            state = effect.pair(settled.spindle, settled.state.condition, values, state)
    return replace(settled, state=state, effects=tuple(effects))


def doubts(spindle: Spindle, points: Sequence[OperatingPoint]) -> list[str]:
    """What is odd about conditions and about the states of the bearings there, a sentence each."""
    return sense.of_conditions(spindle, [p.condition for p in points]) + sense.of_states(spindle, [p.state.bearings for p in points])


def doubts_of_modes(spindle: Spindle, points: Sequence[OperatingPoint]) -> list[str]:
    """What is odd, and what the modes within the hammer's band would be with dampers that turn, at the fastest of the points."""
    fastest = max(points, key=lambda p: abs(p.condition.speed))
    turning = sense.of_damping(fastest.chain, fastest.modes_below(spindle.hammer.band[1])) if fastest.condition.speed else []
    return doubts(spindle, points) + turning


def _region_temperatures(spindle: Spindle, condition: Condition, effects: Sequence[tuple[Effect, Values]]) -> float | dict[str, float]:
    """The condition's temperature (C), or one for every region where an effect has a say in it."""
    if not any(effect.temperatures for effect, _ in effects):
        return condition.temperature
    temperatures = {g.name: condition.temperature for g in spindle.regions}
    for effect, values in effects:
        if effect.temperatures:
            temperatures = effect.temperatures(spindle, condition, values, temperatures)
    return temperatures


def drawing(spindle: Spindle, condition: Condition, effects: Sequence[tuple[Effect, Values]]) -> Spindle:
    """The drawing at a condition's temperature, with the sensors of known mass on it, whose shafts
    and joints have the moduli of that temperature, as effects leave it."""
    spindle = with_sensors(spindle)
    structure = at_temperature(spindle.structure, spindle.materials, spindle.reference_temperature, condition.temperature)
    spindle = spindle if structure is spindle.structure else replace(spindle, structure=structure)
    for effect, values in effects:
        if effect.spindle:
            spindle = effect.spindle(spindle, condition, values)
    return spindle


def stiffness_table(spindle: Spindle, temperatures: Sequence[float], speeds: Sequence[float] = (0.0,)) -> StiffnessTable:
    """Bearing properties over temperature (C) and speed (rad/s), and the temperature at which a bearing unloads."""
    temperatures, speeds = sorted(set(temperatures)), sorted(set(speeds))
    points = [[operating_point(spindle, Condition(t, speed)) for speed in speeds] for t in temperatures]
    lost = {b.name: unloads(spindle, [row[0] for row in points], b.name) for b in spindle.bearings}
    states = [[point.state for point in row] for row in points]
    return tabulate(temperatures, speeds, states, lost, provenance(spindle), [[pressures(point.spindle, point.state) for point in row] for row in points])


BESIDE, NEARLY = 0.02, 0.1
"""K beside the temperature at which a bearing loses contact, and what it may be pressed by there of where it surely is."""


def unloads(spindle: Spindle, points: Sequence[OperatingPoint], bearing: str) -> float | None:
    """Temperature (C) between two neighbouring points, the first such two, at which a bearing loses contact, or gets it in the
    warmth, to a millikelvin; the lowest of the points where it has none at any of them."""

    failed: list[NoEquilibrium] = []

    def deformation(temperature: float) -> float:
        condition = Condition(temperature, points[0].condition.speed)
        try:
            state = operating_point(spindle, condition).state.bearing(bearing)
        except NoEquilibrium as error:  # between rows that are let go nothing holds the rings
            failed.append(error)
            return -1e-12
        return state.deformation if state.in_contact else min(state.deformation, -1e-12)

    for cold, hot in pairwise(points):
        if cold.state.bearing(bearing).in_contact != hot.state.bearing(bearing).in_contact:
            found = float(scipy.optimize.brentq(deformation, cold.condition.temperature, hot.condition.temperature, xtol=1e-3))
            held = cold if cold.state.bearing(bearing).in_contact else hot
            if failed and not 0 < deformation(found + np.copysign(BESIDE, held.condition.temperature - found)) < NEARLY * held.state.bearing(bearing).deformation:
                raise failed[0]  # for another reason: it is pressed right beside
            return found
    return None if points[0].state.bearing(bearing).in_contact else points[0].condition.temperature


def provenance(spindle: Spindle) -> dict[str, str]:
    """What a result was made from: scene, its hash, versions of this program and of the libraries that compute."""
    libraries = {name: version(name) for name in ("thermospindle", "mujoco", "numpy", "scipy", "scikit-fem")}
    return {"scene": spindle.name, "scene_hash": content_hash(spindle)} | libraries
