"""Try whole campaigns many times on a simulated true system, and experiments in one shot.

Each run estimates, plans and stops as a real campaign does.
"""

from __future__ import annotations

import time
from collections import Counter
from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field, replace
from functools import partial
from math import inf
from typing import Literal, get_args

import numpy as np

from inputdesign_cli.arrays import Array
from inputdesign_cli.compute.executor import Executor
from inputdesign_cli.compute.time_limit import time_limit
from inputdesign_cli.errors import IdesignError, InaccurateError, InfeasibleError, SpecError, bad_spec
from inputdesign_cli.findings.neglected import mattering, neglected
from inputdesign_cli.identification import Estimate, fit_batch, identify, information_of_data
from inputdesign_cli.information import Experiment, FiniteRecord
from inputdesign_cli.monte_carlo.batches import run_batches
from inputdesign_cli.monte_carlo.statistics import binomial_limits
from inputdesign_cli.monte_carlo.study import responses
from inputdesign_cli.outcome import Simulation
from inputdesign_cli.outcome.campaign import State
from inputdesign_cli.outcome.curves import Curves, RunCurves, TradeCurves
from inputdesign_cli.outcome.estimate import Verdict, variance_of
from inputdesign_cli.outcome.results import Results, Table
from inputdesign_cli.outcome.simulation import Limits, Spread, TriedInput
from inputdesign_cli.plant import Model
from inputdesign_cli.questions.campaign.plans import Planner, other_minima, standing
from inputdesign_cli.questions.campaign.schedule import Rules, Schedule, Standing
from inputdesign_cli.questions.common.delivery import with_study
from inputdesign_cli.questions.least_cost.solve import ConvexTask

Ending = State | Literal["unplanned"]
Reference = Literal["true", "estimate", "design"]
_ENDINGS: tuple[Ending, ...] = ("stopped", "missed", "undecided", "unplanned")
_REFERENCES: tuple[Reference, ...] = get_args(Reference)
_SEEDS = 2**31


@dataclass(frozen=True)
class Oracle:
    """Holds the cost of an experiment whose design knows the true plant, summed over its samples.

    Attributes:
        cost: cost of the spectrum; `record`: cost of the delivered record, None without one. Both are on the
            true plant.
    """

    cost: float
    record: float | None = None


@dataclass(frozen=True)
class Ended:
    """Describes the end of one run.

    Attributes:
        status: `stopped` if the data met what is asked; `unplanned` if no experiment could be planned.
        ratio: the largest r_u / r_adm of the true plant by the samples applied; None if the true system has
            other parameters than the model.
        energy: cost per sample times samples, on the true plant.
        within: whether the error of the estimate is within r_adm of the truth, of the estimate and of the
            plant of the spec; None if r_adm cannot be evaluated.
        parts: number of applied parts; `shrunk`: number of parts after which the estimate was not used.
    """

    status: Ending
    samples: int
    energy: float
    ratio: float | None
    within: Mapping[Reference, bool | None]
    parts: int
    shrunk: int


