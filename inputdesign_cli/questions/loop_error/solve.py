"""Design the input of the model for a controller, so that the error of the loop is least."""

from __future__ import annotations

import time
from dataclasses import dataclass

from inputdesign_cli.compute.executor import Executor
from inputdesign_cli.design.loop_error import LoopErrorDesign, LoopErrorProblem, design_loop_error
from inputdesign_cli.errors import bad_spec
from inputdesign_cli.findings.simulated_runs import unstable_runs
from inputdesign_cli.identification.least_squares import is_arx
from inputdesign_cli.monte_carlo.loop_error import study_losses
from inputdesign_cli.outcome import Simulation
from inputdesign_cli.outcome.results import Results
from inputdesign_cli.questions.common.plain_signal import signal_results
from inputdesign_cli.questions.common.study import timing, with_study
from inputdesign_cli.questions.loop_error.outcome import (
    LoopErrorTerms,
    design_outcome,
    loss_results,
    spectrum_results,
)
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
        """Return the design with its proof, its signal and its curves.

        Raises:
            SpecError: `not-identifiable`.
            InaccurateError: `gap-not-closed`, `integral-inaccurate` or `solver-failed`.
        """
        return self._solved()[1]

    def simulate(self, executor: Executor | None = None) -> Results:
        """Return the design with its Monte Carlo study and the histogram of the loss.

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
        findings = list(unstable_runs({name: one.unstable for name, one in studies.items()}, trial.runs))
        return with_study(results, study, begun, curves=curves, findings=findings)

    def _solved(self) -> tuple[LoopErrorDesign, Results]:
        started = time.perf_counter()
        design = design_loop_error(self.problem, self.terms.covariance, tolerance=self.terms.tolerance)
        solved = time.perf_counter()
        samples, signal = realise(design, self.signal)
        outcome = design_outcome(self.terms, design, signal, timing(started, solved))
        header = self.terms.header
        tables, curves = spectrum_results(self.terms, design)
        tables["signal"], curves["signal"] = signal_results(header.units, samples)
        return design, Results(outcome, header.resolved_spec, header.units.time_unit, tables, curves)


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
            "neither named parameters nor coefficients in s, and none is known",
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
