"""Model error of a whole plant with several channels: the Frobenius norm of G_hat - G below r_adm(w).

Over the confidence ellipsoid that norm is, to first order, at most r_u = alpha sqrt(lambda_max(T P T^T))
with T the real and imaginary parts of the gradients of all entries: the cut of one entry with more rows.
The largest singular value of the error is no larger, which is what a sensitivity asks for.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike, NDArray

from inputdesign_cli.accuracy.admissible import AdmissibleError
from inputdesign_cli.accuracy.continuous_weight import weight_singularities
from inputdesign_cli.accuracy.model_error import ModelError
from inputdesign_cli.accuracy.requirement import inverse_factor
from inputdesign_cli.information import ChannelExperiment
from inputdesign_cli.plant import ChannelLoop, ChannelModel, Rational, graded_grid
from inputdesign_cli.plant.polynomial import Array, ComplexArray

_NOWHERE = np.zeros(0)
_TINY = np.finfo(float).tiny


@dataclass(frozen=True)
class RelativeNorm:
    """r_adm = fraction |G|_F."""

    model: ChannelModel
    fraction: float
    knots = _NOWHERE
    singularities = _NOWHERE.astype(complex)

    def at(self, w: ArrayLike) -> Array:
        return self.fraction * np.linalg.norm(self.model.plant_at(w), axis=(1, 2))


@dataclass(frozen=True)
class LoopSensitivity:
    """r_adm = (1 - |W| s(S)) / s(C S), s the largest singular value and S = (I + G C)^-1 of the nominal loop.

    For every plant G + D with s(D) <= r_adm then s(W S') <= 1: S' = S (I + D C S)^-1, so that
    s(S') <= s(S) / (1 - s(D) s(C S)). With one channel it is `admissible.Sensitivity`.
    """

    loop: ChannelLoop
    weight: Rational
    knots = _NOWHERE

    @cached_property
    def singularities(self) -> ComplexArray:
        return np.concatenate([self.loop.singularities, weight_singularities(self.weight)])

    def at(self, w: ArrayLike) -> Array:
        S, applied = self.loop.sensitivity(w)
        room = 1.0 - np.abs(self.weight.at(w)) * np.linalg.norm(S, 2, axis=(1, 2))
        return room / np.maximum(np.linalg.norm(applied, 2, axis=(1, 2)), _TINY)


@dataclass(frozen=True)
class NormError(ModelError):
    """The requirement on the Frobenius norm; `band` in the experiment's unit."""

    experiment: ChannelExperiment  # type: ignore[assignment]
    admissible: AdmissibleError
    alpha: float
    band: tuple[float, float]

    @cached_property
    def grid(self) -> Array:
        """Frequencies that see every resonance of the plant, its loop, its noise and of r_adm."""
        near = [self.experiment.model.singularities, self.experiment.singularities, self.own_singularities]
        return graded_grid(np.concatenate(near), *self.band, knots=self.knots)

    def rows(self, w: ArrayLike) -> NDArray[np.float64]:
        """(n, 2 p r, k): V(w)^T = (alpha / r_adm) T, so that the requirement reads M >= V V^T."""
        return self._all_rows(w) * (self.alpha / self.admissible.at(w))[:, None, None]

    def measure(self, half: NDArray[np.float64], w: Array) -> Array:
        """r_u / r_adm."""
        return _largest(half)

    def error_bound(self, information: Array, w: ArrayLike) -> Array:
        """r_u (n,) at frequencies `w`, inside or outside the band, to first order."""
        return self.alpha * _largest(self._all_rows(w) @ inverse_factor(information).T)

    def _all_rows(self, w: ArrayLike) -> NDArray[np.float64]:
        gradient = self.experiment.plant_gradient(w)
        flat = np.moveaxis(gradient.reshape(*gradient.shape[:2], -1), 1, 2)
        return np.concatenate([flat.real, flat.imag], axis=1)


def _largest(half: NDArray[np.float64]) -> Array:
    """Largest singular values (n,) of (n, q, k), by the smaller Gram matrix."""
    return np.sqrt(np.maximum(np.linalg.eigvalsh(half @ half.swapaxes(1, 2))[:, -1], 0.0))
