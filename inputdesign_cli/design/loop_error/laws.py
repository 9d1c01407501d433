"""Control laws whose response at a frequency depends on the plant at that frequency only.

All have the form C = G^-1 X with X free of G, so that Delta C = -G^-1 Delta G C, [rojas-asymptotic] Section
VII. Arrays are (K, n, n) over K frequencies; vec stacks columns.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Protocol

import numpy as np
from numpy.typing import ArrayLike, NDArray

from inputdesign_cli.arrays import Array, ComplexArray
from inputdesign_cli.design.loop_error.checks import (
    check_circle,
    check_minimum_variance,
    check_model_reference,
)
from inputdesign_cli.design.loop_error.plant import MatrixPlant
from inputdesign_cli.plant.filtering import filtered
from inputdesign_cli.plant.frequencies import logarithmic_distance
from inputdesign_cli.plant.polynomial import join_roots, roots_in_z, unit_circle
from inputdesign_cli.plant.polynomial_matrix import delay_of, determinant_and_adjugate
from inputdesign_cli.plant.transfer import Rational, TransferMatrix, product_of


class ControlLaw(Protocol):
    """What the design needs to know of a control law."""

    @property
    def target(self) -> TransferMatrix | None:
        """T where the law gives it whatever the plant; None where it follows from the plant."""

    def complementary(self, w: ArrayLike) -> ComplexArray:
        """T = G C (I + G C)^-1, the loop that the true plant would give."""

    def controller(self, G: ComplexArray, w: ArrayLike) -> ComplexArray:
        """C(G)."""

    def noise_jacobian(self, G: ComplexArray, w: ArrayLike) -> ComplexArray | None:
        """d vec C / d vec H: (K, n^2, n^2); None where C ignores the noise model."""

    def check(self, plant: MatrixPlant, *, key: str) -> None:
        """The controller can run on this plant: it is causal, stable, and finite on the circle.

        Raises:
            SpecError: see `checks`.
        """

    @property
    def singularities(self) -> ComplexArray:
        """Poles, and zeros of S, as points of the frequency plane."""


def propagation(law: ControlLaw, G: ComplexArray, w: ArrayLike) -> ComplexArray:
    """(K, n^2, n^2): d vec(S G Delta C S) / d vec G, what an error of the model does to the loop.

    Equal to (S^T (x) S G) (d vec C / d vec G), but finite where S has a zero and C a pole.
    """
    T = law.complementary(w)
    S = sensitivity(T)
    return -kronecker(_transposed(np.linalg.inv(G) @ T), S)


def complement(numerator: Array, denominator: Array) -> Array:
    """The matrix of polynomials d I - N (n, n, l) of I - N / d."""
    n, size = numerator.shape[0], max(numerator.shape[-1], denominator.size)
    found = np.zeros((n, n, size))
    found[..., : numerator.shape[-1]] -= numerator
    found[np.arange(n), np.arange(n), : denominator.size] += denominator
    return found


def sensitivity(T: ComplexArray) -> ComplexArray:
    """S = I - T for each frequency."""
    return np.asarray(np.eye(T.shape[1]) - T, dtype=complex)


def kronecker(left: NDArray, right: NDArray) -> ComplexArray:
    """left (x) right for each frequency."""
    product = np.einsum("kab,kcd->kacbd", left, right)
    rows, columns = left.shape[1] * right.shape[1], left.shape[2] * right.shape[2]
    return product.reshape(-1, rows, columns)


def _transposed(matrix: NDArray) -> NDArray:
    return np.swapaxes(matrix, 1, 2)


@dataclass(frozen=True)
class _FixedLoop:
    """Laws that give a loop T whatever the plant, and ignore the noise model."""

    target: TransferMatrix

    def complementary(self, w: ArrayLike) -> ComplexArray:
        """See `ControlLaw`."""
        return self.target.at(w)

    def noise_jacobian(self, G: ComplexArray, w: ArrayLike) -> None:
        """See `ControlLaw`."""
        return

    @cached_property
    def singularities(self) -> ComplexArray:
        """See `ControlLaw`."""
        numerator, d = self.target.common_fraction()
        zeros = [determinant_and_adjugate(N)[0] for N in (complement(numerator, d), numerator)]
        return logarithmic_distance(join_roots([self.target.poles, *map(roots_in_z, zeros)]))


@dataclass(frozen=True)
class ModelReference(_FixedLoop):
    """C = G^-1 T (I - T)^-1: the loop from reference to output is T, [rojas-asymptotic] (18)."""

    def controller(self, G: ComplexArray, w: ArrayLike) -> ComplexArray:
        """See `ControlLaw`."""
        T = self.target.at(w)
        return np.linalg.inv(G) @ T @ np.linalg.inv(sensitivity(T))

    def check(self, plant: MatrixPlant, *, key: str) -> None:
        """See `ControlLaw`."""
        check_model_reference(plant, self.target, key=key)


@dataclass(frozen=True)
class InternalModel(_FixedLoop):
    """C = (I - Q G)^-1 Q with Q = G^-1 T, T = b f I.

    f is the filter, b the all-pass of the delay and of the zeros that G^-1 may not invert; b is held
    at its nominal value, since it does not depend on G at a single frequency.
    """

    @classmethod
    def build(cls, plant: MatrixPlant, filter_: Rational) -> InternalModel:
        """With the delay and the zeros outside the unit circle of the plant in b."""
        missing = max(plant.inverse_delay - delay_of(filter_.numerator), 0)
        above: Array = np.eye(missing + 1)[-1]
        below: Array = np.ones(1)
        outside = plant.zeros[np.abs(plant.zeros) > 1]
        if outside.size:
            # (q^-1 - 1/z0)*... of modulus one on the circle, poles at the mirrored zeros, gain one at DC.
            below = np.asarray(np.poly(1 / np.conj(outside)).real, dtype=float)
            blaschke = np.poly(outside).real
            above = product_of([above, np.sum(below) / np.sum(blaschke) * blaschke])
        return cls(TransferMatrix.diagonal(filter_, plant.outputs).scaled(Rational(above, (below,))))

    def controller(self, G: ComplexArray, w: ArrayLike) -> ComplexArray:
        """See `ControlLaw`."""
        Q = np.linalg.inv(G) @ self.target.at(w)
        return np.asarray(np.linalg.inv(sensitivity(Q @ G)) @ Q)

    def check(self, plant: MatrixPlant, *, key: str) -> None:
        """See `ControlLaw`."""
        check_circle(plant, self.target, key=key)


@dataclass(frozen=True)
class MinimumVariance:
    """C = G^-1 (H E^-1 - I): the output is E e, E the first `delay` terms of H."""

    plant: MatrixPlant

    @property
    def target(self) -> None:
        """See `ControlLaw`."""
        return None

    @property
    def delay(self) -> int:
        """The samples that pass before the input acts."""
        return self.plant.inverse_delay

    def unavoidable(self, w: ArrayLike) -> ComplexArray:
        """E (K, n, n), diagonal: what no controller can remove from the noise."""
        q = unit_circle(w)
        E = np.zeros((q.size, self.plant.outputs, self.plant.outputs), dtype=complex)
        for i, terms in enumerate(self._terms()):
            E[:, i, i] = np.polynomial.polynomial.polyval(q, terms)
        return E

    def complementary(self, w: ArrayLike) -> ComplexArray:
        """See `ControlLaw`."""
        return sensitivity(self.unavoidable(w) @ np.linalg.inv(self.plant.noise_at(w)))

    def controller(self, G: ComplexArray, w: ArrayLike) -> ComplexArray:
        """See `ControlLaw`."""
        X = -sensitivity(self.plant.noise_at(w) @ np.linalg.inv(self.unavoidable(w)))
        return np.asarray(np.linalg.inv(G) @ X)

    def noise_jacobian(self, G: ComplexArray, w: ArrayLike) -> ComplexArray:
        """d vec C / d vec H with E held: its few terms are known far better than H pointwise."""
        return kronecker(_transposed(np.linalg.inv(self.unavoidable(w))), np.linalg.inv(G))

    def check(self, plant: MatrixPlant, *, key: str) -> None:
        """See `ControlLaw`."""
        check_minimum_variance(plant, self.complementary(np.linspace(0.1, 3.0, 30)), key=key)

    def _terms(self) -> list[Array]:
        plant = self.plant
        impulse = np.zeros(self.delay)
        impulse[0] = 1.0
        return [
            filtered(c, np.convolve(a, d), impulse)
            for a, c, d in zip(*map(plant.per_output, (plant.A, plant.C, plant.D)), strict=True)
        ]

    @property
    def singularities(self) -> ComplexArray:
        """See `ControlLaw`."""
        roots = [roots_in_z(terms) for terms in self._terms()]
        return np.concatenate([self.plant.singularities, logarithmic_distance(join_roots(roots))])
