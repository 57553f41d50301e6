"""Pages that are made from the program itself: the references of its files, from the forms that its
loader checks, and the catalogue of effects."""

from __future__ import annotations

import json
import re
import tomllib
from collections.abc import Iterator, Mapping
from importlib import import_module
from pathlib import Path
from typing import Any

from pydantic import BaseModel

from thermospindle.model.scene.form import Scene
from thermospindle.sim.campaign.form import MODE_COLUMNS, CampaignTable, ModeTable
from thermospindle.sim.effects import CATALOGUE
from thermospindle.sim.effects.effect import Effect
from thermospindle.sim.importing.mapping import MappingForm
from thermospindle.sim.study.form import StudyForm

MEANINGS = tomllib.loads((Path(__file__).parent / "meanings.toml").read_text(encoding="utf-8"))
FORMS: dict[str, type[BaseModel]] = {"scene": Scene, "campaign": CampaignTable, "mapping": MappingForm, "study": StudyForm}


def meaning(form: str, path: str, key: str) -> str:
    """What a key means, "" where nobody has said."""
    table = re.sub(r"[\[\]]|\.NAME", "", path)
    return MEANINGS[form].get(f"{table}.{key}") or MEANINGS[form].get(key, "")


def keys(form: str) -> Iterator[tuple[str, str]]:
    """(table, key) of every key of a file but those of provenance."""
    for path, table in _tables(FORMS[form].model_json_schema()):
        for key in table.get("properties", {}):
            if key not in ("origin", "source", "origins"):
                yield path, key


def reference(name: str, title: str, intro: str) -> str:
    """A page with one table for each table of a form: key, meaning, what is allowed, default."""
    schema = FORMS[name].model_json_schema()
    lines = [f"# {title}", "", intro, ""]
    for path, table in _tables(schema):
        lines += [f"## `{path}`" if path else "## At the top of the file", ""]
        if text := _words(table.get("description", "")):
            lines += [text, ""]
        lines += ["| key | what it is | what is allowed | without it |", "|---|---|---|---|"]
        for key, field in table.get("properties", {}).items():
            if key in ("origin", "source", "origins"):
                continue
            missing = "needed" if key in table.get("required", []) else _default(field)
            lines.append(f"| `{key}` | {meaning(name, path, key)} | {_allowed(field, schema)} | {missing} |")
        lines.append("")
    return "\n".join(lines)


def _words(text: str) -> str:
    """A docstring as one paragraph."""
    return re.sub(r"\s+", " ", text).strip().replace("|", "\\|")


def _tables(schema: Mapping[str, Any]) -> Iterator[tuple[str, Mapping[str, Any]]]:
    """Tables of a schema with their place in the file, each once."""
    seen: set[str] = set()

    def walk(path: str, table: Mapping[str, Any]) -> Iterator[tuple[str, Mapping[str, Any]]]:
        yield path, table
        for key, field in table.get("properties", {}).items():
            for name, suffix in _inside(field):
                if name not in seen:
                    seen.add(name)
                    here = f"{path.strip('[]')}.{key}" if path else key
                    yield from walk(f"[[{here}]]" if suffix == "list" else f"[{here}.NAME]" if suffix == "map" else f"[{here}]", schema["$defs"][name])

    return walk("", schema)


def _inside(field: Mapping[str, Any], suffix: str = "") -> Iterator[tuple[str, str]]:
    """Names of the tables in a field, and whether it is a list or a map of them."""
    if "$ref" in field:
        yield field["$ref"].rsplit("/", 1)[-1], suffix
    for other in field.get("anyOf", []):
        yield from _inside(other, suffix)
    if isinstance(field.get("items"), dict):
        yield from _inside(field["items"], "list")
    if isinstance(field.get("additionalProperties"), dict):
        yield from _inside(field["additionalProperties"], "map")


