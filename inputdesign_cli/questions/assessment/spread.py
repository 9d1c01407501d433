"""How far estimates of short records scatter beyond first-order theory, by simulated records.

First-order theory states a covariance of the estimate. A short record may hold too little noise to average,
and the likelihood may be no parabola. Then records of the estimated model are simulated and estimated again.
How far they scatter depends on the plant, so that plants of the confidence region are simulated as well,
where that takes a moment.
"""

from __future__ import annotations

from contextlib import suppress
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
# Other plants and the runs of each; a quarter of them may scatter more than is stated.
_OTHERS, _EACH, _MOST_OF_THEM = 8, 100, 0.75
_TRIES = 10  # draws for each of the other plants, of which some are unstable
_WIDEST = 6.0  # plants are drawn from the region as simulated, no wider than by this factor
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
    factor, fast = _scatter(model, u, step, _RUNS, free=estimate.start.free)
    if factor <= _LUCK:
        return estimate, []
    each = [factor]
    for other in _possible(model, min(factor, _WIDEST) * estimate.covariance) if fast else ():
        with suppress(ArithmeticError, RuntimeWarning):  # a plant whose numbers have no end
            each.append(_scatter(other, u, step, _EACH, free=estimate.start.free)[0])
    factor = max(factor, float(np.quantile(each, _MOST_OF_THEM)))
    wider = replace(estimate, factor=estimate.factor / np.sqrt(factor))
    return wider, scattered(float(np.sqrt(factor)), _RUNS, none=factor >= _MOST)


def _possible(model: Model, covariance: Array) -> list[Model]:
    """Return plants of this structure about a model, drawn with the covariance (k, k); none is unstable."""
    rng, root, found = np.random.default_rng(1), np.linalg.cholesky(covariance), list[Model]()
    for _ in range(_TRIES * _OTHERS):
        drawn = model.at(model.theta + root @ rng.standard_normal(len(root)))
        if drawn.flaw is None and drawn.radius < 1.0:
            found.append(drawn)
        if len(found) == _OTHERS:
            break
    return found


def _scatter(model: Model, u: Array, step: float, runs: int, *, free: bool) -> tuple[float, bool]:
    """Return the 95 % quantile of squared distances from the model over that of first-order theory.

    Then whether the estimates took a moment, since all records were estimated in one pass.
    """
    rng = np.random.default_rng(0)
    e = rng.standard_normal((runs, len(u), model.outputs)) @ np.linalg.cholesky(model.covariance).T
    caused, noise = model.simulate(u[None], e, step)
    try:
        found = fit_batch(model, u, caused + noise, step, start=model.theta, free=free)
    except np.linalg.LinAlgError:  # records as short as this determine no estimate
        return _MOST, False
    away = (found.theta - model.theta)[found.converged]
    if len(away) < _SETTLED * runs:
        return _MOST, False
    squares = np.einsum("ri,rij,rj->r", away, found.information[found.converged], away)
    factor = float(np.quantile(squares, _LEVEL) / scipy.stats.chi2.ppf(_LEVEL, model.theta.size))
    return min(factor, _MOST) if np.isfinite(factor) else _MOST, found.fast
