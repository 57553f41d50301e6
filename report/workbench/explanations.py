"""Explanations with their probabilities: from the answer of `spindle diagnose`, read from its file or found here."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from markupsafe import Markup

from thermospindle.diagnosis import verdict
from thermospindle.diagnosis.answer import answer_of, fitted_values, read_raw, told_by
from thermospindle.diagnosis.compare.before_after import without
from thermospindle.model.errors import BadInput
from thermospindle.model.scene.reading import content_hash
from thermospindle.report.text.diagnosis.answer import diagnosis_json
from thermospindle.report.workbench.bench import Bench
from thermospindle.report.workbench.state import Setting, add_effect, set_deviation


@dataclass(frozen=True)
class Explanation:
    """Effects that act together, their fitted values by effect, and relative deviations of the tolerances fitted beside them."""

    effects: tuple[str, ...]
    probability: float
    delta_evidence: float
    values: Mapping[str, Mapping[str, float]]
    deviations: Mapping[str, float]

    @property
    def words(self) -> str:
        return f"{' + '.join(self.effects)}, {self.probability:.0%}"


@dataclass(frozen=True)
class Explanations:
    """The verdict in a word and why, explanations with the most probable first, and what is left for none and for something unknown."""

    word: str
    reason: str
    rows: tuple[Explanation, ...]
    none: float
    unknown: float
    of_scene: bool = True  # as it is on the workbench, as far as the answer says


def read_explanations(file: Path, bench: Bench) -> Explanations:
    """The explanations of an answer of `spindle diagnose --json`; `BadInput` for another file."""
    return explanations(read_raw(file, f"--diagnosis {file}"), bench, f"--diagnosis {file}")


def explanations(raw: Mapping[str, Any], bench: Bench, where: str) -> Explanations:
    """What the workbench shows of an answer; candidates with effects that cannot be added to this scene are left away."""
    answer, known, rows = answer_of(raw, where), {e.name for e in bench.effects}, []
    with told_by(where, "a verdict and probabilities"):
        for candidate, offered in zip(raw["candidates"], answer.candidates, strict=True):
            names = offered.effects
            if not set(names) <= known:
                continue
            values = fitted_values([bench.effect(n) for n in names], offered, Path(where.removeprefix("--diagnosis ")))
            own = answer.build if set(names) == set(answer.best) else {}
            rows.append(Explanation(names, float(candidate["probability"]), float(candidate["delta_evidence"]), values, own))
        odds = {key: float(raw["probability"][key]) for key in ("none", "unknown")}
        return Explanations(str(raw["verdict"]), str(raw["reason"]), tuple(rows), odds["none"], odds["unknown"], answer.scene_hash in (None, content_hash(bench.spindle)))


def find(bench: Bench, s: Setting, progress: Callable[[str], None]) -> Explanations:
    """The diagnosis of the scene as it was opened, from all tests that are not left out: a minute or several."""
    if bench.campaign is None:
        raise BadInput("without a campaign there is nothing to explain")
    found = verdict.diagnose(bench.spindle, without(bench.campaign, sorted(s.left_out)), bench.effects, progress)
    return explanations(diagnosis_json(found), bench, "the diagnosis")


def steps(bench: Bench, s: Setting) -> int:
    """Of the progress of `find`."""
    return len(verdict.STEPS) + len(bench.shown) - len(s.left_out)


def taken(bench: Bench, s: Setting, e: Explanation) -> Setting:
    """The setting with the effects and tolerances of an explanation in place of those it has."""
    s = Setting(left_out=s.left_out, free=s.free)
    for name in e.effects:
        s = add_effect(s, bench.effect(name), e.values[name])
    for name, value in e.deviations.items():
        s = set_deviation(s, name, value)
    return s


def table(found: Explanations) -> str:
    """As HTML, with what is left for no effect and for something unknown."""
    head = Markup("<p><b>{}</b>: {}</p>").format(found.word, found.reason)
    rows = [(" + ".join(e.effects), f"{e.probability:.1%}", f"{e.delta_evidence:+z.0f}") for e in found.rows]
    rows += [("no effect", f"{found.none:.1%}", "0"), ("something unknown", f"{found.unknown:.1%}", "")]
    body = Markup("").join(Markup("<tr><th scope=row>{}</th><td>{}</td><td>{}</td></tr>").format(*row) for row in rows)
    return str(head + Markup("<table><thead><tr><th scope=col>explanation</th><th scope=col>probability</th><th scope=col>ln evidence</th></tr></thead><tbody>") + body + Markup("</tbody></table>"))
