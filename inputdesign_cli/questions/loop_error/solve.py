"""Design the input of the model for a controller, so that the error of the loop is least."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from functools import partial
from typing import Literal

import numpy as np

from inputdesign_cli import outcome as out
from inputdesign_cli.arrays import Array, ComplexArray
from inputdesign_cli.compute.executor import Executor
from inputdesign_cli.design.convex.limits import Weight, weighted_sum
from inputdesign_cli.design.loop_error.closed_form import adjoint, power_of
from inputdesign_cli.design.loop_error.design import LoopErrorDesign, design_loop_error
from inputdesign_cli.design.loop_error.parametric import ParametricCriterion, root_moments
from inputdesign_cli.design.loop_error.problem import LoopErrorProblem
from inputdesign_cli.errors import bad_spec
from inputdesign_cli.findings.simulated_runs import unstable_runs
from inputdesign_cli.identification.polynomial_rows import is_arx
from inputdesign_cli.information import POWER_KINDS, PowerKind
from inputdesign_cli.monte_carlo.loop_error import LossStudy, study_losses
from inputdesign_cli.monte_carlo.statistics import whitened_eigenvalues
from inputdesign_cli.outcome import Signal, Simulation
from inputdesign_cli.outcome.curves import Curves, DirectionCurves, RunCurves, SpectrumCurves
from inputdesign_cli.outcome.design import ActivePower, LossMoments, TheoreticalLoss
from inputdesign_cli.outcome.results import Results, Table
from inputdesign_cli.outcome.simulation import ExactLoss, Improvement, TriedInput
from inputdesign_cli.outcome.units import Header
from inputdesign_cli.plant.frequencies import graded_grid, local_maxima
from inputdesign_cli.questions.common import delivery
from inputdesign_cli.questions.common.bound_curves import hermitian_columns
from inputdesign_cli.questions.common.signal_outcome import plain_signal, signal_results
from inputdesign_cli.signal.limits import Bounds
from inputdesign_cli.signal.lines import Lines, grid_lines
from inputdesign_cli.signal.periodic import even_multisine, harmonics, periodogram
from inputdesign_cli.signal.rational import rational_filter
from inputdesign_cli.signal.spectral_factor import matrix_factor

# Number of frequencies of the plots, and the lowest as a share of the highest.
_POINTS = 800
_LOWEST = 1e-3
KEY = "accuracy.closed_loop_error"


@dataclass(frozen=True)
class LoopErrorTask:
    """Designs for the closed-loop error, and studies the design.

    `law` is the name of the control law in the spec, and `grid` the number of points of spectrum.csv. The
    `covariance` is asymptotic in the model order, or exact for the model structure. The record is `filtered`
    white noise, by a rational filter of `order` states for each input or by taps (None), or a multisine of
    equal `periods`. The runs are on the plant of `true`. With `white`, noise of equal power is tried, too.
    """

    problem: LoopErrorProblem
    header: Header
    law: str
    covariance: Literal["asymptotic", "parametric"]
    samples: int
    tolerance: float
    cost: Mapping[PowerKind, Weight]
    grid: int
    record_samples: int
    filtered: bool
    periods: int
    order: int | None
    candidates: int
    signal_seed: int
    bounds: Bounds
    true: LoopErrorProblem
    runs: int
    seed: int
    white: bool

    def solve(self) -> Results:
        """Return the design with its proof, its signal and its curves."""
        return self._solved()[1]

    def simulate(self, executor: Executor | None = None) -> Results:
        """Return the design with its Monte Carlo study and the histogram of the loss."""
        _check_simulated(self.problem, self.true)
        design, results = self._solved()
        begun, samples = time.perf_counter(), self.record_samples
        inputs = {"design": design_lines(design, samples)}
        if self.white:
            inputs["white"] = design_lines(design, samples, white=True)
        studies = study_losses(
            self.true, inputs, samples=samples, runs=self.runs, seed=self.seed, executor=executor
        )
        tried, improvement, curves = loss_results(self.true.parametric(), studies, inputs, samples)
        names = tuple(self.true.plant.names)
        study = Simulation(
            self.runs, self.seed, tried, samples=samples, parameters=names, improvement=improvement
        )
        findings = unstable_runs({name: one.unstable for name, one in studies.items()}, self.runs)
        return delivery.with_study(results, study, begun, findings, curves=curves)

    def _solved(self) -> tuple[LoopErrorDesign, Results]:
        started = time.perf_counter()
        design = design_loop_error(self.problem, self.covariance, tolerance=self.tolerance)
        solved = time.perf_counter()
        samples, signal = self._realised(design)
        outcome = self._outcome(design, signal, delivery.timing(started, solved))
        tables, curves = self._drawn(design)
        tables["signal"], curves["signal"] = signal_results(self.header.units, samples)
        return design, delivery.results_of(self.header, outcome, tables, curves)

    def _outcome(self, design: LoopErrorDesign, signal: out.Signal, seconds: dict[str, float]) -> out.Outcome:
        """Return the content of result.json; raise `internal-disagreement` of value and bound."""
        samples, unit, problem = self.samples, self.header.units.sample_time, design.problem
        inputs = {"design": design, "white": design.white}
        powers, of_white = (
            {kind: one.power(kind).tolist() for kind in POWER_KINDS} for one in inputs.values()
        )
        prices = [None] * len(design.powers) if design.multipliers is None else design.multipliers.tolist()
        each = zip(problem.limits, design.powers.tolist(), prices, strict=True)
        value = design.white_value
        white = out.White(value=value, ratio=value / design.value, power=out.Powers.of(of_white))
        details = {"steps": design.steps, "nodes": int(design.rule.nodes.size), "settled": design.settled}
        objective = out.Objective(
            "closed_loop_error",
            design.value,
            lower_bound=design.lower_bound,
            relative_gap=design.gap,
            any_spectrum_bound=design.lower_bound,
        )
        remedy = "rescale the signals, or restrict the band"
        delivery.check_claims(delivery.of_bounds(objective, self.tolerance), remedy)
        return out.Outcome(
            title=self.header.title,
            status=delivery.proof_status(design.gap, self.tolerance),
            objective=objective,
            cost=weighted_sum(self.cost, powers),
            samples=samples,
            power=out.Powers.of(powers),
            closed_loop_error=out.ClosedLoopError(
                law=self.law,
                covariance=self.covariance,
                expected=design.value / samples,
                band=(problem.band[0] / unit, problem.band[1] / unit),
                noise_model_part=design.noise_part,
                parametric={name: theory_of(one.criterion, one.information) for name, one in inputs.items()},
                limits=tuple(
                    ActivePower(
                        one.kind, one.bound, power, None if one.channel is None else one.channel + 1, price
                    )
                    for one, power, price in each
                ),
            ),
            information=out.Information(
                problem.structure.names,
                samples * design.information,
                np.linalg.inv(design.information) / samples,
            ),
            spectrum=self._spectrum(design),
            baseline=out.Baseline(white),
            signal=signal,
            solver=out.Solver("exchange" if design.of_lines else "dual", self.tolerance, details=details),
            timing_s=seconds,
        )

    def _drawn(self, design: LoopErrorDesign) -> tuple[dict[str, Table], dict[str, Curves]]:
        """Return spectrum.csv on the grid that the spec asks for, and the figures."""
        units, (lo, hi) = self.header.units, design.problem.band
        if design.of_lines:
            w, Phi, white = design.frequencies, design.spectrum, None
            shown, drawn = w, Phi
        else:
            w, white = np.linspace(lo, hi, self.grid), design.white_level
            Phi = design.density(w)
            shown = np.geomspace(max(lo, _LOWEST * hi), hi, _POINTS)
            drawn = design.density(shown)
        table = Table({units.frequency_header: w / units.frequency, **hermitian_columns(Phi, "phi")})
        _, gains, right = np.linalg.svd(design.problem.plant.plant_at(shown))
        directions = adjoint(right)
        power = np.einsum("kai,kab,kbi->ki", np.conj(directions), drawn, directions).real
        frequency, lines = shown / units.frequency, design.of_lines
        return {"spectrum": table}, {
            "spectrum": SpectrumCurves(frequency, drawn, white=white, lines=lines),
            "directions": DirectionCurves(frequency, gains, power, white=white, lines=lines),
        }

    def _spectrum(self, design: LoopErrorDesign) -> out.Spectrum:
        unit, problem = self.header.units.frequency, design.problem
        if design.of_lines:
            lines = {"frequencies": design.frequencies / unit, "masses": design.spectrum}
            return out.Spectrum("multisine", lines)

        def trace(w: Array) -> Array:
            return np.asarray(np.trace(design.density(w), axis1=1, axis2=2).real)

        def at(w: float) -> dict[str, object]:
            matrix = design.density(np.array([w]))[0]
            return {
                "frequency": w / unit,
                "trace": float(np.trace(matrix).real),
                "matrix": _tidy(matrix),
                "eigenvalues": np.linalg.eigvalsh(matrix),
            }

        lo, hi = problem.band
        grid = graded_grid(problem.plant.singularities, lo, hi)
        peaks, heights = local_maxima(trace, grid, trace(grid))
        shown = {"peak": float(peaks[np.argmax(heights)]), "lowest": lo, "highest": hi}
        # C S Phi_r (C S)^* at the lowest frequency, the input of the loop there, and its matrix root.
        w = np.array([lo])
        applied = np.linalg.inv(problem.plant.plant_at(w)) @ problem.law.complementary(w)
        matrix = applied @ (problem.entering(w) - problem.plant.disturbance_at(w)) @ adjoint(applied)
        loop_input = {
            "matrix": _tidy(matrix[0]),
            "root": _tidy(power_of(matrix, 0.5)[0]),
            "root_eigenvalues": np.sqrt(np.maximum(np.linalg.eigvalsh(matrix[0]), 0.0)),
        }
        details = {"grid": self.grid, **{name: at(w) for name, w in shown.items()}, "loop_input": loop_input}
        return out.Spectrum("pointwise", details)

    def _realised(self, design: LoopErrorDesign) -> tuple[Array, Signal]:
        """Return the best of several records (N, n) by the error that it gives, scaled into the limits."""
        samples, periods = self.record_samples, self.periods
        if self.filtered:
            make, residual, details = self._by_filter(design)
        else:
            lines = design_lines(design, samples // periods)
            make = partial(even_multisine, lines, samples, periods=periods)
            residual, details = None, {"periods": periods}
        w = harmonics(samples)
        metrics = design.problem.metrics(w)
        best, value = None, np.inf
        for stream in np.random.SeedSequence(self.signal_seed).spawn(self.candidates):
            u = make(np.random.default_rng(stream))
            powers = periodogram(u).powers
            # The factor on powers by which the record exceeds its limits, by its own spectrum.
            excess = np.max(np.einsum("pkab,kba->p", metrics, powers).real / design.problem.most)
            excess = max(float(excess), max(self.bounds.shares(u).values(), default=0.0) ** 2)
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
        method = "filtered_noise" if self.filtered else "multisine"
        return best, replace(
            plain_signal(best), type=method, spectral_factor_residual=residual, details=details
        )

    def _by_filter(
        self, design: LoopErrorDesign
    ) -> tuple[Callable[[np.random.Generator], Array], float | None, dict[str, object]]:
        """Return the generator of a record, the residual of its spectral factor, and other entries on it."""
        samples, factor = self.record_samples, matrix_factor(design.density)
        if self.order is None:
            details: dict[str, object] = {"floor": factor.floor, "taps": int(factor.taps.shape[0])}
            return lambda rng: factor.filtered(samples, rng), factor.residual, details
        filter_ = rational_filter(factor.taps, self.order)
        wanted = float(design.power("input").sum())
        filter_ = filter_.scaled(float(np.sqrt(wanted / filter_.power().sum())))
        w, weights = design.frequencies, design.weights
        found: dict[str, object] = {
            "floor": factor.floor,
            "order": filter_.order,
            "pole_radius": filter_.radius,
            "filter_value": design.criterion.value(
                design.criterion.information(w, filter_.spectrum(w), weights)
            ),
            "filter": {"A": filter_.A, "B": filter_.B, "C": filter_.C, "D": filter_.D},
        }
        return lambda rng: filter_.filtered(samples, rng), factor.residual, found


def theory_of(criterion: ParametricCriterion, information: Array) -> TheoreticalLoss:
    """Return N E||y - y0||^2 of the model structure, and mean and deviation of its root.

    The information (k, k) is that of one sample.
    """
    moments = root_moments(criterion.error_eigenvalues(information))
    return TheoreticalLoss(criterion.value(information), LossMoments(*moments))


def _tidy(matrix: ComplexArray) -> Array | ComplexArray:
    """Return a matrix that is real up to rounding as a real one."""
    return matrix.real if np.abs(matrix.imag).max() <= 1e-13 * np.abs(matrix).max() else matrix


def loss_results(
    criterion: ParametricCriterion,
    studies: Mapping[str, LossStudy],
    inputs: Mapping[str, Lines],
    samples: int,
) -> tuple[dict[str, TriedInput], Improvement | None, dict[str, Curves]]:
    """Return the loss with each input, the improvement over white noise, and the histogram of many runs."""
    theory, entries = {}, {}
    for name, lines in inputs.items():
        information = criterion.information(lines.frequencies, lines.powers, np.ones(len(lines.powers)))
        theory[name], study = theory_of(criterion, information), studies[name]
        several, counted = len(study.estimates) > 1, study.loss.size > 1
        entries[name] = TriedInput(
            theory=theory[name],
            unstable=study.unstable,
            mean_estimate=study.estimates.mean(axis=0),
            power=tuple(np.ravel(study.power).tolist()),
            covariance_eigenvalues=whitened_eigenvalues(study.estimates, samples * information)
            if several
            else None,
            loss=_moments(study.loss) if counted else None,
            squared=_moments(study.loss**2) if counted else None,
            exact=ExactLoss(_moments(study.exact), _moments(study.exact**2)) if counted else None,
        )
    losses = {name: study.loss for name, study in studies.items() if study.loss.size > 1}
    improvement = None
    if {"design", "white"} <= losses.keys():
        measured = 1 - float(losses["design"].mean() / losses["white"].mean())
        improvement = Improvement(measured, 1 - theory["design"].loss.mean / theory["white"].loss.mean)
    means = {name: theory[name].loss.mean for name in losses}
    return entries, improvement, {"loss": RunCurves(losses, means)} if losses else {}


def _moments(values: Array) -> LossMoments:
    sd = float(values.std(ddof=1))
    return LossMoments(float(values.mean()), sd, sd / float(np.sqrt(values.size)))


def design_lines(design: LoopErrorDesign, samples: int, *, white: bool = False) -> Lines:
    """Return the design, or white noise of its power in its band, on the harmonics of a record."""
    w = harmonics(samples)
    if design.of_lines and not white:
        return Lines.of_period(Lines(design.frequencies, design.spectrum).dense(samples), samples)
    return grid_lines(design.white_density(w) if white else design.density(w), samples, 1.0)


def _check_simulated(nominal: LoopErrorProblem, true: LoopErrorProblem) -> None:
    solve, key = "run idesign solve, which computes what theory expects", "plant"
    if true.law.desired is None:
        what, hint = "simulates model-reference and internal-model control only", solve
        key = f"{KEY}.control.minimum_variance"
    elif nominal.estimated is not None:
        what = (
            "identifies by least squares, which estimates every coefficient of a plant in q^-1: neither "
            "named parameters nor coefficients in s, and none is known"
        )
        hint = f"{solve}; or write A and B as numbers"
    elif not is_arx(true.plant):
        what = "identifies by least squares, so the true system must be of the form A y = B u + e"
        hint = "write A and B only, and simulation.noise: {variance: ..}"
        key = "plant" if true.plant is nominal.plant else "simulation"
    else:
        return true.law.check(true.plant, key="simulation.plant")
    raise bad_spec("not-supported", f"this version {what}", hint=hint, key=key)
