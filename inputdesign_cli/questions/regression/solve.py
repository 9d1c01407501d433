"""Moments of the regressors with the least mean-squared error, or the least energy for a given error."""

from __future__ import annotations

import time
from dataclasses import dataclass, replace

import numpy as np

from inputdesign_cli.arrays import Array
from inputdesign_cli.compute.executor import Executor
from inputdesign_cli.design.regression import OutOfReachError, Regression, design_toeplitz
from inputdesign_cli.design.regression.limits import SMALLEST_EIGENVALUE
from inputdesign_cli.errors import InaccurateError, InfeasibleError, bad_spec
from inputdesign_cli.monte_carlo.regression import Contender, contending_regressors, run_experiments
from inputdesign_cli.outcome import Simulation, Solver
from inputdesign_cli.outcome.curves import Curves, MomentsCurves
from inputdesign_cli.outcome.results import Results, Table
from inputdesign_cli.outcome.simulation import TriedInput
from inputdesign_cli.questions.common.plain_signal import signal_results
from inputdesign_cli.questions.common.study import timing, with_study
from inputdesign_cli.questions.regression.outcome import (
    MomentsDesign,
    RegressionTerms,
    error_curves,
    moments_outcome,
    tried_regressors,
)
from inputdesign_cli.questions.regression.regressors import (
    RegressorRecord,
    RegressorSettings,
    realise_regressors,
)

KEY = "accuracy.mean_squared_error"


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
        """Return the design with its proof, its signal and its curves.

        Raises:
            SpecError: `bad-period` when signal.periods does not fit.
            InfeasibleError: `target-out-of-reach`.
            InaccurateError: `target-undecided`.
        """
        return self._solved()[1]

    def simulate(self, executor: Executor | None = None) -> Results:
        """Return the design with least-squares estimates of theta_1 in many runs of y = Phi theta + v.

        Raises:
            SpecError: there is no simulation, or the record is too short, or an input to compare with is
                not available for regressions; and what `solve` raises, as it does.
        """
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
        return record, Results(outcome, terms.header.resolved_spec, units.time_unit, tables, curves)

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
