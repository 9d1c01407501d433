"""The design problem in one object: plant, control law, reference and limits."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike

from inputdesign_cli.arrays import Array, ComplexArray
from inputdesign_cli.design.convex.limits import PowerLimit
from inputdesign_cli.design.loop_error.closed_form import adjoint, best_spectrum, power_of, weight
from inputdesign_cli.design.loop_error.laws import ControlLaw, sensitivity
from inputdesign_cli.design.loop_error.limits import LimitedDesign, design_within
from inputdesign_cli.design.loop_error.parametric import ParametricCriterion
from inputdesign_cli.design.loop_error.plant import MatrixPlant
from inputdesign_cli.information import Experiment
from inputdesign_cli.information.experiment import of_channel
from inputdesign_cli.information.quadrature import Quadrature, graded_quadrature
from inputdesign_cli.plant.frequencies import logarithmic_distance
from inputdesign_cli.plant.model import Model, noise_gradients
from inputdesign_cli.plant.transfer import Rational

_SETTLED = 1e-11
_HALVINGS = 4
_WHITE = Rational(np.ones(1))


@dataclass(frozen=True)
class LoopErrorProblem:
    """The error E||y - y0||^2 of the loop with the controller designed on the model, and the input limits.

    Attributes:
        estimated: the model in the estimated parameters, with the G and H of `plant`. None if they are all
            coefficients of `plant`.
        reference_variance: (n,) variances of the white noise behind the reference, one for each output.
        reference_filter: the filter that colours it.
        band: normalised frequencies inside which the input may have power. The asymptotic
            covariance is infinite outside, so there the error is counted inside only.
    """

    plant: MatrixPlant
    law: ControlLaw
    limits: tuple[PowerLimit, ...]
    reference_variance: Array
    reference_filter: Rational = _WHITE
    band: tuple[float, float] = (0.0, np.pi)
    estimated: Model | None = None

    @property
    def structure(self) -> Model:
        """Return the model in the parameters that are estimated."""
        return self.plant if self.estimated is None else self.estimated

    def entering(self, w: ArrayLike) -> ComplexArray:
        """Return the spectrum Phi_r + Phi_v (K, n, n) that drives the error of the loop."""
        noise = self.plant.disturbance_at(w)
        reference = np.abs(self.reference_filter.at(w))[:, None, None] ** 2 * np.diag(self.reference_variance)
        return np.asarray(noise + reference)

    def target(self, w: ArrayLike) -> ComplexArray:
        """Return Z^T (K, n, n), the weight of Phi^-1, [rojas-asymptotic] (19)."""
        plant = self.plant
        Z = weight(self.law.complementary(w), plant.plant_at(w), self.entering(w), plant.disturbance_at(w))
        return np.swapaxes(Z, 1, 2)

    @cached_property
    def experiment(self) -> Experiment:
        """Return one sample of the model structure, in open loop and within the band."""
        return Experiment(self.structure, 1, self.band)

    def metrics(self, w: ArrayLike) -> ComplexArray:
        """Return the weights M_i (p, K, n, n) of the limits: mean tr(M_i Phi) is the limited power."""
        each = (of_channel(self.experiment.response(one.kind, w), one.channel) for one in self.limits)
        return np.array([adjoint(R) @ R for R in each])

    @cached_property
    def most(self) -> Array:
        """Return the limits on the powers, (p,)."""
        return np.array([limit.bound for limit in self.limits])

    @cached_property
    def singularities(self) -> ComplexArray:
        """Return the points of the frequency plane at which integrands over frequency are not analytic."""
        reference = logarithmic_distance(self.reference_filter.poles)
        return np.concatenate([self.plant.singularities, self.law.singularities, reference])

    def rule(self, refine: int, *, band: bool = True) -> Quadrature:
        """Return nodes and weights of means over frequency, inside the band or over all of the circle."""
        lo, hi = self.band if band else (0.0, np.pi)
        return graded_quadrature(self.singularities, lo=lo, hi=hi, refine=refine)

    def asymptotic(self) -> tuple[LimitedDesign, Quadrature, float]:
        """Return the best spectrum at the nodes of a rule, the rule, and the relative change of its means.

        The rule is the coarsest whose mean of an optimum agrees with halved panels.
        """

        def total(rule: Quadrature) -> float:
            A = self.target(rule.nodes)
            outer = power_of(self._price(1.0 / (len(self.limits) * self.most), rule.nodes), 0.5)
            root = power_of(outer @ A @ outer, 0.5)
            return float(np.trace(root, axis1=1, axis2=2).real @ rule.weights)

        rule = self.rule(0)
        value, change = total(rule), np.inf
        for refine in range(1, _HALVINGS + 1):
            rule = self.rule(refine)
            before, value = value, total(rule)
            change = abs(value - before) / max(abs(value), 1e-300)
            if change <= _SETTLED:
                break
        design = design_within(self.target(rule.nodes), self.metrics(rule.nodes), self.most, rule.weights)
        return design, rule, change

    def spectrum_at(self, w: ArrayLike, multipliers: Array, scale: float = 1.0) -> ComplexArray:
        """Return the Phi (K, n, n) of the multipliers at any frequencies; zero outside the band."""
        w = np.asarray(w, dtype=float)
        Phi = scale * best_spectrum(self.target(w), self._price(multipliers, w))
        inside = (w >= self.band[0] * (1 - 1e-12)) & (w <= self.band[1] * (1 + 1e-12))
        return np.where(inside[:, None, None], Phi, 0.0)

    def _price(self, multipliers: Array, w: ArrayLike) -> ComplexArray:
        return np.asarray(np.einsum("p,pkab->kab", multipliers, self.metrics(w)))

    def model_of_noise_part(self) -> float:
        """Return J_o, the error due to the noise model, whatever the input (zero if C ignores H).

        The variance of vec Delta H is Lambda^-T (x) Phi_v.
        """
        rule = self.rule(1, band=False)
        w, Y = rule.nodes, self.law.by_noise(rule.nodes)
        if Y is None:
            return 0.0
        S, inverse = sensitivity(self.law.complementary(w)), np.linalg.inv(self.plant.covariance)
        passed = np.einsum("kab,kbc,kac->k", S, self.plant.disturbance_at(w), np.conj(S)).real
        entering = np.einsum("kab,kbc,kdc,da->k", Y, self.entering(w), np.conj(Y), inverse).real
        return float(passed * entering @ rule.weights)

    def parametric(self) -> ParametricCriterion:
        """Return the criterion tr(W P) of the model structure."""
        plant, model, rule = self.plant, self.structure, self.rule(1, band=False)
        w = rule.nodes
        dG, relative = model.plant_gradient(w), noise_gradients([model], w)[0]  # H^-1 dH of the noise
        T, inverse = self.law.complementary(w), np.linalg.inv(plant.plant_at(w))
        X = -sensitivity(T)[:, None] @ dG @ (inverse @ T)[:, None]
        moved = self.law.loop_gradient(np.einsum("kab,klba->kl", inverse, dG), relative, rule)
        X = X if moved is None else X + moved
        W = np.einsum("klab,kbc,kmac,k->lm", X, self.entering(w), np.conj(X), rule.weights).real
        return ParametricCriterion(W, self.experiment)
