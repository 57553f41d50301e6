"""The model of a campaign: residuals of every test in standard errors, for any nuisance values and effects.

The receptance between hammers B and points A is A D(s)^-1 B^T with D = s^2 M + s C + K, and - s^4 N of shafts whose mass is spread.
"""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from thermospindle.diagnosis.data.lines import LineData
from thermospindle.diagnosis.data.mode_table import ModeData, TestData
from thermospindle.diagnosis.forward.latest import Latest
from thermospindle.diagnosis.forward.linear import Dofs, Linear, mass_changes
from thermospindle.diagnosis.forward.measuring import channel_gain, measured, replace_measuring
from thermospindle.diagnosis.forward.points import Applied, undrawn
from thermospindle.diagnosis.forward.response import Law, Light, Response
from thermospindle.diagnosis.forward.table import Table
from thermospindle.diagnosis.parameters import nuisance as kinds_of
from thermospindle.diagnosis.parameters.masses import mass_terms
from thermospindle.diagnosis.parameters.nuisance import Nuisance, Resonance, Unevenness, unevennesses
from thermospindle.diagnosis.parameters.numbers import Discrepancies, Numbers
from thermospindle.diagnosis.parameters.reference import ReferenceModes, Turned
from thermospindle.model.built.tolerance import Toleranced
from thermospindle.model.changed import changed
from thermospindle.model.errors import NoEquilibrium, OutsideRange
from thermospindle.model.machine import Condition, Spindle
from thermospindle.model.rotor.chain import Matrices, RotorBase, losses, matrices
from thermospindle.model.rotor.poles import Between
from thermospindle.model.types import Array, ComplexArray, Integers
from thermospindle.sim.effects.effect import HOOKS, Effect, Values
from thermospindle.sim.effects.temperature.expansion_mismatch import expanding, with_material
from thermospindle.sim.operating import SETTLING, OperatingPoint, acted_on, equilibrium, mass_between, operating_point

SIZE_STEP = 0.02  # of a size's or shape parameter's prior standard deviation, for differences
THIN, ENOUGH_LINES = 4, 30  # lines left out of a thinned model, and how many of a test it keeps at least
KEPT, ANSWERS = 12, 2  # spindles, states and points a test, and answers, of those asked for last
ACTING = tuple(hook for hook in HOOKS if hook != "measurement")
FAILED = (NoEquilibrium, OutsideRange, ValueError, RuntimeError, ZeroDivisionError, FloatingPointError, np.linalg.LinAlgError)
"""What a model says at parameter values where no spindle can be built; a fit then steps less far."""


