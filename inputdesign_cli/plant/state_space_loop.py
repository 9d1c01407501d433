"""A loop around a state-space model: the predictor of its innovations form on the left."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from inputdesign_cli.arrays import Array, ComplexArray
from inputdesign_cli.plant.loop import close_loop
from inputdesign_cli.plant.sampled_loop import SampledLoop
from inputdesign_cli.plant.state_space_model import StateSpaceModel
from inputdesign_cli.plant.transfer import TransferMatrix


@dataclass(frozen=True)
class StateSpaceLoop(SampledLoop):
    """`Loop` with R = H^-1 and N = H^-1 G of the predictor, so that R H = I."""

    model: StateSpaceModel

    @property
    def predictor_poles(self) -> ComplexArray:
        """Poles in z of the filters that make the gradient of the prediction."""
        return self.model.predictor_poles

    @property
    def noise_gain(self) -> Array:
        """(states, p): K, behind the past of the inputs and before the controller."""
        K = self.model.matrices.K
        past = len(self.model.realisation.A) - len(K)
        behind = len(self.controller.realisation.A)
        return np.concatenate([np.zeros((past, K.shape[1])), K, np.zeros((behind, K.shape[1]))])

    def left_at(self, w: ArrayLike) -> ComplexArray:
        """(n, p + r, p + r): the matrix on the left of `Loop`."""
        left, p = super().left_at(w), self.model.outputs
        R, N = self.model.predictor_at(w)
        left[:, :p, :p], left[:, :p, p:] = R, -N
        return left


@close_loop.register
def _(model: StateSpaceModel, controller: TransferMatrix) -> StateSpaceLoop:
    return StateSpaceLoop(model, controller)
