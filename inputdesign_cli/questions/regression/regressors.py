"""Make the regressors of an experiment from their moments, with the error that these samples give."""

from __future__ import annotations

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
    """The length of the record, its number of equal periods (None: free), its past, and the seed."""

    samples: int
    periods: int | None
    start: Start
    seed: int

    def period(self, least: int) -> int | None:
        """Return the samples of a period, `least` or more; None if no periods are asked for.

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
class RegressorRecord:
    """Phi (N, n), the signals to apply (N, n), or (N, 1) for delayed copies of one, and their description.

    `lines` of one periodic input are its frequencies (L,) in rad/sample and mean squares (L,).
    """

    Phi: NDArray[np.float64]
    channels: NDArray[np.float64]
    signal: Signal
    lines: tuple[Array, Array] | None = None


def realise_regressors(
    settings: RegressorSettings, regression: Regression, R: Array, rho: Array | None, target: float | None
) -> RegressorRecord | None:
    """Return the record that is asked for; None when it is too short for any.

    Args:
        R: (n, n) moments summed over the samples.
        rho: (n,) autocorrelations of one input, of which the regressors are delayed copies; None: free ones.
        target: the error that is allowed, if the energy is what counts.

    Raises:
        SpecError: `bad-period` when signal.periods does not fit.
    """
    samples, least = settings.samples, rank(R) if rho is None else regression.n
    if samples < least:
        return None
    period, details, lines = settings.period(least), dict[str, object](), None
    if rho is None:
        period = period or (least if samples % least == 0 else samples)
        Phi = channels = free_regressors(R, samples, period)
    else:
        period = period or samples
        found = design_periodic(regression, rho, float(np.trace(R)), period, target=target)
        power = found.energy / (least * samples)
        u = periodic_input(found.shares, power, samples, period, np.random.default_rng(settings.seed))
        Phi, channels = delayed_regressors(u, least, settings.start), u[:, None]
        at_rest = _attained(regression, delayed_regressors(u, least, "zero"), R)
        details = {"start": settings.start, "on_grid": found.exact, "from_rest": at_rest}
        used = np.flatnonzero(found.shares > 0.0)
        lines = 2.0 * np.pi * used / period, found.shares[used] * power
    attained = _attained(regression, Phi, R)
    error = attained.pop("mean_squared_error", None)
    details = {**attained, "period": period, **details}
    signal = replace(signal_of(channels), details=details, mean_squared_error=error)
    return RegressorRecord(Phi, channels, signal, lines)


def _attained(regression: Regression, Phi: Array, R: Array) -> dict[str, float]:
    """Return the energy of the Gram matrix of these samples, its distance to R, and the error if finite."""
    G = Phi.T @ Phi
    found = {"energy": float(np.trace(G)), "moments_error": float(np.abs(G - R).max() / np.abs(R).max())}
    error = regression.error(G).total
    return {**found, "mean_squared_error": error} if np.isfinite(error) else found
