"""From starting points to the likeliest parameters, other minima, and whether the records begin at rest.

A dead time that was excited at a few frequencies is known only up to whole periods. Near-equal minima then
stand far apart, and the covariance describes one of them alone. Where a dead time passes a sampling instant,
the likelihood has a kink. It may have a minimum between any two instants, as likely as the best and within a
few standard deviations of it. No single minimum shows how far the parameters are known.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
import scipy
from numpy.typing import NDArray

from inputdesign_cli.arrays import Array
from inputdesign_cli.identification.gauss_newton import MOST_STEPS, Minimum, best_run, minimise
from inputdesign_cli.identification.records import Point, RecordProblem, Records, centred, evaluate

# The largest excess in -2 log likelihood of another minimum: a thousandth of the likelihood of the best.
_NEARLY = 2.0 * float(np.log(1000.0))
# Another minimum is farther than _APART, in squared standard deviations, and _UNEXPLAINED times its excess.
# Within one quadratic minimum the squared distance equals the excess.
_APART, _UNEXPLAINED = 25.0, 4.0
# Minima farther apart than _SAME, in squared standard deviations, are distinct. Beyond an instant that is
# farther than _REACH standard deviations no minimum is likely.
_SAME, _REACH, _RIDGE = 0.1, 3.0, 1e-9
# A search begun within a deviation settles in a few steps, or stops at the kink that it has passed.
_STEPS, _ROUNDS = 15, 4
# A search at kinks has settled at _SETTLED, the squared step in standard deviations. The cost must be higher
# at _ASIDE standard deviations beside a kink.
_SETTLED, _ASIDE, _MOST_HELD_STEPS = 1e-8, 0.01, 60
# The least decrease of -2 log likelihood in ten steps of a quick search.
_IDLE = 0.1
# Rest is refuted wrongly with the probability _MISTAKEN. Above the probability _UNLIKELY no search with free
# starts is made. The decrease that a step promises counts up to _MOST_PROMISED of the cost.
_MISTAKEN, _UNLIKELY, _MOST_PROMISED = 0.01, 0.2, 0.999
# Samples of unknown inputs to spare, for a dead time that grows during a search; the most recounts of them.
# Unknown starts are many if fewer than _MANY errors come on each.
_SPARE, _MOST_COUNTS, _MANY = 2, 4, 10
# Rest is not refuted if no more errors than this remain beside parameters and unknown starts.
_FEWEST = 8
# The largest exponent, so that exp stays finite.
_LARGEST = 50.0


@dataclass(frozen=True)
class Rival:
    """Parameters theta (k,) at another minimum, `excess` more in -2 log likelihood than the estimate."""

    theta: Array
    excess: float


@dataclass(frozen=True)
class Search:
    """The end of the search from the best of `starts` points."""

    records: Records
    point: Point
    converged: bool
    steps: int
    starts: int
    rivals: tuple[Rival, ...]  # other minima that explain the records nearly as well, far from the best
    beside: tuple[tuple[Point, float], ...]  # minima near the best, beyond instants, with their excess
    rest_refuted: bool = False  # whether the records say that they do not begin at rest about zero


def search(records: Records, points: Array, *, starts: int, quick: int | None = None) -> Search:
    """Return the likeliest minimum that Gauss-Newton steps find from `points` (n, k), of `starts` tried ones.

    Args:
        quick: the most steps from each, fewer if these gain nothing that matters. Kinks may stop the search,
            and no other minima are returned.
    """
    idle = _IDLE if quick else 0.0
    found = minimise(RecordProblem((records,) * len(points)), points, most=quick or MOST_STEPS, idle=idle)
    found = found if quick else _beyond_instants(records, found)
    best = best_run(found)
    steps, converged = int(found.steps[best]), bool(found.converged[best])
    point = evaluate(records, found.theta[best])
    if quick:
        return Search(records, point, converged, steps, starts, (), ())
    if not converged and np.isfinite(point.cost):
        kinked = settled_at_kinks(records, point)
        point, converged = (point, False) if kinked is None else (kinked, True)
    return Search(records, point, converged, steps, starts, *_others(records, point, found))


def _others(
    records: Records, point: Point, found: Minimum
) -> tuple[tuple[Rival, ...], tuple[tuple[Point, float], ...]]:
    """Return the other minima that explain the records nearly as well as the best `point`, likeliest first.

    Rivals are more than five deviations away. Minima beside the best one come with their excess in -2 log
    likelihood. Only models with dead times have them: kinks separate them from the best one.
    """
    far, beside = [Rival(point.theta, 0.0)], list[tuple[Point, float]]()
    for run in np.argsort(found.cost) if point.cost > 0.0 else ():
        cost, theta = float(found.cost[run]), np.asarray(found.theta[run], dtype=float)
        excess = point.freedom * float(np.log(cost / point.cost)) if np.isfinite(cost) else np.inf
        if excess > _NEARLY:
            break
        if not any(_is_near(point, theta - other.theta, excess - other.excess) for other in far):
            far.append(Rival(theta, max(excess, 0.0)))
        if records.dead_times.size and found.converged[run] and _is_near(point, theta - point.theta, excess):
            here = (point, *(one for one, _ in beside))
            if min(_distance(point, theta - other.theta) for other in here) > _SAME:
                beside.append((evaluate(records, theta), max(excess, 0.0)))
    return tuple(far[1:]), tuple(beside)


def _distance(point: Point, step: Array) -> float:
    """Return the square of a `step` (k,) in standard deviations of the parameters at a point."""
    return point.freedom / point.cost * float(step @ point.hessian @ step)


def _is_near(point: Point, step: Array, excess: float) -> bool:
    """Return whether a step leads to the same minimum, or to one within five deviations."""
    return _distance(point, step) <= max(_APART, _UNEXPLAINED * excess)


def _beyond_instants(records: Records, found: Minimum) -> Minimum:
    """Return `found` with minima beyond the sampling instants next to dead times, until none is better."""
    for _ in range(_ROUNDS):
        best = best_run(found)
        point = evaluate(records, found.theta[best])
        if not (np.isfinite(point.cost) and point.cost > 0.0 and len(points := _beyond(records, point))):
            break
        others = minimise(RecordProblem((records,) * len(points)), points, most=_STEPS)
        better = ~others.converged & (others.cost < point.cost)
        if np.any(better):
            begun = others.theta[better]
            others = others.and_of(minimise(RecordProblem((records,) * len(begun)), begun))
        found = found.and_of(others, others.converged)
        if best_run(found) == best:
            break
    return found


def _beyond(records: Records, point: Point) -> Array:
    """Return starts (n, k) beyond the sampling instants next to dead times.

    If the instant is within reach, the other parameters follow the dead time across it. Otherwise they stay,
    as dead times of a loop may have minima in neighbouring samples, many deviations apart.
    """
    crossings = records.kind.crossings(point.theta, records.longest)
    if not len(crossings):
        return np.zeros((0, point.theta.size))
    scale = np.sqrt(np.maximum(np.diag(point.hessian), 1e-300))
    covariance = np.linalg.pinv(point.hessian / np.outer(scale, scale), rcond=_RIDGE, hermitian=True)
    covariance *= point.cost / point.freedom / np.outer(scale, scale)
    found = []
    for to_instant, to_midst in crossings:
        index = int(np.argmax(np.abs(to_midst)))
        deviation = float(np.sqrt(max(covariance[index, index], 0.0)))
        if deviation > 0.0 and abs(to_instant[index]) < _REACH * deviation:
            beyond = np.clip((to_midst - to_instant)[index], -deviation, deviation)
            step = covariance[index] / covariance[index, index] * (to_instant[index] + beyond)
            found.append(records.stabilised(point.theta + step))
        elif abs(to_instant[index]) < 2.0 * abs((to_midst - to_instant)[index]):  # within a sample
            found.append(records.stabilised(point.theta + to_midst))
    return np.array(found).reshape(-1, point.theta.size)


def settled_at_kinks(records: Records, point: Point) -> Point | None:
    """Return the point where the search settles if kinks of the cost stopped it, otherwise None.

    A dead time that passes a sampling instant makes a kink, and minima may lie on kinks. No Gauss-Newton step
    there gains as much as its slopes promise. The same happens if a root is mirrored into the stable region.
    Parameters that block the way are held, one after the other; only dead times, if there are some. The rest
    settles. Then each held one is moved to both sides, where the cost must be higher.
    """
    every = np.eye(point.theta.size, dtype=bool)
    blocking = records.dead_times.tolist() or range(point.theta.size)
    held = np.zeros(point.theta.size, dtype=bool)

    def moved(step: Array) -> Point:
        return evaluate(records, records.stabilised(point.theta + step))

    for _ in range(_MOST_HELD_STEPS):
        step = _newton(point, held)
        if abs(step @ point.slope) * point.errors.size > _SETTLED * point.cost:
            trial = moved(step)
            if trial.cost >= point.cost:
                more = [held | every[j] for j in blocking if not held[j]]
                if not more:
                    return None
                tried = [moved(_newton(point, one)) for one in more]
                best = int(np.argmin([other.cost for other in tried]))
                held, trial = more[best], tried[best]
            point = trial if trial.cost < point.cost else point
            continue
        size = _ASIDE * np.sqrt(point.cost / point.errors.size / np.maximum(np.diag(point.hessian), 1e-300))
        beside = (moved(sign * size * every[j]) for j in np.flatnonzero(held) for sign in (1.0, -1.0))
        lower = next((other for other in beside if other.cost < point.cost), None)
        if lower is None:
            return point if np.any(held) else None
        held, point = np.zeros_like(held), lower
    return None


def _newton(point: Point, held: NDArray[np.bool_]) -> Array:
    """Return the Gauss-Newton step (k,) of all parameters that are not held."""
    free = np.flatnonzero(~held)
    scale = np.sqrt(np.maximum(np.diag(point.hessian)[free], 1e-300))
    step = np.zeros(held.size)
    matrix = point.hessian[np.ix_(free, free)] / np.outer(scale, scale)
    step[free] = np.linalg.lstsq(matrix, point.slope[free] / scale, rcond=1e-12)[0] / scale
    return step


def _chance_of(at_rest: Search, records: Records, point: Point, gain: float = 0.0) -> float:
    """Return the probability that useless unknown starts at a point lower -2 log likelihood as far.

    Many unknowns shrink the estimated noise, which chi-squared does not account for: F does. The probability
    is one if there are no more unknowns than from rest, or too few errors to compare.
    """
    rest, errors, unknowns = at_rest.point, records.y.size, point.unknowns
    more, left = unknowns - rest.unknowns, errors - len(records.kind.model.names) - unknowns
    if more <= 0 or left <= _FEWEST:
        return 1.0
    # -2 log likelihood at the likeliest levels and states, up to a constant.
    deviances = [
        records.samples * float(np.linalg.slogdet(one.all_errors.T @ one.all_errors)[1]) + one.of_noise
        for one in (rest, point)
    ]
    ratio = np.expm1(min(max(deviances[0] - deviances[1] + gain, 0.0) / errors, _LARGEST))
    return float(scipy.special.fdtrc(more, left, ratio * left / more))


def _promised(point: Point) -> float:
    """Return the promised decrease of -2 log likelihood by one step: about as much as by a search.

    The determinant is left out, since it allows short steps only near the edge of stability.
    """
    errors = point.of_errors
    step = np.linalg.lstsq(errors.hessian, errors.slope, rcond=1e-12)[0]
    # A cost of zero cannot decrease.
    share = min(float(errors.slope @ step) / point.cost, _MOST_PROMISED) if point.cost else 0.0
    return float(-point.freedom * np.log1p(-share))


def from_rest_or_free(
    records: Records,
    rest: bool | None,
    searched: Callable[[Records, Array | None], Search],
    about: Array | None = None,
) -> Search:
    """Return the search from rest, unless unknown starts explain its errors better than chance.

    An F test of the likelihood ratio decides; its degrees of freedom are the additional unknowns. Noise
    never rests: its values before the record are unknown either way.

    Args:
        rest: whether the records begin at rest about zero; None: as the data say.
        searched: a function that searches from its own starts and, if given, from the parameters (k,).
        about: (k,), parameters that show roughly how long unknown inputs act.
    """
    # An unknown level makes up for the means.
    deviations = replace(records, parts=tuple(centred(records.parts)))

    def later(theta: Array | None) -> int:
        late = 0 if theta is None else records.kind.lateness(theta)
        return late + _SPARE if late else 0

    def begun_free(known: Array | None, late: int) -> Search:
        tried = {late: (found := searched(deviations.begun_freely(late), known))}
        # The estimated dead time may differ from the one by which the unknown inputs were counted.
        while abs((now := later(found.point.theta)) - late) > _SPARE:
            # Unknown inputs may explain half of a record, whatever the model.
            swamped = 2 * now * records.u.shape[1] > records.longest
            if now in tried or len(tried) > _MOST_COUNTS or swamped:
                return tried[min(tried)]  # the fewest unknown inputs explain the least by chance
            late = now
            tried[late] = found = searched(deviations.begun_freely(late), found.point.theta)
        return found

    if rest is False:
        return begun_free(None, later(about))
    at_rest = searched(records, None)
    if rest or at_rest.point.cost <= 0.0:
        return at_rest
    late = later(at_rest.point.theta)
    free = deviations.begun_freely(late)
    near = evaluate(free, at_rest.point.theta)
    if records.dead_times.size and near.unknowns * _MANY > records.y.size:
        # A wrong level or a spike may feign a dead time, whose many unknown inputs explain anything.
        begun = begun_free(None, later(about))
    elif _chance_of(at_rest, free, near, _promised(near)) > _UNLIKELY:
        return at_rest  # a search with unknown starts would hardly refute it
    else:
        begun = begun_free(at_rest.point.theta, late)
    refuted = _chance_of(at_rest, begun.records, begun.point) < _MISTAKEN
    return replace(begun, rest_refuted=True) if refuted else at_rest
