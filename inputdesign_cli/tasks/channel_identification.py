"""Spec and data -> an estimate of `plant` and `noise` with several channels, ready to paste."""

from __future__ import annotations

import json
import time
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np

from inputdesign_cli.accuracy import worst_violation
from inputdesign_cli.design.convex.problem import RequirementFactory
from inputdesign_cli.identification import ChannelEstimate
from inputdesign_cli.information import FiniteRecord
from inputdesign_cli.plant import ChannelModel
from inputdesign_cli.runs.results import (
    BoundCurves,
    FitCurves,
    FitPanel,
    ResidualCurves,
    Results,
    Table,
)
from inputdesign_cli.specification import Spec, parse_spec
from inputdesign_cli.tasks.build.channel_requirements import build_entry_errors, unstated_errors
from inputdesign_cli.tasks.build.channel_task import channel_requirements, with_prior
from inputdesign_cli.tasks.build.channels import (
    build_channel_model,
    channel_experiment,
    frequency_unit,
    record_step,
)
from inputdesign_cli.tasks.build.data import Data, read_channel_data, told_of
from inputdesign_cli.tasks.build.model_error import model_error_alpha
from inputdesign_cli.tasks.channel_estimation import (
    blocks_of,
    estimated,
    moved,
    predictor_of,
)
from inputdesign_cli.tasks.result.channel_curves import bound_curves_of, entry_bound_curves
from inputdesign_cli.tasks.result.estimates import (
    REFUTED,
    estimate_result,
    identification_entry,
    model_notes,
    model_text,
)


@dataclass(frozen=True)
class ChannelIdentified:
    """An estimate, its data, and the spec with the estimate in place of the nominal plant and noise."""

    estimate: ChannelEstimate
    model: ChannelModel
    data: Data
    spec: Spec

    @cached_property
    def experiment(self) -> Any:
        """The experiment of the data on the estimated model, in raw parameters.

        Raises:
            SpecError: the loop is unstable with the estimate.
        """
        return replace(with_prior(self.spec, channel_experiment(self.spec)), samples=len(self.data.y))

    @property
    def frequency_unit(self) -> float:
        """What a frequency of the experiment is divided by to be in rad per time unit."""
        return frequency_unit(self.spec)

    @property
    def entry(self) -> dict[str, Any]:
        """`identification` of `result.json`."""
        estimate = self.estimate
        variance: Any = float(estimate.noise[0, 0]) if estimate.noise.size == 1 else estimate.noise.tolist()
        fit: Any = list(estimate.fit) if len(estimate.fit) > 1 else estimate.fit[0]
        return identification_entry(estimate, variance, fit)

    @property
    def notes(self) -> list[str]:
        """What a user should know of the data, and what speaks against the model."""
        notes = [*self.data.notes, *model_notes(self.estimate, predictor_of(self.model))]
        tests = self.estimate.whiteness, self.estimate.independence
        if self.model.continuous and min(test.probability for test in tests) < REFUTED:
            notes.append(
                "the input was taken for the band-limited interpolation of its samples; where it is held "
                "between them, write plant.sample: zoh"
            )
        return notes

    def requirements(self) -> list[RequirementFactory]:
        """What the spec asks for, at the estimate."""
        return channel_requirements(self.spec, self.experiment)

    def outcome(self, spec: Spec, started: float) -> Results:
        """What `idesign identify` writes."""
        result = estimate_result(spec.title, len(self.data.y), self.estimate, self.entry)
        tables, curves = _data_curves(spec, self)
        tables["bound"], curves["bound"], result["model_error"] = _bound(self)
        if self.notes:
            result["notes"] = self.notes
        result["timing_s"] = {"identification": time.perf_counter() - started}
        files = {"model.yaml": model_text(blocks_of(self.model), self.estimate).encode()}
        return Results(result, spec.to_yaml(), spec.time_unit, tables, curves, files)


def channels_identified(spec: Spec, path: Path, *, remove_means: bool = False) -> ChannelIdentified:
    """The estimate from the data in `path`; the nominal parameters are one of the starts.

    Raises:
        SpecError: the spec has no such model.
        DataError: the file cannot be used, or the data do not determine the parameters.
    """
    nominal = build_channel_model(spec)
    step = record_step(spec)
    data = read_channel_data(spec, path, remove_means=remove_means)
    with told_of(path):
        estimate = estimated(nominal, data.u, data.y, step, nominal.theta, feedback=spec.closed_loop)
    model = moved(nominal, estimate.theta, estimate.noise)
    replaced = parse_spec(
        spec.to_yaml(),
        file=f"{path.name} (estimate)",
        overrides=[f"{key}={json.dumps(block)}" for key, block in blocks_of(model).items()],
        folder=spec.resolve_path("."),
    )
    return ChannelIdentified(estimate, model, data, replaced)


def _data_curves(spec: Spec, found: ChannelIdentified) -> tuple[dict[str, Table], dict[str, Any]]:
    """fit.csv and residuals.csv with their figures."""
    estimate, u, y = found.estimate, found.data.u, found.data.y
    instants = spec.sample_time * np.arange(len(y), dtype=np.float64)
    predicted = y - estimate.errors
    stable = [fit is not None for fit in estimate.fit]
    open_loop = replace(found.experiment, loop=None)
    plant = FiniteRecord(open_loop, len(u), record_step(spec))
    simulated = plant.signals("output", u) if any(stable) else None
    columns = {f"time_{spec.time_unit}": instants, **_columns("u{}", u), **_columns("y{}", y)}
    columns |= _columns("y{}_predicted", predicted)
    outputs = []
    for i, fit in enumerate(estimate.fit):
        curve = simulated[:, i] if simulated is not None and stable[i] else None
        if curve is not None:
            columns[f"y{i + 1}_simulated"] = curve
        outputs.append(FitPanel(y[:, i], predicted[:, i], curve, fit, i))
    columns |= _columns("residual_{}", estimate.errors)
    white, cross = estimate.whiteness, estimate.independence
    shared = min(white.lags.size, cross.lags.size)
    residuals = {"autocorrelation_lag": white.lags[:shared]}
    residuals |= _pairs("autocorrelation", white.correlation[:shared])
    residuals |= {"cross_correlation_lag": cross.lags[:shared]}
    residuals |= _pairs("cross_correlation", cross.correlation[:shared])
    curves: dict[str, Any] = {
        "fit": FitCurves(instants, tuple(outputs)),
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


def _columns(name: str, values: np.ndarray) -> dict[str, np.ndarray]:
    return {name.format(i + 1): column for i, column in enumerate(values.T)}


def _pairs(name: str, values: np.ndarray) -> dict[str, np.ndarray]:
    _, rows, columns = values.shape
    return {f"{name}_{i + 1}{j + 1}": values[:, i, j] for i in range(rows) for j in range(columns)}


def _bound(found: ChannelIdentified) -> tuple[Table, BoundCurves, dict[str, Any]]:
    spec, experiment, information = found.spec, found.experiment, found.estimate.information
    entry: dict[str, Any] = {"alpha": model_error_alpha(spec, experiment)}
    stated = build_entry_errors(spec, experiment)
    if stated:
        violations = [worst_violation(error, information) for error in stated]
        violation = max(violations, key=lambda v: v.ratio)
        entry["worst_ratio"] = violation.ratio
        if violation.frequency is not None:
            entry["worst_frequency"] = violation.frequency / found.frequency_unit
    table, curves = bound_curves_of(spec, stated, information, None, label="data") or entry_bound_curves(
        spec, unstated_errors(spec, experiment), information, None, stated=False, label="data"
    )
    return table, curves, entry
