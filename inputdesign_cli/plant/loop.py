"""The loop around a sampled plant: u = r - C y, C a matrix of transfer functions in q^-1."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import cast

import numpy as np
import scipy
from numpy.typing import ArrayLike, NDArray

from inputdesign_cli.arrays import Array, ComplexArray
from inputdesign_cli.errors import bad_spec
from inputdesign_cli.plant.frequencies import logarithmic_distance
from inputdesign_cli.plant.model import Model, SampledPlant, prediction_gradients
from inputdesign_cli.plant.transfer import TransferMatrix

_WELL_POSED = 1e-9
# A pole this near to z = 1 integrates. Responses at frequency zero are then computed at this share of the
# distance of the nearest pole: they differ by the square of that share.
INTEGRATES, BESIDE = 1e-7, 1e-5
_DELAY = (
    "give the plant its delay (a leading 0 in B; in s a numerator of lower order than the denominator) or "
    "the controller one (a leading 0 in its numerator)"
)
# The most frequent other faults of controllers: of one channel, and of several.
_ONE = "and that numerator and denominator of the controller are in q^-1, ascending"
_SEVERAL = (
    "which output each column of the controller reads, and that entries of a row with the same poles share "
    "one denominator"
)


def beside_zero(w: ArrayLike, nearest: float) -> ComplexArray | Array:
    """Return the frequencies `w`, with real ones moved to at least `nearest` from zero."""
    given = np.asarray(w)
    if nearest == 0.0 or np.iscomplexobj(given):
        return given
    return np.where(np.abs(given) < nearest, nearest, given)


@dataclass(frozen=True)
class Loop:
    """A model under u = r - C y, with e acting on u through the loop.

    With R y = N u + R H e of the model (see `SampledPlant`) and C = Q^-1 P, Q diagonal, everything solves

        [R  -N] [y]   [R H e]
        [P   Q] [u] = [Q r  ]

    in which nothing has poles on or outside the unit circle: these are zeros of R and Q, and their effect in
    the loop stays finite. Poles and signals come from the states of G and of the rows of C, since one
    polynomial in q^-1 would lose the digits of poles that crowd at z = 1. y(t) is measured before u(t) is
    applied; a controller that needs time to compute has a delay.
    """

    model: SampledPlant
    controller: TransferMatrix

    @cached_property
    def _states(self) -> tuple[Array, Array, Array]:
        """Return A, B, C: x(t + 1) = A x + B [y; u] + .. R H e, `instantaneous` [y; u] = C x + [R H e; r]."""
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
        """Return all poles of the loop in z; it is internally stable when they lie inside the unit circle."""
        A, B, C = self._states
        poles = np.linalg.eigvals(A + B @ np.linalg.solve(self.instantaneous, C)).astype(complex)
        return poles[np.argsort(np.abs(poles - 1.0))][self.model.repeated_integrators :]

    @cached_property
    def instantaneous(self) -> Array:
        """Return the gains without delay, [I, -G; C, I] at infinite frequency, as (p + r, p + r)."""
        G, C = self.model.realisation.D, self.controller.realisation.D
        return np.block([[np.eye(len(G)), -G], [C, np.eye(len(C))]])

    def signals(self, r: Array, e: Array) -> tuple[Array, Array]:
        """Return y (.., n, p) and u (.., n, r) for samples r (.., n, r) and e (.., n, p), from rest."""
        (A, B, C), v = self._states, self.model.forcing(e)
        at_once = np.linalg.inv(self.instantaneous).T
        found = np.concatenate([v, r], axis=-1) @ at_once
        from_states, onward, next_state = C.T @ at_once, B.T, A.T
        gain = self.model.noise_gain
        by_noise = v @ np.pad(gain, ((0, len(A) - len(gain)), (0, 0))).T
        x = np.zeros((*r.shape[:-2], len(A)))
        for t in range(r.shape[-2]):
            found[..., t, :] += x @ from_states
            x = x @ next_state + found[..., t, :] @ onward + by_noise[..., t, :]
        return found[..., : self.model.outputs], found[..., self.model.outputs :]

    def input_deviation(self, colouring: Array, samples: int) -> Array:
        """Return the standard deviations (r,) of the inputs by noise alone, `samples` after rest.

        Args:
            colouring: (p, p), a root of the covariance of e.
        """
        e = np.zeros((len(colouring), samples, len(colouring)))
        e[:, 0] = colouring.T
        _, u = self.signals(np.zeros((*e.shape[:2], self.model.inputs)), e)
        return np.asarray(np.sqrt(np.sum(u**2, axis=(0, 1))))

    @cached_property
    def singularities(self) -> ComplexArray:
        """Return the poles of all responses to excitation and noise, as points of the frequency plane."""
        return logarithmic_distance(np.concatenate([self.closed_poles, self.model.predictor_poles]))

    @property
    def radius(self) -> float:
        """Return the largest modulus of poles in z of the closed loop and the predictor.

        Integrators of the predictor are left out.
        """
        filters = self.model.predictor_poles
        caused = np.concatenate([self.closed_poles, filters[np.abs(filters - 1.0) >= INTEGRATES]])
        return float(np.abs(caused).max(initial=0.0))

    @property
    def integrates(self) -> bool:
        """Return whether filters of the prediction are infinite at frequency zero; the loop stays finite."""
        near = np.abs(self.model.predictor_poles - 1.0) < INTEGRATES
        return self.model.integrates or bool(np.any(near))

    @cached_property
    def nearest(self) -> float:
        """Return the least frequency at which responses are computed, to avoid a pole at zero."""
        if not self.integrates:
            return 0.0
        near = np.abs(logarithmic_distance(self.closed_poles))
        return BESIDE * float(np.min(near, initial=1.0))

    def beside_zero(self, w: ArrayLike) -> ComplexArray | Array:
        """Return the frequencies `w`, moved off zero where the loop integrates; those off the axis stay."""
        return beside_zero(w, self.nearest)

    @property
    def memory(self) -> float:
        """Return the number of samples for which signals matter beyond the memory of the poles."""
        return self.model.memory + self.controller.memory

    def check_stability(self) -> None:
        """Raise `SpecError` (`unstable-loop`, `algebraic-loop`) unless the loop is well posed and stable."""
        p, leading = self.model.outputs, self.instantaneous
        # det(I + C G) is the product of 1 + these eigenvalues, which do not depend on the units of u and y.
        gains = np.linalg.eigvals(-leading[:p, p:] @ np.linalg.solve(leading[p:, p:], leading[p:, :p]))
        if np.min(np.abs(1.0 + gains) / (1.0 + np.abs(gains))) < _WELL_POSED:
            raise bad_spec(
                "algebraic-loop",
                "plant and controller both act without delay and det(I + C G) vanishes at infinite frequency",
                hint=_DELAY,
                key="experiment.controller",
            )
        worst = max(self.closed_poles, key=abs, default=0.0)
        if abs(worst) >= 1.0:
            raise bad_spec(
                "unstable-loop",
                f"the loop u = r - C y is unstable: closed-loop pole at radius {abs(worst):.6g}, "
                f"angle {abs(np.angle(worst)):.4g} rad/sample",
                hint="check the signs (feedback is negative: u = r - C y), the delay of the plant, "
                + (_ONE if self.model.inputs == p == 1 else _SEVERAL),
                key="experiment.controller",
            )

    def check_delay(self) -> None:
        """Raise `SpecError` (`algebraic-loop`) where both plant and controller act at once.

        Then u(t) contains e(t), and so does the gradient of the prediction of y(t): an estimate from u and y
        is biased. [ljung-1999], Chapter 13, assumes a delay in one of them.
        """
        answers = self.instantaneous[self.model.outputs :, : self.model.outputs] != 0.0
        if np.any(self.model.at_once @ answers):
            raise bad_spec(
                "algebraic-loop",
                "plant and controller both act without delay: u(t) answers the noise of y(t) and changes "
                "y(t), so that estimates from u and y would be biased",
                hint=_DELAY,
                key="experiment.controller",
            )

    def excited(self, w: ArrayLike) -> tuple[ComplexArray, ComplexArray]:
        """Return the responses to r: G S_i (n, p, r) at y, S_i = (I + C G)^-1 (n, r, r) at u."""
        y, u = excited([self], w)
        return y[0], u[0]

    def disturbed(self, w: ArrayLike) -> tuple[ComplexArray, ComplexArray]:
        """Return the responses to e: S_o H (n, p, p) at y, -C S_o H (n, r, p) at u; S_o = (I + G C)^-1."""
        y, u = disturbed([self], w)
        return y[0], u[0]

    def sensitivity(self, w: ArrayLike) -> tuple[ComplexArray, ComplexArray]:
        """Return the sensitivity function S = (I + G C)^-1 (n, p, p) and C S (n, r, p) at `w`, rad/sample."""
        left, p = _lefts_at([self], w)[0], self.model.outputs
        y, minus_u = _solved(left, left[:, :, :p] * (np.arange(left.shape[1]) < p)[:, None], p)
        return y, -minus_u

    def excitation_gradient(self, w: ArrayLike) -> ComplexArray:
        """Return the prediction gradient due to r, (n, k, p, r)."""
        return excitation_gradients([self], w)[0]

    def noise_gradient(self, w: ArrayLike) -> ComplexArray:
        """Return the prediction gradient due to e, by the noise model and around the loop, (n, k, p, p)."""
        return disturbance_gradients([self], w)[0]


def excited(loops: Sequence[Loop], w: ArrayLike) -> tuple[ComplexArray, ComplexArray]:
    """Return `Loop.excited` of loops around plants of one structure: (S, n, p, r) at y, (S, n, r, r) at u."""
    left, p = _lefts_at(loops, w), loops[0].model.outputs
    return _solved(left, left[..., p:] * (np.arange(left.shape[-1]) >= p)[:, None], p)


def disturbed(loops: Sequence[Loop], w: ArrayLike) -> tuple[ComplexArray, ComplexArray]:
    """Return `Loop.disturbed` of loops around plants of one structure, (S, n, p, p) and (S, n, r, p)."""
    left, p = _lefts_at(loops, w), loops[0].model.outputs
    right = np.zeros((*left.shape[:-1], p), dtype=complex)
    right[..., :p, :] = [loop.model.forcing_at(loop.beside_zero(w)) for loop in loops]
    return _solved(left, right, p)


def _lefts_at(loops: Sequence[Loop], w: ArrayLike) -> ComplexArray:
    """Return the matrices on the left of `Loop`, beside zero, (S, n, p + r, p + r)."""
    p, r = loops[0].model.outputs, loops[0].model.inputs
    # In memory the values of an entry stand side by side.
    left = np.zeros((len(loops), p + r, p + r, np.size(w)), dtype=complex).transpose(0, 3, 1, 2)
    controllers: dict[tuple[int, float], tuple[ComplexArray, ComplexArray]] = {}
    for own, loop in zip(left, loops, strict=True):
        at, key = loop.beside_zero(w), (id(loop.controller), loop.nearest)
        if key not in controllers:
            controllers[key] = loop.controller.fraction_at(at)
        own[:, :p, :p], N = loop.model.left_at(at)
        own[:, :p, p:] = -N
        own[:, p:, :p], own[:, p + np.arange(r), p + np.arange(r)] = controllers[key]
    return left


def _solved(left: ComplexArray, right: ComplexArray, outputs: int) -> tuple[ComplexArray, ComplexArray]:
    """Solve left [y; u] = right (.., p + r, columns) for y and u; two unknowns by Cramer's rule."""
    if left.shape[-1] == 2:
        (a, b), (c, d) = (tuple(left[..., i, j, None] for j in (0, 1)) for i in (0, 1))
        top, bottom = right[..., 0, :], right[..., 1, :]
        below = a * d - b * c
        y, u = (d * top - b * bottom) / below, (a * bottom - c * top) / below
        return y[..., None, :], u[..., None, :]
    solved = np.linalg.solve(left, right).astype(complex)
    return solved[..., :outputs, :], solved[..., outputs:, :]


