"""Control laws whose response at a frequency depends on the plant at that frequency only.

All have the form C = G^-1 X with X free of G at that frequency, so that Delta C = -G^-1 Delta G C,
[rojas-asymptotic] Section VII. X may depend on a few numbers that all frequencies determine together: the
zeros outside the circle, or the first terms of H. Their variance stays bounded as the model order grows, so
the asymptotic covariance leaves it out. The exact covariance of a model structure includes it, by
`loop_gradient`. Arrays are (K, n, n) over K frequencies; vec stacks columns.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Protocol

import numpy as np
from numpy.typing import ArrayLike, NDArray

from inputdesign_cli.arrays import Array, ComplexArray
from inputdesign_cli.design.loop_error.checks import (
    check_circle,
    check_minimum_variance,
    check_model_reference,
)
from inputdesign_cli.design.loop_error.desired_loop import DesiredLoop
from inputdesign_cli.design.loop_error.plant import MatrixPlant
from inputdesign_cli.information.quadrature import Quadrature
from inputdesign_cli.plant.filtering import filtered
from inputdesign_cli.plant.frequencies import logarithmic_distance
from inputdesign_cli.plant.polynomial import all_roots, delay_of, determinant_and_adjugate, unit_circle
from inputdesign_cli.plant.transfer import Rational, TransferMatrix


class ControlLaw(Protocol):
    """The protocol of control laws: the desired loop, its controller and their derivatives."""

    @property
    def desired(self) -> DesiredLoop | None:
        """Return T, and the zeros that it keeps. None if T follows from the noise."""

    def complementary(self, w: ArrayLike) -> ComplexArray:
        """Return T = G C (I + G C)^-1, the loop that the true plant would give."""

    def controller(self, G: ComplexArray, w: ArrayLike) -> ComplexArray:
        """Return the controller C(G)."""

    def noise_jacobian(self, G: ComplexArray, w: ArrayLike) -> ComplexArray | None:
        """Return the derivative d vec C / d vec H (K, n^2, n^2). None if C ignores the noise model."""

    def loop_gradient(
        self, logarithmic: Array, relative_noise: ComplexArray, rule: Quadrature
    ) -> ComplexArray | None:
        """Return dT (K, k, n, n) at the nodes as the parameters of the model move. None if T is fixed.

        Args:
            logarithmic: (K, k), tr(G^-1 dG).
            relative_noise: (K, k, n, n), H^-1 dH.
            rule: of means over [0, pi].
        """

    def check(self, plant: MatrixPlant, *, key: str) -> None:
        """Raise unless the controller can run on this plant: causal, stable, and finite on the circle.

        Raises:
            SpecError: see `checks`.
        """

    @property
    def singularities(self) -> ComplexArray:
        """Return poles, and zeros of S, as points of the frequency plane."""


def propagation(law: ControlLaw, G: ComplexArray, w: ArrayLike) -> ComplexArray:
    """Return d vec(S G Delta C S) / d vec G, the effect of a model error on the loop, (K, n^2, n^2).

    It equals (S^T (x) S G) (d vec C / d vec G), but is finite where S has a zero and C a pole.
    """
    T = law.complementary(w)
    S = sensitivity(T)
    return -kronecker(_transposed(np.linalg.inv(G) @ T), S)


def complement(numerator: Array, denominator: Array) -> Array:
    """Return the matrix of polynomials d I - N (n, n, l) of I - N / d."""
    n, size = numerator.shape[0], max(numerator.shape[-1], denominator.size)
    found = np.zeros((n, n, size))
    found[..., : numerator.shape[-1]] -= numerator
    found[np.arange(n), np.arange(n), : denominator.size] += denominator
    return found


def sensitivity(T: ComplexArray) -> ComplexArray:
    """Return the sensitivity function S = I - T for each frequency."""
    return np.asarray(np.eye(T.shape[1]) - T, dtype=complex)


def kronecker(left: NDArray, right: NDArray) -> ComplexArray:
    """Return the Kronecker product left (x) right for each frequency."""
    product = np.einsum("kab,kcd->kacbd", left, right)
    rows, columns = left.shape[1] * right.shape[1], left.shape[2] * right.shape[2]
    return product.reshape(-1, rows, columns)


def _transposed(matrix: NDArray) -> NDArray:
    return np.swapaxes(matrix, 1, 2)


class _DesiredLaw:
    """Control laws that state the loop T, and ignore the noise model."""

    if TYPE_CHECKING:

        @property
        def desired(self) -> DesiredLoop:
            """Return T, and the zeros that it keeps."""

    def complementary(self, w: ArrayLike) -> ComplexArray:
        """See `ControlLaw`."""
        return self.desired.whole.at(w)

    def controller(self, G: ComplexArray, w: ArrayLike) -> ComplexArray:
        """Return the controller C = G^-1 T (I - T)^-1."""
        T = self.complementary(w)
        return np.linalg.inv(G) @ T @ np.linalg.inv(sensitivity(T))

    def noise_jacobian(self, G: ComplexArray, w: ArrayLike) -> None:
        """See `ControlLaw`."""
        return

    def loop_gradient(
        self, logarithmic: Array, relative_noise: ComplexArray, rule: Quadrature
    ) -> ComplexArray | None:
        """See `ControlLaw`."""
        return self.desired.gradient(logarithmic, rule)

    @cached_property
    def singularities(self) -> ComplexArray:
        """See `ControlLaw`."""
        whole = self.desired.whole
        numerator, d = whole.common_fraction()
        zeros = [determinant_and_adjugate(N)[0] for N in (complement(numerator, d), numerator)]
        return logarithmic_distance(np.append(whole.poles, all_roots(zeros)))


@dataclass(frozen=True)
class ModelReference(_DesiredLaw):
    """The law C = G^-1 T (I - T)^-1: the loop from reference to output is T, [rojas-asymptotic] (18)."""

    target: TransferMatrix

    @property
    def desired(self) -> DesiredLoop:
        """See `ControlLaw`."""
        return DesiredLoop(self.target)

    def check(self, plant: MatrixPlant, *, key: str) -> None:
        """See `ControlLaw`."""
        check_model_reference(plant, self.target, key=key)


@dataclass(frozen=True)
class InternalModel(_DesiredLaw):
    """The law of internal model control, C = (I - Q G)^-1 Q with Q = G^-1 T, T = b f I.

    f is the filter with the delay of the plant, b the all-pass of the zeros that G^-1 may not invert.
    """

    desired: DesiredLoop

    @classmethod
    def build(cls, plant: MatrixPlant, filter_: Rational) -> InternalModel:
        """Build the law with the delay, and the zeros outside the unit circle, of the plant in the loop."""
        missing = max(plant.inverse_delay - delay_of(filter_.numerator), 0)
        late = Rational(np.append(np.zeros(missing), filter_.numerator), filter_.denominator)
        outside = plant.zeros[np.abs(plant.zeros) > 1]
        return cls(DesiredLoop(TransferMatrix.diagonal(late, plant.outputs), outside))

    def check(self, plant: MatrixPlant, *, key: str) -> None:
        """See `ControlLaw`."""
        check_circle(plant, self.desired.whole, key=key)


@dataclass(frozen=True)
class MinimumVariance:
    """The minimum-variance law C = G^-1 (H E^-1 - I): the output is E e, E the first `delay` terms of H."""

    plant: MatrixPlant

    @property
    def desired(self) -> None:
        """See `ControlLaw`."""
        return None

    @property
    def delay(self) -> int:
        """Return the number of samples that pass before the input acts."""
        return self.plant.inverse_delay

    def unavoidable(self, w: ArrayLike) -> ComplexArray:
        """Return E (K, n, n), diagonal: the part of the noise that no controller can remove."""
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
        """Return d vec C / d vec H with E held, since its few terms are known far better than H pointwise."""
        return kronecker(_transposed(np.linalg.inv(self.unavoidable(w))), np.linalg.inv(G))

    def loop_gradient(
        self, logarithmic: Array, relative_noise: ComplexArray, rule: Quadrature
    ) -> ComplexArray | None:
        """Return dT = E H^-1 dH H^-1 - dE H^-1, with dE the first terms of dH, see `ControlLaw`."""
        H, q = self.plant.noise_at(rule.nodes)[:, None], unit_circle(rule.nodes)
        powers = q ** np.arange(self.delay)[:, None]
        terms = np.einsum("dk,klab->dlab", rule.weights / powers, H @ relative_noise).real
        dE = np.einsum("dk,dlab->klab", powers, terms)
        E = self.unavoidable(rule.nodes)[:, None]
        return np.asarray((E @ relative_noise - dE) @ np.linalg.inv(H))

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
        return np.append(self.plant.singularities, logarithmic_distance(all_roots(self._terms())))
