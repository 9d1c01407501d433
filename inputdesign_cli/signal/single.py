"""Experiments of one input and one output on the road of channels, until they are built there."""

from __future__ import annotations

import numpy as np

from inputdesign_cli.information import ChannelExperiment, Experiment, FiniteRecord
from inputdesign_cli.plant import MatrixController, PolynomialChannels, PolynomialLoop
from inputdesign_cli.plant.polynomial import Array


def as_channels(experiment: Experiment) -> ChannelExperiment:
    """The same experiment, with one channel."""
    m, controller = experiment.model, experiment.loop.controller
    model = PolynomialChannels(
        ((m.B,),), (m.A,), ((m.F,),), (m.C,), (m.D,), np.array([[m.variance]], dtype=float)
    )
    loop = None
    if controller is not None:
        C = MatrixController.build(
            [[controller.numerator.tolist()]], [[controller.denominator_polynomial.tolist()]]
        )
        loop = PolynomialLoop(model, C)
    return ChannelExperiment(
        model, experiment.samples, prior=experiment.prior, factor=experiment.factor, loop=loop
    )


def record_information(experiment: Experiment, excitation: Array) -> Array:
    """(k, k): the information of one record (n,)."""
    return FiniteRecord(as_channels(experiment), excitation.size).information(excitation[:, None])


def input_and_output(experiment: Experiment, excitation: Array) -> tuple[Array, Array]:
    """u_x and y_x (.., n): what the excitation alone causes at input and output, from rest."""
    plant = FiniteRecord(as_channels(experiment), excitation.shape[-1])
    u, y = (plant.signals(kind, np.atleast_2d(excitation).T) for kind in ("input", "output"))
    return u.T.reshape(excitation.shape), y.T.reshape(excitation.shape)


def channel_record_information(experiment: ChannelExperiment, record: Array, step: float) -> Array:
    """(k, k): the information of one record (n, r), see `FiniteRecord`."""
    return FiniteRecord(experiment, len(record), step).information(record)


def channel_outputs(experiment: ChannelExperiment, record: Array, step: float) -> Array:
    """(n, p): what the samples alone cause at the outputs, from rest."""
    return FiniteRecord(experiment, len(record), step).signals("output", record)
