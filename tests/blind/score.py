"""`python -m tests.blind.score FILE ...`: what a diagnosis is worth where the truth is known, printed and written to docs/blind.txt.

Shares have Clopper and Pearson's 95 % interval (*Biometrika* 26 (1934) 404). The log score is the mean of ln of the
probability that was stated for the truth, no less than ln 0.001 each (Good, *J. R. Statist. Soc. B* 14 (1952) 107). A hidden
piece whose change of the FRFs is less than sqrt(10) standard errors, 5 in ln evidence, after what tolerances, and the other
piece where there are two, could take of it, need not be found, and may be; from twice that on it counts as visible.
"""

from __future__ import annotations

import argparse
import io
from collections import Counter
from collections.abc import Callable, Sequence
from itertools import pairwise, product
from pathlib import Path
from typing import Any

import numpy as np
from rich.console import Console
from rich.table import Table
from scipy.stats import binomtest

from tests.blind.study import KINDS, RESULTS, ROOT, read
from thermospindle.diagnosis.decision.explanations import ASTRAY, astray

Row = dict[str, Any]
OUTCOMES = ("right", "in the set", "half", "unexplained", "missed", "wrong", "false alarm", "error")
SHOWS = np.sqrt(10.0)
VISIBLE = 2 * SHOWS
LEAST = 1e-3
MUCH = 0.3  # of the largest amount of what is hidden
SURE = 0.95
BINS = (0.0, 0.2, 0.5, 0.8, 0.95, 0.99, 1.0)
DOCS = ROOT / "docs" / "blind.txt"


def truths(row: Row) -> list[list[str]]:
    """Of every hidden piece the effects that are right answers, as measured (`tests.blind.alike`);
    of older rows those that its author had in mind."""
    return row.get("right", row["truth"])


def nameless(row: Row) -> bool:
    """Whether something is hidden that was drawn from outside the catalogue, whatever comes near it there, or that no effect of it can be."""
    return row["kind"] == "outside" or any(not names for names in truths(row))


def shows(row: Row) -> bool:
    """Whether anything that is hidden shows."""
    return any(v >= SHOWS for v in row["visibility"])


def beside(row: Row) -> list[float]:
    """How visible every hidden piece is beside the other, as much of which as there is in every test
    could do its part: of two of which each does what the other does, either is the whole answer."""
    return row.get("visibility_beside") or row["visibility"]


def needed(row: Row) -> list[bool]:
    """Of every hidden piece whether it shows, also beside the other, and must be in a true answer."""
    return [v >= SHOWS for v in beside(row)]


def outcome(row: Row) -> str:
    """right: nothing said where nothing shows, no name but those of what is hidden and all of what
    shows, or `unexplained` of what is in no catalogue; half: one of two, and no other; unexplained: of
    what a name stands for; wrong: any name that is none of the truth's, or a set without all of it."""
    verdict, named = row["verdict"], set(row["effects"])
    if verdict == "error":
        return "error"
    if verdict == "none":
        return "missed" if shows(row) else "right"
    if row["kind"] == "nothing":
        return "false alarm"
    if verdict == "unexplained":
        return "right" if nameless(row) else "unexplained"
    there = [bool(named & set(names)) for names in truths(row)]
    whole = any(there) and all(t or not n for t, n in zip(there, needed(row), strict=True))
    if verdict == "ambiguous":
        return "in the set" if whole else "half" if any(there) else "wrong"
    if named <= {n for names in truths(row) for n in names}:
        return "right" if whole else "half"
    return "wrong"


def visible(row: Row) -> bool:
    return bool(row["visibility"]) and min(beside(row)) >= VISIBLE


def element_found(row: Row) -> bool:
    """Whether the first free-form answer is of the element that changes: either name begins the other, or holds it."""
    if not row["drifts"]:
        return False
    told = row["drifts"][0][0]
    return any(e.split()[0] in told or told.split()[0] in e for e in row["elements"])


