"""Hidden physics of the structure: joints, masses, sensors, cables, tethers."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np

from tests.blind.hidden import Mechanism
from thermospindle.model.machine import Spindle
from thermospindle.model.rotor.chain import Element, RotorBase
from thermospindle.model.structure import MOVES, Body

OMEGA = 2 * np.pi * 1500.0  # rad/s, at which a loss factor becomes a damper


RIGHT = {"mount": ("mount_compliance",), "plate": ("plate_prestress",), "flange": ("flange_fit_loosening",)}


def of_structure(spindle: Spindle) -> list[Mechanism]:
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
        Mechanism("a spring from rotor to ground", "% of a bearing's radial", 0.001, 0.1, (), "spring", {"chain": _tether}, sign=1),
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
