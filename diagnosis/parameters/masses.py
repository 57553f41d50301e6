"""How rigid bodies and shafts may have their mass otherwise than drawn, where no tolerance holds it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from thermospindle.model.machine import Spindle
from thermospindle.model.shaft import Shaft
from thermospindle.model.structure import MOVES, Body

GYRATION = ", of the radius of gyration"
Dof = tuple[str, str]


@dataclass(frozen=True)
class MassTerm:
    """How bodies may have their mass otherwise than drawn: what the whole of it adds to M at two degrees of freedom
    (kg, kg m, kg m2), to polar inertias by body (kg m2), and one standard deviation of the share of it that is there."""

    name: str
    sd: float
    entries: tuple[tuple[Dof, Dof, float], ...] = ()
    polar: tuple[tuple[str, float], ...] = ()


def mass_terms(spindle: Spindle) -> tuple[MassTerm, ...]:
    """What the toleranced parameters leave as drawn of the mass of rigid bodies and of shafts. A hub
    whose polar inertia was off by two thousandths beside the other had a disk on it, 30 in ln evidence."""
    rigid = [m for b in spindle.structure.rigid_bodies for m in _of_a_body(b, spindle)]
    shafts = [m for s in spindle.structure.shafts for m in _of_a_shaft(s, spindle)]
    return tuple(m for m in (*rigid, *shafts) if m.entries or m.polar)


def _of_a_body(body: Body, spindle: Spindle) -> list[MassTerm]:
    """The numbers of a rigid body's mass matrix that no tolerance holds; a centre of mass is off in radii of gyration.

    It moves with u + tilt x d (Goldstein, *Classical Mechanics*, 1980, 5.1), to first order in d; of what turns the mean over a turn.
    """
    t, inertia = spindle.tolerances, float(np.mean(body.inertia[:2]))
    arm = float(np.sqrt(body.mass * inertia))

    def term(name: str, *entries: tuple[str, str, float], of: str = "") -> MassTerm:
        own = tuple(((body.name, a), (body.name, b), amount) for a, b, amount in entries if {a, b} <= {*body.moves} and amount)
        return MassTerm(f"{name} of {body.name}{of}", t.hub if body.turns else t.structure, own)

    found = [term("height of the centre of mass", ("x", "tilt_y", arm), ("y", "tilt_x", -arm), of=GYRATION)]
    if body.turns:
        found.append(_polar(body.name, t.hub, [body]))
    else:
        found += [term("place along x of the centre of mass", ("z", "tilt_y", -arm), of=GYRATION), term("place along y of the centre of mass", ("z", "tilt_x", arm), of=GYRATION)]
        found.append(term("product of inertia", ("tilt_x", "tilt_y", inertia), of=" beside the other inertias"))
    if body.regions and not body.turns:  # of all others these are tolerances
        found.append(term("mass", *((m, m, body.mass) for m in MOVES[:3])))
        found += [term(f"inertia about {m[-1]}", (m, m, own)) for m, own in zip(MOVES[3:], body.inertia, strict=False)]
    return found


def _of_a_shaft(shaft: Shaft, spindle: Spindle) -> list[MassTerm]:
    """Of one that turns, on which a drawing lumps rotor, nuts and tool: more mass towards its end, and in its middle less than
    at both; and polar inertia beside the other. One that stands still is of one piece, with the tolerance of its density."""
    if not shaft.turns:
        return []
    sd, nodes = spindle.tolerances.hub, [spindle.structure.body(name) for name in shaft.bodies]
    z = np.array([b.z for b in nodes])
    along = (2 * z - z.min() - z.max()) / np.ptp(z)
    found = []
    for name, share in (("towards its end", along), ("away from its middle", 1.5 * along**2 - 0.5)):  # Legendre's polynomials
        own = tuple(
            ((b.name, m), (b.name, m), s * amount)
            for b, s in zip(nodes, share.tolist(), strict=True)
            for m, amount in zip(MOVES, (*[b.mass] * 3, *b.inertia[:2]), strict=True)
            if m in b.moves
        )
        found.append(MassTerm(f"mass of {shaft.name} {name}", sd, own))
    return [*found, _polar(shaft.name, sd, nodes)]


def _polar(name: str, sd: float, bodies: Sequence[Body]) -> MassTerm:
    """By which it turns, of bodies that can tilt both ways."""
    turned = tuple((b.name, b.inertia[2]) for b in bodies if {*MOVES[3:]} <= {*b.moves} and b.inertia[2] > 0)
    return MassTerm(f"polar inertia of {name} beside the other", sd, polar=turned)
