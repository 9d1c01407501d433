"""Spec and data -> an estimate of `plant` and `noise`, ready to paste."""

from __future__ import annotations

import json
import time
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import scipy.signal

from inputdesign_cli.accuracy import error_bound, worst_violation
from inputdesign_cli.design.convex.problem import RequirementFactory
from inputdesign_cli.errors import IdesignError
from inputdesign_cli.identification import Estimate, Structure
from inputdesign_cli.identification import identify as identify_record
from inputdesign_cli.information import Experiment
from inputdesign_cli.plant.polynomial import Array
from inputdesign_cli.runs.results import (
    BoundCurves,
    BoundPanel,
    FitCurves,
    FitPanel,
    ResidualCurves,
    Results,
    Table,
)
from inputdesign_cli.specification import Spec, parse_spec
from inputdesign_cli.tasks.build.channels import has_channels
from inputdesign_cli.tasks.build.data import Data, read_data, told_of
from inputdesign_cli.tasks.build.experiment import build_experiment
from inputdesign_cli.tasks.build.model_error import build_model_error, model_error_alpha, sampled_band
from inputdesign_cli.tasks.build.requirements import build_requirements
from inputdesign_cli.tasks.channel_identification import ChannelIdentified, channels_identified
from inputdesign_cli.tasks.result.curves import axis, frequency_header
from inputdesign_cli.tasks.result.estimates import (
    Blocks,
    estimate_result,
    identification_entry,
    model_notes,
    model_text,
)


@dataclass(frozen=True)
class Identified:
    """An estimate, its data, and the spec with the estimate in place of the nominal plant and noise."""

    estimate: Estimate
    data: Data
    spec: Spec
    experiment: Experiment

    @property
    def entry(self) -> dict[str, Any]:
        """`identification` of `result.json`."""
        return identification_entry(self.estimate, self.estimate.variance, self.estimate.fit)

    @property
    def notes(self) -> list[str]:
        """What a user should know of the data, and what speaks against the model."""
        model = self.estimate.model
        predictor = {letter: [getattr(model, letter)] for letter in "CDF"}
        return [*self.data.notes, *model_notes(self.estimate, predictor)]

    @property
    def frequency_unit(self) -> float:
        """What a frequency of the experiment is divided by to be in rad per time unit."""
        return self.spec.sample_time

    def requirements(self) -> list[RequirementFactory]:
        """What the spec asks for, at the estimate."""
        spec, experiment = self.spec, self.experiment
        error = build_model_error(spec, experiment) if spec.accuracy.model_error is not None else None
        return build_requirements(spec, experiment, error)

    def outcome(self, spec: Spec, started: float) -> Results:
        """What `idesign identify` writes."""
        estimate = self.estimate
        result = estimate_result(spec.title, self.data.y.size, estimate, self.entry)
        tables, curves = _data_curves(spec, self)
        tables["bound"], curves["bound"], result["model_error"] = _bound(self)
        if self.notes:
            result["notes"] = self.notes
        result["timing_s"] = {"identification": time.perf_counter() - started}
        files = {"model.yaml": model_text(_blocks(estimate), estimate).encode()}
        return Results(result, spec.to_yaml(), spec.time_unit, tables, curves, files)


def identify(spec: Spec, data: str | Path, *, remove_means: bool = False) -> Results:
    """Estimate the model whose structure `plant` and `noise` give from a recorded experiment.

    Raises:
        SpecError: the plant is not supported.
        DataError: the file cannot be used, or the data do not determine the parameters.
    """
    try:
        started = time.perf_counter()
        return identified(spec, Path(data), remove_means=remove_means).outcome(spec, started)
    except IdesignError as error:
        raise spec.place(error) from error


def identified(spec: Spec, path: Path, *, remove_means: bool = False) -> Identified | ChannelIdentified:
    """The estimate from the data in `path`; the nominal parameters are one of the starts.

    Raises:
        SpecError, DataError: see `identify`.
    """
    if has_channels(spec):
        return channels_identified(spec, path, remove_means=remove_means)
    nominal = build_experiment(spec)
    data = read_data(spec, path, remove_means=remove_means)
    structure = Structure.of(nominal.model)
    with told_of(path):
        estimate = identify_record(
            structure, data.u, data.y, start=nominal.model.theta, feedback=spec.closed_loop
        )
    replaced = parse_spec(
        spec.to_yaml(),
        file=f"{path.name} (estimate)",
        overrides=[f"{key}={json.dumps(block)}" for key, block in _blocks(estimate).items()],
        folder=spec.resolve_path("."),
    )
    return Identified(estimate, data, replaced, build_experiment(replaced))


