"""A user's own effect: a Python file that defines EFFECT, or an entry point of group `thermospindle.effects` that names one.

Its functions are called under guard: whatever goes wrong in them, now or in the middle of a fit, is said in one sentence that names
file and line. To another process an effect of a file travels as the name of its file, which is run there too, once.
"""

from __future__ import annotations

import hashlib
import sys
import traceback
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cache
from importlib.metadata import EntryPoint, entry_points
from importlib.util import module_from_spec, spec_from_file_location
from pathlib import Path
from typing import Any, SupportsIndex

import numpy as np

from thermospindle.model.bearing.pair import PairState
from thermospindle.model.errors import BadInput, NoEquilibrium, OutsideRange, absent
from thermospindle.model.rotor.chain import RotorBase
from thermospindle.sim.effects.effect import HOOKS, Effect

GROUP = "thermospindle.effects"
STATES = (BadInput, NoEquilibrium, OutsideRange)  # what a function of an effect may raise: they say what is wrong with a state


@dataclass(frozen=True)
class Guarded:
    """A function of an effect that answers with what it should, or with `BadInput` naming the line that failed."""

    function: Callable[..., Any]
    effect: str
    hook: str
    where: str

    def __call__(self, *arguments: Any) -> Any:
        try:
            answer = self.function(*arguments)
        except STATES:
            raise
        except (Exception, SystemExit) as error:
            raise BadInput(f"{_line(self.where, error, self.function)}: effect {self.effect}: its {self.hook} {_said(error)}") from None
        wanted, keys = HOOKS[self.hook], tuple(answer) if isinstance(answer, dict) else ()
        if not isinstance(answer, wanted):
            said = f"returned {type(answer).__name__}; it must return {wanted.__name__}"
            raise BadInput(f"{_line(self.where, None, self.function)}: effect {self.effect}: its {self.hook} {said}")
        if wanted is dict and set(keys) != set(arguments[-1]):
            said = f"returned the keys {', '.join(map(str, keys))}; it must return those it was given, {', '.join(arguments[-1])}"
            raise BadInput(f"{_line(self.where, None, self.function)}: effect {self.effect}: its {self.hook} {said}")
        if said := _misshapen(answer):
            raise BadInput(f"{_line(self.where, None, self.function)}: effect {self.effect}: its {self.hook} gives {said}")
        return answer


def _misshapen(answer: Any) -> str:
    """What of an answer's elements or bearings is no matrix that a chain can have; empty where all are."""
    parts = [("element", e) for e in answer.elements] if isinstance(answer, RotorBase) else [("bearing", b) for b in answer.bearings] if isinstance(answer, PairState) else []
    for what, part in parts:
        for key in ("stiffness", "damping"):
            try:
                matrix = np.asarray(getattr(part, key))
            except ValueError as error:  # rows of different length
                return f"{what} {part.name!r} a {key} that is no matrix: {error}"
            if matrix.shape != (5, 5) or matrix.dtype.kind not in "fiu":
                return f"{what} {part.name!r} a {key} of shape {matrix.shape}, {matrix.dtype}; it must be (5, 5) real numbers"
    return ""


@dataclass(frozen=True)
class OwnEffect(Effect):
    """An effect that is not of the catalogue, and `where` it comes from: its file or its entry point.

    `file` is what it was read from, if it was; pickled, it is read again.
    """

    where: str = ""
    file: Path | None = None

    def __reduce_ex__(self, protocol: SupportsIndex) -> str | tuple[Any, ...]:
        return super().__reduce_ex__(protocol) if self.file is None else (effect_of, (self.file, self.where))


def guarded(effect: Effect, where: str) -> OwnEffect:
    """The effect with all its functions under guard."""
    keys = {name: getattr(effect, name) for name in Effect.__dataclass_fields__}
    for hook in HOOKS:
        function = keys[hook]
        if function is not None and not isinstance(function, Guarded):
            if not callable(function):
                raise BadInput(f"{where}: effect {effect.name}: {hook} = {function!r}: must be a function")
            keys[hook] = Guarded(function, str(effect.name), hook, where)
    return OwnEffect(**keys, where=where)


def effect_of(file: Path, where: str = "") -> OwnEffect:
    """The EFFECT of a Python file, called `where` in messages; `BadInput` where there is none,
    naming file and line. A file is run once until it is changed."""
    if not file.is_file():
        raise BadInput(f"--effect {where or file}: {absent(file)}; it must be a Python file that defines EFFECT")
    return _effect_of(file.resolve(), where or str(file), file.stat().st_mtime_ns)


@cache
def _effect_of(file: Path, where: str, changed: int) -> OwnEffect:
    name = f"effect_{hashlib.sha256(str(file).encode()).hexdigest()[:12]}"  # one that no other module has
    spec = spec_from_file_location(name, file)
    if spec is None or spec.loader is None:
        raise BadInput(f"--effect {where}: must be a Python file, named FILE.py")
    module = module_from_spec(spec)
    sys.modules[name] = module  # as `import` would have it: dataclasses of the file, for one, look there
    try:
        spec.loader.exec_module(module)
    except (Exception, SystemExit) as error:
        del sys.modules[name]
        raise BadInput(f"{_line(where, error)}: {_said(error)}") from None
    return replace(_effect(getattr(module, "EFFECT", None), where), file=file)


@cache
def installed() -> tuple[OwnEffect, ...]:
    """Effects of installed packages, in order of their names."""
    return tuple(_installed(point) for point in sorted(entry_points(group=GROUP)))


def _installed(point: EntryPoint) -> OwnEffect:
    package = point.dist.name if point.dist else "an unknown package"
    where = f"entry point {point.name} = {point.value} of {package}"
    try:
        found = point.load()
    except Exception as error:
        raise BadInput(f"{where}: {_said(error)}") from None
    return _effect(found, where)


def _effect(found: Any, where: str) -> OwnEffect:
    if not isinstance(found, Effect):
        said = "defines no EFFECT" if found is None else f"EFFECT is a {type(found).__name__}"
        raise BadInput(f"{where}: {said}; it must be a sim.effects.effect.Effect")
    return guarded(found, where)


def _said(error: BaseException) -> str:
    text = " ".join(str(error.msg if isinstance(error, SyntaxError) else error).split())
    return f"raises {type(error).__name__}" + (f": {text}" if text else "")


def _line(where: str, error: BaseException | None, function: Callable[..., Any] | None = None) -> str:
    """`file:line` of the last line of the user's file that an error went through, or where the function begins."""
    code = getattr(function, "__code__", None)
    file = code.co_filename if code else str(Path(where).resolve())
    if isinstance(error, SyntaxError) and error.filename == file:
        return f"{where}:{error.lineno}"
    lines = [f.lineno for f in traceback.extract_tb(error.__traceback__) if f.filename == file] if error else []
    line = lines[-1] if lines else code.co_firstlineno if code else None
    return where if line is None else f"{where}:{line}" if where.endswith(".py") else f"{where}, {file}:{line}"
