"""The loop T that a control law gives, and the zeros outside the unit circle that it keeps in it."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from inputdesign_cli.arrays import Array, ComplexArray
from inputdesign_cli.information.quadrature import Quadrature
from inputdesign_cli.plant.polynomial import roots_in_z, unit_circle
from inputdesign_cli.plant.transfer import Rational, TransferMatrix


@dataclass(frozen=True)
class DesiredLoop:
    """The desired loop T = b F: F is `free`, b the all-pass of the plant zeros outside the unit circle.

    A controller can have b only from the model, so b errs with the model.

    Attributes:
        outside: the zeros in z that b keeps. None stands for a law that keeps no zeros, so that b is one.
    """

    free: TransferMatrix
    outside: ComplexArray | None = None

    @cached_property
    def kept(self) -> Rational:
        """Return the all-pass b of the plant, with gain one at frequency zero."""
        if self.outside is None or not self.outside.size:
            return Rational(np.ones(1))
        above = np.poly(self.outside).real
        below = np.poly(1 / np.conj(self.outside)).real
        return Rational(np.sum(below) / np.sum(above) * above, (np.asarray(below, dtype=float),))

    @cached_property
    def whole(self) -> TransferMatrix:
        """Return the desired loop T of the plant."""
        return self.free.scaled(self.kept)

    def mirrored(self, determinants: Array) -> Array:
        """Return polynomials m (runs, l) with b = determinant / m for the determinants (runs, l) of models.

        Zeros outside the circle are mirrored into it, and the value at frequency zero stays.
        """
        if self.outside is None:
            return determinants
        found = determinants.copy()
        for row in found:
            roots = roots_in_z(row)
            far = np.abs(roots) > 1
            if np.any(far):
                first = int(np.flatnonzero(row)[0])
                inside = np.poly(np.where(far, 1 / np.conj(roots), roots)).real
                row[first : first + inside.size] = np.sum(row) / np.sum(inside) * inside
        return found

    def gradient(self, logarithmic: Array, rule: Quadrature) -> ComplexArray | None:
        """Return dT (K, k, n, n) at the nodes, as b errs with the model. None if b is one.

        A zero z_i that moves by dz_i adds -dz_i / (z - z_i) to d log det G, its only poles outside the
        circle. With P their sum, d log b = 2j Im P on the circle.

        Args:
            logarithmic: (K, k), d log det G = tr(G^-1 dG) at the nodes.
            rule: of means over [0, pi].
        """
        if self.outside is None or not self.outside.size:
            return None
        # P = N / D with D = prod (z - z_i): its terms z^1 .. z^m are the terms of d log det G.
        D = np.poly(self.outside).real[::-1]
        m, z = self.outside.size, 1 / unit_circle(rule.nodes)
        waves = rule.weights * z ** -np.arange(1, m + 1)[:, None]
        terms = (waves @ logarithmic).real
        terms = np.concatenate([-(D[m - 1 :: -1] @ terms)[None], terms])
        above = [sum(D[j] * terms[i - j] for j in range(i + 1)) for i in range(m)]
        P = (z[:, None] ** np.arange(m) @ np.array(above)) / np.polyval(D[::-1], z)[:, None]
        return np.asarray(2j * P.imag[:, :, None, None] * self.whole.at(rule.nodes)[:, None])