def _allowed(field: Mapping[str, Any], schema: Mapping[str, Any]) -> str:
    if "$ref" in field:
        return "a table"
    if "anyOf" in field:
        return " or ".join(dict.fromkeys(_allowed(f, schema) for f in field["anyOf"] if f.get("type") != "null"))
    if "enum" in field or "const" in field:
        return ", ".join(f"`{json.dumps(v)}`" for v in field.get("enum", [field.get("const")]))
    kind = {"number": "number", "integer": "whole number", "string": "text", "boolean": "`true` or `false`"}.get(field.get("type", ""), "")
    limits = [
        f"{sign} {field[key]:g}"
        for key, sign in (("exclusiveMinimum", "above"), ("minimum", "at least"), ("exclusiveMaximum", "below"), ("maximum", "at most"))
        if key in field
    ]
    if field.get("type") == "array":
        count = field.get("minItems")
        same = f"{count} " if count and count == field.get("maxItems") else f"at least {count} " if count else ""
        inner = field.get("items") or (field.get("prefixItems") or [{}])[0]
        each = _allowed(inner, schema) or "any value"
        return f"list of {same}" + ("tables" if each == "a table" else f"entries, each {each}")
    if field.get("type") == "object":
        inner = field.get("additionalProperties")
        return f"table of name = {_allowed(inner, schema) or 'value'}" if isinstance(inner, dict) and "$ref" not in inner else "tables by name"
    length = f", up to {field['maxLength']} letters" if "maxLength" in field else ""
    return f"{kind}{', ' if kind and limits else ''}{', '.join(limits)}{length}" or "any value"


def _default(field: Mapping[str, Any]) -> str:
    if "default" not in field:
        return "empty"
    value = field["default"]
    return "-" if value is None or isinstance(value, dict) else "empty" if value in ("", []) else f"`{json.dumps(value)}`"


# ---------------------------------------------------------------- effects


def effects(folder: Path) -> str:
    """The catalogue, with a picture of each effect: what it does to natural frequencies, to the lines of the runout, or to a measured FRF."""
    from effect_pictures import picture

    lines = ["# Effects", "", "What `spindle diagnose` asks about, and `spindle add` puts into a scene. Each picture shows what an effect does at its typical size to a spindle",
             "that it can be in: the paper's `hdd_2003`, or one that has what the effect needs. A parameter of unit 1 is a plain number.", ""]  # fmt: skip
    for effect in CATALOGUE:
        lines += _effect(effect, *picture(effect, folder))
    return "\n".join(lines)


def _effect(effect: Effect, picture: str, caption: str) -> list[str]:
    lines = [f"## {effect.name}", "", f"**{effect.title}.** Equation: `{effect.equation}`", ""]
    lines += [f"One sees: {effect.sees}.", "", f"Valid: {effect.valid}.", ""]
    if effect.resembles:
        lines += ["Easily taken for: " + ", ".join(f"[{n}](#{n})" for n in effect.resembles) + ".", ""]
    lines += [f"![{caption}]({picture})", "", f"*{caption}.*", "", "| parameter | unit | neutral | typical | prior s.d. | limits | meaning |", "|---|---|---|---|---|---|---|"]
    for p in effect.parameters:
        cells = (p.name, p.unit, f"{p.neutral:g}", f"{p.typical:g}", f"{p.prior_sd:g}", f"{p.limits[0]:g} to {p.limits[1]:g}", p.meaning)
        lines.append("| " + " | ".join(str(c).replace("|", "\\|") for c in cells) + " |")
    return [*lines, "", *(f"- Source of {p.name}: {p.source}" for p in effect.parameters), ""]


def command_line() -> str:
    """Every verb with its options, and the keys of its answer where they are told."""
    from thermospindle.options import parsers

    answers = tomllib.loads((Path(__file__).parent / "answers.toml").read_text(encoding="utf-8"))
    _, verbs = parsers()
    lines = ["# Command line", "", "`spindle VERB ...`; every verb takes `--json` (one JSON object on standard output, nothing else) and `--out DIR` (a folder written whole or",
             'not at all). What cannot be used ends with one sentence that names file, key, value and what is allowed, and exit code 2. `eval "$(spindle --completion bash)"`',
             "completes verbs and options.", ""]  # fmt: skip
    for name, verb in verbs.items():
        lines += [f"## spindle {name}", "", f"{verb.description}.", "", "```text", verb.format_help().split("\n\noptions:")[0].strip(), "```", "", "| option | what it does |", "|---|---|"]
        for action in verb._actions:
            if action.option_strings and action.dest not in ("help", "json", "out"):
                lines.append(f"| `{action.option_strings[-1]}` | {(action.help or '').replace('|', '/')} |")
        for form, keys_ in answers.items():
            if form == name or form.startswith(f"{name},"):
                head = "Answer of `--json`" + form.removeprefix(name) + (", in addition" if ", and " in form else "")
                lines += ["", f"{head.replace(', and ', ' ')}:", "", "| key | what it is |", "|---|---|", *(f"| `{k}` | {v} |" for k, v in keys_.items())]
        lines.append("")
    return "\n".join(lines)


