"""Write the outcome of a design of moments, and the curves of its error."""

from __future__ import annotations

from dataclasses import asdict, dataclass

import numpy as np

from inputdesign_cli.arrays import Array
from inputdesign_cli.design.regression import (
    ErrorSplit,
    Regression,
    energy_bound,
    energy_sensitivity,
    error_bound,
    error_sensitivity,
    least_energy,
    least_error,
)
from inputdesign_cli.monte_carlo.regression import Estimates
from inputdesign_cli.outcome import (
    Baseline,
    MeanSquaredError,
    Moments,
    Objective,
    Outcome,
    Sensitivity,
    Signal,
    Solver,
    White,
)
from inputdesign_cli.outcome.curves import ErrorCurves
from inputdesign_cli.outcome.simulation import TheoryOfError, TriedInput
from inputdesign_cli.outcome.units import Header
from inputdesign_cli.questions.common.delivery import proof_status

_POINTS = 400


@dataclass(frozen=True)
class RegressionTerms:
    """The question. Exactly one of `target` and `energy` is given.

    Attributes:
        toeplitz: whether the regressors are delayed copies of one input.
        target: the mean-squared error that is allowed; the energy is minimised.
        energy: trace R; the error is minimised.
    """

    header: Header
    regression: Regression
    toeplitz: bool
    samples: int
    target: float | None
    energy: float | None

    def free(self) -> tuple[Array, float]:
        """Return the best moments R (n, n) of any structure, and the bound that proves them."""
        if self.target is not None:
            R = least_energy(self.regression, self.target)
            return R, energy_bound(self.regression, self.target, R)
        assert self.energy is not None
        return least_error(self.regression, self.energy), error_bound(self.regression, self.energy)


@dataclass(frozen=True)
class MomentsDesign:
    """R with its proof.

    Attributes:
        rho: (n,) autocorrelations, if one input has these moments.
        bound: no R of the structure does better.
        tolerance: relative gap up to which the design counts as optimal.
    """

    R: Array
    rho: Array | None
    split: ErrorSplit
    bound: float
    tolerance: float
    how: Solver

    @property
    def energy(self) -> float:
        """trace R."""
        return float(np.trace(self.R))


def moments_outcome(
    terms: RegressionTerms, design: MomentsDesign, signal: Signal | None, timing: dict[str, float]
) -> Outcome:
    """Return what result.json says of a design."""
    regression, split, target, n = terms.regression, design.split, terms.target, terms.regression.n
    if target is not None:
        kind, value, of = "least_cost", design.energy, "energy"
        changes = energy_sensitivity(regression, design.energy, target, split)
    else:
        kind, value, of = "mean_squared_error", split.total, "mean_squared_error"
        changes = error_sensitivity(regression, design.energy, split)
    gap = abs(value - design.bound) / value
    return Outcome(
        title=terms.header.title,
        status=proof_status(gap, design.tolerance),
        objective=Objective(
            kind,
            value,
            lower_bound=design.bound,
            relative_gap=gap,
            any_structure_bound=terms.free()[1] if terms.toeplitz else design.bound,
        ),
        cost=design.energy,
        samples=terms.samples,
        mean_squared_error=MeanSquaredError(
            split.total, split.bias_squared, split.variance, target, others=asdict(split)
        ),
        moments=Moments(
            structure="toeplitz" if terms.toeplitz else "free",
            estimated=regression.m,
            trace=design.energy,
            R=design.R,
            entries={f"R_{i + 1}_{j + 1}": float(design.R[i, j]) for i in range(n) for j in range(i, n)},
            autocorrelations=design.rho,
        ),
        sensitivity=Sensitivity(
            of,
            changes.neglected_norm,
            changes.noise_deviation,
            target=None if target is None else changes.goal,
            energy=changes.goal if target is None else None,
        ),
        baseline=Baseline(_white(terms, value)),
        signal=signal,
        solver=design.how,
        timing_s=timing,
    )


def error_curves(terms: RegressionTerms, design: MomentsDesign) -> ErrorCurves:
    """Return squared bias and variance over the energy, beside the error of white regressors."""
    regression = terms.regression
    energy = design.energy * np.geomspace(0.1, 10.0, _POINTS)
    white = regression.error(np.eye(regression.n) / regression.n)
    return ErrorCurves(
        energy=energy,
        bias_squared=np.full(_POINTS, design.split.bias_squared),
        variance=design.split.variance * design.energy / energy,
        white=white.bias_squared + white.variance / energy,
        design=(design.energy, design.split.total),
        target=terms.target,
    )


def tried_regressors(regression: Regression, Phi: Array, theta: Array, found: Estimates) -> TriedInput:
    """Return means with their standard errors, and the theory of these samples."""
    squared = found.error**2
    runs = squared.size
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


def _white(terms: RegressionTerms, value: float) -> White | None:
    """Return the energy that white regressors need for the target (None if they cannot), or their error."""
    regression = terms.regression
    unit = regression.error(np.eye(regression.n))
    if terms.target is None:
        assert terms.energy is not None
        error = regression.error(np.eye(regression.n) * (terms.energy / regression.n)).total
        return White(mean_squared_error=error, ratio=error / value)
    slack = terms.target - unit.bias_squared
    if slack <= 0.0:
        return None
    energy = regression.n * unit.variance / slack
    return White(cost=energy, ratio=energy / value)
