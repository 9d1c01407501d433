"""Requirements as a solver takes them: cones, and the linear inequalities that they prove.

Every cone here holds for M whenever it holds for a smaller M, and has the form h * constant + linear
map of (M, auxiliary unknowns), with h = 1 for a plain requirement. A design that scales M by an
unknown h scales the constants with it.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Literal, Protocol

import numpy as np
import scipy.sparse as sp

from inputdesign_cli.arrays import Array

CutKind = Literal["nonnegative", "psd", "exponential"]


@dataclass(frozen=True)
class CutBlock:
    """The constraint h * constant + information svec(M) + auxiliary z in a cone, see `design.conic.Block`."""

    kind: CutKind
    order: int
    constant: Array
    information: sp.csc_matrix
    auxiliary: sp.csc_matrix


@dataclass(frozen=True)
class Inequality:
    """The constraint h * `constant` + `scale` * M + nu * `form` >= 0 (psd), M filling the leading (k, k).

    The matrices are (d, d) with d >= k; nu >= 0 is an unknown of its own, where there is a `form`.
    """

    constant: Array
    scale: float = 1.0
    form: Array | None = None


@dataclass(frozen=True)
class ConcaveFunction:
    """The constraint g(M) >= h, g concave for M > 0 (k, k) and of degree one: g(t M) = t g(M).

    `at` maps (M, M^-1) to g(M) and its gradient G (k, k). The second derivative along D is `curvature`
    (tr(G D)^2 / g - tr(M^-1 D G D)).
    """

    curvature: float
    at: Callable[[Array, Array], tuple[float, Array]]


class Cut(Protocol):
    """A convex set of information matrices (k, k) that contains every admissible one.

    `frequency` (rad/sample) is where the requirement needs it, None when it has no frequency.
    """

    @property
    def frequency(self) -> float | None:
        """Return the frequency (rad/sample) at which the requirement needs the cut, if it has one."""

    def transformed(self, congruence: Array) -> Cut:
        """Return the same set for K M K^T, K = `congruence` (k, k) nonsingular."""

    def blocks(self, size: int) -> list[CutBlock]:
        """Return the cones of the cut, all with the same number of auxiliary unknowns; `size` is k."""

    @property
    def inequality(self) -> Inequality | None:
        """Return the set as one matrix inequality, unless it is a concave function."""

    @property
    def concave(self) -> ConcaveFunction | None:
        """Return the set by a concave function, unless it is a matrix inequality."""

    def proof(self, multipliers: Sequence[Array]) -> tuple[Array, float]:
        """Return (Y, r) with Y >= 0 (k, k) and tr(Y M) >= h r for every M of the set.

        Args:
            multipliers: one array a block, suggestions of a solver; the inequality holds for any.
        """

    def implied(self, weight: Array) -> tuple[Array, float]:
        """Return (Y, r) from one matrix: a multiplier of `inequality`, or of `concave` times its gradient."""


def positive_part(matrix: Array) -> Array:
    """Return the nearest positive semidefinite matrix."""
    eigenvalues, vectors = np.linalg.eigh(0.5 * (matrix + matrix.T))
    kept = eigenvalues > 0
    return (vectors[:, kept] * eigenvalues[kept]) @ vectors[:, kept].T
