"""What a variant is, and what several of them are built from."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from model.ball_row import Array
from model.machine import Body, Joint, Law, Material, Spindle
from model.modes import ComplexArray
from model.pair import BearingState, PairState
from model.rotor_base import Element, RotorBase
from sim.effect import HOOKS, Effect, Parameter

Told = tuple[float, float, float | None, float | None]
"""What a test's record tells: temperature (C), speed (rpm), hammer level (N), soak time (s)."""

REST = tuple((float(t), 0.0, None, None) for t in (20, 30, 40, 50, 60))
PLAN: tuple[Told, ...] = (*REST, *((float(t), 7200.0, None, None) for t in (20, 40, 60)))
"""The tests of a practice campaign."""

Recorder = Callable[[float, float, Array, ComplexArray], ComplexArray]
"""(size, temperature C, frequency Hz (n,), FRFs (n_resp, n_ref, n)) to the FRFs as the instruments write them down."""


@dataclass(frozen=True, eq=False)
class Variant:
    """Another engineer's simulation of an effect, with the one parameter `size`, zero where the effect is absent.

    `truth` are the catalogue's names that are right answers, none for an effect from outside it; `visible` and `large` the sizes that
    the engineer would call just visible and large; `plan` the tests that would be made; `record` what no hook of an effect can say.
    """

    effect: Effect
    truth: tuple[str, ...]
    visible: float
    large: float
    plan: tuple[Told, ...] = PLAN
    record: Recorder | None = None

    @property
    def name(self) -> str:
        return self.effect.name

    def size(self, share: float) -> float:
        """From just visible (0) to large (1), in equal ratios."""
        return self.visible * (self.large / self.visible) ** share

    def of_size(self, size: float) -> Effect:
        """The effect with `size` as its typical value."""
        return replace(self.effect, parameters=(replace(self.effect.parameters[0], typical=size),))


def variant(
    name: str,
    what: str,
    unit: str,
    visible: float,
    large: float,
    truth: tuple[str, ...] | None = None,
    plan: tuple[Told, ...] = PLAN,
    record: Recorder | None = None,
    **hooks: Callable[..., Any],
) -> Variant:
    """A variant named `effect/how`, or `outside/what`. Hooks are called with (spindle, condition, size, state), the first without state."""
    family = name.split("/")[0]
    right = truth if truth is not None else () if family == "outside" else (family,)
    if not hooks and record is None:
        raise ValueError(f"variant {name} changes nothing")
    if unknown := set(hooks) - set(HOOKS):
        raise ValueError(f"variant {name}: {', '.join(unknown)}: no such step of the chain")
    size = Parameter("size", unit, 0.0, large, abs(large), (min(0.0, 10 * large), max(0.0, 10 * large)), what, "chosen by its author")

    def sized(hook: Callable[..., Any]) -> Callable[..., Any]:
        def call(spindle: Spindle, condition: Any, values: Mapping[str, float], *state: Any) -> Any:
            return hook(spindle, condition, values["size"], *state)

        return call

    effect = Effect(name, what, what, (size,), "", (), "", **{key: sized(hook) for key, hook in hooks.items()})  # type: ignore[arg-type]
    return Variant(effect, right, visible, large, plan, record)


# ---------------------------------------------------------------- what variants are built from


def warm(temperature: float, start: float = 20.0, stop: float = 60.0) -> float:
    """0 at `start` (C), 1 at `stop`, in a straight line and beyond."""
    return (temperature - start) / (stop - start)


def step(temperature: float, start: float, stop: float) -> float:
    """As `warm`, but 0 below `start` and 1 above `stop`."""
    return float(np.clip(warm(temperature, start, stop), 0.0, 1.0))


def turning(speed: float) -> float:
    """Speed (rad/s) over 7200 rpm."""
    return abs(speed) * 30 / np.pi / 7200


def with_material(spindle: Spindle, material: Material) -> Spindle:
    return replace(spindle, materials={**spindle.materials, material.name: material})


def scaled_expansion(material: Material, factor: float, name: str) -> Material:
    law = material.thermal_expansion
    return replace(material, name=name, thermal_expansion=Law(law.temperature, tuple(factor * v for v in law.value)))


def falling_modulus(material: Material, per_kelvin: float, name: str) -> Material:
    """E = E20 (1 - per_kelvin (T - 20))."""
    e20 = material.youngs_modulus(20.0)
    ends = (-40.0, 160.0)
    return replace(material, name=name, youngs_modulus=Law(ends, tuple(e20 * (1 - per_kelvin * (t - 20)) for t in ends)))


def with_joint(spindle: Spindle, name: str, factors: tuple[float, float, float, float, float], damping: float = 1.0) -> Spindle:
    """A joint's stiffness times `factors` (x, y, z, tilt_x, tilt_y), its damping ratio times `damping`."""

    def changed(joint: Joint) -> Joint:
        k = [f * v for f, v in zip(factors, joint.stiffness, strict=True)]
        return replace(joint, stiffness=(k[0], k[1], k[2], k[3], k[4]), damping_ratio=damping * joint.damping_ratio)

    if name not in [j.name for j in spindle.structure.joints]:
        raise ValueError(f"no joint {name!r}")
    joints = tuple(changed(j) if j.name == name else j for j in spindle.structure.joints)
    return replace(spindle, structure=replace(spindle.structure, joints=joints))


def with_stiffness(bearing: BearingState, stiffness: Array) -> BearingState:
    """The damping keeps its ratio to the stiffness."""
    return replace(bearing, stiffness=stiffness, damping=bearing.damping[2, 2] / bearing.stiffness[2, 2] * stiffness)


def each_bearing(state: PairState, change: Callable[[BearingState], BearingState]) -> PairState:
    return replace(state, bearings=tuple(change(b) for b in state.bearings))


def each_element(chain: RotorBase, names: tuple[str, ...], change: Callable[[Element], Element]) -> RotorBase:
    if missing := set(names) - {e.name for e in chain.elements}:
        raise ValueError(f"no element {', '.join(missing)}")
    return replace(chain, elements=tuple(change(e) if e.name in names else e for e in chain.elements))


def in_series(element: Element, compliance: Array, loss: float = 0.0, frequency: float = 1800.0) -> Element:
    """An element in series with a `compliance` (5, 5) of a loss factor: complex stiffnesses, with the viscous part true at `frequency` (Hz)."""
    if not compliance.any():
        return element
    omega = 2 * np.pi * frequency
    k = element.stiffness + 1j * omega * element.damping
    both = k @ np.linalg.inv(np.eye(5) + compliance / (1 + 1j * loss) @ k)
    both = (both + both.T) / 2
    return replace(element, stiffness=both.real, damping=both.imag / omega)


def with_mass(chain: RotorBase, name: str, mass: float, positions: Array) -> RotorBase:
    """A body with `mass` (kg) at each of `positions` (m, 3); what lies off the axis counts by its moments of inertia alone."""

    def changed(body: Body) -> Body:
        x, y, z = positions[:, 0], positions[:, 1], positions[:, 2] - body.z
        added = mass * np.array([(y**2 + z**2).sum(), (x**2 + z**2).sum(), (x**2 + y**2).sum()])
        i = [float(a + b) for a, b in zip(body.inertia, added, strict=True)]
        return replace(body, mass=body.mass + mass * len(positions), inertia=(i[0], i[1], i[2]))

    return replace(chain, bodies=tuple(changed(b) if b.name == name else b for b in chain.bodies))
