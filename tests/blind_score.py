"""The score of a blind study: what a verdict is worth where the truth is known, and the tables of it."""

from __future__ import annotations

from collections import Counter
from typing import Any

from rich.console import Console
from rich.table import Table

KINDS = ("right", "identified", "in the set", "half", "wrong", "missed", "false alarm")


def outcome(row: dict[str, Any]) -> str:
    """right: nothing named where nothing (or nothing in the catalogue) was hidden; half: one of two effects named, and nothing else; wrong
    is also what names one effect too many."""
    verdict, named = row["verdict"], set(row["effects"])
    if not row["variants"]:
        return "right" if verdict == "none" else "false alarm"
    if verdict == "none":
        return "missed"
    if not all(row["truth"]):
        return "right" if verdict == "unexplained" else "wrong"
    if verdict == "unexplained":
        return "missed"
    there = [any(name in named for name in names) for names in row["truth"]]
    all_true = named <= {name for names in row["truth"] for name in names}
    if verdict == "ambiguous":
        return "in the set" if all(there) else "half" if all_true else "wrong"
    return ("identified" if all(there) else "half") if all_true else "wrong"


def show(console: Console, rows: list[dict[str, Any]]) -> None:
    grid = Table("hidden", "share", "x smallest", "outcome", "verdict", "pull", "held out", "best (ln evidence)")
    for row in sorted(rows, key=lambda r: (r["variants"], r["shares"], r["seed"])):
        first = row["candidates"][0] if row["candidates"] else None
        grid.add_row(
            "\n".join(row["variants"]) or "nothing",
            "\n".join(f"{s:.2f}" for s in row["shares"]),
            "\n".join("-" if s is None else f"{s:.1f}" for s in row["over_smallest"]),
            outcome(row),
            " ".join([row["verdict"], *row["effects"]]),
            "{:.2f} > {:.2f}".format(*row["rms_pull"]),
            "{:.2f} > {:.2f}".format(*row["held_out"]),
            f"{' + '.join(first['effects'])} {first['delta_evidence']:.0f}" if first else "",
        )
    console.print(grid)
    table = Table("hidden effect", *KINDS)
    for key in sorted({family(r) for r in rows}):
        count = Counter(outcome(r) for r in rows if family(r) == key)
        table.add_row(key, *(str(count[k] or "") for k in KINDS))
    total = Counter(map(outcome, rows))
    table.add_row("all", *(str(total[k] or "") for k in KINDS))
    console.print(table)
    inside = [r for r in rows if r["variants"] and all(r["truth"])]
    share(console, "false alarms where nothing is hidden", ("false alarm",), [r for r in rows if not r["variants"]])
    visible = [r for r in inside if all((s or 0) >= 2 for s in r["over_smallest"])]
    share(console, "truth in the verdict at twice the smallest detectable size or more", ("identified", "in the set"), visible)
    share(console, "wrong there", ("wrong",), visible)
    share(console, "wrong at any size", ("wrong",), inside)
    outside = [r for r in rows if r["variants"] and not all(r["truth"])]
    share(console, "outside effects called something of the catalogue", ("wrong",), outside)
    share(console, "outside effects called identified", ("identified",), outside, lambda r: r["verdict"])
    share(console, "error on left-out conditions at least threefold down where rightly identified", ("yes",),
          [r for r in inside if outcome(r) == "identified"], lambda r: "yes" if r["held_out"][1] < r["held_out"][0] / 3 else "no")  # fmt: skip
    reliability = Table("stated probability", "campaigns", "came true")
    for low, high in ((0, 0.5), (0.5, 0.9), (0.9, 0.99), (0.99, 1.01)):
        said = [r for r in inside if r["verdict"] != "none" and r["candidates"] and low <= r["candidates"][0]["probability"] < high]
        if said:
            true = sum(all(set(names) & set(r["candidates"][0]["effects"]) for names in r["truth"]) for r in said)
            reliability.add_row(f"{low:g} to {min(high, 1):g}", str(len(said)), f"{true / len(said):.2f}")
    console.print(reliability)


def family(row: dict[str, Any]) -> str:
    return " + ".join("outside" if v.startswith("outside/") else v.split("/")[0] for v in row["variants"]) or "nothing"


def share(console: Console, what: str, kinds: tuple[str, ...], rows: list[dict[str, Any]], of=outcome) -> None:
    if rows:
        console.print(f"{what}: {sum(of(r) in kinds for r in rows)} of {len(rows)}")
