"""Where natural frequencies meet the lines of bearings and unbalance, over temperature and speed: a Campbell diagram with two axes.

Modes are followed by shape over the grid from the nominal condition, along temperature at the nominal speed and from there
along speed. A line (`model.bearing.kinematics`) crosses a mode where their difference changes sign between neighbours of
the grid; the crossing is then found with the exact operating point. Of a flexible spindle with hundreds of crossings only
the strongest are found so, and the others are interpolated between the grid's points (`sim.resonance.between`), with an
error that is measured on those found both ways. It counts only where the line can excite the mode:

- an axial line an axial mode, a radial line a rocking or lateral one;
- sense of whirl: of the modal force of a line, |psi f|^2, and of the same line whirling the other way, |psi f*|^2 (psi the left modal
  vector), the line must have a share of at least `SENSE`. A forward line finds no backward mode of an isotropic rotor, and both halves of
  a pair that anisotropy has split (Genta, *Dynamics of Rotating Systems*, 2005, sec. 2.4).

How strong a crossing is: amplitude of the mode's own part of the response, phi (psi f) / (i omega - pole), at the hub's probe
(`sim.running.probes.hub_probes`), under the imperfections of the scene, and per unit of the imperfection that makes the line.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np

from thermospindle.model.built.imperfections import Imperfections
from thermospindle.model.errors import BadInput
from thermospindle.model.machine import Condition, Spindle
from thermospindle.model.types import Array
from thermospindle.model.units import RPM
from thermospindle.sim.resonance.between import passes_zero
from thermospindle.sim.resonance.found import Coincidence, Curve, ResonanceMap, once, strongest
from thermospindle.sim.resonance.grid import PARTS, Candidate, Grid, same_direction

TEMPERATURES, SPEEDS = 21, 41  # of a map, where none are told
MULTIPLES = 3  # of the number of balls, and even ball orders, whose lines are drawn
DENSER = 18  # coincidences about which runout is computed at more places, as many as a report lists


def resonance_map(
    spindle: Spindle,
    temperatures: Sequence[float],
    speeds: Sequence[float],
    nominal: Condition,
    multiples: int = MULTIPLES,
    highest: float | None = None,
    imperfections: Imperfections | None = None,
    progress: Callable[[str], None] = lambda done: None,
    nearby: bool = False,
) -> ResonanceMap:
    """The map over `temperatures` (C) and `speeds` (rad/s, not negative), to which the nominal
    condition is added; with `nearby` also what is met just beyond these speeds.

    Modes up to `highest` (Hz, the scene's band by default) at the nominal condition are followed.
    `imperfections` default to the scene's (with those of its effects), or to a plausible set where it
    names none. BadInput for speeds without extent; of one temperature it is a Campbell diagram alone.
    """
    over_t, over_s = _with(nominal.temperature, temperatures), _with(nominal.speed, speeds)
    if len(over_s) < 2:
        raise BadInput(f"--speeds {over_s[0] / RPM:g}: a map needs at least two different ones, the nominal {nominal.speed / RPM:g} rpm included")
    if over_s[0] < 0:
        raise BadInput(f"speeds: {over_s[0] / RPM:g} rpm; a map goes over speeds of one sense, so none may be negative")
    grid = Grid(spindle, nominal, multiples, highest or spindle.hammer.band[1], imperfections)
    tracks, of_lines = grid.follow(over_t, over_s, progress)
    progress(f"{len(over_t)} temperatures x {len(over_s)} speeds")
    t0, s0 = int(np.searchsorted(over_t, nominal.temperature)), int(np.searchsorted(over_s, nominal.speed))
    candidates: list[tuple[Curve, list[Candidate]]] = []
    for own in of_lines:
        for track in tracks:
            if same_direction(own.line, track):
                gap = own.frequency - track.frequency
                curve = Curve(own.line, track, *_along_speed(gap, over_t, over_s))
                candidates.append((curve, grid.candidates(own, track, gap, curve, over_t, over_s, (t0, s0))))
    met_by, interpolated = grid.met([c for _, own in candidates for c in own], progress)
    curves = [curve for curve, own in candidates if any(id(c) in met_by for c in own)]
    found = [met_by[id(c)] for _, own in candidates for c in own if id(c) in met_by]
    found.sort(key=lambda c: (not c.at_nominal_speed, -c.strength, c.frequency))
    of_runout = [c for c in found if not c.repeats]  # which NRRO is made of
    crossed = [c for c in of_runout if c.condition.temperature == nominal.temperature]
    met = [c for c in of_runout if c.at_nominal_speed]
    found = once(found)
    progress(f"{len(found)} coincidences")
    along_s = np.array([(s, *grid.nrro(Condition(nominal.temperature, s), (t0, _nearest(over_s, s)))) for s in _dense(over_s, crossed, lambda c: c.condition.speed)])
    along_t = np.array([(t, *grid.nrro(Condition(t, nominal.speed), (_nearest(over_t, t), s0))) for t in _dense(over_t, met, lambda c: c.condition.temperature)])
    found = [_on_curve(c, along_s, along_t, nominal) for c in found]
    progress("runout along both axes")
    beyond = grid.beyond(tracks, of_lines, over_s, (t0, s0)) if nearby else ()
    return ResonanceMap(
        spindle, nominal, over_t, over_s, tracks, of_lines, tuple(curves), tuple(found), along_s, along_t, grid.drawn_from, interpolated, beyond
    )


def _with(nominal: float, values: Sequence[float]) -> Array:
    """Places of the grid in rising order with the nominal one, once: one that differs from it by
    rounding alone would be a neighbour that nothing can be interpolated to."""
    every = np.array(values, float)
    return np.unique([nominal, *every[~np.isclose(every, nominal, rtol=1e-9, atol=1e-9)]])


def speeds_about(spindle: Spindle, nominal: float, count: int) -> list[float]:
    """So many speeds (rad/s) of a map about a `nominal` one: from rest to twice that, or as far as the tables of bearings given by numbers."""
    fastest = min([2 * nominal, *(b.speed[-1] for b in spindle.linear_bearings if len(b.speed) > 1)])
    return np.linspace(0, fastest, count).tolist()


def stages(spindle: Spindle, temperatures: int) -> int:
    """How often `resonance_map` tells of its progress, about."""
    return temperatures + PARTS * (2 if spindle.structure.shafts else 1) + 3


def _nearest(values: Array, value: float) -> int:
    return int(np.argmin(np.abs(values - value)))


def _dense(grid: Array, met: Sequence[Coincidence], place: Callable[[Coincidence], float]) -> list[float]:
    """The grid, the places of all that is met at the nominal speed or was found exactly, where runout may have a peak
    that the grid misses, and some values more about those of the `DENSER` strongest, within one step of the grid."""
    step = float(np.diff(grid).max(initial=0.0))
    own = [place(c) for c in met if c.at_nominal_speed or not c.interpolated]
    more = [place(c) + share * step for c in strongest(met)[:DENSER] for share in (-0.5, -0.25, -0.1, 0.0, 0.1, 0.25, 0.5)]
    return sorted({*grid.tolist(), *(p for p in [*own, *more] if grid[0] <= p <= grid[-1])})


def _on_curve(c: Coincidence, along_s: Array, along_t: Array, nominal: Condition) -> Coincidence:
    """An interpolated coincidence with the runout that was computed where it is, if it was: the curves of runout and the list say the same."""
    if not c.interpolated or not (c.at_nominal_speed or c.condition.temperature == nominal.temperature):
        return c
    along, place = (along_t, c.condition.temperature) if c.at_nominal_speed else (along_s, c.condition.speed)
    here = along[along[:, 0] == place]
    return replace(c, nrro=float(here[0, 2 if c.line.direction == "axial" else 1])) if len(here) else c


def _along_speed(gap: Array, over_t: Array, over_s: Array) -> tuple[Array, Array]:
    """Temperatures and speeds where `gap` (T, S) passes zero between neighbouring speeds, by linear interpolation."""
    i, j = np.nonzero(passes_zero(gap))
    share = gap[i, j] / (gap[i, j] - gap[i, j + 1])
    return over_t[i], over_s[j] + share * (over_s[j + 1] - over_s[j])
