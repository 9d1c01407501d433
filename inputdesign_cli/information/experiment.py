"""What an excitation does to a plant: gradients of the prediction, information per frequency, powers."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from typing import Literal

import numpy as np
import scipy.linalg
from numpy.typing import ArrayLike, NDArray

from inputdesign_cli.errors import bad_spec
from inputdesign_cli.information.quadrature import Quadrature, graded_quadrature, integrate
from inputdesign_cli.plant import Loop, PolynomialModel, logarithmic_distance
from inputdesign_cli.plant.polynomial import Array, ComplexArray

PowerKind = Literal["input", "output", "excitation"]
POWER_KINDS: tuple[PowerKind, ...] = ("input", "output", "excitation")
_RANK_TOLERANCE = 1e-11


@dataclass(frozen=True)
class Experiment:
    """N samples of a model in a loop; `prior` (k, k) is information already at hand, in raw parameters.

    The excitation x is u in open loop and r in closed loop (u = r - C y).

    `factor` L (k, k), lower triangular, sets the coordinates of every gradient and information
    matrix: gradients are L^-1 F and M = L M~ L^T. Raw parameters correspond to L = I; there the
    information matrix easily has a condition number of 1e12, which no solver survives, so designs
    are computed in the coordinates of `whitened`.
    """

    loop: Loop
    samples: int
    prior: Array | None = None
    factor: Array | None = None

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

    def information_density(self, w: ArrayLike) -> NDArray[np.float64]:
        """(n, k, k): D with M = M0 + (1/2 pi) integral D(w) Phi_x(w) dw, for all N samples."""
        return (self.samples / self.model.variance) * _real_outer(self.excitation_gradient(w))

    def power_density(self, kind: PowerKind, w: ArrayLike) -> Array:
        """(n,): the factor on Phi_x that gives the spectrum of u_x, y_x or x itself."""
        if kind == "excitation":
            return np.ones_like(np.asarray(w, dtype=float))
        t = self.loop.responses(w)
        return np.abs(t.u_x if kind == "input" else t.y_x) ** 2

    @cached_property
    def baseline_information(self) -> Array:
        """(k, k): what is known without any excitation, by the noise in the loop and by `prior`."""

        def moments(rule: Quadrature) -> NDArray[np.float64]:
            F = self.noise_gradient(rule.nodes)
            return np.einsum("n,nij->ij", rule.weights, _real_outer(F), optimize=True)

        from_noise = self.samples * integrate(moments, self.singularities)
        if self.prior is None:
            return from_noise
        return from_noise + self.whiten_matrix(self.prior)

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
        scale = np.linalg.norm(stacked, axis=0)
        scale[scale == 0.0] = 1.0
        triangle = np.asarray(np.linalg.qr(stacked / scale, mode="r"))
        self._check_rank(triangle)
        return replace(self, factor=(triangle * scale).T)

    def whiten_matrix(self, information: Array) -> Array:
        """An information matrix (k, k) of raw parameters in these coordinates."""
        return self.whiten_rows(self.whiten_rows(information).T)

    @cached_property
    def _inverse_factor(self) -> Array:
        return scipy.linalg.solve_triangular(self.factor, np.eye(self.size), lower=True)

    def to_raw(self, information: Array) -> Array:
        """An information matrix of these coordinates in raw parameters."""
        if self.factor is None:
            return information
        return self.factor @ information @ self.factor.T

    def raw_covariance(self, information: Array) -> Array:
        """P = M^-1 in raw parameters, from an information matrix of these coordinates."""
        half = scipy.linalg.solve_triangular(np.linalg.cholesky(information), np.eye(self.size), lower=True)
        if self.factor is not None:
            half = scipy.linalg.solve_triangular(self.factor, half.T, lower=True, trans="T").T
        return half.T @ half

    def whiten_rows(self, rows: NDArray) -> NDArray:
        """Gradients (n, k) of raw parameters in these coordinates."""
        if self.factor is None:
            return rows
        return rows @ self._inverse_factor.T

    def _check_rank(self, triangle: Array) -> None:
        _, singular, vectors = np.linalg.svd(triangle)
        if singular[-1] > _RANK_TOLERANCE * singular[0]:
            return
        involved = np.abs(vectors[-1]) > 0.05 * np.abs(vectors[-1]).max()
        names = ", ".join(name for name, member in zip(self.model.names, involved, strict=True) if member)
        raise bad_spec(
            "not-identifiable",
            f"no excitation can tell these parameters apart: {names}",
            hint="look for a factor that B and A (or B and F, C and D, A and C) have in common, or for an "
            "order too high, and take it out",
            key="plant",
        )


def _real_outer(F: ComplexArray) -> NDArray[np.float64]:
    """Re(F F^*) for each frequency: (n, k) -> (n, k, k)."""
    return F.real[:, :, None] * F.real[:, None, :] + F.imag[:, :, None] * F.imag[:, None, :]
