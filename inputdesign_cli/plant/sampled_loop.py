"""The loop around plants in s that are sampled behind a zero-order hold."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Protocol

import numpy as np
import scipy
from numpy.typing import ArrayLike

from inputdesign_cli.arrays import Array, ComplexArray
from inputdesign_cli.plant.loop import Loop, close_loop
from inputdesign_cli.plant.model import Model
from inputdesign_cli.plant.sampled_model import SampledModel
from inputdesign_cli.plant.transfer import StateSpace, TransferMatrix


class Realised(Model, Protocol):
    """A sampled model that has states."""

    @property
    def realisation(self) -> StateSpace:
        """Return a state-space realisation from inputs to outputs."""

    @property
    def poles(self) -> ComplexArray:
        """Poles in z."""

    @property
    def repeated_integrators(self) -> int:
        """The integrators of the realisation that take no part in G."""


@dataclass(frozen=True)
class SampledLoop(Loop):
    """`Loop` with R = I and N = G, which has no poles outside the unit circle, and H = I.

    Poles and signals come from the states of the entries of G and of the rows of C: polynomials in q^-1
    would lose the digits of poles that crowd at z = 1 when sampling is fast. States of G that feedback does
    not reach are poles of G, hence stable.

    y(t) is measured before u(t) is applied and held; a controller that needs time to compute has a delay.
    """

    model: Realised

    @property
    def noise_gain(self) -> Array:
        """(states, p): how e enters the states besides its way through the outputs."""
        return np.zeros((len(self._states[0]), self.model.outputs))

    @cached_property
    def _states(self) -> tuple[Array, Array, Array]:
        """x(t + 1) = A x + B [y; u], `instantaneous` [y; u] = C x + [e; r]."""
        plant, controller = self.model.realisation, self.controller.realisation
        from_u = np.concatenate([plant.B, np.zeros((len(controller.A), self.model.inputs))])
        from_y = np.concatenate([np.zeros((len(plant.A), self.model.outputs)), controller.B])
        return (
            scipy.linalg.block_diag(plant.A, controller.A),
            np.concatenate([from_y, from_u], axis=1),
            scipy.linalg.block_diag(plant.C, -controller.C),
        )

    @cached_property
    def closed_poles(self) -> ComplexArray:
        """All poles of the loop in z."""
        A, B, C = self._states
        poles = np.linalg.eigvals(A + B @ np.linalg.solve(self.instantaneous, C)).astype(complex)
        repeated = self.model.repeated_integrators
        return poles[np.argsort(np.abs(poles - 1.0))][repeated:]

    @property
    def predictor_poles(self) -> ComplexArray:
        """Poles in z of the filters that make the gradient of the prediction."""
        return self.model.poles

    @cached_property
    def instantaneous(self) -> Array:
        """(p + r, p + r): what acts without delay."""
        p, r = self.model.outputs, self.model.inputs
        G, C = self.model.realisation.D, self.controller.realisation.D
        return np.block([[np.eye(p), -G], [C, np.eye(r)]])

    def left_at(self, w: ArrayLike) -> ComplexArray:
        """(n, p + r, p + r): the matrix on the left of `Loop`."""
        (P, below), G = self.controller.fraction_at(w), self.model.plant_at(w)
        p, r = self.model.outputs, self.model.inputs
        left = np.zeros((len(G), p + r, p + r), dtype=complex)
        left[:, :p, :p], left[:, :p, p:], left[:, p:, :p] = np.eye(p), -G, P
        left[:, p + np.arange(r), p + np.arange(r)] = below
        return left

    def noise_at(self, w: ArrayLike) -> ComplexArray:
        """R H (n, p, p)."""
        p = self.model.outputs
        return np.broadcast_to(np.eye(p, dtype=complex), (np.size(w), p, p))

    def signals(self, r: Array, e: Array) -> tuple[Array, Array]:
        """y (.., n, p) and u (.., n, r) for samples of r and e, from rest."""
        A, B, C = self._states
        at_once = np.linalg.inv(self.instantaneous).T
        found = np.concatenate([e, r], axis=-1) @ at_once
        from_states, onward, next_state = C.T @ at_once, B.T, A.T
        by_noise = e @ self.noise_gain.T
        x = np.zeros((*r.shape[:-2], len(A)))
        for t in range(r.shape[-2]):
            found[..., t, :] += x @ from_states
            x = x @ next_state + found[..., t, :] @ onward + by_noise[..., t, :]
        return found[..., : self.model.outputs], found[..., self.model.outputs :]


@close_loop.register
def _(model: SampledModel, controller: TransferMatrix) -> SampledLoop:
    return SampledLoop(model, controller)
