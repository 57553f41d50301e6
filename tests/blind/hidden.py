"""Hidden physics: a mechanism (what is changed) times a law over temperature and speed that is drawn anew for every campaign.

Written without a look at the catalogue of effects: nothing here is imported from `sim.effects`, and only the names of effects are known. A
mechanism says which names would be right answers to it, as far as names tell (`alike` measures it), and which element changes; where a scene has none of
these names it is outside every catalogue there. Sizes are drawn evenly in their logarithm.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from tests.blind.laws import CONSTANT, Law, Place, law
from thermospindle.model.bearing.pair import BearingState
from thermospindle.model.machine import MOVES, Body, RingMotion, Spindle
from thermospindle.model.rotor.chain import Element, RotorBase
from thermospindle.model.tolerance import scaled_preload
from thermospindle.model.types import Array

OMEGA = 2 * np.pi * 1500.0  # rad/s, at which a loss factor becomes a damper


@dataclass(frozen=True, eq=False)
class Hidden:
    """One hidden piece of physics with its law and size; `acts` by step of the chain (`world.STEPS`): (spindle, amount, state) -> state.

    `names` are the right answers, none for what is outside every catalogue; `element` what changes, for the free-form answer.
    """

    mechanism: str
    unit: str
    size: float
    law: Law
    names: tuple[str, ...]
    element: str
    acts: dict[str, Callable[[Spindle, float, Any], Any]] = field(repr=False)

    def amount(self, place: Place) -> float:
        return self.size * self.law(place)


@dataclass(frozen=True, eq=False)
class Mechanism:
    """A generator of `Hidden`: sizes from `low` to `high` in `unit`, with `sign` or either (0); `constant` laws only, `drift` only, or `any`."""

    name: str
    unit: str
    low: float
    high: float
    names: tuple[str, ...]
    element: str
    acts: dict[str, Callable[[Spindle, float, Any], Any]] = field(repr=False)
    sign: int = 0
    laws: str = "drift"

    def drawn(self, random: np.random.Generator, places: Sequence[Place]) -> Hidden:
        constant = self.laws == "constant" or (self.laws == "any" and random.random() < 0.3)
        own = CONSTANT if constant else law(random, places)
        size = float(np.exp(random.uniform(np.log(self.low), np.log(self.high))))
        size *= self.sign or float(random.choice([-1, 1]))
        return Hidden(self.name, self.unit, size, own, self.names, self.element, self.acts)

    def of_size(self, share: float, own: Law = CONSTANT) -> Hidden:
        """With the size at `share` between low and high, its sign (or plus), and a given law."""
        size = self.low * (self.high / self.low) ** share * (self.sign or 1)
        return Hidden(self.name, self.unit, size, own, self.names, self.element, self.acts)


def mechanisms(spindle: Spindle, usable: Sequence[str]) -> tuple[Mechanism, ...]:
    """Every mechanism of a scene; of the right answers those that are `usable` there."""
    found = [*_of_rings(spindle), *_of_bearings(spindle), *_of_structure(spindle), *_of_measuring(spindle)]
    return tuple(replace(m, names=tuple(n for n in m.names if n in usable)) for m in found)


# ---- rings and preload


def _of_rings(spindle: Spindle) -> list[Mechanism]:
    turning, standing = ("outer", "inner") if spindle.bearings[0].turning_ring == "outer" else ("inner", "outer")
    first = spindle.bearings[0].name
    found = [
        Mechanism("preload falls", "%", 1.0, 40.0, ("preload_loss",), "preload",
                  {"spindle": lambda s, a, _: scaled_preload(s, max(1 + a / 100, 0.02))}, sign=-1),
        Mechanism("turning part warmer", "K", 0.3, 8.0, ("thermal_gradient", "soak_lag", "cooling_imbalance"), "rings", {"temperatures": _warmer(turning)}),
        Mechanism("standing part warmer", "K", 0.3, 8.0, ("thermal_gradient", "soak_lag", "cooling_imbalance"), "rings", {"temperatures": _warmer(standing)}),
        Mechanism("outer rings grow", "um", 0.02, 0.8, ("clearance_opening", "ring_growth", "loose_inserts", "expansion_mismatch"),
                  "rings apart radially", {"motions": _moved(None, "outer_r")}, sign=1),
        Mechanism("inner rings shrink", "um", 0.02, 0.8, ("clearance_opening", "loose_inserts", "expansion_mismatch"),
                  "rings apart radially", {"motions": _moved(None, "inner_r", -1.0)}, sign=1),
        Mechanism("balls grow", "1e-6", 20.0, 600.0, ("ball_material", "clearance_opening"), "rings", {"motions": _moved(None, "ball_strain")}),
        Mechanism("inner grooves grow", "1e-6", 20.0, 600.0, ("expansion_mismatch", "clearance_opening"), "rings",
                  {"motions": _moved(None, "inner_strain")}),
    ]  # fmt: skip
    if spindle.sets[0].spring is None:
        found.append(Mechanism("rings move along the axis", "um", 0.02, 0.8, ("preload_loss", "expansion_mismatch", "tandem_sharing"), "preload",
                               {"motions": _moved((first,), "outer_z")}))  # fmt: skip
    return found


def _warmer(ring: str):
    """All regions of the part that carries the `ring` rings warmer by the amount (K)."""

    def temperatures(spindle: Spindle, amount: float, before: dict[str, float]) -> dict[str, float]:
        b = spindle.bearings[0]
        part = spindle.region(b.inner_ring if ring == "inner" else b.outer_ring).part
        return {name: t + amount * (spindle.region(name).part == part) for name, t in before.items()}

    return temperatures


def _moved(names: tuple[str, ...] | None, coordinate: str, factor: float = 1.0):
    def motions(spindle: Spindle, amount: float, before: dict[str, RingMotion]) -> dict[str, RingMotion]:
        more = 1e-6 * factor * amount
        return {
            b: replace(m, **{coordinate: getattr(m, coordinate) + more}) if names is None or b in names else m for b, m in before.items()
        }

    return motions


# ---- bearings


def _of_bearings(spindle: Spindle) -> list[Mechanism]:
    last = spindle.bearings[-1].name
    return [
        Mechanism("compliance in series with the bearings", "% of the bearing's", 0.5, 25.0, ("bond_softening", "housing_flexibility"), "bearings",
                  {"bearings": _in_series(None)}, sign=1, laws="any"),
        Mechanism(f"compliance in series with the {last} bearing", "% of the bearing's", 0.5, 25.0, ("bond_softening", "seat_clearance"), last,
                  {"bearings": _in_series(last)}, sign=1),
        Mechanism("bearing damping", "% (ln)", 10.0, 150.0, ("grease_damping", "lubricant_film"), "bearings damping",
                  {"bearings": _each(None, lambda b, a: replace(b, damping=np.exp(a / 100) * b.damping))}),
        Mechanism("negative stiffness between rotor and stator", "% of a bearing's radial", 0.1, 3.0, ("magnetic_pull",), "bearings",
                  {"chain": _pull}, sign=1, laws="any"),
        # nothing in any list of names: stiffer, and in one direction alone; a whirl force; loss without its stiffness
        Mechanism("bearings stiffen across the axis", "%", 1.0, 20.0, (), "bearings radial", {"bearings": _each(None, _radially)}, sign=1),
        Mechanism(f"{last} bearing stiffens", "%", 1.0, 20.0, (), last, {"bearings": _each(last, _stiffer)}, sign=1),
        Mechanism("cross-coupled stiffness of the bearings", "% of the radial", 0.3, 4.0, (), "bearings", {"bearings": _each(None, _crossed)}),
    ]  # fmt: skip


def _each(name: str | None, change: Callable[[BearingState, float], BearingState]):
    def bearings(spindle: Spindle, amount: float, before: tuple[BearingState, ...]) -> tuple[BearingState, ...]:
        return tuple(change(b, amount) if name in (None, b.name) else b for b in before)

    return bearings


def _with_stiffness(b: BearingState, stiffness: Array) -> BearingState:
    """The damping keeps its ratio to the stiffness."""
    return replace(b, stiffness=stiffness, damping=b.damping[2, 2] / b.stiffness[2, 2] * stiffness)


def _in_series(name: str | None):
    """A compliance of force only, alike along all three axes, of some share of the bearing's radial compliance; 5 % lossy itself."""

    def change(b: BearingState, amount: float) -> BearingState:
        if amount <= 0:
            return b
        compliance = np.diag([1.0, 1.0, 1.0, 0.0, 0.0]) * amount / 100 / b.stiffness[0, 0]
        k = b.stiffness + 1j * OMEGA * b.damping
        both = k @ np.linalg.inv(np.eye(5) + compliance / (1 + 0.05j) @ k)
        both = (both + both.T) / 2
        return replace(b, stiffness=both.real, damping=both.imag / OMEGA)

    return _each(name, change)


