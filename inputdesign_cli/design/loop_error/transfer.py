"""Square transfer matrices over one denominator: the desired closed loop, a filter of the reference."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
import scipy.signal
from numpy.typing import ArrayLike

from inputdesign_cli.plant.polynomial import Array, ComplexArray, evaluate, roots_in_z, unit_circle
from inputdesign_cli.plant.polynomial_matrix import at, delay_of, stack

Entries = Sequence[Sequence[Sequence[float]]]


@dataclass(frozen=True)
class MatrixTransfer:
    """numerator (n, m, l) over the polynomial `denominator` (d,), both in q^-1, ascending."""

    numerator: Array
    denominator: Array

    @classmethod
    def build(cls, numerator: Entries, denominator: Entries) -> MatrixTransfer:
        """From entries with a denominator each; equal denominators are kept once."""
        distinct = list(dict.fromkeys(tuple(p) for row in denominator for p in row))
        common = np.ones(1)
        for factor in distinct:
            common = np.convolve(common, factor)
        rows = []
        for above, below in zip(numerator, denominator, strict=True):
            row = []
            for entry, own in zip(above, below, strict=True):
                product = np.asarray(entry, dtype=float)
                for factor in distinct:
                    if factor != tuple(own):
                        product = np.convolve(product, factor)
                row.append([float(c) for c in product])
            rows.append(row)
        return cls(stack(rows), common)

    @classmethod
    def diagonal(cls, numerator: Sequence[float], denominator: Sequence[float], size: int) -> MatrixTransfer:
        """t(q) I from the polynomials of t."""
        entries = [[list(numerator) if i == j else [0.0] for j in range(size)] for i in range(size)]
        return cls(stack(entries), np.asarray(denominator, dtype=float))

    def at(self, w: ArrayLike) -> ComplexArray:
        """(K, n, m) at normalised frequencies `w` (K,)."""
        q = unit_circle(w)
        return at(self.numerator, q) / evaluate(self.denominator, q)[:, None, None]

    def scaled(self, numerator: Array, denominator: Array) -> MatrixTransfer:
        """This matrix times a scalar transfer function."""
        rows = [[np.convolve(p, numerator).tolist() for p in row] for row in self.numerator]
        return MatrixTransfer(stack(rows), np.convolve(self.denominator, denominator))

    @cached_property
    def delay(self) -> int:
        """The number of samples by which every entry is delayed."""
        return delay_of(self.numerator)

    @cached_property
    def scalar(self) -> bool:
        """Whether it is t(q) I."""
        first = self.numerator[0, 0]
        identity = np.eye(self.numerator.shape[0])[:, :, None]
        return bool(np.array_equal(self.numerator, identity * first))

    @cached_property
    def poles(self) -> ComplexArray:
        """Roots in z of the denominator."""
        return roots_in_z(self.denominator)


def sampled(numerator: Sequence[float], denominator: Sequence[float], interval: float) -> tuple[Array, Array]:
    """A transfer function in s (descending) after a zero-order hold: polynomials in q^-1, ascending."""
    if len(denominator) == 1:
        return np.array([numerator[-1] / denominator[0]]), np.ones(1)
    # scipy takes coefficients below 1e-14 for zeros, so it gets a numerator of order one.
    given = np.trim_zeros(np.asarray(numerator, dtype=float), "f")
    gain = np.abs(given).max(initial=0.0)
    scaled = (given / gain).tolist() if gain > 0 else [1.0]
    above, below, _ = scipy.signal.cont2discrete((scaled, list(denominator)), interval, method="zoh")
    top = gain * np.atleast_1d(np.squeeze(above)).astype(float)
    return np.concatenate([np.zeros(below.size - top.size), top]), below