def halved(row: Row) -> bool:
    """Whether the effect that `draft` writes halves the error of temperatures predicted from all others."""
    before, after = row["drafted"][:2]
    return bool(after < before / 2)


def above_noise(row: Row) -> bool:
    """Whether half the error without effects is more than is left where nothing is hidden: with noise and with
    all that differs from test to test; rows from before that was asked have noise alone, one standard error."""
    before, _, *least = row["drafted"]
    return bool(before > 2 * (least[0] if least else 1.0))


def told_elsewhere(row: Row) -> bool:
    """Whether tests of more than one temperature have much of what is hidden: of one alone no law tells the others."""
    for amounts in row["amounts"]:
        most = max(map(abs, amounts))
        if len({t for (t, _), amount in zip(row["tests"], amounts, strict=True) if abs(amount) > MUCH * most}) > 1:
            return True
    return False


def truth_probability(row: Row) -> float:
    """What was stated for the truth: nothing, something unknown, or candidates whose names are all right and all of what shows."""
    return float(sum(p for p, true in _answers(row) if true))


def true_names(row: Row, names: Sequence[str]) -> bool:
    """Whether every name is one of a hidden piece's, each of another, and no piece that shows is without one."""
    pieces = [[k for k, truth in enumerate(truths(row)) if name in truth] for name in names]
    return any(
        len(set(chosen)) == len(names) and all(k in chosen for k, asked in enumerate(needed(row)) if asked) for chosen in product(*pieces)
    )


def restated(row: Row) -> Row:
    """With probabilities as they are stated since evidence is said to be led astray (`decision.explanations.astray`), of a row from before that."""
    if "astray" in row.get("weighed", {}) or row["verdict"] == "error":
        return row
    told, untried = astray([c["delta_evidence"] for c in row["candidates"]], [c["probability"] for c in row["candidates"]], row["probability"]["none"])
    unknown = untried + (1 - ASTRAY) * row["probability"]["unknown"]
    candidates = [c | {"probability": p} for c, p in zip(row["candidates"], told, strict=True)]
    return row | {"probability": row["probability"] | {"unknown": unknown}, "candidates": candidates}


def _answers(row: Row) -> list[tuple[float, bool]]:
    """The stated probability of nothing, of something unknown and of every candidate, and whether it is true."""
    found = [(row["probability"]["none"], not shows(row)), (row["probability"]["unknown"], nameless(row))]
    return found + [(c["probability"], bool(row["hidden"]) and true_names(row, c["effects"])) for c in row["candidates"]]


def most_probable(row: Row) -> tuple[float, bool]:
    """The most probable answer's stated probability, and whether it is true."""
    return max(_answers(row), key=lambda a: a[0])


def sure(row: Row) -> bool:
    """Whether one answer that names effects was stated to be all but certain, where something is hidden."""
    return bool(row["hidden"] and row["effects"] and row["candidates"]) and _likeliest(row)["probability"] > SURE


def _likeliest(row: Row) -> Row:
    return max(row["candidates"], key=lambda c: c["probability"])


def no_wrong_name(row: Row) -> bool:
    """Whether every name of the most probable candidate is one of a hidden piece's, whatever else is hidden."""
    return set(_likeliest(row)["effects"]) <= {name for names in truths(row) for name in names}


def interval(k: int, n: int) -> tuple[float, float]:
    """Clopper and Pearson's, 95 %."""
    found = binomtest(k, n).proportion_ci(0.95, "exact")
    return float(found.low), float(found.high)


def share(rows: Sequence[Row], true: Callable[[Row], bool]) -> str:
    if not rows:
        return "none yet"
    k = sum(map(true, rows))
    low, high = interval(k, len(rows))
    return f"{k} of {len(rows)} ({k / len(rows):.0%}; {low:.0%} to {high:.0%})"


