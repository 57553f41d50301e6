"""A small campaign of a rotor on two modes, and its files as other programs write them."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from thermospindle.model.drawing.measuring import Point
from thermospindle.model.units import RPM
from thermospindle.sim.campaign.campaign import Campaign, Noise, Test
from thermospindle.sim.campaign.modes import ModeRow
from thermospindle.sim.identification.frf import Frf

POINTS = (
    Point(1, "hub_top0", "hub", (0.012, 0.0, 0.02), (0.0, 0.0, 1.0)),
    Point(3, "hub_side0", "hub", (0.0125, 0.0, 0.015), (-1.0, 0.0, 0.0)),
    Point(6, "seat90", "seat", (0.0, 0.02, 0.0), (0.0, 0.0, 1.0)),
)
SHAPES = np.array([[0.9, 0.4, -0.7], [0.6, -1.1, 0.8]])  # two modes at the three points, kg^-1/2
FREQUENCY = 400.0 + np.arange(301)


def rotor_frf(frequency: np.ndarray = FREQUENCY, quantity: str = "mobility", gyroscopic: float = 0.0, noise: float = 0.002) -> Frf:
    """FRFs from hammers 1 and 6 of two modes at 480 and 600 Hz, 1 % damped, coupled by `gyroscopic` (rad/s)."""
    s = 2j * np.pi * frequency[:, None, None]
    w = np.diag(2 * np.pi * np.array([480.0, 600.0]))
    dynamic = s**2 * np.eye(2) + s * (0.02 * w + gyroscopic * np.array([[0, 1], [-1, 0]])) + w**2
    value = np.einsum("mr,nmk,kq->rqn", SHAPES, np.linalg.inv(dynamic), SHAPES[:, [0, 2]])
    value = value * (2j * np.pi * frequency) ** ("receptance", "mobility", "accelerance").index(quantity)
    random = np.random.default_rng(1)
    error = noise * np.abs(value).max() * (random.standard_normal((2, *value.shape)) / np.sqrt(2))
    sd = np.full(value.shape, noise * np.abs(value).max()) if noise else None
    return Frf(frequency, value + error[0] + 1j * error[1], (1, 3, 6), (1, 6), quantity, 1 - 0.02 * random.random(value.shape), sd)


def campaign(**changes: object) -> Campaign:
    tests = (
        Test("T20_n0", 20.0, 0.0, frf=rotor_frf()),
        Test(
            "T20.5_n7200", 20.5, 7200 * RPM, 3.3, 1234.5, 2,
            {"air": "dry; Ω é", "humidity": 0.1, "open": True, "list": [1, 2.5], "sub table": {"a": -3}},
            rotor_frf(gyroscopic=150.0),
            (ModeRow("T20.5_n7200", 1, "axial", 1 / 3, 0.01), ModeRow("T20.5_n7200", 2, "rocking", 1738.1, 0.1, 0.011, 1e-4 / 3)),
        ),
    )  # fmt: skip
    return replace(Campaign('Zwei "Tests"\nin °C', "hdd_2003", "mobility", POINTS, tests, Noise(0.004, 0.0002), "a note"), **changes)  # type: ignore[arg-type]


def other_campaign(modes: Sequence[ModeRow], temperature: float = 20.0, speed: float = 0.0) -> Campaign:
    ids = dict.fromkeys(m.test for m in modes)
    tests = tuple(Test(i, temperature, speed, modes=tuple(m for m in modes if m.test == i)) for i in ids)
    return Campaign("other", "hdd_2003", "mobility", (), tests)


def sets_of(file: Path) -> list[bytes]:
    """The sets of a 58b file, each from its opening line to its closing one."""
    return [b"    -1\n" + s for s in re.split(rb"(?<=    -1\n)    -1\n", file.read_bytes().removeprefix(b"    -1\n"))]


def ascii_58(frequency: np.ndarray, value: np.ndarray, precision: int, even: bool) -> bytes:
    """An ASCII dataset 58 of H(1,1), mobility, by the published formats (precision 5 single, 6 double complex)."""
    head = "model\nNONE\n17-Oct-17 13:50:13\nNONE\nNONE\n    4         0    0         0 NONE               1   3 NONE               1   3\n"
    step = frequency[1] - frequency[0]
    head += f"{precision:10d}{len(frequency):10d}{even:10d}{even * frequency[0]:13.5E}{even * step:13.5E}{0:13.5E}\n"
    units = ((18, "Hz"), (11, "mm/s"), (13, "lbf"), (0, "NONE"))
    head += "".join(f"{kind:10d}{0:5d}{0:5d}{0:5d} {'NONE':20} {unit:20}\n" for kind, unit in units)
    width = "13.5E" if precision == 5 else "20.12E"
    cells = []
    for f, z in zip(frequency, value, strict=True):
        cells += ([] if even else [f"{f:13.5E}"]) + [f"{z.real:{width}}", f"{z.imag:{width}}"]
    a_line = 6 if precision == 5 else (4 if even else 3)
    body = "".join("".join(cells[i : i + a_line]) + "\n" for i in range(0, len(cells), a_line))
    return f"    -1\n    58\n{head}{body}    -1\n".encode()
