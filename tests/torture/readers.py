"""Every reader of files that come from others: whole files to begin with (`wholes`), and what it
does with one. The property tests, the fuzzer (`tests/fuzz`) and `tests/faults` share them.
"""

from __future__ import annotations

import shutil
import zipfile
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from tests.conftest import SCENE
from tests.torture.machines import FILES
from tests.torture.wholes import (
    KEPT,
    MAPPING,
    OF_PEAKS,
    PEAKS,
    STUDIES,
    TABLE,
    arrays,
    diagnosis,
    kept,
    log,
    matlab,
    modes,
    one_array,
    own_uff,
    shapes,
    small_uff,
    stiffness,
    study_key,
    uffs,
)
from thermospindle.diagnosis.answer import read_answer
from thermospindle.diagnosis.draft.draft import draft
from thermospindle.diagnosis.prediction.outcomes import outcomes
from thermospindle.model.errors import BadInput
from thermospindle.model.files.stiffness_table import read_table
from thermospindle.model.scene.bearing_numbers import Numbers
from thermospindle.model.scene.reading import load
from thermospindle.report.log.read import check_readable, read_log
from thermospindle.report.log.told import describe
from thermospindle.sim.campaign.campaign import read_campaign, write_campaign
from thermospindle.sim.campaign.published import read_published
from thermospindle.sim.importing.assemble import campaign_of, read
from thermospindle.sim.importing.mapping import MappingForm, read_mapping
from thermospindle.sim.study.form import read_study
from thermospindle.sim.study.parts import opened

# ---------------------------------------------------------------- what is done with a file


def _campaign_of_modes(file: Path) -> None:
    for name in {"campaign.toml", "modes.csv"} - {file.name}:
        (file.parent / name).write_bytes(modes(name))
    for test in read_campaign(file.parent).tests:
        assert all(np.isfinite([r.frequency, r.frequency_sd]).all() and r.frequency > 0 for r in test.modes or ())


def _campaign_of_shapes(file: Path) -> None:
    for name in ("campaign.toml", "modes.csv"):
        (file.parent / name).write_bytes(shapes(name))
    for test in read_campaign(file.parent).tests:
        for row in test.modes:
            assert [at.node for at in row.shape] == list(test.shape_nodes)
            assert all(np.isfinite([at.value.real, at.value.imag, at.sd]).all() and at.sd > 0 for at in row.shape)


def _campaign_of_frfs(file: Path) -> None:
    text = (SCENE / "virtual" / "soak_20_60" / "campaign.toml").read_text(encoding="utf-8")
    (file.parent / "campaign.toml").write_text(text[: text.index("[[tests]]", text.index("[[tests]]") + 5)], encoding="utf-8")
    for test in read_campaign(file.parent).tests:
        assert test.frf is None or np.all(np.isfinite(test.frf.value))


def _to_import(file: Path) -> None:
    read([file], MappingForm(), None)


def _packed(file: Path) -> None:
    """An array packed whole, whatever is wrong with it: the sum that guards a .npz hides most damage done to one."""
    packed = file.with_name("packed.npz")
    with zipfile.ZipFile(packed, "w") as archive:
        archive.writestr("frequency.npy", one_array(np.arange(100.0, 200.0)))
        archive.writestr("H_3_1.npy", file.read_bytes())
    _to_import(packed)


def _to_campaign(file: Path) -> None:
    """With the mapping that answers what the file does not tell."""
    mapping = file.with_name("m.toml")
    mapping.write_bytes(MAPPING)
    form = read_mapping(mapping)
    found, _ = campaign_of(read([file], form, None, mapping), form, None, [file], mapping)
    assert all(test.frf is None or np.all(np.isfinite(test.frf.value)) for test in found.tests)


def _peaks(file: Path) -> None:
    """What is taken of a table of modes can be written, and read again as it was."""
    mapping, place = file.with_name("m.toml"), file.with_name("made")
    mapping.write_bytes(OF_PEAKS)
    shutil.rmtree(place, ignore_errors=True)
    form = read_mapping(mapping)
    found, _ = campaign_of(read([file], form, None, mapping), form, None, [file], mapping)
    write_campaign(found, place)
    try:
        assert read_campaign(place).tests[0].modes == found.tests[0].modes
    except BadInput as error:
        raise AssertionError("what was written is refused when it is read") from error


