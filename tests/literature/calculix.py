"""The input of CalculiX (`ccx`, GPL-2, https://www.calculix.de, a Debian package) for the free
bending of a stepped hollow shaft, as a solid.

A quarter of the shaft in bricks of 20 nodes (C3D20R): bending along x is symmetric about the plane y = 0 and antisymmetric about x = 0. Two
motions of it are rigid, and come out as frequencies of nearly nothing.
"""

from __future__ import annotations

import subprocess
from itertools import pairwise, product
from pathlib import Path

import numpy as np

from thermospindle.model.shaft import Segment

ABOUT = 4  # elements of a quarter turn
CORNERS = [(0, 0, 0), (2, 0, 0), (2, 2, 0), (0, 2, 0), (0, 0, 2), (2, 0, 2), (2, 2, 2), (0, 2, 2)]
EDGES = [(0, 1), (1, 2), (2, 3), (3, 0), (4, 5), (5, 6), (6, 7), (7, 4), (0, 4), (1, 5), (2, 6), (3, 7)]


def deck(segments: tuple[Segment, ...], modulus: float, poisson: float, density: float, longest: float, modes: int = 6) -> str:
    """The text of the input; elements up to `longest` (m) along the shaft and 1.5 times that across it. SI units."""
    radii = _divided(sorted({r for s in segments for r in (*s.outer, *s.bore)}), 1.5 * longest)
    heights = _divided(sorted({z for s in segments for z in s.z}), longest)
    number: dict[tuple[int, int, int], int] = {}
    elements = []
    for i, k in product(range(len(radii) - 1), range(len(heights) - 1)):
        r, z = (radii[i] + radii[i + 1]) / 2, (heights[k] + heights[k + 1]) / 2
        own = next(s for s in segments if s.z[0] < z < s.z[1])
        if not own.bore[0] < r < own.outer[0]:
            continue
        for j in range(ABOUT):
            at = [(2 * i + a, 2 * j + b, 2 * k + c) for a, b, c in CORNERS]
            at += [tuple((p + q) // 2 for p, q in zip(at[a], at[b], strict=True)) for a, b in EDGES]
            elements.append([number.setdefault(place, len(number) + 1) for place in at])
    both = [np.interp(np.arange(2 * len(v) - 1), np.arange(0, 2 * len(v), 2), v) for v in (radii, heights)]
    lines = ["*NODE, NSET=ALL"]
    for (i, j, k), n in number.items():
        angle = np.pi / 4 * j / ABOUT
        lines.append(f"{n}, {both[0][i] * np.cos(angle):.12g}, {both[0][i] * np.sin(angle):.12g}, {both[1][k]:.12g}")
    lines.append("*ELEMENT, TYPE=C3D20R, ELSET=SHAFT")
    for n, own in enumerate(elements, 1):
        lines += [f"{n}, " + ", ".join(map(str, own[:10])) + ",", ", ".join(map(str, own[10:]))]
    lines += ["*BOUNDARY"]
    for (_, j, _), n in number.items():
        lines += [f"{n}, 2, 2"] if j == 0 else [f"{n}, 2, 3"] if j == 2 * ABOUT else []
    lines += ["*MATERIAL, NAME=STEEL", "*ELASTIC", f"{modulus:.9g}, {poisson:.9g}", "*DENSITY", f"{density:.9g}"]
    lines += ["*SOLID SECTION, ELSET=SHAFT, MATERIAL=STEEL", "*STEP", "*FREQUENCY", str(modes), "*END STEP", ""]
    return "\n".join(lines)


def _divided(values: list[float], longest: float) -> list[float]:
    found = values[:1]
    for a, b in pairwise(values):
        count = max(1, int(np.ceil((b - a) / longest - 1e-9)))
        found += [a + (b - a) * k / count for k in range(1, count + 1)]
    return found


def solved(ccx: str, folder: Path, text: str) -> list[float]:
    """Frequencies (Hz) that `ccx` finds for an input, rigid motions left out."""
    (folder / "shaft.inp").write_text(text, encoding="ascii")
    done = subprocess.run([ccx, "-i", "shaft"], cwd=folder, capture_output=True, text=True, timeout=900, check=False)
    rows = []
    for line in (folder / "shaft.dat").read_text(encoding="ascii").splitlines():
        words = line.split()
        if len(words) == 5 and words[0].isdigit():
            rows.append(float(words[3]))
        elif rows and "PARTICIPATION" in line.replace(" ", ""):
            break
    if not rows:
        raise RuntimeError(done.stdout[-500:])
    return [f for f in rows if f > 1.0]
