"""A design of moments -> `result.json` and the curves of its error."""

from __future__ import annotations

from collections.abc import Mapping
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
)
from inputdesign_cli.monte_carlo.regression import Estimates
from inputdesign_cli.outcome.curves import ErrorCurves
from inputdesign_cli.outcome.units import Header
from inputdesign_cli.questions.common.status import proof_status

_POINTS = 400

Entry = dict[str, object]


@dataclass(frozen=True)
class RegressionTerms:
    """How the question was put. Exactly one of `target` and `energy` is given.

    Attributes:
        toeplitz: whether the regressors are delayed copies of one input.
        samples: of the experiment.
        target: the mean-squared error that is allowed; the energy is minimised.
        energy: trace R; the error is minimised.
    """

    header: Header
    regression: Regression
    toeplitz: bool
    samples: int
    target: float | None
    energy: float | None


@dataclass(frozen=True)
class MomentsDesign:
    """R with what is proved of it.

    Attributes:
        rho: (n,) autocorrelations, if the moments are those of one input.
        bound: no R of the structure does better.
        tolerance: relative gap up to which the design counts as optimal.
        how: what result.json says under `solver`.
    """

    R: Array
    rho: Array | None
    split: ErrorSplit
    bound: float
    tolerance: float
    how: Mapping[str, object]

    @property
    def energy(self) -> float:
        """trace R."""
        return float(np.trace(self.R))


def moments_result(terms: RegressionTerms, design: MomentsDesign) -> Entry:
    """`result.json` but for the signal."""
    regression, split, target = terms.regression, design.split, terms.target
    if target is not None:
        kind, value, of, goal = "least_cost", design.energy, "energy", "target"
        sensitivity = energy_sensitivity(regression, design.energy, target, split)
    else:
        kind, value, of, goal = "mean_squared_error", split.total, "mean_squared_error", "energy"
        sensitivity = error_sensitivity(regression, design.energy, split)
    gap = abs(value - design.bound) / value
    white = _white(terms, value)
    return {
        "format": 1,
        "title": terms.header.title,
        "status": proof_status(gap, design.tolerance),
        "objective": {
            "kind": kind,
            "value": value,
            "lower_bound": design.bound,
            "relative_gap": gap,
            "any_structure_bound": _any_structure(terms) if terms.toeplitz else design.bound,
        },
        "cost": design.energy,
        "samples": terms.samples,
        "mean_squared_error": {
            "value": split.total,
            **asdict(split),
            **({} if target is None else {"target": target}),
        },
        "moments": _moments(terms, design),
        "sensitivity": {
            "of": of,
            "neglected_norm": sensitivity.neglected_norm,
            goal: sensitivity.goal,
            "noise_deviation": sensitivity.noise_deviation,
        },
        "baseline": {"white": white} if white else {},
        "solver": dict(design.how),
    }


def error_curves(terms: RegressionTerms, design: MomentsDesign) -> ErrorCurves:
    """Squared bias and variance of the design's shape over the energy, and those of white regressors."""
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


def trial_entry(regression: Regression, Phi: Array, theta: Array, found: Estimates) -> Entry:
    """What `simulation` says of one input: means with their standard errors, and theory for its samples."""
    squared = found.error**2
    runs = squared.size
    G, m = Phi.T @ Phi, regression.m
    inverse = np.linalg.pinv(G[:m, :m], rcond=1e-12, hermitian=True)
    mean = inverse @ G[:m] @ theta
    bias = regression.estimated @ mean - regression.estimated @ theta[:m] - regression.neglected @ theta[m:]
    variance = regression.variance * (regression.estimated @ inverse @ regression.estimated)
    entry: Entry = {
        "mse": float(squared.mean()),
        "mean_estimate": found.theta.mean(axis=0).tolist(),
        "theory": {"mse": float(bias**2 + variance), "mean_estimate": mean.tolist()},
        "energy": float(np.trace(G)),
    }
    if runs > 1:
        entry["mse_standard_error"] = float(squared.std(ddof=1) / np.sqrt(runs))
        entry["mean_estimate_standard_error"] = (found.theta.std(axis=0, ddof=1) / np.sqrt(runs)).tolist()
    return entry


def _moments(terms: RegressionTerms, design: MomentsDesign) -> Entry:
    R, m, n = design.R, terms.regression.m, terms.regression.n
    moments: Entry = {
        "structure": "toeplitz" if terms.toeplitz else "free",
        "estimated": m,
        "trace": design.energy,
        "R": R,
        "entries": {f"R_{i + 1}_{j + 1}": R[i, j] for i in range(n) for j in range(i, n)},
    }
    return moments if design.rho is None else moments | {"autocorrelations": design.rho}


def _any_structure(terms: RegressionTerms) -> float:
    """What no R does better, whatever its structure."""
    if terms.target is not None:
        return energy_bound(terms.regression, terms.target, least_energy(terms.regression, terms.target))
    assert terms.energy is not None
    return error_bound(terms.regression, terms.energy)


def _white(terms: RegressionTerms, value: float) -> Entry:
    """White regressors: the energy that they need for the target (if they can), or their error."""
    regression = terms.regression
    unit = regression.error(np.eye(regression.n))
    if terms.target is None:
        assert terms.energy is not None
        error = regression.error(np.eye(regression.n) * (terms.energy / regression.n)).total
        return {"mean_squared_error": error, "ratio": error / value}
    slack = terms.target - unit.bias_squared
    if slack <= 0.0:
        return {}
    energy = regression.n * unit.variance / slack
    return {"cost": energy, "ratio": energy / value}
