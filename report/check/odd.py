"""What is odd about a scene: sentences that refuse nothing, each from one thing that can be computed with and is seldom meant."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from itertools import pairwise
from typing import Any

import numpy as np

from thermospindle.model.carrier import UNBALANCE, load_carrier, turning_parts, unbalanced
from thermospindle.model.drawing.measuring import Point
from thermospindle.model.drawing.section import PARTS
from thermospindle.model.errors import listed
from thermospindle.model.machine import Spindle
from thermospindle.model.rotor.poles import LARGE, lost_to_rounding, poles_below
from thermospindle.model.rotor.section import cells, mass_properties
from thermospindle.model.rotor.static import free_motions
from thermospindle.model.shaft import SAME_HEIGHT, Shaft
from thermospindle.model.units import HERTZ, MM, RPM
from thermospindle.report.check.looked import Looked, looked
from thermospindle.report.check.odd_bearings import OF_BEARINGS
from thermospindle.report.check.understood import understood
from thermospindle.sim.effects import of_scene
from thermospindle.sim.effects.effect import Effect, refusal
from thermospindle.sim.hammer.pulse import pulse_duration
from thermospindle.sim.hammer.test import damped_throughout
from thermospindle.sim.operating import OperatingPoint, mass_between
from thermospindle.sim.resonance.critical import criticals

WEAK = 0.1
"""Share of its force at low frequency below which a hammer hardly excites: 20 dB."""
UNDAMPED = 1e-5
"""Damping ratio below which a record cannot show how a mode dies out: of metals, 1e-4 and more."""
NEAR = 0.05
"""Of its speed, within which a natural frequency that a part's unbalance drives is told."""
LOWEST = 0.1
"""Hz, of a motion that is slower than anything measured here."""
ENDLESS = 0.1
"""m, of a motion at resonance that damping does not bound in earnest."""
LEAST_EXPANSION = 0.01
"""um/m K: glass ceramics such as Zerodur have 0.02, and whoever writes 1/K has 1e-5."""
LEAST_MODULUS = 0.5e9
"""Pa: plastics have 1 to 4 GPa, and whoever writes 0.21 has it in units of 1000 GPa."""
LEAST_DENSITY = 100.0
"""kg/m3: foams have more, and whoever writes g/cm3 has 1 to 20."""
THIN = 0.7
"""Of the bore of a ring: what of a shaft within it is stiff is no thinner, and told by its radius it has a half."""
DENSEST = 22600.0
"""kg/m3, of osmium (CRC Handbook of Chemistry and Physics)."""
OFF = 1.0 * MM
"""How far from its body's surface a point may lie: sensors have bases."""
COARSE = 2e-3
"""Of a frequency, by which masses at nodes may put it off: more than measured ones are known to."""
VAST = 3.0
"""Times the machine's length, beyond which no mass of it lies."""
SLOW = 2.0
"""Hz, of a machine as a whole that stands on rubber feet: 3 to 10."""
FAR = 3.0
"""Radii of gyration from a centre of mass beyond which a body given by its mass is taken to have ended: a rod ends at 1.7."""
MOVES_FREE = 1e-6
"""Of the largest of a free motion, from which a part takes part in it."""
MANY_STEPS = 1e6
"""Of integration in a virtual hammer test, some minutes of computing for a flexible shaft."""


def told(spindle: Spindle, reference: OperatingPoint, catalogue: Sequence[Effect]) -> dict[str, Any]:
    """What is understood of a scene, and what is odd about it: all that `spindle check --json` tells."""
    return understood(spindle, reference, catalogue) | {"odd": odd(looked(spindle, reference))}


def odd(found: Looked) -> list[str]:
    """All that is odd, each once."""
    return list(dict.fromkeys(words for question in QUESTIONS for words in question(found)))


def _seats(found: Looked) -> Iterator[str]:
    shafts = {s.name: s for s in found.spindle.structure.shafts}
    for b in found.spindle.bearings:
        shaft = shafts.get(found.spindle.structure.carrier(b.inner_body))
        if shaft is not None:
            bore, radii = found.spindle.region(b.inner_ring).r[0], _radii(shaft, b.z)[1]
            seat, stiff = max(radii), max(radii[::2])
            if min(abs(bore - r) for r in radii) > 0.05 * seat or stiff < THIN * bore:  # what carries mass may be the ring itself
                radius = seat if stiff == seat else stiff
                yield f"bearing {b.name}: its inner ring {b.inner_ring!r} begins at a radius of {bore / MM:g} mm, and the shaft {shaft.name!r} has {radius / MM:g} mm there" + ("; outer_mm is a diameter" if stiff < THIN * bore else "")


