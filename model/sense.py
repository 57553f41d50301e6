"""Limits of sense: conditions and states that can be computed but that no real spindle bears. They warn, they refuse nothing."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence

import numpy as np

from thermospindle.model.bearing.definitions import Bearing, RollerBearing
from thermospindle.model.bearing.pair import BearingState
from thermospindle.model.bearing.row import relative_speed
from thermospindle.model.errors import listed
from thermospindle.model.machine import Condition, Spindle
from thermospindle.model.rotor.chain import Matrices, RotorBase, element_rows, matrices
from thermospindle.model.rotor.loss import damping_of_loss
from thermospindle.model.rotor.modes import Mode
from thermospindle.model.types import Array
from thermospindle.model.units import MM, RPM

COLDEST, HOTTEST = -40.0, 120.0
"""C. Below, rolling-bearing greases no longer lubricate; above, bearing steel that is not stabilised grows (SKF, Rolling bearings, 2018)."""
FASTEST = 2.5e6
"""mm rev/min, speed times pitch diameter: what rolling bearings reach, with ceramic balls and oil-air (Abele et al., CIRP Annals 59, 2010)."""
STRONGEST = 1e9
"""Pa: rho v^2, the hoop stress of a thin ring by its own rotation (Timoshenko, *Strength of
Materials*, part 2, 1956), that quenched steel does not bear for long."""
AGAINST = 0.01  # of its preload, or of 1 N, by which a row is loaded against its sense
OTHERWISE = 0.3
"""Of a damping ratio, by which it may be off before that is said: measured ones scatter by as much."""
TURNED = {"x": (-1.0, "y"), "y": (1.0, "x"), "tilt_x": (-1.0, "tilt_y"), "tilt_y": (1.0, "tilt_x")}
"""What a motion becomes as it is turned by a right angle about z."""
DEEPEST = 0.01
"""Deformation of both contacts over the ball's diameter. The static capacity of ISO 76, 4.2 GPa, is reached at about a third of it."""


def of_conditions(spindle: Spindle, conditions: Sequence[Condition]) -> list[str]:
    """What is doubtful about operating conditions: temperatures that bearings do not bear, speeds that none has reached."""
    said = []
    for condition in _extremes(conditions):
        if not COLDEST <= condition.temperature <= HOTTEST:
            said.append(
                f"{condition.temperature:g} C lies outside {COLDEST:g} to {HOTTEST:g} C, where bearing steel keeps its size and grease "
                "its function; the materials are taken as the scene has them"
            )
    fastest = max(abs(c.speed) for c in conditions)
    alike: dict[str, list[str]] = {}  # bearings by their speed factor, as it is told
    for b in spindle.rolling:
        reached = speed_factor(spindle, b, fastest)
        if reached > FASTEST:
            alike.setdefault(f"{reached:.3g}", []).append(b.name)
    said += [
        f"{fastest / RPM:g} rpm means a speed factor n dm of {reached} mm rev/min in the {listed(names)} bearing{'s' * (len(names) > 1)}; rolling bearings "
        f"end at about {FASTEST:.2g}"
        for reached, names in alike.items()
    ]
    for shaft in spindle.structure.shafts:
        rims = [(max(s.outer), spindle.materials[s.material].density) for s in shaft.segments] if shaft.turns else []
        radius, density = max(rims, default=(0.0, 0.0), key=lambda rim: rim[0] ** 2 * rim[1])
        rim = abs(shaft.speed_ratio) * fastest * radius
        if density * rim**2 > STRONGEST:
            said.append(f"{fastest / RPM:g} rpm means {rim:.0f} m/s at the largest diameter of shaft {shaft.name!r}, where a ring bears {np.sqrt(STRONGEST / density):.0f} m/s of its own rotation")
    return said


def speed_factor(spindle: Spindle, b: Bearing | RollerBearing, speed: float) -> float:
    """n dm (mm rev/min) of a bearing: the speed of its rings against each other, where the spindle
    has `speed` (rad/s), times its pitch diameter."""
    return relative_speed(spindle, b, speed) / RPM * b.pitch_diameter / MM


def of_states(spindle: Spindle, states: Iterable[Sequence[BearingState]]) -> list[str]:
    """What is doubtful about loaded bearings, given all bearings of every state."""
    deepest: dict[str, float] = {}
    least: dict[str, float] = {}
    for state in states:
        for b in state:
            deepest[b.name] = max(deepest.get(b.name, 0.0), b.deformation)
            least[b.name] = min(least.get(b.name, 0.0), b.preload if b.in_contact else 0.0)
    return [*of_depths(spindle, deepest), *of_loads(spindle, least)]