def excitation_gradients(loops: Sequence[Loop], w: ArrayLike) -> ComplexArray:
    """Return `Loop.excitation_gradient` of loops around plants of one structure, as (S, n, k, p, r)."""
    y, u = excited(loops, w)
    return _prediction_gradients(loops, w, y, u, np.zeros_like(y))


def disturbance_gradients(loops: Sequence[Loop], w: ArrayLike) -> ComplexArray:
    """Return `Loop.noise_gradient` of loops around plants of one structure, as (S, n, k, p, p)."""
    y, u = disturbed(loops, w)
    return _prediction_gradients(loops, w, y, u, np.broadcast_to(np.eye(y.shape[-1], dtype=complex), y.shape))


def _prediction_gradients(
    loops: Sequence[Loop], w: ArrayLike, y: ComplexArray, u: ComplexArray, e: NDArray
) -> ComplexArray:
    """Return the prediction gradients of the models, all at once if their frequencies agree."""
    if len({loop.nearest for loop in loops}) == 1:
        models = [loop.model for loop in loops]
        return prediction_gradients(models[0], models, loops[0].beside_zero(w), y, u, e)
    each = zip(loops, y, u, e, strict=True)
    return np.stack([one.model.prediction_gradient(one.beside_zero(w), *signals) for one, *signals in each])


def close_loop(model: Model, controller: TransferMatrix) -> Loop:
    """Return the loop of a sampled model under a controller."""
    assert not model.continuous
    return Loop(cast(SampledPlant, model), controller)
