"""Variants of effects of the bearings: preload, contacts, film, bond, fit."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from scipy.optimize import brentq

from model.ball_row import Array, respond
from model.machine import Condition, Law, RingMotion, Spindle
from model.pair import BearingState, PairState, solve
from model.rotor_base import Element, RotorBase
from model.tolerance import with_preload
from tests.variants.thermal import FAST
from tests.variants.variant import Told, each_bearing, each_element, in_series, turning, variant, warm, with_material, with_stiffness

BEARINGS = ("lower", "upper")
Motions = dict[str, RingMotion]


def translations(compliance: float) -> Array:
    return np.diag([compliance] * 3 + [0.0, 0.0])


def less_preload(spindle: Spindle, condition: Condition, size: float) -> Spindle:
    return with_preload(spindle, spindle.pair.preload * (1 - size)) if size else spindle


def moved_apart(motions: Motions, distance: float) -> Motions:
    """The outer rings of a back-to-back pair moved apart by `distance` (m), which loads them."""
    up, low = motions["upper"], motions["lower"]
    upper, lower = replace(up, outer_z=up.outer_z + distance / 2), replace(low, outer_z=low.outer_z - distance / 2)
    return motions | {"upper": upper, "lower": lower}


def seats_settle(spindle: Spindle, condition: Condition, size: float, motions: Motions) -> Motions:
    return moved_apart(motions, -1e-6 * size)


def spring_of_rate(spindle: Spindle, condition: Condition, size: float, motions: Motions) -> Motions:
    """A spring of compliance `size` (um/N) between outer rings that slide: they part by h where P(h) = P0 - h / size."""
    if size == 0:
        return motions

    def excess(h: float) -> float:
        load = solve(spindle, condition, moved_apart(motions, h)).bearing("upper").preload
        return h - 1e-6 * size * (spindle.pair.preload - load)

    return moved_apart(motions, float(brentq(excess, -5e-6, 40e-6, xtol=1e-12)))


def share_by_spring(spindle: Spindle, condition: Condition, size: float, state: PairState) -> PairState:
    """Stiffness between that of fixed positions (0) and of the reference preload at the angle of that temperature (1): k ~ F^(1/3)."""

    def change(b: BearingState) -> BearingState:
        return with_stiffness(b, b.stiffness * (1 + size * ((spindle.pair.preload / b.preload) ** (1 / 3) - 1)))

    return each_bearing(state, change)


def clearance_with_temperature(spindle: Spindle, condition: Condition, size: float, motions: Motions) -> Motions:
    """Diametral clearance grows by `size` um from 20 to 60 C."""
    opening = 1e-6 * size / 2 * warm(condition.temperature)
    return {name: replace(m, outer_r=m.outer_r + opening) for name, m in motions.items()}


def clearance_by_wear(spindle: Spindle, condition: Condition, size: float, motions: Motions) -> Motions:
    """`size` um of diametral clearance at every temperature, half from either groove."""
    part = 1e-6 * size / 4
    return {name: replace(m, outer_r=m.outer_r + part, inner_r=m.inner_r - part) for name, m in motions.items()}


def bond_by_glass_transition(spindle: Spindle, condition: Condition, size: float, chain: RotorBase) -> RotorBase:
    """Outer rings on a bond of size / 10 nm/N that softens about 48 C, over 5 K, by `size` nm/N; its loss factor is 0.2 there."""
    share = 1 / (1 + np.exp(-(condition.temperature - 48) / 5))
    compliance = translations(1e-9 * size * (0.1 + share))
    return each_element(chain, BEARINGS, lambda e: in_series(e, compliance, 0.02 + 0.8 * share * (1 - share)))


def bond_by_creep(spindle: Spindle, condition: Condition, size: float, chain: RotorBase) -> RotorBase:
    """A bond whose compliance doubles every 12 K, with shells 3 mm wide that tilt too; `size` nm/N at 60 C."""
    c = 1e-9 * size * 2 ** ((condition.temperature - 60) / 12)
    compliance = np.diag([c, c, c, 12 * c / 3e-3**2 / 10, 12 * c / 3e-3**2 / 10])
    return each_element(chain, BEARINGS, lambda e: in_series(e, compliance, 0.1))


def other_balls(spindle: Spindle, name: str, share: float, modulus: float, poisson: float, expansion: float, density: float) -> Spindle:
    steel = spindle.materials["steel"]

    def mixed(ours: float, theirs: float) -> float:
        return (1 - share) * ours + share * theirs

    ball = replace(
        steel,
        name=name,
        youngs_modulus=Law((20.0,), (mixed(steel.youngs_modulus(20.0), modulus),)),
        poisson_ratio=mixed(steel.poisson_ratio, poisson),
        thermal_expansion=Law((20.0,), (mixed(steel.thermal_expansion(20.0), expansion),)),
        density=mixed(steel.density, density),
    )
    bearings = tuple(replace(b, ball_material=name) for b in spindle.bearings)
    return replace(with_material(spindle, ball), bearings=bearings)


def silicon_nitride(spindle: Spindle, condition: Condition, size: float) -> Spindle:
    return other_balls(spindle, "silicon nitride", size, 310e9, 0.27, 3.2e-6, 3200)


def zirconia(spindle: Spindle, condition: Condition, size: float) -> Spindle:
    return other_balls(spindle, "zirconia", size, 205e9, 0.30, 9.5e-6, 6050)


def film(spindle: Spindle, condition: Condition) -> float:
    """Film thickness over that at 7200 rpm and 20 C, (viscosity speed)^0.67 (Hamrock & Dowson)."""
    viscosity = spindle.thermal.friction.viscosity
    return float((turning(condition.speed) * viscosity(condition.temperature) / viscosity(20.0)) ** 0.67)


def film_thickens_balls(spindle: Spindle, condition: Condition, size: float, motions: Motions) -> Motions:
    """A film of `size` um in each of the two contacts wedges rings apart as a thicker ball does."""
    thicker = 2e-6 * size * film(spindle, condition) / spindle.bearings[0].ball_diameter
    return {name: replace(m, ball_strain=m.ball_strain + thicker) for name, m in motions.items()}


def film_softens(spindle: Spindle, condition: Condition, size: float, chain: RotorBase) -> RotorBase:
    """A film spring in series, `size` of the bearing's compliance at 7200 rpm and 20 C, and damping up by ten times that."""
    part = size * film(spindle, condition)
    return each_element(
        chain, BEARINGS, lambda e: replace(e, stiffness=e.stiffness / (1 + part), damping=e.damping * (1 + 10 * part) / (1 + part))
    )


