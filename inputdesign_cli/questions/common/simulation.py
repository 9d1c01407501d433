"""A designed or given experiment, tried many times on the true system: does it keep what is predicted?

Every run draws a new realisation of the spectrum (scaled to its power exactly) and new noise. With
`simulation.excitation: record` all runs apply the one record that the design delivers.
"""

from __future__ import annotations

import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from math import inf

import numpy as np

from inputdesign_cli.accuracy import ModelError
from inputdesign_cli.arrays import Array
from inputdesign_cli.compute.executor import Executor
from inputdesign_cli.compute.time_limit import time_limit
from inputdesign_cli.design.convex.cost import Weight
from inputdesign_cli.errors import bad_spec
from inputdesign_cli.findings.simulated_runs import (
    initial_estimate_off,
    one_minimum,
    other_length,
    runs_miss_confidence,
)
from inputdesign_cli.information import Experiment, PowerKind
from inputdesign_cli.monte_carlo.excitations import Excitation, Recorded, Redrawn
from inputdesign_cli.monte_carlo.study import Study, tried_on_model, tried_on_truth
from inputdesign_cli.monte_carlo.trials import PredictedError
from inputdesign_cli.outcome.curves import BoundCurves, Curves
from inputdesign_cli.outcome.results import Results, Table
from inputdesign_cli.outcome.simulation import TriedInput
from inputdesign_cli.outcome.units import Units
from inputdesign_cli.plant import Loop, Model, close_loop
from inputdesign_cli.questions.common.bound import Informed
from inputdesign_cli.questions.common.delivery import Delivered
from inputdesign_cli.questions.common.simulation_curves import cloud, disturbance, error_bands
from inputdesign_cli.questions.common.simulation_outcome import (
    covariance_in_theory,
    study_outcome,
    tried_input,
)
from inputdesign_cli.signal.settings import LEVELLED, Method

# Records that are searched from several starts, where those leave other minima.
_SEARCHED = 10


@dataclass(frozen=True)
class TrueSystem:
    """The plant and the noise that the runs meet, and the loop around them.

    With `relative_noise` the standard deviation of the noise is that share of the weakest output's.
    """

    model: Model
    loop: Loop | None
    relative_noise: float | None = None

    def experiment(self, nominal: Experiment, output_power: Sequence[float]) -> Experiment:
        """The nominal experiment on this system; `output_power` (p,) is that of the design."""
        model = self.model
        if self.relative_noise is not None:
            variance = self.relative_noise**2 * min(output_power)
            model = model.at(model.theta, variance * np.eye(model.outputs))
        loop = None if self.loop is None else close_loop(model, self.loop.controller)
        return replace(nominal, model=model, loop=loop, factor=None)


@dataclass(frozen=True)
class Simulation:
    """How an experiment is tried.

    Attributes:
        nominal: the experiment on the design model, in raw parameters, prior information included.
        truth: None if the design model is the true system.
        renewed: whether each run realises the spectrum anew.
        compare: what else is tried at equal power: signals of a flat spectrum over the band, of these kinds.
        entries: see `ModelQuestion`.
    """

    units: Units
    nominal: Experiment
    truth: TrueSystem | None
    runs: int
    seed: int
    renewed: bool
    compare: Sequence[Method]
    cost: Mapping[PowerKind, Weight]
    entries: Sequence[ModelError]


def simulate(plan: Simulation, delivered: Delivered, executor: Executor | None = None) -> Results:
    """The results of the design with the study of its excitation added.

    Args:
        executor: where the batches of runs are computed (default: in this process).

    Raises:
        SpecError: `nothing-to-simulate`; `not-supported` for an input to compare with.
    """
    with time_limit(inf):  # that of the solver is for the design
        return _simulated(plan, delivered, executor)


