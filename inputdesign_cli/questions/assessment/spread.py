"""How far estimates of short records scatter beyond first-order theory.

First-order theory states a covariance of the estimate. A short record may hold too little noise to average,
and the likelihood may be no parabola. So records of the estimated model are simulated and estimated again.
They show the scatter at one plant only. The likelihood of the record shows how far away other plants may be,
whose estimates scatter more.
"""

from __future__ import annotations

from contextlib import suppress
from dataclasses import replace

import numpy as np
import scipy
from numpy.typing import NDArray

from inputdesign_cli.arrays import Array
from inputdesign_cli.finding import Finding
from inputdesign_cli.findings.estimates import scattered
from inputdesign_cli.identification import Estimate, fit_batch
from inputdesign_cli.identification.records import evaluate
from inputdesign_cli.plant import Model

# Number of runs, and the samples per parameter from which theory holds to a few per cent.
_RUNS, _PLENTY = 200, 60
_LEVEL = 0.95
# Number of models drawn about the estimate, from Gaussian densities of these multiples of its deviations.
_DRAWS, _REACH = 1000, np.array([1.0, 2.0, 4.0])
# Factors up to the first may be chance. A record that gives no estimate in most runs has the second.
_LUCK, _MOST = 1.05, 1e4
_SETTLED = 0.5  # least share of runs with a usable estimate
_NEAR = 1e-4  # the square of the last step, in standard deviations: far below the scatter of the runs
_SINGULAR = 1e14  # condition number of the information, without units
_NO_NUMBERS = (ArithmeticError, RuntimeWarning, np.linalg.LinAlgError)  # at draws far from any real plant


def as_simulated(model: Model, estimate: Estimate, u: Array, step: float) -> tuple[Estimate, list[Finding]]:
    """Return the estimate with the errors that a short record has, and a finding where they are larger.

    The confidence regions of the plant and of the noise are enlarged until each holds 95 % of the simulated
    estimates, each judged by its own covariance, and 95 % of the likelihood of the record.

    Args:
        u: the inputs (N, r) of the data, applied in open loop.
        step: time between samples.
    """
    plenty = estimate.errors.size >= _PLENTY * estimate.theta.size
    if plenty or not estimate.search.converged or estimate.tests.failed:  # a refuted model promises nothing
        return estimate, []
    factors = np.maximum(_scatter(model, u, step, free=estimate.start.free), reach(model, estimate))
    if np.all(factors <= _LUCK):
        return estimate, []
    times = np.sqrt(np.maximum(factors, 1.0))  # nothing is stated more sharply than by theory
    wider = replace(estimate, factor=estimate.factor / times[:, None])
    of_plant, of_noise = (float(times[part].max(initial=1.0)) for part in (model.in_plant, ~model.in_plant))
    return wider, scattered(of_plant, of_noise, _RUNS)


def reach(model: Model, estimate: Estimate) -> Array:
    """Return the ratios (k,) of squared distances that the likelihood reaches and that theory states.

    Stable models are drawn about the estimate, with another plant or with another noise. Each counts by its
    likelihood over the density of the draws (importance sampling). The unknown size of the noise is
    integrated over, which gives Student's t.
    """
    rng, records, best = np.random.default_rng(1), estimate.search.records, estimate.search.point
    factors = np.ones(model.theta.size)
    for part in _parts(model):
        # The other parameters follow by linear regression on these, where the likelihood is largest.
        root = np.linalg.cholesky(estimate.covariance[np.ix_(part, part)])
        z = rng.choice(_REACH, (_DRAWS, 1)) * rng.standard_normal((_DRAWS, part.size))
        off = z @ np.linalg.solve(root, estimate.covariance[part])
        # Integration over the others takes degrees of freedom.
        left = max(best.freedom - factors.size + part.size, 1)
        exponents = -0.5 * np.sum(z**2, axis=1)[:, None] / _REACH**2 - part.size * np.log(_REACH)
        logarithms = np.full(_DRAWS, -np.inf)
        for i, theta in enumerate(best.theta + off):
            with suppress(*_NO_NUMBERS):
                drawn = model.at(theta)
                stable = drawn.flaw is None and drawn.radius < 1.0
                if stable and (cost := evaluate(records, theta).cost) > 0.0:
                    likelihood = -0.5 * left * np.log(cost / best.cost)
                    logarithms[i] = likelihood - scipy.special.logsumexp(exponents[i])
        if np.max(logarithms) > -np.inf:
            weights, spread = np.exp(logarithms - np.max(logarithms)), estimate.covariance
            spreads = np.broadcast_to(spread, (_DRAWS, *spread.shape))
            factors[part] = _ratio(part, spreads, off, weights)
    return factors


def _scatter(model: Model, u: Array, step: float, *, free: bool) -> Array:
    """Return the ratios (k,) of squared distances of simulated estimates and of first-order theory."""
    rng, unknown = np.random.default_rng(0), np.full(model.theta.size, _MOST)
    e = rng.standard_normal((_RUNS, len(u), model.outputs)) @ np.linalg.cholesky(model.covariance).T
    caused, noise = model.simulate(u[None], e, step)
    try:
        found = fit_batch(model, u, caused + noise, step, start=model.theta, free=free, settled_at=_NEAR)
    except np.linalg.LinAlgError:  # records as short as this determine no estimate
        return unknown
    sizes = np.sqrt(np.maximum(np.einsum("rkk->rk", found.information), np.finfo(float).tiny))
    scaled = found.information / (sizes[:, :, None] * sizes[:, None, :])
    usable = found.converged & (np.linalg.cond(scaled) < _SINGULAR)
    if np.sum(usable) < _SETTLED * _RUNS:
        return unknown
    # The covariance and the distance from the model, free of units.
    spread, away = np.linalg.inv(scaled[usable]), (sizes * (found.theta - model.theta))[usable]
    factors = np.ones(model.theta.size)
    for part in _parts(model):
        factors[part] = _ratio(part, spread, away, np.ones(len(away)))
    return factors


def _parts(model: Model) -> list[NDArray[np.int64]]:
    """Return the indices of the parameters of the plant, and of the noise alone, where there are some."""
    return [part for part in map(np.flatnonzero, (model.in_plant, ~model.in_plant)) if part.size]


def _ratio(part: NDArray[np.int64], spread: Array, off: Array, weights: Array) -> float:
    """Return the ratio of the 95 % quantile of squared distances to the quantile of chi-squared.

    Args:
        part: the parameters that count.
        spread: covariances (n, k, k) that the distances `off` (n, k) are measured by.
        weights: how much each distance counts, (n,).
    """
    own, away = spread[:, part[:, None], part], off[:, part]
    squares = np.einsum("ri,ri->r", away, np.linalg.solve(own, away[:, :, None])[:, :, 0])
    nearest = np.argsort(squares)
    share = np.cumsum(weights[nearest])
    quantile = squares[nearest][np.searchsorted(share, _LEVEL * share[-1])]
    ratio = float(quantile / scipy.stats.chi2.ppf(_LEVEL, part.size))
    return min(ratio, _MOST) if np.isfinite(ratio) else _MOST
