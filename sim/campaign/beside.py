"""A test's measured FRFs and the model's on one axis: the same points, quantity, lines and window."""

from __future__ import annotations

import hashlib
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from thermospindle.model import sense
from thermospindle.model.drawing.measuring import Point
from thermospindle.model.errors import BadInput, listed
from thermospindle.model.machine import Condition, Spindle
from thermospindle.model.rotor.poles import Between
from thermospindle.model.shaft import SAME_HEIGHT, Shaft
from thermospindle.model.types import Array, ComplexArray
from thermospindle.model.units import MM, RPM
from thermospindle.sim.campaign.campaign import Campaign, Test, condition_of
from thermospindle.sim.identification.frf import POWER, Frf, out_of, without
from thermospindle.sim.operating import OperatingPoint, mass_between, operating_point


@dataclass(frozen=True, eq=False)
class Beside:
    """One test: `measured` FRFs at the lines above 0 Hz without those of the running speed, `point`, the model at the test's condition
    with the test's points, and what the mass `between` nodes of its shafts adds, which a campaign of this program's own has not."""

    test: Test
    measured: Frf
    point: OperatingPoint
    between: Between | None = None

    def computed(self, frequency: Array) -> ComplexArray:
        """The model's FRFs (responses, references, n) at any `frequency` (n,) Hz, in the measured quantity.

        An exponential window exp(-decay t) left in the measured ones damps these as much: they are taken at i omega + decay.
        """
        s = 2j * np.pi * frequency + self.test.window_decay
        value = self.point.frf(frequency, self.test.window_decay, self.between) * s ** POWER[self.measured.quantity]
        return np.asarray(value[: len(self.measured.response_nodes)], complex)

    @property
    def held(self) -> bool:
        """Whether any bearing is in contact: FRFs of what else moves freely say nothing of a machine that was measured."""
        state = self.point.state
        return bool(state.linear or not state.bearings or any(b.stiffness.any() for b in state.bearings))


def check_points(spindle: Spindle, campaign: Campaign) -> None:
    """Raises `BadInput` for a campaign with a point on a body that the scene has not, or beyond the ends of a shaft."""
    bodies = {b.name for b in spindle.structure.rigid_bodies}
    for point in campaign.points:
        where, shaft = f"{campaign.folder or campaign.title}: points.{point.node}", _shaft_of(spindle, point)
        if shaft is None and point.body not in bodies:
            allowed = [*sorted(bodies), *(s.name for s in spindle.structure.shafts)]
            raise BadInput(f"{where}.body = {point.body!r}: no body of scene {spindle.name}; allowed are {', '.join(allowed)}")
        if shaft is not None and not shaft.nodes[0] - SAME_HEIGHT <= point.position[2] <= shaft.nodes[-1] + SAME_HEIGHT:
            low, high = (z / MM for z in (shaft.nodes[0], shaft.nodes[-1]))
            raise BadInput(
                f"{where}: at z_mm = {point.position[2] / MM:g} beyond the shaft {shaft.name!r} of scene {spindle.name}, which spans {low:g} to {high:g}"
            )


def on_nodes(spindle: Spindle, points: Sequence[Point]) -> tuple[Point, ...]:
    """A campaign's points on the nodes that the scene's shafts have: a mesh that was made finer, or that a bearing
    more divides, has them in other places than when the campaign was written, and height alone says where a point is."""
    shafts = [_shaft_of(spindle, p) for p in points]
    return tuple(p if shaft is None else replace(p, body=shaft.node_at(p.position[2])) for p, shaft in zip(points, shafts, strict=True))


def _shaft_of(spindle: Spindle, point: Point) -> Shaft | None:
    """The shaft that a point is on, by its name or that of a node of some mesh of it."""
    if any(b.name == point.body for b in spindle.structure.rigid_bodies):
        return None
    name, _, number = point.body.rpartition(" ")
    return next((s for s in spindle.structure.shafts if s.name == point.body or (s.name == name and number.isdecimal())), None)


def measured_at(spindle: Spindle, campaign: Campaign, test: Test) -> Spindle:
    """The spindle with the response points of a campaign's test first and its hammer points; of a table of modes with the points of its
    shapes, or as it is where it tells none. A sensor whose mass the campaign does not tell has that of the scene's point of its node."""
    responses = test.response_nodes
    if not responses:
        return spindle
    references = responses[:1] if test.frf is None else test.frf.reference_nodes
    nodes = (*responses, *(n for n in references if n not in responses))
    mass = {p.node: p.mass for p in spindle.points}
    channel, struck = ({n: k for k, n in enumerate(of_all, 1)} for of_all in (campaign.sensors, campaign.hammers))
    by_node = {
        p.node: replace(p, mass=p.mass or mass.get(p.node, 0.0), listens=p.node in responses, channel=channel.get(p.node, 0), hammer=struck.get(p.node, 0))
        for p in on_nodes(spindle, campaign.points)
    }
    hammer = replace(spindle.hammer, hammer_nodes=references)
    return replace(spindle, points=tuple(by_node[n] for n in nodes), hammer=hammer)


