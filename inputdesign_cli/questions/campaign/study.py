"""Try whole campaigns many times on the true system, and experiments in one shot."""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import partial
from math import inf

from inputdesign_cli.compute.executor import Executor
from inputdesign_cli.compute.time_limit import time_limit
from inputdesign_cli.errors import IdesignError, bad_spec
from inputdesign_cli.monte_carlo.batches import run_batches
from inputdesign_cli.outcome.results import Results
from inputdesign_cli.questions.campaign.outcome import campaigns_curves, campaigns_entry
from inputdesign_cli.questions.campaign.schedule import Oracle, Rules, Schedule
from inputdesign_cli.questions.campaign.trials import CampaignStudy, Ended, energy_of, run_campaigns
from inputdesign_cli.questions.least_cost.solve import ConvexTask


@dataclass(frozen=True)
class CampaignTask:
    """A spec with a campaign: solved it is the experiment in one shot, simulated it goes in parts."""

    design: ConvexTask
    study: CampaignStudy

    def solve(self) -> Results:
        """Design the whole experiment at the plant of the spec, see `ConvexTask.solve`."""
        return self.design.solve()

    def simulate(self, executor: Executor | None = None) -> Results:
        """Design, and try whole campaigns and experiments in one shot on the true system.

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