def _radially(b: BearingState, amount: float) -> BearingState:
    d = np.diag([np.sqrt(1 + max(amount, -90) / 100)] * 2 + [1.0] * 3)
    return _with_stiffness(b, d @ b.stiffness @ d)


def _stiffer(b: BearingState, amount: float) -> BearingState:
    return _with_stiffness(b, (1 + max(amount, -90) / 100) * b.stiffness)


def _crossed(b: BearingState, amount: float) -> BearingState:
    """k_xy = -k_yx, as fluid films have it: it feeds one whirl and damps the other."""
    skew = np.zeros((5, 5))
    skew[0, 1], skew[1, 0] = 1.0, -1.0
    return replace(b, stiffness=b.stiffness + amount / 100 * b.stiffness[0, 0] * skew)


def _pull(spindle: Spindle, amount: float, chain: RotorBase) -> RotorBase:
    own = [e for e in chain.elements if e.group == "bearings"]
    k = -amount / 100 * own[0].stiffness[0, 0]
    z = float(np.mean([e.z for e in own]))
    pull = Element("pull", "pull", own[0].a, own[0].b, z, np.diag([k, k, 0.0, 0.0, 0.0]), np.zeros((5, 5)))
    return replace(chain, elements=(*chain.elements, pull))


# ---- structure


