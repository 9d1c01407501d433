"""What an excitation does to a plant: gradients of the prediction, information per frequency, powers."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from inputdesign_cli.information.coordinates import Coordinates, factor_of
from inputdesign_cli.information.quadrature import Quadrature, graded_quadrature, integrate
from inputdesign_cli.plant import Fraction, Loop, PolynomialModel, logarithmic_distance
from inputdesign_cli.plant.polynomial import Array, ComplexArray

PowerKind = Literal["input", "output", "excitation"]
POWER_KINDS: tuple[PowerKind, ...] = ("input", "output", "excitation")


@dataclass(frozen=True)
class Experiment(Coordinates):
    """N samples of a model in a loop; `prior` (k, k) is information already at hand, in raw parameters.

    The excitation x is u in open loop and r in closed loop (u = r - C y).

    `factor` sets its `Coordinates`; designs are computed in those of `whitened`.
    """

    loop: Loop
    samples: int
    prior: Array | None = None
    factor: Array | None = None

    band = (0.0, np.pi)
    inputs = 1

    @property
    def model(self) -> PolynomialModel:
        return self.loop.model

    @property
    def size(self) -> int:
        """Number of parameters k."""
        return len(self.model.names)

    @cached_property
    def singularities(self) -> ComplexArray:
        """Poles of all densities below, as points angle + j damping of the frequency plane."""
        return logarithmic_distance(self.loop.poles)

    def excitation_gradient(self, w: ArrayLike) -> ComplexArray:
        """F_x (n, k): what x contributes to the gradient of the prediction.

        F_u = Lambda_G / H in open loop, F_r = S Lambda_G / H in closed loop (least-costly paper,
        below (4) and (15)).
        """
        t = self.loop.responses(w)
        return self.whiten_rows(self.model.prediction_gradient(w, t.y_x, t.u_x, np.zeros_like(t.y_x)))

    def noise_gradient(self, w: ArrayLike) -> ComplexArray:
        """F_e or F_v (n, k): what e contributes, Lambda_H / H - C S Lambda_G (least-costly paper, (15))."""
        t = self.loop.responses(w)
        return self.whiten_rows(self.model.prediction_gradient(w, t.y_e, t.u_e, np.ones_like(t.y_e)))

    def plant_gradient(self, w: ArrayLike) -> ComplexArray:
        """Lambda_G (n, k): the gradient of G, in these coordinates."""
        return self.whiten_rows(self.model.plant_gradient(w))

    def plant_fraction(self, w: ArrayLike) -> Fraction:
        """G as numerator over denominator, their gradients (n, k) in these coordinates."""
        part = self.model.fraction(w)
        return replace(
            part,
            numerator_gradient=self.whiten_rows(part.numerator_gradient),
            denominator_gradient=self.whiten_rows(part.denominator_gradient),
        )

    def information_density(self, w: ArrayLike) -> NDArray[np.float64]:
        """(n, k, k): D with M = M0 + (1/2 pi) integral D(w) Phi_x(w) dw, for all N samples."""
        return (self.samples / self.model.variance) * _real_outer(self.excitation_gradient(w))

    def value_density(self, weight: Array, w: ArrayLike) -> Array:
        """(n,): the density of tr(Y (M - M0)) for a fixed Y = `weight` (k, k)."""
        F = self.excitation_gradient(w)
        scale = self.samples / self.model.variance
        return scale * np.einsum("ni,ij,nj->n", F.conj(), weight, F, optimize=True).real

    def power_density(self, kind: PowerKind, w: ArrayLike, channel: int | None = None) -> Array:
        """(n,): the factor on Phi_x that gives the spectrum of u_x, y_x or x itself.

        `channel` is for plants with several channels; here the sum over the channels is the only one.
        """
        if kind == "excitation":
            return np.ones_like(np.asarray(w, dtype=float))
        t = self.loop.responses(w)
        return np.abs(t.u_x if kind == "input" else t.y_x) ** 2

    @cached_property
    def noise_information(self) -> Array:
        """(k, k): what N samples tell without any excitation, by the noise alone (in the loop)."""

        def moments(rule: Quadrature) -> NDArray[np.float64]:
            F = self.noise_gradient(rule.nodes)
            return np.einsum("n,nij->ij", rule.weights, _real_outer(F), optimize=True)

        return self.samples * integrate(moments, self.singularities)

    @property
    def baseline_information(self) -> Array:
        """(k, k): what is known without any excitation, by the noise in the loop and by `prior`."""
        return self.noise_information + self.prior_information

    def whitened(self, power: float) -> Experiment:
        """The same experiment in coordinates where white excitation of this power gives M = I.

        L comes from a QR factorisation of the gradients themselves, never from M: that halves the
        digits lost to an ill-conditioned parametrisation.

        Raises:
            SpecError: `not-identifiable` when even white excitation cannot tell parameters apart.
        """
        rule = graded_quadrature(self.singularities)
        raw = replace(self, factor=None)
        excited = (
            raw.excitation_gradient(rule.nodes)
            * np.sqrt(rule.weights * (power * self.samples / self.model.variance))[:, None]
        )
        noise = raw.noise_gradient(rule.nodes) * np.sqrt(rule.weights * self.samples)[:, None]
        rows = [excited.real, excited.imag, noise.real, noise.imag]
        if self.prior is not None:
            eigenvalues, vectors = np.linalg.eigh(self.prior)
            rows.append(np.sqrt(np.maximum(eigenvalues, 0.0))[:, None] * vectors.T)
        stacked = np.concatenate(rows)
        return replace(self, factor=factor_of(stacked, self.model.names, excitation="excitation"))


def _real_outer(F: ComplexArray) -> NDArray[np.float64]:
    """Re(F F^*) for each frequency: (n, k) -> (n, k, k)."""
    return F.real[:, :, None] * F.real[:, None, :] + F.imag[:, :, None] * F.imag[:, None, :]
