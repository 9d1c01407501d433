"""Plan each part of a campaign: an ordinary design at the estimate, with the data as its prior."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from contextlib import suppress
from dataclasses import dataclass, replace
from functools import cached_property, partial

import numpy as np

from inputdesign_cli.arrays import Array
from inputdesign_cli.design.convex.limits import Weight, weighted_sum
from inputdesign_cli.errors import IdesignError, InfeasibleError, SpecError
from inputdesign_cli.information import Experiment, FiniteRecord, PowerKind
from inputdesign_cli.monte_carlo.excitations import Redrawn
from inputdesign_cli.outcome.campaign import PlanClaim, PlanKind
from inputdesign_cli.plant import Model, close_loop
from inputdesign_cli.questions.assessment.identify import ModelQuestion
from inputdesign_cli.questions.building.rebuild import Change, Rebuild
from inputdesign_cli.questions.campaign.schedule import REACHED, Planned, Rules, Standing, power_of
from inputdesign_cli.questions.common.record import design_cost, given_record
from inputdesign_cli.questions.given.solve import GivenExcitation
from inputdesign_cli.questions.least_cost.audit import audit
from inputdesign_cli.questions.least_cost.outcome import Designed, design_outcome
from inputdesign_cli.questions.least_cost.record_search import fitting_record
from inputdesign_cli.questions.least_cost.solve import ConvexTask
from inputdesign_cli.spectrum import FlatBasis

# A length within the cap is near enough to the shortest: by this factor, or at this share of the cap.
_CLOSE, _MOSTLY = 1.1, 0.5
_LONGER = 4.0  # a length grows at most by this factor at once
# Cost of a part at the plant of the spec in units of the cap, if costs depend on the plant. Likewise cost of
# the first plan after a pilot, in units of the design for that plant.
_ELSEWHERE = 10.0
# Shares of the way from the last estimate that could be built on to one that cannot.
_SHARES = (1.0, 0.95, 0.9, 0.8, 0.7, 0.6, 0.5, 0.4, 0.3, 0.2, 0.1, 0.0)


@dataclass(frozen=True)
class Planner:
    """Asks for the accuracy and plans the experiment at any estimate.

    Attributes:
        nominal: the experiment on the plant of the spec, in raw parameters.
        farthest: the radius of poles beyond which an estimate is not built on.
        cost: weights of the powers.
        step: time between samples in the unit of the experiment's frequencies.
        bounded: whether limits bound the power, so that a best experiment exists.
        seed: of the record of the whole experiment.
        designs: builds the design of a plan.
        asked: the accuracy question at a model; see `Identification.at`.
    """

    nominal: Experiment
    farthest: float
    cost: Mapping[PowerKind, Weight]
    step: float
    bounded: bool
    seed: int
    designs: Rebuild[ConvexTask]
    asked: Callable[[Model, int, Array, str], ModelQuestion]

    def radius(self, model: Model) -> float:
        """Return the radius of the farthest pole of the plant, or of its loop; infinite if it is unstable."""
        try:
            loop = self._experiment(model).loop
        except SpecError:
            return np.inf
        return model.radius if loop is None else loop.radius

    def _experiment(self, model: Model) -> Experiment:
        """Return the experiment on another plant, in raw parameters."""
        loop = self.nominal.loop
        if loop is not None:
            loop = close_loop(model, loop.controller)
            loop.check_stability()
        return replace(self.nominal, model=model, loop=loop)

    def question(self, model: Model, information: Array) -> ModelQuestion:
        """Return the question at a model, in coordinates where the information (k, k) of the data is I.

        Raises:
            IdesignError: nothing can be asked of this model.
            LinAlgError: the information is singular.
        """
        factor: Array = np.asarray(np.linalg.cholesky(information), dtype=float)
        return self.asked(model, self.nominal.samples, factor, "plan")

    def plan(
        self,
        rules: Rules,
        known: Standing | None,
        done: int,
        seed: int,
        first: float | None,
        before: Array | None = None,
    ) -> Planned:
        """Plan the experiment that follows `done` samples; raise `IdesignError` if there is no first plan.

        Args:
            known: None before any data.
            first: cost of a sample of the first plan, which the cap is relative to.
            before: (n, r), applied so far about the operating point; None before any.
        """
        take, rest = rules.schedule.take(done), rules.schedule.rest(done)
        earlier = np.zeros((0, self.nominal.inputs)) if before is None else before
        if known is None and done == 0 and rules.pilot_power is not None:
            # White noise of this power, even over the inputs.
            powers = np.full(self.nominal.inputs, rules.pilot_power / self.nominal.inputs)
            drawn = Redrawn.flat("pilot", "white", powers, self.nominal.band, take, self.step)
            record = drawn.draw(1, take, np.random.default_rng(seed))[0]
            pilot = Planned(record, take, power_of(record), 0.0, "pilot")
            return self._kept(pilot, rules, np.inf, None, earlier)
        cap = rules.cap(first)
        if first is None and known is not None and None not in (rules.pilot_power, rules.power_cap):
            cap = _ELSEWHERE * self._unlearned  # the first plan after a pilot
        last = rules.schedule.last(done)
        change = Change(
            samples=rest,
            seed=seed,
            information=None if known is None else known.information,
            uncertainty="stated" if known is None and rules.robust_last else "none",
            white=rules.white,
            goes_on=rules.stops or not last,
        )
        model = None if known is None else known.model
        if rules.robust_last and last and known is not None:
            # Some plant that the data leave open may ask for what cannot be done; the estimate need not.
            with suppress(IdesignError):
                found = self._designed(model, replace(change, uncertainty="data"))
                if found.cost <= cap * REACHED:
                    return self._kept(replace(found.planned, take=take), rules, cap, known, earlier)
        try:
            plan = replace(self._affordable(model, change, cap, rules.end - done), take=take)
            # The first plan sets the cap, which its own part keeps as well.
            own = rules.cap(plan.cost) if first is None else np.inf
            return self._kept(plan, rules, min(cap, own), known, earlier)
        except IdesignError as error:
            if known is None:
                raise
            # The estimate may be far off; the next part improves it, and nothing is decided by this one.
            cost = np.inf if first is None else min(cap, first)
            gap = replace(self._stopgap(rules, cost, rest, seed, error), take=take)
            return self._kept(gap, rules, cap, None, earlier)

    @cached_property
    def _unlearned(self) -> float:
        """Return the cost of a sample of the design for the plant of the spec; infinite if none or free."""
        try:
            return self._designed(self.nominal.model, Change(self.nominal.samples, self.seed)).cost or np.inf
        except IdesignError:
            return np.inf

    def _kept(
        self, plan: Planned, rules: Rules, cap: float, known: Standing | None, before: Array
    ) -> Planned:
        """Return the plan with a first part within the cap, at its estimate and at the plant of the spec.

        A part may be stronger than its plan is on average. An experiment that costs little at a wrong
        estimate may cost any amount at the plant if outputs are paid for. The cap is wide at the plant of
        the spec, since plants differ. Noise does not count, as in the cost of a design.
        """
        lead = 0
        if rules.rate is not None and before.size and np.any(before[-1]):
            # A record starts within one move of zero: moves of at most the rate lead back to it.
            last, rate = before[-1], np.asarray(rules.rate)
            lead = int(np.max(np.ceil(np.abs(last) / rate)))
            left = np.maximum(np.abs(last) - np.arange(1, lead + 1)[:, None] * rate, 0.0)
            plan = replace(plan, record=np.concatenate([np.sign(last) * left, plan.record]))
        caps = [(self.nominal, cap)]
        if known is not None:
            wide = _ELSEWHERE if any(map(self.nominal.depends_on_plant, self.cost)) else 1.0
            caps = [(self._experiment(known.model), cap), (self.nominal, wide * cap)]

        def cost(experiment: Experiment, scale: float) -> float:
            """Return the cost of a sample of the part, all of it but the lead at a scale."""
            factors = np.where(np.arange(plan.take) < lead, 1.0, scale)[: len(plan.applied), None]
            return self.cost_of(experiment, np.concatenate([before, factors * plan.applied]), len(before))

        scale = min(_largest_scale(partial(cost, at), most) for at, most in caps)
        beyond = any(cost(at, scale) > most * REACHED for at, most in caps)
        part_cost, record = cost(caps[0][0], scale), plan.record.copy()
        record[lead : plan.take] *= scale
        return replace(plan, record=record, share=scale**2, part_cost=part_cost, beyond=beyond)

    def cost_of(self, experiment: Experiment, record: Array, begin: int = 0) -> float:
        """Return the cost of a sample of a record (n, r), from the sample `begin` on, without any noise."""
        at = FiniteRecord(replace(experiment, samples=len(record)), len(record), self.step)
        signals = {kind: at.signals(kind, record)[begin:] for kind in self.cost}
        powers = {kind: np.mean(x**2, axis=0).tolist() for kind, x in signals.items()}
        return weighted_sum(self.cost, powers)

    def knowing(self, model: Model) -> tuple[float, Array | None]:
        """Return the cost of the design for a known plant, over all samples, and its record (samples, r).

        The record is None if none fits. Raise `IdesignError` if there is no design.
        """
        found, record = self._designed(model, Change(self.nominal.samples, self.seed)), None
        with suppress(IdesignError):
            record = found.planned.record
        return self.nominal.samples * found.cost, record

    def _affordable(self, model: Model | None, change: Change, cap: float, longest: int) -> Planned:
        """Return the cheapest experiment; if its samples cost more than the cap, the shortest within the cap.

        If the longest costs more, return it at the cap. If limits admit none, return the best within them.
        """

        def tried(samples: int) -> _Found | None:
            with suppress(InfeasibleError):
                return self._designed(model, replace(change, samples=samples))
            return None

        rest = change.samples
        short, found = rest, tried(rest)
        while not _fits(found, cap) and rest < longest:
            more = 2.0 if found is None else min(found.cost / cap, _LONGER)
            short, rest = rest, int(min(np.ceil(max(more, 1.1) * rest), longest))
            found = tried(rest)
        if found is None:
            if not self.bounded:
                return self._designed(model, change).planned  # raises what is infeasible
            return replace(self._designed(model, replace(change, best=True)).planned, capped=True)
        fits = _fits(found, cap)
        while fits and rest > _CLOSE * short and found.cost < _MOSTLY * cap:
            middle = int(np.sqrt(short * rest))
            between = tried(middle)
            if between is not None and _fits(between, cap):
                found, rest = between, middle
            else:
                short = middle
        plan = found.planned
        if _fits(found, cap):
            return plan
        share = cap / plan.cost
        weaker = plan.record * np.sqrt(share)
        return replace(plan, record=weaker, power=plan.power * share, cost=cap, capped=True)

    def _designed(self, model: Model | None, change: Change) -> _Found:
        task = self.designs.at(model, change)
        task = replace(task, asked=replace(task.asked, windows=0))  # a part is not the whole record
        kind: PlanKind = "white" if change.white else "nominal" if task.asked.plants is None else "robust"
        return _Found(task, task.designed(), kind)

    def _stopgap(self, rules: Rules, cost: float, rest: int, seed: int, why: IdesignError) -> Planned:
        """Return white noise of this cost a sample; of the power of the pilot if nothing else was applied."""
        nominal, task = self.nominal, self.designs.at(None, Change(rest, seed))
        unit = weighted_sum(task.asked.cost, GivenExcitation.even(nominal, 1.0).power)
        power = cost / unit if np.isfinite(cost) else rules.pilot_power or 0.0
        flat = FlatBasis(nominal.inputs, nominal.band)
        record = given_record(task.record, nominal, flat, np.array([power]), lambda information: 0.0)
        samples = np.zeros((rest, nominal.inputs)) if record is None else record.samples
        message = why.diagnostics[0].message
        return Planned(samples, rest, power_of(samples), power * unit, "stopgap", why=message)


@dataclass(frozen=True)
class _Found:
    """Holds a design, whose record is made when it is wanted."""

    task: ConvexTask
    done: Designed
    kind: PlanKind

    @cached_property
    def cost(self) -> float:
        """Return the cost of a sample."""
        return design_cost(self.done.design, self.done.cost)

    @property
    def planned(self) -> Planned:
        """Return the plan with its record; zero if nothing needs to be applied."""
        done = self.done

        def claim() -> PlanClaim:
            """Return the proof of the design; raise `InaccurateError` if other means do not confirm it."""
            found = design_outcome(done)
            audit(done, found, on_grid=False)
            assert found.objective is not None
            assert found.spectrum is not None
            return PlanClaim(done.answer.status, found.objective, found.spectrum)

        made = fitting_record(self.task.record, done.question, done.design, done.experiment.samples).record
        silent = np.zeros((done.experiment.samples, done.experiment.inputs))
        record = silent if made is None else made.samples
        return Planned(record, len(record), power_of(record), self.cost, self.kind, claim=claim)


def _fits(found: _Found | None, cap: float) -> bool:
    return found is not None and found.cost <= cap * REACHED


def standing(
    planner: Planner, estimate: Model, informed: Callable[[Model], Array], last: Model
) -> Standing | None:
    """Return the estimate with its accuracy, or the nearest usable model on the way from the `last` one.

    `informed` returns the information (k, k) of the data at a model. None: no model can be used.
    """
    for share in _SHARES:
        model = estimate if share == 1.0 else estimate.at(last.theta + share * (estimate.theta - last.theta))
        if not planner.radius(model) <= planner.farthest:
            continue
        try:
            information = informed(model)
            question = planner.question(model, information)
            ratio = question.ratio(question.information)
        except (IdesignError, np.linalg.LinAlgError):
            continue
        if np.isfinite(ratio):
            return Standing(model, information, ratio, share)
    return None


def _largest_scale(cost: Callable[[float], float], cap: float) -> float:
    """Return the largest scale up to one at which a cost, quadratic in the scale, is at most `cap`.

    If effects of earlier parts alone cost more, the own effects of the part keep the cap.
    """
    full = cost(1.0)
    if full <= cap:
        return 1.0
    left, turned = cost(0.0), cost(-1.0)
    own, mixed = 0.5 * (full + turned) - left, 0.25 * (full - turned)
    if left >= cap:
        return float(min(np.sqrt(cap / own), 1.0)) if own > 0.0 else 1.0
    return float((np.sqrt(mixed**2 + own * (cap - left)) - mixed) / own)
