"""Which nuisance parameters of a campaign are what."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from thermospindle.diagnosis.data.lines import LineData
from thermospindle.diagnosis.data.mode_table import TestData
from thermospindle.diagnosis.parameters import nuisance as kinds_of
from thermospindle.diagnosis.parameters.nuisance import Nuisance
from thermospindle.diagnosis.parameters.reference import ReferenceModes
from thermospindle.model.types import Array, Integers

Discrepancies = tuple[Integers, Integers, Integers, Array]


@dataclass(frozen=True, eq=False)
class Numbers:
    """The numbers of the `parameters` by what they are: of all `tests` together, or of each."""

    parameters: Sequence[Nuisance]
    tests: Sequence[TestData]
    reference: ReferenceModes

    @cached_property
    def of_kind(self) -> dict[str, Integers]:
        """Numbers of the parameters of every kind there is."""
        kinds = [p.kind for p in self.parameters]
        return {kind: np.flatnonzero(np.array(kinds) == kind) for kind in dict.fromkeys(kinds)}

    @cached_property
    def tolerances(self) -> dict[str, int]:
        """The number of every build tolerance, by its name."""
        return {p.name: n for n, p in enumerate(self.parameters) if p.kind == kinds_of.BUILD}

    @cached_property
    def sd(self) -> Array:
        """Prior standard deviations (P,) of the parameters in their own units."""
        return np.array([p.sd for p in self.parameters])

    def _of(self, *kinds: str) -> Integers:
        return np.sort(np.concatenate([self.of_kind.get(kind, np.zeros(0, int)) for kind in kinds]))

    @cached_property
    def places(self) -> tuple[Integers, Integers, Integers]:
        """Test, index and first mode (P,) of every parameter, -1 where it has none."""
        rows = [(-1 if p.test is None else p.test, p.index, p.modes[0]) for p in self.parameters]
        test, index, mode = np.array(rows, int).reshape(-1, 3).T
        return test, index, mode

    @cached_property
    def drawn(self) -> Integers:
        """Numbers of the parameters of the drawing: build tolerances, coefficients of expansion, the balls' inertia loads."""
        return self._of(kinds_of.BUILD, kinds_of.COEFFICIENT, kinds_of.FLUNG)

    @cached_property
    def settling(self) -> list[Integers]:
        """For every test the numbers of all parameters on which it depends where its rings settle."""
        return [np.array([*self.drawn, *self.expansion, temperature], int) for temperature in self.temperature]

    @cached_property
    def little(self) -> list[Integers]:
        """For every test the numbers of those by which its bearings and joints differ where rings have settled."""
        return [np.concatenate([self.apart, balls, self.uneven]) for balls in self.balls]

    @cached_property
    def expansion(self) -> Integers:
        """Numbers of the parameters of ring expansion."""
        return self._of(kinds_of.EXPANSION)

    @cached_property
    def coefficients(self) -> Integers:
        """Numbers of the parameters of coefficients of expansion."""
        return self._of(kinds_of.COEFFICIENT)

    @cached_property
    def apart(self) -> Integers:
        """Numbers of the parameters by which bearings differ among themselves."""
        return self._of(*kinds_of.APART)

    @cached_property
    def balls(self) -> list[Integers]:
        """For every test the numbers of the parameters by which balls are stiffer: in one
        direction, with temperature, by their orbits, and in this test."""
        own = self._of(kinds_of.BALLS, kinds_of.CHANGE, kinds_of.ORBITS)
        return [own[np.isin(self.places[0][own], (-1, t))] for t in range(len(self.tests))]

    @cached_property
    def flung(self) -> Integers:
        """The number of the parameter by which the balls' inertia loads are off, where the scene has these."""
        return self._of(kinds_of.FLUNG)

    @cached_property
    def law(self) -> tuple[Integers, Integers]:
        """The numbers of the parameters of the law of damping, and which of its two kinds each is of."""
        own = self._of(kinds_of.LAW)
        return own, self.places[1][own]

    @cached_property
    def uneven(self) -> Integers:
        """Numbers of the parameters by which joints are uneven about the axis."""
        return self._of(kinds_of.UNEVEN)

    @cached_property
    def masses(self) -> Integers:
        """Numbers of the parameters of how bodies have their mass."""
        return self._of(kinds_of.MASSES)

    @cached_property
    def temperature(self) -> list[int]:
        """For every test the number of its thermometer's parameter."""
        return [next(i for i, p in enumerate(self.parameters) if p.kind == kinds_of.TEMPERATURE and p.test == t) for t in range(len(self.tests))]

    @cached_property
    def discrepancies(self) -> list[tuple[Discrepancies, Discrepancies]]:
        """For every test, of stiffness and of damping: parameter numbers, first and second mode of
        each, and its factor in the modal matrix."""
        found = []
        omega, damping = self.reference.omega, np.sqrt(2 * self.reference.damping * self.reference.omega)
        for t in range(len(self.tests)):
            of_test = []
            for kinds, scale, twice in (
                ((kinds_of.STIFFNESS, kinds_of.STIFFNESS_DRIFT), omega, 2.0),
                ((kinds_of.DAMPING, kinds_of.DAMPING_DRIFT), damping, 1.0),
            ):
                rows = [(n, *p.modes) for n, p in enumerate(self.parameters) if p.kind in kinds and p.test in (None, t)]
                number, i, j = np.array(rows, int).reshape(-1, 3).T
                sd = np.array([self.parameters[n].sd for n in number])
                of_test.append((number, i, j, twice * sd * scale[i] * scale[j] * np.where(i == j, 1.0, np.sqrt(0.5))))
            found.append((of_test[0], of_test[1]))
        return found

    @cached_property
    def gains(self) -> list[tuple[Integers, Integers]]:
        """For every test the numbers of gain parameters and the channel of each."""
        return [self._of_one_and_all(t, kinds_of.GAIN, kinds_of.DRIFT) for t in range(len(self.tests))]

    @cached_property
    def hammers(self) -> list[tuple[Integers, Integers]]:
        """For every test the numbers of the parameters of hammers' gains and the hammer of each."""
        return [self._of_one_and_all(t, kinds_of.HAMMER, kinds_of.HAMMER_DRIFT) for t in range(len(self.tests))]

    @cached_property
    def misses(self) -> list[tuple[Integers, Integers]]:
        """For every test the numbers of the parameters by which hammers miss, and twice the hammer with the way of each."""
        return [self._of_one_and_all(t, kinds_of.MISS, kinds_of.MISS_DRIFT) for t in range(len(self.tests))]

    @cached_property
    def sensors(self) -> tuple[Integers, Integers]:
        """The numbers of the parameters by which sensors are off their places and directions, and
        four times the channel with the way of each."""
        own = self._of(kinds_of.PLACE, kinds_of.ASKEW)
        return own, self.places[1][own]

    @cached_property
    def delays(self) -> tuple[Integers, Integers]:
        """The numbers of the parameters by which channels are late, and the channel of each."""
        own = self._of(kinds_of.LATE)
        return own, self.places[1][own]

    def _of_one_and_all(self, t: int, in_all: str, in_one: str) -> tuple[Integers, Integers]:
        rows = [(i, p.index) for i, p in enumerate(self.parameters) if p.kind == in_all or (p.kind == in_one and p.test == t)]
        number, index = np.array(rows, int).reshape(-1, 2).T
        return number, index

    @cached_property
    def channel_of(self) -> list[Integers]:
        """For every test the channel of each row: a sensor keeps its gain at whichever row it is."""
        return _counted([d.sensors if isinstance(d, LineData) else () for d in self.tests])

    @cached_property
    def hammer_of(self) -> list[Integers]:
        """For every test the hammer of each column."""
        return _counted([d.hammers if isinstance(d, LineData) else () for d in self.tests])

    @cached_property
    def record(self) -> int | None:
        """The number of the parameter of records that end too early."""
        return next((i for i, p in enumerate(self.parameters) if p.kind == kinds_of.RECORD), None)


def _counted(nodes: Sequence[Sequence[int]]) -> list[Integers]:
    """Nodes of every test by the order in which tests first have them."""
    number = {node: c for c, node in enumerate(dict.fromkeys(node for own in nodes for node in own))}
    return [np.array([number[node] for node in own], int) for own in nodes]