RIGHT = {"mount": ("mount_compliance",), "plate": ("plate_prestress",), "flange": ("flange_fit_loosening",)}


def _of_structure(spindle: Spindle) -> list[Mechanism]:
    found = []
    turning, heavier = hit(spindle), larger(spindle)
    for joint in (j for j in spindle.structure.joints if j.role != "beam"):
        right = RIGHT.get(joint.role, ())
        softer = right if joint.role != "plate" else (*right, "support_anisotropy")
        found += [
            Mechanism(f"{joint.name} softens", "%", 0.1, 15.0, softer, joint.name, {"chain": _joint(joint.name, -1.0, True)}, sign=1),
            Mechanism(f"{joint.name} stiffens", "%", 0.1, 15.0, ("plate_prestress",) if joint.role == "plate" else (), joint.name,
                      {"chain": _joint(joint.name, 1.0, True)}, sign=1),
            Mechanism(f"{joint.name} damping", "% (ln)", 15.0, 150.0, (), f"{joint.name} damping", {"chain": _joint_damping(joint.name)}),
        ]  # fmt: skip
        if joint.role == "mount":
            found.append(Mechanism("mount softer by a constant", "%", 3.0, 40.0, ("mount_compliance",), joint.name,
                                   {"chain": _joint(joint.name, -1.0, True)}, sign=1, laws="constant"))  # fmt: skip
    every = tuple(j.name for j in spindle.structure.joints)
    metal = tuple(j.name for j in spindle.structure.joints if j.material)
    if metal:
        found.append(Mechanism("modulus of the structure falls", "%", 0.1, 6.0, ("modulus_softening",), " ".join(metal),
                               {"chain": _joints(metal)}, sign=1))  # fmt: skip
    standing = spindle.standing.name
    found += [
        Mechanism(
            f"mass added to {turning}", "%", 0.5, 12.0, ("added_disk",), turning, {"chain": _heavier(turning)}, sign=1, laws="constant"
        ),
        Mechanism("mass at a sensor", "g", 0.02 * heavier**0.5, 2.0 * heavier**0.5, ("sensor_mass",), standing, {"chain": _sensor}, sign=1, laws="constant"),
        Mechanism(f"{turning} loses inertia", "%", 0.5, 8.0, (), turning, {"chain": _lighter}, sign=1),
        Mechanism("a cable on the base", "g", 0.05 * heavier, 3.0 * heavier, (), every[0], {"chain": _cable}, sign=1),
        Mechanism("a spring from rotor to ground", "% of a bearing's radial", 0.001, 0.1, (), every[0], {"chain": _tether}, sign=1),
    ]
    return found


