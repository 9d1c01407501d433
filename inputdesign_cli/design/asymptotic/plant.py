"""A square-or-not matrix of polynomials A y = (B/F) u + (C/D) e, evaluated pointwise with its gradients."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike

from inputdesign_cli.design.asymptotic.polynomials import (
    delay_of,
    determinant_and_adjugate,
    stack,
)
from inputdesign_cli.plant.frequencies import logarithmic_distance
from inputdesign_cli.plant.polynomial import (
    Array,
    ComplexArray,
    evaluate,
    join_roots,
    roots_in_z,
    unit_circle,
)

Rows = tuple[tuple[Array, ...], ...]


@dataclass(frozen=True)
class MatrixPlant:
    """y_i = sum_j B_ij/(A_i F_ij) u_j + C_i/(A_i D_i) e_i, e white with a covariance.

    Attributes:
        A, C, D: one polynomial for each output, monic.
        B, F: rows (outputs) of columns (inputs).
        covariance: (n, n) of e.
        common_A: whether all outputs share the parameters of A.
    """

    A: tuple[Array, ...]
    B: Rows
    F: Rows
    C: tuple[Array, ...]
    D: tuple[Array, ...]
    covariance: Array
    common_A: bool = True

    @classmethod
    def build(
        cls,
        *,
        B: Sequence[Sequence[Sequence[float]]],
        covariance: ArrayLike,
        A: Sequence[Sequence[float]] | None = None,
        F: Sequence[Sequence[Sequence[float]]] | None = None,
        C: Sequence[Sequence[float]] | None = None,
        D: Sequence[Sequence[float]] | None = None,
        common_A: bool = True,
    ) -> MatrixPlant:
        """From plain numbers; absent polynomials are 1."""
        outputs = len(B)

        def each(given: Sequence[Sequence[float]] | None) -> tuple[Array, ...]:
            return tuple(np.asarray(p, dtype=float) for p in given or [[1.0]] * outputs)

        def matrix(given: Sequence[Sequence[Sequence[float]]]) -> Rows:
            return tuple(tuple(np.asarray(p, dtype=float) for p in row) for row in given)

        ones = [[[1.0] for _ in row] for row in B]
        return cls(
            A=each(A),
            B=matrix(B),
            F=matrix(F or ones),
            C=each(C),
            D=each(D),
            covariance=np.asarray(covariance, dtype=float),
            common_A=common_A,
        )

    @property
    def outputs(self) -> int:
        """The number of outputs."""
        return len(self.B)

    @property
    def inputs(self) -> int:
        """The number of inputs."""
        return len(self.B[0])

    def plant_at(self, w: ArrayLike) -> ComplexArray:
        """G (K, outputs, inputs) at normalised frequencies `w` (K,)."""
        q = unit_circle(w)
        rows = [
            [evaluate(b, q) / (evaluate(a, q) * evaluate(f, q)) for b, f in zip(above, below, strict=True)]
            for a, above, below in zip(self.A, self.B, self.F, strict=True)
        ]
        return np.moveaxis(np.array(rows), -1, 0)

    def noise_at(self, w: ArrayLike) -> ComplexArray:
        """H (K, n, n), diagonal and monic, at normalised frequencies `w` (K,)."""
        q = unit_circle(w)
        H = np.zeros((q.size, self.outputs, self.outputs), dtype=complex)
        for i, (a, c, d) in enumerate(zip(self.A, self.C, self.D, strict=True)):
            H[:, i, i] = evaluate(c, q) / (evaluate(a, q) * evaluate(d, q))
        return H

    def disturbance_at(self, w: ArrayLike) -> ComplexArray:
        """Phi_v (K, n, n), the spectrum of the noise at the outputs."""
        H = self.noise_at(w)
        return H @ self.covariance @ np.conj(np.swapaxes(H, 1, 2))

    @cached_property
    def _parameters(self) -> tuple[tuple[str, str, int, int, int], ...]:
        """(name, letter, output, input, lag) of each free parameter; output -1: common to all."""
        found: list[tuple[str, str, int, int, int]] = []
        single = self.outputs == self.inputs == 1

        def add(letter: str, polynomial: Array, i: int, j: int, first: int, place: str) -> None:
            for lag in range(first, polynomial.size):
                found.append((f"{letter}{lag}{'' if single else place}", letter, i, j, lag))

        if self.common_A:
            add("a", self.A[0], -1, -1, 1, "")
        else:
            for i, a in enumerate(self.A):
                add("a", a, i, -1, 1, f"[{i + 1}]")
        for i, row in enumerate(self.B):
            for j, b in enumerate(row):
                start = int(np.flatnonzero(b)[0]) if np.any(b) else b.size
                add("b", b, i, j, start, f"[{i + 1},{j + 1}]")
        for letter, each in (("c", self.C), ("d", self.D)):
            for i, p in enumerate(each):
                add(letter, p, i, -1, 1, f"[{i + 1}]")
        for i, row in enumerate(self.F):
            for j, f in enumerate(row):
                add("f", f, i, j, 1, f"[{i + 1},{j + 1}]")
        return tuple(found)

    @cached_property
    def names(self) -> tuple[str, ...]:
        """Parameter names, `a1`, `b1[1,2]`, in the order of the gradients."""
        return tuple(p[0] for p in self._parameters)

    def gradients(self, w: ArrayLike) -> tuple[ComplexArray, ComplexArray]:
        """dG (K, k, outputs, inputs) and dH (K, k, outputs, outputs) at normalised frequencies `w`."""
        q = unit_circle(w)
        G, H = self.plant_at(w), self.noise_at(w)
        dG = np.zeros((q.size, len(self._parameters), self.outputs, self.inputs), dtype=complex)
        dH = np.zeros((q.size, len(self._parameters), self.outputs, self.outputs), dtype=complex)
        for index, (_, letter, i, j, lag) in enumerate(self._parameters):
            shift = q**lag
            if letter == "a":
                for row in range(self.outputs) if i < 0 else (i,):
                    factor = shift / evaluate(self.A[row], q)
                    dG[:, index, row, :] = -factor[:, None] * G[:, row, :]
                    dH[:, index, row, row] = -factor * H[:, row, row]
            elif letter == "b":
                dG[:, index, i, j] = shift / (evaluate(self.A[i], q) * evaluate(self.F[i][j], q))
            elif letter == "c":
                dH[:, index, i, i] = H[:, i, i] * shift / evaluate(self.C[i], q)
            elif letter == "d":
                dH[:, index, i, i] = -H[:, i, i] * shift / evaluate(self.D[i], q)
            else:
                dG[:, index, i, j] = -G[:, i, j] * shift / evaluate(self.F[i][j], q)
        return dG, dH

    @cached_property
    def numerator(self) -> Array:
        """N (outputs, inputs, l): G = R^-1 N with R diagonal, R_i = A_i prod_j F_ij."""
        rows = []
        for above, below in zip(self.B, self.F, strict=True):
            row = []
            for j, b in enumerate(above):
                product = b
                for other, f in enumerate(below):
                    product = np.convolve(product, f) if other != j else product
                row.append(product.tolist())
            rows.append(row)
        return stack(rows)

    @cached_property
    def _inverse(self) -> tuple[Array, Array]:
        return determinant_and_adjugate(self.numerator)

    @cached_property
    def regular(self) -> bool:
        """Whether the square G has an inverse at all."""
        return bool(np.any(self._inverse[0]))

    @cached_property
    def inverse_delay(self) -> int:
        """The least d for which q^-d G^-1 is causal."""
        det, adj = self._inverse
        return delay_of(det) - delay_of(adj)

    @cached_property
    def delay(self) -> int:
        """The least delay among the entries of G."""
        return delay_of(self.numerator)

    @cached_property
    def zeros(self) -> ComplexArray:
        """Transmission zeros in z of the square G (with stable ones that cancel against F)."""
        return roots_in_z(self._inverse[0])

    @cached_property
    def singularities(self) -> ComplexArray:
        """Poles and zeros of G and H as points of the frequency plane."""
        parts = [roots_in_z(p) for each in (self.A, self.C, self.D) for p in each]
        parts += [roots_in_z(f) for row in self.F for f in row]
        parts += [self.zeros] if self.outputs == self.inputs and self.regular else []
        return logarithmic_distance(join_roots(parts))