@dataclass(frozen=True)
class CampaignTask:
    """Solves a spec with a campaign as one experiment in one shot, and simulates it in parts.

    Attributes:
        ways: the rules of the campaign, and of experiments in one shot to compare with.
        true: the experiment on the true system, of the planned length.
        has_prior: whether the spec states information that runs would have to draw.
    """

    design: ConvexTask
    planner: Planner
    ways: Mapping[str, Rules]
    true: Experiment
    runs: int
    seed: int
    has_prior: bool

    def solve(self) -> Results:
        """Design the whole experiment at the plant of the spec, see `ConvexTask.solve`.

        Raises:
            SpecError: `not-supported` for `signal.least_move`, which the parts of a campaign keep.
        """
        if self.ways["campaign"].least is not None:
            message = "the record of a whole experiment does not keep signal.least_move"
            hint = "begin the campaign (`idesign campaign SPEC -o DIR`), or remove the key"
            raise bad_spec("not-supported", message, hint=hint, key="signal.least_move")
        return self.design.solve()

    def simulate(self, executor: Executor | None = None) -> Results:
        """Design, and simulate whole campaigns and experiments in one shot on the true system.

        Args:
            executor: where runs are computed (default: in this process); the result does not depend on it.

        Raises:
            SpecError: `not-supported` for prior information without data.
        """
        model, samples = self.true.model, self.true.samples
        if self.has_prior:
            raise bad_spec(
                "not-supported",
                "simulated campaigns begin without data: information that is known before would have to be "
                "drawn anew in each run",
                hint="remove experiment.prior, and let campaign.pilot gather the first data",
                key="experiment.prior",
            )
        results = self.design.solve()
        started = time.perf_counter()
        with time_limit(inf):  # the limit of the solver is for the design
            oracle = self.oracle()
            ways = {name: self.tried(name, executor) for name in self.ways}
        record = None if oracle is None else oracle.record
        simulation = Simulation(
            runs=self.runs,
            seed=self.seed,
            samples=samples,
            true_parameters=dict(zip(model.names, model.theta.tolist(), strict=True)),
            true_variance=variance_of(model.covariance),
            inputs={name: way_entry(ended, oracle) for name, ended in ways.items()},
            oracle_cost=None if oracle is None else oracle.cost / samples,
            oracle_record_cost=None if record is None else record / samples,
            others={"numbers": {"way": list(ways), "status": list(_ENDINGS)}},
        )
        tables, curves = campaigns_curves(ways, oracle)
        return with_study(results, simulation, started, (), tables, curves)

    def oracle(self) -> Oracle | None:
        """Return the cost of an experiment that knows the plant; None if the true plant has no design."""
        try:
            cost, record = self.planner.knowing(self.true.model)
        except IdesignError:
            return None
        energy = 0.0 if record is None else len(record) * self.planner.cost_of(self.true, record)
        return Oracle(cost, energy or None)

    def tried(self, way: str, executor: Executor | None = None) -> Sequence[Ended]:
        """Return the runs of one way of experimenting."""
        # One run a batch: all ways meet the same noise in the same run.
        run = partial(_ended, self.planner, self.ways[way], self.true)
        return run_batches(run, runs=self.runs, size=1, seed=self.seed, executor=executor)


def ways_of(rules: Rules, *, uncertain: bool, white: bool) -> dict[str, Rules]:
    """Return the rules of the campaign, and of the same length in one shot after a pilot of white noise.

    Args:
        uncertain: whether the spec or a pilot bounds the error of the first estimate.
        white: whether to compare with white excitation that suffices at the estimate.
    """
    whole = rules.schedule.samples
    pilot = rules.schedule.parts[:1] if rules.pilot_power is not None else ()
    once = Schedule((*pilot, whole - sum(pilot)), whole, whole, whole, rules.schedule.hold)
    one = replace(rules, schedule=once, power_cap=None, stops=False, robust_last=False)
    ways = {"campaign": rules, "one_shot": one}
    if uncertain:
        ways["one_shot_robust"] = replace(one, robust_last=True)
    return ways | ({"white": replace(one, white=True)} if white else {})


def way_entry(ended: Sequence[Ended], oracle: Oracle | None) -> TriedInput:
    """Return the results of one way of experimenting."""
    (true, true_limits), (estimate, estimate_limits), (design, design_limits) = (
        _within(ended, of) for of in ("true", "estimate", "design")
    )
    ratios = [run.ratio for run in ended if run.ratio is not None]
    energies = np.array([run.energy for run in ended])
    known = oracle if oracle is not None and oracle.cost > 0.0 else None
    counts = Counter(run.status for run in ended)
    return TriedInput(
        within_r_adm_true=true,
        within_r_adm_true_limits=true_limits,
        within_r_adm_estimate=estimate,
        within_r_adm_estimate_limits=estimate_limits,
        within_r_adm=design,
        within_r_adm_limits=design_limits,
        true_ratio=_spread(ratios, float(np.mean(np.array(ratios) <= 1.0))) if ratios else None,
        energy=_spread(energies),
        cost_over_oracle=None if known is None else _spread(energies / known.cost),
        cost_over_oracle_record=None
        if known is None or known.record is None
        else _spread(energies / known.record),
        samples=_spread([run.samples for run in ended]),
        stopped=counts["stopped"],
        missed=counts["missed"],
        undecided=counts["undecided"],
        unplanned=counts["unplanned"],
        parts=Spread(float(np.mean([run.parts for run in ended]))),
        shrunk=sum(run.shrunk for run in ended),
    )


