"""The answers of `static` in words and numbers."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from rich.console import Console

from thermospindle.model.rotor.static import Static
from thermospindle.report.text.grid import show_grid


def axis_name(direction: Sequence[float]) -> str:
    """A unit vector along an axis as +X, -Y ..."""
    along = max(range(3), key=lambda i: abs(direction[i]))
    return ("+" if direction[along] > 0 else "-") + "XYZ"[along]


def static_json(answers: Sequence[Static], bearings: str, beam: str) -> dict[str, Any]:
    """By point: stiffness (None where nothing holds it), reactions and shares of the compliance."""
    points = {
        a.point.name: {
            "direction": axis_name(a.point.direction),
            "stiffness_N_per_m": a.stiffness if 0 < a.stiffness < float("inf") else None,
            "free": a.stiffness == 0.0,
            "reactions_N": dict(a.reactions),
            "compliance_shares": dict(a.shares),
        }
        for a in answers
    }
    return {"bearings": bearings, "beam": beam, "points": points}


def show_static(console: Console, values: dict[str, Any]) -> None:
    """A table of stiffness and bearing reactions, and one of where the compliance of each point sits."""
    points = values["points"]
    reactions, parts = (list(dict.fromkeys(name for row in points.values() for name in row[key])) for key in ("reactions_N", "compliance_shares"))
    told = f"bearings {values['bearings']}" + (f", beam {values['beam']}" if values["beam"] != "none" else "")
    show_grid(
        console,
        f"Stiffness at each point, and what every bearing bears of 1 N there ({told})",
        ["point", "along", "stiffness\nN/um", *(f"{name}\nN" for name in reactions)],
        [[name, row["direction"], _stiffness(row), *("-" if row["free"] else f"{row['reactions_N'].get(b, 0.0):+z.4f}" for b in reactions)] for name, row in points.items()],
        words=("point", "along"),
    )
    if not parts:
        return  # every point is free to move
    console.print()
    show_grid(
        console,
        "Share of the compliance at each point in every part, %",
        ["point", *(f"{name}\n%" for name in parts)],
        [[name, *("-" if row["free"] else f"{100 * row['compliance_shares'].get(part, 0.0):.1f}" for part in parts)] for name, row in points.items()],
        words=("point",),
    )


def _stiffness(row: dict[str, Any]) -> str:
    if row["free"]:
        return "free to move"
    return "rigid" if row["stiffness_N_per_m"] is None else f"{row['stiffness_N_per_m'] / 1e6:.6g}"
