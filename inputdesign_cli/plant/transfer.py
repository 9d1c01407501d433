"""Transfer functions: scalars in q^-1 and in s, and matrices in q^-1 with the scalar as their 1 x 1 case.

Denominators are kept in factors. A controller's slow pole next to z = 1 loses digits when it is multiplied
out, and the sensitivity function at low frequency depends on just those digits.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from functools import cached_property, reduce
from operator import or_
from typing import NamedTuple, Protocol

import numpy as np
import scipy
from numpy.polynomial.polynomial import polyval
from numpy.typing import ArrayLike

from inputdesign_cli.arrays import Array, ComplexArray
from inputdesign_cli.plant.frequencies import frequency_plane, logarithmic_distance
from inputdesign_cli.plant.polynomial import all_roots, at, delay_of, roots_in_z, stack

Coefficients = Sequence[float] | Array


class ScalarTransfer(Protocol):
    """A weight or a filter, whatever its variable."""

    def at(self, w: ArrayLike) -> ComplexArray:
        """Return the frequency response at frequencies `w`, in the same shape."""

    @property
    def pole_points(self) -> ComplexArray:
        """Return the poles as points of the frequency plane, frequency + j damping."""

    @property
    def zero_points(self) -> ComplexArray:
        """Return the zeros as points of the frequency plane."""

    @property
    def singularities(self) -> ComplexArray:
        """Return the poles and zeros together."""
        return np.concatenate([self.zero_points, self.pole_points])


@dataclass(frozen=True)
class Rational(ScalarTransfer):
    """A transfer function numerator / (product of the denominator factors), all in q^-1, ascending."""

    numerator: Array
    denominator: tuple[Array, ...] = (np.ones(1),)

    @classmethod
    def build(
        cls, numerator: Coefficients, denominator: Coefficients | Sequence[Coefficients] = (1.0,)
    ) -> Rational:
        """Build from plain numbers; `denominator` is one polynomial or a list of factors."""
        factors = [denominator] if np.ndim(denominator[0]) == 0 else denominator
        return cls(np.asarray(numerator, dtype=float), tuple(np.asarray(f, dtype=float) for f in factors))

    def at(self, w: ArrayLike) -> ComplexArray:
        """Return the frequency response at normalised frequencies `w`."""
        q = np.exp(-1j * np.asarray(w))
        return polyval(q, self.numerator) / _product_at(self.denominator, q)

    @cached_property
    def poles(self) -> ComplexArray:
        """Return the poles in z, factor by factor."""
        return all_roots(self.denominator)

    @cached_property
    def zeros(self) -> ComplexArray:
        """Return the zeros in z, those at the origin and at infinity left out."""
        return roots_in_z(self.numerator)

    @property
    def pole_points(self) -> ComplexArray:
        """Return the poles as points of the frequency plane."""
        return logarithmic_distance(self.poles)

    @property
    def zero_points(self) -> ComplexArray:
        """Return the zeros as points of the frequency plane."""
        return logarithmic_distance(self.zeros)

    @cached_property
    def denominator_polynomial(self) -> Array:
        """Return the product of the denominator factors."""
        return product_of(self.denominator)


@dataclass(frozen=True)
class ContinuousRational(ScalarTransfer):
    """A transfer function numerator / denominator in s, coefficients in descending powers."""

    numerator: Array
    denominator: Array

    def at(self, w: ArrayLike) -> ComplexArray:
        """Return the frequency response at frequencies `w` in rad per time unit."""
        s = 1j * np.asarray(w, dtype=float)
        return np.asarray(np.polyval(self.numerator, s) / np.polyval(self.denominator, s), dtype=complex)

    @property
    def pole_points(self) -> ComplexArray:
        """Return the poles as points of the frequency plane."""
        return frequency_plane(np.roots(self.denominator))

    @property
    def zero_points(self) -> ComplexArray:
        """Return the zeros as points of the frequency plane."""
        return frequency_plane(np.roots(self.numerator))


class Drive(NamedTuple):
    """The columns by which an input, `lag` samples earlier, enters states (n,) and outputs (q,)."""

    input: int
    lag: int
    states: Array
    outputs: Array


class StateSpace(NamedTuple):
    """A system x(t + 1) = A x + B v, z = C x + D v of n states, m inputs, q outputs."""

    A: Array
    B: Array
    C: Array
    D: Array

    def from_rest(self, v: Array) -> Array:
        """Return the outputs (.., N, q) that samples v (.., N, m) cause."""
        A, B, C, D = (M.T for M in self)
        x = np.zeros((*v.shape[:-2], len(A)))
        driven, found = v @ B, v @ D
        for t in range(v.shape[-2]):
            found[..., t, :] += x @ C
            x = x @ A + driven[..., t, :]
        return np.asarray(found)

    @classmethod
    def of_delayed_inputs(cls, A: Array, C: Array, drives: Sequence[Drive], inputs: int) -> StateSpace:
        """Return a system whose inputs act after lags: its states are their past, then the n states of A.

        Args:
            C: (q, n), the outputs by the states of A.
            drives: which input acts after which lag, on which states.
        """
        past = [max((one.lag for one in drives if one.input == j), default=0) for j in range(inputs)]
        first = np.concatenate([[0], np.cumsum(past)]).astype(int)
        own, size = slice(first[-1], None), first[-1] + len(A)
        full = cls(
            *(np.zeros(shape) for shape in ((size,) * 2, (size, inputs), (len(C), size), (len(C), inputs)))
        )
        full.A[own, own], full.C[:, own] = A, C
        for j, length in enumerate(past):
            full.A[first[j] : first[j + 1], first[j] : first[j + 1]] = np.eye(length, k=-1)
            full.B[first[j] : first[j] + min(length, 1), j] = 1.0
        for one in drives:
            column = first[one.input] + one.lag - 1 if one.lag else one.input
            into, at_once = (full.A, full.C) if one.lag else (full.B, full.D)
            into[own, column] += one.states
            at_once[:, column] += one.outputs
        return full

    @classmethod
    def of(cls, blocks: Iterable[tuple[Array, Array, Array]], direct: Array) -> StateSpace:
        """Join blocks (A, B, C) that share all inputs and whose outputs add up; D (q, m) is `direct`."""
        outputs, inputs = direct.shape
        none = (np.zeros((0, 0)), np.zeros((0, inputs)), np.zeros((outputs, 0)))
        A, B, C = zip(none, *blocks, strict=True)
        return cls(scipy.linalg.block_diag(*A), np.concatenate(B), np.concatenate(C, axis=1), direct)


@dataclass(frozen=True)
class TransferMatrix:
    """A matrix T = Q^-1 P in q^-1: `numerator` P (rows, columns, l), `factors` of each entry of diagonal Q.

    A denominator that several entries of a row share is kept once, so that its poles are not counted twice.
    With integral action on every output each input has one integrator.
    """

    numerator: Array
    factors: tuple[tuple[Array, ...], ...]

    @classmethod
    def build(
        cls, numerator: Sequence[Sequence[Coefficients]], denominator: Sequence[Sequence[Coefficients]]
    ) -> TransferMatrix:
        """Build from entries with a denominator each; zero entries have no poles."""
        rows = zip(numerator, denominator, strict=True)
        return cls.of([[Rational.build(*entry) for entry in zip(*row, strict=True)] for row in rows])

    @classmethod
    def of(cls, rows: Sequence[Sequence[Rational]]) -> TransferMatrix:
        """Build from entries with denominators in factors; a factor that a row shares is kept once."""
        tops, below = [], []
        for row in rows:
            own = [Counter(map(tuple, entry.denominator if np.any(entry.numerator) else ())) for entry in row]
            shared = reduce(or_, own)
            pairs = [(e.numerator, shared - factors) for e, factors in zip(row, own, strict=True)]
            tops.append([product_of([p, *rest.elements()]) if np.any(p) else p for p, rest in pairs])
            below.append(tuple(np.array(factor, dtype=float) for factor in shared.elements()))
        return cls(stack(tops), tuple(below))

    @classmethod
    def diagonal(cls, entry: Rational, size: int) -> TransferMatrix:
        """Return t(q) I of `size` rows."""
        return cls(np.eye(size)[:, :, None] * entry.numerator, (entry.denominator,) * size)

    @cached_property
    def denominator(self) -> tuple[Array, ...]:
        """Return the diagonal of Q, multiplied out."""
        return tuple(product_of(row) for row in self.factors)

    def at(self, w: ArrayLike) -> ComplexArray:
        """Return the frequency response T (n, rows, columns) at normalised frequencies `w` (n,)."""
        P, below = self.fraction_at(w)
        return P / below[:, :, None]

    def fraction_at(self, w: ArrayLike) -> tuple[ComplexArray, ComplexArray]:
        """Return P (n, rows, columns) and the diagonal of Q (n, rows) at normalised frequencies `w` (n,)."""
        q = np.exp(-1j * np.asarray(w))
        return at(self.numerator, q), np.stack([_product_at(row, q) for row in self.factors], axis=-1)

    def scaled(self, factor: Rational) -> TransferMatrix:
        """Return this matrix times a scalar transfer function."""
        rows = [[np.convolve(p, factor.numerator).tolist() for p in row] for row in self.numerator]
        return TransferMatrix(stack(rows), tuple((*row, *factor.denominator) for row in self.factors))

    def common_fraction(self) -> tuple[Array, Array]:
        """Return P' (rows, columns, l) and d (m,) with T = P' / d; factors that rows share are in d once."""
        own = [Counter(map(tuple, row)) for row in self.factors]
        shared: Counter[tuple[float, ...]] = reduce(or_, own)
        rows = [
            [product_of([p, *(shared - factors).elements()]).tolist() for p in row]
            for row, factors in zip(self.numerator, own, strict=True)
        ]
        return stack(rows), product_of(shared.elements())

    @property
    def poles(self) -> ComplexArray:
        """Return the poles in z."""
        return all_roots(factor for row in self.factors for factor in row)

    @property
    def memory(self) -> float:
        """Return the length of the longest polynomial, in samples."""
        return float(max([self.numerator.shape[-1], *(d.size for d in self.denominator)]))

    @cached_property
    def delay(self) -> int:
        """Return the number of samples by which every entry is delayed."""
        return delay_of(self.numerator)

    @property
    def realisation(self) -> StateSpace:
        """Return a realisation from columns to rows, row by row in the observer's canonical form."""
        outputs, inputs, length = self.numerator.shape
        direct = np.zeros((outputs, inputs))
        blocks = []
        for j, denominator in enumerate(self.denominator):
            n = max(length, denominator.size) - 1
            q, P = np.zeros(n + 1), np.zeros((n + 1, inputs))
            q[: denominator.size], P[:length] = denominator, self.numerator[j].T
            q, P = q / denominator[0], P / denominator[0]
            direct[j] = P[0]
            A, C = np.eye(n, k=1), np.zeros((outputs, n))
            if n:
                A[:, 0], C[j, 0] = -q[1:], 1.0
            blocks.append((A, P[1:] - np.outer(q[1:], P[0]), C))
        return StateSpace.of(blocks, direct)


def product_of(polynomials: Iterable[Coefficients]) -> Array:
    """Return the product of polynomials, 1 if there are none."""
    return reduce(np.convolve, (np.asarray(p, dtype=float) for p in polynomials), np.ones(1))


def _product_at(polynomials: Iterable[Array], q: ComplexArray) -> ComplexArray:
    value = np.ones_like(q)
    for polynomial in polynomials:
        value = value * polyval(q, polynomial)
    return value
