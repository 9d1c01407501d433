"""Plan each part of a campaign: an ordinary design at the estimate, with the data as its prior."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from contextlib import suppress
from dataclasses import dataclass, replace
from functools import cached_property, partial
from typing import cast

import numpy as np

from inputdesign_cli.arrays import Array, ComplexArray
from inputdesign_cli.design.convex.limits import Weight, weighted_sum
from inputdesign_cli.errors import IdesignError, InfeasibleError, SpecError
from inputdesign_cli.findings.campaigns import NEARLY
from inputdesign_cli.findings.rivals import beyond
from inputdesign_cli.identification import Estimate
from inputdesign_cli.information import Experiment, FiniteRecord, PowerKind
from inputdesign_cli.monte_carlo.excitations import Redrawn
from inputdesign_cli.outcome.campaign import PlanClaim, PlanKind
from inputdesign_cli.plant import Model, close_loop
from inputdesign_cli.plant.model import SampledPlant
from inputdesign_cli.questions.assessment.identify import ModelQuestion
from inputdesign_cli.questions.building.rebuild import Change, Rebuild
from inputdesign_cli.questions.campaign.schedule import REACHED, Planned, Rules, Standing
from inputdesign_cli.questions.common.record import design_cost, given_record
from inputdesign_cli.questions.given.solve import GivenExcitation
from inputdesign_cli.questions.least_cost.audit import audit
from inputdesign_cli.questions.least_cost.outcome import Designed, design_outcome
from inputdesign_cli.questions.least_cost.record_search import fitting_record
from inputdesign_cli.questions.least_cost.solve import ConvexTask
from inputdesign_cli.signal.selection import power_of
from inputdesign_cli.spectrum import FlatBasis, TabulatedSpectrum

# A length within the cap is near enough to the shortest by this factor, or if it costs this share of the cap.
_CLOSE, _MOSTLY = 1.1, 0.5
_LONGER = 4.0  # a length grows at most by this factor at once
# At the plant of the spec a part may cost this multiple of the cap, if costs depend on the plant. The first
# plan after a pilot may cost this multiple of the design for that plant.
_ELSEWHERE = 10.0
# A minimum beside the estimate counts up to this excess of -2 log likelihood: it is a hundredth as likely. A
# part that separates minima raises -2 log likelihood of one of them by the second number on average.
_LIKELY, _APART = 9.0, 36.0
# Frequencies at which models are compared, and the lowest as a share of the highest.
_LINES, _LOWEST = 200, 1e-3
# A part with a least move keeps this share of its power; it is raised by this factor until it does.
_ENOUGH, _RAISED = 0.95, 1.05
# Shares of the way from the last usable estimate to a new one, tried from the new one on.
_SHARES = (1.0, 0.95, 0.9, 0.8, 0.7, 0.6, 0.5, 0.4, 0.3, 0.2, 0.1, 0.0)


@dataclass(frozen=True)
class Planner:
    """Asks for the accuracy and plans the experiment at any estimate.

    Attributes:
        nominal: the experiment on the plant of the spec, in raw parameters.
        farthest: the largest radius of the poles of a usable estimate.
        cost: weights of the powers.
        step: time between samples in the unit of the experiment's frequencies.
        bounded: whether limits bound the power, so that a best experiment exists.
        seed: seed of the record of the whole experiment.
        designs: builds the design of a plan.
        asked: the accuracy question at a model; see `Identification.at`.
        block: the length of a record is a multiple of it, since periods and values are whole.
        reach: (r,), the largest deviation of each input; infinite without a limit.
    """

    nominal: Experiment
    farthest: float
    cost: Mapping[PowerKind, Weight]
    step: float
    bounded: bool
    seed: int
    designs: Rebuild[ConvexTask]
    asked: Callable[[Model, int, Array, str], ModelQuestion]
    block: int
    reach: Array

    def radius(self, model: Model) -> float:
        """Return the radius of the farthest pole of the plant, or of its loop, infinite if unstable."""
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

        Data that suffice now, or with the next part, may leave several minima of the likelihood. The next
        part then also separates these. If the data suffice but tests leave them undecided, the part is
        planned as if there were no data.

        Args:
            known: None before any data.
            first: cost of a sample of the first plan, which the cap is relative to.
            before: (n, r), applied so far about the operating point; None before any.
        """
        take, rest, last = rules.schedule.take(done), rules.schedule.rest(done), rules.schedule.last(done)
        earlier = np.zeros((0, self.nominal.inputs)) if before is None else before
        if known is None and done == 0 and rules.pilot_power is not None:
            return self._kept(self._pilot(rules, rules.pilot_power, take, seed), rules, np.inf, None, earlier)
        cap = rules.cap(first)
        if first is None and known is not None and None not in (rules.pilot_power, rules.power_cap):
            cap = _ELSEWHERE * self._unlearned  # the first plan after a pilot
        left = known if known is not None and known.open and (last or known.met) else None
        apart = left if left is not None and left.others else None
        alone = left is not None and apart is None and left.met
        change = Change(
            samples=take if alone else rest,
            seed=seed,
            information=None if known is None or alone else known.information,
            uncertainty="stated" if known is None and rules.robust_last else "none",
            white=rules.white,
            goes_on=rules.stops or not last,
        )
        try:
            if apart is None or not apart.met:
                robust = rules.robust_last and last and known is not None and not alone
                plan = self._sufficient(known, change, cap, rules.end - done, robust=robust)
            else:
                plan = Planned(np.zeros((take, self.nominal.inputs)), take, 0.0, 0.0, "parting")
            if apart is not None:
                plan = self._parting(plan, apart, take, seed)
            # The first plan sets the cap, which its own part keeps as well.
            own = rules.cap(plan.cost) if first is None else np.inf
            return self._kept(replace(plan, take=take, alone=alone), rules, min(cap, own), known, earlier)
        except IdesignError as error:
            if known is None:
                raise
            # The estimate may be far off. The next part improves it, and this plan decides nothing.
            cost = np.inf if first is None else min(cap, first)
            gap = replace(self._stopgap(rules, cost, rest, seed, error), take=take)
            return self._kept(gap, rules, cap, None, earlier)

    def _sufficient(
        self, known: Standing | None, change: Change, cap: float, longest: int, *, robust: bool
    ) -> Planned:
        """Return the plan that makes the data suffice, at all plants that they admit if `robust`."""
        model = None if known is None else known.model
        if robust:
            # The accuracy may be infeasible at some plant that the data admit, but not at the estimate.
            with suppress(IdesignError):
                found = self._designed(model, replace(change, uncertainty="data"))
                if found.cost <= cap * REACHED:
                    return found.planned
        plan = self._affordable(model, change, cap, longest)
        # A longer plan goes on after its first part, and a later part may be robust.
        return replace(plan, fragile=robust and len(plan.record) - change.samples < self.block)

    def _pilot(self, rules: Rules, power: float, take: int, seed: int) -> Planned:
        """Return white noise of a power, even over the inputs."""
        powers, hold = np.full(self.nominal.inputs, power / self.nominal.inputs), rules.schedule.hold
        drawn = Redrawn.flat("pilot", "white", powers, self.nominal.band, take, self.step, hold)
        record = drawn.draw(1, take, np.random.default_rng(seed))[0]
        return Planned(record, take, power_of(record), 0.0, "pilot")

    def _parting(self, plan: Planned, known: Standing, take: int, seed: int) -> Planned:
        """Return a plan whose part also separates the minima of the likelihood.

        The added spectrum is the squared difference of the predictions of the models. Its power
        is the expected difference of -2 log likelihood, as in T-optimal designs ([atkinson-fedorov-1975]).
        """
        experiment = self._experiment(known.model).with_samples(take)
        lo, hi = experiment.band
        w = np.linspace(max(lo, _LOWEST * hi), hi, _LINES)
        apart = [self._apart(experiment, known.model.at(theta), w) for theta in known.others]
        squares = np.array([np.einsum("npi,npj->nij", one.conj(), one) for one in apart])
        # The spectrum has power one: 1 / pi times its integral over positive frequencies.
        shape = np.sum(squares / np.abs(squares).max(axis=(1, 2, 3), keepdims=True), axis=0)
        table = TabulatedSpectrum(w, shape * np.pi / np.trapezoid(np.einsum("nii->n", shape).real, w))
        gains = np.trapezoid(np.einsum("mnij,nji->mn", squares, table.phi).real, w) / np.pi
        request = self.designs.at(known.model, Change(take, seed)).record
        power = _APART / (take * np.min(gains, keepdims=True))
        more = given_record(request, experiment, table, power, lambda information: 0.0)
        if more is None:
            return plan
        # The sum of two records within the limits may exceed them.
        record = more.samples[:take] + plan.record[:take]
        plant = FiniteRecord(experiment, take, self.step)
        u, y = (plant.signals(kind, record) for kind in ("input", "output"))
        record /= max([1.0, *request.bounds.shares(u, y).values()])
        cost = self.cost_of(experiment, record)
        return replace(plan, record=record, power=power_of(record), cost=cost, kind="parting", claim=None)

    def _apart(self, experiment: Experiment, other: Model, w: Array) -> ComplexArray:
        """Return the response (n, p, r) from the excitation to the difference of two models' predictions.

        It is whitened, at frequencies `w` (n,); the models have the same excitation and noise.
        """
        model = cast(SampledPlant, experiment.model)
        off = model.plant_at(w) - other.plant_at(w)
        left = model.left_at(w)[0] @ off @ experiment.response("input", w)
        white = np.linalg.solve(model.forcing_at(w), left)
        whitened = np.linalg.solve(np.linalg.cholesky(model.covariance)[None], white)
        return np.asarray(whitened, dtype=np.complex128)

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
        the spec, since plants differ. Noise does not count, as in the cost of a design. Moves of the part
        keep the largest rate and the least size of the rules.
        """
        lead, last = 0, before[-1] if before.size else np.zeros(self.nominal.inputs)
        if rules.rate is not None and np.any(last):
            # A record starts within one move of zero: moves of at most the rate lead back to it.
            rate = np.asarray(rules.rate)
            moves = np.arange(1, int(np.max(np.ceil(np.abs(last) / rate))) + 1)[:, None]
            back = np.sign(last) * np.maximum(np.abs(last) - moves * rate, 0.0)
            back = np.repeat(back, rules.schedule.hold, axis=0)
            lead, plan = len(back), replace(plan, record=np.concatenate([back, plan.record]))
        caps = [(self.nominal, cap)]
        if known is not None:
            wide = _ELSEWHERE if any(map(self.nominal.depends_on_plant, self.cost)) else 1.0
            caps = [(self._experiment(known.model), cap), (self.nominal, wide * cap)]

        def part(scale: float) -> Array:
            """Return the part at a scale, with its lead unscaled."""
            factors = np.where(np.arange(plan.take) < lead, 1.0, scale)
            return factors[: len(plan.applied), None] * plan.applied

        def cost(experiment: Experiment, applied: Array) -> float:
            return self.cost_of(experiment, np.concatenate([before, applied]), len(before))

        def scaled(experiment: Experiment, scale: float) -> float:
            return cost(experiment, part(scale))

        scale = min(_largest_scale(partial(scaled, at), most) for at, most in caps)
        applied = part(scale)
        if rules.least is not None:
            applied = usefully_moved(applied, last, np.asarray(rules.least), self.reach)
        beyond = any(cost(at, applied) > most * REACHED for at, most in caps)
        record = np.concatenate([applied, plan.record[plan.take :]])
        part_cost = cost(caps[0][0], applied)
        # A part may be stronger or weaker than its plan is on average.
        weaker = scale**2 < NEARLY and plan.power > 0.0
        share = power_of(applied) / plan.power if weaker else 1.0
        return replace(plan, record=record, share=share, part_cost=part_cost, beyond=beyond)

    def cost_of(self, experiment: Experiment, record: Array, begin: int = 0) -> float:
        """Return the cost of a sample of a record (n, r), from the sample `begin` on, without any noise."""
        at = FiniteRecord(experiment.with_samples(len(record)), len(record), self.step)
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
        whole = -(-change.samples // self.block) * self.block
        task = self.designs.at(model, replace(change, samples=whole))
        task = replace(task, asked=replace(task.asked, windows=0))  # a part is not the whole record
        kind: PlanKind = "white" if change.white else "nominal" if task.asked.plants is None else "robust"
        return _Found(task, task.designed(), kind)

    def _stopgap(self, rules: Rules, cost: float, rest: int, seed: int, why: IdesignError) -> Planned:
        """Return white noise of this cost a sample; of the power of the pilot if nothing else was applied."""
        nominal, rest = self.nominal, -(-rest // self.block) * self.block
        task = self.designs.at(None, Change(rest, seed))
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
    """Return the estimate with its accuracy, or the nearest usable model on the way to it from the `last`.

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


