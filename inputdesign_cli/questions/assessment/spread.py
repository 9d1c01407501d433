"""How far estimates of short records scatter beyond first-order theory, by simulated records.

First-order theory states a covariance of the estimate. A short record may hold too little noise to average,
and the likelihood may be no parabola. Then records of the estimated model are simulated and estimated again.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import scipy

from inputdesign_cli.arrays import Array
from inputdesign_cli.finding import Finding
from inputdesign_cli.findings.estimates import scattered
from inputdesign_cli.identification import Estimate, fit_batch
from inputdesign_cli.plant import Model

# Runs, and the samples a parameter beyond which theory is good to a few per cent.
_RUNS, _PLENTY = 200, 60
_LEVEL = 0.95
# Smaller factors are luck of the runs; a record without an estimate as a rule has the largest.
_LUCK, _MOST = 1.05, 1e4
_SETTLED = 0.5


def as_simulated(model: Model, estimate: Estimate, u: Array, step: float) -> tuple[Estimate, list[Finding]]:
    """Return the estimate with the scatter of simulated estimates, and a finding where it is larger.

    The confidence region of the stated covariance is enlarged until it holds 95 % of the simulated estimates.
    Each of them is judged by its own covariance, as the estimate itself is.

    Args:
        u: the inputs (N, r) of the data, applied in open loop.
        step: time between samples.
    """
    if estimate.errors.size >= _PLENTY * estimate.theta.size or not estimate.search.converged:
        return estimate, []
    factor = _scatter(model, u, step, free=estimate.start.free)
    if factor <= _LUCK:
        return estimate, []
    wider = replace(estimate, factor=estimate.factor / np.sqrt(factor))
    return wider, scattered(float(np.sqrt(factor)), _RUNS, none=factor >= _MOST)


def _scatter(model: Model, u: Array, step: float, *, free: bool) -> float:
    """Return the 95 % quantile of squared distances from the model over that of first-order theory."""
    rng = np.random.default_rng(0)
    e = rng.standard_normal((_RUNS, len(u), model.outputs)) @ np.linalg.cholesky(model.covariance).T
    caused, noise = model.simulate(u[None], e, step)
    try:
        found = fit_batch(model, u, caused + noise, step, start=model.theta, free=free)
    except np.linalg.LinAlgError:  # records as short as this determine no estimate
        return _MOST
    away = (found.theta - model.theta)[found.converged]
    if len(away) < _SETTLED * _RUNS:
        return _MOST
    squares = np.einsum("ri,rij,rj->r", away, found.information[found.converged], away)
    factor = float(np.quantile(squares, _LEVEL) / scipy.stats.chi2.ppf(_LEVEL, model.theta.size))
    return min(factor, _MOST) if np.isfinite(factor) else _MOST