THEORY = {
    "Expansion": ("thermal.elastic",),
    "Ball and roller contact": ("model.bearing.hertz", "model.bearing.ball_row", "model.bearing.heavy_ball.balance", "model.bearing.roller"),
    "Equilibrium of the bearings": ("model.bearing.pair", "model.bearing.springs", "model.rotor.loaded"),
    "Rotor and base": ("model.rotor.chain", "model.rotor.beam", "model.rotor.modes"),
    "What excites a running spindle": ("model.bearing.kinematics", "sim.running.excitation"),
    "The hammer test and its FRFs": ("sim.hammer.estimate", "sim.importing.records.hits", "sim.importing.records.spectra"),
    "Poles of a measurement": ("sim.identification.poles", "sim.identification.modal", "sim.identification.running_lines"),
    "Measured beside computed": ("diagnosis.compare.compare",),
    "Lines, noise and evidence": ("diagnosis.data.lines", "diagnosis.data.window", "diagnosis.forward.record", "diagnosis.inference.evidence", "diagnosis.inference.search"),
    "Warm-up": ("sim.warmup", "thermal.friction", "thermal.heat"),
}
"""Sections of the theory, and the modules whose docstrings tell them."""


def theory() -> str:
    """The equations as the modules tell them, so that no page says another thing than the program."""
    lines = []
    for title, modules in THEORY.items():
        lines += [f"## {title}", ""]
        for name in modules:
            lines += [f"### `{name}`", "", "```{eval-rst}", _displayed(import_module(f"thermospindle.{name}").__doc__ or ""), "```", ""]
    return "\n".join(lines)


def _displayed(text: str) -> str:
    """A docstring as reStructuredText whose indented lines are shown as they are, and in which no sign of mathematics is mark-up."""
    blocks = []
    for block in re.split(r"\n\s*\n", text.strip()):
        if all(line.startswith("    ") for line in block.splitlines()):
            blocks.append("::\n\n" + block)
        else:
            blocks.append(block.replace("**", r"\*\*").replace("|", r"\|"))
    return "\n\n".join(blocks)


def write_all(folder: Path) -> None:
    """Write every generated page into a folder of the site."""
    folder.mkdir(exist_ok=True)
    pages = {
        "scene": reference("scene", "Scene reference", "Every key of `spindle.toml`, as the loader checks it. Units are in the names of the keys. Every table with numbers also takes `origin` (printed, assumed or calibrated), `source`, and `origins` for single keys; a number without an origin is refused."),
        "campaign": reference("campaign", "Campaign reference", "Every key of `campaign.toml`, as the loader checks it. FRFs stand in UFF files beside it (dataset 58 or 58b), modes in a CSV file.")
        + "\n## `modes.csv`\n\nColumns, in this order: "
        + ", ".join(f"`{c}`" for c in MODE_COLUMNS)
        + f". Empty cells are allowed under {', '.join(f'`{k}`' for k, f in ModeTable.model_fields.items() if not f.is_required())}.\n",
        "mapping": reference("mapping", "Mapping reference", 'Every key of the mapping of `spindle import`, as it is checked. A value `"?"` is an open question.'),
        "study": reference("study", "Study reference", "Every key of the file of `spindle study`, as it is checked. Values of `[vary]` are lists, or tables of `from`, `to`, `steps` and `spacing`."),
        "cli": command_line(),
        "effects": effects(folder),
    }  # fmt: skip
    for name, text in pages.items():
        (folder / f"{name}.md").write_text(text, encoding="utf-8")
    (folder / "theory.inc").write_text(theory(), encoding="utf-8")


if __name__ == "__main__":
    write_all(Path(__file__).parent / "generated")
