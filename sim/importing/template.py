"""The mapping as a form to fill in: what the files tell as it was found, open answers as "?", and a comment at each."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path

from thermospindle.model.files.formats import CURRENT, KEY, MAPPING
from thermospindle.model.machine import Spindle
from thermospindle.model.units import MM, RPM
from thermospindle.sim.campaign.form import in_unit, toml
from thermospindle.sim.importing.files.labels import ROLES
from thermospindle.sim.importing.mapping import REST
from thermospindle.sim.importing.measured import End, Question, Read, listed
from thermospindle.sim.importing.names import conditions_of, hit_at, plain, tests_of

CONDITIONS = ("temperature_C", "speed_rpm")
HEAD = """\
# What the files do not tell. Put an answer in the place of each "?"; a key that is left out, or "?", is open.
# Then run the same command again. Everything here may be edited; units are in the names of the keys.
"""
MORE = """\
# ---------------------------------------------------------------- more, where it is needed
# In [[files]]: quantity, unit = "g/N", response = 3, reference = "hub_top0", columns = { "Ch 2" = "response 3 [m/s^2]" }, phase_unit = "deg",
#   start_Hz, step_Hz, sample_rate_Hz, damping_unit, conjugate = true, leave_out = ["set 5", "H(3,1)"], test = "T20" (files of one test share it)
# In [[tests]]: hammer_level_N, soak_time_min, window_decay_1_per_s, pretrigger_s, averages, repeat, conditions = { humidity = 0.4 }
# [records]                     time records: estimator = "H1" | "H2" | "Hv", hit_length_s, exponential_end, double_hit_share, apart_s, band_Hz (else the scene's),
#   overload = { force = 200.0, hub_top0 = 500.0 }   limits in the file's units, from which a hit is left out
"""


OF_FRFS = """\
# quantity = "accelerance"    # of the campaign: receptance, mobility or accelerance; FRFs are converted to it (the most frequent by default)
# band_Hz = [50.0, 3000.0]    # lines outside are left out"""
"""Keys of the whole file: below the first table they would be one of its."""
OF_RECORDS = ("hit_length_s",)
"""Keys under [records] that may be asked."""


def template(found: Read, files: Sequence[Path], scene: Spindle | None) -> str:
    """The text of a mapping for these files."""
    lines = [HEAD, f"{KEY} = {CURRENT[MAPPING]}", f'title = {toml(f"imported from {listed((f.name for f in files), 3)}")}']
    lines.append(f"spindle = {toml(scene.name)}" if scene else 'spindle = "?"    # name of the scene')
    if any(q.key == "frequency_sd_Hz" for q in found.questions):
        lines.append('frequency_sd_Hz = "?"    # how sure hand-picked frequencies are: one standard deviation')
    if any(m.damping_ratio is not None and m.damping_ratio_sd is None for every in found.modes.values() for m in every):
        lines.append("# damping_sd_percent = 10.0    # how sure their dampings are: one standard deviation in per cent of each; without, they are shown and judge nothing")
    if any(m.shape for every in found.modes.values() for m in every):
        lines.append("# shape_sd_percent = 5.0    # how sure their shapes are: one standard deviation in per cent of the largest of each; without, they are left out")
    if found.curves or not found.modes:
        lines.append(OF_FRFS)
    common, own = _shared(found.questions, files)
    for suffix, questions in common.items():
        many = sum(f.suffix == suffix for f in files)
        lines += ["", "[[files]]", f"file = {toml(f'*{suffix}')}    # all {many} of them; the table of one file, below, may say otherwise", *_asked(questions)]
    tests = tests_of(found.contents)
    for file in files:
        lines += ["", "[[files]]", f"file = {toml(file.name)}", f"test = {toml(tests[file])}    # files of one test have the same"]
        node = hit_at(file)
        lines += _asked(own[file], node if node in found.points else None)
    renamed = {plain(f.stem): test for f, test in tests.items()}
    names = list(dict.fromkeys(renamed.get(t, t) for t in found.tests))
    shared = [key for key in CONDITIONS if len(names) > 2 and not any(key in conditions_of(t) for t in names)]
    if shared:
        lines += ["", "[[tests]]", f'id = "*"    # all {len(names)} of them; the table of one test, below, may say otherwise', *(f'{key} = "?"' for key in shared)]
    for test in names:
        lines += ["", "[[tests]]", f"id = {toml(test)}", *_condition(test, shared, _examples(scene))]
    lines += [line for block in _points(found, scene) for line in block]
    if of_records := {q.key: q.text for q in found.questions if q.key in OF_RECORDS}:
        lines += ["", "[records]", *(f"{key} = {toml('?')}    # {text}" for key, text in of_records.items())]
    return "\n".join([*lines, "", MORE])


