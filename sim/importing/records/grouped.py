"""Time records by test and hammer point."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from thermospindle.model.errors import BadInput
from thermospindle.sim.importing.files.labels import same_end
from thermospindle.sim.importing.mapping import FileForm
from thermospindle.sim.importing.measured import FORCE_NEEDED, Content, End, Motion, Question, listed
from thermospindle.sim.importing.names import plain
from thermospindle.sim.importing.records.exchanged import exchanged

Records = dict[tuple[str, End], list[tuple[Path, list[Motion]]]]


def grouped(contents: Sequence[Content], settings: dict[Path, FileForm]) -> tuple[Records, list[Question]]:
    """Time records by test and hammer point; force and responses of one hit may be in files of their
    own, of the same test, and those of several points in one file that tells which point each
    response answers. Raises `BadInput` for records of one point that are not as many or not as long."""
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
        else:
            questions += _add(groups, test, c.file.name, c.motions)
    for test, own in apart.items():
        motions = [m for c in own for m in c.motions]
        names = ", ".join(c.file.name for c in own)
        if len({m.force for m in motions}) == 2:
            questions += _add(groups, test, names, motions)
        else:
            lacking = "response" if all(m.force for m in motions) else "force"
            alone = f"; {FORCE_NEEDED}" if lacking == "force" else ""
            questions.append(Question(names, "test", f"the {lacking} record that goes with them: files of one hit have the same test{alone}"))
    wrong = {key: [q for path, motions in group if (q := exchanged(path, motions)) is not None] for key, group in groups.items()}
    return {key: group for key, group in groups.items() if not wrong[key]}, [*questions, *(q for of in wrong.values() for q in of)]


def _add(groups: Records, test: str, names: str, motions: Sequence[Motion]) -> list[Question]:
    """Put the records of some files to their hammer points, or ask what is open of that."""
    forces = [m for m in motions if m.force]
    moving = [m for m in motions if not m.force]
    one = len(forces) == 1 and len({(m.reference.node, m.reference.name) for m in moving if m.reference.label}) < 2
    answers: list[list[Motion]] = [[] for _ in forces]
    lost = []
    for m in moving:
        own = [k for k, force in enumerate(forces) if one or _answers(m, force) or (len(forces) == 1 and not m.reference.label)]
        if len(own) == 1:
            answers[own[0]].append(m)
        else:
            lost.append(m)
    if lost or not all(answers):
        return [_open(names, forces, lost, forces[answers.index([])] if [] in answers else None)]
    for force, answering in zip(forces, answers, strict=True):
        for m in answering:
            if m.value.shape != force.value.shape:
                hits, n = force.value.shape
                raise BadInput(f"{m.file}: {m.where}: has {m.value.shape[0]} hit{'s' * (m.value.shape[0] > 1)} of {m.value.shape[1]} samples, its force {force.where} {hits} of {n}; they must be the same: time records are (hits, samples), or (hits, responses, samples)")
        groups.setdefault((test, force.end), []).append((force.file, [force, *answering]))
    return []


def _open(names: str, forces: Sequence[Motion], lost: Sequence[Motion], idle: Motion | None) -> Question:
    """What is asked where a response answers no force, or several, or where a force (`idle`) has no response."""
    there = listed(f"{f.where} at {f.end.label or 'no point'}" for f in forces)
    if lost and not lost[0].reference.label:
        if ", " in names:
            return Question(names, "test", f"which force goes with which response: there are {there}; files of one hit have a test of their own")
        if lost[0].where.startswith("set "):
            return Question(names, "leave_out", f'which force {lost[0].where} answers, for it names no reference: there are {there}; leave_out = ["{forces[-1].where}"] does without one')
        return Question(names, "columns", "which one of its force channels is the hammer's")
    if lost:
        return Question(names, "leave_out", f'the force that {lost[0].where} answers: its reference is {lost[0].reference.label}, and there are {there}; leave_out = ["{lost[0].where}"] does without it')
    where = idle.where if idle else ""
    return Question(names, "leave_out", f'the responses to the force {where}: none has its point as reference; leave_out = ["{where}"] does without it')


def _answers(response: Motion, force: Motion) -> bool:
    """Whether a response says that it answers a force: one at its point, along its axis as far as both tell that."""
    a, b = response.reference, force.end
    return bool(a.label) and same_end(a, b) and (not a.direction or not b.direction or a.direction[1] == b.direction[1])
