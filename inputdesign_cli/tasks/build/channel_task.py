"""Spec -> the question of a design with several channels, in continuous time or on a band."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from inputdesign_cli.design.convex.designs import Question
from inputdesign_cli.design.convex.problem import Goal, RequirementFactory
from inputdesign_cli.information import ChannelExperiment, FiniteRecord
from inputdesign_cli.plant.polynomial import Array
from inputdesign_cli.specification import Spec
from inputdesign_cli.specification.models.spectrum import FirSpectrum, PolynomialSpectrum
from inputdesign_cli.spectrum import PolynomialBasis
from inputdesign_cli.tasks.build.channel_requirements import build_entry_errors, build_entry_variances
from inputdesign_cli.tasks.build.channels import (
    build_cost,
    channel_experiment,
    excitation_symbol,
    record_step,
    spectrum_basis,
)
from inputdesign_cli.tasks.build.experiment import embedded
from inputdesign_cli.tasks.build.free_directions import check_every_direction_counts
from inputdesign_cli.tasks.build.limits import build_density_limits, build_power_limits
from inputdesign_cli.tasks.build.model_error import model_error_alpha
from inputdesign_cli.tasks.build.requirements import build_criterion, build_requirements
from inputdesign_cli.tasks.build.signal_checks import check_signal
from inputdesign_cli.tasks.build.spectra import check_has_density
from inputdesign_cli.tasks.build.tables import read_columns
from inputdesign_cli.tasks.build.task import Task
from inputdesign_cli.tasks.result.ellipses import check_pairs

_GOALS: dict[str, Goal] = {"least_cost": "cost", "best_accuracy": "factor", "shortest_experiment": "samples"}
_ROUNDING = 1e-9


def build_channel_task(spec: Spec) -> Task:
    """Everything that can be wrong with the spec comes to light here, before anything is computed.

    Raises:
        SpecError: see the builders of the parts; `not-supported`, `needs-band`, `bad-limit`,
            `not-identifiable`.
    """
    check_channels_supported(spec)
    # Any: designs and requirements ask for no more than both kinds of experiments have.
    experiment: Any = with_prior(spec, channel_experiment(spec))
    model, band = experiment.model, experiment.band
    requirements = channel_requirements(spec, experiment)
    criterion = build_criterion(spec, experiment)
    goal = _GOALS[spec.goal]
    experiment.whitened(1.0)  # says which parameters cannot be told apart
    check_pairs(spec, model.names)
    check_signal(spec)
    basis = spectrum_basis(spec, experiment.inputs, band)
    _check_columns(spec, basis)
    check_has_density(spec, basis)
    cost = build_cost(spec)
    question = Question(
        experiment=replace(experiment, samples=1) if goal == "samples" else experiment,
        basis=basis,
        goal=goal,
        requirements=requirements if criterion is None else [criterion],
        side=[] if criterion is None else requirements,
        cost=cost if goal == "cost" else {},
        limits=build_power_limits(spec),
        densities=build_density_limits(spec, experiment),
        band=band,
    )
    check_every_direction_counts(spec, question)
    return Task(question, experiment, cost, model_error_alpha(spec, experiment), None)  # type: ignore[arg-type]


def channel_requirements(spec: Spec, experiment: Any) -> list[RequirementFactory]:
    """All requirements, those over frequency entry by entry.

    Raises:
        SpecError, DataError: see the builders of the parts.
    """
    requirements = [_moved(error) for error in build_entry_errors(spec, experiment)]
    requirements += build_requirements(_without_variance(spec), experiment, None)
    return requirements + [_moved(variance) for variance in build_entry_variances(spec, experiment)]


def _moved(requirement: Any) -> RequirementFactory:
    return lambda experiment: replace(requirement, experiment=experiment)


def _without_variance(spec: Spec) -> Spec:
    """The spec but for its weighted variance, which is made entry by entry here."""
    accuracy = spec.accuracy.model_copy(update={"weighted_variance": None})
    return spec.model_copy(update={"accuracy": accuracy})


def with_prior(spec: Spec, experiment: ChannelExperiment) -> ChannelExperiment:
    """The experiment with what `experiment.prior` adds to it.

    Raises:
        SpecError, DataError: see `channel_prior`.
    """
    return replace(experiment, prior=channel_prior(spec, experiment))


def channel_prior(spec: Spec, experiment: ChannelExperiment) -> Array | None:
    """`experiment.prior` (k, k): a matrix, or that of the samples of an earlier experiment.

    Its columns are u1, u2, .., in closed loop r1, r2, ..

    Raises:
        SpecError, DataError: the matrix does not fit the parameters, the file cannot be used.
    """
    prior, step = spec.experiment.prior, record_step(spec)
    if prior is None:
        return None
    key = "experiment.prior.information"
    if isinstance(prior.information, str):
        channels = [f"{excitation_symbol(spec)}{i + 1}" for i in range(experiment.inputs)]
        columns = read_columns(
            spec.resolve_path(prior.information), {name: name for name in channels}, key=key
        )
        record = np.stack([columns[name] for name in channels], axis=1)
        return FiniteRecord(replace(experiment, samples=len(record)), len(record), step).information(record)
    matrix = np.array(prior.information, dtype=float)
    return embedded(spec, experiment.model.names, matrix, prior.parameters, key)


# Keys of signals that mean something for a record that the tool makes.
_MADE = ("type", "periods", "hold", "lines", "amplitudes", "ramp", "bits", "quantisation")


def check_channels_supported(spec: Spec) -> None:
    """Say plainly what is not designed for channels and bands, rather than ignore it.

    Raises:
        SpecError: `not-supported`, `bad-limit`.
    """

    def refuse(key: str, what: str, hint: str) -> Exception:
        return spec.complain("not-supported", f"this version does not {what}", hint=hint, key=key)

    for name in ("closed_loop_error", "mean_squared_error"):
        if getattr(spec.accuracy, name) is not None:
            raise refuse(
                f"accuracy.{name}", f"handle {name} here", "state the accuracy as model_error or a criterion"
            )
    if spec.limits.energy is not None:
        raise refuse(
            "limits.energy",
            "enforce limits.energy for several channels or in continuous time",
            "limit input_power, its mean a sample",
        )
    if spec.solver.method != "exchange":
        raise refuse("solver.method", f"use the {spec.solver.method} method here", "use exchange")
    if not spec.plant.sampled:
        _check_interpolated(spec)
    _check_band(spec)


def check_given_signal(spec: Spec) -> None:
    """A given excitation is shown by one record of it, as it is.

    Raises:
        SpecError: `not-supported`.
    """
    for name in _MADE:
        if getattr(spec.signal, name) is not None and (name, spec.signal.type) != ("type", "multisine"):
            raise spec.complain(
                "not-supported",
                f"this version does not apply signal.{name} to a given excitation of this plant",
                hint="remove it",
                key=f"signal.{name}",
            )
    if spec.signal.phases in ("schroeder", "optimised"):
        raise spec.complain(
            "not-supported",
            f"this version does not choose {spec.signal.phases} phases for a given excitation of this plant",
            hint="use random, or leave the key out",
            key="signal.phases",
        )


def _check_interpolated(spec: Spec) -> None:
    """In continuous time samples are interpolated within their band: between them there are no levels."""
    kinds = ("binary", "ternary", "prbs")
    bits = spec.signal.bits is not None
    if spec.signal.type in kinds or spec.signal.hold is not None or bits:
        key = "signal.hold" if spec.signal.hold is not None else "signal.bits" if bits else "signal.type"
        raise spec.complain(
            "not-supported",
            "a plant in s is driven by the band-limited interpolation of the samples, which has no levels "
            "and holds nothing between them",
            hint="write plant.sample: zoh for a signal that is held between samples, or use a multisine",
            key=key,
        )


def _check_band(spec: Spec) -> None:
    spectrum, limit = spec.spectrum, spec.limits.band
    if limit is None:
        return
    if spectrum is None or isinstance(spectrum, FirSpectrum):
        raise spec.complain(
            "bad-limit",
            "a FIR spectrum does not vanish outside a band: no trigonometric polynomial does",
            hint="use type: polynomial, multisine or free",
            key="limits.band",
        )
    if isinstance(spectrum, PolynomialSpectrum):
        lo, hi = spectrum.band
        if lo < limit[0] * (1 - _ROUNDING) or hi > limit[1] * (1 + _ROUNDING):
            raise spec.complain(
                "bad-limit",
                f"the band of the spectrum, [{lo:g}, {hi:g}], leaves limits.band, "
                f"[{limit[0]:g}, {limit[1]:g}]",
                hint="narrow spectrum.band; limits.band is not needed, a polynomial spectrum has its own",
                key="spectrum.band",
            )


def _check_columns(spec: Spec, basis: object) -> None:
    """A factor of few columns is for criteria under upper power limits."""
    columns = getattr(spec.spectrum, "factor_columns", None)
    if columns is None:
        return
    assert isinstance(basis, PolynomialBasis)
    plain = spec.accuracy.criterion is not None and not spec.accuracy.requirements
    floors = any(not limit.upper for limit in build_power_limits(spec))
    if not plain or floors or spec.limits.spectrum is not None:
        raise spec.complain(
            "not-supported",
            "factor_columns is for a criterion under upper limits on powers",
            hint="remove factor_columns: the default, a factor of full rank, is the true optimum",
            key="spectrum.factor_columns",
        )
