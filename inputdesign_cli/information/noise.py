"""What the noise alone tells: around a loop, or of a plant with past outputs in its prediction."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Protocol

import numpy as np
from numpy.typing import ArrayLike, NDArray

from inputdesign_cli.information.quadrature import NODES_AT_ONCE, Quadrature, integrate
from inputdesign_cli.plant import Model
from inputdesign_cli.plant.polynomial import Array, ComplexArray

_NUMBERS_AT_ONCE = 2**16


class Disturbed(Protocol):
    """An experiment, as far as its noise goes; see `Experiment`."""

    @property
    def model(self) -> Model:
        """What the noise disturbs."""

    @property
    def samples(self) -> int:
        """N."""

    @property
    def size(self) -> int:
        """Number of parameters k."""

    @property
    def singularities(self) -> ComplexArray:
        """Poles of the gradient, as points of the frequency plane."""

    @property
    def told_by_noise(self) -> bool:
        """Whether the noise tells of any parameter at all."""

    def noise_gradient(self, w: ArrayLike) -> ComplexArray:
        """(n, k, p, p): what white e of covariance I contributes, noise whitened to I."""


def noise_informations(experiments: Sequence[Disturbed]) -> NDArray[np.float64]:
    """(S, k, k): what N samples of each tell without any excitation, by the noise alone (in the loop).

    The S plants are of one structure, and their integrals share nodes.
    """
    first = experiments[0]
    if not first.told_by_noise:
        return np.zeros((len(experiments), first.size, first.size))

    def gradients(w: Array) -> NDArray:
        return np.stack([experiment.noise_gradient(w) for experiment in experiments], axis=1)

    def sums(rule: Quadrature, values: NDArray) -> NDArray[np.float64]:
        weighted = np.moveaxis(values, 0, -1) * np.sqrt(rule.weights)
        flat = weighted.reshape(*weighted.shape[:2], -1)
        rows = np.concatenate([flat.real, flat.imag], axis=2)
        return np.asarray(rows @ rows.swapaxes(1, 2))

    near = np.concatenate([experiment.singularities for experiment in experiments])
    numbers = len(experiments) * first.size * first.model.outputs**2
    told = integrate(gradients, sums, near, at_once=max(_NUMBERS_AT_ONCE // numbers, NODES_AT_ONCE))
    return told * np.array([experiment.samples for experiment in experiments])[:, None, None]
