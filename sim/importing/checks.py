"""What files hold that cannot be used, and what a mapping tells of them that they do not hold: refused, whatever else is open."""

from __future__ import annotations

import re
from collections.abc import Sequence
from itertools import product
from pathlib import Path

import numpy as np

from thermospindle.model.errors import BadInput
from thermospindle.sim.importing.files.labels import end, same_end
from thermospindle.sim.importing.mapping import REST, FileForm, MappingForm, fits
from thermospindle.sim.importing.measured import Content, Curve, Read, listed
from thermospindle.sim.importing.places import place


def check_files(files: Sequence[Path], form: MappingForm, mapping: Path | None) -> None:
    """`BadInput` for files that are not there or named twice, and for tables of the mapping that are about none of them."""
    for f in files:
        if not f.is_file():
            raise BadInput(f"{f}: no such file")
    if len({f.resolve() for f in files}) < len(files):
        raise BadInput(f"{listed(f.name for f in files)}: a file is named twice")
    if unused := [t.file for t in form.files if not any(fits(t, f) for f in files)]:
        raise BadInput(f"{mapping}: files: file = {unused[0]!r}: is none of {listed(f.name for f in files)}")


def check_content(c: Content) -> None:
    """`BadInput` for a file with nothing of a measurement in it, and for an FRF that is dead, cut, or no number on a line."""
    if not (c.curves or c.motions or c.modes or c.places or c.unscaled or c.coherence or c.questions):
        raise BadInput(f"{c.file}: holds no FRF of a motion, no time record, no modes and no geometry" + (f"; {'; '.join(c.notes)}" if c.notes else ""))
    for x in c.curves:
        if x.value.shape != x.frequency.shape:
            raise BadInput(f"{c.file}: {x.where}: {x.value.size} values at {x.frequency.size} frequencies; there must be as many")
        if not np.any(x.value) and x.magnitude_only:
            raise BadInput(f"{c.file}: {x.where}: zero on every line; a dead channel is not allowed: tell it as \"ignore\" in columns")
        used = (x.frequency > 0) | x.magnitude_only  # a receptance out of an acceleration is none at 0 Hz
        if len(wrong := np.flatnonzero(~np.isfinite(x.value) & used)):
            more = f", and {len(wrong) - 1} more lines are none either" if len(wrong) > 1 else ""
            at = f"on line {wrong[0] + 1}" if any(q.key == "step_Hz" for q in c.questions) else f"at {x.frequency[wrong[0]]:g} Hz"
            raise BadInput(f"{c.file}: {x.where}: its value {at} is no number{more}; take the FRF out of the file, or export it again")


def check_columns(form: MappingForm, contents: Sequence[Content], mapping: Path | None) -> None:
    """`BadInput` for a column that the mapping tells and none of the files that it is about has."""
    for table in form.files:
        names = dict.fromkeys(n for c in contents if fits(table, c.file) for n in c.names)
        known = {REST, *names, *(n.rsplit(".", 1)[-1] for n in names)}
        if wrong := [name for name in table.columns if name not in known]:
            called = [n for n in names if not re.fullmatch(r"(column )?\d+", n)] or [n for n in names if not n.isdigit()]
            there = listed(called, 12) or "none, for UFF and tables of modes say themselves what they hold"
            raise BadInput(f"{mapping}: files: columns: {wrong[0]!r} is no column of {table.file}; there are {there}")


def check_ends(form: MappingForm, contents: Sequence[Content], settings: dict[Path, FileForm], mapping: Path | None) -> None:
    """`BadInput` for a point that the mapping tells of files whose headings all tell others: which of the two is meant nobody knows."""
    for table, key in product(form.files, ("response", "reference")):
        own = [c for c in contents if fits(table, c.file) and getattr(settings[c.file], key) == getattr(table, key)]
        told = [getattr(x, key) for c in own for x in c.curves] + [m.end for c in own for m in c.motions if m.force == (key == "reference")]
        if getattr(table, key) is not None and told and not any(same_end(end(str(getattr(table, key))), e) for e in told):
            raise BadInput(
                f"{mapping}: files: {key} = {getattr(table, key)!r}: the headings of {table.file} say {listed(dict.fromkeys(e.label for e in told))}; allowed is what a heading leaves open, or "
                f'the way that it looks, as in "{told[0].label.partition(":")[0]}:-Z", and columns tells another heading'
            )


def check_tests(found: Read, files: Sequence[Path]) -> None:
    """`BadInput` for files that make no test, whatever is answered: there is nothing to ask of them."""
    if not found.tests:
        raise BadInput(f"{listed(f.name for f in files)}: no FRF, time record or mode in {'it' if len(files) == 1 else 'them'}; geometry, spectra or coherence alone are no campaign")


def names_of(curve: Curve, response: int | str, reference: int | str) -> set[str]:
    """What `leave_out` may call a curve between two nodes."""
    return {f"H({r},{q})" for r in (response, curve.response.label) for q in (reference, curve.reference.label)}


def check_left_out(found: Read, form: MappingForm, settings: dict[Path, FileForm], mapping: Path | None) -> None:
    """`BadInput` for what `leave_out` names and no file holds; sets of UFF files are left out as they are read."""
    curves = [c for every in found.curves.values() for c in every if not c.magnitude_only]
    ends = [[(place(e, form, found.points) or (e.label,))[0] for e in (c.response, c.reference)] for c in curves]
    known = {n for c, (r, q) in zip(curves, ends, strict=True) for n in names_of(c, r, q)}
    for own in settings.values():
        for name in own.leave_out:
            if not name.startswith("set ") and name.replace(" ", "") not in known:
                raise BadInput(f"{mapping}: files: leave_out: {name!r} is no FRF of the files; there are {listed(sorted(known), 6)}")
