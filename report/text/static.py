"""The answers of `static` in words and numbers."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from rich.console import Console
from rich.table import Table

from thermospindle.model.rotor.static import Static


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
    """A table of stiffness and reactions, and where the compliance of each point sits."""
    table = Table(title=f"unit force at each point; bearings {values['bearings']}, beam {values['beam']}")
    names = list(next(iter(values["points"].values()))["reactions_N"])
    for column in ("point", "along", "N/um", *(f"{n} N" for n in names), "compliance"):
        table.add_column(column, justify="left" if column in ("point", "along", "compliance") else "right")
    for name, row in values["points"].items():
        stiffness = "free to move" if row["free"] else "rigid" if row["stiffness_N_per_m"] is None else f"{row['stiffness_N_per_m'] / 1e6:.6g}"
        shares = ", ".join(f"{k} {v:.1%}" for k, v in sorted(row["compliance_shares"].items(), key=lambda kv: -kv[1]) if v > 5e-4)
        table.add_row(name, row["direction"], stiffness, *(f"{v:+.4f}" for v in row["reactions_N"].values()), shares)
    console.print(table)
