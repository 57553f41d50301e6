"""Designs side by side, a table a condition."""

from __future__ import annotations

from typing import Any

from rich.console import Console

from thermospindle.report.text.grid import show_grid
from thermospindle.report.typeset import plain_error

CONDITIONS = 6  # shown


def show_designs(console: Console, values: dict[str, Any]) -> None:
    """What a comparison says: mean and standard deviation of drawn ones, else the scenes' own numbers, and which design is the best."""
    names = [d["design"] for d in values["designs"]]
    for c in values["conditions"][:CONDITIONS]:
        rows = [[f"{figure} ({own['better']} is better)", *(_value(d) for d in own["designs"].values()), _best(own)] for figure, own in c["figures"].items()]
        show_grid(console, f"{c['temperature_C']:g} C, {c['speed_rpm']:g} rpm", ["", *names, "better"], rows, ("", "better"))
    if any("pairs" in own for c in values["conditions"] for own in c["figures"].values()):
        console.print("+-: standard deviation of the drawn spindles.")
    for d in values["designs"]:
        if d["in_contact"] is not None and d["in_contact"] < 1:
            console.print(f"{d['design']}: all bearings have contact in {100 * d['in_contact']:.1f} % of its rows")


def _value(own: dict[str, Any]) -> str:
    if s := own.get("spread"):
        return plain_error(s["mean"], s["sd"])
    return "-" if own["nominal"] is None else f"{own['nominal']:.5g}"


def _best(own: dict[str, Any]) -> str:
    """The design that is better than each other with a probability above a half, or the best number; nothing where none is."""
    sign = 1 if own["better"] == "higher" else -1
    if "pairs" not in own:
        known = {name: sign * d["nominal"] for name, d in own["designs"].items() if d["nominal"] is not None}
        best = [name for name, v in known.items() if v == max(known.values())]
        return best[0] if len(best) == 1 and len(known) > 1 else "-"
    for name in own["designs"]:
        against = [p["probability"] if p["design"] == name else 1 - p["probability"] for p in own["pairs"] if name in (p["design"], p["than"])]
        errors = [p["sd"] for p in own["pairs"] if name in (p["design"], p["than"])]
        if len(against) == len(own["designs"]) - 1 and all(a - 0.5 > 3 * e for a, e in zip(against, errors, strict=True)):
            return f"{name} in {100 * min(against):.0f} %"
    return "-"
