"""What a finite record achieves: its own information matrix, not that of the spectrum it was drawn from."""

from __future__ import annotations

import numpy as np
import scipy.signal
from numpy.typing import NDArray

from inputdesign_cli.information import Experiment
from inputdesign_cli.plant.polynomial import Array


def record_information(experiment: Experiment, excitation: Array) -> Array:
    """(k, k): M0 + sum_t psi(t) psi(t)^T / variance, in the coordinates of `experiment`.

    psi is the gradient of the prediction that the actual samples of the excitation (n,) cause when
    they are applied to the plant (in its loop) at rest. M0 is scaled to the length of the record.
    """
    gradient = experiment.whiten_rows(prediction_gradient(experiment, excitation))
    length = excitation.size / experiment.samples
    known = length * experiment.noise_information + experiment.prior_information
    return known + gradient.T @ gradient / experiment.model.variance


def prediction_gradient(experiment: Experiment, excitation: Array) -> NDArray[np.float64]:
    """(n, k): psi(t) in raw parameters, from rest."""
    model = experiment.model
    u, y = input_and_output(experiment, excitation)
    CF = np.convolve(model.C, model.F)
    sources = {
        "a": scipy.signal.lfilter(-model.D, model.C, y),
        "b": scipy.signal.lfilter(model.D, CF, u),
        "f": scipy.signal.lfilter(-np.convolve(model.D, model.B), np.convolve(CF, model.F), u),
    }
    gradient = np.zeros((excitation.size, experiment.size))
    for column, name in enumerate(model.names):
        lag = int(name[1:])
        if name[0] in sources and lag < excitation.size:
            gradient[lag:, column] = sources[name[0]][: excitation.size - lag]
    return gradient


def input_and_output(experiment: Experiment, excitation: Array) -> tuple[Array, Array]:
    """u_x and y_x (n,): what the excitation alone causes at input and output, from rest."""
    loop = experiment.loop
    model, controller = loop.model, loop.controller
    if controller is None:
        return excitation, scipy.signal.lfilter(model.B, np.convolve(model.A, model.F), excitation)
    denominator = controller.denominator_polynomial
    to_input = np.convolve(np.convolve(model.A, model.F), denominator)
    u = scipy.signal.lfilter(to_input, loop.characteristic, excitation)
    y = scipy.signal.lfilter(np.convolve(model.B, denominator), loop.characteristic, excitation)
    return u, y
