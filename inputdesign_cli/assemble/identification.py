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

from inputdesign_cli.accuracy import error_bound
from inputdesign_cli.assemble.curves import axis, frequency_header
from inputdesign_cli.assemble.data import Data, read_data
from inputdesign_cli.assemble.experiment import build_experiment
from inputdesign_cli.assemble.model_error import build_model_error, model_error_alpha, sampled_band
from inputdesign_cli.errors import IdesignError
from inputdesign_cli.identification import Estimate, ResidualTest, Structure
from inputdesign_cli.identification import identify as identify_record
from inputdesign_cli.information import Experiment
from inputdesign_cli.outcome import BoundCurves, FitCurves, Outcome, ResidualCurves, Table
from inputdesign_cli.plant.polynomial import Array, roots_in_z
from inputdesign_cli.spec import Spec, parse_spec

# A residual test below this probability speaks against the model.
_REFUTED = 0.01


@dataclass(frozen=True)
class Identified:
    """An estimate, its data, and the spec with the estimate in place of the nominal plant and noise."""

    estimate: Estimate
    data: Data
    spec: Spec
    experiment: Experiment


def identify(spec: Spec, data: str | Path, *, remove_means: bool = False) -> Outcome:
    """Estimate the model whose structure `plant` and `noise` give from a recorded experiment.

    Raises:
        SpecError: the plant is not supported, or the data do not determine the parameters.
        DataError: the file cannot be used.
    """
    try:
        started = time.perf_counter()
        found = identified(spec, Path(data), remove_means=remove_means)
        return identification_outcome(spec, found, started)
    except IdesignError as error:
        raise spec.place(error) from error


def identified(spec: Spec, path: Path, *, remove_means: bool = False) -> Identified:
    """The estimate from the data in `path`; the nominal parameters are one of the starts."""
    nominal = build_experiment(spec)
    data = read_data(spec, path, remove_means=remove_means)
    structure = Structure.of(nominal.model)
    estimate = identify_record(structure, data.u, data.y, start=nominal.model.theta)
    replaced = parse_spec(
        spec.to_yaml(),
        file=f"{path.name} (estimate)",
        overrides=[f"{key}={json.dumps(block)}" for key, block in blocks(spec, estimate).items()],
        folder=spec.resolve_path("."),
    )
    return Identified(estimate, data, replaced, build_experiment(replaced))


def blocks(spec: Spec, estimate: Estimate) -> dict[str, dict[str, Any]]:
    """`plant` and `noise` of the estimate in the words of the spec; polynomials that are 1 are left out."""
    model = estimate.model
    plant = {"A": model.A, "B": model.B, "F": model.F}
    noise = {"C": model.C, "D": model.D}

    def plain(polynomials: Mapping[str, Array]) -> dict[str, Any]:
        return {name: p.tolist() for name, p in polynomials.items() if name == "B" or p.size > 1}

    return {"plant": plain(plant), "noise": {**plain(noise), "variance": model.variance}}


def identification_outcome(spec: Spec, found: Identified, started: float) -> Outcome:
    """What `idesign identify` writes."""
    estimate = found.estimate
    deviations = np.sqrt(np.diag(estimate.covariance))
    result: dict[str, Any] = {
        "format": 1,
        "title": spec.title,
        "status": "identified" if estimate.converged else "not_converged",
        "samples": int(found.data.y.size),
        "identification": identification_entry(estimate),
        "information": {
            "parameters": list(estimate.names),
            "matrix": estimate.information,
            "covariance": estimate.covariance,
            "standard_deviation": dict(zip(estimate.names, deviations.tolist(), strict=True)),
        },
    }
    tables, curves = data_curves(spec, found)
    tables["bound"], curves["bound"], result["model_error"] = _bound(found)
    notes = [*found.data.notes, *model_notes(estimate)]
    if notes:
        result["notes"] = notes
    result["timing_s"] = {"identification": time.perf_counter() - started}
    files = {"model.yaml": model_text(spec, found).encode()}
    return Outcome(result, spec.to_yaml(), spec.time_unit, tables, curves, files)


