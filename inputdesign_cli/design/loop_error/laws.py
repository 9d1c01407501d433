"""Control laws whose response at a frequency depends on the plant at that frequency only.

All have the form C = G^-1 X with X free of G at that frequency, so that Delta C = -G^-1 Delta G C,
[rojas-asymptotic] Section VII. X may depend on a few numbers that all frequencies determine together: the
zeros outside the circle, or the first terms of H. Their variance stays bounded as the model order grows, so
the asymptotic covariance leaves it out. The exact covariance of a model structure includes it, by
`loop_gradient`. Arrays are (K, n, n) over K frequencies.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike

from inputdesign_cli.arrays import Array, ComplexArray
from inputdesign_cli.design.loop_error.plant import MatrixPlant
from inputdesign_cli.errors import SpecError, bad_spec
from inputdesign_cli.information.quadrature import Quadrature
from inputdesign_cli.plant.filtering import filtered
from inputdesign_cli.plant.frequencies import logarithmic_distance
from inputdesign_cli.plant.polynomial import (
    all_roots,
    at,
    delay_of,
    determinant_and_adjugate,
    multiply,
    roots_in_z,
)
from inputdesign_cli.plant.transfer import Rational, TransferMatrix

# A zero this close to the unit circle counts as on it.
_ON_CIRCLE = 1e-7
_VANISHES = 1e-7


class ControlLaw(ABC):
    """A control law: the loop T that it gives, its controller and their derivatives."""

    @property
    def desired(self) -> DesiredLoop | None:
        """Return T, and the zeros that it keeps. None if T follows from the noise."""
        return None

    @abstractmethod
    def complementary(self, w: ArrayLike) -> ComplexArray:
        """Return T = G C (I + G C)^-1, the loop that the true plant would give."""

    def controller(self, G: ComplexArray, w: ArrayLike) -> ComplexArray:
        """Return the controller C(G) = G^-1 T (I - T)^-1."""
        T = self.complementary(w)
        return np.linalg.inv(G) @ T @ np.linalg.inv(sensitivity(T))

    def by_noise(self, w: ArrayLike) -> ComplexArray | None:
        """Return Y (K, n, n), where an error of H moves the loop by S Delta H Y. None if C ignores H."""
        return None

    @abstractmethod
    def loop_gradient(
        self, logarithmic: Array, relative_noise: ComplexArray, rule: Quadrature
    ) -> ComplexArray | None:
        """Return dT (K, k, n, n) at the nodes as the parameters of the model move. None if T is fixed.

        Args:
            logarithmic: (K, k), d log det G = tr(G^-1 dG).
            relative_noise: (K, k, n, n), H^-1 dH.
            rule: nodes and weights of means over [0, pi].
        """

    @abstractmethod
    def check(self, plant: MatrixPlant, *, key: str) -> None:
        """Raise `SpecError` unless the controller can run: causal, stable, and finite on the circle.

        Its codes are `delay-too-short`, `non-minimum-phase`, `infinite-criterion`, `no-feedback` and
        `not-supported`.
        """

    @property
    @abstractmethod
    def singularities(self) -> ComplexArray:
        """Return poles, and zeros of S, as points of the frequency plane."""


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


@dataclass(frozen=True)
class DesiredLoop(ControlLaw):
    """The law that states the loop T = b F: F is `free`, b the all-pass of plant zeros outside the circle.

    It ignores the noise model. A controller can have b only from the model, so b errs with the model.

    Attributes:
        outside: the zeros in z that b keeps. None stands for a law that keeps no zeros, so that b is one.
    """

    free: TransferMatrix
    outside: ComplexArray | None = None

    @property
    def desired(self) -> DesiredLoop:
        """Return the loop itself."""
        return self

    @cached_property
    def kept(self) -> Rational:
        """Return the all-pass b of the plant, with gain one at frequency zero."""
        if self.outside is None or not self.outside.size:
            return Rational(np.ones(1))
        above = np.poly(self.outside).real
        below = np.poly(1 / np.conj(self.outside)).real
        return Rational(np.sum(below) / np.sum(above) * above, (np.asarray(below, dtype=float),))

    @cached_property
    def whole(self) -> TransferMatrix:
        """Return the desired loop T of the plant."""
        return self.free.scaled(self.kept)

    def complementary(self, w: ArrayLike) -> ComplexArray:
        """Return T, see `ControlLaw`."""
        return self.whole.at(w)

    def mirrored(self, determinants: Array) -> Array:
        """Return polynomials m (runs, l) for determinants (runs, l); determinant / m is the all-pass b.

        Zeros outside the circle are mirrored into it, and the value at frequency zero stays.
        """
        if self.outside is None:
            return determinants
        found = determinants.copy()
        for row in found:
            roots = roots_in_z(row)
            far = np.abs(roots) > 1
            if np.any(far):
                first = int(np.flatnonzero(row)[0])
                inside = np.poly(np.where(far, 1 / np.conj(roots), roots)).real
                row[first : first + inside.size] = np.sum(row) / np.sum(inside) * inside
        return found

    def loop_gradient(
        self, logarithmic: Array, relative_noise: ComplexArray, rule: Quadrature
    ) -> ComplexArray | None:
        """Return dT as b errs with the model, see `ControlLaw`; None if b is one.

        A zero z_i that moves by dz_i adds -dz_i / (z - z_i) to d log det G, its only poles outside the
        circle. With P their sum, d log b = 2j Im P on the circle.
        """
        if self.outside is None or not self.outside.size:
            return None
        # P = N / D with D = prod (z - z_i): its terms z^1 .. z^m are the terms of d log det G.
        D = np.poly(self.outside).real[::-1]
        m, z = self.outside.size, 1 / np.exp(-1j * rule.nodes)
        waves = rule.weights * z ** -np.arange(1, m + 1)[:, None]
        terms = (waves @ logarithmic).real
        terms = np.concatenate([-(D[m - 1 :: -1] @ terms)[None], terms])
        above = [sum(D[j] * terms[i - j] for j in range(i + 1)) for i in range(m)]
        P = (z[:, None] ** np.arange(m) @ np.array(above)) / np.polyval(D[::-1], z)[:, None]
        return np.asarray(2j * P.imag[:, :, None, None] * self.whole.at(rule.nodes)[:, None])

    @cached_property
    def singularities(self) -> ComplexArray:
        """Return poles and zeros of T and zeros of S, see `ControlLaw`."""
        numerator, d = self.whole.common_fraction()
        zeros = [determinant_and_adjugate(N)[0] for N in (complement(numerator, d), numerator)]
        return logarithmic_distance(np.append(self.whole.poles, all_roots(zeros)))

    def check(self, plant: MatrixPlant, *, key: str) -> None:
        """Raise `SpecError`, see `ControlLaw`: a law that keeps no zeros must also be causal and stable."""
        _check_circle(plant, self.whole, key)
        if self.outside is not None:
            return
        det, adj = determinant_and_adjugate(plant.numerator)
        if delay_of(multiply(adj, self.whole.common_fraction()[0])) < delay_of(det):
            need = plant.inverse_delay
            message = (
                f"the desired loop has a delay of {_samples(self.whole.delay)}, the inverse of the plant "
                f"needs {_samples(need)}: the controller would not be causal"
            )
            hint = (
                f"begin the numerator in q^-1 with {need} {'zero' if need == 1 else 'zeros'} (in s, lower "
                "its degree below that of the denominator), or use internal_model, which adds the delay"
            )
            raise bad_spec("delay-too-short", message, hint=hint, key=key)
        outside = _not_cancelled(plant.zeros[np.abs(plant.zeros) > 1], self.whole)
        if outside.size:
            raise _unstable(outside, key)


class ModelReference(DesiredLoop):
    """The law C = G^-1 T (I - T)^-1: the loop from reference to output is T, [rojas-asymptotic] (18)."""


class InternalModel(DesiredLoop):
    """The law of internal model control, C = (I - Q G)^-1 Q with Q = G^-1 T, T = b f I.

    f is the filter with the delay of the plant, b the all-pass of the zeros that G^-1 may not invert.
    """

    @classmethod
    def build(cls, plant: MatrixPlant, filter_: Rational) -> InternalModel:
        """Build the law with the delay, and the zeros outside the unit circle, of the plant in the loop."""
        missing = max(plant.inverse_delay - delay_of(filter_.numerator), 0)
        late = Rational(np.append(np.zeros(missing), filter_.numerator), filter_.denominator)
        outside = plant.zeros[np.abs(plant.zeros) > 1]
        return cls(TransferMatrix.diagonal(late, plant.outputs), outside)


@dataclass(frozen=True)
class MinimumVariance(ControlLaw):
    """The minimum-variance law C = G^-1 (H E^-1 - I): the output is E e, E the first terms of H."""

    plant: MatrixPlant

    def unavoidable(self, w: ArrayLike) -> ComplexArray:
        """Return E (K, n, n), diagonal: the part of the noise that no controller can remove."""
        q = np.exp(-1j * np.ravel(w))
        E = np.zeros((q.size, self.plant.outputs, self.plant.outputs), dtype=complex)
        for i, terms in enumerate(self._terms):
            E[:, i, i] = np.polynomial.polynomial.polyval(q, terms)
        return E

    def complementary(self, w: ArrayLike) -> ComplexArray:
        """Return T = I - E H^-1, see `ControlLaw`."""
        return sensitivity(self.unavoidable(w) @ np.linalg.inv(self.plant.noise_at(w)))

    def by_noise(self, w: ArrayLike) -> ComplexArray:
        """Return H^-1 = E^-1 S with E held, since its few terms are known far better than H pointwise."""
        return np.asarray(np.linalg.inv(self.plant.noise_at(w)))

    def loop_gradient(
        self, logarithmic: Array, relative_noise: ComplexArray, rule: Quadrature
    ) -> ComplexArray | None:
        """Return dT = E H^-1 dH H^-1 - dE H^-1, with dE the first terms of dH, see `ControlLaw`."""
        H, q = self.plant.noise_at(rule.nodes)[:, None], np.exp(-1j * rule.nodes)
        powers = q ** np.arange(self.plant.inverse_delay)[:, None]
        terms = np.einsum("dk,klab->dlab", rule.weights / powers, H @ relative_noise).real
        dE = np.einsum("dk,dlab->klab", powers, terms)
        E = self.unavoidable(rule.nodes)[:, None]
        return np.asarray((E @ relative_noise - dE) @ np.linalg.inv(H))

    @cached_property
    def _terms(self) -> list[Array]:
        """Return the terms of H by output, as many as samples pass before the input acts."""
        plant = self.plant
        impulse = np.eye(1, plant.inverse_delay)[0]
        return [
            filtered(c, np.convolve(a, d), impulse)
            for a, c, d in zip(*map(plant.per_output, (plant.A, plant.C, plant.D)), strict=True)
        ]

    @property
    def singularities(self) -> ComplexArray:
        """Return the singularities of the plant, and the zeros of E; see `ControlLaw`."""
        return np.append(self.plant.singularities, logarithmic_distance(all_roots(self._terms)))

    def check(self, plant: MatrixPlant, *, key: str) -> None:
        """Raise `SpecError` unless the plant has one delay and no zeros outside, see `ControlLaw`."""
        _check_circle(plant, None, key)
        outside = plant.zeros[np.abs(plant.zeros) > 1]
        if outside.size:
            raise _unstable(outside, key)
        if np.abs(self.complementary(np.linspace(0.1, 3.0, 30))).max(axis=(0, 2)).min() < _VANISHES:
            raise bad_spec(
                "no-feedback",
                "the noise of some output cannot be predicted beyond the delay, so minimum-variance control "
                "leaves it alone and asks nothing of the model there",
                hint="give the noise poles or zeros (C, D or A), or use another law",
                key=key,
            )
        if plant.inverse_delay != plant.delay:
            raise bad_spec(
                "not-supported",
                "this version designs minimum-variance control for plants with one delay in all directions; "
                f"here it lies between {_samples(plant.delay)} and {_samples(plant.inverse_delay)}",
                hint="use internal_model or model_reference",
                key=key,
            )


def check_invertible(plant: MatrixPlant, *, key: str) -> None:
    """Raise `SpecError` (`singular-plant`) if the determinant of the square G is zero everywhere."""
    if not plant.regular:
        message = "the determinant of the plant vanishes at every frequency, so no controller can invert it"
        hint = "check the gains, or leave out one input and one output"
        raise bad_spec("singular-plant", message, hint=hint, key=key)


def _check_circle(plant: MatrixPlant, target: TransferMatrix | None, key: str) -> None:
    """Raise if a zero of the plant lies on the unit circle where `target` does not vanish."""
    on = plant.zeros[np.abs(np.abs(plant.zeros) - 1) <= _ON_CIRCLE]
    on = on if target is None else _not_cancelled(on, target)
    if on.size:
        raise bad_spec(
            "infinite-criterion",
            f"the plant has a zero on the unit circle at {abs(np.angle(on[0])):.4g} rad/sample, where the "
            "controller would have a pole: the error of the loop is infinite, whatever the input",
            hint="let the desired loop vanish there, or move the zero inside",
            key=key,
        )


def _not_cancelled(zeros: ComplexArray, target: TransferMatrix) -> ComplexArray:
    """Return the zeros at which the desired loop does not vanish."""
    values = np.abs(at(target.numerator, 1 / zeros)).max(axis=(1, 2))
    return zeros[values > _VANISHES * np.abs(target.numerator).sum(axis=2).max()]


def _unstable(zeros: ComplexArray, key: str) -> SpecError:
    worst = zeros[np.argmax(np.abs(zeros))]
    return bad_spec(
        "non-minimum-phase",
        f"the plant has a zero outside the unit circle (radius {abs(worst):.4g}, "
        f"{abs(np.angle(worst)):.4g} rad/sample): the controller inverts it and would be unstable",
        hint="use internal_model, which keeps such zeros in the loop",
        key=key,
    )


def _samples(count: int) -> str:
    return "no sample" if count == 0 else "1 sample" if count == 1 else f"{count} samples"