def _materials(found: Looked) -> Iterator[str]:
    """Numbers that are of a material in other units than their keys'."""
    for m in found.spindle.materials.values():
        expansion = max(m.thermal_expansion.value) / 1e-6
        if expansion < LEAST_EXPANSION:
            yield f"material {m.name}: expands by {expansion:.2g} um/m in a kelvin, and even glass ceramics by 0.02; the key takes micrometres per metre and kelvin, of steel 11.5"
        modulus = max(m.youngs_modulus.value)
        if modulus < LEAST_MODULUS:
            yield f"material {m.name}: has a Young's modulus of {modulus / 1e9:g} GPa, less than any solid part; of steel it is 208"
        if m.density < LEAST_DENSITY:
            yield f"material {m.name}: has {m.density:g} kg/m3, less than any solid part; of steel it is 7800"


def _compact(found: Looked) -> Iterator[str]:
    """Bodies given by numbers whose mass would have to be denser than any solid: of all shapes a
    ball has the least largest moment of inertia."""
    structure = found.spindle.structure
    for b in structure.bodies:
        largest = max(b.inertia)
        if b.regions or not b.mass or not largest or structure.carrier(b.name) != b.name:  # of a shaft's pieces it is told by its segments
            continue
        density = b.mass / (4 / 3 * np.pi * (2.5 * largest / b.mass) ** 1.5)
        if density > DENSEST:
            yield (
                f"body {b.name!r}: {b.mass:.4g} kg with moments of inertia of at most {largest:.3g} kg m2 would be a ball of {density:.2g} kg/m3 at the least, and no metal has more than {DENSEST:.3g}: "
                "a mass in g, or a moment of inertia in another unit than its key's?"
            )


def _vast(found: Looked) -> Iterator[str]:
    """Bodies given by numbers whose mass would have to reach far beyond the machine."""
    spindle, structure = found.spindle, found.spindle.structure
    heights = [z for spans in turning_parts(spindle).values() for span in spans for z in span] + [b.z for b in structure.bodies] + [p.position[2] for p in spindle.points]
    heights += [z for g in spindle.regions for z in g.z]
    reach = max(heights) - min(heights)
    for b in structure.rigid_bodies:
        if b.mass and not b.regions and (radius := np.sqrt(max(b.inertia) / b.mass)) > VAST * reach > 0:
            yield (
                f"body {b.name!r}: {b.mass:.4g} kg with a moment of inertia of {max(b.inertia):.3g} kg m2 lie {radius:.2g} m from its centre, and the whole machine is {reach:.2g} m long: "
                "a moment of inertia in another unit than its key's, or a mass in t?"
            )


def _slow(found: Looked) -> Iterator[str]:
    """Natural frequencies so low that what holds the parts may be in another unit."""
    for m in found.reference.modes:
        if LOWEST < m.frequency < min(SLOW, found.spindle.hammer.band[0] / 10):
            most = max(m.energy, key=lambda name: m.energy[name])
            yield f"a natural frequency of {m.frequency:.2g} Hz, with {m.energy[most]:.0%} of its strain in {most}: a machine on soft feet has 3 to 10; is a stiffness, a mass or a moment of inertia in another unit than its key's?"


def _massless(found: Looked) -> Iterator[str]:
    """Regions of the section whose mass nothing has, in a part of which everything else is made of
    regions: a body or shaft given by numbers, or a ground that holds rings, may stand for them."""
    spindle, structure = found.spindle, found.spindle.structure
    grounded = any("ground" in (b.inner_body, b.outer_body) for b in spindle.all_bearings)
    for part in PARTS:
        turns = part == "rotating"
        own = [set(b.regions) for b in structure.rigid_bodies if b.turns == turns] + [set(s.regions) for s in structure.shafts if s.turns == turns]
        if not own or not all(own) or (grounded and not turns):
            continue
        regions = [g for g in spindle.regions if g.part == part]
        left, tiles = {g.name for g in regions}.difference(*own), cells(regions)
        of_each = {g.name: [t for t in tiles if t.region == g.name] for g in regions if g.name in left}
        each = [f"{name!r} ({mass_properties(of, regions, dict(spindle.materials)).mass:.3g} kg)" for name, of in of_each.items() if of]
        if each:
            yield f"section.regions: no body or shaft has the mass of {listed(each)}, {part}; regions of a body, or mass_regions of a shaft, may name {'it' if len(each) == 1 else 'them'}"


