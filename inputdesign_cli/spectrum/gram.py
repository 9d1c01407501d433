"""Spectra with a Gram matrix: Phi(w) = B(w) Q B(w)^*, Q >= 0, for a fixed row of functions B(w).

These families share the cone, its faces, and the price of spectra outside of a face.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple, Self

import numpy as np
import scipy
from numpy.typing import NDArray

from inputdesign_cli.arrays import Array
from inputdesign_cli.spectrum.basis import DensityFamily, Face, Functional, Pricing
from inputdesign_cli.spectrum.directions import directed_scale
from inputdesign_cli.spectrum.svec import smat

_DIRECTIONS = 8
# A generator with a smaller eigenvalue, relative to the largest, is dropped. Its share of the cost, which is
# the trace, is the solver's distance from the boundary of the cone; keeping it would cost further steps.
_KEPT = 1e-10
_SINGULAR_PRICE = 1e-12


class FaceSizes(NamedTuple):
    """Holds orders: up to `whole` a cone is its own face; others get `first`, later `kept` generators."""

    whole: int = 28
    first: int = 16
    kept: int = 24


@dataclass(frozen=True)
class GramBasis(DensityFamily, ABC):
    """A family for `inputs` r, of `order` m; Q has the order n = r (m + 1), degree by degree.

    A face has generators V (n, q): Q = V Y V^* with a real Y >= 0 of order q. Where Q may be complex
    (`hermitian`) so may V; the whole cone then needs 2 n of them, [I, jI].
    """

    inputs: int
    order: int

    hermitian = False

    @cached_property
    def gram_order(self) -> int:
        """Return the order n = r (m + 1) of the Gram matrix."""
        return self.inputs * (self.order + 1)

    @property
    def degree(self) -> int:
        """Return the degree of the polynomial."""
        return self.order

    @cached_property
    def _copies(self) -> int:
        """Return the number of generators of the whole cone, in multiples of n."""
        return 2 if self.hermitian else 1

    @property
    def sizes(self) -> FaceSizes:
        """Return the sizes of faces."""
        return FaceSizes()

    @abstractmethod
    def gram(self, vector: Array) -> NDArray:
        """Return G (n, n) with tr(G Q) = vector . x for the x of any Gram matrix Q."""

    @abstractmethod
    def spread(self, powers: Array) -> Array:
        """Return flat excitation with these powers (r,) of the channels, uncorrelated, (size,)."""

    @abstractmethod
    def products(self, generators: NDArray) -> Array:
        """Return x of each pair of generators (n, q), in svec's order and scale: (size, q (q + 1) / 2)."""

    @abstractmethod
    def of_order(self, order: int) -> Self:
        """Return the family with a lower order; its x is the head of ours."""

    def coarser(self) -> list[Self]:
        """Return lower orders, each about half the next, whose optimum is a good start for this one."""
        orders = [self.order]
        while self._copies * self.inputs * (orders[0] + 1) > 2 * self.sizes.whole:
            orders.insert(0, orders[0] // 2)
        return [self.of_order(order) for order in orders[:-1]]

    def first_face(self, price: Functional) -> Face:
        """Return the whole cone when it is small, else the spectra of low order."""
        n = self.gram_order
        few = self.inputs * max(self.sizes.first // (self.inputs * self._copies), 1)
        first = np.eye(n)[:, : n if n * self._copies <= self.sizes.whole else min(few, n)]
        return self._face(np.concatenate([first, 1j * first], axis=1) if self.hermitian else first, price)

    def price(self, price: Functional, value: Functional, grid: Array) -> Pricing:
        """Return the largest s with price - s value >= 0 on the whole cone: a generalised eigenvalue.

        Where the price itself nearly vanishes, rounding spoils that eigenvalue, and the largest ratio
        over frequency, which is valid too, stands in.
        """
        metric, worth = self.gram(price.vector), self.gram(value.vector)
        unit = _units(metric)
        metric, worth = metric / np.outer(unit, unit), worth / np.outer(unit, unit)
        spread = np.linalg.eigvalsh(metric)
        if spread[0] <= _SINGULAR_PRICE * spread[-1]:
            _, vectors = _leading_pairs(worth - metric, np.eye(len(metric)), _DIRECTIONS)
            return Pricing(directed_scale(price, value, grid)[0], vectors / unit[:, None])
        ratios, vectors = _leading_pairs(worth, metric, _DIRECTIONS)
        return Pricing(1.0 / ratios[-1] if ratios[-1] > 0 else np.inf, vectors / unit[:, None])

    def enlarge(self, face: Face, y: Array, directions: Array, price: Functional) -> tuple[Self, Face]:
        """Keep the generators that the solution uses, add the `directions` (n, number)."""
        n, (known, number) = self.gram_order, face.generators.shape
        if known == n and number == n * self._copies:
            return self, face
        eigenvalues, vectors = np.linalg.eigh(smat(y))
        kept = eigenvalues > _KEPT * eigenvalues[-1]
        kept[: -self.sizes.kept] = False
        used = np.pad(face.generators @ vectors[:, kept], ((0, n - known), (0, 0)))
        return self, self._face(np.concatenate([used, directions], axis=1), price)

    def factor(self, face: Face, y: Array) -> NDArray:
        """Return H (n, q) with Q = H H^*."""
        eigenvalues, vectors = np.linalg.eigh(smat(y))
        return face.generators @ (vectors * np.sqrt(np.maximum(eigenvalues, 0.0)))

    def _face(self, spanning: NDArray, price: Functional) -> Face:
        """Return generators orthonormal in the metric of the price, so that the cost is tr Y."""
        gram = self.gram(price.vector)[: len(spanning), : len(spanning)]
        unit = _units(gram)
        basis = _independent(unit[:, None] * spanning)
        values, vectors = np.linalg.eigh((basis.conj().T @ (gram / np.outer(unit, unit)) @ basis).real)
        scaled = basis @ (vectors / np.sqrt(np.maximum(values, _SINGULAR_PRICE * values[-1])))
        generators = scaled / unit[:, None]
        return Face(self.products(generators), "psd", generators.shape[1], generators)


def _units(metric: NDArray) -> Array:
    """Return roots of the diagonal, so that nothing depends on the units of the channels, (n,)."""
    diagonal = np.diag(metric).real
    return np.sqrt(np.where(diagonal > 0.0, diagonal, 1.0))


def _independent(vectors: NDArray) -> NDArray:
    """Return an orthonormal basis of the span over the real numbers."""
    if not np.iscomplexobj(vectors):
        return np.asarray(scipy.linalg.qr(vectors, mode="economic")[0])
    q = scipy.linalg.qr(np.concatenate([vectors.real, vectors.imag]), mode="economic")[0]
    return q[: len(vectors)] + 1j * q[len(vectors) :]


def _leading_pairs(worth: NDArray, metric: NDArray, number: int) -> tuple[Array, NDArray]:
    """Return the `number` largest generalised eigenvalues, ascending, and their vectors as columns."""
    first = max(len(worth) - number, 0)
    return scipy.linalg.eigh(worth, metric, subset_by_index=[first, len(worth) - 1])