def _within(ended: Sequence[Ended], of: Reference) -> tuple[float | None, Limits | None]:
    """Return the share of runs within r_adm, with its limits; None if some run cannot be judged."""
    judged = [run.within[of] for run in ended]
    if None in judged:
        return None, None
    kept = sum(map(bool, judged))
    return kept / len(judged), binomial_limits(kept, len(judged))


def _spread(values: Sequence[float] | np.ndarray, at_most_one: float | None = None) -> Spread:
    return Spread(float(np.mean(values)), float(np.quantile(values, 0.95)), at_most_one)


def campaigns_curves(
    ways: Mapping[str, Sequence[Ended]], oracle: Oracle | None
) -> tuple[dict[str, Table], dict[str, Curves]]:
    """Return campaigns.csv with a row for each run, the true ratios, and cost against coverage.

    Ways and endings are written by their numbers. The table has no true ratios if some run has none, for
    instance if the true system has another structure.
    """
    every = [(way, run) for way, ended in enumerate(ways.values()) for run in ended]
    columns = {
        "way": [way for way, _ in every],
        "samples": [run.samples for _, run in every],
        "energy": [run.energy for _, run in every],
        "true_ratio": [run.ratio for _, run in every if run.ratio is not None],
        "status": [_ENDINGS.index(run.status) for _, run in every],
    }
    rows = {name: np.array(values, dtype=float) for name, values in columns.items()}
    tables = {"campaigns": Table({name: x for name, x in rows.items() if len(x) == len(every)})}
    ratios = {
        name: np.array([run.ratio for run in ended if run.ratio is not None]) for name, ended in ways.items()
    }
    curves: dict[str, Curves] = (
        {"true_ratio": RunCurves(ratios, limit=1.0)} if rows["true_ratio"].size else {}
    )
    if oracle is None:
        return tables, curves
    points = {}
    for name, ended in ways.items():
        share, limits = _within(ended, "true")
        if share is None or limits is None:
            return tables, curves
        energies = np.array([run.energy for run in ended])
        costs = np.quantile(energies / oracle.cost, [0.05, 0.95])
        points[name] = (float(np.mean(energies)) / oracle.cost, *costs.tolist(), share, *limits)
    record = None if oracle.record is None else oracle.record / oracle.cost
    curves["cost_coverage"] = TradeCurves(points, record)
    return tables, curves


def _ended(planner: Planner, rules: Rules, true: Experiment, _one: int, rng: np.random.Generator) -> Ended:
    """Run a campaign from rest to its end."""
    return _Run(planner, rules, true, rng).end()


