"""Find the structure that explains an output: estimated on one part of the record, validated on another.

A sweep of regressions gives delays and orders. An autoregression of its residuals whitens the noise, and a
second sweep of the whitened records gives starts. In a loop a long ARX model whitens it at once. Up to a
dozen structures are then estimated by output errors of the whitened records, which are prediction errors for
that noise.

Structures that simulate unseen data about as well count alike. Of these the criterion takes one, in which
every parameter must lower the variance of the prediction errors by a share. A structure with a parameter
that deviates by more than half its value comes last.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
import scipy
from numpy.typing import NDArray

from inputdesign_cli.arrays import Array
from inputdesign_cli.compute.time_limit import Counted, report_progress
from inputdesign_cli.explore.division import busiest, cut
from inputdesign_cli.explore.fits import NOT_COMPUTED, Parts, fits, is_steady
from inputdesign_cli.explore.relation import autoregression
from inputdesign_cli.explore.structures import Orders, Process
from inputdesign_cli.explore.sweep import (
    Regressed,
    Sweep,
    delay_ranges,
    lingering,
    noise_model,
    sweep,
    whitened,
    whitening,
)
from inputdesign_cli.identification.adequacy import failed, score_tests
from inputdesign_cli.identification.checks import check_length
from inputdesign_cli.identification.estimators import estimator, factor_at
from inputdesign_cli.identification.records import Records, centred, noise_of
from inputdesign_cli.identification.search import search
from inputdesign_cli.identification.white import White
from inputdesign_cli.plant import Model

# An error of simulation that is larger by less than this factor, or these points, is as good, if it
# explains almost as much of the variance of the output.
_AS_GOOD, _POINTS, _EXPLAINED = 1.2, 2.0, 0.99
_WORST_ERROR = 1e6  # per cent; beyond this a fit says nothing
# The largest deviation of a parameter of the plant, in shares of its value.
_UNCERTAIN = 0.5
# The least relative decrease of the prediction-error variance per parameter, for records of any length; the
# advantage of gains, time constants and dead times over polynomials, in the same measure.
_LEAST_PRICE, _PHYSICAL = 0.01, 0.02
_MOST_SAMPLES = 4000
_HIGHEST, _HIGHEST_ARX = 5, 8
# The fewest samples per parameter; steps of a search.
_PER_PARAMETER, _STEPS = 5, 30
# A dead time may settle _SETTLES samples beyond the sweep's, and at most at _RUN_OFF times the longest.
_SETTLES, _RUN_OFF = 5, 2

Shape = Orders | Process
"""A structure for one output."""

Family = Literal["fopdt", "sopdt", "integrator", "arx", "armax", "oe", "bj"]
"""A structure that a user may fix."""


@dataclass(frozen=True, eq=False)
class Candidate:
    """One structure for one output.

    Attributes:
        orders: the structure; `model` is it, estimated on the first part.
        ranges: the 95 % interval of each delay.
        estimation, validation: per cent that the simulation explains of the two parts.
        prediction: per cent one step ahead, on the second part.
        criterion: log of the variance of the prediction errors, plus the price of the parameters.
        steady: whether its plant is stable, as far as the record shows.
        certain: whether no parameter of the plant deviates by more than half its value.
        failed: names of the tests of its residuals that fail.
    """

    orders: Shape
    model: Model
    ranges: tuple[tuple[int, int], ...]
    estimation: float
    validation: float
    prediction: float
    criterion: float
    converged: bool
    steady: bool
    certain: bool
    failed: tuple[str, ...]


@dataclass(frozen=True)
class Chosen:
    """Holds the result of the search for one output.

    Attributes:
        candidates: the best come first; the `good` explain the record about as well as any.
        swept: the regressions of the first part.
        dropped: families without a structure that could be estimated.
    """

    candidates: tuple[Candidate, ...]
    good: tuple[Candidate, ...]
    swept: Sweep
    dropped: tuple[str, ...]

    @property
    def best(self) -> Candidate:
        """Return the best candidate."""
        return self.candidates[0]


def certain(theta: Array, deviations: Array, dead_times: NDArray[np.bool_], step: float) -> bool:
    """Return whether no parameter (k,) deviates by more than half its value.

    A dead time may deviate by up to a sample, `step`: it may be zero.
    """
    most = np.maximum(_UNCERTAIN * np.abs(theta), np.where(dead_times, step, 0.0))
    return bool(np.all(deviations <= most))


def ranked(
    usable: Sequence[Candidate], *, by_prediction: bool = False
) -> tuple[tuple[Candidate, ...], tuple[Candidate, ...]]:
    """Return the candidates, the preferred one first, and the subset that simulates about equally well.

    In closed loop the input depends on the noise, so that a wrong plant may simulate the output better than
    the right one. Prediction errors are free of this bias ([ljung-1999], Section 13.4): they alone count.
    """
    error = min(_WORST_ERROR, *(100.0 - c.validation for c in usable))
    most, explained = max(_AS_GOOD * error, error + _POINTS), 1e4 - error**2

    def is_good(c: Candidate) -> bool:
        own = 100.0 - c.validation
        return by_prediction or (own <= most and 1e4 - own**2 >= _EXPLAINED * explained)

    def preference(c: Candidate) -> tuple[float, ...]:
        by = c.criterion - _PHYSICAL * c.orders.physical if is_good(c) else -c.validation
        return not is_good(c), not c.steady, not c.certain, not c.converged, by

    every = tuple(sorted(usable, key=preference))
    return every, tuple(c for c in every if is_good(c))


@dataclass(frozen=True)
class _Records:
    """Holds the records by which structures are estimated and judged.

    Attributes:
        first, judging: records of one output; the first `late` samples of each that judges are left out.
        white: the first part through the autoregression of its noise; `swept` its regressions.
        C, D: the noise model of structures that have none of their own.
        feedback: whether inputs depend on the outputs.
        step: the sample time.
    """

    first: Parts
    judging: Parts
    white: Parts
    swept: Sweep
    late: int
    C: Array
    D: Array
    feedback: bool
    step: float

    @property
    def samples(self) -> int:
        """Return the number of samples that estimate."""
        return sum(len(y) for _, y in self.first)

    def candidate(self, shape: Shape) -> Candidate:
        """Return a structure, estimated and judged; it may raise one of `NOT_COMPUTED`."""
        parts, near = self.first if shape.shared else self.white, self.swept.near(shape.order)
        if not shape.physical and near.delays != shape.delays:
            near = Regressed(parts, near.order).output_error(shape.delays, near.F)
        kind, start = estimator(shape.model(), 1.0), shape.start(near)
        check_length(sum(len(y) for _, y in parts), len(kind.model.names), kind.recent, outputs=1)
        records = Records(kind, tuple(centred(parts))).begun_freely(kind.lateness(start))
        found = search(records, records.stabilised(start)[None], starts=1, quick=_STEPS)
        point, theta, noise = found.point, found.point.theta, noise_of(records, found.point)
        factor = factor_at(records, point, noise)
        half = scipy.linalg.solve_triangular(factor, np.eye(len(factor)), lower=True)
        tests = score_tests(records, theta, White.of(records, point), feedback=self.feedback, robust=None)
        deviations = np.linalg.norm(half, axis=0)[shape.model().in_plant]
        shape = shape.at(theta) if shape.physical is True else shape
        if max(shape.delays) > _RUN_OFF * self.swept.most:
            raise ArithmeticError("a dead time has run off to where nothing answers")
        model = shape.noisy(theta, self.C, self.D)
        model = model.at(model.theta, noise)
        plant, judged, physical = model.in_plant, fits(model, self.judging, self.late), bool(shape.physical)
        unknowns = shape.size + (0 if physical else len(shape.delays))
        # The price of a parameter by BIC, or a fixed share if that is larger.
        price = max(float(np.log(self.samples)) / self.samples, _LEAST_PRICE)
        if shape.physical is True:
            ranges = shape.ranges(model.theta[plant], deviations)
        else:
            ranges = delay_ranges(self.first, near, least=int(self.feedback), most=self.swept.most)
        longest = max(len(y) for _, y in self.first)
        return Candidate(
            shape.coloured(self.C, self.D),
            model,
            tuple((low, min(high, longest)) for low, high in ranges),
            fits(model, self.first, self.late).simulation[0],
            judged.simulation[0],
            judged.prediction[0],
            float(np.log(max(noise[0, 0], 1e-300))) + unknowns * price,
            found.converged or physical,  # kinks at dead times stop a quick search early
            shape.integrates or is_steady(model, self.samples),
            certain(model.theta[plant], deviations, model.dead_times[plant], self.step * physical),
            tuple(test.name for test in failed(tests)),
        )


def explore_structure(
    first: Parts,
    second: Parts,
    *,
    feedback: bool = False,
    step: float = 1.0,
    physical: bool = True,
    only: Family | None = None,
) -> Chosen | None:
    """Return the structures of one output y (n, 1) from all inputs (n, r); None if none can be estimated.

    Args:
        first, second: records to estimate from and to judge by.
        feedback: whether u(t) may depend on y(t).
        step: the sample time.
        physical: whether plants in s are tried.
        only: the only family of structures to try; None: all.
    """
    first, second = (cut(parts, busiest(parts, _MOST_SAMPLES)) for parts in (first, second))
    records = _prepared(first, second, feedback, step, only)
    every = dict.fromkeys(_shapes(records, physical, only))
    shapes = [shape for shape in every if _PER_PARAMETER * shape.size <= records.samples]
    found = list[Candidate]()
    for count, shape in enumerate(shapes):
        report_progress(Counted(f"structures estimated, now {shape.family}", count, len(shapes)))
        try:
            found.append(records.candidate(shape))
        except NOT_COMPUTED:
            continue
        except KeyboardInterrupt:
            if not found:
                raise
            break
    usable = [c for c in found if np.isfinite(c.validation)]
    if not usable:
        return None
    estimated = {c.orders.family for c in found}
    wanted = dict.fromkeys(shape.coloured(records.C, records.D).family for shape in shapes)
    dropped = tuple(family for family in wanted if family not in estimated)
    chosen = ranked(usable, by_prediction=feedback)
    return Chosen(*chosen, records.swept, dropped)


def _prepared(first: Parts, judging: Parts, feedback: bool, step: float, only: Family | None) -> _Records:
    """Return the records with their noise whitened, and the regressions of all orders."""
    samples, inputs = sum(len(y) for _, y in first), first[0][0].shape[1]
    highest = max(min(_HIGHEST, samples // (6 * (inputs + 1))), 1)
    looped = feedback and only != "oe"
    # The output errors of a plant are biased in a loop, and so is their noise.
    white = (whitened(first, autoregression(first)) if looped else first) or first
    swept, C, D = sweep(white, highest, least=int(feedback)), np.ones(1), np.ones(1)
    left = Regressed(first, swept.best.order).errors(swept.best)
    if only != "oe" and all(np.all(np.isfinite(e)) for e in left):
        C, D = noise_model(left, int(feedback or only == "bj"))
        white = white if looped else whitened(first, whitening(left)) or white
        swept = swept if looped else sweep(white, highest, least=0)
    longest = max(len(y) for _, y in judging)
    late = max(max(one.delays) for one in swept.by_order.values()) + _SETTLES
    return _Records(first, judging, white, swept, late if late < longest // 2 else 0, C, D, feedback, step)


def _shapes(records: _Records, physical: bool, only: Family | None) -> list[Shape]:
    """Return the structures to try, the simplest first, or the orders of the one family that is asked for."""
    swept, step, near = records.swept, records.step, records.swept.best
    first, second = (swept.near(n) for n in (1, 2))
    asked: dict[Family | None, list[Shape]] = {
        "arx": [Orders("ARX", near.delays, n, a=n) for n in range(1, _HIGHEST_ARX + 1)],
        "armax": [Orders("ARMAX", one.delays, n, a=n, c=n) for n, one in swept.by_order.items()],
        "oe": [Orders("OE", one.delays, n, f=n) for n, one in swept.by_order.items()],
        "bj": [Orders("OE", one.delays, n, f=n) for n, one in swept.by_order.items()],
        "fopdt": [Process(first.delays, 1, step)],
        "sopdt": [Process(second.delays, 2, step)],
        "integrator": [Process(first.delays, 0, step), Process(second.delays, 1, step, rising=True)],
    }
    if only is not None:
        return asked[only]
    found: list[Shape] = [Orders("FIR", first.delays, 1)]
    if physical:
        found += [*asked["fopdt"], *asked["sopdt"]]
        found += [Process(second.delays, 2, step, zero=True)] if near.order > 1 else []
        found += asked["integrator"][:1] if lingering(first.F, records.samples) else []
        rises = near.order > 1 and lingering(second.F, records.samples)
        found += asked["integrator"][1:] if rises else []
    found += [Orders("OE", swept.near(n).delays, max(n, 2), f=n) for n in sorted({1, near.order})]
    if max(swept.by_order) > 1 and not records.feedback:
        found.append(Orders("ARMAX", second.delays, 2, a=2, c=2))
    return [*found, *(Orders("ARX", near.delays, n, a=n) for n in (near.order, near.order + 1))]
