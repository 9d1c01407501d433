"""What a finite record of several inputs achieves: its own information matrix and outputs."""

from __future__ import annotations

from typing import Literal

import numpy as np
from numpy.typing import NDArray

from inputdesign_cli.information import ChannelExperiment, PowerKind
from inputdesign_cli.plant.polynomial import Array

# e^-32 is below rounding; a plant that remembers longer than this many samples is cut there.
_FORGOTTEN = 32.0
_LONGEST_MEMORY = 2**20
_FREQUENCIES_AT_ONCE = 16384


def channel_record_information(experiment: ChannelExperiment, record: Array, step: float) -> Array:
    """(k, k): M0 + sum_t psi(t) Lambda^-1 psi(t)^T of the samples (n, r), from rest, M0 scaled to n.

    In continuous time the plant is driven by the band-limited interpolation of the samples, `step`
    apart, and its outputs are read at the same instants.
    """
    psi = _response(experiment, record, step, of="gradient")
    flat = psi.transpose(1, 0, 2).reshape(experiment.size, -1)
    noise = len(record) / experiment.samples * experiment.noise_information
    return experiment.prior_information + noise + flat @ flat.T


def channel_outputs(experiment: ChannelExperiment, record: Array, step: float) -> Array:
    """(n, p): what the samples alone cause at the outputs, from rest."""
    return _response(experiment, record, step, of="output")[:, 0]


def channel_inputs(experiment: ChannelExperiment, record: Array, step: float) -> Array:
    """(n, r): what the samples alone cause at the inputs; in open loop they are the inputs."""
    return record if experiment.loop is None else _response(experiment, record, step, of="input")[:, 0]


def _response(
    experiment: ChannelExperiment, record: Array, step: float, *, of: PowerKind | Literal["gradient"]
) -> NDArray[np.float64]:
    """(n, k, p) the prediction gradient, or (n, 1, channels): filtering by FFT, padded past memory."""
    damping = float(np.min(experiment.singularities.imag, initial=1.0)) * (
        step if experiment.model.continuous else 1.0
    )
    memory = min(int(np.ceil(_FORGOTTEN / max(damping, 1e-9))), _LONGEST_MEMORY)
    length = int(2 ** np.ceil(np.log2(len(record) + memory)))
    transform = np.fft.rfft(record, length, axis=0)
    w = 2.0 * np.pi * np.arange(length // 2 + 1) / length
    if experiment.model.continuous:
        w = w / step
    parts = []
    for start in range(0, w.size, _FREQUENCIES_AT_ONCE):
        part = slice(start, start + _FREQUENCIES_AT_ONCE)
        if of == "gradient":
            F = experiment.excitation_gradient(w[part])
        else:
            F = experiment.response(of, w[part])[:, None]
        parts.append(np.einsum("nkpr,nr->nkp", F, transform[part]))
    return np.fft.irfft(np.concatenate(parts), length, axis=0)[: len(record)]
