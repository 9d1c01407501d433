"""What the design asks of a requirement: is it met, where not, and which cones would mend it."""

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
    """How badly a requirement is missed: `ratio` > 1 misses, at a frequency where there is one."""

    ratio: float
    frequency: float | None = None


class Requirement(ABC):
    """A convex condition on the information matrix M (k, k) in the coordinates of the experiment.

    Its `ratio` is measured as an error is, in standard deviations: with ratio r, the matrix r^2 M just
    meets the requirement (and no smaller multiple does). A new requirement is one file with a subclass that
    answers `name`, `violations`, `ratios` and `cut`; the rest has answers that fit most.
    """

    @property
    @abstractmethod
    def name(self) -> str:
        """How the spec calls it, for reports."""

    @property
    def entry(self) -> Entry | None:
        """The entry (output, input) of G that it is about, from zero; None for G as a whole."""
        return None

    @property
    def of_the_norm(self) -> bool:
        """Whether it is about the Frobenius norm of all entries of G."""
        return False

    @property
    def definite(self) -> bool:
        """Whether it is out of the question that M is singular."""
        return True

    @abstractmethod
    def violations(self, information: Array, *, above: float = -np.inf) -> list[Violation]:
        """Every local maximum over frequency of the ratio that must not exceed one, if above `above`."""

    @abstractmethod
    def ratios(self, information: Array, frequencies: Array) -> Array:
        """The ratio at given frequencies (n,): (n,)."""

    @abstractmethod
    def cut(self, frequency: float | None) -> Cut:
        """The cone that enforces the requirement at this frequency."""

    def most(self, information: Array) -> float:
        """What the ratio does not exceed; where the search for its maximum is long, without that search."""
        return worst(self.violations(information)).ratio

    def least(self, information: Array) -> float:
        """What the ratio is at least, in the same way."""
        return worst(self.violations(information)).ratio

    def worst(self, information: Array) -> Violation:
        """The largest of the violations, for reports."""
        return worst(self.violations(information))


class OneCondition(Requirement):
    """A requirement without a frequency: its single ratio stands for all."""

    @abstractmethod
    def ratio(self, information: Array) -> float:
        """The ratio, see `Requirement`."""

    def violations(self, information: Array, *, above: float = -np.inf) -> list[Violation]:
        """The one ratio, if above `above`."""
        ratio = self.ratio(information)
        return [Violation(ratio)] if ratio > above else []

    def ratios(self, information: Array, frequencies: Array) -> Array:
        """The one ratio, as often as there are frequencies."""
        return np.full(np.shape(frequencies), self.ratio(information))


def inverse_factor(information: Array) -> Array:
    """K (.., k, k) with K^T K = M^-1.

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
    """The largest of them; ratio 0 when there are none."""
    return max(violations, key=lambda v: v.ratio, default=Violation(0.0))
