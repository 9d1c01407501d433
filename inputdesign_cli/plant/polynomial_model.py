"""Polynomial plants with several inputs and outputs: G, H and their gradients.

The five-polynomial form A y = (B/F) u + (C/D) e ([ljung-1999], Section 4.2) with a matrix of B and F.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike, NDArray

from inputdesign_cli.plant.filtering import filtered
from inputdesign_cli.plant.frequencies import logarithmic_distance
from inputdesign_cli.plant.model import (
    Fraction,
    Parameter,
    Parametrised,
    entry_label,
    input_gradients,
    noise_gradients,
    prediction_gradients,
    row_parameters,
)
from inputdesign_cli.plant.polynomial import (
    Array,
    ComplexArray,
    evaluate,
    frequencies_last,
    join_roots,
    power,
    roots_in_z,
    unit_circle,
)

Rows = tuple[tuple[Array, ...], ...]


@dataclass(frozen=True)
class PolynomialModel(Parametrised):
    """A_i y_i = sum_j (B_ij / F_ij) u_j + (C_i / D_i) e_i, e white with a full covariance (p, p).

    A, C and D hold one polynomial, common to all outputs with common parameters, or one an output. An
    entry B_ij that is absent has no parameters. Otherwise the rules and names are those of `PolynomialModel`,
    with output and input in brackets: `b1[2,1]`, `a1[2]`; common coefficients go without: `a1`.

    Attributes:
        delays: (p, r), the power of the first coefficient of each B that is free, its length where the entry
            is absent; None where zeros of B say so.
    """

    B: Rows
    A: tuple[Array, ...]
    F: Rows
    C: tuple[Array, ...]
    D: tuple[Array, ...]
    covariance: Array
    delays: tuple[tuple[int, ...], ...] | None = None

    continuous = False

    @classmethod
    def single(
        cls,
        B: ArrayLike,
        *,
        A: ArrayLike = (1.0,),
        C: ArrayLike = (1.0,),
        D: ArrayLike = (1.0,),
        F: ArrayLike = (1.0,),
        variance: float = 1.0,
    ) -> PolynomialModel:
        """One input and one output."""
        a, b, c, d, f = (np.asarray(p, dtype=float) for p in (A, B, C, D, F))
        return cls(((b,),), (a,), ((f,),), (c,), (d,), np.array([[variance]], dtype=float))

    @property
    def outputs(self) -> int:
        """Number of outputs p."""
        return len(self.B)

    @property
    def inputs(self) -> int:
        """Number of inputs r."""
        return len(self.B[0])

    @cached_property
    def parameters(self) -> tuple[Parameter, ...]:
        """All free coefficients: those of A, B, C, D, F in turn."""
        found: list[Parameter] = []
        for letter in "abcdf":
            if letter in "bf":
                found += self._entry_parameters(letter)
            else:
                rows = {"a": self.A, "c": self.C, "d": self.D}[letter]
                found += row_parameters(letter, rows, self.outputs, self.inputs)
        return tuple(found)

    def _entry_parameters(self, letter: str) -> list[Parameter]:
        found = []
        single = self.outputs == self.inputs == 1
        for i in range(self.outputs):
            for j in range(self.inputs):
                if (i, j) not in self.active:
                    continue
                first = self.first[i][j] if letter == "b" else 1
                values = self.B[i][j] if letter == "b" else self.F[i][j]
                label = entry_label(i, j, single=single)
                found += [
                    Parameter(letter, lag, ((i, j),), label, float(values[lag]))
                    for lag in range(first, len(values))
                ]
        return found

    @cached_property
    def active(self) -> tuple[tuple[int, int], ...]:
        """The entries (output, input) of G that are not absent."""
        places = ((i, j) for i in range(self.outputs) for j in range(self.inputs))
        return tuple((i, j) for i, j in places if self.first[i][j] < self.B[i][j].size)

    @cached_property
    def first(self) -> tuple[tuple[int, ...], ...]:
        """(p, r): `delays`, also where zeros of B say them."""
        if self.delays is not None:
            return self.delays
        return tuple(tuple(b.size - np.trim_zeros(b, "f").size for b in row) for row in self.B)

    @cached_property
    def at_once(self) -> NDArray[np.bool_]:
        """(p, r): see `Model`."""
        return np.array(
            [[(i, j) in self.active and not d for j, d in enumerate(row)] for i, row in enumerate(self.first)]
        )

    @property
    def memory(self) -> float:
        """The longest polynomials in a row, in samples: what they filter is forgotten after that."""
        rows = (self.A, self.C, self.D, *self.B, *self.F)
        return float(sum(max(p.size for p in row) for row in rows))

    @cached_property
    def in_plant(self) -> NDArray[np.bool_]:
        """(k,): the parameters on which G depends."""
        return np.array([parameter.letter in "abf" for parameter in self.parameters], dtype=bool)

    def per_output(self, rows: Sequence[Array]) -> tuple[Array, ...]:
        """A, C or D as one polynomial an output, a common one repeated."""
        return tuple(rows) * self.outputs if len(rows) == 1 else tuple(rows)

    def _row(self, rows: Sequence[Array], output: int) -> Array:
        return rows[0] if len(rows) == 1 else rows[output]

    @cached_property
    def singularities(self) -> ComplexArray:
        """Poles of G and of all gradients, as points of the frequency plane."""
        polynomials = [*self.A, *self.C, *self.D, *(p for row in self.F for p in row)]
        return logarithmic_distance(join_roots(roots_in_z(p) for p in polynomials))

    @property
    def radius(self) -> float:
        """See `Model`."""
        polynomials = [*self.A, *self.C, *self.D, *(p for row in self.F for p in row)]
        return float(np.abs(join_roots(roots_in_z(p) for p in polynomials)).max(initial=0.0))

    def entry_singularities(self, output: int, input: int) -> ComplexArray:
        """Poles and zeros of one entry of G, as points of the frequency plane."""
        polynomials = (self._row(self.A, output), self.F[output][input], self.B[output][input])
        return logarithmic_distance(join_roots(roots_in_z(p) for p in polynomials))

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
        """(k,): those of A and F of the entry, where both stand in its denominator."""
        both = len(self._row(self.A, output)) > 1 and len(self.F[output][input]) > 1
        return np.array(
            [both and p.letter in "af" and (output, input) in p.places for p in self.parameters], dtype=bool
        )

    def entry_fraction(self, output: int, input: int, w: ArrayLike) -> Fraction:
        """One entry of G as such a fraction, gradients (n, k), where none is bent."""
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
        return evaluate(self._row(self.A, i), q) * evaluate(self.F[i][j], q)

    def plant_gradient(self, w: ArrayLike) -> ComplexArray:
        """dG/dtheta (n, k, p, r)."""
        q = unit_circle(w)
        gradient = frequencies_last(q.size, len(self.parameters), self.outputs, self.inputs)
        factors: dict[tuple[str, int, int], ComplexArray] = {}
        for i, j in self.active:
            A, B, F = (evaluate(p, q) for p in (self._row(self.A, i), self.B[i][j], self.F[i][j]))
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

    @property
    def outputs_count(self) -> bool:
        """Whether the gradient of the prediction depends on past outputs: by coefficients of A alone."""
        return "a" in self.letters

    @cached_property
    def letters(self) -> frozenset[str]:
        """The polynomials that have free coefficients."""
        return frozenset(parameter.letter for parameter in self.parameters)

    def prediction_gradient(self, w: ArrayLike, y: NDArray, u: NDArray, e: NDArray) -> ComplexArray:
        """(n, k, p, m), see `Model`; epsilon_i = (D_i/C_i) (A_i y_i - sum_j (B_ij/F_ij) u_j)."""
        return _gradients([self], w, y.shape[2], y[None], u[None], e[None])[0]

    def at(self, theta: ArrayLike, covariance: Array | None = None) -> PolynomialModel:
        """The same structure with parameters (k,) and, if given, noise covariance (p, p) of its own."""
        B, F = ([[entry.copy() for entry in row] for row in rows] for rows in (self.B, self.F))
        common = {"a": self.A, "c": self.C, "d": self.D}
        rows = {letter: [polynomial.copy() for polynomial in given] for letter, given in common.items()}
        for parameter, value in zip(self.parameters, np.asarray(theta, dtype=float), strict=True):
            for i, j in parameter.places:
                if parameter.letter in rows:
                    own = rows[parameter.letter]
                    own[0 if len(own) == 1 else i][parameter.power] = value
                else:
                    (B if parameter.letter == "b" else F)[i][j][parameter.power] = value
        return PolynomialModel(
            tuple(tuple(row) for row in B),
            tuple(rows["a"]),
            tuple(tuple(row) for row in F),
            tuple(rows["c"]),
            tuple(rows["d"]),
            self.covariance if covariance is None else covariance,
            self.first,
        )

    def simulate(self, u: Array, e: Array, step: float) -> tuple[Array, Array]:
        """What u (.., n, r) and e (.., n, p) cause at the outputs (.., n, p), each from rest."""
        y, v = np.zeros((*u.shape[:-1], self.outputs)), np.empty(e.shape)
        for i, (a, c, d) in enumerate(zip(*map(self.per_output, (self.A, self.C, self.D)), strict=True)):
            v[..., i] = filtered(c, np.convolve(a, d), e[..., i])
            for j, (b, f) in enumerate(zip(self.B[i], self.F[i], strict=True)):
                if (i, j) in self.active:
                    y[..., i] += filtered(b, np.convolve(a, f), u[..., j])
        return y, v

    @property
    def stable_outputs(self) -> tuple[bool, ...]:
        """Output by output, whether its row of G is stable."""
        rows = [
            [a, *(f for j, f in enumerate(fs) if (i, j) in self.active)]
            for i, (a, fs) in enumerate(zip(self.per_output(self.A), self.F, strict=True))
        ]
        return tuple(all(np.all(np.abs(roots_in_z(p)) < 1.0) for p in row) for row in rows)


@input_gradients.register
def _input_gradients(first: PolynomialModel, models: Sequence[PolynomialModel], w: ArrayLike) -> ComplexArray:
    """(S, n, k, p, r): those of models of one structure."""
    G = np.stack([model.plant_at(w) for model in models]) if first.outputs_count else None
    u = np.eye(first.inputs, dtype=complex)[None, None]
    return _gradients(models, w, first.inputs, G, u, None)


@noise_gradients.register
def _noise_gradients(first: PolynomialModel, models: Sequence[PolynomialModel], w: ArrayLike) -> ComplexArray:
    """(S, n, k, p, p): those of models of one structure."""
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
    """(S, n, k, p, m): those of models of one structure."""
    return _gradients(models, w, y.shape[-1], y, u, e)


def _gradients(
    models: Sequence[PolynomialModel],
    w: ArrayLike,
    sources: int,
    y: NDArray | None,
    u: NDArray | None,
    e: NDArray | None,
) -> ComplexArray:
    """(S, n, k, p, m): `prediction_gradient` of models of one structure, by the polynomials of the predictor.

    Args:
        y, u, e: (S, n, p or r, m); None stands for nothing, and a length of one for the same everywhere.
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