def _shared(questions: Sequence[Question], files: Sequence[Path]) -> tuple[dict[str, list[Question]], dict[Path, list[Question]]]:
    """Questions about all files of one ending, by that ending, and those of each file alone."""
    common: dict[str, list[Question]] = {}
    own: dict[Path, list[Question]] = {f: [] for f in files}
    for q in questions:
        about = [f for f in files if f", {f.name}, " in f", {q.about}, "]
        for suffix in dict.fromkeys(f.suffix for f in about):
            alike = [f for f in files if f.suffix == suffix]
            if q.key in ("records", "test"):
                continue
            if len(alike) > 1 and suffix and all(f in about for f in alike) and q.key != "reference":
                common.setdefault(suffix, []).append(q)
            else:
                for f in alike:
                    if f in about:
                        own[f].append(q)
    return common, own


def _asked(questions: Sequence[Question], hit: int | None = None) -> list[str]:
    """Lines of a [[files]] table with the questions as open answers; `hit` is the node that the file's name speaks of."""
    found: dict[str, list[str]] = {}
    names = [n for q in questions if q.key == "columns" for n in q.names]
    for q in questions:
        found.setdefault(q.key, []).append(q.text.split(": columns = {")[0])
    lines = []
    for key, texts in found.items():
        if key == "columns" and names:
            continue
        if key == "reference" and hit is not None:
            lines.append(f"reference = {hit}    # the point that was hit, read off the name of the file; correct it where it is wrong")
        else:
            lines.append(f"{key} = {toml('?')}    # {'; '.join(texts)}")
    if names:
        lines += ["[files.columns]", *(f"# {text}" for text in found["columns"]), f"# allowed are {ROLES}, with the unit in brackets behind it"]
        lines += [f"{toml(n)} = {toml('?')}" for n in dict.fromkeys(names)]
        lines += [f'# {toml(REST)} = "ignore"    # instead of the lines of all that are not needed'] if len({*names}) > 1 else []
    return lines


def _examples(scene: Spindle | None) -> dict[str, float]:
    """Conditions as they may be, by key: those that a scene is meant for."""
    if scene is None:
        return dict(zip(CONDITIONS, (20.0, 7200.0), strict=True))
    return dict(zip(CONDITIONS, (scene.reference_temperature, scene.nominal_speed / RPM if scene.structure.turns else 0.0), strict=True))


def _condition(test: str, shared: Sequence[str], examples: Mapping[str, float]) -> list[str]:
    """Temperature and speed, read off the name where it seems to tell them; what is asked of all tests together as a comment."""
    told = conditions_of(test)
    asked = [f"# {key} = {toml(float(f'{examples[key]:.6g}'))}    # where it is another" if key in shared else f'{key} = "?"' for key in CONDITIONS]
    return [f"{key} = {told[key]:g}    # read off the name {test!r}; correct it where it is wrong" if key in told else line for key, line in zip(CONDITIONS, asked, strict=True)]


def _told(place: tuple[float, ...] | None, unscaled: tuple[float, ...] | None) -> str:
    if place:
        return "as the file has it; "
    return f"the file has {', '.join(f'{v:g}' for v in unscaled)} in a unit that it does not name; " if unscaled else ""


def _points(found: Read, scene: Spindle | None) -> Iterable[list[str]]:
    """A [[points]] for every end that no point is called by, nodes and places as files have them."""
    ends: dict[str, End] = {}
    for _, end in found.ends:
        if end.label:
            ends.setdefault(end.full, end)
    places = {n: p for c in found.contents for n, p in c.places.items()}
    unscaled = {n: p for c in found.contents for n, p in c.unscaled.items()}
    taken = set(found.points)
    bodies = f"    # a body of the scene: {', '.join(scene.structure.parts)}" if scene else "    # the body of the scene that it is on"
    for label, end in ends.items():
        node = end.node if end.node and end.node not in taken else next(n for n in range(1, 10**6) if n not in taken)
        taken.add(node)
        place = places.get(end.node)
        where = [in_unit(v, MM) for v in place] if place else ["?"] * 3
        name = re.sub(r"\W+", "_", label.replace("+", "").replace("-", "m")).strip("_")[:10]
        name = f"p{name}"[:10] if not name or name[0].isdigit() else name
        yield [
            "", "[[points]]", f"node = {node}", f"name = {toml(name)}    # at most ten characters", f"called = [{toml(label)}]",
            f'body = "?"{bodies}',
            f"position_mm = {toml(where)}    # " + _told(place, unscaled.get(end.node)) + "spindle axis along z, as in the scene",
            f"direction = {toml(end.direction or '?')}    # +X -X +Y -Y +Z -Z: the way the sensor or hammer looks",
            "# sensor_mass_g = 0.0    # of a sensor that sits there, which the model is to carry",
        ]  # fmt: skip
