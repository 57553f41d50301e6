"""The rotor-base chain: rigid bodies joined by compliant elements, and its matrices M, C, G, K.

Small motions about the loaded state. Every body has its centre of mass on the spindle axis and moves in some of
x, y, z, tilt_x, tilt_y; a point of it at position p is displaced by u + tilt x (p - centre). A turning body adds the gyroscopic
moment -Ip speed tilt_rate_y about x and +Ip speed tilt_rate_x about y on the right-hand side (Genta, *Dynamics of Rotating
Systems*, 2005, Eq. 2.23 in real coordinates), as C + G with G skew.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property, lru_cache

import numpy as np

from thermospindle.model.bearing.pair import BearingState, LinearState, PairState
from thermospindle.model.drawing.measuring import Point
from thermospindle.model.machine import Spindle
from thermospindle.model.rotor.loss import damping_of_loss
from thermospindle.model.structure import MOVES, Body, Joint, Structure
from thermospindle.model.types import Array, Integers


@dataclass(frozen=True)
class Element:
    """Stiffness and damping (5, 5) between two bodies (or the ground) at height `z` on the axis; `b` moves relative to `a`.

    `slides` names a body on `b` that moves along the axis by itself, a ring on its preload spring: the element feels its axial motion
    and the rest of b's.
    """

    name: str
    group: str
    a: str
    b: str
    z: float
    stiffness: Array
    damping: Array
    slides: str = ""
    loss_factor: float = 0.0  # beside `damping`, of its stiffness but for what is `lossless` (`model.rotor.loss`)
    lossless: Array | None = None  # (5, 5), a flexibility in series that `stiffness` has in it and that loses nothing

    @property
    def lossy(self) -> Array:
        """Imaginary part (5, 5) of the complex stiffness by the loss factor: of K in series with a lossless F, together K_s, to first order
        eta (1 + K F)^-1 K (1 + F K)^-1 = eta (K_s - K_s F K_s)."""
        own = self.stiffness if self.lossless is None else self.stiffness - self.stiffness @ self.lossless @ self.stiffness
        return self.loss_factor * own

    def told_by(self, motion: Array) -> Element:
        """The same element told by another relative motion r', r = `motion` r', a regular matrix (5, 5)."""
        back = np.linalg.inv(motion)
        lossless = None if self.lossless is None else back @ self.lossless @ back.T
        return replace(self, stiffness=motion.T @ self.stiffness @ motion, damping=motion.T @ self.damping @ motion, lossless=lossless)


Layout = tuple[tuple[str, float, tuple[str, ...]], ...]
"""Name, height and moves of every body."""


@lru_cache(maxsize=64)
def _dofs(layout: Layout) -> tuple[tuple[str, str], ...]:
    return tuple((name, move) for name, _, moves in layout for move in moves)


@dataclass(frozen=True)
class RotorBase:
    bodies: tuple[Body, ...]
    elements: tuple[Element, ...]
    speed: float  # rad/s

    @cached_property
    def dofs(self) -> tuple[tuple[str, str], ...]:
        """(body, move) of every degree of freedom, in order."""
        return _dofs(self.layout)

    @cached_property
    def layout(self) -> Layout:
        """What the motion of points depends on."""
        return tuple((b.name, b.z, b.moves) for b in self.bodies)

    def body(self, name: str) -> Body:
        return next(b for b in self.bodies if b.name == name)


@dataclass(frozen=True)
class Matrices:
    """M, C + G (gyroscopic terms included) and K of a linearised spindle, all (n, n), with the dofs' names."""

    mass: Array
    damping: Array
    stiffness: Array
    dofs: tuple[tuple[str, str], ...]


def rotor_base(spindle: Spindle, state: PairState) -> RotorBase:
    """The chain at one condition: the structure's joints and the bearings, one of them behind its preload spring where that has a rate."""
    structure = spindle.structure
    joints = [joint_element(structure, i) for i in range(len(structure.joints))]
    of = {b.name: (b.inner_body, b.outer_body) for b in spindle.all_bearings}
    ordered: list[BearingState | LinearState] = [*state.bearings, *state.linear]
    bearings = [Element(b.name, "bearings", *of[b.name], b.z, b.stiffness, b.damping) for b in ordered]
    chain = RotorBase(structure.bodies, (*joints, *bearings), state.condition.speed)
    for s in spindle.sets:
        if s.spring is not None and s.spring.rate is not None:
            chain = sprung(chain, s.spring.rings_of, s.spring.rate, s.spring.mass)
    return chain