def damping_times(chain: RotorBase, factor: float) -> RotorBase:
    return each_element(chain, BEARINGS, lambda e: replace(e, damping=e.damping * factor))


def grease_thins(spindle: Spindle, condition: Condition, size: float, chain: RotorBase) -> RotorBase:
    """A share `size` of the damping follows the base oil's viscosity."""
    viscosity = spindle.thermal.friction.viscosity
    return damping_times(chain, 1 - size + size * viscosity(condition.temperature) / viscosity(20.0))


def grease_exponential(spindle: Spindle, condition: Condition, size: float, chain: RotorBase) -> RotorBase:
    """exp(-size (T - 20))."""
    return damping_times(chain, float(np.exp(-size * (condition.temperature - 20))))


def heavy_balls(spindle: Spindle, condition: Condition, size: float) -> Spindle:
    """The model's own equilibrium of balls with inertia; its closed forms are checked elsewhere."""
    return replace(spindle, pair=replace(spindle.pair, ball_inertia=size))


def pull(factor: float) -> tuple[float, float]:
    """Axial force on the hub (N), radial stiffness of the gap (N/m) for a pull of `factor` N over a gap of 0.3 mm."""
    return -factor, -factor / 0.3e-3


def magnet_gap(chain: RotorBase, radial: float, axial: float) -> RotorBase:
    k = np.diag([radial, radial, axial, 0.0, 0.0])
    return replace(chain, elements=(*chain.elements, Element("magnet gap", "bearings", "base", "hub", 3e-3, k, np.zeros((5, 5)))))


def pulled(spindle: Spindle, condition: Condition, size: float) -> Spindle:
    return replace(spindle, pair=replace(spindle.pair, axial_bias=spindle.pair.axial_bias + pull(size)[0]))


def pulled_gap(spindle: Spindle, condition: Condition, size: float, chain: RotorBase) -> RotorBase:
    return magnet_gap(chain, pull(size)[1], 0.0) if size else chain


def remanence(temperature: float) -> float:
    """Remanence of NdFeB falls 0.12 %/K, its pull with the square."""
    return float((1 - 0.0012 * (temperature - 20)) ** 2)


def lifted(spindle: Spindle, condition: Condition, size: float) -> Spindle:
    return pulled(spindle, condition, -size * remanence(condition.temperature))


def lifted_gap(spindle: Spindle, condition: Condition, size: float, chain: RotorBase) -> RotorBase:
    radial = 10 * pull(size * remanence(condition.temperature))[1]
    return magnet_gap(chain, radial, -2 * radial) if size else chain