def _each_element(chain: RotorBase, names: Sequence[str], change: Callable[[Element], Element]) -> RotorBase:
    return replace(chain, elements=tuple(change(e) if e.name in names else e for e in chain.elements))


def _joint(name: str, sign: float, damping_too: bool):
    """Stiffness times exp(sign * amount / 100)."""

    def chain(spindle: Spindle, amount: float, before: RotorBase) -> RotorBase:
        f = float(np.exp(sign * amount / 100))
        return _each_element(
            before, [name], lambda e: replace(e, stiffness=f * e.stiffness, damping=f * e.damping if damping_too else e.damping)
        )

    return chain


def _joint_damping(name: str):
    def chain(spindle: Spindle, amount: float, before: RotorBase) -> RotorBase:
        return _each_element(before, [name], lambda e: replace(e, damping=np.exp(amount / 100) * e.damping))

    return chain


def _joints(names: tuple[str, ...]):
    def chain(spindle: Spindle, amount: float, before: RotorBase) -> RotorBase:
        f = 1 - amount / 100
        return _each_element(before, names, lambda e: replace(e, stiffness=f * e.stiffness, damping=f * e.damping))

    return chain


def _with_body(chain: RotorBase, name: str, change: Callable[[Body], Body]) -> RotorBase:
    return replace(chain, bodies=tuple(change(b) if b.name == name else b for b in chain.bodies))


def hit(spindle: Spindle) -> str:
    """The turning body that masses are put on: the hub, or of a flexible shaft the node that is hit first."""
    return spindle.point(spindle.hammer.hammer_nodes[0]).body if spindle.structure.shafts else spindle.turning.name


def larger(spindle: Spindle) -> float:
    """Turning mass of a spindle with a flexible shaft over that of the small ones, whose hubs weigh some 26 g; 1 for these."""
    return spindle.turning_mass / 0.026 if spindle.structure.shafts else 1.0


def _heavier(name: str):
    """A disk of some per cent of the turning mass, flat, at the body's centre and three quarters of what turns' radius of gyration."""

    def chain(spindle: Spindle, amount: float, before: RotorBase) -> RotorBase:
        turning, f = [b for b in before.bodies if b.turns], amount / 100
        more, polar = f * sum(b.mass for b in turning), 0.75 * f * sum(b.inertia[2] for b in turning)

        def changed(b: Body) -> Body:
            return replace(b, mass=b.mass + more, inertia=(b.inertia[0] + polar / 2, b.inertia[1] + polar / 2, b.inertia[2] + polar))

        return _with_body(before, name, changed)

    return chain


def _lighter(spindle: Spindle, amount: float, chain: RotorBase) -> RotorBase:
    """Transverse inertia alone of what turns: what no name stands for."""
    f = 1 - amount / 100
    lighter = (replace(b, inertia=(f * b.inertia[0], f * b.inertia[1], b.inertia[2])) if b.turns else b for b in chain.bodies)
    return replace(chain, bodies=tuple(lighter))