def sprung(chain: RotorBase, names: Sequence[str], rate: float, mass: float) -> RotorBase:
    """The chain with the rings of bearings on one lossless axial spring of `rate` (N/m); they move
    across the axis and tilt with their body.

    A ring without mass is condensed: K - K_z K_z^T / (rate + k_zz), damping to first order of complex stiffness. ValueError for
    several without mass.
    """
    own = [e for e in chain.elements if e.name in names]
    if mass > 0.0:
        first = own[0]
        ring = Body(f"{first.name} sprung ring", mass, (0.0, 0.0, 0.0), first.z, ("z",), False, ())
        stiffness = np.diag([0.0, 0.0, rate, 0.0, 0.0])
        spring = Element(f"{first.name} preload spring", "bearings", first.b, ring.name, first.z, stiffness, np.zeros((5, 5)))
        elements = [replace(e, slides=ring.name) if e.name in names else e for e in chain.elements]
        return replace(chain, bodies=(*chain.bodies, ring), elements=(*elements, spring))
    if len(own) > 1:
        raise ValueError(f"the rings of {', '.join(names)} slide together, and need a mass to do so in vibration")
    pass_on = np.eye(5)
    pass_on[:, 2] -= own[0].stiffness[:, 2] / (rate + own[0].stiffness[2, 2])
    stiffness = pass_on @ own[0].stiffness
    condensed = replace(own[0], stiffness=(stiffness + stiffness.T) / 2, damping=pass_on @ own[0].damping @ pass_on.T)
    return replace(chain, elements=tuple(condensed if e is own[0] else e for e in chain.elements))


def joint_element(structure: Structure, index: int) -> Element:
    joint = structure.joints[index]
    return _joint_element(joint, structure.damping_time(joint.damping_ratio))


@lru_cache(maxsize=1024)
def _joint_element(joint: Joint, damping_time: float) -> Element:
    """Read only."""
    stiffness = np.diag(joint.stiffness)
    damping = damping_time * stiffness
    for matrix in (stiffness, damping):
        matrix.flags.writeable = False
    return Element(joint.name, joint.group, *joint.bodies, joint.z, stiffness, damping, loss_factor=joint.loss_factor)


def motion_rows(chain: RotorBase, name: str, position: Sequence[float]) -> Array:
    """Rows (5, n) that give the displacement and tilt of the material point of a body at `position` (3,); read only."""
    return _motion_rows(chain.layout, name, (position[0], position[1], position[2]))


@lru_cache(maxsize=1024)
def _motion_rows(layout: Layout, name: str, position: tuple[float, float, float]) -> Array:
    rows = np.zeros((5, sum(len(moves) for _, _, moves in layout)))
    start = 0
    for body, height, moves in layout:
        if body == name:
            x, y, z = position[0], position[1], position[2] - height
            lever = np.eye(5)  # displacement from a unit motion: tilt x (p - centre)
            lever[1:3, 3] = -z, y
            lever[[0, 2], 4] = z, -x
            rows[:, start : start + len(moves)] = lever[:, [MOVES.index(m) for m in moves]]
        start += len(moves)
    rows.flags.writeable = False
    return rows


def element_rows(chain: RotorBase, element: Element) -> Array:
    """Rows (5, n) of the relative motion an element resists; read only."""
    return _element_rows(chain.layout, element.a, element.b, element.z, element.slides)


@lru_cache(maxsize=1024)
def _element_rows(layout: Layout, a: str, b: str, z: float, slides: str) -> Array:
    end = _motion_rows(layout, b, (0.0, 0.0, z))
    if slides:
        end = end.copy()
        end[2] = _motion_rows(layout, slides, (0.0, 0.0, z))[2]
    rows = end - _motion_rows(layout, a, (0.0, 0.0, z))
    rows.flags.writeable = False
    return rows


def point_row(chain: RotorBase, point: Point) -> Array:
    """Row (n,) of the displacement of a measuring point along its direction."""
    return row_of(chain.layout, point)