def _free(found: Looked) -> Iterator[str]:
    free = free_motions(found.reference.linear.stiffness)
    if count := free.shape[1]:
        what = "a motion" if count == 1 else f"{count} motions"
        bodies = [body for body, _ in found.reference.linear.dofs]
        moving = {body for body, row in zip(bodies, np.abs(free).max(axis=1), strict=True) if row > MOVES_FREE}
        alone = [b.name for b in found.spindle.structure.rigid_bodies if b.name in moving]
        if moving and moving == set(alone) and moving != set(bodies):
            yield f"nothing holds {listed([repr(name) for name in alone])} against {what}: a body without a joint; structure.joints may tie it to another"
        else:
            yield f"nothing holds the spindle against {what}, as of a shaft that hangs free or floats along its axis"


def _lost(found: Looked) -> Iterator[str]:
    lost = lost_to_rounding(found.reference.linear)
    if lost.count and lost.below > LOWEST:
        yield (
            f"{_count(lost.count, 'natural frequency', 'natural frequencies')} below {lost.below:.3g} Hz cannot be told from rounding beside that of {lost.stiffest:.2g} Hz which parts nearly without mass have "
            "between stiff ones, and no verb shows them; more mass there (beam = \"timoshenko\" gives elements their rotary inertia), or longer elements, make them appear"
        )


def _undamped(found: Looked) -> Iterator[str]:
    modes = [m for m in found.reference.modes if m.frequency <= found.spindle.hammer.band[1] and m.damping_ratio < UNDAMPED]
    if modes:
        yield f"{_count(len(modes), 'mode')} up to {found.spindle.hammer.band[1]:g} Hz {'is' if len(modes) == 1 else 'are'} undamped, the lowest at {modes[0].frequency:.0f} Hz: a record does not show how it dies out"


def _damping(found: Looked) -> Iterator[str]:
    for m in found.reference.modes:
        if m.frequency <= found.spindle.hammer.band[1] and m.damping_ratio > 0.3:
            yield f"the mode at {m.frequency:.0f} Hz is damped to {m.damping_ratio:.0%} of critical: a peak cannot be seen of it"


def _critical(found: Looked) -> Iterator[str]:
    if isinstance(found.turning, str):
        return
    for c in criticals(found.turning, NEAR):
        of = "nominal speed" if np.isclose(c.speed, found.turning.condition.speed) else f"speed of {listed(c.parts)}"
        way = "whirls with the rotor" if c.sense > 0.99 else "whirls mostly with the rotor" if c.sense > 0.75 else "hardly whirls" if c.sense > 0.25 else "whirls mostly against the rotor"
        much = f"{1e6 * c.unbalance:.3g} g mm" + (" of the scene" if c.of_scene else "")
        moved = f"{much} at z = {c.z / MM:g} mm would move that place by {1e6 * c.moved:.3g} um in resonance" if c.moved < ENDLESS else "nothing damps it"
        share = "" if c.sense > 0.99 else f" by {100 * c.sense:.2g} % of the modal force"
        yield f"a natural frequency of {c.mode.frequency:.0f} Hz lies at the {of} of {c.speed / RPM:.0f} rpm and {way}: unbalance drives it{share}; {moved}"


# ---------------------------------------------------------------- measuring


def _points(found: Looked) -> Iterator[str]:
    for p in found.spindle.points:
        distance = off(found.spindle, p)
        if distance > OFF:
            yield f"point {p.name}: lies {distance / MM:.3g} mm off {found.spindle.structure.carrier(p.body)!r}, which it is on"


