"""Tables and curves of an estimate: its fit, its residuals, and its error bound."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from inputdesign_cli.accuracy import worst
from inputdesign_cli.accuracy.model_error import OnModelError
from inputdesign_cli.arrays import Array
from inputdesign_cli.identification import Estimate
from inputdesign_cli.outcome import ModelError as Bound
from inputdesign_cli.outcome.curves import BoundCurves, Curves, FitCurves, FitPanel, ResidualCurves
from inputdesign_cli.outcome.results import Table
from inputdesign_cli.outcome.units import Units
from inputdesign_cli.questions.common.bound import Informed
from inputdesign_cli.questions.common.confidence import Confidence


def data_curves(
    units: Units, u: Array, y: Array, estimate: Estimate
) -> tuple[dict[str, Table], dict[str, Curves]]:
    """Return fit.csv and residuals.csv with their figures.

    Args:
        u, y: the records, (samples, r) and (samples, p).
    """
    instants = units.sample_time * np.arange(len(y), dtype=np.float64)
    predicted = y - estimate.errors
    columns = {units.time_header: instants}
    if len(estimate.lengths) > 1:
        columns["record"] = np.repeat(np.arange(1.0, len(estimate.lengths) + 1), estimate.lengths)
    columns |= {**_columns(units, "u", u), **_columns(units, "y", y)}
    columns |= _columns(units, "y", predicted, "_predicted")
    panels = []
    for i, fit in enumerate(estimate.simulation.fit):
        curve = None if fit is None else estimate.simulation.outputs[:, i]
        if curve is not None:
            columns[f"y{_number(units, i)}_simulated"] = curve
        panels.append(FitPanel(y[:, i], predicted[:, i], curve, fit, i, units.label(f"y{i + 1}")))
    columns |= _columns(units, "residual" if units.single else "residual_", estimate.errors)
    white, cross = estimate.tests.whiteness, estimate.tests.independence
    shared = min(white.lags.size, cross.lags.size)
    residuals = {"autocorrelation_lag": white.lags[:shared]}
    residuals |= _pairs(units, "autocorrelation", white.correlation[:shared])
    residuals |= {"cross_correlation_lag": cross.lags[:shared]}
    residuals |= _pairs(units, "cross_correlation", cross.correlation[:shared])
    curves: dict[str, Curves] = {
        "fit": FitCurves(instants, tuple(panels), tuple(estimate.lengths)),
        "residuals": ResidualCurves(
            white.lags,
            white.correlation,
            cross.lags,
            cross.correlation,
            white.limit,
            white.probability,
            cross.probability,
        ),
    }
    return {"fit": Table(columns), "residuals": Table(residuals)}, curves


def bound_of_data(
    units: Units, confidence: Confidence, errors: Sequence[OnModelError], *, asked: bool, information: Array
) -> tuple[Table, BoundCurves, Bound]:
    """Return bound.csv with its figure, and the worst ratio of r_u and r_adm if a requirement bounds it.

    Args:
        errors: what has r_u; `asked` says whether requirements state r_adm.
        information: (k, k) of the data.
    """
    bound = Bound(confidence.alpha, confidence=confidence.reported)
    if asked:
        violation = worst([error.worst(information) for error in errors])
        frequency = violation.frequency
        bound = replace(
            bound,
            worst_ratio=violation.ratio,
            worst_frequency=None if frequency is None else frequency / units.frequency,
        )
    table, curves = Informed(units, errors, information, asked, label="data").bound()
    return table, curves, bound


def _number(units: Units, channel: int) -> str:
    return "" if units.single else f"{channel + 1}"


def _columns(units: Units, name: str, values: Array, of: str = "") -> dict[str, Array]:
    return {f"{name}{_number(units, i)}{of}": column for i, column in enumerate(values.T)}


def _pairs(units: Units, name: str, values: Array) -> dict[str, Array]:
    _, rows, columns = values.shape
    return {f"{name}{units.suffix(i, j)}": values[:, i, j] for i in range(rows) for j in range(columns)}
