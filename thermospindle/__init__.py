"""Thermospindle: from temperature to the modal peaks of a spindle, and from measurements to the physics a model lacks.

    import thermospindle as ts

    spindle = ts.load("hdd_2003")
    point = ts.point(spindle, 60.0, speed_rpm=7200)
    for mode in ts.modes(point):
        print(mode.kind, mode.frequency)

The names below are functions of `thermospindle.front` and `thermospindle.verbs`, loaded when first used: importing this package
costs nothing. They take and return the objects that the command line uses; `thermospindle.testing` has assertions for pytest.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from thermospindle.front import add as add
    from thermospindle.front import answer as answer
    from thermospindle.front import campaign as campaign
    from thermospindle.front import compare as compare
    from thermospindle.front import deviate as deviate
    from thermospindle.front import diagnose as diagnose
    from thermospindle.front import frf as frf
    from thermospindle.front import impact as impact
    from thermospindle.front import load as load
    from thermospindle.front import modes as modes
    from thermospindle.front import point as point
    from thermospindle.front import read_log as read_log
    from thermospindle.model.errors import BadInput as BadInput
    from thermospindle.model.errors import NoEquilibrium as NoEquilibrium
    from thermospindle.model.errors import OutsideRange as OutsideRange
    from thermospindle.verbs import check as check
    from thermospindle.verbs import resonances as resonances
    from thermospindle.verbs import runout as runout
    from thermospindle.verbs import static as static
    from thermospindle.verbs import table as table
    from thermospindle.verbs import warmup as warmup

MODULES = {
    "front": ("add", "answer", "campaign", "compare", "deviate", "diagnose", "frf", "impact", "load", "modes", "point", "read_log"),
    "verbs": ("check", "resonances", "runout", "static", "table", "warmup"),
    "model.errors": ("BadInput", "NoEquilibrium", "OutsideRange"),
}
__all__ = [
    "BadInput", "NoEquilibrium", "OutsideRange", "add", "answer", "campaign", "check", "compare", "deviate", "diagnose", "frf", "impact", "load", "modes", "point", "read_log",
    "resonances", "runout", "static", "table", "warmup",
]  # fmt: skip


def __getattr__(name: str) -> Any:
    module = next((module for module, names in MODULES.items() if name in names), None)
    if module is None:
        raise AttributeError(f"module 'thermospindle' has no attribute {name!r}; there are {', '.join(__all__)}")
    from importlib import import_module

    found = getattr(import_module(f"thermospindle.{module}"), name)
    globals()[name] = found
    return found


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__})
