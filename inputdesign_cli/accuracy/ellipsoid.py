"""Model error over the whole confidence ellipsoid, without linearisation.

For every theta with (theta - theta_0)^T M (theta - theta_0) <= alpha^2, at every frequency of a band:
|W (G(theta) - G_0) / G(theta)| <= bound ("relative"), or |G(theta) - G_0| <= r_adm ("absolute"). With
G = B / D both are |z^T d| <= |c_0 + c^T d| in d = theta - theta_0, an indefinite quadratic inequality,
and the S-procedure turns it into one matrix inequality without loss ([polik-terlaky-2007]).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from inputdesign_cli.accuracy.cuts import EllipsoidCut
from inputdesign_cli.accuracy.model_error import OnModelError
from inputdesign_cli.accuracy.requirement import Requirement
from inputdesign_cli.arrays import Array, ComplexArray

_BISECTIONS = 80
_FLOOR = 1e-150  # its square does not underflow


@dataclass(frozen=True, kw_only=True)
class EllipsoidError(OnModelError):
    """The requirement for one entry of G that is a fraction affine in theta (`Model.bends`).

    The bound on the error is r_adm (`admissible`), or r_adm / |G_0| on the error relative to G(theta)
    ("relative"). All entries share the ellipsoid of the parameters.
    """

    against: Literal["relative", "absolute"] = "relative"

    def _forms(self, w: ArrayLike) -> tuple[ComplexArray, ComplexArray, ComplexArray]:
        """Return the terms z (n, k), c (n, k) and c_0 (n,) of |z^T d| = |c_0 + c^T d| for the entry."""
        output, input = self.entry or (0, 0)
        part = self.experiment.model.entry_fraction(output, input, w)
        above = self.experiment.whiten_rows(part.numerator_gradient)
        below = self.experiment.whiten_rows(part.denominator_gradient)
        G = part.numerator / part.denominator
        z = (above - G[:, None] * below) / self.admissible.at(w)[:, None]
        if self.against == "relative":
            # r_adm = bound |G_0|, while the error is compared with bound |G(theta)|.
            return z * np.abs(G)[:, None], above, part.numerator
        return z, below, part.denominator

    def rows(self, w: ArrayLike) -> NDArray[np.float64]:
        """Return the real and imaginary parts of z / c_0, then of c / c_0, (n, 4, k)."""
        z, c, start = self._forms(w)
        turned = np.conj(start) / np.abs(start) ** 2  # c_0 becomes 1
        z, c = z * turned[:, None], c * turned[:, None]
        return np.stack([z.real, z.imag, c.real, c.imag], axis=1)

    def measure(self, half: NDArray[np.float64], w: Array) -> Array:
        """Return alpha over the radius at which the ellipsoid first touches |z^T d| = |1 + c^T d|.

        The squared radius is the minimum of |y|^2 subject to a quadratic inequality in t = half y. It equals
        the maximum of its concave dual in one multiplier, which is found by bisection.
        """
        left, scale, _ = np.linalg.svd(half, full_matrices=False)
        root = left * scale[:, None, :]
        curve, turn = np.linalg.eigh(np.einsum("nai,a,naj->nij", root, [-1.0, -1.0, 1.0, 1.0], root))
        offset = np.einsum("nij,ni->nj", turn, root[:, 2, :]) ** 2
        reach = np.where(curve[:, 0] < 0, -1.0 / np.minimum(curve[:, 0], -1e-300), np.inf)
        never = ~np.isfinite(reach) | (curve[:, 0] > -1e-30)
        low, high = np.zeros(len(reach)), np.where(never, 1.0, reach)

        def slope(mu: Array) -> Array:
            left_over = np.maximum(1.0 + mu[:, None] * curve, _FLOOR)
            return 1.0 - np.sum(offset * (2 * mu[:, None] + mu[:, None] ** 2 * curve) / left_over**2, axis=1)

        for _ in range(_BISECTIONS):
            middle = 0.5 * (low + high)
            rising = slope(middle) > 0
            low, high = np.where(rising, middle, low), np.where(rising, high, middle)
        left_over = np.maximum(1.0 + low[:, None] * curve, 1e-300)
        squared = low - np.sum(offset * low[:, None] ** 2 / left_over, axis=1)
        with np.errstate(divide="ignore"):
            return np.where(never, 0.0, self.alpha / np.sqrt(np.maximum(squared, 1e-300)))

    def slope(self, information: Array, frequencies: Array, shares: Array) -> Array:
        """Return the gradient by differences, since the ratio is not a sum of squares."""
        return Requirement.slope(self, information, frequencies, shares)

    def cut(self, frequency: float | None) -> EllipsoidCut:
        """Return the matrix inequality of the S-procedure at this frequency."""
        rows = self.rows(np.array([frequency]))[0]
        k = rows.shape[1]
        form = np.zeros((k + 1, k + 1))
        form[:k, :k] = rows[:2].T @ rows[:2] - rows[2:].T @ rows[2:]
        form[:k, k] = form[k, :k] = -rows[2]
        form[k, k] = -1.0
        return EllipsoidCut(form, self.alpha, frequency)