def off(spindle: Spindle, p: Point) -> float:
    """Distance (m) of a point from its body; 0 on the axis, where sensors of plain models are, and
    where nothing is known of the body's shape."""
    r, z = float(np.hypot(*p.position[:2])), p.position[2]
    shaft = next((s for s in spindle.structure.shafts if p.body in s.bodies), None)
    if r == 0.0:
        return 0.0
    if shaft is not None and (sides := [s.sides for s in shaft.segments if s.sides and s.z[0] - SAME_HEIGHT <= z <= s.z[1] + SAME_HEIGHT]):
        return min(float(np.hypot(max(abs(p.position[0]) - w / 2, 0.0), max(abs(p.position[1]) - h / 2, 0.0))) for w, h in sides)
    if shaft is not None:
        inner, outer = _radii(shaft, z)
        return max(r - max(outer), min(inner) - r, 0.0)
    names = spindle.structure.body(p.body).regions
    spans = [(spindle.region(name).r, spindle.region(name).z) for name in names]
    return min((float(np.hypot(max(a[0] - r, r - a[1], 0.0), max(b[0] - z, z - b[1], 0.0))) for a, b in spans), default=0.0)


def _radii(shaft: Shaft, z: float) -> tuple[list[float], list[float]]:
    """Bore and outer radii (m) of a shaft at a height, of both pieces where two meet."""
    inner, outer = [], []
    for s in shaft.segments:
        if s.z[0] - SAME_HEIGHT <= z <= s.z[1] + SAME_HEIGHT:
            share = (z - s.z[0]) / (s.z[1] - s.z[0])
            inner.append(s.bore[0] + share * (s.bore[1] - s.bore[0]))
            outer += [a[0] + share * (a[1] - a[0]) for a in (s.outer, s.mass_outer)]
    return inner, outer


def _hammer(found: Looked) -> Iterator[str]:
    test = found.spindle.hammer
    low, high = test.band
    x = high * pulse_duration(test)
    if x >= 1.5:
        yield f"the hammer gives no force above {1.5 / pulse_duration(test):.0f} Hz, and its band goes to {high:g} Hz: a stiffer tip or a lighter hammer is needed"
    elif abs(np.cos(np.pi * x) / (1 - 4 * x**2) if abs(x - 0.5) > 1e-9 else np.pi / 4) < WEAK:
        yield f"at the upper end of its band, {high:g} Hz, the hammer gives less than a tenth of its force at low frequency"
    if pulse_duration(test) * test.sample_rate < 1:
        yield (
            f"the hammer's pulse of {1e6 * pulse_duration(test):.3g} us is shorter than a sample of {1e6 / test.sample_rate:.3g} us: records show its impulse, "
            f"and a lower peak than its {test.level:g} N; a softer tip or a higher sample_rate_Hz shows it"
        )
    inside = [m for m in found.reference.modes if low <= m.frequency <= high]
    if not inside:
        yield f"no natural frequency lies within the band of the hammer test, {low:g} to {high:g} Hz"
    below = [m for m in found.reference.modes if m.frequency < low]
    if below and inside:
        yield f"{_count(len(below), 'natural frequency', 'natural frequencies')} below the band of the hammer test, the lowest at {below[0].frequency:.0f} Hz: no test will show {'it' if len(below) == 1 else 'them'}"
    decay = min((m.damping_ratio * 2 * np.pi * m.frequency for m in inside if m.damping_ratio >= UNDAMPED), default=np.inf)
    if decay * test.record_length < 3 and test.exponential_end == 1.0:
        yield f"the slowest mode has not died out when the record of {test.record_length:g} s ends; a longer one, or an exponential window, is needed"
    steps = test.hits * len(test.hammer_nodes) * test.record_length / test.step
    freedom = len(found.reference.chain.dofs)
    if damped_throughout(found.reference.chain.elements, freedom):
        yield f"virtual hammer tests are by --element reduced alone: loss_factor makes dampers between all {freedom} degrees of freedom, which MuJoCo steps for {LARGE} or fewer"
    elif steps > MANY_STEPS and found.spindle.structure.shafts:
        yield f"a virtual hammer test takes {steps / 1e6:.1f} million steps of {1e6 * test.step:.2g} us, for the shortest elements of the shaft: places closer together than longest_element_mm make them, or that itself"