def _sensor(spindle: Spindle, amount: float, chain: RotorBase) -> RotorBase:
    """A mass (g) at the last point that is not on the turning body; what lies off the axis counts by its moments of inertia alone."""
    point = [p for p in spindle.points if not spindle.structure.body(p.body).turns][-1]
    m = 1e-3 * amount

    def changed(b: Body) -> Body:
        x, y, z = point.position[0], point.position[1], point.position[2] - b.z
        more = m * np.array([y**2 + z**2, x**2 + z**2, x**2 + y**2])
        i = np.array(b.inertia) + more
        return replace(b, mass=b.mass + m, inertia=(float(i[0]), float(i[1]), float(i[2])))

    return _with_body(chain, point.body, changed)


def on_spring(chain: RotorBase, host: str, name: str, mass: float, frequency: float, damping_ratio: float, move: str) -> RotorBase:
    """A mass (kg) on a spring along one of `MOVES` on a body, at the body's height."""
    omega = 2 * np.pi * frequency
    along = np.diag([float(move == m) for m in MOVES])
    body = Body(name, mass, (0.0, 0.0, 0.0), chain.body(host).z, (move,), False, ())
    spring = Element(name, name, host, name, body.z, mass * omega**2 * along, 2 * damping_ratio * mass * omega * along)
    return replace(chain, bodies=(*chain.bodies, body), elements=(*chain.elements, spring))


def _cable(spindle: Spindle, amount: float, chain: RotorBase) -> RotorBase:
    """Something lossy of 1400 Hz that takes part more and more, by `amount` g, on the body that carries the standing rings or below."""
    host = next(p.body for p in reversed(spindle.points) if not spindle.structure.body(p.body).turns)
    return on_spring(chain, host, "cable", 1e-3 * amount, 1400.0, 0.08, excited(spindle)) if amount > 1e-9 else chain


def excited(spindle: Spindle) -> str:
    """The move in which something light on the base is felt: along the axis, or across it where a machine-tool spindle is hit across."""
    return "x" if spindle.structure.shafts else "z"


def _tether(spindle: Spindle, amount: float, chain: RotorBase) -> RotorBase:
    own = next(e for e in chain.elements if e.group == "bearings")
    k = amount / 100 * own.stiffness[0, 0]
    stiffness = np.diag([k, k, k, 0.0, 0.0])
    rotor = spindle.turning
    return replace(
        chain, elements=(*chain.elements, Element("tether", "tether", "ground", rotor.name, rotor.z, stiffness, stiffness * 0.02 / OMEGA))
    )


# ---- measuring


def _of_measuring(spindle: Spindle) -> list[Mechanism]:
    last = len(spindle.points) - 1
    return [
        Mechanism("sensor gain", "%", 1.0, 30.0, ("sensor_gain",), "sensor", {"gain": _channel(last, 1e-2)}, laws="any"),
        Mechanism("channel delay", "us", 0.5, 30.0, ("channel_delay",), "delay", {"delay": _channel(last, 1e-6)}, sign=1, laws="any"),
        Mechanism(
            "window left in", "1/s", 0.3, 20.0, ("window_damping",), "window", {"decay": lambda s, a, d: d + a}, sign=1, laws="constant"
        ),
        Mechanism("hammer beside its point", "mm", 0.05, 2.0, ("hammer_position",), "hammer", {"hammer": _beside}, laws="constant"),
    ]


def _channel(index: int, unit: float):
    """The last channel's gain (relative) or delay (s) more by the amount."""

    def change(spindle: Spindle, amount: float, before: Array) -> Array:
        after = before.copy()
        after[index] += unit * amount
        return after

    return change


def _beside(spindle: Spindle, amount: float, positions: Array) -> Array:
    """Hammer positions (references, 3): all moved outward along the axis across which they stand, toward or from it; those on it along it."""
    after = positions.copy()
    radial = positions.copy()
    radial[:, 2] = np.hypot(radial[:, 0], radial[:, 1]) == 0.0
    after += 1e-3 * amount * radial / np.maximum(np.linalg.norm(radial, axis=1, keepdims=True), 1e-9)
    return after
