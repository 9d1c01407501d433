"""How far estimates of short records scatter beyond first-order theory, by simulated records.

First-order theory states a covariance of the estimate. A short record may hold too little noise to average,
and the likelihood may be no parabola. Then records of the estimated model are simulated and estimated again.
Their scatter depends on the plant. Other plants of the confidence region are therefore simulated too, if all
their records can be estimated in one pass.
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
_WIDEST = 6.0  # plants are drawn from a region whose variances are at most this many times those of theory
# Smaller factors are luck of the runs; a record without an estimate as a rule has the largest.
_LUCK, _MOST = 1.05, 1e4
_SETTLED = 0.5
_NEAR = 1e-4  # the square of the last step, in standard deviations: far below the luck of the runs
_SINGULAR = 1e14  # condition number of the information, without units
_NO_NUMBERS = (ArithmeticError, RuntimeWarning, np.linalg.LinAlgError)  # of a plant far from any real one


def as_simulated(model: Model, estimate: Estimate, u: Array, step: float) -> tuple[Estimate, list[Finding]]:
    """Return the estimate with the scatter of simulated estimates, and a finding where it is larger.

    The confidence regions of the plant and of the noise are enlarged until each holds 95 % of the simulated
    estimates. Each of these is judged by its own covariance, as the estimate itself is.

    Args:
        u: the inputs (N, r) of the data, applied in open loop.
        step: time between samples.
    """
    plenty = estimate.errors.size >= _PLENTY * estimate.theta.size
    if plenty or not estimate.search.converged or estimate.tests.failed:  # a refuted model promises nothing
        return estimate, []
    factors, fast = _scatter(model, u, step, _RUNS, free=estimate.start.free)
    if np.all(factors <= _LUCK):
        return estimate, []
    each = [factors]
    for other in _possible(model, estimate, np.minimum(factors, _WIDEST)) if fast else ():
        with suppress(*_NO_NUMBERS):
            each.append(_scatter(other, u, step, _EACH, free=estimate.start.free)[0])
    factors = np.maximum(factors, np.quantile(each, _MOST_OF_THEM, axis=0))
    times = np.sqrt(np.maximum(factors, 1.0))  # nothing is stated more sharply than by theory
    wider = replace(estimate, factor=estimate.factor / times[:, None])
    of_plant, of_noise = (float(times[part].max(initial=1.0)) for part in (model.in_plant, ~model.in_plant))
    return wider, scattered(of_plant, of_noise, _RUNS, none=bool(factors.max() >= _MOST))


def _possible(model: Model, estimate: Estimate, factors: Array) -> list[Model]:
    """Return stable plants about a model, drawn with the covariance of its estimate times `factors` (k,)."""
    rng, found = np.random.default_rng(1), list[Model]()
    for _ in range(_TRIES * _OTHERS):
        off = scipy.linalg.solve_triangular(estimate.factor.T, rng.standard_normal(factors.size))
        with suppress(*_NO_NUMBERS):
            drawn = model.at(model.theta + np.sqrt(factors) * off)
            if drawn.flaw is None and drawn.radius < 1.0:
                found.append(drawn)
        if len(found) == _OTHERS:
            break
    return found


def _scatter(model: Model, u: Array, step: float, runs: int, *, free: bool) -> tuple[Array, bool]:
    """Return by how much simulated estimates scatter more than first-order theory states, (k,).

    It is the ratio of 95 % quantiles of squared distances, one for the plant and one for the noise alone. The
    second value says whether all records were estimated in one pass.
    """
    rng, unknown = np.random.default_rng(0), (np.full(model.theta.size, _MOST), False)
    e = rng.standard_normal((runs, len(u), model.outputs)) @ np.linalg.cholesky(model.covariance).T
    caused, noise = model.simulate(u[None], e, step)
    try:
        found = fit_batch(model, u, caused + noise, step, start=model.theta, free=free, settled_at=_NEAR)
    except np.linalg.LinAlgError:  # records as short as this determine no estimate
        return unknown
    sizes = np.sqrt(np.maximum(np.einsum("rkk->rk", found.information), np.finfo(float).tiny))
    scaled = found.information / (sizes[:, :, None] * sizes[:, None, :])
    usable = found.converged & (np.linalg.cond(scaled) < _SINGULAR)
    if np.sum(usable) < _SETTLED * runs:
        return unknown
    # Without units: the covariance, and the distance from the model.
    spread, away = np.linalg.inv(scaled[usable]), (sizes * (found.theta - model.theta))[usable]
    factors = np.ones(model.theta.size)
    for part in map(np.flatnonzero, (model.in_plant, ~model.in_plant)):
        if part.size:
            own, off = spread[:, part[:, None], part], away[:, part]
            squares = np.einsum("ri,ri->r", off, np.linalg.solve(own, off[:, :, None])[:, :, 0])
            quantile = np.quantile(squares, _LEVEL) / scipy.stats.chi2.ppf(_LEVEL, part.size)
            factors[part] = min(quantile, _MOST) if np.isfinite(quantile) else _MOST
    return factors, found.fast
