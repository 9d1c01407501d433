"""Try whole campaigns many times on the true system, and experiments in one shot; say how they ended."""

from __future__ import annotations

import time
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from math import inf

import numpy as np

from inputdesign_cli.compute.executor import Executor
from inputdesign_cli.compute.time_limit import time_limit
from inputdesign_cli.errors import IdesignError, bad_spec
from inputdesign_cli.information import Experiment
from inputdesign_cli.monte_carlo.batches import run_batches
from inputdesign_cli.monte_carlo.statistics import binomial_limits
from inputdesign_cli.outcome import Simulation
from inputdesign_cli.outcome.curves import Curves, RatioCurves, TradeCurves
from inputdesign_cli.outcome.results import Results, Table
from inputdesign_cli.outcome.simulation import Limits, Spread, TriedInput
from inputdesign_cli.questions.campaign.schedule import Oracle, Rules, Schedule
from inputdesign_cli.questions.campaign.trials import (
    CampaignStudy,
    Ended,
    Ending,
    Reference,
    energy_of,
    run_campaigns,
)
from inputdesign_cli.questions.least_cost.solve import ConvexTask

_ENDINGS: tuple[Ending, ...] = ("stopped", "missed", "undecided", "unplanned")


@dataclass(frozen=True)
class CampaignTask:
    """Solves a spec with a campaign as one experiment in one shot, and simulates it in parts."""

    design: ConvexTask
    study: CampaignStudy

    def solve(self) -> Results:
        """Design the whole experiment at the plant of the spec, see `ConvexTask.solve`."""
        return self.design.solve()

    def simulate(self, executor: Executor | None = None) -> Results:
        """Design, and simulate whole campaigns and experiments in one shot on the true system.

        Raises:
            SpecError: `not-supported` for prior information without data.
        """
        if self.study.has_prior:
            raise bad_spec(
                "not-supported",
                "simulated campaigns begin without data: information that is known before would have to be "
                "drawn anew in each run",
                hint="remove experiment.prior, and let campaign.pilot gather the first data",
                key="experiment.prior",
            )
        results = self.design.solve()
        with time_limit(inf):  # that of the solver is for the design
            return studied(self.study, results, executor)


def studied(study: CampaignStudy, results: Results, executor: Executor | None) -> Results:
    """Return the results with the study added.

    Args:
        executor: where the runs are computed (default: in this process); the result does not depend on it.
    """
    started = time.perf_counter()
    oracle = oracle_of(study)
    ways = {name: tried(study, rules, executor) for name, rules in ways_of(study).items()}
    simulation = campaigns_entry(study.true, ways, oracle, runs=study.runs, seed=study.seed)
    timing = {**(results.outcome.timing_s or {}), "simulation": time.perf_counter() - started}
    tables, curves = campaigns_curves(ways, oracle)
    return replace(
        results,
        outcome=replace(results.outcome, simulation=simulation, timing_s=timing),
        tables={**results.tables, **tables},
        curves={**results.curves, **curves},
    )


def oracle_of(study: CampaignStudy) -> Oracle | None:
    """Return the cost of an experiment that knows the plant; None if the true plant has no design."""
    try:
        cost, record = study.planner.knowing(study.true.model)
    except IdesignError:
        return None
    energy = 0.0 if record is None else energy_of(study.planner, record, study.true)
    return Oracle(cost, energy or None)


def ways_of(study: CampaignStudy) -> dict[str, Rules]:
    """Return the rules of the campaign, and of the same length in one shot after a pilot of white noise."""
    rules = study.rules
    whole = rules.schedule.samples
    pilot = rules.schedule.parts[:1] if rules.pilot_power is not None else ()
    parts = (*pilot, whole - sum(pilot))
    one = replace(
        rules, schedule=Schedule(parts, whole, whole, whole), power_cap=None, stops=False, robust_last=False
    )
    ways = {"campaign": rules, "one_shot": one}
    if study.uncertain:
        ways["one_shot_robust"] = replace(one, robust_last=True)
    return ways | ({"white": replace(one, white=True)} if study.white else {})


def tried(study: CampaignStudy, rules: Rules, executor: Executor | None = None) -> Sequence[Ended]:
    """Return the runs of one way of experimenting."""
    run = partial(run_campaigns, replace(study, rules=rules))
    # One run a batch: all ways meet the same noise in the same run.
    parts = run_batches(run, runs=study.runs, size=1, seed=study.seed, executor=executor)
    return [run for part in parts for run in part]


def campaigns_entry(
    true: Experiment, ways: Mapping[str, Sequence[Ended]], oracle: Oracle | None, *, runs: int, seed: int
) -> Simulation:
    """Return the entry of the study in the result.

    Args:
        true: the experiment on the true system.
        ways: the runs of the campaign and of the experiments that it is compared with.
        oracle: cost of an experiment that knows the true plant; None if there is none.
    """
    model = true.model
    record = None if oracle is None else oracle.record
    return Simulation(
        runs=runs,
        seed=seed,
        samples=true.samples,
        true_parameters=dict(zip(model.names, model.theta.tolist(), strict=True)),
        true_variance=float(model.covariance[0, 0])
        if model.outputs == 1
        else tuple(map(tuple, model.covariance.tolist())),
        inputs={name: way_entry(ended, oracle) for name, ended in ways.items()},
        oracle_cost=None if oracle is None else oracle.cost / true.samples,
        oracle_record_cost=None if record is None else record / true.samples,
        others={"numbers": {"way": list(ways), "status": list(_ENDINGS)}},
    )


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
    """Return campaigns.csv with a row for each run, the true ratios, and cost against coverage."""
    ratios = {name: [run.ratio for run in ended if run.ratio is not None] for name, ended in ways.items()}
    curves: dict[str, Curves] = {}
    if any(ratios.values()):
        curves["true_ratio"] = RatioCurves({name: np.array(values) for name, values in ratios.items()})
    tables = {"campaigns": _table(ways)}
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


def _table(ways: Mapping[str, Sequence[Ended]]) -> Table:
    """Return a row for each run; the result has the names of the numbers of ways and endings.

    The true ratios are left out if some run has none, for instance if the true system has another structure.
    """
    rows = [(way, run) for way, ended in enumerate(ways.values()) for run in ended]

    def column(values: Sequence[float]) -> np.ndarray:
        return np.array(values, dtype=float)

    ratios = [run.ratio for _, run in rows if run.ratio is not None]
    return Table(
        {
            "way": column([way for way, _ in rows]),
            "samples": column([run.samples for _, run in rows]),
            "energy": column([run.energy for _, run in rows]),
            **({"true_ratio": column(ratios)} if len(ratios) == len(rows) else {}),
            "status": column([_ENDINGS.index(run.status) for _, run in rows]),
        }
    )