def askew(b: BearingState, tilt_x: float, tilt_y: float) -> BearingState:
    return with_stiffness(b, respond(b.row, np.array([0.0, 0.0, 0.0, tilt_x, tilt_y])).tangent) if tilt_x or tilt_y else b


def upper_askew(spindle: Spindle, condition: Condition, size: float, state: PairState) -> PairState:
    return each_bearing(state, lambda b: askew(b, 1e-3 * size * (b.name == "upper"), 0.0))


def both_askew(spindle: Spindle, condition: Condition, size: float, state: PairState) -> PairState:
    part = 1e-3 * size / np.sqrt(2)
    return each_bearing(state, lambda b: askew(b, part, part if b.name == "upper" else -part))


def softer_by_amplitude(spindle: Spindle, condition: Condition, size: float, state: PairState) -> PairState:
    """Hertz under x + A cos: the first harmonic's stiffness is k (1 - (A/x)^2 / 32); A is `size` um at 1 N."""
    amplitude = 1e-6 * size * condition.level
    return each_bearing(state, lambda b: with_stiffness(b, b.stiffness * (1 - min(amplitude / b.deformation, 1.0) ** 2 / 32)))


def softer_by_level(spindle: Spindle, condition: Condition, size: float, state: PairState) -> PairState:
    """A share `size` at 10 N, in proportion to the level."""
    return each_bearing(state, lambda b: with_stiffness(b, b.stiffness * (1 - size * condition.level / 10)))


LEVELS: tuple[Told, ...] = (
    *((float(t), 0.0, n, None) for t in (20, 40, 60) for n in (1.0, 6.0)),
    (20.0, 7200.0, 1.0, None),
    (60.0, 7200.0, 6.0, None),
)

OF_BEARINGS = (
    variant("preload_loss/assembly", "mounted with less preload", "1", 0.1, 0.3, spindle=less_preload),
    variant("preload_loss/settling", "the outer rings' seats have settled", "um", 0.15, 1.0, motions=seats_settle),
    variant("constant_force_preload/spring_rate", "a spring between the rings", "um/N", 0.02, 3.0, motions=spring_of_rate),
    variant("constant_force_preload/cube_root", "stiffness of a constant force", "1", 0.05, 1.0, pair=share_by_spring),
    variant("clearance_opening/with_temperature", "clearance grows with temperature", "um", 0.02, 0.6, motions=clearance_with_temperature),
    variant("clearance_opening/wear", "clearance is larger at all temperatures", "um", 0.1, 0.5, motions=clearance_by_wear),
    variant("bond_softening/glass_transition", "the outer rings' bond softens", "nm/N", 0.5, 15.0, chain=bond_by_glass_transition),
    variant("bond_softening/creep", "the bond's compliance doubles every 12 K", "nm/N", 0.6, 15.0, chain=bond_by_creep),
    variant("ball_material/silicon_nitride", "a share of ceramic", "1", 0.05, 1.0, spindle=silicon_nitride),
    variant("ball_material/zirconia", "a share of zirconia", "1", 0.3, 1.0, spindle=zirconia),
    variant("lubricant_film/thickness", "the film wedges the rings apart", "um", 0.005, 0.1, motions=film_thickens_balls),
    variant("lubricant_film/series", "the film is a spring in series", "1", 0.004, 0.08, chain=film_softens),
    variant("grease_damping/viscosity", "damping follows the oil", "1", 0.1, 0.9, chain=grease_thins),
    variant("grease_damping/exponential", "damping falls exponentially", "1/K", 0.003, 0.03, chain=grease_exponential),
    variant("ball_inertia/fast", "balls with inertia", "1", 0.5, 1.0, plan=FAST, spindle=heavy_balls),
    variant("magnetic_pull/down", "the motor pulls the hub down", "N", 1.5, 10.0, spindle=pulled, chain=pulled_gap),
    variant("magnetic_pull/up", "a magnet lifts the hub, less when warm", "N", 0.4, 8.0, spindle=lifted, chain=lifted_gap),
    variant("bearing_misalignment/upper", "the upper outer ring sits askew", "mrad", 0.08, 0.6, pair=upper_askew),
    variant("bearing_misalignment/both", "both outer rings sit askew", "mrad", 0.08, 0.4, pair=both_askew),
    variant("hertz_amplitude/harmonic", "softer with the amplitude squared", "um/N", 0.03, 0.15, plan=LEVELS, pair=softer_by_amplitude),
    variant("hertz_amplitude/linear", "softer in proportion to the level", "1", 0.002, 0.05, plan=LEVELS, pair=softer_by_level),
)  # fmt: skip
