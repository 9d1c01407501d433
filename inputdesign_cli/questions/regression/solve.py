"""Moments of the regressors with the least mean-squared error, or the least energy for a given error."""

from __future__ import annotations

import time
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from inputdesign_cli.arrays import Array
from inputdesign_cli.compute.executor import Executor
from inputdesign_cli.design.regression import OutOfReachError, Regression, design_toeplitz
from inputdesign_cli.design.regression.limits import SMALLEST_EIGENVALUE
from inputdesign_cli.design.regression.periodic import design_periodic
from inputdesign_cli.errors import InaccurateError, InfeasibleError, bad_spec
from inputdesign_cli.monte_carlo.regression import Contender, contending_regressors, run_experiments
from inputdesign_cli.outcome import Signal, Simulation, Solver
from inputdesign_cli.outcome.curves import Curves, MomentsCurves
from inputdesign_cli.outcome.results import Results, Table
from inputdesign_cli.outcome.simulation import TriedInput
from inputdesign_cli.questions.common.delivery import results_of, timing, with_study
from inputdesign_cli.questions.common.signal_outcome import plain_signal, signal_results
from inputdesign_cli.questions.regression.outcome import (
    MomentsDesign,
    RegressionTerms,
    error_curves,
    moments_outcome,
    tried_regressors,
)
from inputdesign_cli.signal.moments import Start, delayed_regressors, free_regressors, periodic_input, rank

KEY = "accuracy.mean_squared_error"


@dataclass(frozen=True)
class RegressorSettings:
    """The length of the record, its number of equal periods (None: free), its past, and the seed."""

    samples: int
    periods: int | None
    start: Start
    seed: int

    def period(self, least: int) -> int | None:
        """Return the samples of a period, `least` or more; None if no periods are asked for.

        Raises:
            SpecError: `bad-period`.
        """
        samples, periods = self.samples, self.periods
        if periods is None:
            return None
        if samples % periods or samples // periods < least:
            raise bad_spec(
                "bad-period",
                f"{samples} samples do not make {periods} equal periods of at least {least} samples",
                hint=f"choose a divisor of {samples} up to {samples // least}, or change signal.samples",
                key="signal.periods",
            )
        return samples // periods


@dataclass(frozen=True)
class RegressorRecord:
    """Phi (N, n), the signals to apply (N, n), or (N, 1) for delayed copies of one, and their description.

    `lines` of one periodic input are its frequencies (L,) in rad/sample and mean squares (L,).
    """

    Phi: NDArray[np.float64]
    channels: NDArray[np.float64]
    signal: Signal
    lines: tuple[Array, Array] | None = None


def realise_regressors(
    settings: RegressorSettings, regression: Regression, R: Array, rho: Array | None, target: float | None
) -> RegressorRecord | None:
    """Return the record that is asked for; None when it is too short for any.

    Args:
        R: (n, n) moments summed over the samples.
        rho: (n,) autocorrelations of one input, of which the regressors are delayed copies; None: free ones.
        target: the error that is allowed, if the energy is what counts.

    Raises:
        SpecError: `bad-period` when signal.periods does not fit.
    """
    samples, least = settings.samples, rank(R) if rho is None else regression.n
    if samples < least:
        return None
    period, details, lines = settings.period(least), dict[str, object](), None
    if rho is None:
        period = period or (least if samples % least == 0 else samples)
        Phi = channels = free_regressors(R, samples, period)
    else:
        period = period or samples
        found = design_periodic(regression, rho, float(np.trace(R)), period, target=target)
        power = found.energy / (least * samples)
        u = periodic_input(found.shares, power, samples, period, np.random.default_rng(settings.seed))
        Phi, channels = delayed_regressors(u, least, settings.start), u[:, None]
        at_rest = _attained(regression, delayed_regressors(u, least, "zero"), R)
        details = {"start": settings.start, "on_grid": found.exact, "from_rest": at_rest}
        used = np.flatnonzero(found.shares > 0.0)
        lines = 2.0 * np.pi * used / period, found.shares[used] * power
    attained = _attained(regression, Phi, R)
    error = attained.pop("mean_squared_error", None)
    details = {**attained, "period": period, **details}
    signal = replace(plain_signal(channels), details=details, mean_squared_error=error)
    return RegressorRecord(Phi, channels, signal, lines)


def _attained(regression: Regression, Phi: Array, R: Array) -> dict[str, float]:
    """Return the energy of the Gram matrix of these samples, its distance to R, and the error if finite."""
    G = Phi.T @ Phi
    found = {"energy": float(np.trace(G)), "moments_error": float(np.abs(G - R).max() / np.abs(R).max())}
    error = regression.error(G).total
    return {**found, "mean_squared_error": error} if np.isfinite(error) else found


@dataclass(frozen=True)
class RegressionTrial:
    """The Monte Carlo study: the true parameters and the other inputs to try.

    `variance` of the true noise, or its deviation relative to the output without noise, are None if they are
    nominal.
    """

    theta: Array
    runs: int
    seed: int
    compare: tuple[Contender, ...]
    variance: float | None
    relative_std: float | None

    def of(self, nominal: Regression, Phi: Array) -> Regression:
        """Return the regression with the true variance of the noise, for regressors Phi (N, n)."""
        variance = nominal.variance if self.variance is None else self.variance
        if self.relative_std is not None:
            variance = float(self.relative_std**2 * np.mean((Phi @ self.theta) ** 2))
        return replace(nominal, variance=variance)