def _blocks(estimate: Estimate) -> Blocks:
    """`plant` and `noise` of the estimate in the words of the spec; polynomials that are 1 are left out."""
    model = estimate.model
    plant = {"A": model.A, "B": model.B, "F": model.F}
    noise = {"C": model.C, "D": model.D}

    def plain(polynomials: Mapping[str, Array]) -> dict[str, Any]:
        return {name: p.tolist() for name, p in polynomials.items() if name == "B" or p.size > 1}

    return {"plant": plain(plant), "noise": {**plain(noise), "variance": model.variance}}


def _data_curves(spec: Spec, found: Identified) -> tuple[dict[str, Table], dict[str, Any]]:
    """fit.csv and residuals.csv with their figures."""
    estimate, data = found.estimate, found.data
    n = data.y.size
    instants = spec.sample_time * np.arange(n, dtype=np.float64)
    predicted = data.y - estimate.errors
    simulated = None
    if estimate.fit is not None:
        model = estimate.model
        simulated = scipy.signal.lfilter(model.B, np.convolve(model.A, model.F), data.u)
    columns = {f"time_{spec.time_unit}": instants, "u": data.u, "y": data.y, "y_predicted": predicted}
    if simulated is not None:
        columns["y_simulated"] = simulated
    columns["residual"] = estimate.errors
    white, cross = estimate.whiteness, estimate.independence
    shared = min(white.lags.size, cross.lags.size)
    tables = {
        "fit": Table(columns),
        "residuals": Table(
            {
                "autocorrelation_lag": white.lags[:shared],
                "autocorrelation": white.correlation[:shared],
                "cross_correlation_lag": cross.lags[:shared],
                "cross_correlation": cross.correlation[:shared],
            }
        ),
    }
    curves = {
        "fit": FitCurves(instants, (FitPanel(data.y, predicted, simulated, estimate.fit),)),
        "residuals": ResidualCurves(
            white.lags,
            white.correlation[:, None, None],
            cross.lags,
            cross.correlation[:, None, None],
            white.limit,
            white.probability,
            cross.probability,
        ),
    }
    return tables, curves


def _bound(found: Identified) -> tuple[Table, BoundCurves, dict[str, Any]]:
    spec, experiment = found.spec, found.experiment
    alpha = model_error_alpha(spec, experiment)
    entry: dict[str, Any] = {"alpha": alpha}
    stated = build_model_error(spec, experiment) if spec.accuracy.model_error is not None else None
    w = axis(*(stated.band if stated is not None else sampled_band(spec, None)), experiment_peaks(experiment))
    r_u = error_bound(experiment, found.estimate.information, alpha, w)
    columns = {frequency_header(spec): w / spec.sample_time, "r_u": r_u}
    r_adm = None
    if stated is not None:
        r_adm = stated.admissible.at(w)
        columns["r_adm"] = r_adm
        worst = worst_violation(stated, found.estimate.information)
        entry["worst_ratio"] = worst.ratio
        if worst.frequency is not None:
            entry["worst_frequency"] = worst.frequency / spec.sample_time
    G = np.abs(experiment.model.plant_at(w))
    columns["G_abs"] = G
    panel = BoundPanel(frequency=w / spec.sample_time, r_u=r_u, G_abs=G, r_adm=r_adm, label="data")
    return Table(columns), BoundCurves((panel,)), entry


def experiment_peaks(experiment: Experiment) -> Array:
    """Frequencies (rad/sample) about the resonances of the plant, so that a figure shows their peaks."""
    poles = experiment.singularities
    near = poles[np.abs(poles.imag) < 0.3]
    offsets = np.linspace(-3.0, 3.0, 31)
    w = np.abs(near.real)[:, None] + np.abs(near.imag)[:, None] * offsets
    return np.clip(w.ravel(), 0.0, np.pi)
