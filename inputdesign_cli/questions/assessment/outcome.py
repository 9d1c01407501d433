"""The results of an estimate: its entries of `result.json`, model.yaml, tables and curves."""

from __future__ import annotations

import json
import re
from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from inputdesign_cli.accuracy import worst
from inputdesign_cli.accuracy.model_error import OnModelError
from inputdesign_cli.arrays import Array
from inputdesign_cli.findings.frequency_responses import BY_U
from inputdesign_cli.findings.rivals import rival_entries
from inputdesign_cli.identification import (
    Estimate,
    FrequencyResponse,
    ResidualTest,
    Rival,
    ScoreTest,
    frequency_response,
    response_delays,
)
from inputdesign_cli.outcome import Identification, Information, MeasuredLines, ModelError as Bound
from inputdesign_cli.outcome.curves import (
    BoundCurves,
    Curves,
    FitCurves,
    FitPanel,
    ResidualCurves,
    ResponseCurves,
    ResponsePanel,
)
from inputdesign_cli.outcome.estimate import PriorAgreement, Test, variance_of
from inputdesign_cli.outcome.model_words import blocks_of
from inputdesign_cli.outcome.results import Table
from inputdesign_cli.outcome.units import Units
from inputdesign_cli.plant import Model
from inputdesign_cli.questions.common.bound_curves import Informed
from inputdesign_cli.questions.common.confidence import Confidence
from inputdesign_cli.records import Preparation, Record
from inputdesign_cli.specification import is_prior

# A model is far outside a disc if it lies outside by more than this share of |G|.
_FAR = 0.2

# A figure shows deviations of an output if a level above this share of its range was removed.
_LEVEL = 1e-3


def identification_entry(
    estimate: Estimate, preparation: Preparation, ruled_out: Sequence[Rival]
) -> Identification:
    """Return the entry `identification` of `result.json`."""
    single, centred = estimate.noise.size == 1, preparation.detrend == "constant"
    levels = None if centred else dict(preparation.levels)
    return Identification(
        theta=dict(zip(estimate.names, estimate.theta.tolist(), strict=True)),
        standard_deviation=_deviations(estimate),
        variance=variance_of(estimate.noise),
        converged=estimate.search.converged,
        steps=estimate.search.steps,
        starts=estimate.search.starts,
        whiteness=_test(estimate.tests.whiteness),
        independence=_test(estimate.tests.independence),
        tests={test.name: _test(test, test.lag) for test in estimate.tests.all},
        failed=tuple(test.name for test in estimate.tests.failed),
        free_start=estimate.start.free,
        rivals=rival_entries(estimate, estimate.search.rivals) or None,
        ruled_out=rival_entries(estimate, ruled_out) or None,
        prior=None if estimate.prior is None else PriorAgreement(estimate.prior.differing),
        records=tuple(estimate.lengths) if len(estimate.lengths) > 1 else None,
        means_removed=centred or None,
        operating_point=levels or None,
        fit_percent=estimate.simulation.fit[0] if single else tuple(estimate.simulation.fit),
    )


def information_entry(estimate: Estimate) -> Information:
    """Return the entry `information` of `result.json`."""
    return Information(estimate.names, estimate.information, estimate.covariance, _deviations(estimate))


def _deviations(estimate: Estimate) -> dict[str, float]:
    deviations = np.sqrt(np.diag(estimate.covariance))
    return dict(zip(estimate.names, deviations.tolist(), strict=True))


def _test(test: ResidualTest | ScoreTest, lag: int | None = None) -> Test:
    return Test(test.statistic, test.freedom, test.probability, lag)


def determined(estimate: Estimate) -> dict[str, dict[str, float] | list[list[float]]]:
    """Return the entries of a section `estimate`: the parameters, and their covariance if it is definite."""
    values = dict(zip(estimate.names, estimate.theta.tolist(), strict=True))
    covariance = estimate.covariance.tolist()
    return {"parameters": values, **({"covariance": covariance} if is_prior(values, covariance) else {})}


