"""Modes of FRFs that were extracted before: kept on disk (`model.files.kept`), a file a test, under
the hash of all that `extract` is given.

A measurement is looked at many times, by `compare`, `ladder` and `workbench`, and its extraction is the longest step of opening it.
"""

from __future__ import annotations

import json
from dataclasses import fields
from pathlib import Path
from typing import Any

import numpy as np
import scipy

from thermospindle.model.files import kept
from thermospindle.model.types import Array, ComplexArray
from thermospindle.sim.identification.modal import Modes, extract

KIND = "modes"


def extracted(frequency: Array, value: ComplexArray, sd: Array, kind: str, window_decay: float) -> Modes:
    """`extract` of FRFs `value` (responses, references, n) with standard errors `sd` alike at `frequency` (n,) Hz, or what it found before.

    Raises what `extract` raises.
    """
    arrays = {"frequency": frequency, "value": value, "sd": sd}
    question = json.dumps({"digest": kept.digest(arrays), "kind": kind, "window_decay": window_decay})
    found = _known(question)
    if found is None:
        found = extract(frequency, value, sd, kind=kind, window_decay=window_decay)
        told = {f.name: getattr(found, f.name) for f in fields(Modes)}
        kept.write(KIND, question, _code(), {}, {name: json.dumps(v) if _plain(v) else v for name, v in told.items()})
    return found


def _known(question: str) -> Modes | None:
    found = kept.read(KIND, question, _code())
    if found is None:
        return None
    data: dict[str, Any] = {name: json.loads(str(v)) if v.dtype.kind == "U" else v for name, v in found[1].items() if name != "notes"}
    try:
        return Modes(**(data | {"lines": tuple(data["lines"])}))
    except (KeyError, TypeError):
        return None


def _plain(value: Any) -> bool:
    return not isinstance(value, np.ndarray)


def _code() -> str:
    """The text of this package and the versions of the libraries that it computes with."""
    return f"{np.__version__} {scipy.__version__} {kept.code(Path(__file__).parent)}"
