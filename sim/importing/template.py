"""The mapping as a form to fill in: what the files tell as it was found, open answers as "?", and a comment at each."""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence
from pathlib import Path

from thermospindle.model.files.formats import CURRENT, KEY, MAPPING
from thermospindle.model.machine import Spindle
from thermospindle.model.units import MM
from thermospindle.sim.campaign.form import in_unit, toml
from thermospindle.sim.importing.assemble import Read, plain
from thermospindle.sim.importing.measured import End, listed
from thermospindle.sim.importing.places import body_names

HEAD = """\
# What the files do not tell. Put an answer in the place of each "?"; a key that is left out, or "?", is open.
# Then run the same command again. Everything here may be edited; units are in the names of the keys.
"""
MORE = """\
# ---------------------------------------------------------------- more, where it is needed
# quantity = "accelerance"      of the campaign: receptance, mobility or accelerance; FRFs are converted to it (the most frequent by default)
# band_Hz = [50.0, 3000.0]      lines outside are left out
# In [[files]]: quantity, unit = "g/N", response = 3, reference = "hub_top0", columns = { "Ch 2" = "response 3 [m/s^2]" }, phase_unit = "deg",
#   start_Hz, step_Hz, sample_rate_Hz, conjugate = true, leave_out = ["set 5", "H(3,1)"], test = "T20" (files of one test share it)
# In [[tests]]: hammer_level_N, soak_time_min, window_decay_1_per_s, averages, repeat, conditions = { humidity = 0.4 }
# [records]                     time records: estimator = "H1" | "H2" | "Hv", hit_length_s, exponential_end, double_hit_share, apart_s, band_Hz,
#   overload = { force = 200.0, hub_top0 = 500.0 }   limits in the file's units, from which a hit is left out
"""
TEMPERATURE = re.compile(r"(?:^|[_\W])T?(-?\d+(?:\.\d+)?)\s*(?:deg)?_?C(?=$|[_\W])|(?:^|[_\W])T(-?\d+(?:\.\d+)?)(?=$|[_\W])")
SPEED = re.compile(r"(?:^|[_\W])(\d+)\s*_?rpm|(?:^|[_\W])n(\d+)(?=$|[_\W])", re.IGNORECASE)


def template(found: Read, files: Sequence[Path], scene: Spindle | None) -> str:
    """The text of a mapping for these files."""
    lines = [HEAD, f"{KEY} = {CURRENT[MAPPING]}", f'title = {toml(f"imported from {listed((f.name for f in files), 3)}")}']
    lines.append(f"spindle = {toml(scene.name)}" if scene else 'spindle = "?"    # name of the scene')
    if any(q.key == "frequency_sd_Hz" for q in found.questions):
        lines.append('frequency_sd_Hz = "?"    # how sure hand-picked frequencies are: one standard deviation')
    asked: dict[str, list[tuple[str, str]]] = {}
    columns = {c.file.name: [n for q in c.questions for n in q.names] for c in found.contents}
    for q in found.questions:
        for file in files:
            if file.name in q.about.split(", "):
                asked.setdefault(file.name, []).append((q.key, q.text))
    for file in files:
        own = asked.get(file.name, [])
        lines += ["", "[[files]]", f"file = {toml(file.name)}", f"test = {toml(plain(file.stem))}    # files of one test have the same"]
        blank = {"columns": toml(dict.fromkeys(columns.get(file.name, []), "?"))}
        lines += [f"{key} = {blank.get(key, toml('?'))}    # {text}" for key, text in _once(own) if key not in ("records", "test")]
    for test in found.tests:
        lines += ["", "[[tests]]", f"id = {toml(test)}", *_condition(test)]
    lines += [line for block in _points(found, scene) for line in block]
    return "\n".join([*lines, "", MORE])


def _once(questions: Iterable[tuple[str, str]]) -> list[tuple[str, str]]:
    found: dict[str, list[str]] = {}
    for key, text in questions:
        found.setdefault(key, []).append(text)
    return [(key, "; ".join(texts)) for key, texts in found.items()]


def _condition(test: str) -> list[str]:
    """Temperature and speed, read off the name where it seems to tell them."""
    lines = []
    for key, pattern in (("temperature_C", TEMPERATURE), ("speed_rpm", SPEED)):
        match = pattern.search(test)
        if match:
            lines.append(f"{key} = {float(next(g for g in match.groups() if g)):g}    # read off the name {test!r}; correct it where it is wrong")
        else:
            lines.append(f'{key} = "?"')
    return lines


def _told(place: tuple[float, ...] | None, unscaled: tuple[float, ...] | None) -> str:
    if place:
        return "as the file has it; "
    return f"the file has {', '.join(f'{v:g}' for v in unscaled)} in a unit that it does not name; " if unscaled else ""


def _points(found: Read, scene: Spindle | None) -> Iterable[list[str]]:
    """A [[points]] for every end that no point is called by, nodes and places as files have them."""
    ends: dict[str, End] = {}
    for _, end in found.ends:
        if end.label:
            ends.setdefault(end.label, end)
    places = {n: p for c in found.contents for n, p in c.places.items()}
    unscaled = {n: p for c in found.contents for n, p in c.unscaled.items()}
    taken = set(found.points)
    bodies = f"    # a body of the scene: {', '.join(body_names(scene))}" if scene else "    # the body of the scene that it is on"
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
        ]  # fmt: skip
