"""The input for the model that a controller is designed on: the least error of the loop."""

from __future__ import annotations

import time
from dataclasses import dataclass, replace

from inputdesign_cli.compute.executor import Executor
from inputdesign_cli.design.loop_error import LoopErrorDesign, LoopErrorProblem, design_loop_error
from inputdesign_cli.errors import bad_spec
from inputdesign_cli.findings.unstable_runs import unstable_runs
from inputdesign_cli.identification.least_squares import is_arx
from inputdesign_cli.monte_carlo.loop_error import study_losses
from inputdesign_cli.outcome import Signal, Simulation, read_plain, write_plain
from inputdesign_cli.outcome.results import Results
from inputdesign_cli.questions.common.plain_signal import signal_of, signal_results
from inputdesign_cli.questions.common.study import timing, with_study
from inputdesign_cli.questions.loop_error.losses import loss_results
from inputdesign_cli.questions.loop_error.outcome import LoopErrorTerms, design_outcome, spectrum_results
from inputdesign_cli.questions.loop_error.signal import (
    LoopErrorSignalSettings,
    design_lines,
    realise,
    white_lines,
)

KEY = "accuracy.closed_loop_error"


@dataclass(frozen=True)
class LossTrial:
    """The Monte Carlo study: `problem` with the true plant, and whether white noise is tried as well."""

    problem: LoopErrorProblem
    runs: int
    seed: int
    white: bool


@dataclass(frozen=True)
class LoopErrorTask:
    """A design for the closed-loop error, and its study."""

    problem: LoopErrorProblem
    terms: LoopErrorTerms
    signal: LoopErrorSignalSettings
    trial: LossTrial

    def solve(self) -> Results:
        """The design, its proof, its signal and its curves.

        Raises:
            SpecError: `not-identifiable`.
            InaccurateError: `gap-not-closed`, `integral-inaccurate` or `solver-failed`.
        """
        return self._solved()[1]

    def simulate(self, executor: Executor | None = None) -> Results:
        """The same with the entry `simulation` and the histogram of the loss.

        Raises:
            SpecError: `not-supported` for true systems that are not ARX, or minimum-variance control; see
                `ControlLaw.check` for what a controller designed on the true plant could not do.
            InaccurateError: see `solve`.
        """
        trial = self.trial
        _check_simulated(self.problem, trial.problem)
        design, results = self._solved()
        begun = time.perf_counter()
        samples = self.signal.samples
        inputs = {"design": design_lines(design, samples)}
        if trial.white:
            inputs["white"] = white_lines(design, samples)
        studies = study_losses(
            trial.problem, inputs, samples=samples, runs=trial.runs, seed=trial.seed, executor=executor
        )
        tried, improvement, curves = loss_results(trial.problem.parametric(), studies, inputs, samples)
        names = tuple(trial.problem.plant.names)
        study = Simulation(
            trial.runs, trial.seed, tried, samples=samples, parameters=names, improvement=improvement
        )
        findings = unstable_runs({name: one.unstable for name, one in studies.items()}, trial.runs)
        return with_study(results, study, begun, curves=curves, findings=findings)

    def _solved(self) -> tuple[LoopErrorDesign, Results]:
        started = time.perf_counter()
        design = design_loop_error(self.problem, self.terms.covariance, tolerance=self.terms.tolerance)
        solved = time.perf_counter()
        made = realise(design, self.signal)
        signal = replace(signal_of(made.samples), type=made.method)
        signal = read_plain(Signal, write_plain(signal) | made.details)
        outcome = design_outcome(self.terms, design, signal, timing(started, solved))
        header = self.terms.header
        tables, curves = spectrum_results(self.terms, design)
        table, record = signal_results(header.units, made.samples)
        return design, Results(
            outcome,
            header.resolved_spec,
            header.units.time_unit,
            {**tables, "signal": table},
            {**curves, "signal": record},
        )


def _check_simulated(nominal: LoopErrorProblem, true: LoopErrorProblem) -> None:
    if true.law.desired is None:
        raise bad_spec(
            "not-supported",
            "this version simulates model-reference and internal-model control only",
            hint="run idesign solve, which computes what theory expects",
            key=f"{KEY}.control.minimum_variance",
        )
    if nominal.estimated is not None:
        raise bad_spec(
            "not-supported",
            "this version identifies by least squares, which estimates every coefficient of a plant in q^-1: "
            "neither named parameters nor those of a plant in s, and none is known",
            hint="run idesign solve, which computes what theory expects; or write A and B as numbers",
            key="plant",
        )
    if not is_arx(true.plant):
        raise bad_spec(
            "not-supported",
            "this version identifies by least squares, so the true system must be of the form A y = B u + e",
            hint="write A and B only, and simulation.noise: {variance: ..}",
            key="plant" if true.plant is nominal.plant else "simulation",
        )
    true.law.check(true.plant, key="simulation.plant")
