"""Written whole or not at all: what fails, what is killed, and what is left of it."""

import errno
import os
import subprocess
import sys
from pathlib import Path

import pyarrow as pa
import pytest

from thermospindle.model.errors import BadInput
from thermospindle.model.files import whole as whole_files
from thermospindle.model.files.whole import whole
from thermospindle.sim.study.parts import opened, write_table

ROOT = Path(__file__).parents[2]


def write(path: Path, text: str) -> None:
    """A folder with one file."""
    with whole(path) as folder:
        folder.mkdir()
        (folder / "text").write_text(text)


def test_a_folder_and_a_file_replace_what_stood_there(tmp_path):
    for text in ("old", "new"):
        write(tmp_path / "folder", text)
        with whole(tmp_path / "file") as file:
            file.write_text(text)
    assert (tmp_path / "folder" / "text").read_text() == (tmp_path / "file").read_text() == "new"
    assert sorted(p.name for p in tmp_path.iterdir()) == ["file", "folder"]


def test_the_old_one_stays_when_writing_fails(tmp_path):
    write(tmp_path / "a", "old")
    with pytest.raises(BadInput, match=rf"^{tmp_path}/a/text: is wrong$"), whole(tmp_path / "a") as folder:  # noqa: PT012
        folder.mkdir()
        raise BadInput(f"{folder}/text: is wrong")
    assert (tmp_path / "a" / "text").read_text() == "old"
    assert [p.name for p in tmp_path.iterdir()] == ["a"]


def test_what_cannot_be_written_is_named_as_it_was_asked_for(tmp_path):
    """Not by the hidden folder that it would have been written in."""
    with pytest.raises(FileNotFoundError) as told, whole(tmp_path / "nowhere" / "a"):
        pass
    assert told.value.filename == str(tmp_path / "nowhere" / "a")


@pytest.mark.parametrize("when", [1, 2, 3])
def test_the_old_or_the_new_one_can_be_had_after_a_kill(tmp_path, when):
    """Killed before the first, second and third move of a replacement; the next writer puts the old one back and clears away."""
    write(tmp_path / "a", "old")
    script = f"""
import os, signal, sys
from pathlib import Path
from thermospindle.model.files import whole
replace, moves = os.replace, []
def counted(*paths):
    moves.append(paths)
    if len(moves) == {when}:
        os.kill(os.getpid(), signal.SIGKILL)
    replace(*paths)
whole.os.replace = counted
with whole.whole(Path(sys.argv[1])) as folder:
    folder.mkdir()
    (folder / "text").write_text("new")
"""
    code = subprocess.run([sys.executable, "-c", script, tmp_path / "a"], cwd=ROOT, env=os.environ | {"PYTHONPATH": str(ROOT)}).returncode
    moved = 2  # the old one away, the new one in
    assert code == (0 if when > moved else -9)
    left = [p for p in tmp_path.iterdir() if p.name != "a"]
    assert len(left) == (0 if when > moved else 1)
    with pytest.raises(KeyboardInterrupt), whole(tmp_path / "a"):  # noqa: PT012
        assert (tmp_path / "a" / "text").read_text() == ("new" if when > moved else "old")
        raise KeyboardInterrupt
    assert [p.name for p in tmp_path.iterdir()] == ["a"]


def test_work_of_a_living_process_is_left_alone(tmp_path):
    with whole(tmp_path / "a") as first:
        first.write_text("first")
        with whole(tmp_path / "a") as second:
            second.write_text("second")
        assert first.read_text() == "first"
    assert (tmp_path / "a").read_text() == "first"


def test_names_that_are_patterns_or_long(tmp_path):
    for name in ("a[1]*?", "n" * 250):
        for text in ("old", "new"):
            write(tmp_path / name, text)
        assert (tmp_path / name / "text").read_text() == "new"
    assert len(list(tmp_path.iterdir())) == 2


def test_what_killed_runs_left_of_a_study_goes_when_it_is_gone_on_with(tmp_path):
    """A run killed after its part stood and before its work folder was gone: that part is not
    written again, and the folder stayed for good."""
    for _ in range(2):
        with opened(tmp_path / "study", {"study": "a"}, 4, 2, pa.schema({})) as folder:
            write_table(pa.table({}), folder.part(0))
            left = [tmp_path / "study" / "parts" / ".part-000000.parquet.spindle-killed" / "new", tmp_path / "study" / ".study.json.spindle-killed" / "old"]
            for place in left:
                place.mkdir(parents=True)
    with opened(tmp_path / "study", {"study": "a"}, 4, 2, pa.schema({})) as folder:
        assert not any(place.parent.exists() for place in left)
        assert folder.part(0).exists()


def test_where_folders_have_no_locks_things_are_written_all_the_same(tmp_path, monkeypatch):
    """As on some network drives: no lock is not a lock that another has."""

    def unsupported(*asked):
        raise OSError(errno.ENOTSUP, os.strerror(errno.ENOTSUP))

    monkeypatch.setattr(whole_files.fcntl, "flock", unsupported)
    write(tmp_path / "a", "new")
    assert (tmp_path / "a" / "text").read_text() == "new"
    assert [p.name for p in tmp_path.iterdir()] == ["a"]
    with whole_files.alone(tmp_path):
        pass


def test_where_no_lock_can_be_asked_for_nothing_goes_on_for_ever(tmp_path, monkeypatch):
    """As at the limit of open files: a folder after the other was made."""
    opened = os.open

    def full(path, *asked, **more):
        if asked[0] == os.O_RDONLY and Path(path).is_dir():
            raise OSError(errno.EMFILE, os.strerror(errno.EMFILE))
        return opened(path, *asked, **more)

    monkeypatch.setattr(whole_files.os, "open", full)
    with pytest.raises(OSError, match="open files"):
        write(tmp_path / "a", "new")


def test_a_folder_that_is_not_there_is_not_said_to_be_written(tmp_path):
    with pytest.raises(FileNotFoundError), whole_files.alone(tmp_path / "nowhere"):
        pass


def test_an_interrupt_between_the_moves_puts_the_old_one_back(tmp_path, monkeypatch):
    write(tmp_path / "a", "old")
    move = os.replace

    def interrupted(path, target):
        move(path, target)
        if Path(path) == tmp_path / "a":
            raise KeyboardInterrupt

    monkeypatch.setattr(whole_files.os, "replace", interrupted)
    with pytest.raises(KeyboardInterrupt):
        write(tmp_path / "a", "new")
    assert (tmp_path / "a" / "text").read_text() == "old"


RACE = """
import sys
from pathlib import Path
from thermospindle.report.folder import mark, whole_folder
for k in range(60):
    with whole_folder(Path(sys.argv[1]) / "out") as folder:
        for name in "abc":
            (folder / name).write_text(f"{sys.argv[2]} {k}")
        mark(folder, {"verb": "race"}, {})
"""


def test_of_several_writers_the_last_ones_folder_stands_whole(tmp_path):
    writers = [subprocess.Popen([sys.executable, "-c", RACE, str(tmp_path), str(k)], cwd=ROOT, stderr=subprocess.PIPE, text=True) for k in range(3)]
    said = [writer.communicate()[1] for writer in writers]
    assert [writer.returncode for writer in writers] == [0, 0, 0], said
    assert len({(tmp_path / "out" / name).read_text() for name in "abc"}) == 1
    assert [p.name for p in tmp_path.iterdir()] == ["out"]