@dataclass(eq=False)
class CampaignModel:
    """A spindle, the tests it is to explain and its nuisance parameters. Nuisance vectors are in prior standard deviations."""

    spindle: Spindle
    tests: tuple[TestData, ...]
    scenes: tuple[Spindle, ...]  # the spindle with the points of each test
    build: tuple[Toleranced, ...]
    parameters: tuple[Nuisance, ...]
    reference: ReferenceModes
    present: Applied
    resonances: tuple[Resonance, ...] = ()  # whose parameters are the last
    lumped: bool = False  # of tests of a spindle whose shafts have their masses at nodes

    def __repr__(self) -> str:
        return f"<{type(self).__name__} of {self.spindle.name}: {len(self.tests)} tests, {len(self.parameters)} nuisances>"

    def __getstate__(self) -> dict:
        """Without what was worked out: it is on its way to another process."""
        return {k: v for k, v in self.__dict__.items() if not isinstance(v, Latest) and k not in ("_heavier", "kept", "thinned")}

    @cached_property
    def thinned(self) -> CampaignModel:
        """The model of every `THIN`-th line with errors that much smaller: what a fit needs as long as errors are taken too large anyway."""
        return replace(self, tests=tuple(_thin(d) if isinstance(d, LineData) else d for d in self.tests))

    # ------------------------------------------------------------ the spindle at nuisance values

    def _built(self, t: int, x: Array) -> Spindle:
        t = self._like[t]

        def built() -> Spindle:
            spindle = self.scenes[t]
            for parameter, nuisance, value in zip(self.build, self.parameters, x, strict=False):
                if value:
                    spindle = parameter.apply(spindle, nuisance.at(value))
            for i in self.numbers.coefficients:
                if x[i]:
                    material = spindle.materials[spindle.used_materials[self.parameters[i].index]]
                    spindle = with_material(spindle, expanding(material, float(x[i]) * self.numbers.sd[i]))
            for i in self.numbers.flung:
                spindle = replace(spindle, ball_inertia=max(spindle.ball_inertia * (1 + float(x[i]) * self.parameters[i].sd), 0.0))
            return spindle

        return self._spindles.of((t, x[self.numbers.drawn].tobytes()), built)

    @cached_property
    def _spindles(self) -> Latest[Spindle]:
        return Latest(KEPT * len(self.tests))

    @cached_property
    def _like(self) -> list[int]:
        """For every test the first that has the same points and hammers."""
        keys = [(s.points, s.hammer.hammer_nodes) for s in self.scenes]
        return [keys.index(key) for key in keys]

    @cached_property
    def numbers(self) -> Numbers:
        """Which of the parameters are what."""
        return Numbers(self.parameters, self.tests, self.reference)

    @cached_property
    def unevennesses(self) -> tuple[Unevenness, ...]:
        return unevennesses(self.spindle)

    def operating(self, t: int, x: Array, effects: Applied) -> OperatingPoint:
        """The operating point of test `t`, sizes within their limits; what differs in the measuring
        chain alone is not worked out again, nor rings that settle alike."""
        effects = within_limits(effects)
        at, little = (t, x[self.numbers.settling[t]].tobytes()), x[self.numbers.little[t]].tobytes()

        def worked_out() -> OperatingPoint:
            own = undrawn(self.numbers, t, x, [b.name for b in self.spindle.all_bearings], self.unevennesses, self._undrawn)
            every = [*own, *self.present, *effects]
            found = acted_on(self._with_settled_rings(t, x, every, (at, _asking(effects, SETTLING))), every)
            found.chain  # noqa: B018 - worked out here, so that errors come here
            return found

        return replace_measuring(self._points.of((at, little, _asking(effects, ACTING)), worked_out), [*self.present, *effects])

    @cached_property
    def _points(self) -> Latest[OperatingPoint]:
        return Latest(KEPT * len(self.tests))

    def _with_settled_rings(self, t: int, x: Array, every: Applied, key: tuple) -> OperatingPoint:
        """The rings of test `t` in equilibrium under all that acts."""

        def settled() -> tuple[OperatingPoint, Applied]:
            condition, i = self.tests[t].condition, self.numbers.temperature[t]
            warmer = float(x[i]) * self.parameters[i].sd
            return equilibrium(self._built(t, x), changed(condition, temperature=condition.temperature + warmer), every), every

        return self._equilibria.of(key, settled)[0]

    @cached_property
    def _equilibria(self) -> Latest[tuple[OperatingPoint, Applied]]:
        """With the effects, which their keys tell apart by where they are in memory: as long as they are kept no other comes there."""
        return Latest(KEPT * len(self.tests))

    @cached_property
    def _undrawn(self) -> Latest[tuple[Effect, Values]]:
        return Latest(4 * KEPT * len(self.tests))

    @cached_property
    def _at_reference(self) -> RotorBase:
        """The chain of the spindle as drawn at the reference condition."""
        return operating_point(self.spindle, Condition(self.spindle.reference_temperature), self.present).chain

    @cached_property
    def by_condition(self) -> Array:
        """Relative changes (tests, 2, modes) that temperature and speed make in the frequency and the damping of
        the modes seen, from the reference condition, of the spindle as drawn; none of one that cannot be built."""
        reference = matrices(self._at_reference)
        found = np.zeros((len(self.tests), 2, self.reference.seen))
        for t in range(len(self.tests)):
            try:
                found[t] = self.reference.moved(reference, self.linear(t, np.zeros(len(self.parameters)), []).matrices)
            except FAILED:
                continue
        return found

    @cached_property
    def kept(self) -> dict:
        """What whoever asks for many things about one fit has worked out of it."""
        return {}

    def linear(self, t: int, x: Array, effects: Applied) -> Linear:
        """The linear model of test `t`; where the size of an effect lies beyond its limits, the one
        at the limit and straight on from there: matrices, rows and gains by their derivatives inside."""
        inside = within_limits(effects)
        at = found = self._linear(t, x, inside)
        for k, ((effect, values), (_, wanted)) in enumerate(zip(inside, effects, strict=True)):
            q = effect.parameters[0]
            if over := wanted[q.name] - values[q.name]:
                inward = -np.copysign(min(SIZE_STEP * q.prior_sd, q.limits[1] - q.limits[0]), over)
                stepped = [*inside[:k], (effect, {**values, q.name: values[q.name] + inward}), *inside[k + 1 :]]
                found = found.moved(at, self._linear(t, x, stepped), over / inward)
        return found

    def _linear(self, t: int, x: Array, effects: Applied) -> Linear:
        bare = self.bare(t, x, effects)
        m, point = bare.matrices, self.operating(t, x, effects)
        stiffness, damping = self._discrepancy(t, m, x)
        mass, gyroscopic = self._otherwise_heavy(x, m.dofs)
        whole = Matrices(m.mass + mass, m.damping + damping + point.chain.speed * gyroscopic, m.stiffness + stiffness, m.dofs)
        lost = None if bare.lost is None else bare.lost + self._lost_otherwise(t, m.dofs, x, damping)
        return replace(bare, matrices=whole, chain=measured(self.numbers, t, point, x), between=self._between(point), lost=lost)

    def _between(self, point: OperatingPoint) -> Between | None:
        if self.lumped:
            return None
        if "_between" not in point.__dict__:
            object.__setattr__(point, "_between", mass_between(point, self.spindle))
        return point.__dict__["_between"]

    def bare(self, t: int, x: Array, effects: Applied) -> Linear:
        """The linear model of test `t` at its operating point as its chain has it: without
        discrepancies, mass between nodes, and what its measuring chain may be off by."""
        point = self.operating(t, x, effects)
        found = point.__dict__.get("_bare")
        if found is None:
            own = matrices(point.chain)
            lost = losses(point.chain, own) if isinstance(self.tests[t], LineData) else None
            found = Linear(own, point.measurement, point.chain.layout, lost=lost)
            object.__setattr__(point, "_bare", found)
        return found

    def _otherwise_heavy(self, x: Array, dofs: Dofs) -> tuple[Array, Array]:
        """What bodies that have their mass otherwise than drawn add to M and, per rad/s, to G (n, n)."""
        mass, gyroscopic = self.heavier(dofs)
        n, own = len(dofs), x[self.numbers.masses]
        return (own @ mass.reshape(-1, n * n)).reshape(n, n), (own @ gyroscopic.reshape(-1, n * n)).reshape(n, n)

    def heavier(self, dofs: Dofs) -> tuple[Array, Array]:
        """What a standard deviation of each way in which bodies may have their mass otherwise adds to M and, per rad/s, to G (k, n, n)."""
        if dofs not in self._heavier:
            self._heavier[dofs] = mass_changes(self.spindle, mass_terms(self.spindle), dofs)
        return self._heavier[dofs]

    @cached_property
    def _heavier(self) -> dict[Dofs, tuple[Array, Array]]:
        return {}

    def _discrepancy(self, t: int, linear: Matrices, x: Array) -> tuple[Array, Array]:
        w, (_, damping) = self.reference.over(linear.dofs), self.numbers.discrepancies[t]
        return w @ self.turned(t, x).whole @ w.T, w @ _modal(damping, x, len(self.reference.omega)) @ w.T

    def _lost_otherwise(self, t: int, dofs: Dofs, x: Array, damping: Array) -> Array:
        """What of `Linear.lost` (3, n, n) the discrepancy of the `damping` (n, n) is: it has the
        laws of loss factors and of dampers, in the shares that these have in what modes lose."""
        share, w = self.by_factors, self.reference.over(dofs) * np.sqrt(self.reference.omega)
        constant = share * w @ _modal(self.numbers.discrepancies[t][1], x, len(self.reference.omega)) @ w.T if share else np.zeros_like(damping)
        return np.array([constant, share * damping, (1 - share) * damping])

    @cached_property
    def by_factors(self) -> float:
        """Share of loss factors in what the reference modes lose, the rest being the dampers'."""
        chain, own = self._at_reference, matrices(self._at_reference)
        shape = np.linalg.solve(own.mass, self.reference.over(own.dofs))
        factors, dampers = (float(np.sum(np.einsum("im,ij,jm->m", shape, lost, shape) / self.reference.omega)) for lost in losses(chain, own)[1:])
        return factors / (factors + dampers) if factors > 0 else 0.0

    def turned(self, t: int, x: Array) -> Turned:
        """What test `t` has of a stiffness between modes otherwise than the model."""
        return self.reference.turned(_modal(self.numbers.discrepancies[t][0], x, len(self.reference.omega)))

    # ------------------------------------------------------------ residuals

    def residual(self, t: int, x: Array, effects: Applied) -> Array:
        """Residuals (N,) of test `t`, computed less measured, in standard errors."""
        return self.in_errors(t, self.standing(t, x, effects)[1])

    def in_errors(self, t: int, answer: Response | Table) -> Array:
        """Residuals (N,) of an answer, in standard errors."""
        if isinstance(answer, Table):
            return answer.residual
        data = self.tests[t]
        assert isinstance(data, LineData)
        return self.whitened(t, answer.value, data.value)

    def response(self, t: int, x: Array, effects: Applied, frequency: Array) -> ComplexArray:
        """FRFs (n_resp, n_ref, n) of test `t`, one of FRF lines, at other frequencies (n,) Hz."""
        data = self.tests[t]
        assert isinstance(data, LineData)
        return self._response(t, x, self.linear(t, x, effects), replace(data, frequency=frequency)).value

    def answer(self, t: int, x: Array, linear: Linear) -> Response | Table:
        """What a linear model says at the lines, or of the table, of test `t`."""
        data = self.tests[t]
        return Table(linear, data) if isinstance(data, ModeData) else self._response(t, x, linear, data)

    def _response(self, t: int, x: Array, linear: Linear, data: LineData) -> Response:
        cut = 0.0 if self.numbers.record is None else float(x[self.numbers.record])
        lights = [light for light, _ in self.lights(t, linear.matrices.dofs, x)]
        return Response(linear, data, channel_gain(self.numbers, t, x), cut, lights, self.law(x))

    def law(self, x: Array) -> Law:
        """The law of damping at nuisance values."""
        numbers, which = self.numbers.law
        shares = np.zeros(len(kinds_of.LAWS))
        shares[which] = x[numbers] * self.numbers.sd[numbers]
        factors, dampers = shares.tolist()
        return Law(factors, dampers, 2 * np.pi * self.spindle.structure.damping_frequency)

    def lights(self, t: int, dofs: Sequence[tuple[str, str]], x: Array) -> list[tuple[Light, Integers]]:
        """The light resonances of test `t` at nuisance values, over `dofs`, and the numbers of the parameters of each."""
        found = []
        first = len(self.parameters) - sum(len(r.nuisances) for r in self.resonances)
        for r in self.resonances:
            numbers = np.arange(first, first + len(r.nuisances))
            first += len(numbers)
            there = r.at(x[numbers] * np.array([self.parameters[i].sd for i in numbers]))
            columns = self.reference.over(dofs)[:, : len(r.shares)]
            far = self.far(t)
            found.append((Light(columns, np.array(there.shares), 2 * np.pi * there.frequency_at(far), there.damping, far), numbers))
        return found

    def far(self, t: int) -> float:
        """How far test `t` is from the reference temperature, in `RANGE_K`."""
        return (self.tests[t].condition.temperature - self.spindle.reference_temperature) / kinds_of.RANGE_K

    def with_resonance(self, resonance: Resonance) -> CampaignModel:
        """With one light resonance more, whose parameters follow all others."""
        return replace(self, parameters=(*self.parameters, *resonance.nuisances), resonances=(*self.resonances, resonance))

    def standing(self, t: int, x: Array, effects: Applied) -> tuple[Linear, Response | Table]:
        """The linear model of test `t` and its answer; the last ones are kept for those who ask more of the same place."""

        def worked_out() -> tuple[Linear, Response | Table, Applied]:
            linear = self.linear(t, x, effects)
            return linear, self.answer(t, x, linear), effects

        linear, answer, _ = self._responses.of((t, x.tobytes(), _asking(effects)), worked_out)
        return linear, answer

    @cached_property
    def _responses(self) -> Latest[tuple[Linear, Response | Table, Applied]]:
        """With the effects, as long as which are kept no other comes where they are in memory."""
        return Latest(ANSWERS * len(self.tests))

    def whitened(self, t: int, value: ComplexArray, measured: ComplexArray | float) -> Array:
        """What differs (n_resp, n_ref, L) in standard errors, (N,): the real and the imaginary part of one number after the other."""
        data = self.tests[t]
        assert isinstance(data, LineData)
        return data.in_errors(value - measured).ravel().view(float)

    @cached_property
    def structural(self) -> list[bool]:
        """Which build tolerances leave the bearings alone."""
        ends = [p.apply(self.spindle, 0.01) for p in self.build]
        return [end.bearings is self.spindle.bearings and end.sets is self.spindle.sets for end in ends]