@dataclass(frozen=True)
class RegressionTask:
    """A design of moments, and its study where the spec has the true parameters.

    `alternating` and `tolerance` (the relative gap to be proved) concern Toeplitz moments.
    """

    terms: RegressionTerms
    alternating: bool
    tolerance: float
    signal: RegressorSettings
    trial: RegressionTrial | None

    def solve(self) -> Results:
        """Return the design with its proof, its signal and its curves."""
        return self._solved()[1]

    def simulate(self, executor: Executor | None = None) -> Results:
        """Return the design with least-squares estimates of theta_1 in many runs of y = Phi theta + v."""
        trial = self.trial
        if trial is None:
            raise bad_spec(
                "missing-key",
                "a regression is simulated with its true parameters, and there are none",
                hint="write simulation: {runs: 10000, plant: {parameters: [..]}}, the estimated ones first",
                key="simulation",
            )
        record, results = self._solved()
        if record is None:
            raise bad_spec(
                "wrong-shape",
                f"{self.signal.samples} samples are too few to realise these moments",
                hint="set experiment.samples",
                key="experiment.samples",
            )
        begun, regression = time.perf_counter(), trial.of(self.terms.regression, record.Phi)
        seeds = np.random.SeedSequence(trial.seed).spawn(1 + 2 * len(trial.compare))

        def tried(Phi: Array, seed: np.random.SeedSequence) -> TriedInput:
            found = run_experiments(
                regression, Phi, trial.theta, runs=trial.runs, seed=seed, executor=executor
            )
            return tried_regressors(regression, Phi, trial.theta, found)

        inputs = {"design": tried(record.Phi, seeds[0])}
        for name, drawn, noise in zip(trial.compare, seeds[1::2], seeds[2::2], strict=True):
            Phi = contending_regressors(
                name,
                record.channels.shape,
                delayed=regression.n if self.terms.toeplitz else None,
                energy=float(np.sum(record.Phi**2)),
                rng=np.random.default_rng(drawn),
            )
            inputs[name] = tried(Phi, noise)
        return with_study(results, Simulation(trial.runs, trial.seed, inputs), begun)

    def _solved(self) -> tuple[RegressorRecord | None, Results]:
        started = time.perf_counter()
        terms = self.terms
        design = self._toeplitz() if terms.toeplitz else self._free()
        solved = time.perf_counter()
        record = realise_regressors(self.signal, terms.regression, design.R, design.rho, terms.target)
        signal = None if record is None else record.signal
        outcome = moments_outcome(terms, design, signal, timing(started, solved))
        units, tables = terms.header.units, dict[str, Table]()
        curves: dict[str, Curves] = {"error": error_curves(terms, design)}
        moments = MomentsCurves(design.R, terms.regression.m)
        if record is not None:
            tables["signal"], curves["signal"] = signal_results(units, record.channels)
            if record.lines is not None:
                w, power = record.lines[0] / units.frequency, record.lines[1]
                tables["spectrum"] = Table({units.frequency_header: w, "line_power": power})
                nyquist = np.pi / units.sample_time
                moments = replace(moments, line_frequency=w, line_power=power, nyquist=nyquist)
        curves["moments"] = moments
        return record, results_of(terms.header, outcome, tables, curves)

    def _free(self) -> MomentsDesign:
        R, bound = self.terms.free()
        return MomentsDesign(R, None, self.terms.regression.error(R), bound, 1e-9, Solver("closed_form"))

    def _toeplitz(self) -> MomentsDesign:
        terms = self.terms
        try:
            found = design_toeplitz(
                terms.regression,
                target=terms.target,
                energy=terms.energy,
                tolerance=self.tolerance,
                rng=np.random.default_rng(self.signal.seed),
                alternating=self.alternating,
            )
        except OutOfReachError as error:
            assert terms.target is not None
            raise _out_of_reach(terms.regression, terms.target, error) from error
        how: dict[str, object] = {"starts": found.starts, "solves": found.solves, "nodes": found.nodes}
        how |= {"assumed_smallest_eigenvalue": found.assumed} if found.assumed else {}
        method = "alternating" if self.alternating else "sequential_convex"
        solver = Solver(method, self.tolerance, details=how)
        return MomentsDesign(found.R, found.rho, found.split, found.bound, self.tolerance, solver)


def _out_of_reach(
    regression: Regression, target: float, error: OutOfReachError
) -> InfeasibleError | InaccurateError:
    """Return the error that no Toeplitz moments reach the target, as far as it is proved."""
    bias = error.bias * float(np.linalg.norm(regression.estimated))
    smallest, largest = (regression.neglected_norm * bias) ** 2, float(np.sqrt(target)) / bias
    key, hint = (
        f"{KEY}.target",
        (
            f"a target above {smallest:.7g} can be met, or neglected_norm below {largest:.7g}; "
            "or estimate more parameters"
        ),
    )
    if not error.proved:
        message = (
            f"no Toeplitz moments were found that reach a mean-squared error of {target:.7g} (the least "
            f"biased ones have {smallest:.7g} at any energy), nor was it proved that there are none"
        )
        return InaccurateError.because("target-undecided", message, hint=hint, key=key)
    unit = regression.n * regression.variance * float(np.sum(regression.estimated**2)) / target
    assumed = f" and R11 / r_0 with eigenvalues above {SMALLEST_EIGENVALUE:g}" if error.assumed else ""
    message = (
        f"no Toeplitz moments reach a mean-squared error of {target:.7g} (proved for every energy up to "
        f"{error.proved * unit:.3g}{assumed}): the bias alone is {smallest:.7g}"
    )
    return InfeasibleError.because("target-out-of-reach", message, hint=hint, key=key)
