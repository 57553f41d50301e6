"""The catalogue of effects in words: the list, and one effect explained."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from rich.box import SIMPLE_HEAD
from rich.console import Console
from rich.table import Table

from thermospindle.report.typeset import unit_word
from thermospindle.sim.effects.effect import Effect


def summary(effect: Effect) -> dict[str, Any]:
    main = effect.parameters[0]
    parameter = {"parameter": main.name, "unit": main.unit, "neutral": main.neutral, "typical": main.typical}
    return {"name": effect.name, "title": effect.title} | parameter


def show_effects(console: Console, catalogue: Sequence[Effect], refused: Mapping[str, str] = {}) -> None:
    """The catalogue as a table; `refused` says of effects by name why they cannot be in a scene."""
    grid = Table(box=SIMPLE_HEAD, show_edge=False, pad_edge=False)
    grid.add_column("effect", no_wrap=True)
    grid.add_column("what it is (main parameter and its typical value)")
    for e in map(summary, catalogue):
        grid.add_row(e["name"], f"{e['title']} ({e['parameter']} {e['typical']:g}{unit_word(e['unit'], ' ')})")
    console.print(grid)
    for name, why in refused.items():
        console.print(f"{name}: {why}", markup=False, highlight=False)
    console.print("spindle effects NAME explains one; spindle add SCENE NAME --out NEW_SCENE adds it.", highlight=False)


def show_effect(console: Console, effect: Effect, refused: str = "", called: Mapping[str, Mapping[str, str]] = {}) -> None:
    """One effect in all its words; `refused` says why it cannot be in a scene, `called` what there the numbers of its parameters mean."""

    def line(what: str, text: str) -> None:
        console.print(f"\n{what}:", style="bold")
        console.print(text, markup=False, highlight=False)

    console.print(f"{effect.name}: {effect.title}", style="bold", highlight=False)
    line("Equation", effect.equation)
    console.print("\nParameters:", style="bold")
    grid = Table(box=SIMPLE_HEAD, show_edge=False, pad_edge=False)
    for column in ("name", "unit", "neutral", "typical", "prior s.d.", "limits"):
        grid.add_column(column, justify="left" if column in ("name", "unit") else "right")
    for p in effect.parameters:
        grid.add_row(p.name, p.unit, f"{p.neutral:g}", f"{p.typical:g}", f"{p.prior_sd:g}", f"{p.limits[0]:g} to {p.limits[1]:g}")
    console.print(grid)
    for p in effect.parameters:
        here = ", ".join(f"{number} {name}" for number, name in called.get(p.name, {}).items())
        console.print(f"{p.name}: {p.meaning}. Source: {p.source}." + (f" In this scene: {here}." if here else ""), markup=False, highlight=False)
    line("What one sees", effect.sees)
    line("What it resembles", ", ".join(effect.resembles))
    line("Where it is valid", effect.valid)
    if refused:
        line("In this scene", refused)
