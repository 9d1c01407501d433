"""Design the input of the model for a controller, so that the error of the loop is least."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from inputdesign_cli.arrays import Array
from inputdesign_cli.compute.executor import Executor
from inputdesign_cli.design.loop_error import LoopErrorDesign, LoopErrorProblem, design_loop_error
from inputdesign_cli.errors import bad_spec
from inputdesign_cli.findings.simulated_runs import unstable_runs
from inputdesign_cli.identification.polynomial_rows import is_arx
from inputdesign_cli.monte_carlo.loop_error import study_losses
from inputdesign_cli.outcome import Signal, Simulation
from inputdesign_cli.outcome.results import Results
from inputdesign_cli.questions.common.delivery import results_of, timing, with_study
from inputdesign_cli.questions.common.signal_outcome import plain_signal, signal_results
from inputdesign_cli.questions.loop_error.outcome import (
    LoopErrorTerms,
    design_outcome,
    loss_results,
    spectrum_results,
)
from inputdesign_cli.signal.limits import Bounds
from inputdesign_cli.signal.lines import Lines, grid_lines
from inputdesign_cli.signal.periodic import even_multisine, harmonics, periodogram
from inputdesign_cli.signal.rational import rational_filter
from inputdesign_cli.signal.spectral_factor import matrix_factor

KEY = "accuracy.closed_loop_error"


@dataclass(frozen=True)
class LoopErrorSignalSettings:
    """How the record is made.

    Attributes:
        filtered: by a filter from white noise; otherwise it is a multisine of equal `periods`.
        order: of a rational filter, states for each input; None: a filter of taps.
    """

    samples: int
    filtered: bool
    periods: int
    order: int | None
    candidates: int
    seed: int
    bounds: Bounds


def realise(design: LoopErrorDesign, settings: LoopErrorSignalSettings) -> tuple[Array, Signal]:
    """Return the best of several records (N, n) by the error that it gives, scaled into the limits."""
    make, residual, details = (_by_filter if settings.filtered else _by_multisine)(design, settings)
    w = harmonics(settings.samples)
    metrics = design.problem.metrics(w)
    best, value = None, np.inf
    for stream in np.random.SeedSequence(settings.seed).spawn(settings.candidates):
        u = make(np.random.default_rng(stream))
        powers = periodogram(u).powers
        # What brings the record to its limits, by its own spectrum.
        excess = np.max(np.einsum("pkab,kba->p", metrics, powers).real / design.problem.most)
        excess = max(float(excess), max(settings.bounds.shares(u).values(), default=0.0) ** 2)
        try:
            M = design.criterion.information(w, powers / excess, np.ones(w.size))
            attained = design.criterion.value(M)
        except np.linalg.LinAlgError:  # too short to excite every parameter
            attained = np.inf
        if best is None or attained < value:
            best, value = u / np.sqrt(excess), attained
    assert best is not None
    if np.isfinite(value):
        details["parametric_value"] = value
    method = "filtered_noise" if settings.filtered else "multisine"
    return best, replace(plain_signal(best), type=method, spectral_factor_residual=residual, details=details)


def design_lines(design: LoopErrorDesign, samples: int) -> Lines:
    """Return the design on the harmonics of a record."""
    if design.of_lines:
        lines = Lines(design.frequencies, design.spectrum)
        return Lines.of_period(lines.dense(samples), samples)
    return grid_lines(design.density(harmonics(samples)), samples, 1.0)


def white_lines(design: LoopErrorDesign, samples: int) -> Lines:
    """Return white noise of the same total power, in the band of the design."""
    return grid_lines(design.white_density(harmonics(samples)), samples, 1.0)


# How a record is drawn, the residual of its spectral factor, and what else is reported of it.
_Made = tuple[Callable[[np.random.Generator], Array], float | None, dict[str, object]]


def _by_multisine(design: LoopErrorDesign, settings: LoopErrorSignalSettings) -> _Made:
    samples, periods = settings.samples, settings.periods
    lines = design_lines(design, samples // periods)
    return lambda rng: even_multisine(lines, samples, rng, periods=periods), None, {"periods": periods}


def _by_filter(design: LoopErrorDesign, settings: LoopErrorSignalSettings) -> _Made:
    samples, factor = settings.samples, matrix_factor(design.density)
    if settings.order is None:
        details: dict[str, object] = {"floor": factor.floor, "taps": int(factor.taps.shape[0])}
        return lambda rng: factor.filtered(samples, rng), factor.residual, details
    filter_ = rational_filter(factor.taps, settings.order)
    wanted = float(np.trace(design.input_covariance))
    filter_ = filter_.scaled(float(np.sqrt(wanted / filter_.power().sum())))
    w, weights = design.frequencies, design.weights
    M = design.criterion.information(w, filter_.spectrum(w), weights)
    found: dict[str, object] = {
        "floor": factor.floor,
        "order": filter_.order,
        "pole_radius": filter_.radius,
        "filter_value": design.criterion.value(M),
        "filter": {"A": filter_.A, "B": filter_.B, "C": filter_.C, "D": filter_.D},
    }
    return lambda rng: filter_.filtered(samples, rng), factor.residual, found


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
        """Return the design with its proof, its signal and its curves."""
        return self._solved()[1]

    def simulate(self, executor: Executor | None = None) -> Results:
        """Return the design with its Monte Carlo study and the histogram of the loss."""
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
        tables, curves = spectrum_results(self.terms, design)
        tables["signal"], curves["signal"] = signal_results(self.terms.header.units, samples)
        return design, results_of(self.terms.header, outcome, tables, curves)


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
