"""Long work that was stopped: what its parallel steps had computed, kept until the whole is done,
so that the same work asked for again goes on from there.

The parts of such work are asked for in the same order every time, each by a call of `in_parallel`; the results of every call are
kept in a file of its own, in order. They are pickles, each with its digest, in the cache that only this user can write to (`kept`),
in a folder whose name is the hash of all that they follow from: question, code, versions and number of workers. Work that takes
less than `SOON` keeps nothing, and what was not asked for longest goes first where all of it takes more than `MOST_BYTES`.
"""

from __future__ import annotations

import hashlib
import platform
import shutil
import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager, suppress
from functools import cache
from importlib.metadata import version
from pathlib import Path
from typing import Any

from thermospindle.model.errors import BadInput
from thermospindle.model.files import kept, whole
from thermospindle.model.parallel import cores, keeping, packed, unpacked

SOON = 120.0
"""s that work may take before anything of it is kept: so much is done again."""
MOST_BYTES = 1 << 30
ROOMS = ("model", "thermal", "sim", "diagnosis", "report")
LIBRARIES = ("mujoco", "numpy", "scipy", "scikit-fem")
LENGTH = 8
HEAD = 2 * LENGTH + hashlib.sha256().digest_size


@contextmanager
def going_on(question: bytes, told: Callable[[str], object]) -> Iterator[None]:
    """Within it the results of `in_parallel` are kept until the end, and what a stopped run of the
    same `question` has kept is not computed again; `told` is what may be said of it."""
    with ExitStack() as held:
        try:
            work = _folder(question)
            if work is not None:
                held.enter_context(whole.alone(work))
        except (BadInput, OSError):  # the same work is being done elsewhere, or nothing can be kept
            work = None
        if work is None:
            yield
            return
        pages = _Pages(work, told)
        try:
            with keeping(pages.page):
                yield
        except KeyboardInterrupt:
            if pages.written:
                told("what was computed is kept; the same command goes on from there")
                work = None
            raise
        finally:
            if work is not None:  # it is done, or ends alike when it is asked for again
                shutil.rmtree(work, ignore_errors=True)


class _Pages:
    """One file for the results of each call of `in_parallel`, by its number; nothing is written
    before `SOON`, and nothing any more once all of it is too much."""

    def __init__(self, folder: Path, told: Callable[[str], object]) -> None:
        self.folder, self.told, self.began = folder, told, time.monotonic()
        self.number, self.written, self.waiting = 0, 0, list[tuple[Path, Any]]()
        if any(folder.iterdir()):
            told("goes on from what a run that was stopped has computed")

    def page(self, count: int) -> tuple[list[Any], Callable[[Any], None]]:
        """Results of the next call, of `count` items, that are known; and what keeps a further one."""
        self.number += 1
        file = self.folder / f"{self.number:04d}-{count}"
        known = _read(file)
        self.written += sum(size for _, size in known)

        def add(result: Any) -> None:
            self.waiting.append((file, result))
            if time.monotonic() - self.began > SOON or self.written:
                self._write()

        return [result for result, _ in known], add

    def _write(self) -> None:
        with suppress(OSError):
            for file, result in self.waiting:
                if self.written < MOST_BYTES:
                    record = _record(result)
                    with file.open("ab") as at:
                        at.write(record)
                    self.written += len(record)
        self.waiting.clear()


def _record(result: Any) -> bytes:
    """Length in bytes, length of what is compressed in it, digest of all but itself, and that: zstd
    takes a third of the space of a fit, in a quarter of zlib's time."""
    import pyarrow as pa  # takes its time to load: not where nothing is kept

    plain = packed(result)
    pressed = pa.compress(plain, codec="zstd", asbytes=True)
    lengths = len(pressed).to_bytes(LENGTH, "big") + len(plain).to_bytes(LENGTH, "big")
    return lengths + hashlib.sha256(lengths + pressed).digest() + pressed


def _read(file: Path) -> list[tuple[Any, int]]:
    """Results of a file and how many bytes each takes; what follows one that is damaged, as the last of a killed run may be, is cut off."""
    import pyarrow as pa

    found, good = list[tuple[Any, int]](), 0
    try:
        content = file.read_bytes()
        while good < len(content):
            head, start = content[good : good + HEAD], good + HEAD
            pressed = content[start : start + int.from_bytes(head[:LENGTH], "big")]
            if hashlib.sha256(head[: 2 * LENGTH] + pressed).digest() != head[2 * LENGTH :]:
                break
            plain = pa.decompress(pressed, int.from_bytes(head[LENGTH : 2 * LENGTH], "big"), codec="zstd", asbytes=True)
            found.append((unpacked(plain), HEAD + len(pressed)))
            good = start + len(pressed)
        if good < len(content):
            with file.open("r+b") as at:
                at.truncate(good)
    except OSError:
        return []
    return found


def _folder(question: bytes) -> Path | None:
    """The folder for a question, made where it is not there; None where nothing may be kept."""
    place = kept.folder()
    if place is None or not kept.trusted(place):
        return None
    name = hashlib.sha256(_code() + f"{cores()} {platform.python_version()}".encode() + question).hexdigest()[:32]
    work = place / f"unfinished-{name}"
    for new in (place, work):  # `parents` would have the usual mode
        new.mkdir(mode=0o700, parents=True, exist_ok=True)
    work.touch()
    total = 0
    for other in sorted(place.glob("unfinished-*"), key=lambda f: f.stat().st_mtime, reverse=True):
        total += sum(f.stat().st_size for f in other.iterdir())
        if total > MOST_BYTES and other != work:
            with suppress(BadInput), whole.alone(other):
                shutil.rmtree(other, ignore_errors=True)
    return work


@cache
def _code() -> bytes:
    """Digest of the program and of the versions of what it computes with."""
    found = hashlib.sha256(" ".join(f"{name} {version(name)}" for name in LIBRARIES).encode())
    for file in sorted(f for room in ROOMS for f in (Path(__file__).resolve().parents[2] / room).rglob("*.py")):
        found.update(file.read_bytes())
    return found.digest()
