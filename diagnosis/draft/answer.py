"""What drifts, read from an answer of `spindle diagnose --json`."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import numpy as np
from pydantic import BaseModel, Field, model_validator

from thermospindle.diagnosis.answer import read_raw, told_by
from thermospindle.diagnosis.decision.loss import NAMING
from thermospindle.diagnosis.draft.laws import REFERENCE
from thermospindle.model.errors import BadInput
from thermospindle.model.types import Array

LEAST = -0.999  # of what was: nothing falls further
LARGEST = 1e9  # of any number that is read
SURE = 1e-6  # of the mean variance, added to each: tests of one condition have one change
TINY = 1e-18  # of a variance, what stands for none

Number = Annotated[float, Field(ge=-LARGEST, le=LARGEST)]


class Acting(BaseModel):
    """An effect of the catalogue, whose size has a law of the data's own: the condition at which it
    acts as its formula has it (none: the test's), and its other values."""

    at: dict[str, Number] | None = None
    values: dict[str, Number]

    @model_validator(mode="after")
    def whole(self) -> Acting:
        if self.at is not None and not {"temperature_C", "speed_rpm"} <= set(self.at):
            raise ValueError
        return self


class Place(BaseModel):
    """An element, or an effect, and its change in every test: in `unit`, free forms per cent as a share of what was."""

    element: str
    unit: str
    change: list[dict[str, Number]] = Field(min_length=1)
    change_covariance: list[list[Annotated[float, Field(ge=-(LARGEST**2), le=LARGEST**2)]]] | None = None
    effect: Acting | None = None

    @property
    def relative(self) -> bool:
        return self.unit == "%" and self.effect is None

    @property
    def key(self) -> str:
        return "relative" if self.relative else f"change_{self.unit}"

    def of_tests(self, key: str) -> Array:
        """One number of every test (n,)."""
        return np.array([row[key] for row in self.change])

    @property
    def covariance(self) -> Array:
        """Of the changes (n, n); answers without one have standard errors alone."""
        return np.diag(self.of_tests("sd") ** 2) if self.change_covariance is None else np.array(self.change_covariance)

    @property
    def logarithmic(self) -> tuple[Array, Array]:
        """Changes (n,) and their covariance (n, n) as free forms count them: per cent of a logarithm where they are relative."""
        change, covariance = self.of_tests(self.key), self.covariance
        if not self.relative:
            return change, covariance
        factor = 1 + np.maximum(change, LEAST)
        return 100 * np.log(factor), 1e4 * covariance / np.outer(factor, factor)

    @model_validator(mode="after")
    def measured(self) -> Place:
        if not all({"temperature_C", "speed_rpm", "sd", self.key} <= set(row) for row in self.change):
            raise ValueError
        if self.covariance.shape != (len(self.change),) * 2 or np.any(np.diag(self.covariance) < 0):
            raise ValueError
        correlation, _ = correlated(self.covariance)
        if not np.allclose(correlation, correlation.T, atol=1e-6) or np.linalg.eigvalsh(correlation).min() < -SURE:
            raise ValueError
        return self


def place_of(diagnosis: Path, element: str | None) -> tuple[Place, float, tuple[str, ...], bool]:
    """The first that would have to drift, or `element`, the reference temperature (C) of the scene, the effects that the
    verdict names, without which that would drift, and whether the build tolerances of the answer are those fitted beside it.
    Raises `BadInput` where the file holds none, one that changes by nothing, or a name that cannot stand in a Python file."""
    what = "elements that drift in `where`"
    told = read_raw(diagnosis, str(diagnosis), what)
    with told_by(str(diagnosis), what):
        reference = float(told.get("reference_temperature_C", REFERENCE))
        if not -273.15 < reference < LARGEST:
            raise ValueError
        elements = [str(p["element"]) for p in told["where"]]
        beside = {str(e) for e in told.get("tolerances_beside", ())}
        named = tuple(str(e) for e in told.get("effects", ())) if told.get("verdict") in NAMING else ()
        found = [Place.model_validate(p) for p in told["where"] if element in (None, p["element"])][:1]
    if not found and element is None:
        raise BadInput(f"{diagnosis}: where: is empty; the diagnosis found nothing that drifts, and there is nothing to draft")
    if not found:
        raise BadInput(f"--element {element}: does not drift in {diagnosis}; allowed are {', '.join(elements) or 'none'}")
    place = found[0]
    _check_plain(place.element, place.unit, diagnosis.name, *((*(place.effect.at or ()), *place.effect.values) if place.effect else ()))
    if not place.of_tests(place.key).any():
        raise BadInput(f"{diagnosis}: where: {place.element} changes by 0 in every test; there is nothing to draft")
    return place, reference, named, place.element in beside | {*named}


def correlated(covariance: Array) -> tuple[Array, Array]:
    """The correlation (n, n) of a covariance, and standard errors (n,)."""
    sd = np.sqrt(np.maximum(np.diag(covariance), TINY))
    return covariance / np.outer(sd, sd), sd


def whitening(covariance: Array) -> Array:
    """W (n, n) with W C W^T = 1 of a covariance C, which may be that of tests without errors of their own."""
    correlation, sd = correlated(covariance)
    value, vector = np.linalg.eigh(correlation)
    return np.asarray((vector / np.sqrt(np.maximum(value, 0.0) + SURE)).T / sd)


def _check_plain(*texts: str) -> None:
    """Refuse what would be more than a word in the Python file that is drafted: nothing of a data file becomes code."""
    for text in texts:
        if not text.isprintable() or set(text) & set("\"\\{}"):
            raise BadInput(f"{text[:80]!r}: cannot be written into an effect file; names without quotes, braces, backslashes and line ends are allowed")
