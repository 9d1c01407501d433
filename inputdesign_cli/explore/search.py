"""Which structure explains an output: estimated on one part of the record, judged by simulation on another.

Delays and the order come from quick output-error estimates; ARX models of all orders up to eight are
judged beside them. The best few of every family are then estimated by prediction errors, and `candidates`
says which one to take.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from functools import partial

import numpy as np
import scipy

from inputdesign_cli.arrays import Array
from inputdesign_cli.explore.busiest import busiest
from inputdesign_cli.explore.candidates import (
    Candidate,
    Chosen,
    Shape,
    about_as_good,
    likeliest,
    noise_first,
    settled_at,
    with_noise,
)
from inputdesign_cli.explore.delays import criterion, delays_of
from inputdesign_cli.explore.division import known_before
from inputdesign_cli.explore.fits import (
    NOT_COMPUTED,
    Parts,
    fits,
    is_steady,
    output_error_form,
    simulation_fit,
)
from inputdesign_cli.explore.integrated import differenced, integrating
from inputdesign_cli.explore.orders import Orders, arx, plant_order, static_gain
from inputdesign_cli.explore.processes import processes
from inputdesign_cli.explore.regression import SharedDenominator, arx_grid, best_delays, from_rest, whitened
from inputdesign_cli.identification.adequacy import failed, score_tests
from inputdesign_cli.identification.checks import check_length
from inputdesign_cli.identification.estimate import factor_at, noise_of
from inputdesign_cli.identification.estimators import estimator
from inputdesign_cli.identification.records import Records, centred
from inputdesign_cli.identification.search import search
from inputdesign_cli.identification.white import White
from inputdesign_cli.plant import Model

_MOST_SAMPLES = 4000
_HIGHEST, _HIGHEST_ARX = 5, 8
# So far beyond the longest delay that was looked for a dead time may settle.
_RUN_OFF = 2
# Plants up to this order are always tried.
_ALWAYS = 3
_ARX_KEPT = 2
# Of each family so many are estimated once more, levels and starts along with them.
_FINALISTS = 2
# Samples to a parameter, at least; steps of the search for a candidate, by whether it is physical, and times
# as many for a finalist.
_PER_PARAMETER = 5
_STEPS, _AGAIN = {False: 100, True: 30}, 4


@dataclass(frozen=True)
class _Parts:
    """What structures are estimated from, `first`, and judged by: `levels`, the same, and `judging`.

    Of each record that judges the first `late` samples are left out, those recorded `before` it among them.
    Plants whose dead time has run off beyond `latest` samples are left out as well.
    """

    first: Parts
    levels: Parts
    judging: Parts
    before: Parts
    feedback: bool
    wanders: bool
    quick: dict[int, SharedDenominator]
    resting: Mapping[int, Parts]
    late: int
    latest: int

    @property
    def samples(self) -> int:
        return sum(len(y) for _, y in self.first)

    @property
    def _price(self) -> float:
        """Of a parameter: that of BIC; in a loop, where a plant that is too simple is biased, less.

        The least that is consistent ([hannan-quinn-1979]).
        """
        logarithm = float(np.log(self.samples))
        return 2.0 * float(np.log(logarithm)) if self.feedback else logarithm

    def candidate(self, orders: Shape) -> Candidate | None:
        """A structure, quickly estimated from records that begin at rest, and judged; None: it cannot be."""
        n = min(max(orders.order, 1), max(self.quick))
        resting = self.resting[n]
        try:
            points = orders.starts(resting, self.quick[n], max(n, 2))
            return self._searched(orders, orders.model(), resting, points, free=False)
        except NOT_COMPUTED:
            return None

    def refined(self, candidate: Candidate) -> Candidate | None:
        """The same, levels and starts estimated along: the search goes on from where it ended."""
        try:
            return self._searched(
                candidate.orders,
                candidate.orders.model(),
                centred(self.first),
                candidate.theta[None],
                free=True,
            )
        except NOT_COMPUTED:
            return None

    def _searched(
        self, orders: Shape, structure: Model, parts: Parts, points: Array, *, free: bool
    ) -> Candidate:
        kind = estimator(structure, 1.0).kind
        check_length(self.samples, len(kind.names), kind.recent, outputs=1)
        records = Records(tuple(kind.record(*part) for part in parts))
        if free:
            records = records.begun_freely(max(records.lateness(theta) for theta in points))
        found = search(
            records, points, starts=len(points), quick=_STEPS[orders.physical] * (_AGAIN if free else 1)
        )
        settled = settled_at(orders, found.point.theta, self.latest)
        noise = noise_of(found.point, kind.own())
        factor = factor_at(kind.names, records, found.point, noise)
        deviations = np.linalg.norm(
            scipy.linalg.solve_triangular(factor, np.eye(len(factor)), lower=True), axis=0
        )
        echoes = kind.echoes(found.point.theta, records.lengths)
        white = White.of(records, found.point, echoes)
        tests = score_tests(
            records, found.point, white, recent=kind.recent, feedback=self.feedback, echoes=echoes
        )
        fitted = integrating(structure.at(found.point.theta, noise), (self.wanders,))
        on_first = fits(fitted, self.levels, self.late)
        on_second = fits(fitted, self.judging, self.late, self.before)
        return Candidate(
            settled,
            fitted,
            on_first.simulation[0],
            on_second.simulation[0] if output_error_form(fitted).radius < 1.0 else -np.inf,
            on_second.prediction[0],
            float(np.log(max(noise[0, 0], 1e-300)) + orders.size * self._price / self.samples),
            tuple(test.name for test in failed(tests)),
            found.converged,
            is_steady(fitted, self.samples) and not orders.beyond(found.point.theta, self.samples),
            orders.ranges(found.point.theta, deviations),
            self.latest,
            self.feedback or self.wanders,
        )


def explore_structure(
    first: Parts,
    second: Parts,
    *,
    feedback: bool = False,
    step: float = 1.0,
    physical: bool = True,
    wanders: bool = False,
    before: Parts = (),
) -> Chosen | None:
    """The structures of one output, y (n, 1), from all inputs (n, r); None where nothing can be estimated.

    Args:
        first, second: records to estimate from and to judge by.
        feedback: whether u(t) may answer y(t).
        step: the sample time.
        physical: whether plants in s are tried.
        wanders: whether the noise integrates.
        before: what was recorded right before each of those that judge; empty: nothing.
    """
    levels, judging = busiest(first, _MOST_SAMPLES), busiest(second, _MOST_SAMPLES)
    first = differenced(levels) if wanders else levels
    if any(len(y) != len(own) for (_, y), (_, own) in zip(second, judging, strict=True)):
        before = ()
    by_prediction = feedback or wanders
    samples = sum(len(y) for _, y in first)
    r, longest = first[0][0].shape[1], max(len(y) for _, y in judging)
    highest = max(min(_HIGHEST, samples // (6 * (r + 1))), 1)
    # In a loop an input answers the noise; what is left of it must be white to tell the plant.
    clean = whitened(first) if by_prediction else first
    delays = delays_of(first, clean, highest, longest, feedback=feedback, known=bool(before))
    quick, late = delays.quick, delays.latest
    by_order = {n: float(np.sqrt(found.loss)) for n, found in quick.items()}
    near = min(quick, key=lambda n: criterion(quick[n], samples))
    resting = {n: from_rest(first, found, max(n, 2)) for n, found in quick.items()}
    # Delays that some orders take for others are no reason to judge by other samples.
    before = known_before(judging, before, late) if delays.told else ()
    # What is to judge a model must be longer than its delay.
    latest = min(_RUN_OFF * delays.most, longest + (late if before else 0) - 1)
    parts = _Parts(first, levels, judging, before, feedback, wanders, quick, resting, late, latest)

    families = dict[str, None]()

    def judged(tried: Iterable[Shape]) -> list[Candidate]:
        small = [shape for shape in dict.fromkeys(tried) if _PER_PARAMETER * shape.size <= samples]
        families.update(dict.fromkeys(shape.family for shape in small))
        return [candidate for candidate in map(parts.candidate, small) if candidate is not None]

    orders = sorted({*range(1, min(highest, _ALWAYS) + 1), near})
    gain = static_gain(best_delays(clean, 0, 1, delays.most, quick[1].delays, delays.least).delays)
    in_s = [process for n in quick if physical for process in processes(n, quick[n].delays, step)]
    if wanders:
        plain: list[Shape] = [gain, *(plant_order(n, quick[n].delays)[-1] for n in orders), *in_s]
        found = judged(shape.with_coloured_noise()[0] for shape in plain)
    else:
        begun = [quick[near].delays, *((d,) * r for d in (0, 1) if d >= max(delays.least))]
        known = [shape for n in orders for shape in plant_order(n, quick[n].delays)]
        judge = partial(simulation_fit, parts=judging, late=late, before=before)
        found = judged([gain, *known, *_best_arx(first, judge, begun, samples), *in_s])
        for family in ({"OE"}, {"FOPDT", "SOPDT", "TOPDT"}):
            simulating = [c for c in found if c.orders.family in family]
            if simulating:
                found += judged(with_noise(simulating))
    again = {c.orders: parts.refined(c) for c in _leading(found)}
    found = [again.get(c.orders) or c for c in found]
    usable = [c for c in again.values() if c is not None and np.isfinite(c.validation)]
    if not usable:
        return None
    good = about_as_good(usable)
    if good[0].failed and not (by_prediction or good[0].orders.coloured):
        filtered = map(parts.refined, judged(good[0].orders.with_coloured_noise()))
        good = noise_first(good, [c for c in filtered if c is not None])
    best = good[0]
    every = {c.orders: c for c in (*found, *good)}
    rest = sorted((c for c in every.values() if c.orders != best.orders), key=likeliest)
    estimated = {c.orders.family for c in found}
    dropped = tuple(family for family in families if family not in estimated)
    return Chosen((best, *rest), by_order, tuple(good), first, delays.least, delays.most, dropped)


def _leading(found: Sequence[Candidate]) -> list[Candidate]:
    """The best of every family; those with coloured noise beside the plain ones, of which they are made."""
    kept: list[Candidate] = []
    for candidate in sorted(found, key=likeliest):
        alike = sum(
            (c.orders.family, c.orders.coloured) == (candidate.orders.family, candidate.orders.coloured)
            for c in kept
        )
        if alike < _FINALISTS and np.isfinite(candidate.validation):
            kept.append(candidate)
    return kept


def _best_arx(
    first: Parts, judge: Callable[[Model], tuple[float, ...]], begun: Sequence[tuple[int, ...]], samples: int
) -> Iterator[Orders]:
    """The ARX models that `judge` says simulate best, of sets of delays."""
    r = len(begun[0])
    highest = max(min(_HIGHEST_ARX, samples // (6 * (r + 1))), 1)
    ranked = []
    for a, b, lags, theta in arx_grid(first, highest, list(dict.fromkeys(begun))):
        orders = arx(lags, a, b)
        if np.all(np.isfinite(theta)) and orders.size == theta.size:
            model = orders.model().at(theta)
            with suppress(*NOT_COMPUTED):
                if all(model.stable_outputs):
                    ranked.append((judge(model)[0], orders))
    ranked.sort(key=lambda pair: -pair[0])
    return (orders for _, orders in ranked[:_ARX_KEPT])
