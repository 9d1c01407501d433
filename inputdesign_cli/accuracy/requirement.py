"""The protocol of requirements: whether one is met, where it is not, and the cones that enforce it."""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass

import numpy as np
import scipy

from inputdesign_cli.accuracy.cut import Cut
from inputdesign_cli.arrays import Array

Entry = tuple[int, int]


@dataclass(frozen=True)
class Violation:
    """Holds a local maximum of the ratio of a requirement (above 1: missed), and its frequency, if any."""

    ratio: float
    frequency: float | None = None


class Requirement(ABC):
    """A convex condition on the information matrix M (k, k) in the coordinates of the experiment.

    Its `ratio` is measured as an error is, in standard deviations: with ratio r, the matrix r^2 M just
    meets the requirement (and no smaller multiple does). A new requirement is one file with a subclass that
    defines `name`, `violations`, `ratios` and `cut`; the other methods have defaults.
    """

    @property
    @abstractmethod
    def name(self) -> str:
        """Return the name of the requirement in the spec, for reports."""

    @property
    def entry(self) -> Entry | None:
        """Return the entry (output, input) of G that it concerns, from zero; None for G as a whole."""
        return None

    @property
    def of_the_norm(self) -> bool:
        """Return whether it concerns the Frobenius norm of all entries of G."""
        return False

    @property
    def definite(self) -> bool:
        """Return whether the requirement excludes a singular M."""
        return True

    @abstractmethod
    def violations(self, information: Array, *, above: float = -np.inf) -> list[Violation]:
        """Return every local maximum over frequency of the ratio (at most one if met), if above `above`."""

    @abstractmethod
    def ratios(self, information: Array, frequencies: Array) -> Array:
        """Return the ratio at given frequencies, (n,)."""

    @abstractmethod
    def cut(self, frequency: float | None) -> Cut:
        """Return the cone that enforces the requirement at this frequency."""

    def most(self, information: Array) -> float:
        """Return an upper bound on the largest ratio, without a slow search for it."""
        return worst(self.violations(information)).ratio

    def least(self, information: Array) -> float:
        """Return a lower bound on the largest ratio, without a slow search for it."""
        return worst(self.violations(information)).ratio

    def worst(self, information: Array) -> Violation:
        """Return the largest of the violations, for reports."""
        return worst(self.violations(information))


class OneCondition(Requirement):
    """A requirement that does not depend on frequency and has a single ratio."""

    @abstractmethod
    def ratio(self, information: Array) -> float:
        """Return the ratio, see `Requirement`."""

    def violations(self, information: Array, *, above: float = -np.inf) -> list[Violation]:
        """Return the single ratio as a violation, if it exceeds `above`."""
        ratio = self.ratio(information)
        return [Violation(ratio)] if ratio > above else []

    def ratios(self, information: Array, frequencies: Array) -> Array:
        """Return the single ratio, repeated for every frequency."""
        return np.full(np.shape(frequencies), self.ratio(information))


def inverse_factor(information: Array) -> Array:
    """Return K (.., k, k) with K^T K = M^-1.

    Raises:
        LinAlgError: M is singular, that is, some parameter is not excited.
    """
    if information.ndim > 2:
        return np.linalg.inv(np.linalg.cholesky(information))
    factor, flaw = scipy.linalg.lapack.dpotrf(information, lower=1)
    if flaw:
        raise np.linalg.LinAlgError("the information matrix is not positive definite")
    inverse, _ = scipy.linalg.lapack.dtrtri(factor, lower=1)
    return np.asarray(inverse)


def worst(violations: list[Violation]) -> Violation:
    """Return the largest violation; ratio 0 when there are none."""
    return max(violations, key=lambda v: v.ratio, default=Violation(0.0))
