"""A loop that is that of another model, but for its parameters or its noise."""

from __future__ import annotations

from abc import abstractmethod
from dataclasses import dataclass

from numpy.typing import ArrayLike

from inputdesign_cli.arrays import Array, ComplexArray
from inputdesign_cli.plant.loop import Loop


@dataclass(frozen=True)
class LoopAround(Loop):
    """What holds for the loop around the other model holds here, where nothing else is said."""

    @property
    @abstractmethod
    def inner(self) -> Loop:
        """The loop around the other model."""

    @property
    def closed_poles(self) -> ComplexArray:
        """All poles of the loop in z."""
        return self.inner.closed_poles

    @property
    def predictor_poles(self) -> ComplexArray:
        """Poles in z of the filters that make the gradient of the prediction."""
        return self.inner.predictor_poles

    @property
    def integrates(self) -> bool:
        """Whether plant or noise do."""
        return self.inner.integrates

    @property
    def instantaneous(self) -> Array:
        """(p + r, p + r): what acts without delay."""
        return self.inner.instantaneous

    def left_at(self, w: ArrayLike) -> ComplexArray:
        """(n, p + r, p + r): the matrix on the left of `Loop`."""
        return self.inner.left_at(w)

    def noise_at(self, w: ArrayLike) -> ComplexArray:
        """R H (n, p, p)."""
        return self.inner.noise_at(w)

    def signals(self, r: Array, e: Array) -> tuple[Array, Array]:
        """y (.., n, p) and u (.., n, r) for samples of r and e, from rest."""
        return self.inner.signals(r, e)
