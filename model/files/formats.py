"""The format that a file is written in, and how an older one becomes today's: the one place where formats and migrations stand.

A file says its own as `format = 2`, a JSON answer as `"format": 2`; one that says none is of format 1. What a migration cannot carry over
without changing what a file means is refused in a sentence, never guessed.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from importlib.metadata import version
from typing import Any

from thermospindle.model.errors import BadInput

SCENE, CAMPAIGN, MAPPING, STUDY, DIAGNOSIS = "scene", "campaign", "mapping", "study", "diagnosis"
KEY = "format"

CURRENT = {SCENE: 2, CAMPAIGN: 1, MAPPING: 1, STUDY: 1, DIAGNOSIS: 1}
"""The format of each kind of file that this version writes; it reads all before."""

Tables = dict[str, Any]


def _one_arrangement(raw: Tables) -> Tables:
    """Scenes before 2 could say `bearing_pair.stiffness_arrangement`: load lines of another pair
    than the one mounted, for the stiffness alone."""
    pair = raw.get("bearing_pair")
    if not isinstance(pair, Mapping) or "stiffness_arrangement" not in pair:
        return raw
    other, own = pair["stiffness_arrangement"], pair.get("arrangement")
    if other != own:
        raise BadInput(
            f"bearing_pair.stiffness_arrangement = {other!r}: scenes of format 1 computed the stiffness with other load lines than those of"
            f" arrangement = {own!r}, which no format since does; take the key out, and fit the structure's stiffnesses again"
        )
    kept = {key: value for key, value in pair.items() if key != "stiffness_arrangement"}
    if isinstance(kept.get("origins"), Mapping):
        kept["origins"] = {key: value for key, value in kept["origins"].items() if key != "stiffness_arrangement"}
    return raw | {"bearing_pair": kept}


MIGRATIONS: dict[tuple[str, int], Callable[[Tables], Tables]] = {(SCENE, 1): _one_arrangement}
"""(kind, format n): what makes tables of format n those of n + 1. A migration leaves what is of n + 1 already as it is."""


def migrated(kind: str, raw: Any, where: object) -> Any:
    """The tables `raw` of a file in today's format of its `kind`; what is no table is given back, for the file's reader to refuse.

    Raises `BadInput`, naming the file by `where`, for a format that is none, that is newer than
    this program, or that cannot be carried over.
    """
    if not isinstance(raw, Mapping):
        return raw
    now, own = CURRENT[kind], raw.get(KEY, 1)
    if not isinstance(own, int) or isinstance(own, bool) or own < 1:
        raise BadInput(f"{where}: format = {str(own)[:80]!r}: must be a whole number, 1 to {now} for a {kind}")
    if own > now:
        raise BadInput(
            f"{where}: format = {str(own)[:20]}: is newer than this program; thermospindle {version('thermospindle')} reads a {kind} of"
            f" format 1 to {now}, so take a newer version"
        )
    tables = dict(raw)
    for number in range(own, now):
        try:
            tables = MIGRATIONS.get((kind, number), dict)(tables)
        except BadInput as error:
            raise BadInput(f"{where}: {error}") from None
    return tables | ({KEY: now} if KEY in raw else {})
