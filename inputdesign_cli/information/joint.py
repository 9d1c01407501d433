"""Compute information and cost of several plants under the same spectra, with shared nodes.

Much of the time of an integral goes into its nodes and into the spectra at these nodes. Both hardly differ
between plants that are alike.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
from numpy.typing import NDArray

from inputdesign_cli.arrays import Array, ComplexArray
from inputdesign_cli.information.experiment import Experiment, PowerKind, information_of_noise, of_channel
from inputdesign_cli.plant import (
    disturbance_gradients,
    excitation_gradients,
    excited,
    input_gradients,
    noise_gradients,
)

# Entries of all plants of an integral at one node; more would leave the cache of the processor.
_AT_A_NODE = 256
# Frequencies computed together, over all plants, for the same reason.
_AT_ONCE = 2**13

Integrals = Callable[[Callable[[Array], NDArray], ComplexArray, Callable[[Array], NDArray] | None], NDArray]
"""The integrals (size, ...) of a density with these singularities and this factor, see `Basis.integrals`."""


def jointly_whitened(experiments: Sequence[Experiment], power: float | Array) -> list[Experiment]:
    """Return each experiment in coordinates where M = I by this power, see `Experiment.whitened`."""
    return [whitened for group in _groups(experiments) for whitened in _whitened(group, power)]


def _whitened(experiments: Sequence[Experiment], power: float | Array) -> list[Experiment]:
    first = experiments[0]
    if len(experiments) == 1:
        return [first.whitened(power)]
    excited, around = first.flat_rules(_singularities(experiments))
    F = _excitation_gradients(experiments, excited.nodes)
    V = _noise_gradients(experiments, around.nodes) if first.noise_informs else None
    return [
        experiment.whitened_by(
            power, (excited, experiment.noise_whitener[0, 0] * F[s]), (around, None if V is None else V[s])
        )
        for s, experiment in enumerate(experiments)
    ]


def joint_noise(experiments: Sequence[Experiment]) -> NDArray[np.float64]:
    """Return `noise_information` of each experiment (S, k, k)."""
    return np.concatenate([_noise(group) for group in _groups(experiments)])


def _noise(experiments: Sequence[Experiment]) -> NDArray[np.float64]:
    first, number = experiments[0], len(experiments)
    if number == 1 or not first.noise_informs:
        return np.stack([experiment.noise_information for experiment in experiments])
    whiteners = np.array([experiment.from_raw for experiment in experiments])

    def gradients(w: Array) -> ComplexArray:
        columns = whiteners @ _noise_gradients(experiments, w)[..., 0, 0].transpose(0, 2, 1)
        return columns.transpose(2, 0, 1)[..., None, None]

    found = information_of_noise(gradients, _singularities(experiments))
    return np.asarray(first.samples * found)


def joint_information(experiments: Sequence[Experiment], integrals: Integrals) -> NDArray[np.float64]:
    """Return the information (size, S, k, k) by each of the basis functions at each plant."""
    return np.concatenate([_together(group, integrals) for group in _groups(experiments)], axis=1)


def mean_cost(
    experiments: Sequence[Experiment], weights: Sequence[tuple[PowerKind, int | None, float]], w: Array
) -> NDArray:
    """Return what a unit of spectral density costs at frequencies, a mean over plants, (n,) or (n, r, r).

    Args:
        weights: for each kind of power and each channel (or all together).
    """
    number = max(_AT_ONCE // max(w.size, 1), 1)
    parts = [experiments[start : start + number] for start in range(0, len(experiments), number)]
    return np.asarray(sum(_cost(part, weights, w) for part in parts) / len(experiments))


def _cost(
    experiments: Sequence[Experiment], weights: Sequence[tuple[PowerKind, int | None, float]], w: Array
) -> NDArray:
    """Return the sum over the plants."""
    first, total = experiments[0], np.zeros(())
    loops = [experiment.loop for experiment in experiments if experiment.loop is not None]
    y, u = excited(loops, w) if loops else (None, None)
    for kind, channel, weight in weights:
        caused = y if kind == "output" else u
        if not first.depends_on_plant(kind):
            total = total + weight * len(experiments) * first.power_density(kind, w, channel)
        elif caused is None:
            total = total + weight * sum(one.power_density(kind, w, channel) for one in experiments)
        else:
            rows = of_channel(caused, channel)
            total = total + weight * first.squeezed(np.einsum("snpa,snpb->nab", rows.conj(), rows))
    return total


def _groups(experiments: Sequence[Experiment]) -> list[Sequence[Experiment]]:
    """Return groups of experiments that share an integral; one of several channels is a group alone."""
    first = experiments[0]
    channels = first.model.outputs * first.inputs
    number = max(_AT_A_NODE // first.size**2, 1) if channels == 1 else 1
    return [experiments[start : start + number] for start in range(0, len(experiments), number)]


def _singularities(experiments: Sequence[Experiment]) -> ComplexArray:
    return np.concatenate([experiment.singularities for experiment in experiments])


def _together(experiments: Sequence[Experiment], integrals: Integrals) -> NDArray[np.float64]:
    first = experiments[0]
    if len(experiments) == 1:
        return integrals(first.information_density, first.singularities, first.information_factor)[:, None]

    whiteners = np.array([np.sqrt(e.samples) * e.noise_whitener[0, 0] * e.from_raw for e in experiments])
    first_of, second_of = np.tril_indices(first.size)
    entries = np.zeros((first.size, first.size), dtype=np.intp)
    entries[first_of, second_of] = entries[second_of, first_of] = np.arange(first_of.size)

    def density(w: Array) -> NDArray[np.float64]:
        """Return the products (n, S, k (k + 1) / 2), which are symmetric."""
        columns = whiteners @ _excitation_gradients(experiments, w)[..., 0, 0].transpose(0, 2, 1)
        real, imaginary = np.ascontiguousarray(columns.real), np.ascontiguousarray(columns.imag)
        products = real[:, first_of] * real[:, second_of]
        products += imaginary[:, first_of] * imaginary[:, second_of]
        return products.transpose(2, 0, 1)

    return integrals(density, _singularities(experiments), None)[..., entries]


def _excitation_gradients(experiments: Sequence[Experiment], w: Array) -> ComplexArray:
    """Return the part of x in the gradients of the predictions, in raw parameters, (S, n, k, p, r)."""
    if experiments[0].loop is not None:
        return excitation_gradients([e.loop for e in experiments if e.loop is not None], w)
    return input_gradients([e.model for e in experiments], w)


def _noise_gradients(experiments: Sequence[Experiment], w: Array) -> ComplexArray:
    """Return the part of e in the gradients of the predictions (S, n, k, p, p)."""
    if experiments[0].loop is not None:
        return disturbance_gradients([e.loop for e in experiments if e.loop is not None], w)
    return noise_gradients([e.model for e in experiments], w)
