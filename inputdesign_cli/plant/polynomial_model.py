"""Polynomial plants A y = (B/F) u + (C/D) e ([ljung-1999], Section 4.2): G, H, their gradients, simulations.

B and F are matrices of polynomials, an entry for each output and input.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Self

import numpy as np
from numpy.polynomial.polynomial import polyvander
from numpy.typing import ArrayLike, NDArray

from inputdesign_cli.arrays import Array, ComplexArray, Rows
from inputdesign_cli.plant.filtering import filtered
from inputdesign_cli.plant.frequencies import logarithmic_distance
from inputdesign_cli.plant.model import (
    Fraction,
    Parameter,
    Parametrised,
    Signals,
    entry_label,
    prediction_gradients,
    row_parameters,
    tables_at,
)
from inputdesign_cli.plant.polynomial import all_roots, at, roots_in_z, stack
from inputdesign_cli.plant.transfer import StateSpace, TransferMatrix, product_of


@dataclass(frozen=True)
class PolynomialModel(Parametrised):
    """A model A_i y_i = sum_j (B_ij / F_ij) u_j + (C_i / D_i) e_i, e white with a full covariance (p, p).

    A, C and D hold one polynomial, common to all outputs with common parameters, or one an output. Parameters
    are called by letter and power, with several channels also by output and input: `b1`, `b1[2,1]`, `a1[2]`;
    common coefficients go without: `a1`. An absent entry B_ij has no parameters. `delays` (p, r) are the
    powers of the first free coefficients of B, or its lengths if absent; if None, numbers of leading zeros.
    """

    B: Rows
    A: tuple[Array, ...]
    F: Rows
    C: tuple[Array, ...]
    D: tuple[Array, ...]
    covariance: Array
    delays: tuple[tuple[int, ...], ...] | None = None

    continuous = False
    integrates = False
    repeated_integrators = 0

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
    ) -> Self:
        """Build a model of one input and one output."""
        a, b, c, d, f = (np.asarray(p, dtype=float) for p in (A, B, C, D, F))
        return cls(((b,),), (a,), ((f,),), (c,), (d,), np.array([[variance]], dtype=float))

    @cached_property
    def outputs(self) -> int:
        """Return the number of outputs p."""
        return len(self.B)

    @cached_property
    def inputs(self) -> int:
        """Return the number of inputs r."""
        return len(self.B[0])

    @cached_property
    def parameters(self) -> tuple[Parameter, ...]:
        """Return all free coefficients, of A, B, C, D and F in turn."""
        found: list[Parameter] = []
        common, entries = {"a": self.A, "c": self.C, "d": self.D}, {"b": self.B, "f": self.F}
        for letter in "abcdf":
            if letter in common:
                found += row_parameters(letter, common[letter], self.outputs, self.inputs)
                continue
            rows = entries[letter]
            for i, j in self.active:
                label = entry_label(i, j, single=self.outputs == self.inputs == 1)
                lags = range(self.first[i][j] if letter == "b" else 1, len(rows[i][j]))
                found += [Parameter(letter, lag, ((i, j),), label, float(rows[i][j][lag])) for lag in lags]
        return tuple(found)

    @cached_property
    def active(self) -> tuple[tuple[int, int], ...]:
        """Return the entries (output, input) of G that are not absent."""
        places = ((i, j) for i in range(self.outputs) for j in range(self.inputs))
        return tuple((i, j) for i, j in places if self.first[i][j] < self.B[i][j].size)

    @cached_property
    def first(self) -> tuple[tuple[int, ...], ...]:
        """Return `delays`, or where they are None the numbers of leading zeros of B, (p, r)."""
        if self.delays is not None:
            return self.delays
        return tuple(tuple(b.size - np.trim_zeros(b, "f").size for b in row) for row in self.B)

    @cached_property
    def at_once(self) -> NDArray[np.bool_]:
        """Return the entries of G that may act without delay, (p, r), see `Model`."""
        return np.array(
            [[(i, j) in self.active and not d for j, d in enumerate(row)] for i, row in enumerate(self.first)]
        )

    @property
    def memory(self) -> float:
        """Return the sum of the lengths of the longest polynomials, see `Model`."""
        rows = (self.A, self.C, self.D, *self.B, *self.F)
        return float(sum(max(p.size for p in row) for row in rows))

    @cached_property
    def in_plant(self) -> NDArray[np.bool_]:
        """Return whether G depends on each parameter, (k,)."""
        return np.array([parameter.letter in "abf" for parameter in self.parameters], dtype=bool)

    @cached_property
    def letters(self) -> frozenset[str]:
        """Return the polynomials that have free coefficients."""
        return frozenset(parameter.letter for parameter in self.parameters)

    def per_output(self, rows: Sequence[Array]) -> tuple[Array, ...]:
        """Return A, C or D as one polynomial an output, a common one repeated."""
        return tuple(rows) * self.outputs if len(rows) == 1 else tuple(rows)

    def row(self, rows: Sequence[Array], output: int) -> Array:
        """Return the polynomial of an output in A, C or D."""
        return rows[0] if len(rows) == 1 else rows[output]

    @cached_property
    def poles(self) -> ComplexArray:
        """Return the poles in z of G, H and their gradients."""
        return np.concatenate([all_roots(self.A), self.predictor_poles])

    @cached_property
    def predictor_poles(self) -> ComplexArray:
        """See `SampledPlant`."""
        return all_roots([*self.C, *self.D, *(f for row in self.F for f in row)])

    @cached_property
    def singularities(self) -> ComplexArray:
        """Return the poles of G and of all gradients, as points of the frequency plane."""
        return logarithmic_distance(self.poles)

    @property
    def radius(self) -> float:
        """See `Model`."""
        return float(np.abs(self.poles).max(initial=0.0))

    @property
    def plant_points(self) -> ComplexArray:
        """Return the poles of G alone, as points of the frequency plane."""
        return logarithmic_distance(all_roots([*self.A, *(f for row in self.F for f in row)]))

    def entry_singularities(self, output: int, input: int) -> ComplexArray:
        """Return the poles and zeros of one entry of G, as points of the frequency plane."""
        polynomials = (self.row(self.A, output), self.F[output][input], self.B[output][input])
        return logarithmic_distance(all_roots(polynomials))

    @property
    def stable_outputs(self) -> tuple[bool, ...]:
        """Return whether each output's row of G is stable."""
        rows = [
            [a, *(f for j, f in enumerate(fs) if (i, j) in self.active)]
            for i, (a, fs) in enumerate(zip(self.per_output(self.A), self.F, strict=True))
        ]
        return tuple(all(np.all(np.abs(roots_in_z(p)) < 1.0) for p in row) for row in rows)

    def at(self, theta: ArrayLike, covariance: Array | None = None) -> Self:
        """Return the structure with parameters (k,) and, if given, noise covariance (p, p) of its own."""
        tables: dict[str, Sequence[Array | Sequence[Array]]] = {
            "a": self.A,
            "b": self.B,
            "c": self.C,
            "d": self.D,
            "f": self.F,
        }
        a, b, c, d, f = tables_at(self.parameters, theta, tables).values()
        noise = self.covariance if covariance is None else covariance
        return replace(self, A=a, B=b, C=c, D=d, F=f, covariance=noise, delays=self.first)

    def plant_at(self, w: ArrayLike) -> ComplexArray:
        """Return the frequency response G as (n, p, r)."""
        q = _turn(w)
        G = np.zeros((q.size, self.outputs, self.inputs), dtype=complex)
        for i, j in self.active:
            A, B, F = _values(self._entries[i][j], q)
            G[:, i, j] = B / (A * F)
        return G

    def noise_at(self, w: ArrayLike) -> ComplexArray:
        """Return the noise filter H (n, p, p), diagonal and monic, at normalised frequencies `w`."""
        q = _turn(w)
        H = np.zeros((q.size, self.outputs, self.outputs), dtype=complex)
        for i, rows in enumerate(zip(*map(self.per_output, (self.A, self.C, self.D)), strict=True)):
            A, C, D = (_values(row, q) for row in rows)
            H[:, i, i] = C / (A * D)
        return H

    def bends(self, output: int, input: int) -> NDArray[np.bool_]:
        """Return a mask (k,) of parameters of A and F of the entry, if both stand in its denominator."""
        both = len(self.row(self.A, output)) > 1 and len(self.F[output][input]) > 1
        return np.array(
            [both and p.letter in "af" and (output, input) in p.places for p in self.parameters], dtype=bool
        )

    def entry_fraction(self, output: int, input: int, w: ArrayLike) -> Fraction:
        """Return one entry of G as a `Fraction` with gradients (n, k), where no parameter bends it."""
        q = _turn(w)
        above = np.zeros((q.size, len(self.parameters)), dtype=complex)
        below = np.zeros_like(above)
        for index, parameter in enumerate(self.parameters):
            if parameter.letter in "abf" and (output, input) in parameter.places:
                gradient = above if parameter.letter == "b" else below
                gradient[:, index] = q**parameter.power
        A, B, F = _values(self._entries[output][input], q)
        return Fraction(B, A * F, above, below)

    @cached_property
    def _entries(self) -> list[list[Array]]:
        """Return A_i, B_ij and F_ij of each entry, as (3, l)."""
        rows = zip(self.per_output(self.A), self.B, self.F, strict=True)
        return [[stack([[a, b, f]])[0] for b, f in zip(bs, fs, strict=True)] for a, bs, fs in rows]

    def plant_gradient(self, w: ArrayLike) -> ComplexArray:
        """Return the gradient dG/dtheta as (n, k, p, r)."""
        q = _turn(w)
        powers = _powers(q, self.parameters)
        # Frequencies lie side by side in memory.
        shape = (len(self.parameters), self.outputs, self.inputs, q.size)
        gradient = np.zeros(shape, dtype=complex).transpose(3, 0, 1, 2)
        factors: dict[tuple[str, int, int], ComplexArray] = {}
        for i, j in self.active:
            A, B, F = _values(self._entries[i][j], q)
            AF = A * F
            factors["b", i, j] = 1.0 / AF
            for letter, own in (("a", A), ("f", F)):
                if letter in self.letters:
                    factors[letter, i, j] = -B / (own * AF)
        for index, parameter in enumerate(self.parameters):
            if parameter.letter in "abf":
                for i, j in parameter.places:
                    if (parameter.letter, i, j) in factors:
                        gradient[:, index, i, j] = factors[parameter.letter, i, j] * powers[parameter.power]
        return gradient

    def prediction_gradient(self, w: ArrayLike, y: Signals, u: Signals, e: Signals) -> ComplexArray:
        """Return psi (n, k, p, m), see `Model`; epsilon_i = (D_i/C_i) (A_i y_i - sum_j (B_ij/F_ij) u_j)."""
        return _gradients(self, [self], w, *(x if x is None else x[None] for x in (y, u, e)))[0]

    def simulate(self, u: Array, e: Array, step: float) -> tuple[Array, Array]:
        """Return the outputs (.., n, p) that u (.., n, r) and e (.., n, p) cause, each from rest."""
        y, v = np.zeros((*u.shape[:-1], self.outputs)), np.empty(e.shape)
        for i, (a, c, d) in enumerate(zip(*map(self.per_output, (self.A, self.C, self.D)), strict=True)):
            v[..., i] = filtered(c, np.convolve(a, d), e[..., i])
            for j, (b, f) in enumerate(zip(self.B[i], self.F[i], strict=True)):
                if (i, j) in self.active:
                    y[..., i] += filtered(b, np.convolve(a, f), u[..., j])
        return y, v

    @cached_property
    def _fractions(self) -> Array:
        """Return R_i = A_i prod_j F_ij of each output, and the numerators N_ij of R G, (p, 1 + r, l)."""
        rows = [
            [product_of([a, *f]).tolist()]
            + [product_of([b, *f[:j], *f[j + 1 :]]).tolist() for j, b in enumerate(self.B[i])]
            for i, (a, f) in enumerate(zip(self.per_output(self.A), self.F, strict=True))
        ]
        return stack(rows)

    @cached_property
    def realisation(self) -> StateSpace:
        """See `SampledPlant`."""
        return TransferMatrix(self._fractions[:, 1:], tuple((R,) for R in self._fractions[:, 0])).realisation

    @property
    def noise_gain(self) -> Array:
        """See `SampledPlant`: the noise adds to the first state of an output, which R feeds back."""
        return self.realisation.A @ self.realisation.C.T

    def left_at(self, w: ArrayLike) -> tuple[ComplexArray, ComplexArray]:
        """See `SampledPlant`."""
        values = at(self._fractions, _turn(w))
        return values[..., 0, None] * np.eye(self.outputs), values[..., 1:]

    def forcing_at(self, w: ArrayLike) -> ComplexArray:
        """See `SampledPlant`: prod_j F_ij C_i / D_i."""
        q = _turn(w)
        found = np.zeros((q.size, self.outputs, self.outputs), dtype=complex)
        rows = zip(self.F, self.per_output(self.C), self.per_output(self.D), strict=True)
        for i, (f, c, d) in enumerate(rows):
            found[:, i, i] = _values(product_of([*f, c]), q) / _values(d, q)
        return found

    def forcing(self, e: Array) -> Array:
        """See `SampledPlant`."""
        rows = zip(self.F, self.per_output(self.C), self.per_output(self.D), strict=True)
        return np.stack(
            [filtered(product_of([*f, c]), d, e[..., i]) for i, (f, c, d) in enumerate(rows)], axis=-1
        )