def _modal(discrepancies: Discrepancies, x: Array, modes: int) -> Array:
    """Discrepancies over the modal matrix (modes, modes), each as it is stated."""
    number, i, j, size = discrepancies
    found = np.bincount(i * modes + j, size * x[number], modes**2).reshape(modes, modes)
    return np.where(found == 0, found.T, found)


def _asking(effects: Applied, hooks: Collection[str] = HOOKS) -> tuple:
    """What tells those of the effects that have one of these hooks from others: each and its values,
    by name, for ways to act list them in orders of their own."""
    return tuple((id(e), frozenset(v.items())) for e, v in effects if not e.hooks.isdisjoint(hooks))


def within_limits(effects: Applied) -> list[tuple[Effect, Values]]:
    """The same with sizes within their limits."""
    sizes = [(e.parameters[0], v[e.parameters[0].name]) for e, v in effects]
    return [
        (e, v if q.limits[0] <= size <= q.limits[1] else {**v, q.name: float(np.clip(size, *q.limits))})
        for (e, v), (q, size) in zip(effects, sizes, strict=True)
    ]


def _thin(data: LineData) -> LineData:
    lines = data.value.shape[-1]
    own = slice(THIN // 2, None, THIN) if lines >= ENOUGH_LINES * THIN else slice(None)
    share = np.sqrt(lines / max(data.value[:, :, own].shape[-1], 1)) or 1.0
    alike = None if data.alike is None else data.alike.only(own)
    return replace(data, frequency=data.frequency[own], value=data.value[:, :, own], sd=data.sd[:, :, own] / share, alike=alike)