def beside(spindle: Spindle, campaign: Campaign, test: Test, condition: Condition) -> Beside | None:
    """A test of a campaign, and the scene at its condition; None for a table of modes."""
    if test.frf is None:
        return None
    measured = without(test.frf, out_of(test.frf, test.speed).out | (test.frf.frequency <= 0))
    own = measured_at(spindle, campaign, test)
    point = operating_point(own, condition)
    return Beside(test, measured, point, None if campaign.lumped_shafts else mass_between(point, own))


def doubtful(spindle: Spindle, campaign: Campaign) -> list[str]:
    """What is odd about a campaign before it is compared with a scene, a sentence each; what its
    FRFs tell beside the scene's own is `likeness`."""
    return [*of_another(spindle, campaign), *sense.of_conditions(spindle, [condition_of(t) for t in campaign.tests]), *far_from(spindle, campaign), *the_same(campaign), *left_out(campaign)]


FAR_K, FAR_SHARE = 20.0, 1.5
"""Beyond the temperatures that a scene is for, and times its nominal speed, from which a test was hardly meant for it."""


def far_from(spindle: Spindle, campaign: Campaign) -> list[str]:
    """A sentence for temperatures, and one for speeds, that are far from what the scene is for, with the unit in which they would not be."""
    low, high = spindle.temperatures
    told = []
    outside = [t for t in campaign.tests if not low - FAR_K <= t.temperature <= high + FAR_K]
    if outside:
        span = " to ".join(f"{v:.4g}" for v in dict.fromkeys((min(t.temperature for t in outside), max(t.temperature for t in outside))))
        units = {"in kelvin": lambda c: c - 273.15, "as degrees Fahrenheit": lambda c: (c - 32) / 1.8}
        near = [how for how, of in units.items() if all(low - FAR_K <= of(t.temperature) <= high + FAR_K for t in outside)]
        asked = f"; {near[0]} they would be near" if near else ""
        which = f"tests {listed([t.id for t in outside])}" if len(outside) < 4 else f"{len(outside)} tests"
        told.append(f"{which} at {span} C: the scene is for {low:g} to {high:g} C (temperature_range_C){asked}")
    nominal, fastest = abs(spindle.nominal_speed) / RPM, max((abs(t.speed) for t in campaign.tests), default=0.0) / RPM
    if nominal and fastest > FAR_SHARE * nominal:
        told.append(f"tests turn with up to {fastest:.5g} rpm: the scene is for {nominal:g} rpm (nominal_speed_rpm)")
    elif nominal and 0 < 60 * fastest <= FAR_SHARE * nominal and fastest < nominal / 40:
        told.append(f"tests turn with {fastest:.5g} rpm at most: the scene is for {nominal:g} rpm (nominal_speed_rpm); as speeds in Hz, {60 * fastest:.5g} rpm, they would be near")
    return told


def of_another(spindle: Spindle, campaign: Campaign) -> list[str]:
    """A sentence where a campaign names another spindle, and no point of it is one of the scene's
    by body and place: a table of modes has none, and would be compared with any machine's."""
    own = {(p.body, p.position) for p in spindle.points}
    if campaign.spindle == spindle.name or any((p.body, p.position) in own for p in on_nodes(spindle, campaign.points)):
        return []
    where = campaign.folder / "campaign.toml" if campaign.folder else campaign.title
    return [f"{where}: spindle = {campaign.spindle!r}, and the scene is {spindle.name!r}: no point of the campaign tells that they are one machine"]


def the_same(campaign: Campaign) -> list[str]:
    """A sentence for tests whose FRFs are the same to the last bit, as no two measurements are."""
    alike: dict[bytes, list[str]] = {}
    for t in campaign.tests:
        if t.frf is not None and t.frf.value.size and np.ptp(np.abs(t.frf.value)):
            alike.setdefault(hashlib.sha256(t.frf.value.tobytes()).digest(), []).append(t.id)
    return [f"tests {listed(ids)} have the same FRFs to the last bit: is one file there under {len(ids)} names?" for ids in alike.values() if len(ids) > 1]


def left_out(campaign: Campaign) -> list[str]:
    """A sentence that names the tests in whose FRFs lines of the running speed stand: those are
    compared with nothing. Of one test it names the lines too."""
    where = f"{campaign.folder / 'campaign.toml'}: " if campaign.folder else ""
    every = [(t.id, out_of(t.frf, t.speed)) for t in campaign.tests if t.frf is not None]
    found = [(id_, lines) for id_, lines in every if lines.multiples]
    if len(found) < 2:
        return [f"{where}tests.{id_}: {lines.words()}" for id_, lines in found]
    each = ", ".join(f"{id_} ({lines.span}, {int(lines.out.sum())} lines)" for id_, lines in found)
    return [f"{where}tests: lines of the running speed stand in the FRFs of {len(found)} tests, {each}, and are left out"]
