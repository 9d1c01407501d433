"""What the design asks of a requirement: is it met, where not, and which cones would mend it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import numpy as np

from inputdesign_cli.plant.polynomial import Array


@dataclass(frozen=True)
class Violation:
    """How badly a requirement is missed: `ratio` > 1 misses, at a frequency where there is one."""

    ratio: float
    frequency: float | None = None


@dataclass(frozen=True)
class Cut:
    """One cone that every admissible information matrix satisfies: M >= V V^T, V = `root` (k, q)."""

    root: Array
    frequency: float | None = None

    @property
    def matrix(self) -> Array:
        """(k, k): V V^T."""
        return self.root @ self.root.T

    def proof(self, multiplier: Array) -> tuple[Array, float]:
        """(Y, r) with tr(Y M) >= r for every admissible M, from a multiplier (k, k) >= 0."""
        return multiplier, float(np.sum(multiplier * self.matrix))


class Requirement(Protocol):
    """A convex condition on the information matrix M (k, k) in the coordinates of the experiment."""

    name: str

    def violations(self, information: Array, *, above: float = -np.inf) -> list[Violation]:
        """Every local maximum over frequency of the ratio that must not exceed one, if above `above`."""
        ...

    def ratios(self, information: Array, frequencies: Array) -> Array:
        """The ratio at given frequencies (n,): (n,)."""
        ...

    def cut(self, frequency: float | None) -> Cut:
        """The cone that enforces the requirement at this frequency."""
        ...


def worst(violations: list[Violation]) -> Violation:
    """The largest of them; ratio 0 when there are none."""
    return max(violations, key=lambda v: v.ratio, default=Violation(0.0))