def failure(row: Row) -> str:
    """One line: what was hidden, what was said, and what can be seen of why."""
    hidden = " + ".join(
        f"{h} {s:.3g} {u} ({law}; {v:.0f} sd)"
        for h, s, u, law, v in zip(row["hidden"], row["sizes"], row["units"], row["laws"], row["visibility"], strict=True)
    )
    said = " ".join([row["verdict"], *row["effects"]])
    if row["verdict"] == "error":
        return f"{row['seed']} {Path(row['scene']).name}: {hidden or 'nothing'}: {row['error']}"
    why = [f"rms {row['rms'][0]:.1f} > {row['rms'][1]:.1f}"]
    right = next((i for i, c in enumerate(row["candidates"]) if row["hidden"] and true_names(row, c["effects"])), None)
    if row["hidden"] and not nameless(row):
        best = max((c["delta_evidence"] for c in row["candidates"]), default=0.0)
        why.append(
            "truth no candidate"
            if right is None
            else f"truth is number {right + 1}, {row['candidates'][right]['delta_evidence'] - best:.0f} from the best name"
        )
    if row["drifts"]:
        why.append("drifts " + ", ".join(f"{e} {g:.0f}" for e, g in row["drifts"][:2]))
    return f"{row['seed']} {Path(row['scene']).name}: {hidden or 'nothing'}: {said} [{'; '.join(why)}; {_world(row)}]"


def _world(row: Row) -> str:
    w, r = row["world"], row["record"]
    told = [
        f"stiffness {w['stiffness_error']:.1%} and damping {w['damping_error']:.1%} of modes wrong",
        f"grooves {w['grooves_follow_faces']:.1f}",
        "weak mode" if w["weak_mode"] else "no weak mode",
    ]
    return ", ".join(
        [
            *told,
            f"{r['kind']}, {r['told']} told, leakage {row['leakage']:.1f} sd",
            f"frequencies learned as {row['learned']['frequency_discrepancy']:.1%} wrong",
        ]
    )