def model_text(units: Units, model: Model, estimate: Estimate) -> str:
    """Return the blocks to paste, with the clock of the data and the prior for a next experiment."""
    lines = [
        f"# Estimated from {len(estimate.errors)} samples: paste in place of the blocks of the same names,",
        "# or write include: and the name of this file in a spec without them.",
        f"sample_time: {units.sample_time!r}",
        f"time_unit: {units.time_unit}",
    ]
    for key, block in blocks_of(model).items():
        lines += [f"{key}:", *(f"  {name}: {json.dumps(value)}" for name, value in block.items())]
    known = determined(estimate)
    lines += [
        "# How far to trust them; a later spec may say experiment: {prior: {information: model.yaml}}.",
        "estimate:",
        f"  parameters: {json.dumps(known['parameters'])}",
    ]
    if "covariance" in known:
        lines += ["  covariance:", *(f"    - {json.dumps(row)}" for row in known["covariance"])]
    else:
        lines += [
            "  # No covariance: it is singular to rounding, for the data do not distinguish some of these.",
            "  # Take more data, or fewer parameters; this file is no prior.",
        ]
    return "\n".join(lines) + "\n"


def fit_of(
    units: Units,
    data: Record,
    errors: Array,
    simulated: Sequence[tuple[float | None, Array]],
    time: Array | None = None,
) -> tuple[dict[str, Array], FitCurves]:
    """Return the columns of fit.csv with its figure, in which files follow each other.

    Args:
        errors: prediction errors (samples, p).
        simulated: the fit of the simulation (or None) and its samples, for every output.
        time: instants of the samples; None: multiples of the sample time.
    """
    even = units.sample_time * np.arange(len(data.y), dtype=np.float64)
    columns = {units.time_header: even if time is None else time}
    if len(data.lengths) > 1:
        columns["record"] = np.repeat(np.arange(1.0, len(data.lengths) + 1), data.lengths)
    columns |= {**_columns(units, "u", data.u), **_columns(units, "y", data.y)}
    columns |= _columns(units, "y", data.y - errors, "_predicted")
    panels = []
    for i, (fit, samples) in enumerate(simulated):
        measured, curve = data.y[:, i], None if fit is None else samples
        if curve is not None:
            columns[f"y{_number(units, i)}_simulated"] = curve
        label = units.label(f"y{i + 1}")
        if data.recorded is not None and label[:1] not in ("", "("):  # a level was taken away
            level = float(np.nanmedian(data.recorded.values[:, data.u.shape[1] + i] - measured))
            label = f"Δ {label}" if abs(level) > _LEVEL * np.ptp(measured) else label
        panels.append(FitPanel(measured, measured - errors[:, i], curve, fit, i, label))
    instants = even if np.any(np.diff(data.time) <= 0.0) else data.time
    return columns, FitCurves(instants, tuple(panels), tuple(data.lengths))


def fit_to_log(fit: FitCurves, log: Record, used: Record) -> FitCurves:
    """Return the fit with the columns of a log as names, and with the samples left out of the estimate.

    Samples of several files are not marked, since their times may be the same.
    """
    rest = ~np.isin(log.time, used.time) & (len(log.files) == 1)
    panels = []
    for panel in fit.panels:
        column = log.names.get(f"y{panel.output + 1}", "")
        label = panel.label or column * (re.fullmatch(r"y?\d*", column) is None)
        panels.append(replace(panel, label=label, left_out=log.y[rest, panel.output] if rest.any() else None))
    return replace(fit, panels=tuple(panels), left_out=log.time[rest])


def data_curves(units: Units, data: Record, estimate: Estimate) -> tuple[dict[str, Table], dict[str, Curves]]:
    """Return fit.csv and residuals.csv with their figures."""
    found = estimate.simulation
    columns, fit = fit_of(units, data, estimate.errors, list(zip(found.fit, found.outputs.T, strict=True)))
    columns |= _columns(units, "residual" if units.single else "residual_", estimate.errors)
    white, cross = estimate.tests.whiteness, estimate.tests.independence
    shared = min(white.lags.size, cross.lags.size)
    residuals = {"autocorrelation_lag": white.lags[:shared]}
    residuals |= _pairs(units, "autocorrelation", white.correlation[:shared])
    residuals |= {"cross_correlation_lag": cross.lags[:shared]}
    residuals |= _pairs(units, "cross_correlation", cross.correlation[:shared])
    correlations = ResidualCurves(
        white.lags,
        white.correlation,
        cross.lags,
        cross.correlation,
        white.limit,
        white.probability,
        cross.probability,
    )
    return {"fit": Table(columns), "residuals": Table(residuals)}, {"fit": fit, "residuals": correlations}