@dataclass
class _Run:
    """Runs one campaign. The noise of all samples is drawn first, so that other ways meet the same noise."""

    planner: Planner
    rules: Rules
    true: Experiment
    rng: np.random.Generator
    known: Standing | None = None
    first: float | None = None
    parts: int = 0
    shrunk: set[int] = field(default_factory=set)  # parts, by their numbers

    def __post_init__(self) -> None:
        size = (self.rules.schedule.most, self.true.model.outputs)
        self.e = self.rng.standard_normal(size) @ np.linalg.cholesky(self.true.model.covariance).T
        self.r: Array = np.zeros((0, self.true.inputs))
        self.sound = self.last = self.planner.nominal.model

    def end(self) -> Ended:
        """Run the campaign from its first plan to its end."""
        rules, planner = self.rules, self.planner
        while True:
            seed = int(self.rng.integers(_SEEDS))
            try:
                plan = planner.plan(rules, self.known, len(self.r), seed, self.first, self.r)
            except (InfeasibleError, InaccurateError, SpecError):
                return self._ended("unplanned")
            if self.first is None and plan.claim is not None:
                self.first = plan.cost
            self.r = np.concatenate([self.r, plan.applied])
            signals = responses(self.true, self.r[None], self.e[None, : len(self.r)], planner.step)
            u, y = (total[0] for _, total in signals)
            self.parts += 1
            done, model, found = len(self.r), self.last, None
            if self.known is not None:
                found = fit_batch(model, u[None], y[None], planner.step, start=model.theta)
            if found is not None and found.converged[0]:
                self._stand(model.at(found.theta[0], found.noise[0]), u, y)
            else:
                self._identified(u, y)
            # A search from several starts is made only after a first suspicion, or at the end.
            if rules.state(done, "met" if self._met else "missed") == "running":
                asks = rules.stops and self.known is not None
                near = self._identified(u, y, near=True) if asks else None
                if near is None or not rules.refuted(near):
                    continue
            full = self._identified(u, y)
            refuted = full is not None and rules.refuted(full)
            state = rules.state(done, self._verdict(full), refuted=refuted)
            if state != "running":
                return self._ended(state)

    @property
    def _met(self) -> bool:
        return self.known is not None and self.known.met

    def _identified(self, u: Array, y: Array, *, near: bool = False) -> Estimate | None:
        """Return the estimate near the last one, or from several starts; later plans rest on this one."""
        model, step, feedback = self.last, self.planner.step, self.true.loop is not None
        try:
            found = identify(model, u, y, step, start=model.theta, feedback=feedback, rest=True, near=near)
        except SpecError:  # too little is known yet
            return None
        if not near:
            self._stand(model.at(found.theta, found.noise), u, y)
        return found

    def _verdict(self, full: Estimate | None) -> Verdict:
        """Return the verdict on all data, and note other minima for the next plan."""
        known = self.known
        if full is None or known is None:
            return "met" if self._met else "missed"
        question = self.planner.question(known.model, known.information)
        others = other_minima(known.model, full, question)
        against = bool(full.tests.failed or others or not full.search.converged)
        if not against and known.met:  # a missed accuracy is missed with more parameters, too
            found = neglected(known.model, full, question.asked, question.information)
            against = bool(mattering(found))
        self.known = replace(known, open=against, others=others)
        return "undecided" if against else "met" if known.met else "missed"

    def _stand(self, estimate: Model, u: Array, y: Array) -> None:
        informed = partial(information_of_data, u=u, y=y, step=self.planner.step)
        stands = standing(self.planner, estimate, informed, self.sound)
        if stands is None:
            return
        self.known, self.last = stands, stands.model
        self.shrunk.discard(self.parts)  # a part may be estimated anew
        if stands.share == 1.0:
            self.sound = stands.model
        else:
            self.shrunk.add(self.parts)

    def _ended(self, status: Ending) -> Ended:
        """Return the end of the run, judged on the true plant."""
        samples, energy, ratio = len(self.r), 0.0, None
        if samples:
            energy = samples * self.planner.cost_of(self.true, self.r)
        if samples and self.true.model.names == self.last.names:
            true = self.true.with_samples(samples)
            information = FiniteRecord(true, samples, self.planner.step).information(self.r)
            with suppress(IdesignError, np.linalg.LinAlgError):
                question = self.planner.question(true.model, information)
                ratio = question.ratio(question.information)
        within = {of: self._within(of) for of in _REFERENCES}
        return Ended(status, samples, energy, ratio, within, self.parts, len(self.shrunk))

    def _within(self, of: Reference) -> bool | None:
        """Return whether |G_hat - G_0| <= r_adm of the truth, the estimate or the spec at all frequencies."""
        planner, true = self.planner, self.true.model
        model = {"true": true, "estimate": self.last, "design": planner.nominal.model}[of]
        try:
            errors = planner.question(model, np.eye(len(model.names))).asked
        except IdesignError:
            return None
        kept = []
        for error in errors:
            off = np.abs(error.concerned(self.last.plant_at(error.grid) - true.plant_at(error.grid)))
            kept.append(bool(np.all(np.linalg.norm(off, axis=1) <= error.admissible.at(error.grid))))
        return all(kept) if kept else None
