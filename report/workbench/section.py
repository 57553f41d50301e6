"""The section as polygons that move with their bodies: where every corner goes in a mode.

A corner at (x, z) of the plane through the axis moves by Re((a + ib) e^(i phase)) in that plane;
the plane is the one that the turning body, or whatever moves most, moves in.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from thermospindle.model.drawing.section import PARTS
from thermospindle.model.machine import Spindle
from thermospindle.model.rotor.chain import RotorBase
from thermospindle.model.rotor.look.colours import PLATE, SHADES, colour, region_bodies, region_colours
from thermospindle.model.rotor.look.meshes import plate
from thermospindle.model.rotor.look.shafts import drawn_by_shaft, slices
from thermospindle.model.rotor.modes import Mode
from thermospindle.model.rotor.section import Cell, cells
from thermospindle.model.structure import MOVES
from thermospindle.model.types import Array, ComplexArray

LARGEST = 0.07  # of the drawing's larger side, by which a mode moves at most
BALL = (0.74, 0.75, 0.77)
ROUND = 20  # corners of a ball


@dataclass(frozen=True, eq=False)
class Piece:
    """A polygon (k,) x, z in mm that moves with a body, and its colour (red, green, blue, 0 to 1)."""

    body: str
    x: Array
    z: Array
    rgb: tuple[float, float, float]


def pieces(spindle: Spindle) -> list[Piece]:
    """Both halves of everything that the section, flexible shafts and bodies without regions show."""
    hosts, colours = region_bodies(spindle), region_colours(spindle)
    found: list[Piece] = []
    for part in PARTS:
        for tile in cells([g for g in spindle.regions if g.part == part]):
            if not drawn_by_shaft(spindle, spindle.region(tile.region)):
                found += _both(hosts[tile.region], tile, colours[tile.region])
    for shaft in spindle.structure.shafts:
        tone = np.array(colour(shaft.segments[0].material))
        for k, (name, tiles) in enumerate(slices(shaft).items()):
            for tile in tiles:
                found += _both(name, tile, (SHADES[k % 2] * tone).tolist())
    shown = set(hosts.values()) | {name for shaft in spindle.structure.shafts for name in shaft.bodies}
    for body in spindle.structure.bodies:
        if body.name not in shown:
            found += _both(body.name, plate(spindle, body), PLATE)
    turn = np.linspace(0, 2 * np.pi, ROUND, endpoint=False)
    for b in spindle.bearings:
        for side in (1, -1):
            circle = b.ball_diameter / 2 * np.array([np.cos(turn), np.sin(turn)])
            found.append(Piece(b.inner_body, 1e3 * (side * b.pitch_diameter / 2 + circle[0]), 1e3 * (b.z + circle[1]), BALL))
    return found


def _both(body: str, tile: Cell, rgb: Sequence[float]) -> list[Piece]:
    r, z = 1e3 * np.array(tile.r)[[0, 1, 1, 0]], 1e3 * np.array(tile.z)[[0, 0, 1, 1]]
    return [Piece(body, side * r, z, (rgb[0], rgb[1], rgb[2])) for side in (1, -1)]


def moving(drawn: Sequence[Piece], chain: RotorBase, mode: Mode) -> list[tuple[ComplexArray, ComplexArray]]:
    """Complex displacements (k,) of every piece's corners along x and z in mm, the largest `LARGEST` of the drawing's size."""
    motion = {body.name: np.zeros(5, complex) for body in chain.bodies}
    for (name, move), value in zip(chain.dofs, mode.shape, strict=True):
        motion[name][MOVES.index(move)] = value
    height = {body.name: 1e3 * body.z for body in chain.bodies}
    azimuth = _plane(list(motion.values()))
    c, s = np.cos(azimuth), np.sin(azimuth)
    found = []
    for p in drawn:
        ux, uy, uz, tx, ty = motion.get(p.body, np.zeros(5, complex))
        tilt = ty * c - tx * s  # about the normal of the plane; per m, so per mm a thousandth
        x = (ux * c + uy * s) + 1e-3 * tilt * (p.z - height.get(p.body, 0.0))
        found.append((x, uz - 1e-3 * tilt * p.x))
    size = max((float(np.abs(v).max()) for pair in found for v in pair), default=0.0) or 1.0
    reach = max(np.ptp(np.concatenate([p.x for p in drawn])), np.ptp(np.concatenate([p.z for p in drawn])))
    factor = LARGEST * reach / size
    return [(factor * x, factor * z) for x, z in found]


def _plane(motions: Sequence[ComplexArray]) -> float:
    """Azimuth (rad) of the plane with the most lateral motion and tilt; tilts count by the motion at a tenth of a metre."""
    lateral = np.array([pair for m in motions for pair in ((m[0], m[1]), (0.1 * m[4], -0.1 * m[3]))])
    matrix = (lateral.T @ lateral.conj()).real
    return float(0.5 * np.arctan2(2 * matrix[0, 1], matrix[0, 0] - matrix[1, 1]))