def of_depths(spindle: Spindle, deepest: Mapping[str, float]) -> list[str]:
    """Balls pressed deeper into their races than steel stays elastic; `deepest` is the deformation (m) of both contacts, by bearing."""
    return [
        f"the balls of the {name} bearing are pressed in by {depth / spindle.bearing(name).ball_diameter:.1%} of their diameter; beyond "
        f"{DEEPEST:.0%} no bearing stays elastic, and Hertz's theory does not hold"
        for name, depth in deepest.items()
        if depth > DEEPEST * spindle.bearing(name).ball_diameter
    ]


def of_loads(spindle: Spindle, least: Mapping[str, float]) -> list[str]:
    """Rows that their neighbours or an axial load press the wrong way; `least` is the axial load (N) along the row's sense, by bearing."""
    return [
        f"the {name} bearing is loaded against its sense, by {-load:.4g} N: its balls are taken to roll on the other side of their grooves, as deep-groove bearings let them; one of angular contact "
        "has no shoulder there and comes apart"
        for name, load in least.items()
        if load < -AGAINST * max(spindle.bearing(name).preload, 1.0)
    ]


def of_damping(chain: RotorBase, modes: Sequence[Mode]) -> list[str]:
    """Modes of a turning chain that would be damped otherwise if the dampers of what turns turned
    with it, and not stood in space as those of a chain do."""
    other = [(m, m.damping_ratio, turned) for m, turned in zip(modes, turned_dampings(chain, modes), strict=True)]
    undamped = [(m, turned) for m, own, turned in other if turned <= 0 < own]
    if undamped:
        m, turned = undamped[0]
        more = f", and {len(undamped) - 1} more" if len(undamped) > 1 else ""
        return [
            f"the damping of shafts and joints that turn is taken to stand in space; turning with them, it would feed the {m.kind} {m.whirl} mode at {m.frequency:.1f} Hz{more}: "
            f"{100 * turned:.2g} % of critical where {100 * m.damping_ratio:.2g} % is computed, which is unstable"
        ]
    off = [(abs(turned / own - 1), k) for k, (_, own, turned) in enumerate(other) if own > 0]
    worst, k = max(off, default=(0.0, 0))
    if worst < OTHERWISE:
        return []
    m, own, turned = other[k]
    return [
        f"the damping of shafts and joints that turn is taken to stand in space; turning with them, it would damp the {m.kind} {m.whirl} mode at {m.frequency:.1f} Hz "
        f"by {100 * turned:.2g} % of critical where {100 * own:.2g} % is computed, the most that any is off"
    ]


def turned_dampings(chain: RotorBase, modes: Sequence[Mode]) -> list[float]:
    """Damping ratios of modes of a chain if the dampers between bodies of one rotor turned with it.

    Turning with w, such a damper feels q' - w S q, S q the motion (-y, x) across and of the tilts (Genta, *Dynamics of
    Rotating Systems*, 2005, ch. 6): beside C it makes the circulatory stiffness -w C S. To first order that moves a
    lightly damped mode's pole p by w phi^H C S phi / phi^H (2 p M + C + G) phi; forward modes lose w / |p| of what turns.
    """
    linear = matrices(chain)
    circulatory = _circulatory(chain, linear)
    poles = [m.pole + (m.shape.conj() @ circulatory @ m.shape) / (m.shape.conj() @ (2 * m.pole * linear.mass + linear.damping) @ m.shape) for m in modes]
    return [float(-p.real / abs(p)) for p in poles]


def _circulatory(chain: RotorBase, linear: Matrices) -> Array:
    """w C S (n, n) of the dampers between bodies of one rotor, summed over the rotors."""
    ratio = {b.name: b.speed_ratio for b in chain.bodies if b.turns}
    own = [e for e in chain.elements if e.a in ratio and ratio.get(e.b) == ratio[e.a]]
    at = {dof: k for k, dof in enumerate(linear.dofs)}
    found = np.zeros_like(linear.stiffness)
    for rotor in {ratio[e.a] for e in own}:
        turn = np.zeros_like(found)
        for (body, move), k in at.items():
            if ratio.get(body) == rotor and move in TURNED:
                turn[k, at[body, TURNED[move][1]]] = TURNED[move][0]
        of_it = [(e, element_rows(chain, e)) for e in own if ratio[e.a] == rotor]
        damping = np.sum([rows.T @ e.damping @ rows for e, rows in of_it], axis=0)
        lossy = [(e.lossy, rows) for e, rows in of_it if e.loss_factor]
        if lossy:
            damping = damping + damping_of_loss(np.diag(linear.mass), linear.stiffness, lossy)
        found += chain.speed * rotor * damping @ turn
    return found


def _extremes(conditions: Sequence[Condition]) -> list[Condition]:
    """The coldest and the hottest condition, once where they are the same."""
    coldest, hottest = (int(pick([c.temperature for c in conditions])) for pick in (np.argmin, np.argmax))
    return [conditions[i] for i in dict.fromkeys((coldest, hottest))]