def _turn(w: ArrayLike) -> ComplexArray:
    """Return q^-1 at normalised frequencies `w`, as (n,).

    At w - j rho it is on a circle of radius e^-rho: the transform of signals weighted with e^(-rho t).
    """
    return np.exp(-1j * np.ravel(w)).astype(complex)


def _values(polynomials: Array, q: ComplexArray) -> ComplexArray:
    """Return the values (.., n) of polynomials (.., l) at `q` (n,); in place, thrice as fast as `polyval`."""
    value = np.zeros((*polynomials.shape[:-1], q.size), dtype=complex)
    value += polynomials[..., -1, None]
    for lag in range(polynomials.shape[-1] - 2, -1, -1):  # Horner
        value *= q
        value.real += polynomials[..., lag, None]
    return value


def _values_of_each(
    polynomials: Mapping[tuple[str, int, int], Sequence[Array]], q: ComplexArray
) -> dict[tuple[str, int, int], ComplexArray]:
    """Return values (S, 1, n) at `q` of polynomials of S models each; of constants (S, 1, 1)."""
    tables = {key: np.array(one) for key, one in polynomials.items()}
    found = {key: one[:, None].astype(complex) for key, one in tables.items() if one.shape[1] == 1}
    varying = [key for key, one in tables.items() if one.shape[1] > 1]
    if varying:
        longest = max(tables[key].shape[1] for key in varying)
        rows = np.zeros((len(varying), len(tables[varying[0]]), longest))
        for row, key in zip(rows, varying, strict=True):
            row[:, : tables[key].shape[1]] = tables[key]
        found |= dict(zip(varying, _values(rows, q)[:, :, None], strict=True))
    return found