def row_of(layout: Layout, point: Point) -> Array:
    """The same from what it depends on alone."""
    return np.array(point.direction) @ _motion_rows(layout, point.body, point.position)[:3]


def matrices(chain: RotorBase) -> Matrices:
    """M, C + G, K assembled element by element (independent of MuJoCo)."""
    n, speed = len(chain.dofs), chain.speed
    mass: list[float] = []
    damping, stiffness = _felt(chain, n) if chain.elements else np.zeros((2, n, n))
    for body in chain.bodies:
        if body.turns:
            i, j = len(mass) + body.moves.index("tilt_x"), len(mass) + body.moves.index("tilt_y")
            damping[i, j] += body.inertia[2] * speed * body.speed_ratio
            damping[j, i] -= body.inertia[2] * speed * body.speed_ratio
        inertia = dict(zip(MOVES, (body.mass, body.mass, body.mass, *body.inertia[:2]), strict=True))
        mass += [inertia[move] for move in body.moves]
    if any(e.loss_factor for e in chain.elements):
        damping += lost(chain, np.array(mass), stiffness)
    whole = np.zeros((n, n))
    whole.flat[:: n + 1] = mass
    return Matrices(whole, damping, stiffness, chain.dofs)


def _felt(chain: RotorBase, n: int) -> Array:
    """Damping and stiffness (2, n, n) of a chain's elements."""
    rows, place = _places(chain.layout, tuple((e.a, e.b, e.z, e.slides) for e in chain.elements))
    of_elements = np.concatenate([*(e.damping for e in chain.elements), *(e.stiffness for e in chain.elements)]).reshape(2, -1, 5, 5)
    found = np.bincount(place, (rows.transpose(0, 2, 1) @ (of_elements @ rows)).ravel(), 2 * n * n)
    return np.asarray(found, float).reshape(2, n, n)


def lost(chain: RotorBase, mass: Array, stiffness: Array) -> Array:
    """Damping (n, n) of the loss factors of a chain's elements, in its masses (n,) and stiffness (n, n)."""
    return damping_of_loss(mass, stiffness, [(e.lossy, element_rows(chain, e)) for e in chain.elements if e.loss_factor])


def losses(chain: RotorBase, at: Matrices) -> Array:
    """What loses energy in a chain (3, n, n): the imaginary part of the complex stiffness K + i H that loss factors are
    (Bishop, *J. R. Aeronaut. Soc.* 59 (1955) 738), the damping that its matrices `at` have for it, and that of its dampers."""
    n = len(chain.dofs)
    dampers = _felt(chain, n)[0] if chain.elements else np.zeros((n, n))
    constant, by_loss = np.zeros((2, n, n))
    if lossy := [e for e in chain.elements if e.loss_factor]:
        constant += sum(element_rows(chain, e).T @ e.lossy @ element_rows(chain, e) for e in lossy)
        by_loss += (at.damping + at.damping.T) / 2 - dampers  # without any it would be rounding, of as many products as there are degrees of freedom
    return np.array([constant, by_loss, dampers])


@lru_cache(maxsize=64)
def _places(layout: Layout, elements: tuple[tuple[str, str, float, str], ...]) -> tuple[Array, Integers]:
    """Rows (elements, 5, w) of the relative motion that each element (a, b, z, slides) resists,
    over the w degrees of freedom of its ends, and the place (2 elements w w,) of each of its terms
    in one of two whole matrices after each other; fewer than w are filled up with zeros at place 0."""
    first, at = {"ground": range(0)}, 0
    for name, _, moves in layout:
        first[name] = range(at, at + len(moves))
        at += len(moves)
    own = [[i for name in (a, b, slides) if name for i in first[name]] for a, b, _, slides in elements]
    width = max(len(numbers) for numbers in own)
    rows, number = np.zeros((len(elements), 5, width)), np.zeros((len(elements), width), int)
    for k, ((a, b, z, slides), numbers) in enumerate(zip(elements, own, strict=True)):
        rows[k, :, : len(numbers)] = _element_rows(layout, a, b, z, slides)[:, numbers]
        number[k, : len(numbers)] = numbers
    place = (number[:, :, None] * at + number[:, None, :]).ravel()
    return rows, np.concatenate([place, at * at + place])