def show(console: Console, rows: Sequence[Row]) -> None:
    rows = sorted(rows, key=lambda r: r["seed"])
    without = sorted({w for r in rows for w in r.get("without", [])})
    commits = ", ".join(sorted({r["commit"] for r in rows}))
    console.print(
        f"{len(rows)} campaigns, seeds {_ranges([r['seed'] for r in rows])}, commit {commits}"
        + (f", without {', '.join(without)}" if without else "")
    )
    grid = Table("hidden", "campaigns", *OUTCOMES, "log score")
    for kind in (*KINDS, "all"):
        own = [r for r in rows if kind in ("all", r["kind"])]
        count = Counter(map(outcome, own))
        score = f"{_log_score(own):.2f}" if own else ""
        grid.add_row(kind, str(len(own)), *(str(count[o] or "") for o in OUTCOMES), score)
    console.print(grid)
    told = [r for r in rows if r["verdict"] != "error"]
    inside = [r for r in told if r["hidden"] and not nameless(r)]
    seen = [r for r in inside if visible(r)]
    outside = [r for r in told if nameless(r) and visible(r)]
    sets = [r for r in told if r["verdict"] == "ambiguous"]
    console.print(f"error instead of an answer: {share(rows, lambda r: r['verdict'] == 'error')}")
    console.print(
        f"false alarm, nothing hidden: {share([r for r in told if r['kind'] == 'nothing'], lambda r: outcome(r) == 'false alarm')}"
    )
    console.print(f"  with a name: {share([r for r in told if r['kind'] == 'nothing'], lambda r: bool(r['effects']))}")
    console.print(f"truth in the verdict, visible: {share(seen, lambda r: outcome(r) in ('right', 'in the set'))}")
    console.print(f"  one hidden: {share([r for r in seen if len(r['hidden']) == 1], lambda r: outcome(r) in ('right', 'in the set'))}")
    console.print(f"  two hidden: {share([r for r in seen if len(r['hidden']) == 2], lambda r: outcome(r) in ('right', 'in the set'))}")
    console.print(f"wrong name, something of the catalogue hidden: {share(inside, lambda r: outcome(r) == 'wrong')}")
    console.print(f"unexplained, outside and visible: {share(outside, lambda r: outcome(r) == 'right')}")
    console.print(f"  and the right element first: {share(outside, lambda r: outcome(r) == 'right' and element_found(r))}")
    drafts = [r for r in outside if r.get("drafted")]
    console.print(f"  and the error left out halved by what draft writes: {share(drafts, halved)}")
    console.print(f"    where more than one temperature shows it: {share([r for r in drafts if told_elsewhere(r)], halved)}")
    console.print(f"    and where it can be, more than twice the noise's before: {share([r for r in drafts if told_elsewhere(r) and above_noise(r)], halved)}")
    named = [r for r in told if nameless(r) and r["kind"] != "outside"]
    console.print(
        f"of these drawn with an effect in mind that cannot be it: {len(named)}; another effect than those in mind is right, too: "
        f"{sum(any(set(own) - set(names) for own, names in zip(truths(r), r['truth'], strict=True)) for r in told)}"
    )
    console.print(f"sets of at most three: {share(sets, lambda r: len(r['effects']) <= 3)}")
    for scene in sorted({r["scene"] for r in rows}):
        own = [r for r in rows if r["scene"] == scene]
        console.print(f"right or in the set, {Path(scene).name}: {share(own, lambda r: outcome(r) in ('right', 'in the set'))}")
    console.print(_reliability("most probable answer's probability", told))
    again = list(map(restated, told))
    if again != told:
        console.print(_reliability("the same, as it is stated today", again))
        console.print(f"log score of all, as it is stated today: {_log_score(again):.2f}")
    certain = [r for r in again if sure(r)]
    console.print(f"names stated above {SURE:g}, every one right: {share(certain, no_wrong_name)}")
    console.print(f"  and nothing that shows left out: {share(certain, lambda r: true_names(r, _likeliest(r)['effects']))}")
    if seconds := [r["seconds"] for r in rows]:
        console.print(f"seconds a diagnosis: median {np.median(seconds):.0f}, largest {max(seconds):.0f}")
    if sets:
        console.print(f"names in a set: {dict(sorted(Counter(len(r['effects']) for r in sets).items()))}")
    console.print("\nfailures:")
    for r in rows:
        if outcome(r) not in ("right", "in the set"):
            console.print(f"- {outcome(r)}: {failure(r)}", markup=False)


def _log_score(rows: Sequence[Row]) -> float:
    return float(np.mean([np.log(max(truth_probability(r), LEAST)) for r in rows]))


def _reliability(title: str, rows: Sequence[Row]) -> Table:
    """How often the most probable answers came true, by the probability that was stated."""
    table = Table(title, "campaigns", "mean stated", "came true")
    said = [most_probable(r) for r in rows]
    for low, high in pairwise(BINS):
        own = [a for a in said if low <= a[0] < high or (high == 1.0 and a[0] >= 1.0)]
        if own:
            k = sum(true for _, true in own)
            a, b = interval(k, len(own))
            table.add_row(f"{low:g} to {high:g}", str(len(own)), f"{np.mean([p for p, _ in own]):.3f}", f"{k} ({a:.0%} to {b:.0%})")
    return table


def _ranges(seeds: Sequence[int]) -> str:
    found: list[list[int]] = []
    for s in sorted(seeds):
        if found and s == found[-1][1] + 1:
            found[-1][1] = s
        else:
            found.append([s, s])
    return ", ".join(f"{a} to {b}" if b > a else str(a) for a, b in found)


def main() -> None:
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("files", type=Path, nargs="*", default=[RESULTS])
    parser.add_argument("--out", type=Path, default=DOCS)
    options = parser.parse_args()
    rows = read(options.files)
    if not rows:
        raise SystemExit(f"{', '.join(map(str, options.files))}: no rows there; python -m tests.blind.study --seeds A B makes some")
    show(Console(width=160), rows)
    text = io.StringIO()
    show(Console(file=text, width=160), rows)
    options.out.write_text(text.getvalue(), encoding="utf-8")


if __name__ == "__main__":
    main()
