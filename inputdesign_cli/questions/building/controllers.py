"""Spec -> the controller of a loop in q^-1, as stated or tuned.

Rules of tuning: [skogestad-2003] with the half rule, and [astrom-hagglund-2004]. The hold delays by half a
sample on average, which counts as dead time.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from inputdesign_cli.errors import SpecError
from inputdesign_cli.plant import Model, Rational, TransferMatrix, delayed, discretised, pid
from inputdesign_cli.questions.building.weights import rational
from inputdesign_cli.specification import Spec
from inputdesign_cli.specification.models import loop
from inputdesign_cli.specification.models.transfer import DiscreteMatrix


def controller_matrix(
    controller: loop.Controller, sample_time: float, channels: tuple[int, int]
) -> TransferMatrix:
    """Return C of the loop u = r - C y, for these numbers of inputs and outputs."""
    match controller:
        case DiscreteMatrix():
            return TransferMatrix.build(controller.numerator_matrix, controller.denominator_matrix)
        case loop.LoopsController(loops=loops):
            nothing = Rational(np.zeros(1))
            rows = [[nothing] * channels[1] for _ in range(channels[0])]
            for one in loops:
                rows[one.input - 1][one.output - 1] = _single(one.controller, sample_time)
            return TransferMatrix.of(rows)
        case _:
            return TransferMatrix.diagonal(_single(controller, sample_time), 1)


def _single(controller: loop.SingleController, sample_time: float) -> Rational:
    match controller:
        case loop.PidController(pid=stated):
            times = stated.Ti, stated.Td, stated.filter_time
            return delayed(pid(stated.Kp, *times, sample_time, stated.sample), controller.delay)
        case loop.ContinuousController(continuous=ratio):
            made = discretised(ratio.numerator, ratio.denominator_factors, sample_time, controller.sample)
            return delayed(made, controller.delay)
        case _:
            return rational(controller)


_REAL = 1e-9


@dataclass(frozen=True)
class Process:
    """Holds gain e^(-dead_time s) / (time_constant s + 1), or gain e^(-dead_time s) / s without constant."""

    gain: float
    time_constant: float | None
    dead_time: float


def loop_controller(spec: Spec, stated: loop.LoopMargin, model: Model) -> loop.Controller | None:
    """Return C of the loop to be kept: tuned on the model, stated, or of the experiment.

    An uncertain plant has settings for each scenario, since the rules will be applied to the estimate. Raises
    `SpecError` (`not-supported`) for plants that the rules are not made for.
    """
    if stated.tuning is None:
        return stated.controller or spec.experiment.controller
    if spec.plant.kind != "continuous":
        return loop.PidController(pid=tuned(process_of(spec), stated.tuning))
    values = dict(zip(model.names, model.theta.tolist(), strict=True))
    changes: dict[str, object] = {
        ".".join(("plant", *map(str, known.place))): values[known.label]
        for known in spec.plant.named_parameters
        if values.get(known.label, known.value) != known.value
    }
    there = spec.with_(**changes) if changes else spec
    return loop.PidController(pid=tuned(process_of(there), stated.tuning))


def tuned(process: Process, tuning: loop.Tuning) -> loop.Pid:
    """Return the settings of a PI or PID controller."""
    K, T, L = process.gain, process.time_constant, process.dead_time
    Td = 0.0
    if tuning.simc is not None:
        reach = (tuning.simc.tau_c or L) + L
        Kp, Ti = (1.0 / reach, 4.0 * reach) if T is None else (T / reach, min(T, 4.0 * reach))
    elif tuning.amigo is not None and tuning.amigo.type == "pi":
        Kp, Ti = 0.35 / L, 13.4 * L
        if T is not None:
            Kp = 0.15 + (0.35 - L * T / (L + T) ** 2) * T / L
            Ti = 0.35 * L + 13.0 * L * T**2 / (T**2 + 12.0 * L * T + 7.0 * L**2)
    else:
        Kp, Ti, Td = 0.45 / L, 8.0 * L, 0.5 * L
        if T is not None:
            Kp, Ti = 0.2 + 0.45 * T / L, (0.4 * L + 0.8 * T) / (L + 0.1 * T) * L
            Td = 0.5 * L * T / (0.3 * L + T)
    return loop.Pid(Kp=Kp / K, Ti=Ti, Td=Td, sample=tuning.sample)


def process_of(spec: Spec) -> Process:
    """Return the nominal plant, by the half rule if it has a second lag; or raise `SpecError`."""
    plant = spec.plant

    def refuse(why: str) -> SpecError:
        message = f"{why}, and the rules of tuning are for a gain, one or two lags and a dead time"
        hint = "tune it yourself: accuracy.loop.controller: {pid: {Kp: .., Ti: ..}}"
        return spec.complain("not-supported", message, hint=hint, key="accuracy.loop.tuning")

    if plant.kind != "continuous" or not plant.sampled:
        raise refuse("the plant is not written in s with sample: zoh")
    if (plant.inputs, plant.outputs) != (1, 1):
        raise refuse("the plant has several channels")
    matrix = plant.continuous
    above = np.trim_zeros(np.array(matrix.numerator_matrix[0][0], dtype=float), "f")
    below = np.trim_zeros(np.array(matrix.denominator_matrix[0][0], dtype=float), "f")
    poles = np.roots(below)
    if above.size != 1 or not 1 <= poles.size <= 2:
        raise refuse("the plant has zeros, or more than two lags")
    if np.any(np.abs(poles.imag) > _REAL * np.abs(poles)):
        raise refuse("the plant oscillates")
    lags = sorted((float(-1.0 / p.real) for p in poles if p != 0.0), reverse=True)
    integrates = len(lags) < poles.size
    if integrates and len(lags) == 0 and poles.size == 2:
        raise refuse("the plant integrates twice")
    dead_time = float(matrix.delays[0][0]) + 0.5 * spec.sample_time
    gain = float(above[0] / below[-2 if integrates else -1])
    kept = None if integrates else lags.pop(0)
    if lags:
        dead_time += 0.5 * lags[0]
        kept = None if kept is None else kept + 0.5 * lags[0]
    return Process(gain, kept, dead_time)
