"""Structures that were estimated for one output, and which of them to take.

Of models that simulate about equally well, one is taken that the tests of its residuals do not refute, with
few parameters. Where they refute all, the noise of the simplest is filtered if that predicts better.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

from inputdesign_cli.arrays import Array
from inputdesign_cli.explore.fits import Parts
from inputdesign_cli.explore.orders import Orders
from inputdesign_cli.explore.processes import Process
from inputdesign_cli.explore.regression import delay_ranges
from inputdesign_cli.plant import Model

# An error of simulation that is larger by less than this share, and by no more points, is as good.
_AS_GOOD, _POINTS = 1.2, 2.0
# Of a preference, what comes before the number of parameters.
_CONDITIONS = 4

Ranges = tuple[tuple[int, int | None], ...]
"""Delays from the one to the other; None: no upper limit is told."""

Shape = Orders | Process
"""A structure for one output."""


@dataclass(frozen=True)
class Candidate:
    """One structure for one output.

    Attributes:
        orders: the structure; `model` is it, estimated on the first part.
        estimation, validation: per cent that the simulation explains of the two parts.
        prediction: per cent one step ahead, on the second part.
        criterion: log of the variance + k log(N) / N (BIC) on the first part; in a loop
            + 2 k log(log(N)) / N [hannan-quinn-1979].
        failed: tests of the residuals that refute it.
        steady: whether its plant is stable, as far as the record tells, and within what it shows.
        ranges: of each input, the delays that 95 % of confidence leaves, where dead times are parameters.
        latest: samples beyond which a dead time has run off to where nothing answers.
        by_prediction: whether prediction errors rank it: in a loop, and where the noise integrates.
    """

    orders: Shape
    model: Model
    estimation: float
    validation: float
    prediction: float
    criterion: float
    failed: tuple[str, ...]
    converged: bool
    steady: bool
    ranges: tuple[tuple[int, int], ...]
    latest: int
    by_prediction: bool

    @property
    def theta(self) -> Array:
        """(k,)."""
        return self.model.theta

    @property
    def settled(self) -> bool:
        """Whether the search ended, as far as a quick one tells: kinks at dead times stop it early."""
        return self.converged or self.orders.physical

    @property
    def biased(self) -> bool:
        """Whether failed tests speak against its plant.

        A wrong noise model biases an A that plant and noise share, not the plant of OE and BJ
        ([ljung-1999], Section 8.4); in a loop it biases them all (Section 13.4).
        """
        return (self.orders.shared or self.by_prediction) and bool(self.failed)

    def estimated(self, theta: Array, noise: Array) -> Candidate:
        """The same from other data.

        Raises:
            ArithmeticError: a dead time has run off.
        """
        settled_at(self.orders, theta, self.latest)
        return replace(self, model=self.model.at(theta, noise))

    @property
    def unknowns(self) -> int:
        """Parameters, delays that were searched for included."""
        return self.orders.size + (0 if self.orders.physical else len(self.orders.delays))


@dataclass(frozen=True)
class Chosen:
    """What was found for one output.

    Attributes:
        candidates: the best first.
        by_order: order of the plant -> least output error (rms) on the first part, quickly estimated.
        finalists: those that may be taken, the best first.
        estimated: the records of the first part.
        least, most: the delays that were looked for, of each input from the one to the other.
        dropped: families of which no structure could be estimated.
    """

    candidates: tuple[Candidate, ...]
    by_order: dict[int, float]
    finalists: tuple[Candidate, ...]
    estimated: Parts
    least: tuple[int, ...]
    most: int
    dropped: tuple[str, ...]

    @property
    def best(self) -> Candidate:
        """The one to take."""
        return self.candidates[0]

    @property
    def ranked(self) -> list[Candidate]:
        """Those that may be taken, then the others, the best first.

        After them the biased ones, and those on the edge of stability last. A static gain that is no
        finalist is none of them: it would hide what the plant does.
        """
        others = [
            c for c in self.candidates if c.orders.order and all(c is not one for one in self.finalists)
        ]
        return sorted((*self.finalists, *others), key=lambda c: (not c.steady, c.biased))

    def ranges(self, candidate: Candidate) -> Ranges:
        """Of each input, the delays that 95 % of confidence leaves a candidate."""
        order = min(max(candidate.orders.order, 1), max(self.by_order))
        delays = candidate.orders.delays
        found = candidate.ranges or delay_ranges(self.estimated, order, delays, self.least, self.most)
        # A Gaussian estimate of a dead time may be wider than the record that it is made from.
        longest = max(len(y) for _, y in self.estimated)
        return tuple((low, high if high <= longest else None) for low, high in found)

    def best_of(self, *, physical: bool) -> Candidate | None:
        """The best with parameters of that kind among those that are about as good as any."""
        return next((c for c in self.finalists if c.orders.physical == physical), None)

    def with_filtered_noise(self, plain: Candidate, order: int) -> Candidate:
        """The candidate with the plant of one whose noise is white, and a filter of that order; or itself."""
        if plain.orders.coloured:
            return plain
        shape = plain.orders.with_coloured_noise()[order]
        same = (c for c in self.candidates if replace(c.orders, delays=shape.delays) == shape)
        return next(same, plain)


def settled_at(orders: Shape, theta: Array, latest: int) -> Shape:
    """The structure with the delays that parameters (k,) tell.

    Raises:
        ArithmeticError: a dead time has run off beyond the `latest` sample at which anything answers.
    """
    settled = orders.at(theta)
    if max(settled.delays) > latest:
        raise ArithmeticError("a dead time has run off to where nothing answers")
    return settled


def with_noise(plain: Sequence[Candidate]) -> list[Shape]:
    """The plant that simulates best with filtered noise, and simpler ones that do so about as well.

    In a loop, or beside noise that integrates, all of them: a plant with the wrong noise is none.
    """
    if plain[0].by_prediction:
        return [shape for c in plain for shape in c.orders.with_coloured_noise()]
    best, most = max(plain, key=lambda c: c.validation), _most_error(plain)
    near = [c for c in plain if 100.0 - c.validation <= most and c.unknowns < best.unknowns]
    return [*best.orders.with_coloured_noise(), *(c.orders.with_coloured_noise()[0] for c in near)]


def about_as_good(usable: Sequence[Candidate]) -> list[Candidate]:
    """Those that simulate about as well as any, the one to take first; by prediction, the likeliest first."""
    if usable[0].by_prediction:
        return sorted(usable, key=lambda c: (not c.settled, not c.steady, bool(c.failed), c.criterion))
    most = _most_error(usable)
    return sorted((c for c in usable if 100.0 - c.validation <= most), key=_preference)


def likeliest(c: Candidate) -> float:
    """By this they are ordered: the error of the simulation of unseen data, in a loop the criterion.

    An input that answers the noise tells of it, so that in a loop a wrong plant may simulate the output
    better than the right one. Prediction errors do not err ([ljung-1999], Section 13.4).
    """
    return c.criterion if c.by_prediction else -c.validation


def noise_first(good: Sequence[Candidate], filtered: Sequence[Candidate]) -> list[Candidate]:
    """Those that are as good, before them the first one's plant with filtered noise where that is better.

    A wrong noise model leaves the plant of OE and of processes as it is, but not its covariance, nor what an
    experiment must do for it ([ljung-1999], Section 8.4).

    Args:
        filtered: the plant of the first with filtered noise.
    """
    most, plain = _most_error(good), good[0]
    better = [
        c
        for c in filtered
        if 100.0 - c.validation <= most
        and c.criterion < plain.criterion
        and c.prediction > plain.prediction
        and _preference(c)[:_CONDITIONS] <= _preference(plain)[:_CONDITIONS]
    ]
    shapes = {c.orders for c in better}
    first = sorted(better, key=lambda c: (len(c.failed), c.criterion))
    return [*first, *(c for c in good if c.orders not in shapes)]


def _most_error(usable: Sequence[Candidate]) -> float:
    error = min(100.0 - c.validation for c in usable)
    return min(_AS_GOOD * error, error + _POINTS)


def _preference(c: Candidate) -> tuple[float, ...]:
    conditions = (not c.settled, c.biased, not c.steady, bool(c.failed))
    return (*conditions, c.unknowns, not c.orders.physical, -c.validation)
