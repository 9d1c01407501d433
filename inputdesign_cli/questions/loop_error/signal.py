"""Make the record that realises a design for the closed-loop error."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from inputdesign_cli.arrays import Array
from inputdesign_cli.design.loop_error import LoopErrorDesign
from inputdesign_cli.outcome import Signal
from inputdesign_cli.questions.common.plain_signal import signal_of
from inputdesign_cli.signal.lines import Lines, grid_lines
from inputdesign_cli.signal.matrix_factor import matrix_factor
from inputdesign_cli.signal.periodic import even_multisine, harmonics, periodogram
from inputdesign_cli.signal.rational import rational_filter


@dataclass(frozen=True)
class LoopErrorSignalSettings:
    """How the record is made.

    Attributes:
        filtered: by a filter from white noise; otherwise it is a multisine of equal `periods`.
        order: of a rational filter, states for each input; None: a filter of taps.
        candidates: records of which the best is taken.
        amplitude, rate: (n,) the largest values of the inputs and their moves, where they are limited.
    """

    samples: int
    filtered: bool
    periods: int
    order: int | None
    candidates: int
    seed: int
    amplitude: Array | None = None
    rate: Array | None = None

    def excess(self, u: Array) -> float:
        """Return the factor by which the power of u (N, n) exceeds the limits on single samples."""
        signals = ((u, self.amplitude), (np.diff(u, axis=0, prepend=0.0), self.rate))
        return max((float(np.max((s / most) ** 2)) for s, most in signals if most is not None), default=0.0)


def realise(design: LoopErrorDesign, settings: LoopErrorSignalSettings) -> tuple[Array, Signal]:
    """Return the best of several records (N, n) by the error that it gives, scaled into the limits."""
    make, residual, details = (_by_filter if settings.filtered else _by_multisine)(design, settings)
    w = harmonics(settings.samples)
    metrics = design.problem.metrics(w)
    best, value = None, np.inf
    for stream in np.random.SeedSequence(settings.seed).spawn(settings.candidates):
        u = make(np.random.default_rng(stream))
        powers = periodogram(u).powers
        # What brings the record to its limits, by its own spectrum.
        excess = np.max(np.einsum("pkab,kba->p", metrics, powers).real / design.problem.most)
        excess = max(float(excess), settings.excess(u))
        try:
            M = design.criterion.information(w, powers / excess, np.ones(w.size))
            attained = design.criterion.value(M)
        except np.linalg.LinAlgError:  # too short to excite every parameter
            attained = np.inf
        if best is None or attained < value:
            best, value = u / np.sqrt(excess), attained
    assert best is not None
    if np.isfinite(value):
        details["parametric_value"] = value
    method = "filtered_noise" if settings.filtered else "multisine"
    return best, replace(signal_of(best), type=method, spectral_factor_residual=residual, details=details)


def design_lines(design: LoopErrorDesign, samples: int) -> Lines:
    """Return the design on the harmonics of a record."""
    if design.of_lines:
        lines = Lines(design.frequencies, design.spectrum)
        return Lines.of_period(lines.dense(samples), samples)
    return grid_lines(design.density(harmonics(samples)), samples, 1.0)


def white_lines(design: LoopErrorDesign, samples: int) -> Lines:
    """Return white noise of the same total power, in the band of the design."""
    return grid_lines(design.white_density(harmonics(samples)), samples, 1.0)


# How a record is drawn, the residual of its spectral factor, and what else is reported of it.
_Made = tuple[Callable[[np.random.Generator], Array], float | None, dict[str, object]]


def _by_multisine(design: LoopErrorDesign, settings: LoopErrorSignalSettings) -> _Made:
    samples, periods = settings.samples, settings.periods
    lines = design_lines(design, samples // periods)
    return lambda rng: even_multisine(lines, samples, rng, periods=periods), None, {"periods": periods}


def _by_filter(design: LoopErrorDesign, settings: LoopErrorSignalSettings) -> _Made:
    samples, factor = settings.samples, matrix_factor(design.density)
    if settings.order is None:
        details: dict[str, object] = {"floor": factor.floor, "taps": int(factor.taps.shape[0])}
        return lambda rng: factor.filtered(samples, rng), factor.residual, details
    filter_ = rational_filter(factor.taps, settings.order)
    wanted = float(np.trace(design.input_covariance))
    filter_ = filter_.scaled(float(np.sqrt(wanted / filter_.power().sum())))
    w, weights = design.frequencies, design.weights
    M = design.criterion.information(w, filter_.spectrum(w), weights)
    found: dict[str, object] = {
        "floor": factor.floor,
        "order": filter_.order,
        "pole_radius": filter_.radius,
        "filter_value": design.criterion.value(M),
        "filter": {"A": filter_.A, "B": filter_.B, "C": filter_.C, "D": filter_.D},
    }
    return lambda rng: filter_.filtered(samples, rng), factor.residual, found