def _mesh(found: Looked) -> Iterator[str]:
    """Modes of shafts that come out low for their masses are at nodes."""
    between, high = mass_between(found.reference, found.spindle), found.spindle.hammer.band[1]
    if between is None or lost_to_rounding(found.reference.linear).count:
        return
    lumped = [m.frequency for m in found.reference.modes]
    spread = np.sort(np.abs(poles_below(found.reference.linear, high, between)[0])) / HERTZ
    count = min(len(lumped), len(spread))
    off = np.abs(lumped[:count] / spread[:count] - 1)
    if count and off.max() > COARSE:
        k = int(np.argmax(off))
        way = "low" if lumped[k] < spread[k] else "high"
        yield (
            f"the shaft's elements are long for the band of the hammer test: mode {k + 1} at {lumped[k]:.2f} Hz is {100 * off[k]:.2g} % too {way} in modes, FRFs and virtual tests, whose masses are at "
            f"nodes, and {spread[k]:.0f} Hz with masses along the elements; half of longest_element_mm makes that a quarter"
        )


def _running(found: Looked) -> Iterator[str]:
    spindle = found.spindle
    own = spindle.imperfections
    if spindle.structure.turns and not (own.unbalance or own.couple_unbalance or own.bearings):
        yield "no imperfections are told: runout, map and report draw plausible ones of seed 0; the table [imperfections] holds the spindle's own, or a seed and a grade"
    turning = {b.name for b in spindle.structure.bodies if b.turns}
    for joint in spindle.structure.joints:
        for one, other in (joint.bodies, joint.bodies[::-1]):
            if one in turning and other not in turning:
                of = spindle.structure.carrier
                yield f"joint {joint.name}: {of(one)!r} turns and {of(other)!r} does not, so that what hangs on it has no gyroscopic moment"
    if spindle.regions and spindle.bearings and not spindle.thermal.sources and not spindle.thermal.convections:
        yield "nothing cools the section"


def _planes(found: Looked) -> Iterator[str]:
    """An unbalance or a radial load at a height at which the part it acts on is not."""
    spindle, own = found.spindle, found.spindle.imperfections
    if not spindle.structure.turns:
        return
    planes = [(load.key, load.z, load_carrier(spindle, load)) for load in spindle.radial_loads]
    if own.unbalance or own.couple_unbalance:
        planes.insert(0, (UNBALANCE, own.unbalance_z, unbalanced(spindle)))
    for key, z, body in planes:
        part = spindle.structure.carrier(body.name)
        reach = 0.0 if body.regions or part != body.name else FAR * np.sqrt(max(body.inertia[:2]) / body.mass)
        low, high = (pick(ends) for pick, ends in zip((min, max), zip(*turning_parts(spindle)[part], strict=True), strict=True))
        if max(low - z, z - high) > reach + SAME_HEIGHT:
            what = f"whose centre of mass is at {low / MM:g}" if low == high else f"which spans {low / MM:g} to {high / MM:g}"
            yield f"{key}z_mm = {z / MM:g}: lies beyond {part!r}, on which it acts, {what}"


def _effects(found: Looked) -> Iterator[str]:
    for effect, _ in of_scene(found.spindle):
        if why := refusal(effect, found.spindle):
            yield f"effect {effect.name}: {why}"


def _sections(found: Looked) -> Iterator[str]:
    """Neighbouring diameters that differ so much that a beam is no longer one."""
    for shaft in found.spindle.structure.shafts:
        for a, b in pairwise(shaft.segments):
            if max(a.outer[1], b.outer[0]) > 4 * min(a.outer[1], b.outer[0]):
                yield f"shaft {shaft.name!r}: its diameter jumps from {2 * a.outer[1] / MM:g} to {2 * b.outer[0] / MM:g} mm at z_mm = {a.z[1] / MM:g}; a disc as a body of its own is nearer the truth"


def _count(n: int, one: str, many: str = "") -> str:
    return f"{n} {one}" if n == 1 else f"{n} {many or one + 's'}"


QUESTIONS: tuple[Callable[[Looked], Iterator[str]], ...] = (
    *OF_BEARINGS, _seats, _materials, _compact, _vast, _slow, _massless, _free, _lost, _undamped, _damping, _critical, _sections, _points, _hammer, _mesh, _running, _planes, _effects,
)  # fmt: skip
