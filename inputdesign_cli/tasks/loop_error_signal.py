"""The record that realises a design for the closed-loop error."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from inputdesign_cli.plant.polynomial import Array
from inputdesign_cli.signal.matrix_factor import matrix_factor
from inputdesign_cli.signal.rational import rational_filter
from inputdesign_cli.signal.tabulated_multisine import lines_of, matrix_multisine, periodogram_masses
from inputdesign_cli.specification import Spec
from inputdesign_cli.tasks.loop_error_design import ClosedLoopDesign

_CANDIDATES = 20


@dataclass(frozen=True)
class ClosedLoopSignal:
    """The samples (n, N), what made them, and what is worth reporting of how well they serve."""

    samples: Array
    method: str
    details: dict[str, Any]


def realise_closed_loop(spec: Spec, design: ClosedLoopDesign) -> ClosedLoopSignal:
    """The best of several records by the error that their own samples give, scaled into the limits.

    Raises:
        SpecError: for a filter of a design that consists of lines.
    """
    samples = spec.signal_samples
    details: dict[str, Any] = {}
    n = design.problem.plant.inputs
    if spec.signal.type == "filtered_noise":
        make, details = _by_filter(spec, design, samples)
        method = "filtered_noise"
    else:
        method = "multisine"
        periods = _periods(spec, samples, n)
        masses = design.masses(samples // periods)
        details["periods"] = periods

        def make(rng: np.random.Generator) -> Array:
            return matrix_multisine(masses, samples, rng, periods=periods)

    best, value = None, np.inf
    for stream in np.random.SeedSequence(spec.signal.seed or 0).spawn(spec.signal.candidates or _CANDIDATES):
        u = _within_limits(design, make(np.random.default_rng(stream)))
        try:
            M = design.criterion.information(
                lines_of(samples), periodogram_masses(u), np.ones(samples // 2 + 1)
            )
            attained = design.criterion.value(M)
        except np.linalg.LinAlgError:  # too short to excite every parameter
            attained = np.inf
        if best is None or attained < value:
            best, value = u, attained
    assert best is not None
    if np.isfinite(value):
        details["parametric_value"] = value
    return ClosedLoopSignal(best, method, details)


def _periods(spec: Spec, samples: int, n: int) -> int:
    """Blocks of the multisine: as many as inputs where the record can be split so, or as asked."""
    if spec.signal.periods is not None:
        if samples % spec.signal.periods:
            raise spec.complain(
                "conflicting-keys",
                f"{samples} samples do not make {spec.signal.periods} equal periods",
                hint="choose a divisor of the number of samples",
                key="signal.periods",
            )
        return spec.signal.periods
    return n if samples % n == 0 else 1


def _by_filter(
    spec: Spec, design: ClosedLoopDesign, samples: int
) -> tuple[Callable[[np.random.Generator], Array], dict[str, Any]]:
    if design.lines is not None:
        raise spec.complain(
            "not-supported",
            "this version makes multisines of a parametric design, which consists of lines",
            hint="write type: multisine, or covariance: asymptotic",
            key="signal.type",
        )
    factor = matrix_factor(design.density)
    details: dict[str, Any] = {"spectral_factor_residual": factor.residual, "floor": factor.floor}
    if spec.signal.order is None:
        details["taps"] = int(factor.taps.shape[0])
        return lambda rng: factor.filtered(samples, rng), details
    filter_ = rational_filter(factor.taps, spec.signal.order)
    wanted = float(np.trace(design.covariance("input")))
    filter_ = filter_.scaled(float(np.sqrt(wanted / filter_.power().sum())))
    nodes, weights = design.rule.nodes, design.rule.weights
    M = design.criterion.information(nodes, filter_.spectrum(nodes), weights)
    details |= {
        "order": filter_.order,
        "pole_radius": filter_.radius,
        "filter_value": design.criterion.value(M),
        "filter": {"A": filter_.A, "B": filter_.B, "C": filter_.C, "D": filter_.D},
    }
    return lambda rng: filter_.filtered(samples, rng), details


def _within_limits(design: ClosedLoopDesign, u: Array) -> Array:
    """The record times the factor that brings it to its limits, by its own spectrum."""
    samples = u.shape[1]
    masses = periodogram_masses(u)
    metrics = design.problem.metrics(lines_of(samples))
    powers = np.einsum("pkab,kba->p", metrics, masses).real
    return np.asarray(u / np.sqrt(np.max(powers / design.problem.most)))
