"""Spec -> the question of `accuracy.closed_loop_error`, checked before anything is computed."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Literal

import numpy as np

from inputdesign_cli.design.loop_error import (
    ClosedLoopProblem,
    InternalModel,
    MatrixPlant,
    MatrixTransfer,
    MinimumVariance,
    ModelReference,
    PowerLimit,
)
from inputdesign_cli.design.loop_error.checks import check_invertible, check_law
from inputdesign_cli.design.loop_error.transfer import sampled
from inputdesign_cli.specification import (
    ContinuousMatrixTransfer,
    ContinuousPlant,
    ContinuousTransfer,
    DiscreteMatrix,
    DiscreteTransfer,
    PolynomialPlant,
    Spec,
)
from inputdesign_cli.specification.models.experiment import NoiseShape, covariance_of
from inputdesign_cli.tasks.build.channels import polynomial_channels, rows_of

KEY = "accuracy.closed_loop_error"


def build_problem(spec: Spec) -> ClosedLoopProblem:
    """The problem, with all that can be wrong with it already complained of.

    Raises:
        SpecError: what this version does not design, and the diagnostics of `check_law`.
    """
    _check_supported(spec)
    plant = build_plant(spec, spec.plant, spec.noise, "plant")
    law = _law(spec, plant)
    check_law(plant, law, key=f"{KEY}.control")
    error = spec.accuracy.closed_loop_error
    assert error is not None
    variance = np.broadcast_to(np.asarray(error.reference.variance, dtype=float), plant.outputs)
    coloured = error.reference.filter
    lo, hi = spec.clip_band(spec.limits.band)
    return ClosedLoopProblem(
        plant=plant,
        law=law,
        limits=_limits(spec),
        reference_variance=variance.copy(),
        reference_filter=None if coloured is None else _scalar(spec, coloured, 1),
        band=(lo * spec.sample_time, min(hi * spec.sample_time, np.pi)),
    )


def build_plant(spec: Spec, plant: object, noise: NoiseShape, key: str) -> MatrixPlant:
    """The matrix of polynomials of `plant` or of the true system `simulation.plant`."""
    variance = getattr(noise, "variance", None)
    if variance is None:
        raise spec.complain(
            "not-supported",
            "this version takes the noise of this simulation as a variance",
            hint="write variance in place of relative_std",
            key="simulation.noise",
        )
    if isinstance(plant, PolynomialPlant):
        covariance = covariance_of(variance, plant.outputs)
        return MatrixPlant.of(polynomial_channels(plant, noise, covariance))
    if not isinstance(plant, ContinuousPlant) or not plant.sampled:
        raise spec.complain(
            "not-supported",
            "this version designs for the closed-loop error of sampled plants only",
            hint="add sample: zoh to a continuous-time plant",
            key=key,
        )
    matrix = plant.continuous
    pairs = [
        [sampled(above, below, spec.sample_time) for above, below in zip(*rows, strict=True)]
        for rows in zip(matrix.numerator_matrix, matrix.denominator_matrix, strict=True)
    ]
    return MatrixPlant(
        B=tuple(tuple(above for above, _ in row) for row in pairs),
        A=(np.ones(1),),
        F=tuple(tuple(below for _, below in row) for row in pairs),
        C=rows_of(noise.C),
        D=rows_of(noise.D),
        covariance=covariance_of(variance, plant.outputs),
    )


def true_plant(spec: Spec, nominal: MatrixPlant) -> MatrixPlant:
    """The true system of the simulation; the nominal one where the spec does not say."""
    simulation = spec.simulation
    if simulation is None or (simulation.plant is None and simulation.noise is None):
        return nominal
    plant = spec.plant if simulation.plant is None else simulation.plant
    noise: NoiseShape = spec.noise if simulation.noise is None else simulation.noise
    return build_plant(spec, plant, noise, "simulation.plant")


def _law(spec: Spec, plant: MatrixPlant) -> ModelReference | InternalModel | MinimumVariance:
    error = spec.accuracy.closed_loop_error
    assert error is not None
    control = error.control
    if control.minimum_variance:
        return MinimumVariance(plant)
    if control.internal_model is not None:
        # The delay and the zeros to be kept are read off the inverse, so it must exist first.
        check_invertible(plant, key="plant.B")
        return InternalModel.build(plant, _scalar(spec, control.internal_model, plant.outputs))
    target = control.model_reference
    assert target is not None
    if isinstance(target, ContinuousMatrixTransfer | DiscreteMatrix):
        return ModelReference(_matrix(spec, target))
    return ModelReference(_scalar(spec, target, plant.outputs))


def _scalar(spec: Spec, transfer: DiscreteTransfer | ContinuousTransfer, size: int) -> MatrixTransfer:
    if isinstance(transfer, ContinuousTransfer):
        ratio = transfer.continuous
        above, below = sampled(ratio.numerator, ratio.denominator_polynomial, spec.sample_time)
        return MatrixTransfer.diagonal(above.tolist(), below.tolist(), size)
    lead = transfer.denominator_polynomial[0]
    return MatrixTransfer.diagonal(
        [c / lead for c in transfer.numerator], [c / lead for c in transfer.denominator_polynomial], size
    )


def _matrix(spec: Spec, target: ContinuousMatrixTransfer | DiscreteMatrix) -> MatrixTransfer:
    if isinstance(target, DiscreteMatrix):
        return MatrixTransfer.build(target.numerator_matrix, target.denominator_matrix)
    inside = target.continuous
    above: list[list[Sequence[float]]] = []
    below: list[list[Sequence[float]]] = []
    for numerators, denominators in zip(inside.numerator_matrix, inside.denominator_matrix, strict=True):
        pairs = [sampled(n, d, spec.sample_time) for n, d in zip(numerators, denominators, strict=True)]
        above.append([pair[0].tolist() for pair in pairs])
        below.append([pair[1].tolist() for pair in pairs])
    return MatrixTransfer.build(above, below)


def _limits(spec: Spec) -> tuple[PowerLimit, ...]:
    found: list[PowerLimit] = []
    kinds: tuple[tuple[str, Literal["input", "output"]], ...] = (
        ("input_power", "input"),
        ("excitation_power", "input"),
        ("output_power", "output"),
    )
    for name, kind in kinds:
        limit = getattr(spec.limits, name)
        if limit is None:
            continue
        if limit.min is not None:
            raise _refuse(spec, f"limits.{name}.min", "enforce least powers here", "remove min")
        if isinstance(limit.max, tuple):
            found += [PowerLimit(kind, most, channel) for channel, most in enumerate(limit.max)]
        else:
            found.append(PowerLimit(kind, limit.max))
    return tuple(found)


_UNSUPPORTED_LIMITS = ("amplitude", "rate", "energy", "spectrum")
_UNSUPPORTED_SIGNAL_KEYS = (
    *("hold", "lines", "amplitudes", "offset", "ramp", "bits", "quantisation", "scale", "also"),
)


def _refuse(spec: Spec, key: str, what: str, hint: str) -> Exception:
    return spec.complain("not-supported", f"this version does not {what}", hint=hint, key=key)


def _check_supported(spec: Spec) -> None:
    for name in spec.accuracy.requirements:
        raise _refuse(spec, f"accuracy.{name}", f"handle {name} beside closed_loop_error", "keep one of them")
    for name in _UNSUPPORTED_LIMITS:
        if getattr(spec.limits, name) is not None:
            raise _refuse(
                spec,
                f"limits.{name}",
                f"enforce limits.{name} for closed_loop_error",
                "limit input_power, output_power or band",
            )
    kind = "pointwise" if spec.spectrum is None else getattr(spec.spectrum, "type", "given")
    if kind not in ("pointwise", "free"):
        raise _refuse(
            spec,
            "spectrum",
            f"design spectra of type {kind} for closed_loop_error",
            "use type: pointwise, which is best at every frequency",
        )
    if spec.closed_loop:
        raise _refuse(
            spec, "experiment.controller", "design closed-loop experiments here", "remove the controller"
        )
    if spec.report.ellipses is not None:
        raise _refuse(spec, "report.ellipses", "draw ellipses for closed_loop_error", "remove report")
    if spec.experiment.prior is not None:
        raise _refuse(spec, "experiment.prior", "use prior information here", "remove it")
    if spec.solver.method != "exchange":
        raise _refuse(spec, "solver.method", f"use the method {spec.solver.method} here", "remove method")
    if spec.signal.type not in (None, "multisine", "filtered_noise"):
        raise _refuse(
            spec, "signal.type", f"make {spec.signal.type} signals here", "use multisine or filtered_noise"
        )
    for name in _UNSUPPORTED_SIGNAL_KEYS:
        if getattr(spec.signal, name) is not None:
            raise _refuse(spec, f"signal.{name}", f"apply signal.{name} here", "remove it")
    if spec.signal.phases not in (None, "random"):
        raise _refuse(spec, "signal.phases", f"choose {spec.signal.phases} phases here", "use random")