def identification_entry(estimate: Estimate) -> dict[str, Any]:
    """`identification` of `result.json`."""
    entry: dict[str, Any] = {
        "theta": dict(zip(estimate.names, estimate.theta.tolist(), strict=True)),
        "standard_deviation": dict(
            zip(estimate.names, np.sqrt(np.diag(estimate.covariance)).tolist(), strict=True)
        ),
        "variance": estimate.variance,
        "converged": estimate.converged,
        "steps": estimate.steps,
        "starts": estimate.starts,
        "whiteness": _test(estimate.whiteness),
        "independence": _test(estimate.independence),
    }
    if estimate.fit is not None:
        entry["fit_percent"] = estimate.fit
    return entry


def _test(test: ResidualTest) -> dict[str, Any]:
    return {
        "statistic": test.statistic,
        "degrees_of_freedom": test.freedom,
        "probability": test.probability,
    }


def model_notes(estimate: Estimate) -> list[str]:
    """What speaks against trusting the estimate."""
    notes = []
    if not estimate.converged:
        notes.append(
            f"the search did not settle after {estimate.steps} steps from the best of {estimate.starts} "
            "starts: the estimate may be far from the minimum; the orders may be too high for these data"
        )
    at_the_edge = [
        letter
        for letter in "CDF"
        if np.any(np.abs(roots_in_z(getattr(estimate.model, letter))) > 1.0 - 1.0 / estimate.errors.size)
    ]
    if at_the_edge:
        notes.append(
            f"{' and '.join(at_the_edge)} has a root on the unit circle, as far as {estimate.errors.size} "
            "samples can tell: the covariance is not to be trusted there, and a design on this model would "
            "count on noise that vanishes or never fades; take more data, or a lower order"
        )
    if estimate.whiteness.probability < _REFUTED:
        notes.append(
            f"the residuals are not white (probability {estimate.whiteness.probability:.1e}): the noise has "
            "more structure than the model, and the covariance is not to be trusted; raise the orders of C "
            "and D (or A)"
        )
    if estimate.independence.probability < _REFUTED:
        notes.append(
            f"past inputs explain residuals (probability {estimate.independence.probability:.1e}): the plant "
            "has more structure than the model, or another delay; raise the orders of B and F (or A)"
        )
    deviations = np.sqrt(np.diag(estimate.covariance))
    vague = [n for n, v, s in zip(estimate.names, estimate.theta, deviations, strict=True) if s > abs(v)]
    if vague:
        notes.append(f"zero lies within a standard deviation of {', '.join(vague)}: an order may be too high")
    return notes


def model_text(spec: Spec, found: Identified) -> str:
    """The blocks to paste, with the covariance and, as a comment, the same as prior information."""
    estimate = found.estimate
    given = blocks(spec, estimate)
    lines = [f"# Estimated from {found.data.y.size} samples; paste in place of the blocks of the same names."]
    for key, block in given.items():
        lines += [f"{key}:", *(f"  {name}: {json.dumps(value)}" for name, value in block.items())]
    names = ", ".join(estimate.names)
    lines += [
        "",
        f"# Covariance of {names}:",
        *(f"#   {json.dumps(row)}" for row in estimate.covariance.tolist()),
        "",
        "# To count these data as prior information of the next experiment, uncomment:",
        "# experiment:",
        "#   prior:",
        f"#     parameters: [{names}]",
        "#     information:",
        *(f"#       - {json.dumps(row)}" for row in estimate.information.tolist()),
    ]
    return "\n".join(lines) + "\n"


def data_curves(spec: Spec, found: Identified) -> tuple[dict[str, Table], dict[str, Any]]:
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
        "fit": FitCurves(instants, data.y, predicted, simulated, estimate.fit),
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
        worst = max(stated.violations(found.estimate.information), key=lambda v: v.ratio)
        entry["worst_ratio"] = worst.ratio
        if worst.frequency is not None:
            entry["worst_frequency"] = worst.frequency / spec.sample_time
    G = np.abs(experiment.model.plant_at(w))
    columns["G_abs"] = G
    curves = BoundCurves(frequency=w / spec.sample_time, r_u=r_u, G_abs=G, r_adm=r_adm, label="data")
    return Table(columns), curves, entry


def experiment_peaks(experiment: Experiment) -> Array:
    """Frequencies (rad/sample) about the resonances of the plant, so that a figure shows their peaks."""
    poles = experiment.singularities
    near = poles[np.abs(poles.imag) < 0.3]
    offsets = np.linspace(-3.0, 3.0, 31)
    w = np.abs(near.real)[:, None] + np.abs(near.imag)[:, None] * offsets
    return np.clip(w.ravel(), 0.0, np.pi)
