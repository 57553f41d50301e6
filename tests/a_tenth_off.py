"""A pytest plugin: one effect of the catalogue computes with the size of everything a tenth off.

    EFFECT_A_TENTH_OFF=name pytest -p tests.a_tenth_off ...

A test that verifies the effect fails then.
"""

from __future__ import annotations

import os
from collections.abc import Callable
from typing import Any

from thermospindle.sim.effects import by_name
from thermospindle.sim.effects.effect import HOOKS, Effect

EFFECT = "EFFECT_A_TENTH_OFF"


def pytest_configure() -> None:
    effect = by_name(os.environ[EFFECT])
    for hook in HOOKS:
        function = getattr(effect, hook)
        if function is not None:
            object.__setattr__(effect, hook, off(effect, function))


def off(effect: Effect, function: Callable[..., Any]) -> Callable[..., Any]:
    def wrong(spindle: Any, condition: Any, values: Any, *state: Any) -> Any:
        changed = {p.name: p.neutral + 1.1 * (values[p.name] - p.neutral) for p in effect.parameters if not p.choices}
        return function(spindle, condition, dict(values) | changed, *state)

    return wrong