def other_minima(model: Model, estimate: Estimate, question: ModelQuestion | None) -> tuple[Array, ...]:
    """Return the parameters (k,) of minima about as likely as the estimate that cast doubt on its accuracy.

    G differs there by more than is admitted, or the minima widen the covariance of the estimate.
    """
    close = [point.theta for point, excess in estimate.search.beside if excess < _LIKELY]
    if question is not None:
        information = None if question.asked else question.information
        close += [one.rival.theta for one in beyond(model, estimate, question.errors, information)]
    return tuple(close)


def usefully_moved(record: Array, start: Array, least: Array, reach: Array) -> Array:
    """Return a record (n, r) that moves by `least` (r,) or more, or not at all, beginning at `start` (r,).

    Each input waits until the record is that far away. The record is raised if it loses power by waiting,
    up to the `reach` (r,) of the inputs.
    """
    peaks = np.abs(record).max(axis=0)
    most = float(np.min(np.divide(reach, peaks, out=np.full(peaks.size, np.inf), where=peaks > 0.0)))
    scale, moved = 1.0, _waiting(record, start, least)
    while power_of(moved) < _ENOUGH * power_of(record) and scale < most:
        scale = min(_RAISED * scale, most)
        moved = _waiting(scale * record, start, least)
    return moved


def _waiting(record: Array, start: Array, least: Array) -> Array:
    moved, now = np.empty_like(record), start.copy()
    for t, goal in enumerate(record):
        now = np.where(np.abs(goal - now) >= least, goal, now)
        moved[t] = now
    return moved


def _largest_scale(cost: Callable[[float], float], cap: float) -> float:
    """Return the largest scale up to one at which a cost, quadratic in the scale, is at most `cap`.

    If effects of earlier parts alone cost more, the effects of this part alone keep the cap.
    """
    full = cost(1.0)
    if full <= cap:
        return 1.0
    left, turned = cost(0.0), cost(-1.0)
    own, mixed = 0.5 * (full + turned) - left, 0.25 * (full - turned)
    if left >= cap:
        return float(min(np.sqrt(cap / own), 1.0)) if own > 0.0 else 1.0
    return float((np.sqrt(mixed**2 + own * (cap - left)) - mixed) / own)
