"""Moments -> the regressors of a regression experiment, and what these very samples give."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from inputdesign_cli.design.regression import Regression
from inputdesign_cli.design.regression.periodic import PeriodicDesign, design_periodic
from inputdesign_cli.plant.polynomial import Array
from inputdesign_cli.signal import delayed_regressors, free_regressors, periodic_input, rank
from inputdesign_cli.specification import Spec


@dataclass(frozen=True)
class RegressorRecord:
    """Phi (N, n), the signals to apply (N, n), or (N, 1) for delayed copies of one, and their description."""

    Phi: NDArray[np.float64]
    channels: NDArray[np.float64]
    entry: dict[str, Any]
    line_frequency: Array | None = None
    line_power: Array | None = None


def realise_regressors(
    spec: Spec, regression: Regression, R: Array, rho: Array | None, target: float | None
) -> RegressorRecord | None:
    """The record that the spec asks for; None when it is too short for any.

    Raises:
        SpecError: `bad-period` when signal.periods does not fit.
    """
    samples = spec.signal_samples
    if rho is None:
        return _free(spec, regression, R, samples)
    return _delayed(spec, regression, R, rho, samples, target)


def _free(spec: Spec, regression: Regression, R: Array, samples: int) -> RegressorRecord | None:
    directions = rank(R)
    if samples < directions:
        return None
    period = _period(spec, samples, directions)
    if period is None:
        period = directions if samples % directions == 0 else samples
    Phi = free_regressors(R, samples, period)
    entry = _entry(regression, Phi, Phi, R) | {"period": period}
    return RegressorRecord(Phi, Phi, entry)


def _delayed(
    spec: Spec, regression: Regression, R: Array, rho: Array, samples: int, target: float | None
) -> RegressorRecord | None:
    if samples < regression.n:
        return None
    period = _period(spec, samples, regression.n) or samples
    found: PeriodicDesign = design_periodic(regression, rho, float(np.trace(R)), period, target=target)
    power = found.energy / (regression.n * samples)
    u = periodic_input(found.shares, power, samples, period, np.random.default_rng(spec.signal.seed or 0))
    start = spec.signal.start or "steady"
    Phi = delayed_regressors(u, regression.n, start)
    from_rest = delayed_regressors(u, regression.n, "zero")
    entry = _entry(regression, Phi, u[:, None], R) | {
        "period": period,
        "start": start,
        "on_grid": found.exact,
    }
    entry["from_rest"] = _attained(regression, from_rest, R)
    used = np.flatnonzero(found.shares > 0.0)
    return RegressorRecord(Phi, u[:, None], entry, 2.0 * np.pi * used / period, found.shares[used] * power)


def _period(spec: Spec, samples: int, least: int) -> int | None:
    periods = spec.signal.periods
    if periods is None:
        return None
    if samples % periods or samples // periods < least:
        raise spec.complain(
            "bad-period",
            f"{samples} samples do not make {periods} equal periods of at least {least} samples",
            hint=f"choose a divisor of {samples} up to {samples // least}, or change signal.samples",
            key="signal.periods",
        )
    return samples // periods


def _entry(regression: Regression, Phi: Array, channels: Array, R: Array) -> dict[str, Any]:
    power = np.mean(channels**2, axis=0)
    peak = np.abs(channels).max(axis=0)
    crest = np.divide(peak, np.sqrt(power), out=np.ones_like(peak), where=power > 0.0)
    return {
        "samples": Phi.shape[0],
        "power": power.tolist(),
        "peak": peak.tolist(),
        "crest_factor": crest.tolist(),
        **_attained(regression, Phi, R),
    }


def _attained(regression: Regression, Phi: Array, R: Array) -> dict[str, Any]:
    """Energy and error of the Gram matrix of these samples, and its distance to R."""
    G = Phi.T @ Phi
    split = regression.error(G)
    attained: dict[str, Any] = {
        "energy": float(np.trace(G)),
        "moments_error": float(np.abs(G - R).max() / np.abs(R).max()),
    }
    if np.isfinite(split.total):
        attained["mean_squared_error"] = split.total
    return attained