def _simulated(plan: Simulation, delivered: Delivered, executor: Executor | None) -> Results:
    started = time.perf_counter()
    units, results = plan.units, delivered.results
    if delivered.record is None:
        raise bad_spec(
            "nothing-to-simulate",
            "there is no record of the excitation, so that there is no experiment to simulate",
            hint="ask for more accuracy or a longer signal, or give an excitation under spectrum.given",
            key="accuracy",
        )
    outcome = results.outcome
    assert outcome.power is not None
    assert outcome.samples is not None
    excitations = _excitations(plan, delivered, delivered.record)
    nominal = replace(plan.nominal, samples=len(delivered.record))
    true = nominal if plan.truth is None else plan.truth.experiment(nominal, outcome.power.output or ())
    study = Study(nominal, true, plan.runs, plan.seed, units.step)
    counted, simulated = outcome.samples, len(delivered.record)
    foretold = results.curves if counted == simulated else delivered.of_length(simulated)
    predicted = _predicted(plan, foretold, delivered.alpha, excitations[0].information(nominal))
    inputs: dict[str, TriedInput] = {}
    curves: dict[str, Curves] = {name: foretold[name] for name in ("ellipses",) if name in foretold}
    tables: dict[str, Table] = {}
    for excitation in excitations:
        name = excitation.name
        tried = tried_on_truth(study, excitation, executor)
        errors = tried.trials.errors(predicted)
        modelled = tried_on_model(study, excitation, executor)
        inputs[name] = tried_input(units, tried, predicted, errors, plan.cost, modelled)
        curves[f"errors_{name}"] = error_bands(units, predicted, errors, name)
        theory = None if tried.information is None else covariance_in_theory(tried.information)
        drawn = cloud(tried.trials, theory)
        if drawn is not None:
            curves[f"cloud_{name}"] = drawn
        if true.loop is not None:
            shown = disturbance(units, true.loop, tried.trials.first)
            tables[f"disturbance_{name}"], curves[f"disturbance_{name}"] = shown
    searched = None
    if outcome.foreseen is not None and outcome.foreseen.rivals and delivered.rivals is not None:
        searched = delivered.rivals(_SEARCHED)
        inputs["design"] = replace(inputs["design"], searched=searched)
    asked = None if outcome.model_error is None else outcome.model_error.confidence
    findings = [
        *other_length(counted, simulated),
        *initial_estimate_off(units, inputs),
        *(runs_miss_confidence(asked, inputs["design"]) if "design" in inputs else []),
        *one_minimum(searched),
    ]
    simulation = study_outcome(study, inputs, excitation="new" if plan.renewed else "record")
    timing = {**(outcome.timing_s or {}), "simulation": time.perf_counter() - started}
    return replace(
        results,
        outcome=replace(outcome, simulation=simulation, timing_s=timing).saying(findings),
        tables={**results.tables, **tables},
        curves={**results.curves, **curves},
    )


def _excitations(plan: Simulation, delivered: Delivered, record: Array) -> list[Excitation]:
    """The design, what is compared at equal power, and white noise of the power that it would need."""
    outcome, step, samples = delivered.results.outcome, plan.units.step, len(record)
    assert outcome.power is not None
    power = float(np.sum(outcome.power.excitation or 0.0))
    renewed = delivered.renewed if plan.renewed else None
    listed: list[Excitation] = [renewed or Recorded("design", record, step)]
    listed += [_flat(plan, kind, kind, power, samples) for kind in plan.compare]
    white = None if outcome.baseline is None else outcome.baseline.white
    cheapest = outcome.objective is not None and outcome.objective.kind == "least_cost"
    if white is not None and white.power is not None and cheapest and "white" in plan.compare:
        needed = float(np.sum(white.power.excitation or 0.0))
        listed.append(_flat(plan, "white", "white_that_suffices", needed, samples))
    return listed


def _flat(plan: Simulation, kind: Method, name: str, power: float, samples: int) -> Excitation:
    """An excitation of a flat spectrum over the band of the experiment, even over its channels.

    Raises:
        SpecError: `not-supported` for signals of few levels on a band.
    """
    nominal, band = plan.nominal, plan.nominal.band
    everywhere = plan.units.sampled and band == (0.0, np.pi)
    if kind in LEVELLED and not everywhere:
        raise bad_spec(
            "not-supported",
            f"a {kind} signal has power at all frequencies of discrete time, the excitation only on a band",
            hint="compare with multisine or white",
            key="simulation.compare",
        )
    powers = np.full(nominal.inputs, power / nominal.inputs)
    return Redrawn.flat(name, kind, powers, band, samples, plan.units.step)


def _predicted(
    plan: Simulation, foretold: Mapping[str, Curves], alpha: float, information: Array
) -> PredictedError:
    """What the curve `bound` says; where there is none, the r_u that the `information` gives."""
    bound = foretold.get("bound")
    if not isinstance(bound, BoundCurves):
        _, bound = Informed(plan.units, plan.entries, information, stated=False).bound()
    panels = bound.panels
    admissible = [panel.r_adm for panel in panels if panel.r_adm is not None]
    places = [panel.entry for panel in panels if panel.entry is not None]
    sizes = [panel.frequency.size for panel in panels]
    return PredictedError(
        w=np.concatenate([panel.frequency for panel in panels]) * plan.units.frequency,
        r_u=np.concatenate([panel.r_u for panel in panels]),
        r_adm=np.concatenate(admissible) if admissible else None,
        alpha=alpha,
        entries=np.repeat(np.array(places), sizes, axis=0) if places else None,
    )
