"""Coordinates of the parameter space in which information matrices are well conditioned.

`factor` L (k, k), lower triangular, sets the coordinates of every gradient and information matrix:
gradients are L^-1 F and M = L M~ L^T. Raw parameters correspond to L = None; there the information
matrix easily has a condition number of 1e12, which no solver survives.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np
import scipy
from numpy.typing import NDArray

from inputdesign_cli.arrays import Array
from inputdesign_cli.errors import InaccurateError, bad_spec
from inputdesign_cli.plant import Model

_RANK_TOLERANCE = 1e-11
# Parameters of a smaller share, relative to the largest, take part by rounding and coincidence only.
_TAKES_PART = 0.05


class Coordinates:
    """Converts between raw parameters and the coordinates of an experiment (`factor`, `prior`)."""

    factor: Array | None
    prior: Array | None

    if TYPE_CHECKING:  # a field or a property of the experiment; a default here would become the field's

        @property
        def model(self) -> Model:
            """Return the model to be identified."""

    @cached_property
    def size(self) -> int:
        """Return the number of parameters k."""
        return len(self.model.names)

    @cached_property
    def prior_information(self) -> Array:
        """Return `prior` in these coordinates, zero when there is none, (k, k)."""
        if self.prior is None:
            return np.zeros((self.size, self.size))
        return self.whiten_matrix(self.prior)

    def whiten_matrix(self, information: Array) -> Array:
        """Return an information matrix (k, k) of raw parameters in these coordinates."""
        return self.whiten_rows(self.whiten_rows(information).T)

    @property
    def from_raw(self) -> Array:
        """Return the matrix (k, k) from the gradient for raw parameters to these coordinates."""
        return np.eye(self.size) if self.factor is None else self._inverse_factor

    @cached_property
    def _inverse_factor(self) -> Array:
        inverse, _ = scipy.linalg.lapack.dtrtri(self.factor, lower=1)
        return np.asarray(inverse)

    def to_raw(self, information: Array) -> Array:
        """Return an information matrix of these coordinates in raw parameters."""
        if self.factor is None:
            return information
        return self.factor @ information @ self.factor.T

    def raw_covariance(self, information: Array) -> Array:
        """Return P = M^-1 in raw parameters, from an information matrix of these coordinates."""
        half = scipy.linalg.solve_triangular(np.linalg.cholesky(information), np.eye(self.size), lower=True)
        if self.factor is not None:
            half = scipy.linalg.solve_triangular(self.factor, half.T, lower=True, trans="T").T
        return half.T @ half

    def raw_steps(self, steps: Array) -> Array:
        """Return differences (n, k) of parameters in these coordinates as differences of raw parameters."""
        return steps if self.factor is None else steps @ self._inverse_factor

    def whiten_rows(self, rows: NDArray) -> NDArray:
        """Return gradients (n, k) of raw parameters in these coordinates."""
        if self.factor is None:
            return rows
        return rows @ self._inverse_factor.T

    def unexcited(self, directions: Array) -> str:
        """Return the names of the parameters in some `directions` (k, m) of these coordinates."""
        raw = directions if self.factor is None else self._inverse_factor.T @ directions
        size = np.abs(self.model.theta)
        return taking_part(self.model.names, raw / np.maximum(size, 1e-3 * size.max())[:, None])


def taking_part(names: Sequence[str], directions: Array) -> str:
    """Return the names of the parameters that take part in a space, for any vectors that span it.

    Args:
        names: of the k parameters.
        directions: (k, m), independent columns.
    """
    share = np.linalg.norm(np.linalg.qr(directions)[0], axis=1)
    return ", ".join(name for name, own in zip(names, share, strict=True) if own > _TAKES_PART * share.max())


def factor_of(rows: NDArray[np.float64], names: Sequence[str], *, excitation: str) -> Array:
    """Return L (k, k), lower triangular, with rows^T rows = L L^T, by a QR factorisation.

    The matrix itself is never formed: that halves the digits lost to an ill-conditioned parametrisation.

    Args:
        rows: (number, k).
        excitation: what excites, for the diagnostic ("excitation", "excitation within [0, 2]").

    Raises:
        SpecError: `not-identifiable`, with the names of parameters that are not identifiable.
        InaccurateError: `numerically-singular`: other excitations could identify them, but next to resonances
            all else is lost to rounding.
    """
    factor, untold = triangular_factor(rows)
    if untold.size:
        size = np.linalg.norm(rows, axis=1)
        even = rows[size > 0.0] / size[size > 0.0, None]
        if len(even) and not triangular_factor(even)[1].size:
            raise InaccurateError.because(
                "numerically-singular",
                f"flat {excitation} does not distinguish these parameters in double precision: "
                f"{taking_part(names, untold)}",
                hint="nearly all its information stands next to a pole at the unit circle: leave those "
                "frequencies out, with limits.band and spectrum: {type: multisine, ..}",
                key="plant",
            )
        raise bad_spec(
            "not-identifiable",
            f"no {excitation} can distinguish these parameters: {taking_part(names, untold)}",
            hint="look for a factor that B and A (or B and F, C and D, A and C) have in common, or for an "
            "order too high, and take it out; or list in plant.known what is known of them",
            key="plant",
        )
    return factor


def triangular_factor(rows: NDArray[np.float64]) -> tuple[Array, Array]:
    """Return L (k, k), lower triangular, with rows^T rows = L L^T, and its null directions (k, m).

    Rank is judged with every column of the rows (number, k) at norm one, in any units.
    """
    scale = np.linalg.norm(rows, axis=0)
    scale[scale == 0.0] = 1.0
    triangle = np.asarray(np.linalg.qr(rows / scale, mode="r"))
    _, singular, vectors = np.linalg.svd(triangle)
    return (triangle * scale).T, vectors[singular <= _RANK_TOLERANCE * singular[0]].T