def _powers(q: ComplexArray, parameters: Sequence[Parameter]) -> ComplexArray:
    """Return the powers of q (n,) from q^0 to the highest of these parameters, (number, n)."""
    return np.asarray(polyvander(q, max((p.power for p in parameters), default=0)).T, dtype=complex)


@prediction_gradients.register
def _gradients(
    first: PolynomialModel,
    models: Sequence[PolynomialModel],
    w: ArrayLike,
    y: Signals,
    u: Signals,
    e: Signals,
) -> ComplexArray:
    """Return the prediction gradients (S, n, k, p, m) of models of one structure, by polynomials."""
    (sources,) = {x.shape[-1] for x in (u, e) if x is not None}
    if y is None and "a" in first.letters:
        cause = np.asarray(e if u is None else u)[0]
        y = np.stack([(m.noise_at(w) if u is None else m.plant_at(w)) @ cause for m in models])
    letters = first.letters
    active = first.active if u is not None else ()
    wanted = {("c", i, 0): [m.row(m.C, i) for m in models] for i in range(first.outputs)}
    wanted |= {("d", i, 0): [m.row(m.D, i) for m in models] for i in range(first.outputs)}
    wanted |= {("f", i, j): [m.F[i][j] for m in models] for i, j in active}
    if "f" in letters:
        wanted |= {("b", i, j): [m.B[i][j] for m in models] for i, j in active}
    y, u, e = (x if x is None else x.transpose(0, 2, 3, 1) for x in (y, u, e))
    q = _turn(w)
    powers, at_q = _powers(q, first.parameters), _values_of_each(wanted, q)
    shape = (len(models), len(first.parameters), first.outputs, sources, q.size)
    gradient = np.zeros(shape, dtype=complex)
    noise: dict[tuple[str, int], ComplexArray] = {}
    for i in range(first.outputs):
        C, D = at_q["c", i, 0], at_q["d", i, 0]
        if y is not None and "a" in letters:
            noise["a", i] = (-D / C) * y[:, i]
        if e is not None and "c" in letters:
            noise["c", i] = e[:, i] / C
        if e is not None and "d" in letters:
            noise["d", i] = -e[:, i] / D
    plant: dict[tuple[str, int, int], ComplexArray] = {}
    for i, j in active:
        assert u is not None
        F = at_q["f", i, j]
        filtered = at_q["d", i, 0] / (at_q["c", i, 0] * F)
        plant["b", i, j] = filtered * u[:, j]
        if "f" in letters:
            plant["f", i, j] = (-filtered * at_q["b", i, j] / F) * u[:, j]
    for index, parameter in enumerate(first.parameters):
        if parameter.letter in "bf":
            i, j = parameter.places[0]
            if (parameter.letter, i, j) in plant:
                gradient[:, index, i] = powers[parameter.power] * plant[parameter.letter, i, j]
            continue
        outputs, _ = zip(*parameter.places, strict=True)
        for i in set(outputs):
            if (parameter.letter, i) in noise:
                gradient[:, index, i] = powers[parameter.power] * noise[parameter.letter, i]
    return gradient.transpose(0, 4, 1, 2, 3)
