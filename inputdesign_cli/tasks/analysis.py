"""A given excitation -> what accuracy it buys: nothing is optimised."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from inputdesign_cli.accuracy import Requirement, worst
from inputdesign_cli.information import POWER_KINDS, ChannelExperiment, Experiment, PowerKind
from inputdesign_cli.plant.polynomial import Array
from inputdesign_cli.runs.results import Results, SpectrumCurves, Table
from inputdesign_cli.signal import DesignedSpectrum, Record
from inputdesign_cli.signal.single import as_channels, input_and_output, record_information
from inputdesign_cli.specification import Spec
from inputdesign_cli.specification.models.spectrum import (
    GivenMultisine,
    GivenSignal,
    GivenSpectrum,
    GivenTable,
    GivenWhite,
)
from inputdesign_cli.spectrum import FirBasis, LinesBasis, TabulatedSpectrum
from inputdesign_cli.tasks.build.experiment import read_excitation_record
from inputdesign_cli.tasks.build.given_limits import broken_limits, check_given_limits
from inputdesign_cli.tasks.build.given_table import bad_table, read_spectrum_table
from inputdesign_cli.tasks.build.header import build_units
from inputdesign_cli.tasks.build.signal_settings import build_record_request
from inputdesign_cli.tasks.build.task import Task, build_analysis
from inputdesign_cli.tasks.record import RecordRequest, given_record, worst_ratio
from inputdesign_cli.tasks.result.curves import (
    axis,
    bound_curves,
    density_curves,
    spectrum_curves,
)
from inputdesign_cli.tasks.result.ellipses import experiment_ellipses
from inputdesign_cli.tasks.result.result import information_entry, requirements_entry
from inputdesign_cli.tasks.result.signal import other_files, signal_curves, signal_entry

_TOO_FAINT = 1e-13


@dataclass(frozen=True)
class Excitation:
    """A given excitation: what it is called, its power by kind, and the information matrix that it gives.

    `information` maps an experiment to M (k, k) in its coordinates. A recorded signal has `samples`, the
    others a `basis` and the coefficients `x` on it.
    """

    kind: str
    power: Mapping[PowerKind, list[float]]
    information: Callable[[Experiment], Array]
    basis: FirBasis | LinesBasis | TabulatedSpectrum | None = None
    x: Array | None = None
    samples: Array | None = None


def analyse_given(spec: Spec) -> Results:
    """r_u, information, predicted standard deviations and powers of the excitation under `spectrum.given`.

    Raises:
        SpecError, DataError: the spec or a file that it names cannot be used, or the excitation leaves
            parameters undetermined (`not-exciting`).
    """
    started = time.perf_counter()
    check_given_limits(spec)
    task = build_analysis(spec)
    excitation = read_excitation(spec, task.experiment)
    unit = max(sum(excitation.power["excitation"]), 1e-300)
    experiment = task.experiment.whitened(unit)
    if excitation.samples is not None:
        experiment = replace(experiment, samples=excitation.samples.size)
    information = excitation.information(experiment)
    check_excites(spec, experiment, information)
    requirements = tuple(make(experiment) for make in task.question.requirements)
    cost = sum(weight * sum(excitation.power[kind]) for kind, weight in task.cost.items())
    white = FirBasis(0).integrals(experiment.information_density, experiment.singularities)
    level = cost / _white_cost(experiment, task)
    flat = experiment.baseline_information + level * white[0]
    result = given_result(spec, task, experiment, information, requirements)
    result |= {"cost": cost, "power": excitation.power, "spectrum": _entry(spec, excitation)}
    result["baseline"] = {"white": {"cost": cost, "excitation_power": level}}
    tables: dict[str, Any] = {}
    curves: dict[str, Any] = {}
    tables["bound"], curves["bound"] = bound_curves(
        spec, experiment, task, information, white=flat, active=np.zeros(0)
    )
    ellipses = experiment_ellipses(spec, experiment, information, flat)
    if ellipses is not None:
        curves["ellipses"] = ellipses
    drawn = _spectrum(spec, excitation, level)
    if drawn is not None:
        tables["spectrum"], curves["spectrum"] = drawn
    request, units = build_record_request(spec), build_units(spec)
    record = _record(request, experiment, excitation, worst_ratio(requirements))
    files: dict[str, bytes] = {}
    if record is not None:
        result["signal"] = signal_entry(request, units, as_channels(experiment), record, requirements)
        tables["signal"], curves["signal"] = signal_curves(request, units, record)
        files = other_files(request, units, record)
    notes = broken_limits(spec, experiment.samples, excitation.power, result.get("signal", {}))
    if notes:
        result["notes"] = notes
    result["timing_s"] = {"analysis": time.perf_counter() - started}
    return Results(result, spec.to_yaml(), spec.time_unit, tables, curves, files)


def given_result(
    spec: Spec, task: Task, experiment: Any, information: Array, requirements: tuple[Requirement, ...]
) -> dict[str, Any]:
    """What `result.json` says of the information (k, k) that a given excitation has."""
    met = all(worst(r.violations(information)).ratio <= 1.0 + 1e-9 for r in requirements)
    result: dict[str, Any] = {
        "format": 1,
        "title": spec.title,
        "status": "given" if not requirements else "met" if met else "missed",
        "samples": experiment.samples,
        "information": information_entry(experiment, information),
    }
    return result | requirements_entry(spec, task, requirements, information, np.zeros(0))


def read_excitation(spec: Spec, experiment: Experiment) -> Excitation:
    """The excitation that stands under `spectrum.given`.

    Raises:
        DataError: its file cannot be used.
    """
    assert isinstance(spec.spectrum, GivenSpectrum)
    given = spec.spectrum.given
    if isinstance(given, GivenSignal):
        return _recorded(spec, experiment, given.signal)
    if isinstance(given, GivenWhite):
        power = given.power[0] if isinstance(given.power, tuple) else given.power
        return _spectral("white", FirBasis(0), np.array([power]), experiment)
    if isinstance(given, GivenMultisine):
        frequencies = np.minimum(np.array(given.frequencies) * spec.sample_time, np.pi)
        listed = given.amplitudes[0] if isinstance(given.amplitudes[0], tuple) else given.amplitudes
        amplitudes = np.array(listed, dtype=float)
        constant = (frequencies <= 0.0) | (frequencies >= np.pi)
        return _spectral(
            "multisine", LinesBasis(frequencies), np.where(constant, 1.0, 0.5) * amplitudes**2, experiment
        )
    return _spectral("table", _table(spec, given), np.ones(1), experiment)


def _spectral(
    kind: str, basis: FirBasis | LinesBasis | TabulatedSpectrum, x: Array, experiment: Experiment
) -> Excitation:
    def information(coordinates: Experiment) -> Array:
        maps = basis.integrals(coordinates.information_density, coordinates.singularities)
        return coordinates.baseline_information + np.tensordot(x, maps, axes=1)

    power = {name: [float(x @ _unit_powers(basis, experiment, name))] for name in POWER_KINDS}
    return Excitation(kind, power, information, basis, x)


def _unit_powers(
    basis: FirBasis | LinesBasis | TabulatedSpectrum, experiment: Experiment, kind: PowerKind
) -> Array:
    """(size,): the power of this kind of each basis function."""
    return basis.integrals(lambda w: experiment.power_density(kind, w), experiment.singularities)


def _recorded(spec: Spec, experiment: Experiment, name: str) -> Excitation:
    samples = read_excitation_record(spec, name, "spectrum.given.signal")
    u, y = input_and_output(experiment, samples)
    power: dict[PowerKind, list[float]] = {
        "input": [float(np.mean(u**2))],
        "output": [float(np.mean(y**2))],
        "excitation": [float(np.mean(samples**2))],
    }
    return Excitation(
        "signal", power, lambda coordinates: record_information(coordinates, samples), samples=samples
    )


def _table(spec: Spec, given: GivenTable) -> TabulatedSpectrum:
    columns = read_spectrum_table(spec, given, ["phi"])
    frequency, phi = columns["frequency"] * spec.sample_time, columns["phi"]
    if np.any(phi < 0) or not np.any(phi):
        raise bad_table(
            spec, given, "phi must be nonnegative, and positive somewhere", "give the spectral density"
        )
    return TabulatedSpectrum(np.minimum(frequency, np.pi), phi)


def _white_cost(experiment: Experiment, task: Task) -> float:
    """What white excitation of power one costs."""
    unit = FirBasis(0)
    return float(sum(weight * _unit_powers(unit, experiment, kind)[0] for kind, weight in task.cost.items()))


def check_excites(spec: Spec, experiment: Experiment | ChannelExperiment, information: Array) -> None:
    """Raise `SpecError` (`not-exciting`) when the information matrix is singular to working precision."""
    eigenvalues, vectors = np.linalg.eigh(information)
    if eigenvalues[0] > _TOO_FAINT * eigenvalues[-1]:
        return
    raise spec.complain(
        "not-exciting",
        f"this excitation tells nothing about {experiment.unexcited(vectors[:, 0])}: infinite variance",
        hint="each sinusoid determines at most two parameters: add frequencies, or drop parameters",
        key="spectrum.given",
    )


def _entry(spec: Spec, excitation: Excitation) -> dict[str, Any]:
    entry: dict[str, Any] = {"type": "given", "given": excitation.kind}
    if isinstance(excitation.basis, LinesBasis):
        entry["frequencies"] = excitation.basis.frequencies / spec.sample_time
        entry["powers"] = excitation.x
    elif isinstance(excitation.basis, FirBasis):
        entry["coefficients"] = excitation.x
    return entry


def _spectrum(spec: Spec, excitation: Excitation, white: float) -> tuple[Table, SpectrumCurves] | None:
    basis = excitation.basis
    if isinstance(basis, FirBasis | LinesBasis) and excitation.x is not None:
        return spectrum_curves(spec, basis, excitation.x, white)
    if isinstance(basis, TabulatedSpectrum):
        w = np.concatenate([[0.0], axis(0.0, np.pi, basis.frequency)])
        return density_curves(spec, w, basis.density(w), white)
    return None


def _record(
    request: RecordRequest, experiment: Experiment, excitation: Excitation, ratio: Callable[[Array], float]
) -> Record | None:
    """The signal as given, or one record of the given spectrum (a table gives none)."""
    if excitation.samples is not None:
        return Record(excitation.samples[:, None], "given", ratio(excitation.information(experiment)))
    if not isinstance(excitation.basis, FirBasis | LinesBasis) or excitation.x is None:
        return None
    spectrum = DesignedSpectrum.of(excitation.basis, excitation.x)
    return given_record(request, as_channels(experiment), spectrum, ratio)
