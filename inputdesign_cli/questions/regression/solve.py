"""Moments of the regressors with the least mean-squared error, or the least energy for a given error."""

from __future__ import annotations

import time
from dataclasses import asdict, dataclass, replace
from functools import partial

import numpy as np
from numpy.typing import NDArray

from inputdesign_cli import outcome as out
from inputdesign_cli.arrays import Array
from inputdesign_cli.compute.executor import Executor
from inputdesign_cli.design.regression.lift import SMALLEST_EIGENVALUE
from inputdesign_cli.design.regression.model import (
    ErrorSplit,
    MomentsDesign,
    Regression,
    energy_bound,
    error_bound,
    least_error,
)
from inputdesign_cli.design.regression.periodic import design_periodic
from inputdesign_cli.design.regression.structured import OutOfReachError, design_toeplitz
from inputdesign_cli.errors import InaccurateError, InfeasibleError, bad_spec
from inputdesign_cli.monte_carlo.regression import Contender, contending_regressors, run_experiments
from inputdesign_cli.outcome.curves import Curves, ErrorCurves, MomentsCurves
from inputdesign_cli.outcome.results import Results, Table
from inputdesign_cli.outcome.simulation import TheoryOfError, TriedInput
from inputdesign_cli.outcome.units import Header
from inputdesign_cli.questions.common import delivery
from inputdesign_cli.questions.common.signal_outcome import plain_signal, signal_results
from inputdesign_cli.signal.moments import Start, delayed_regressors, free_regressors, periodic_input, rank

_POINTS = 400
KEY = "accuracy.mean_squared_error"


@dataclass(frozen=True)
class RegressorRecord:
    """Holds Phi (N, n), the signals to apply (N, n), or (N, 1) for delayed copies of one, and their form.

    `lines` of one periodic input are its frequencies (L,) in rad/sample and mean squares (L,).
    """

    Phi: NDArray[np.float64]
    channels: NDArray[np.float64]
    signal: out.Signal
    lines: tuple[Array, Array] | None = None


def _attained(regression: Regression, Phi: Array, R: Array) -> dict[str, float]:
    """Return the energy of the Gram matrix of these samples, its distance to R, and the error if finite."""
    G = Phi.T @ Phi
    found = {"energy": float(np.trace(G)), "moments_error": float(np.abs(G - R).max() / np.abs(R).max())}
    error = regression.error(G).total
    return {**found, "mean_squared_error": error} if np.isfinite(error) else found


