"""Rotors whose answers others printed: Friswell's examples, Nelson and McVaugh's rotor, a spinning beam.

Friswell, Penny, Garvey, Lees, Dynamics of Rotating Machines (2010): examples 5.9.1, 5.9.2, 5.9.3, 5.9.5 and 5.9.9 with the numbers that
petrobras/ross (Apache-2.0, 631a249a) asserts in `ross/tests/test_examples.py`: natural frequencies of consistent-mass Timoshenko beams,
in rad/s or Hz as there; its torsion (650.41 rad/s, 647.75 in 5.9.9) is left out, which these models do not have; example 5.9.4 has
bearings that are not symmetric, which no scene has. Nelson, McVaugh, The dynamics of rotor-bearing systems using finite elements, J. Eng.
Ind. 98 (1976): the rotor, with the numbers of an independent beam code for it; what is quoted of the paper itself differs by up to 1.4 %.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.linalg import eig

from thermospindle.model.bearing.pair import solve
from thermospindle.model.machine import Condition, Spindle
from thermospindle.model.rotor.beam import with_theory
from thermospindle.model.rotor.chain import RotorBase, matrices, rotor_base
from thermospindle.model.rotor.modes import Mode, modes
from thermospindle.model.scene.reading import build
from thermospindle.model.units import RPM

STIFF = 1e12
"""N/m and N m/rad by which discs are fixed to their node."""


def rotor(
    steel: tuple[float, float, float],
    pieces: Sequence[tuple[float, float]],
    bores: Sequence[tuple[float, float]],
    discs: Sequence[tuple[float, float, float, float]],
    bearings: Sequence[tuple[float, float, float]],
    damping_ratio: float = 0.0,
    longest: float = 25.0,
) -> Spindle:
    """A scene: `steel` (GPa, Poisson, kg/m3), pieces (diameter, length) in mm, discs (z mm, kg, tilt, polar), bearings (z mm, x, y in N/m)."""
    free = {"origin": "printed", "source": "see the test"}
    young, poisson, density = steel
    bodies = [
        {"name": f"disc {k}", "mass_kg": mass, "tilt_inertia_kg_m2": [tilt, tilt], "polar_inertia_kg_m2": polar, "z_mm": z, "turns": True}
        | {"moves": ["x", "y", "z", "tilt_x", "tilt_y"]}
        for k, (z, mass, tilt, polar) in enumerate(discs)
    ]
    joints = [
        {"name": f"fit {k}", "group": "discs", "between": ["shaft", f"disc {k}"], "z_mm": z, "damping_ratio": 0.0, "axial_stiffness_N_per_m": STIFF}
        | {"lateral_stiffness_N_per_m": [STIFF, STIFF], "tilt_stiffness_N_m_per_rad": [STIFF, STIFF]}
        for k, (z, *_) in enumerate(discs)
    ]
    shaft: dict[str, Any] = {"name": "shaft", "material": "steel", "turns": True, "outer_mm": [list(p) for p in pieces], "damping_ratio": 0.0}
    shaft |= {"bore_mm": [list(p) for p in bores]} if bores else {}
    raw = {
        "title": "rotor",
        "reference_temperature_C": 20.0,
        "materials": {
            "steel": free
            | {"youngs_modulus_GPa": young, "poisson_ratio": poisson, "thermal_expansion_um_per_m_K": 11.5, "density_kg_per_m3": density}
            | {"conductivity_W_per_m_K": 46.0, "heat_capacity_J_per_kg_K": 460.0}
        },
        "shafts": [free | shaft | {"longest_element_mm": longest}],
        "bearings": {
            f"b{k}": free | {"z_mm": z, "numbers": {"matrix_SI": np.diag([kx, ky, 0.0, 0.0, 0.0]).tolist(), "damping_ratio": damping_ratio}}
            for k, (z, kx, ky) in enumerate(bearings)
        },
        "structure": free | {"inner_body": "shaft", "outer_body": "ground", "damping_frequency_Hz": 100.0, "bodies": bodies, "joints": joints},
    }
    return build(raw, Path("rotor/spindle.toml"))


def chain(spindle: Spindle, speed: float = 0.0) -> RotorBase:
    return rotor_base(spindle, solve(spindle, Condition(20.0, speed), {}))


def lateral(spindle: Spindle, rpm: float) -> list[Mode]:
    """Modes across the axis at a speed."""
    built = chain(spindle, rpm * RPM)
    along = np.array([move == "z" for _, move in built.dofs])
    return [m for m in modes(built) if np.abs(m.shape[along]).max() < 1e-3 * np.abs(m.shape).max()]


ROSS_STEEL = (211.0, 211.0 / (2 * 81.2) - 1, 7810.0)


def friswell_disc(z: float, diameter: float) -> tuple[float, float, float, float]:
    """A disc of 70 mm with a bore of 50 mm."""
    a, b, h = 0.5e-3 * diameter, 0.025, 0.07
    mass = 7810.0 * np.pi * (a**2 - b**2) * h
    return z, mass, mass / 12 * (3 * (a**2 + b**2) + h**2), mass / 2 * (a**2 + b**2)


def two_discs(kx: float, ky: float, damping_ratio: float = 0.0) -> Spindle:
    """The rotor of examples 5.9.1 to 5.9.5: 1.5 m of 50 mm, discs at a third and two thirds."""
    ends = [(0.0, kx, ky), (1500.0, kx, ky)]
    return rotor(ROSS_STEEL, [(50, 1500)], [], [friswell_disc(500.0, 280.0), friswell_disc(1000.0, 350.0)], ends, damping_ratio)


def overhung() -> Spindle:
    return rotor(ROSS_STEEL, [(50, 1500)], [], [friswell_disc(1500.0, 350.0)], [(0.0, 1e7, 1e7), (1000.0, 1e7, 1e7)])


FRISWELL = [
    ("5.9.1", two_discs(1e6, 1e6), 0, [86.66, 86.66, 274.31, 274.31, 716.78]),
    ("5.9.1", two_discs(1e6, 1e6), 4000, [85.39, 87.80, 251.78, 294.71, 600.18]),
    ("5.9.2", two_discs(1e6, 8e5), 0, [82.65, 86.66, 254.52, 274.31, 679.49]),
    ("5.9.2", two_discs(1e6, 8e5), 4000, [82.33, 86.86, 239.64, 287.25, 583.49]),
    ("5.9.9", overhung(), 0, [90.14, 90.14, 630.73, 630.73]),
    ("5.9.9", overhung(), 4000, [76.19, 103.91, 565.99, 634.23]),
]


@pytest.mark.parametrize(("example", "spindle", "rpm", "printed"), FRISWELL, ids=[f"{e}-{rpm}" for e, _, rpm, _ in FRISWELL])
def test_friswell(example: str, spindle: Spindle, rpm: float, printed: list[float]) -> None:
    """rad/s to 1e-3, as asserted there."""
    found = [2 * np.pi * m.frequency for m in lateral(spindle, rpm)][: len(printed)]
    assert found == pytest.approx(printed, rel=1e-3)


def test_friswell_5_9_3_mixed_modes() -> None:
    """Very unequal bearings; numbers in Hz, asserted loosely there, to 2e-3 here."""
    found = [m.frequency for m in lateral(two_discs(1e6, 2e5), 4000)][:6]
    assert found == pytest.approx([8.545, 13.77, 22.35, 44.06, 78.76, 120.4], rel=2e-3)


@pytest.mark.parametrize(
    ("rpm", "undamped", "damped", "within"),
    [
        (0, [13.91, 13.91, 48.18, 48.18, 137.06, 137.06], [13.89, 13.89, 46.54, 46.54, 103.22, 103.22], 1e-2),
        (4000, [13.70, 14.09, 43.61, 52.18, 103.52], [13.68, 14.07, 41.98, 50.65, 103.52], 1e-2),
    ],
)
def test_friswell_5_9_5_damped_bearings(rpm: float, undamped: list[float], damped: list[float], within: float) -> None:
    """|pole| and its imaginary part, Hz, 3 kN s/m in each bearing; the fifth at speed is the torsion of the source."""
    ratio = 3e3 / 1e6 * 2 * np.pi * 100.0 / 2
    found = lateral(two_discs(1e6, 1e6, ratio), rpm)
    pairs = [(u, d) for u, d in zip(undamped, damped, strict=True) if abs(u - 650.41 / (2 * np.pi)) > 0.1]
    own = [(m.frequency * abs(np.sqrt(1 - m.damping_ratio**2)), m) for m in found][: len(pairs)]
    for (_, d), (frequency, mode) in zip(pairs, own, strict=True):
        assert min(abs(frequency / d - 1), abs(mode.frequency / d - 1)) < within


def test_the_first_critical_speeds_meet_the_whirl_of_friswell() -> None:
    """5.9.1 isotropic: at a critical speed a mode turns with the shaft, by both roads."""
    spindle = two_discs(1e6, 1e6)
    first = critical(chain(spindle, 1.0))[0]
    assert min(abs(2 * np.pi * m.frequency / first - 1) for m in lateral(spindle, first / RPM)) < 1e-6


# ---------------------------------------------------------------- Nelson and McVaugh

PLACES = [0, 1.27, 5.08, 7.62, 8.89, 10.16, 10.67, 11.43, 12.70, 13.46, 16.51, 19.05, 22.86, 26.67, 28.70, 30.48, 31.50, 34.54, 35.81]  # cm
OUTER = [0.51, 1.02, 0.76, 2.03, 2.03, 3.30, 3.30, 2.54, 2.54, 1.27, 1.27, 1.52, 1.52, 1.27, 1.27, 3.81, 2.03, 2.03]  # cm, radii
BORE = {6: 1.52, 7: 1.78, 17: 1.52}


@pytest.fixture(scope="module")
def nelson() -> Spindle:
    lengths = 10 * np.diff(PLACES)
    pieces = [(20 * r, float(x)) for r, x in zip(OUTER, lengths, strict=True)]
    bores = [(20 * BORE.get(k, 0.0), float(x)) for k, x in enumerate(lengths)]
    bearings = [(10 * PLACES[k - 1], 4.378e7, 4.378e7) for k in (11, 15)]
    return rotor((207.8, 0.3, 7806.0), pieces, bores, [(88.9, 1.401, 1.36e-3, 2.03e-3)], bearings, longest=6.0)


def critical(built: RotorBase) -> list[float]:
    """Speeds (rad/s) at which a mode turns with the shaft, from a chain at 1 rad/s without damping: K x = w^2 (M - i G) x."""
    linear = matrices(built)
    value = eig(linear.stiffness, linear.mass - 1j * linear.damping, right=False)
    return sorted(float(np.sqrt(v.real)) for v in value if v.real > 1e3 and abs(v.imag) < 1e-6 * abs(v))


def test_nelson_at_rest(nelson: Spindle) -> None:
    found = [m.frequency for m in lateral(nelson, 0)][:8:2]
    assert found == pytest.approx([268.98, 790.51, 1261.48, 1990.55], rel=1e-3)


@pytest.mark.parametrize(
    ("shares", "expected"),
    [((0.0, 1.0), [15475, 17157, 45953, 49298, 64733, 95832]), ((1.0, 1.0), [15359, 17008, 45716, 48990, 64160, 94648])],
    ids=["rayleigh", "timoshenko"],
)
def test_nelson_critical_speeds(nelson: Spindle, shares: tuple[float, float], expected: list[float]) -> None:
    bent = replace(nelson, structure=with_theory(nelson.structure, nelson.materials, 20.0, shares))
    speeds = [w / RPM for w in critical(chain(bent, 1.0))]
    for rpm in expected:
        assert min(abs(s / rpm - 1) for s in speeds) < 2e-3


# ---------------------------------------------------------------- spinning beam


def test_a_spinning_beam_splits_as_its_closed_form() -> None:
    """A pinned Rayleigh beam of circular section that spins at W: w^2 (1 + r^2 n^2) - 2 r^2 n^2 W w - w0^2 = 0, with n = pi / L, radius
    of gyration r = d / 4, and w0^2 = E I n^4 / (rho A): forward and backward whirl (Genta, Dynamics of Rotating Systems, 2005, 5.2)."""
    length, d, young, density = 1.0, 0.1, 210e9, 7850.0
    spindle = rotor((210.0, 0.3, density), [(1e3 * d, 1e3 * length)], [], [], [(0.0, 1e13, 1e13), (1e3 * length, 1e13, 1e13)], longest=10.0)
    spindle = replace(spindle, structure=with_theory(spindle.structure, spindle.materials, 20.0, (0.0, 1.0)))
    speed = 30_000 * RPM
    n, r = np.pi / length, d / 4
    b = (r * n) ** 2
    w0 = np.sqrt(young * (np.pi * d**4 / 64) * n**4 / (density * np.pi * d**2 / 4))
    roots = np.abs(np.roots([1 + b, -2 * b * speed, -(w0**2)]))
    found = sorted(2 * np.pi * m.frequency for m in lateral(spindle, 30_000))[:2]
    assert found == pytest.approx(sorted(roots), rel=1e-4)
    assert roots.max() / roots.min() > 1.02  # the split is there to be seen
