"""Polynomial plants with several inputs and outputs: G, H, their gradients, and simulations."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from inputdesign_cli.arrays import Array, ComplexArray
from inputdesign_cli.plant.filtering import filtered
from inputdesign_cli.plant.model import Fraction, input_gradients, noise_gradients, prediction_gradients
from inputdesign_cli.plant.polynomial import evaluate, frequencies_last, power, unit_circle
from inputdesign_cli.plant.polynomial_structure import PolynomialStructure


@dataclass(frozen=True)
class PolynomialModel(PolynomialStructure):
    """A_i y_i = sum_j (B_ij / F_ij) u_j + (C_i / D_i) e_i, e white with a full covariance (p, p)."""

    continuous = False

    def plant_at(self, w: ArrayLike) -> ComplexArray:
        """G (n, p, r)."""
        q = unit_circle(w)
        G = np.zeros((q.size, self.outputs, self.inputs), dtype=complex)
        for i, j in self.active:
            G[:, i, j] = evaluate(self.B[i][j], q) / self._denominator(q, i, j)
        return G

    def noise_at(self, w: ArrayLike) -> ComplexArray:
        """H (n, p, p), diagonal and monic, at normalised frequencies `w`."""
        q = unit_circle(w)
        H = np.zeros((q.size, self.outputs, self.outputs), dtype=complex)
        for i, (a, c, d) in enumerate(zip(*map(self.per_output, (self.A, self.C, self.D)), strict=True)):
            H[:, i, i] = evaluate(c, q) / (evaluate(a, q) * evaluate(d, q))
        return H

    def bends(self, output: int, input: int) -> NDArray[np.bool_]:
        """Return (k,), True for parameters of A and F of the entry if both stand in its denominator."""
        both = len(self.row(self.A, output)) > 1 and len(self.F[output][input]) > 1
        return np.array(
            [both and p.letter in "af" and (output, input) in p.places for p in self.parameters], dtype=bool
        )

    def entry_fraction(self, output: int, input: int, w: ArrayLike) -> Fraction:
        """Return one entry of G as a `Fraction` with gradients (n, k), where no parameter bends it."""
        q = unit_circle(w)
        above = np.zeros((q.size, len(self.parameters)), dtype=complex)
        below = np.zeros_like(above)
        for index, parameter in enumerate(self.parameters):
            if parameter.letter in "abf" and (output, input) in parameter.places:
                gradient = above if parameter.letter == "b" else below
                gradient[:, index] = power(q, parameter.power)
        numerator = evaluate(self.B[output][input], q)
        return Fraction(numerator, self._denominator(q, output, input), above, below)

    def _denominator(self, q: ComplexArray, i: int, j: int) -> ComplexArray:
        return evaluate(self.row(self.A, i), q) * evaluate(self.F[i][j], q)

    def plant_gradient(self, w: ArrayLike) -> ComplexArray:
        """dG/dtheta (n, k, p, r)."""
        q = unit_circle(w)
        gradient = frequencies_last(q.size, len(self.parameters), self.outputs, self.inputs)
        factors: dict[tuple[str, int, int], ComplexArray] = {}
        for i, j in self.active:
            A, B, F = (evaluate(p, q) for p in (self.row(self.A, i), self.B[i][j], self.F[i][j]))
            AF = A * F
            factors["b", i, j] = 1.0 / AF
            factors |= {(x, i, j): -B / (own * AF) for x, own in (("a", A), ("f", F)) if x in self.letters}
        for index, parameter in enumerate(self.parameters):
            if parameter.letter in "abf":
                shift = power(q, parameter.power)
                for i, j in parameter.places:
                    if (parameter.letter, i, j) in factors:
                        gradient[:, index, i, j] = factors[parameter.letter, i, j] * shift
        return gradient

    def input_gradient(self, w: ArrayLike) -> ComplexArray:
        """H^-1 dG/dtheta (n, k, p, r)."""
        return _input_gradients(self, [self], w)[0]

    def noise_gradient(self, w: ArrayLike) -> ComplexArray:
        """H^-1 dH/dtheta (n, k, p, p)."""
        return _noise_gradients(self, [self], w)[0]

    def prediction_gradient(self, w: ArrayLike, y: NDArray, u: NDArray, e: NDArray) -> ComplexArray:
        """(n, k, p, m), see `Model`; epsilon_i = (D_i/C_i) (A_i y_i - sum_j (B_ij/F_ij) u_j)."""
        return _gradients([self], w, y.shape[2], y[None], u[None], e[None])[0]

    def simulate(self, u: Array, e: Array, step: float) -> tuple[Array, Array]:
        """What u (.., n, r) and e (.., n, p) cause at the outputs (.., n, p), each from rest."""
        y, v = np.zeros((*u.shape[:-1], self.outputs)), np.empty(e.shape)
        for i, (a, c, d) in enumerate(zip(*map(self.per_output, (self.A, self.C, self.D)), strict=True)):
            v[..., i] = filtered(c, np.convolve(a, d), e[..., i])
            for j, (b, f) in enumerate(zip(self.B[i], self.F[i], strict=True)):
                if (i, j) in self.active:
                    y[..., i] += filtered(b, np.convolve(a, f), u[..., j])
        return y, v


@input_gradients.register
def _input_gradients(first: PolynomialModel, models: Sequence[PolynomialModel], w: ArrayLike) -> ComplexArray:
    """Return the input gradients (S, n, k, p, r) of models of one structure."""
    G = np.stack([model.plant_at(w) for model in models]) if first.outputs_count else None
    u = np.eye(first.inputs, dtype=complex)[None, None]
    return _gradients(models, w, first.inputs, G, u, None)


@noise_gradients.register
def _noise_gradients(first: PolynomialModel, models: Sequence[PolynomialModel], w: ArrayLike) -> ComplexArray:
    """Return the noise gradients (S, n, k, p, p) of models of one structure."""
    H = np.stack([model.noise_at(w) for model in models]) if first.outputs_count else None
    e = np.eye(first.outputs, dtype=complex)[None, None]
    return _gradients(models, w, first.outputs, H, None, e)


@prediction_gradients.register
def _prediction_gradients(
    first: PolynomialModel,
    models: Sequence[PolynomialModel],
    w: ArrayLike,
    y: NDArray,
    u: NDArray,
    e: NDArray,
) -> ComplexArray:
    """Return the prediction gradients (S, n, k, p, m) of models of one structure."""
    return _gradients(models, w, y.shape[-1], y, u, e)


def _gradients(
    models: Sequence[PolynomialModel],
    w: ArrayLike,
    sources: int,
    y: NDArray | None,
    u: NDArray | None,
    e: NDArray | None,
) -> ComplexArray:
    """Return `prediction_gradient` (S, n, k, p, m) of models of one structure, by polynomials.

    Args:
        y, u, e: (S, n, p or r, m); None is a zero signal; axes of length one are broadcast.
    """
    first, q = models[0], unit_circle(w)
    gradient = np.zeros((len(models), len(first.parameters), first.outputs, sources, q.size), dtype=complex)

    def values(polynomials: Iterable[Array]) -> ComplexArray:
        coefficients = np.array(list(polynomials))
        if coefficients.shape[1] == 1:  # the same at every frequency: (S, 1, 1)
            return coefficients[:, None].astype(complex)
        return evaluate(coefficients, q)[:, None]

    C = [values(m.per_output(m.C)[i] for m in models) for i in range(first.outputs)]
    D = [values(m.per_output(m.D)[i] for m in models) for i in range(first.outputs)]
    y, u, e = (x if x is None else x.transpose(0, 2, 3, 1) for x in (y, u, e))
    noise: dict[tuple[str, int], ComplexArray] = {}
    for i in range(first.outputs):
        if y is not None and "a" in first.letters:
            noise["a", i] = (-D[i] / C[i]) * y[:, i]
        if e is not None and "c" in first.letters:
            noise["c", i] = e[:, i] / C[i]
        if e is not None and "d" in first.letters:
            noise["d", i] = -e[:, i] / D[i]
    plant: dict[tuple[str, int, int], ComplexArray] = {}
    for i, j in first.active:
        if u is None:
            break
        F = values(m.F[i][j] for m in models)
        filtered = D[i] / (C[i] * F)
        plant["b", i, j] = filtered * u[:, j]
        if "f" in first.letters:
            plant["f", i, j] = (-filtered * values(m.B[i][j] for m in models) / F) * u[:, j]
    for index, parameter in enumerate(first.parameters):
        if parameter.letter in "bf":
            i, j = parameter.places[0]
            if (parameter.letter, i, j) in plant:
                gradient[:, index, i] = power(q, parameter.power) * plant[parameter.letter, i, j]
            continue
        for i in {place[0] for place in parameter.places}:
            if (parameter.letter, i) in noise:
                gradient[:, index, i] = power(q, parameter.power) * noise[parameter.letter, i]
    return gradient.transpose(0, 4, 1, 2, 3)
