"""Spec -> the controller of a loop, in q^-1."""

from __future__ import annotations

import numpy as np

from inputdesign_cli.plant import Rational, TransferMatrix, delayed, discretised, pid
from inputdesign_cli.questions.building.weights import rational
from inputdesign_cli.specification.models.controller import (
    ContinuousController,
    Controller,
    LoopsController,
    PidController,
    SingleController,
)
from inputdesign_cli.specification.models.transfer import DiscreteMatrix


def controller_matrix(
    controller: Controller, sample_time: float, channels: tuple[int, int]
) -> TransferMatrix:
    """C of the loop u = r - C y.

    Args:
        channels: numbers of inputs and of outputs.
    """
    match controller:
        case DiscreteMatrix():
            return TransferMatrix.build(controller.numerator_matrix, controller.denominator_matrix)
        case LoopsController(loops=loops):
            nothing = Rational(np.zeros(1))
            rows = [[nothing] * channels[1] for _ in range(channels[0])]
            for one in loops:
                rows[one.input - 1][one.output - 1] = _single(one.controller, sample_time)
            return TransferMatrix.of(rows)
        case _:
            return TransferMatrix.diagonal(_single(controller, sample_time), 1)


def _single(controller: SingleController, sample_time: float) -> Rational:
    match controller:
        case PidController(pid=stated):
            times = stated.Ti, stated.Td, stated.filter_time
            return delayed(pid(stated.Kp, *times, sample_time, stated.sample), controller.delay)
        case ContinuousController(continuous=ratio):
            made = discretised(ratio.numerator, ratio.denominator_factors, sample_time, controller.sample)
            return delayed(made, controller.delay)
        case _:
            return rational(controller)
