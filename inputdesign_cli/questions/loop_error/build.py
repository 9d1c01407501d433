"""Spec -> the question of `accuracy.closed_loop_error`, checked before anything is computed."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from inputdesign_cli.design.loop_error import (
    ControlLaw,
    InternalModel,
    LoopErrorProblem,
    MatrixPlant,
    MinimumVariance,
    ModelReference,
    PowerLimit,
)
from inputdesign_cli.design.loop_error.checks import check_invertible
from inputdesign_cli.errors import bad_spec, refuse
from inputdesign_cli.plant import Rational, TransferMatrix, hold_entries
from inputdesign_cli.questions.building.demand import check_record
from inputdesign_cli.questions.building.header import build_header
from inputdesign_cli.questions.building.signal_settings import build_bounds, stated_moves, stated_peaks
from inputdesign_cli.questions.building.weights import held, rational
from inputdesign_cli.questions.loop_error.build_plant import estimated_model, matrix_plant
from inputdesign_cli.questions.loop_error.outcome import LoopErrorTerms
from inputdesign_cli.questions.loop_error.signal import LoopErrorSignalSettings
from inputdesign_cli.questions.loop_error.solve import KEY, LoopErrorTask, LossTrial
from inputdesign_cli.specification import ClosedLoopError, Simulation, Spec
from inputdesign_cli.specification.models.transfer import Transfer

_GRID = 512
_CANDIDATES = 20


def build_loop_error_task(spec: Spec) -> LoopErrorTask:
    """Build the task, and refuse what cannot be designed.

    Faults of the simulation alone are reported by `simulate`.

    Raises:
        SpecError: what this version does not design, and the diagnostics of `ControlLaw.check`.
    """
    error = spec.accuracy.closed_loop_error
    assert error is not None
    _check_supported(spec)
    plant = matrix_plant(spec, spec.plant, spec.noise, "plant")
    name, law = _law(spec, error, plant, "plant.B")
    check_invertible(plant, key="plant.B")
    law.check(plant, key=f"{KEY}.control.{name}")
    coloured = error.reference.filter
    lo, hi = spec.clip_band(spec.limits.band)
    problem = LoopErrorProblem(
        plant=plant,
        estimated=estimated_model(spec),
        law=law,
        limits=_limits(spec),
        reference_variance=np.asarray(error.reference.variance) * np.ones(plant.outputs),
        reference_filter=Rational(np.ones(1)) if coloured is None else _transfer(spec, coloured),
        band=(lo * spec.sample_time, min(hi * spec.sample_time, np.pi)),
    )
    cost, spectrum = spec.cost, spec.spectrum
    terms = LoopErrorTerms(
        header=build_header(spec),
        law=name,
        covariance=error.covariance,
        samples=spec.experiment.samples,
        tolerance=spec.solver.tolerance,
        cost={
            "input": np.asarray(cost.input_power),
            "output": np.asarray(cost.output_power),
            "excitation": np.asarray(cost.excitation_power),
        },
        grid=spectrum.grid if spectrum is not None and spectrum.type == "pointwise" else _GRID,
    )
    return LoopErrorTask(problem, terms, _signal(spec, error, plant.inputs), _trial(spec, error, problem))


def _law(spec: Spec, error: ClosedLoopError, plant: MatrixPlant, key: str) -> tuple[str, ControlLaw]:
    """The key of the control law, and the law."""
    control = error.control
    if control.minimum_variance:
        return "minimum_variance", MinimumVariance(plant)
    if control.internal_model is not None:
        # The delay and the zeros to be kept are read off the inverse, so it must exist first.
        check_invertible(plant, key=key)
        return "internal_model", InternalModel.build(plant, _transfer(spec, control.internal_model))
    target = control.model_reference
    assert target is not None
    if target.kind == "discrete_matrix":
        T = TransferMatrix.build(target.numerator_matrix, target.denominator_matrix)
    elif target.kind == "continuous_matrix":
        inside = target.continuous
        rows = inside.numerator_matrix
        at_once = [[0.0] * len(row) for row in rows]
        held = hold_entries(rows, inside.denominator_matrix, spec.sample_time, at_once)
        T = TransferMatrix.build(*held)
    else:
        T = TransferMatrix.diagonal(_transfer(spec, target), plant.outputs)
    return "model_reference", ModelReference(T)


def _transfer(spec: Spec, transfer: Transfer) -> Rational:
    """A transfer function of the spec, sampled by a zero-order hold where it is given in s."""
    return rational(transfer) if transfer.kind == "discrete" else held(transfer, spec.sample_time)


def _limits(spec: Spec) -> tuple[PowerLimit, ...]:
    found: list[PowerLimit] = []
    limits = spec.limits
    for key, limit, kind in (
        ("input_power", limits.input_power, PowerLimit.of_input),
        ("excitation_power", limits.excitation_power, PowerLimit.of_input),
        ("output_power", limits.output_power, PowerLimit.of_output),
    ):
        if limit is None:
            continue
        if limit.min is not None:
            raise refuse(f"limits.{key}.min", what="enforce least powers here", hint="remove min")
        if isinstance(limit.max, tuple):
            found += [kind(most, channel) for channel, most in enumerate(limit.max)]
        elif limit.max is not None:
            found.append(kind(limit.max))
    samples = ((PowerLimit.of_input, stated_peaks(spec)[0]), (PowerLimit.of_moves, stated_moves(spec)))
    found += [
        kind(float(most) ** 2, channel)
        for kind, bounds in samples
        if bounds is not None
        for channel, most in enumerate(bounds)
        if np.isfinite(most)
    ]
    if spec.limits.amplitude is not None and spec.limits.amplitude.output is not None:
        what = "enforce peaks of outputs for closed_loop_error"
        raise refuse("limits.amplitude.output", what=what, hint="limit output_power")
    return tuple(found)


def _signal(spec: Spec, error: ClosedLoopError, inputs: int) -> LoopErrorSignalSettings:
    check_record(spec, inputs**2)
    signal, samples = spec.signal, spec.signal_samples
    filtered = signal.type == "filtered_noise"
    if filtered and error.covariance == "parametric":
        raise bad_spec(
            "not-supported",
            "this version makes multisines of a parametric design, which consists of lines",
            hint="write type: multisine, or covariance: asymptotic",
            key="signal.type",
        )
    if not filtered and signal.periods is not None and samples % signal.periods:
        raise bad_spec(
            "conflicting-keys",
            f"{samples} samples do not make {signal.periods} equal periods",
            hint="choose a divisor of the number of samples",
            key="signal.periods",
        )
    return LoopErrorSignalSettings(
        samples=samples,
        filtered=filtered,
        # As many periods as inputs, where the record can be split so, make the designed matrix exact.
        periods=signal.periods or (inputs if samples % inputs == 0 else 1),
        order=signal.order,
        candidates=signal.candidates or _CANDIDATES,
        seed=signal.seed or 0,
        amplitude=stated_peaks(spec)[0],
        rate=build_bounds(spec).rate,
    )


def _trial(spec: Spec, error: ClosedLoopError, problem: LoopErrorProblem) -> LossTrial:
    simulation = spec.simulation or Simulation()
    for name in simulation.compare:
        if name != "white":
            raise bad_spec(
                "not-supported",
                f"this version compares the design with white noise, not with {name}",
                hint="write compare: [white]",
                key="simulation.compare",
            )
    true = problem.plant
    if simulation.plant is not None or simulation.noise is not None:
        true = matrix_plant(
            spec, simulation.plant or spec.plant, simulation.noise or spec.noise, "simulation.plant"
        )
    law = _law(spec, error, true, "simulation.plant")[1]
    return LossTrial(
        replace(problem, plant=true, law=law), simulation.runs, simulation.seed, "white" in simulation.compare
    )


_LIMITS = ("energy", "spectrum")
_SIGNAL_KEYS = ("hold", "lines", "amplitudes", "offset", "ramp", "bits", "quantisation", "scale", "also")


def _check_supported(spec: Spec) -> None:
    for name in spec.accuracy.requirements:
        what = f"handle {name} beside closed_loop_error"
        raise refuse(f"accuracy.{name}", what=what, hint="keep one of them")
    for name in spec.limits.stated(*_LIMITS):
        what, hint = f"enforce limits.{name} for closed_loop_error", "limit powers, amplitude, rate or band"
        raise refuse(f"limits.{name}", what=what, hint=hint)
    spectrum, signal = spec.spectrum, spec.signal
    if spectrum is not None and spectrum.type not in ("pointwise", "free"):
        kind = spectrum.phrase.replace(":", "")
        what = f"design spectra of {kind} for closed_loop_error"
        raise refuse("spectrum", what=what, hint="use type: pointwise, which is best at every frequency")
    if spec.closed_loop:
        what, hint = "design closed-loop experiments here", "remove the controller"
        raise refuse("experiment.controller", what=what, hint=hint)
    if spec.report.ellipses is not None:
        raise refuse("report.ellipses", what="draw ellipses for closed_loop_error", hint="remove report")
    if spec.experiment.prior is not None:
        raise refuse("experiment.prior", what="use prior information here", hint="remove it")
    if spec.solver.method != "exchange":
        what = f"use the method {spec.solver.method} here"
        raise refuse("solver.method", what=what, hint="remove method")
    if signal.type not in (None, "multisine", "filtered_noise"):
        what = f"make {signal.type} signals here"
        raise refuse("signal.type", what=what, hint="use multisine or filtered_noise")
    for name in signal.stated(*_SIGNAL_KEYS):
        raise refuse(f"signal.{name}", what=f"apply signal.{name} here", hint="remove it")
    if signal.phases not in (None, "random"):
        raise refuse("signal.phases", what=f"choose {signal.phases} phases here", hint="use random")
