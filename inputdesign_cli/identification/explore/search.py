"""Which structure explains an output: estimated on one part of the record, judged by simulation on another.

Delays and the order come from quick output-error estimates; ARX models of all orders up to eight are
judged beside them. The best few of every family are then estimated by prediction errors. Of models that are
about equally good the one with the fewest parameters is chosen.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from inputdesign_cli.errors import SpecError
from inputdesign_cli.identification.adequacy import ScoreTest, failed, score_tests
from inputdesign_cli.identification.estimate import noise_of
from inputdesign_cli.identification.explore.fits import Parts, fits, simulation_fit
from inputdesign_cli.identification.explore.orders import Orders, arx, box_jenkins, plant_order
from inputdesign_cli.identification.explore.regression import arx_grid, best_delays, from_rest, output_error
from inputdesign_cli.identification.polynomial_record import PolynomialRecord
from inputdesign_cli.identification.polynomials import identify_polynomials
from inputdesign_cli.identification.records import Records, centred
from inputdesign_cli.identification.search import search
from inputdesign_cli.identification.structure import Structure
from inputdesign_cli.plant.polynomial import Array

_MOST_SAMPLES = 4000
_MOST_DELAY = 150
_HIGHEST, _HIGHEST_ARX = 5, 8
# Plants up to this order are always tried.
_ALWAYS = 3
_ARX_KEPT = 2
# Of each family so many are estimated once more, levels and starts along with them.
_FINALISTS = 2
# An error of simulation that is larger by less than this share is as good.
_AS_GOOD = 1.2
_CHI2 = 3.84  # 95 % for one degree of freedom
_WIDTH = 6


@dataclass(frozen=True)
class Candidate:
    """One structure for one output.

    Attributes:
        theta: (k,), estimated on the first part.
        estimation, validation: per cent that the simulation explains of the two parts.
        prediction: per cent one step ahead, on the second part.
        criterion: log of the variance + k log(N) / N (BIC), on the first part.
        failed: tests of the residuals that refute it.
        biased: whether that speaks against its plant: a wrong noise model biases an A that plant and noise
            share, not the plant of OE and BJ ([ljung-1999], Section 8.4).
    """

    orders: Orders
    theta: Array
    estimation: float
    validation: float
    prediction: float
    criterion: float
    failed: tuple[str, ...]
    biased: bool
    converged: bool


@dataclass(frozen=True)
class Chosen:
    """What was found for one output.

    Attributes:
        candidates: the best first.
        ranges: of each input, the delays that 95 % of confidence leaves.
        by_order: order of the plant -> least output error (rms) on the first part, quickly estimated.
    """

    candidates: tuple[Candidate, ...]
    ranges: tuple[tuple[int, int], ...]
    by_order: dict[int, float]

    @property
    def best(self) -> Candidate:
        """The one to take."""
        return self.candidates[0]


def explore_structure(first: Parts, second: Parts, *, feedback: bool = False) -> Chosen | None:
    """The structures of one output, y (n, 1), from all inputs (n, r); None where nothing can be estimated.

    Args:
        first, second: records to estimate from and to judge by.
        feedback: whether u(t) may answer y(t).
    """
    first, second = busiest(first, _MOST_SAMPLES), busiest(second, _MOST_SAMPLES)
    samples = sum(len(y) for _, y in first)
    r = first[0][0].shape[1]
    most = max(min(_MOST_DELAY, max(len(y) for _, y in first) // 6), 1)
    highest = max(min(_HIGHEST, samples // (6 * (r + 1))), 1)
    delays: tuple[int, ...] = (int(feedback),) * r
    quick, tried = {}, list[Orders]()
    for n in range(1, highest + 1):
        found = best_delays(first, n, max(n, 2), most, delays)
        quick[n] = found
        delays = found.delays
    by_order = {n: float(np.sqrt(found.loss)) for n, found in quick.items()}
    penalty = np.log(samples) / samples
    near = min(quick, key=lambda n: np.log(max(quick[n].loss, 1e-300)) + (2 * n + 2) * penalty)
    resting = {n: from_rest(first, found, max(n, 2)) for n, found in quick.items()}

    def judged(tried: Iterable[Orders]) -> list[Candidate]:
        found = [
            _candidate(orders, resting[min(max(orders.order, 1), highest)], first, second, feedback)
            for orders in dict.fromkeys(tried)
        ]
        return [candidate for candidate in found if candidate is not None]

    for n in sorted({*range(1, min(highest, _ALWAYS) + 1), near}):
        tried += plant_order(n, quick[n].delays)
    tried += _best_arx(first, second, quick[near].delays, r, samples)
    found_models = judged(tried)
    plain = [c for c in found_models if c.orders.family == "OE"]
    if plain:
        found_models += judged(box_jenkins(max(plain, key=lambda c: c.validation).orders))
    finalists = {
        c.orders: c for c in (_refined(c, first, second, feedback) for c in _leading(found_models)) if c
    }
    found_models = [finalists.get(c.orders, c) for c in found_models]
    usable = [c for c in finalists.values() if np.isfinite(c.validation)]
    if not usable:
        return None
    least = min(100.0 - c.validation for c in usable)
    good = [c for c in usable if 100.0 - c.validation <= _AS_GOOD * least]
    best = min(good, key=lambda c: (c.biased, c.orders.size, -c.validation))
    rest = sorted((c for c in found_models if c.orders != best.orders), key=lambda c: -c.validation)
    order = min(max(best.orders.order, 1), highest)
    return Chosen((best, *rest), _ranges(first, order, best.orders.delays, most), by_order)


def _leading(found: Sequence[Candidate]) -> list[Candidate]:
    """The best of every family."""
    kept: list[Candidate] = []
    for candidate in sorted(found, key=lambda c: -c.validation):
        alike = sum(c.orders.family == candidate.orders.family for c in kept)
        if alike < _FINALISTS and np.isfinite(candidate.validation):
            kept.append(candidate)
    return kept


def _candidate(
    orders: Orders, resting: Parts, first: Parts, second: Parts, feedback: bool
) -> Candidate | None:
    """A structure, quickly estimated from records that begin at rest, and judged."""
    u, y = (np.concatenate(signals) for signals in zip(*resting, strict=True))
    lengths = [len(part) for _, part in resting]
    try:
        found = identify_polynomials(orders.model(), u, y, feedback=feedback, lengths=lengths, rest=True)
    except (SpecError, np.linalg.LinAlgError):
        return None
    return _judged(orders, found.theta, found.noise, found.failed, found.converged, first, second)


def _refined(candidate: Candidate, first: Parts, second: Parts, feedback: bool) -> Candidate | None:
    """The same, levels and starts estimated along: the search goes on from where it ended."""
    structure = Structure.of(candidate.orders.model())
    records = Records(tuple(PolynomialRecord(structure, *part) for part in centred(first)), free=True)
    try:
        found = search(records, candidate.theta[None], starts=1)
        tests = failed(score_tests(records, found.point, recent=structure.memory, feedback=feedback))
    except (SpecError, np.linalg.LinAlgError):
        return None
    noise = noise_of(found.point, structure.own())
    return _judged(candidate.orders, found.point.theta, noise, tests, found.converged, first, second)


def _judged(
    orders: Orders,
    theta: Array,
    noise: Array,
    tests: Sequence[ScoreTest],
    converged: bool,
    first: Parts,
    second: Parts,
) -> Candidate:
    fitted = orders.model().at(theta, noise)
    on_first, on_second = fits(fitted, first), fits(fitted, second)
    samples = sum(len(y) for _, y in first)
    return Candidate(
        orders,
        theta,
        on_first.simulation[0],
        on_second.simulation[0] if all(fitted.stable_outputs) else -np.inf,
        on_second.prediction[0],
        float(np.log(max(noise[0, 0], 1e-300)) + orders.size * np.log(samples) / samples),
        tuple(test.name for test in tests),
        orders.a > 0 and bool(tests),
        converged,
    )


def _best_arx(first: Parts, second: Parts, delays: tuple[int, ...], r: int, samples: int) -> Iterator[Orders]:
    """The ARX models that simulate the second part best."""
    highest = max(min(_HIGHEST_ARX, samples // (6 * (r + 1))), 1)
    ranked = []
    for a, b, lags, theta in arx_grid(first, highest, list(dict.fromkeys([delays, (0,) * r, (1,) * r]))):
        orders = arx(lags, a, b)
        if np.all(np.isfinite(theta)) and Structure.of(orders.model()).size == theta.size:
            model = orders.model().at(theta)
            if all(model.stable_outputs):
                ranked.append((simulation_fit(model, second)[0], orders))
    ranked.sort(key=lambda pair: -pair[0])
    return (orders for _, orders in ranked[:_ARX_KEPT])


def _ranges(parts: Parts, n: int, delays: tuple[int, ...], most: int) -> tuple[tuple[int, int], ...]:
    """By the likelihood ratio, one input after the other, within a few samples of what was chosen."""
    samples = sum(len(y) for _, y in parts)
    found = []
    for j, chosen in enumerate(delays):
        near = [d for d in range(chosen - _WIDTH, chosen + _WIDTH + 1) if 0 <= d <= most]
        losses = {d: output_error(parts, n, max(n, 2), (*delays[:j], d, *delays[j + 1 :])).loss for d in near}
        least = min(losses.values())
        kept = [d for d, loss in losses.items() if samples * np.log(loss / max(least, 1e-300)) <= _CHI2]
        found.append((min(kept), max(kept)))
    return tuple(found)


def busiest(parts: Parts, most: int) -> list[tuple[Array, Array]]:
    """At most so many samples: of long records the stretch in which the inputs move most."""
    share = most // len(parts)
    return [(u[at], y[at]) for u, y in parts for at in [_window(u, share if len(parts) > 1 else most)]]


def _window(u: NDArray[np.float64], length: int) -> slice:
    if len(u) <= length:
        return slice(0, len(u))
    moves = np.sum((np.diff(u, axis=0) / np.maximum(u.std(axis=0), 1e-300)) ** 2, axis=1)
    total = np.concatenate([[0.0], np.cumsum(moves)])
    begin = int(np.argmax(total[length - 1 :] - total[: len(total) - length + 1]))
    return slice(begin, begin + length)
