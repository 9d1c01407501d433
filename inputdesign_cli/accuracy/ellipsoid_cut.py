"""A cut for a quadratic form over a whole confidence ellipsoid, by the S-procedure."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
import scipy.sparse as sp

from inputdesign_cli.accuracy.cut import CutBlock, Inequality, positive_part
from inputdesign_cli.arrays import Array
from inputdesign_cli.spectrum import smat, svec, svec_length


@dataclass(frozen=True)
class EllipsoidCut:
    """x^T Q x <= 0 for every x = (d, 1) with d^T M d <= alpha^2, Q = `form` (k + 1, k + 1).

    By the S-procedure this holds exactly when [[M / alpha^2, 0], [0, -1]] >= nu Q for some nu >= 0
    ([polik-terlaky-2007]; the ellipsoid has an interior point, so nothing is lost). With a multiplier
    Z >= 0 of tr(Z Q) >= 0, tr(Z_11 M) / alpha^2 >= Z_22.
    """

    form: Array
    alpha: float
    frequency: float | None = None

    concave = None

    def transformed(self, congruence: Array) -> EllipsoidCut:
        """Return the same set for K M K^T, see `Cut`."""
        corner = np.eye(len(self.form))
        corner[:-1, :-1] = congruence
        return replace(self, form=corner @ self.form @ corner.T)

    def blocks(self, size: int) -> list[CutBlock]:
        """The matrix inequality of the S-procedure, and nu, which is the unknown."""
        order, entries = size + 1, svec_length(size)
        corner = np.zeros((order, order))
        corner[-1, -1] = -1.0
        information = sp.eye_array(svec_length(order), entries, format="csc") / self.alpha**2
        unknown = sp.csc_matrix(-svec(self.form)[:, None])
        return [
            CutBlock("psd", order, svec(corner), information, unknown),
            CutBlock("nonnegative", 1, np.zeros(1), sp.csc_matrix((1, entries)), sp.csc_matrix(np.eye(1))),
        ]

    @property
    def inequality(self) -> Inequality:
        """Return the matrix inequality of the S-procedure."""
        corner = np.zeros_like(self.form)
        corner[-1, -1] = -1.0
        return Inequality(corner, 1.0 / self.alpha**2, -self.form)

    def proof(self, multipliers: Sequence[Array]) -> tuple[Array, float]:
        """See `implied`."""
        return self.implied(smat(multipliers[0]))

    def implied(self, weight: Array) -> tuple[Array, float]:
        """tr(Z_11 M) / alpha^2 >= Z_22, from any Z >= 0 (k + 1, k + 1) with tr(Z Q) >= 0.

        Weigh the matrix inequality with Z: tr(Z_11 M) / alpha^2 - Z_22 >= nu tr(Z Q) >= 0, whatever nu is.
        The solver's Z is made positive semidefinite first, and rounding may leave tr(Z Q) a little below
        zero. Two changes of Z mend that and keep it positive semidefinite: to shrink its last row and
        column, or to add to Z_11 the direction in which Q_11 is largest. The first proves more, where it
        is possible.
        """
        Z = positive_part(weight)
        missing = -float(np.sum(Z * self.form))
        if missing > 0.0:
            shorter = _shortened(Z, self.form)
            if shorter is not None:
                return shorter[:-1, :-1] / self.alpha**2, float(shorter[-1, -1])
            values, vectors = np.linalg.eigh(self.form[:-1, :-1])
            if values[-1] <= 0.0:
                return np.zeros_like(self.form[:-1, :-1]), 0.0
            Z[:-1, :-1] += missing / values[-1] * np.outer(vectors[:, -1], vectors[:, -1])
        return Z[:-1, :-1] / self.alpha**2, float(Z[-1, -1])


def _shortened(Z: Array, form: Array) -> Array | None:
    """Z with its last row and column times the largest c < 1 for which tr(Z Q) >= 0, Q = `form`; or None."""
    square = Z[-1, -1] * form[-1, -1]
    linear = 2.0 * float(Z[:-1, -1] @ form[:-1, -1])
    constant = float(np.sum(Z[:-1, :-1] * form[:-1, :-1]))
    roots = np.roots([square, linear, constant])
    inside = roots.real[(np.abs(roots.imag) == 0.0) & (roots.real > 0.5) & (roots.real < 1.0)]
    if inside.size == 0:
        return None
    corner = np.ones(len(Z))
    corner[-1] = inside.max() * (1.0 - 1e-15)
    return Z * np.outer(corner, corner)
