"""Hold the structures that were estimated for one output, and choose one of them.

Structures that simulate unseen data about as well count alike. Of these the criterion takes one, in which
every parameter must lower the variance of the prediction errors by a share. A structure with a parameter
that deviates by more than half its value comes last.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from inputdesign_cli.arrays import Array
from inputdesign_cli.explore.fits import Parts
from inputdesign_cli.explore.structures import Orders, Process
from inputdesign_cli.explore.sweep import Sweep, delay_ranges
from inputdesign_cli.plant import Model

# An error of simulation that is larger by less than this factor, or these points, is as good, if it
# explains almost as much of the variance of the output.
_AS_GOOD, _POINTS, _EXPLAINED = 1.2, 2.0, 0.99
# The largest deviation of a parameter of the plant, in shares of its value.
_UNCERTAIN = 0.5
# What a parameter must take off the variance of prediction errors, however long the record is.
_WORTH = 0.01
# What gains, time constants and dead times are worth by the same measure, beside polynomials.
_NAMED = 0.02

Ranges = tuple[tuple[int, int | None], ...]
"""Delays from the one to the other; None: the record sets no upper limit."""

Shape = Orders | Process
"""A structure for one output."""


@dataclass(frozen=True)
class Candidate:
    """One structure for one output.

    Attributes:
        orders: the structure; `model` is it, estimated on the first part.
        deviations: (k,) of the parameters of the plant.
        estimation, validation: per cent that the simulation explains of the two parts.
        prediction: per cent one step ahead, on the second part.
        criterion: log of the variance of the prediction errors, and the price of the parameters.
        steady: whether its plant is stable, as far as the record shows.
        certain: whether no parameter of the plant deviates by more than half its value.
        failed: names of the tests of its residuals that fail.
        by_prediction: whether prediction errors alone rank it, as in a loop.
    """

    orders: Shape
    model: Model
    deviations: Array
    estimation: float
    validation: float
    prediction: float
    criterion: float
    converged: bool
    steady: bool
    certain: bool
    failed: tuple[str, ...]
    by_prediction: bool


def price(unknowns: int, samples: int) -> float:
    """Return the price of parameters in the log of a variance: that of BIC, and a share at least."""
    return unknowns * max(float(np.log(samples)) / samples, _WORTH)


def certain(theta: Array, deviations: Array, dead_times: NDArray[np.bool_], step: float) -> bool:
    """Return whether no parameter (k,) deviates by more than half its value.

    A dead time may deviate by up to a sample, `step`: it may be zero.
    """
    most = np.maximum(_UNCERTAIN * np.abs(theta), np.where(dead_times, step, 0.0))
    return bool(np.all(deviations <= most))


@dataclass(frozen=True)
class Chosen:
    """What was found for one output.

    Attributes:
        candidates: those to take come first; the `good` explain the record about as well as any.
        estimated: the records of the first part, `swept` its regressions, `least` their shortest delay.
        dropped: families of which no structure could be estimated.
    """

    candidates: tuple[Candidate, ...]
    good: tuple[Candidate, ...]
    estimated: Parts
    swept: Sweep
    least: int
    dropped: tuple[str, ...]

    @property
    def best(self) -> Candidate:
        """Return the one to take."""
        return self.candidates[0]

    @property
    def most(self) -> int:
        """Return the longest delay that was tried."""
        return self.swept.most

    @property
    def by_order(self) -> dict[int, float]:
        """Return the errors (rms) of the regressions on the first part, by order."""
        return {n: float(np.sqrt(one.loss)) for n, one in self.swept.by_order.items()}

    def ranges(self, candidate: Candidate) -> Ranges:
        """Return the 95 % interval of each delay of a candidate."""
        orders, model = candidate.orders, candidate.model
        found = orders.ranges(model.theta[model.in_plant], candidate.deviations)
        if not found:
            near = self.swept.near(orders.order)
            found = delay_ranges(self.estimated, near, least=self.least, most=self.most)
            own = zip(found, orders.delays, strict=True)
            found = tuple((min(low, delay), max(high, delay)) for (low, high), delay in own)
        # A Gaussian estimate of a dead time may be wider than the record that it is made from.
        longest = max(len(y) for _, y in self.estimated)
        return tuple((low, high if high <= longest else None) for low, high in found)


def ranked(usable: Sequence[Candidate]) -> tuple[tuple[Candidate, ...], tuple[Candidate, ...]]:
    """Return the candidates, the preferred one first, and the subset that simulates about equally well.

    In closed loop the input depends on the noise, so that a wrong plant may simulate the output better than
    the right one. Prediction errors are free of this bias ([ljung-1999], Section 13.4).
    """
    error = min(100.0 - c.validation for c in usable)
    most, explained = max(_AS_GOOD * error, error + _POINTS), 1e4 - error**2

    def is_good(c: Candidate) -> bool:
        own = 100.0 - c.validation
        return c.by_prediction or (own <= most and 1e4 - own**2 >= _EXPLAINED * explained)

    def preference(c: Candidate) -> tuple[float, ...]:
        by = c.criterion - _NAMED * c.orders.physical if is_good(c) else -c.validation
        return not is_good(c), not c.steady, not c.certain, not c.converged, by

    every = tuple(sorted(usable, key=preference))
    return every, tuple(c for c in every if is_good(c))
