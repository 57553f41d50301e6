"""The command line: `spindle VERB SCENE [options]`. It parses (`options`), calls the verb's
function in `report.verbs`, prints, and nothing else.

Only what parsing needs is imported at the start; a verb's module, and with it the libraries that compute, when the verb is called.
"""

from __future__ import annotations

import os

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # small matrices: more threads only wait for each other; set before numpy loads
os.environ["MPLBACKEND"] = "agg"  # pictures go to files; a backend that there is not would end in a traceback
os.environ.setdefault("PYTHONSAFEPATH", "1")  # processes that this one starts import nothing from the folder one happens to stand in: it may be a stranger's

import errno
import json
import shlex
import sys
import tempfile
from collections.abc import Iterator, Sequence
from contextlib import contextmanager, redirect_stdout
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING, Any

from thermospindle.model.errors import BadInput, NoEquilibrium, NotConverged, OutsideRange, Unanswered, instead, visible
from thermospindle.options import parsers
from thermospindle.report.folder import COMMAND, MARK

WRITTEN = ("out", "mapping")  # options that name what is written

if TYPE_CHECKING:
    from rich.console import Console


def main(arguments: Sequence[str] | None = None) -> int:
    """Run one verb; returns 0, 2 for what cannot be used, read or written, 130 when stopped."""
    try:
        return _run(sys.argv[1:] if arguments is None else list(arguments))
    except Unanswered as error:
        lines = f"spindle: {error.head}", *(f"  {k}. {item}" for k, item in enumerate(error.items, 1)), error.tail
        print(*map(visible, lines), sep="\n", file=sys.stderr)
        return 2
    except (BadInput, OutsideRange, NoEquilibrium, NotConverged) as error:
        return _refused(str(error))
    except BrokenPipeError:  # whoever read the output has enough of it
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return 0
    except OSError as error:
        where = f"{error.filename}: " if error.filename is not None else ""
        return _refused(f"{where}{error.strerror or error}")
    except RuntimeError as error:
        if not str(error).startswith("Symlink loop"):  # as pathlib tells it before Python 3.13
            raise
        return _refused(str(error))
    except MemoryError as error:
        return _refused(f"not enough memory for what was asked{f' ({error})' if str(error) else ''}")
    except KeyboardInterrupt:
        print("spindle: stopped; nothing was left half written", file=sys.stderr)
        return 130


def _run(arguments: list[str]) -> int:
    parser, verbs = parsers()
    if not arguments:
        parser.print_help()
        return 0
    if not arguments[0].startswith("-") and arguments[0] not in verbs:
        parser.error(f"verb {arguments[0]!r} is unknown; {instead(arguments[0], verbs)}")
    options, rest = parser.parse_known_args(arguments)
    if rest:
        known = verbs[arguments[0]]._option_string_actions
        if not rest[0].startswith("-"):
            taken = " ".join(str(a.metavar) for a in verbs[arguments[0]]._actions if not a.option_strings) or "nothing"
            parser.error(f"{rest[0]!r} is one too many: {arguments[0]} takes {taken}")
        parser.error(f"{rest[0]} is no option of {arguments[0]}; {instead(rest[0], known)}")
    asked = vars(options)
    as_json, (module, function) = asked.pop("json", False), asked.pop("verb")
    token = COMMAND.set(shlex.join(["spindle", *arguments]))
    try:
        _ask_to_write(asked.get("out"))
        _keep_what_is_asked_for(asked)
        with _alone_on_stdout(as_json):
            answer = getattr(import_module(f"thermospindle.report.verbs.{module}"), function)(**asked)
    except OSError as error:
        if told := _not_writable(error, asked):
            raise BadInput(told) from None
        raise
    except OutsideRange as error:  # a law or table, which tells its key, of the scene asked for
        raise OutsideRange(_with_file(str(error), asked.get("scene"))) from None
    finally:
        COMMAND.reset(token)
    for doubt in answer.values["warnings"]:
        print(f"spindle: warning: {visible(doubt)}", file=sys.stderr)
    if as_json:
        print(json.dumps(answer.values))
    else:
        answer.show(_terminal())
    if sys.stdout is not None:  # closed by the caller
        sys.stdout.flush()
    answer.then()
    return 0


def _with_file(told: str, scene: object) -> str:
    """A sentence about a scene with its file before it, where that is not told yet."""
    if not isinstance(scene, str | Path):
        return told
    file = str(import_module("thermospindle.model.scene.reading").scene_path(scene))
    return told if file in told else f"{file}: {told}"


@contextmanager
def _alone_on_stdout(as_json: bool) -> Iterator[None]:
    """Whatever is printed while a verb works, by an effect of one's own or a process that it
    starts, goes to standard error where one JSON object is asked for."""
    try:
        kept = os.dup(1) if as_json else -1
    except OSError:  # closed by the caller
        kept = -1
    if kept < 0:
        yield
        return
    try:
        os.dup2(2, 1)
        with redirect_stdout(sys.stderr):
            yield
    finally:
        os.dup2(kept, 1)
        os.close(kept)


def _ask_to_write(out: Path | None) -> None:
    """OSError, before anything is worked out, where nothing can be written at `out`: a file without a name is made beside it, and gone."""
    if out is not None:
        try:
            tempfile.TemporaryFile(dir=next(p for p in Path(out).absolute().parents if p.is_dir())).close()
        except OSError as error:
            raise OSError(error.errno, error.strerror, str(out)) from None


def _keep_what_is_asked_for(asked: dict[str, Any]) -> None:
    """Refuse (`BadInput`) an output folder that holds what is read for it: a folder of the program's own is replaced whole."""
    out = asked.get("out")
    if out is None or not (Path(out) / MARK).is_file():
        return
    told = [v for value in asked.values() for v in (value if isinstance(value, list) else [value]) if isinstance(v, Path) and v is not out]
    for path in told:
        if path.exists() and Path(out).resolve() in (path.resolve(), *path.resolve().parents):
            raise BadInput(f"--out {out}: holds {path}, which is read; name another folder")


def _not_writable(error: OSError, asked: dict[str, Any]) -> str:
    """What option names a place where nothing may be written, and what is allowed; empty of any other error."""
    if error.errno not in (errno.EACCES, errno.EPERM, errno.EROFS, errno.ENOENT) or error.filename is None:
        return ""
    place = Path(error.filename).absolute()
    for name in WRITTEN:
        if (value := asked.get(name)) is not None:
            own = Path(value).absolute()
            if place == own or place in own.parents or own in place.parents:
                return f"--{name} {value}: {error.strerror}; name a place where you may write"
    return ""


def _terminal() -> Console:
    """Where results are shown; names of scenes and files may look like markup. Rich's own ends the program with 1 where a pipe is closed."""
    from rich.console import Console
    from rich.segment import Segment

    class Terminal(Console):
        def render(self, *arguments: Any, **keywords: Any) -> Iterator[Segment]:
            for part in super().render(*arguments, **keywords):
                yield part if part.control else part._replace(text=visible(part.text))

        def on_broken_pipe(self) -> None:
            raise BrokenPipeError

    return Terminal(markup=False)


def _refused(why: str) -> int:
    print(f"spindle: {visible(' '.join(why.split()))}", file=sys.stderr)
    return 2


if __name__ == "__main__":
    sys.exit(main())
