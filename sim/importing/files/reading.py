"""Which reader a file needs, and what is in it."""

from __future__ import annotations

from pathlib import Path

from thermospindle.model.errors import BadInput
from thermospindle.sim.importing.files.arrays import read_arrays
from thermospindle.sim.importing.files.columns import from_arrays, from_table
from thermospindle.sim.importing.files.mode_tables import from_modes, headings, without_frequency
from thermospindle.sim.importing.files.text import read_table
from thermospindle.sim.importing.files.uff_sets import from_uff
from thermospindle.sim.importing.mapping import FileForm
from thermospindle.sim.importing.measured import Content

ARRAYS = (".npz", ".mat")
UFF = (".uff", ".unv", ".ufb", ".bunv")


def content(file: Path, settings: FileForm) -> Content:
    """What a file holds, by its ending and its first line. Raises `BadInput` for what cannot be read."""
    if not file.is_file():
        raise BadInput(f"{file}: no such file")
    if file.stat().st_size == 0:
        raise BadInput(f"{file}: is empty")
    if file.suffix.lower() in ARRAYS:
        return from_arrays(file, read_arrays(file), settings)
    if file.suffix.lower() in UFF or _begins_as_uff(file):
        return from_uff(file, settings)
    if headings(file) is not None:
        return from_modes(file, settings)
    try:
        return from_table(read_table(file), settings)
    except BadInput:
        if why := without_frequency(file):
            raise BadInput(why) from None
        raise


def _begins_as_uff(file: Path) -> bool:
    with file.open("rb") as stream:
        return stream.readline(90).rstrip() == b"    -1"
