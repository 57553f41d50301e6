"""Time records by test and hammer point."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from thermospindle.sim.importing.mapping import FileForm
from thermospindle.sim.importing.measured import FORCE_NEEDED, Content, End, Motion, Question, listed
from thermospindle.sim.importing.names import plain
from thermospindle.sim.importing.records.exchanged import exchanged

Records = dict[tuple[str, End], list[tuple[Path, list[Motion]]]]


def grouped(contents: Sequence[Content], settings: dict[Path, FileForm]) -> tuple[Records, list[Question]]:
    """Time records by test and hammer point; force and responses of one hit may be in files of their own, of the same test."""
    groups: Records = {}
    questions: list[Question] = []
    apart: dict[str, list[Content]] = {}
    for c in contents:
        if not c.motions or c.questions:
            continue
        test = settings[c.file].test or plain(c.file.stem)
        kinds = {m.force for m in c.motions}
        if len(kinds) == 1:
            apart.setdefault(test, []).append(c)
        elif sum(m.force for m in c.motions) > 1:
            questions.append(Question(c.file.name, "columns", "which one of its force channels is the hammer's"))
        else:
            _add(groups, test, c.file, list(c.motions))
    for test, own in apart.items():
        motions = [m for c in own for m in c.motions]
        names = listed(c.file.name for c in own)
        if sum(m.force for m in motions) == 1 and len(motions) > 1:
            _add(groups, test, own[0].file, motions)
        else:
            lacking = "response" if all(m.force for m in motions) else "force"
            alone = f"; {FORCE_NEEDED}" if lacking == "force" else ""
            questions.append(Question(names, "test", f"the {lacking} record that goes with them: files of one hit have the same test{alone}"))
    wrong = {key: [q for path, motions in group if (q := exchanged(path, motions)) is not None] for key, group in groups.items()}
    return {key: group for key, group in groups.items() if not wrong[key]}, [*questions, *(q for of in wrong.values() for q in of)]


def _add(groups: Records, test: str, file: Path, motions: list[Motion]) -> None:
    groups.setdefault((test, next(m.end for m in motions if m.force)), []).append((file, motions))
