"""The five polynomials of A y = (B/F) u + (C/D) e ([ljung-1999], Section 4.2): coefficients, names and roots.

B and F are matrices of polynomials, an entry for each output and input.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Self

import numpy as np
from numpy.typing import ArrayLike, NDArray

from inputdesign_cli.arrays import Array, ComplexArray, Rows
from inputdesign_cli.plant.frequencies import logarithmic_distance
from inputdesign_cli.plant.model import Parameter, Parametrised, entry_label, row_parameters
from inputdesign_cli.plant.polynomial import join_roots, roots_in_z


@dataclass(frozen=True)
class PolynomialStructure(Parametrised):
    """States which coefficients are free, their names and their values.

    A, C and D hold one polynomial, common to all outputs with common parameters, or one an output. Parameters
    are called by letter and power, with several channels also by output and input: `b1`, `b1[2,1]`, `a1[2]`;
    common coefficients go without: `a1`. An entry B_ij that is absent has no parameters.

    Attributes:
        delays: (p, r), the power of the first coefficient of each B that is free, its length where the entry
            is absent; if None, zeros of B say so.
    """

    B: Rows
    A: tuple[Array, ...]
    F: Rows
    C: tuple[Array, ...]
    D: tuple[Array, ...]
    covariance: Array
    delays: tuple[tuple[int, ...], ...] | None = None

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
        """Return all free coefficients, of A, B, C, D and F in turn."""
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

    @cached_property
    def letters(self) -> frozenset[str]:
        """The polynomials that have free coefficients."""
        return frozenset(parameter.letter for parameter in self.parameters)

    @property
    def outputs_count(self) -> bool:
        """Whether the gradient of the prediction depends on past outputs: by coefficients of A alone."""
        return "a" in self.letters

    def per_output(self, rows: Sequence[Array]) -> tuple[Array, ...]:
        """A, C or D as one polynomial an output, a common one repeated."""
        return tuple(rows) * self.outputs if len(rows) == 1 else tuple(rows)

    def row(self, rows: Sequence[Array], output: int) -> Array:
        """Return the polynomial of an output in A, C or D."""
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
        polynomials = (self.row(self.A, output), self.F[output][input], self.B[output][input])
        return logarithmic_distance(join_roots(roots_in_z(p) for p in polynomials))

    @property
    def stable_outputs(self) -> tuple[bool, ...]:
        """Output by output, whether its row of G is stable."""
        rows = [
            [a, *(f for j, f in enumerate(fs) if (i, j) in self.active)]
            for i, (a, fs) in enumerate(zip(self.per_output(self.A), self.F, strict=True))
        ]
        return tuple(all(np.all(np.abs(roots_in_z(p)) < 1.0) for p in row) for row in rows)

    def at(self, theta: ArrayLike, covariance: Array | None = None) -> Self:
        """Return the structure with parameters (k,) and, if given, noise covariance (p, p) of its own."""
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
        return replace(
            self,
            B=tuple(tuple(row) for row in B),
            A=tuple(rows["a"]),
            F=tuple(tuple(row) for row in F),
            C=tuple(rows["c"]),
            D=tuple(rows["d"]),
            covariance=self.covariance if covariance is None else covariance,
            delays=self.first,
        )
