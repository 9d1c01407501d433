"""Moments -> the regressors of a regression experiment, and what these very samples give."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from inputdesign_cli.arrays import Array
from inputdesign_cli.design.regression import Regression
from inputdesign_cli.design.regression.periodic import design_periodic
from inputdesign_cli.errors import bad_spec
from inputdesign_cli.outcome import Signal
from inputdesign_cli.questions.common.plain_signal import signal_of
from inputdesign_cli.signal import delayed_regressors, free_regressors, periodic_input, rank
from inputdesign_cli.signal.moments import Start


@dataclass(frozen=True)
class RegressorSettings:
    """Length of the record, its number of equal periods (None: as suits), its past, and the seed."""

    samples: int
    periods: int | None
    start: Start
    seed: int

    def period(self, least: int) -> int | None:
        """Samples a period, at least so many; None where no periods are asked for.

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
class PowerLines:
    """Lines of one periodic input: frequencies (L,) in rad/sample and mean squares (L,)."""

    frequencies: Array
    powers: Array


@dataclass(frozen=True)
class RegressorRecord:
    """Phi (N, n), the signals to apply (N, n), or (N, 1) for delayed copies of one, and their description."""

    Phi: NDArray[np.float64]
    channels: NDArray[np.float64]
    signal: Signal
    lines: PowerLines | None = None


def realise_regressors(
    settings: RegressorSettings, regression: Regression, R: Array, rho: Array | None, target: float | None
) -> RegressorRecord | None:
    """The record that is asked for; None when it is too short for any.

    Args:
        R: (n, n) moments summed over the samples.
        rho: (n,) autocorrelations of one input, of which the regressors are delayed copies; None: free ones.
        target: the error that is allowed, if the energy is what counts.

    Raises:
        SpecError: `bad-period` when signal.periods does not fit.
    """
    if rho is None:
        return _free(settings, regression, R)
    return _delayed(settings, regression, R, rho, target)


def _free(settings: RegressorSettings, regression: Regression, R: Array) -> RegressorRecord | None:
    samples, directions = settings.samples, rank(R)
    if samples < directions:
        return None
    period = settings.period(directions)
    if period is None:
        period = directions if samples % directions == 0 else samples
    Phi = free_regressors(R, samples, period)
    details = {**_attained(regression, Phi, R), "period": period}
    return RegressorRecord(Phi, Phi, _with_error(signal_of(Phi), regression, Phi, details))


def _delayed(
    settings: RegressorSettings, regression: Regression, R: Array, rho: Array, target: float | None
) -> RegressorRecord | None:
    samples, n = settings.samples, regression.n
    if samples < n:
        return None
    period = settings.period(n) or samples
    found = design_periodic(regression, rho, float(np.trace(R)), period, target=target)
    power = found.energy / (n * samples)
    u = periodic_input(found.shares, power, samples, period, np.random.default_rng(settings.seed))
    Phi = delayed_regressors(u, n, settings.start)
    rest = delayed_regressors(u, n, "zero")
    details = {
        **_attained(regression, Phi, R),
        "period": period,
        "start": settings.start,
        "on_grid": found.exact,
        "from_rest": {**_attained(regression, rest, R), **_error(regression, rest)},
    }
    signal = _with_error(signal_of(u[:, None]), regression, Phi, details)
    used = np.flatnonzero(found.shares > 0.0)
    lines = PowerLines(2.0 * np.pi * used / period, found.shares[used] * power)
    return RegressorRecord(Phi, u[:, None], signal, lines)


def _attained(regression: Regression, Phi: Array, R: Array) -> dict[str, object]:
    """Return the energy of the Gram matrix of these samples, and its distance to R."""
    G = Phi.T @ Phi
    return {"energy": float(np.trace(G)), "moments_error": float(np.abs(G - R).max() / np.abs(R).max())}


def _error(regression: Regression, Phi: Array) -> dict[str, float]:
    """Return the error of these samples where it is finite."""
    total = regression.error(Phi.T @ Phi).total
    return {"mean_squared_error": total} if np.isfinite(total) else {}


def _with_error(signal: Signal, regression: Regression, Phi: Array, details: Mapping[str, object]) -> Signal:
    """Return the signal with its details and the error of its samples."""
    error = _error(regression, Phi).get("mean_squared_error")
    return replace(signal, details=details, mean_squared_error=error)