def _published(file: Path) -> None:
    for row in read_published(file).frequency.values():
        assert all(0 < f < np.inf for f in row)


def _bearing_table(file: Path) -> None:
    """The table of stiffness that a scene names."""
    grid = Numbers(table=file.name, bearing="upper", damping_ratio=0.01).grid(file.with_name("spindle.toml"), "table")
    assert all(np.isfinite(part).all() for part in grid)


def _mapping(file: Path) -> None:
    table = file.with_name("right.csv")
    table.write_bytes(TABLE)
    form = read_mapping(file)
    campaign_of(read([table], form, None, file), form, None, [table], file)


def _study_key(file: Path) -> None:
    """The file by which a study is gone on with."""
    import pyarrow as pa

    data, place = file.read_bytes(), file.with_name("begun")
    shutil.rmtree(place, ignore_errors=True)
    with opened(place, {"study": "a"}, 10, 2, pa.schema({})):
        pass
    (place / "study.json").write_bytes(data)
    with opened(place, {"study": "a"}, 10, 2, pa.schema({})) as found:
        assert found.count == 5


def _cache(file: Path) -> None:
    """A kept answer that was damaged is computed again: never another number, never an error."""
    from thermospindle.model.files import kept as files

    place = files._file
    files._file = lambda kind, question, code: file
    try:
        found = files.read("influence", "q", "")
        assert found is None or np.array_equal(found[1]["a"], KEPT["a"])
    finally:
        files._file = place


def _log(file: Path) -> None:
    """A process is started first, since what reads logs may abort."""
    check_readable(file)
    describe(read_log(file))


@dataclass(frozen=True)
class Reader:
    """`file` is the name a file of this kind has; `whole` gives some that are not damaged; `read` returns, or raises a named error."""

    file: str
    whole: Callable[[], tuple[bytes, ...]]
    read: Callable[[Path], object]

    def __call__(self, folder: Path, data: bytes) -> None:
        """Reads `data` as the only damaged file of a folder of its own."""
        folder.mkdir(exist_ok=True)
        (folder / self.file).write_bytes(data)
        self.read(folder / self.file)


READERS = {
    "scene": Reader("spindle.toml", lambda: tuple(f.read_bytes() for f in FILES.values()), load),
    "campaign": Reader("campaign.toml", lambda: (modes("campaign.toml"),), _campaign_of_modes),
    "modes": Reader("modes.csv", lambda: (modes("modes.csv"),), _campaign_of_modes),
    "shapes": Reader("shapes.csv", lambda: (shapes("shapes.csv"),), _campaign_of_shapes),
    "campaign-uff": Reader("T20_n0.uff", lambda: (own_uff(), small_uff()), _campaign_of_frfs),
    "uff": Reader("lab.uff", uffs, _to_import),
    "csv": Reader("lab.csv", lambda: (TABLE,), _to_campaign),
    "mode-table": Reader("lab.csv", lambda: (PEAKS,), _peaks),
    "npz": Reader("lab.npz", lambda: (arrays(),), _to_import),
    "npy": Reader("H.npy", lambda: (one_array(np.ones(100) * (1 + 1j)), one_array(np.array(["a", "b"]))), _packed),
    "mat": Reader("lab.mat", lambda: tuple(matlab(kind) for kind in ("plain", "packed", "hdf5")), _to_import),
    "mapping": Reader("mapping.toml", lambda: (MAPPING,), _mapping),
    "study": Reader("study.toml", lambda: STUDIES, read_study),
    "study-key": Reader("study.json", lambda: (study_key(),), _study_key),
    "diagnosis": Reader("diagnosis.json", lambda: (diagnosis(),), read_answer),
    "diagnosis-draft": Reader("diagnosis.json", lambda: (diagnosis(),), lambda file: draft(file, "own", None)),
    "diagnosis-predicted": Reader("diagnosis.json", lambda: (diagnosis(),), lambda file: outcomes(file, [])),
    "stiffness": Reader("table.csv", lambda: (stiffness(),), read_table),
    "bearing-table": Reader("table.csv", lambda: (stiffness(),), _bearing_table),
    "published": Reader("paper.csv", lambda: ((SCENE / "published" / "jang_2003_analysis.csv").read_bytes(),), _published),
    "cache": Reader("influence-0.npz", lambda: (kept(),), _cache),
    "log": Reader("log.rrd", lambda: (log(),), _log),
}