def bound_of_data(
    units: Units, confidence: Confidence, errors: Sequence[OnModelError], *, asked: bool, information: Array
) -> tuple[Table, BoundCurves, Bound]:
    """Return bound.csv with its figure, and the worst ratio of r_u and r_adm if requirements state r_adm."""
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


def response_without_model(
    units: Units, model: Model, data: Record, *, inputs: Sequence[int] | None = None, loop: bool = False
) -> tuple[dict[str, Table], dict[str, Curves], MeasuredLines | None]:
    """Return the frequency response of the data alone beside a model; nothing where it cannot be estimated.

    The reference is used where it differs from u and gives a response, else u alone.

    Args:
        inputs, loop: see `response_of_data`.
    """
    some = list(range(units.inputs)) if inputs is None else list(inputs)
    u, r = data.u[:, some], None if data.r is None else data.r[:, some]
    delays = response_delays(model, max(data.lengths), step=units.step)[:, some]

    for reference in [r, None]:
        if reference is None or not np.any(np.all(reference == u, axis=0)):
            found = frequency_response(u, data.y, reference, lengths=data.lengths, delays=delays)
            if found is not None:
                table, curves, lines = response_of_data(
                    units, model, found, by_reference=reference is not None, inputs=inputs, loop=loop
                )
                return {"frequency_response": table}, {"frequency_response": curves}, lines
    return {}, {}, None


def response_of_data(
    units: Units,
    model: Model,
    found: FrequencyResponse,
    *,
    by_reference: bool,
    inputs: Sequence[int] | None = None,
    loop: bool = False,
) -> tuple[Table, ResponseCurves, MeasuredLines]:
    """Return the table, its figure, and `frequency_response` of the result.

    Args:
        model: the estimate to compare with.
        by_reference: whether the response was estimated from the reference.
        inputs: the inputs (from zero) of `found`; None: all.
        loop: whether the data come from a loop, which the spec need not state.
    """
    w = found.frequency / units.sample_time
    G = model.plant_at(w * units.frequency)
    columns: dict[str, Array] = {units.frequency_header: w}
    panels, outside, far = [], list[NDArray[np.bool_]](), list[NDArray[np.bool_]]()
    for i in range(units.outputs):
        for k, j in enumerate(range(units.inputs) if inputs is None else inputs):
            own, radius, modelled = found.G[:, i, k], found.radius[:, i, k], G[:, i, j]
            listed = {"G_re": own.real, "G_im": own.imag, "G_abs": np.abs(own), "radius": radius}
            listed["model_abs"] = np.abs(modelled)
            columns |= {f"{name}{units.suffix(i, j)}": values for name, values in listed.items()}
            entry = None if units.single else (i, j)
            named = units.passage((i, j))
            panels.append(ResponsePanel(w, own, radius, modelled, entry=entry, names=named))
            apart, size = np.abs(own - modelled), np.maximum(np.abs(own), np.abs(modelled))
            outside.append(apart > radius)
            far.append(apart > radius + _FAR * size)
        number = "" if units.single else f"_{i + 1}"
        columns |= {f"noise_spectrum{number}": found.noise[:, i], f"coherence{number}": found.coherence[:, i]}
    lines = MeasuredLines(
        method=found.method,
        excitation="r" if by_reference else "u",
        frequencies=int(w.size),
        entries=len(panels),
        model_outside=float(np.mean(outside)),
        model_far_outside=float(np.mean(far)),
        caveat=BY_U if (units.closed_loop or loop) and not by_reference else None,
    )
    return Table(columns), ResponseCurves(tuple(panels)), lines