@dataclass(frozen=True)
class RegressionTask:
    """Minimises the energy, trace R, for a `target` error, or the error for an `energy`, and studies it.

    Toeplitz moments belong to delayed copies of one input, and are proved to a relative gap of `tolerance`.
    The record has a number of equal `periods` (None: free), and a past by `start`. The trial has the true
    parameters `theta` (None: not stated) and compares inputs. Its noise is that of `true`, or has a standard
    deviation of `relative_std` times the rms of the noise-free output.
    """

    header: Header
    regression: Regression
    toeplitz: bool
    samples: int
    target: float | None
    energy: float | None
    alternating: bool
    tolerance: float
    record_samples: int
    periods: int | None
    start: Start
    seed: int
    theta: Array | None
    true: Regression
    relative_std: float | None
    compare: tuple[Contender, ...]
    runs: int
    trial_seed: int

    def solve(self) -> Results:
        """Return the design with its proof, its signal and its curves."""
        return self._solved()[1]

    def simulate(self, executor: Executor | None = None) -> Results:
        """Return the design with least-squares estimates of theta_1 in many runs of y = Phi theta + v."""
        theta, true = self.theta, self.true
        if theta is None:
            message = "a regression is simulated with its true parameters, and there are none"
            hint = "write simulation: {runs: 10000, plant: {parameters: [..]}}, the estimated ones first"
            raise bad_spec("missing-key", message, hint=hint, key="simulation")
        record, results = self._solved()
        if record is None:
            message = f"{self.record_samples} samples are too few to realise these moments"
            hint = "set experiment.samples"
            raise bad_spec("wrong-shape", message, hint=hint, key="experiment.samples")
        begun = time.perf_counter()
        if self.relative_std is not None:
            true = replace(true, variance=float(self.relative_std**2 * np.mean((record.Phi @ theta) ** 2)))
        seeds = np.random.SeedSequence(self.trial_seed).spawn(1 + 2 * len(self.compare))
        tried = partial(tried_regressors, true, theta, runs=self.runs, executor=executor)
        inputs = {"design": tried(record.Phi, seed=seeds[0])}
        for name, drawn, noise in zip(self.compare, seeds[1::2], seeds[2::2], strict=True):
            Phi = contending_regressors(
                name,
                record.channels.shape,
                delayed=true.n if self.toeplitz else None,
                energy=float(np.sum(record.Phi**2)),
                rng=np.random.default_rng(drawn),
            )
            inputs[name] = tried(Phi, seed=noise)
        return delivery.with_study(results, out.Simulation(self.runs, self.trial_seed, inputs), begun)

    def _free(self) -> MomentsDesign:
        """Return the best moments R (n, n) of any structure, and the bound that proves them."""
        if self.target is not None:
            bound = energy_bound(self.regression, self.target)
            R = least_error(self.regression, bound)
        else:
            assert self.energy is not None
            bound = error_bound(self.regression, self.energy)
            R = least_error(self.regression, self.energy)
        return MomentsDesign(R, self.regression.error(R), bound)

    def _solved(self) -> tuple[RegressorRecord | None, Results]:
        started = time.perf_counter()
        design = self._toeplitz() if self.toeplitz else self._free()
        solved = time.perf_counter()
        record = self._realised(design)
        signal = None if record is None else record.signal
        outcome = self._outcome(design, signal, delivery.timing(started, solved))
        units, tables = self.header.units, dict[str, Table]()
        # Squared bias and variance over the energy, beside the error of white regressors.
        energy, n = design.energy * np.geomspace(0.1, 10.0, _POINTS), self.regression.n
        white = self.regression.error(np.eye(n) / n)
        errors = ErrorCurves(
            energy=energy,
            bias_squared=np.full(_POINTS, design.split.bias_squared),
            variance=design.split.variance * design.energy / energy,
            white=white.bias_squared + white.variance / energy,
            design=(design.energy, design.split.total),
            target=self.target,
        )
        curves: dict[str, Curves] = {"error": errors}
        moments = MomentsCurves(design.R, self.regression.m)
        if record is not None:
            tables["signal"], curves["signal"] = signal_results(units, record.channels)
            if record.lines is not None:
                w, power = record.lines[0] / units.frequency, record.lines[1]
                tables["spectrum"] = Table({units.frequency_header: w, "line_power": power})
                nyquist = np.pi / units.sample_time
                moments = replace(moments, line_frequency=w, line_power=power, nyquist=nyquist)
        curves["moments"] = moments
        return record, delivery.results_of(self.header, outcome, tables, curves)

    def _toeplitz(self) -> MomentsDesign:
        try:
            return design_toeplitz(
                self.regression,
                target=self.target,
                energy=self.energy,
                tolerance=self.tolerance,
                rng=np.random.default_rng(self.seed),
                alternating=self.alternating,
            )
        except OutOfReachError as error:
            assert self.target is not None
            raise _out_of_reach(self.regression, self.target, error) from error

    def _outcome(
        self, design: MomentsDesign, signal: out.Signal | None, seconds: dict[str, float]
    ) -> out.Outcome:
        """Return the content of result.json; raise `internal-disagreement` of value and bound."""
        regression, split, target, n = self.regression, design.split, self.target, self.regression.n
        unit, white, solver = regression.error(np.eye(n)), None, out.Solver("closed_form")
        if self.toeplitz:
            method = "alternating" if self.alternating else "sequential_convex"
            solver = out.Solver(method, self.tolerance, details=dict(design.counts))
        if target is not None:
            kind, value = "least_cost", design.energy
            slack = target - unit.bias_squared
            if slack > 0.0:  # white regressors can meet the target
                energy = n * unit.variance / slack
                white = out.White(cost=energy, ratio=energy / value)
        else:
            assert self.energy is not None
            kind, value = "mean_squared_error", split.total
            error = regression.error(np.eye(n) * (self.energy / n)).total
            white = out.White(mean_squared_error=error, ratio=error / value)
        gap = abs(value - design.bound) / value
        any_bound = self._free().bound if self.toeplitz else design.bound
        objective = out.Objective(
            kind, value, lower_bound=design.bound, relative_gap=gap, any_structure_bound=any_bound
        )
        remedy = "rescale the regressors, or state the weights anew"
        delivery.check_claims(delivery.of_bounds(objective, self.tolerance), remedy)
        return out.Outcome(
            title=self.header.title,
            status=delivery.proof_status(gap, self.tolerance),
            objective=objective,
            cost=design.energy,
            samples=self.samples,
            mean_squared_error=out.MeanSquaredError(
                split.total, split.bias_squared, split.variance, target, others=asdict(split)
            ),
            moments=out.Moments(
                structure="toeplitz" if self.toeplitz else "free",
                estimated=regression.m,
                trace=design.energy,
                R=design.R,
                entries={f"R_{i + 1}_{j + 1}": float(design.R[i, j]) for i in range(n) for j in range(i, n)},
                autocorrelations=design.rho,
            ),
            sensitivity=sensitivity(regression, design.energy, split, target=target is not None),
            baseline=out.Baseline(white),
            signal=signal,
            solver=solver,
            timing_s=seconds,
        )

    def _realised(self, design: MomentsDesign) -> RegressorRecord | None:
        """Return the record with the moments summed over the samples; None when it is too short.

        Regressors are free, or delayed copies of one input. It raises `SpecError` (`bad-period`).
        """
        regression, R, rho = self.regression, design.R, design.rho
        samples, least, periods = self.record_samples, rank(R) if rho is None else regression.n, self.periods
        if samples < least:
            return None
        if periods is not None and (samples % periods or samples // periods < least):
            message = f"{samples} samples do not make {periods} equal periods of at least {least} samples"
            hint = f"choose a divisor of {samples} up to {samples // least}, or change signal.samples"
            raise bad_spec("bad-period", message, hint=hint, key="signal.periods")
        period, details, lines = samples // periods if periods else None, dict[str, object](), None
        if rho is None:
            period = period or (least if samples % least == 0 else samples)
            Phi = channels = free_regressors(R, samples, period)
        else:
            period = period or samples
            shares, energy, exact = design_periodic(
                regression, rho, float(np.trace(R)), period, target=self.target
            )
            power = energy / (least * samples)
            u = periodic_input(shares, power, samples, period, np.random.default_rng(self.seed))
            Phi, channels = delayed_regressors(u, least, self.start), u[:, None]
            at_rest = _attained(regression, delayed_regressors(u, least, "zero"), R)
            details = {"start": self.start, "on_grid": exact, "from_rest": at_rest}
            used = np.flatnonzero(shares > 0.0)
            lines = 2.0 * np.pi * used / period, shares[used] * power
        attained = _attained(regression, Phi, R)
        error = attained.pop("mean_squared_error", None)
        details = {**attained, "period": period, **details}
        signal = replace(plain_signal(channels), details=details, mean_squared_error=error)
        return RegressorRecord(Phi, channels, signal, lines)


def sensitivity(regression: Regression, energy: float, split: ErrorSplit, *, target: bool) -> out.Sensitivity:
    """Return the derivatives of the least error alpha^2 |b|^2 + sigma^2 c / E, or of the energy for a target.

    At the optimum only the data move (envelope theorem). The error falls with the energy at the rate
    variance / energy: a change of the error over this rate is the change of the least energy.
    """
    alpha, falls = regression.neglected_norm, split.variance / energy
    unit = falls if target else 1.0
    return out.Sensitivity(
        "energy" if target else "mean_squared_error",
        2.0 * split.bias_squared / alpha / unit if alpha > 0 else 0.0,
        float(2.0 * split.variance / np.sqrt(regression.variance) / unit),
        target=-1.0 / falls if target else None,
        energy=None if target else -falls,
    )


def tried_regressors(
    regression: Regression,
    theta: Array,
    Phi: Array,
    *,
    runs: int,
    seed: np.random.SeedSequence,
    executor: Executor | None,
) -> TriedInput:
    """Return the mean estimate and error with their standard errors, and the theory for these samples."""
    found = run_experiments(regression, Phi, theta, runs=runs, seed=seed, executor=executor)
    squared = found.error**2
    G, m = Phi.T @ Phi, regression.m
    inverse = np.linalg.pinv(G[:m, :m], rcond=1e-12, hermitian=True)
    mean = inverse @ G[:m] @ theta
    bias = regression.estimated @ mean - regression.estimated @ theta[:m] - regression.neglected @ theta[m:]
    variance = regression.variance * (regression.estimated @ inverse @ regression.estimated)
    root, several = np.sqrt(runs), runs > 1
    return TriedInput(
        mse=float(squared.mean()),
        mean_estimate=found.theta.mean(axis=0),
        theory=TheoryOfError(float(bias**2 + variance), tuple(mean.tolist())),
        energy=float(np.trace(G)),
        mse_standard_error=float(squared.std(ddof=1) / root) if several else None,
        mean_estimate_standard_error=found.theta.std(axis=0, ddof=1) / root if several else None,
    )


def _out_of_reach(
    regression: Regression, target: float, error: OutOfReachError
) -> InfeasibleError | InaccurateError:
    """Return the error that no Toeplitz moments reach the target, as far as it is proved."""
    bias = error.bias * float(np.linalg.norm(regression.estimated))
    smallest, largest = (regression.neglected_norm * bias) ** 2, float(np.sqrt(target)) / bias
    key, of = f"{KEY}.target", f"a mean-squared error of {target:.7g}"
    hint = f"a target above {smallest:.7g} can be met, or neglected_norm below {largest:.7g}"
    hint += "; or estimate more parameters"
    if not error.proved:
        message = (
            f"no Toeplitz moments were found that reach {of} (the least biased ones have {smallest:.7g} at "
            "any energy), nor was it proved that there are none"
        )
        return InaccurateError.because("target-undecided", message, hint=hint, key=key)
    unit = regression.n * regression.variance * float(np.sum(regression.estimated**2)) / target
    assumed = f" and R11 / r_0 with eigenvalues above {SMALLEST_EIGENVALUE:g}" if error.assumed else ""
    message = (
        f"no Toeplitz moments reach {of} (proved for every energy up to {error.proved * unit:.3g}{assumed}): "
        f"the bias alone is {smallest:.7g}"
    )
    return InfeasibleError.because("target-out-of-reach", message, hint=hint, key=key)
