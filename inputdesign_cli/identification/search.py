"""From starting points to the likeliest parameters, and whether the records begin at rest."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
import scipy
from numpy.typing import NDArray

from inputdesign_cli.arrays import Array
from inputdesign_cli.identification.gauss_newton import MOST_STEPS, best_run, minimise
from inputdesign_cli.identification.minima import Rival, beyond_instants, minima_beside, rivals
from inputdesign_cli.identification.problem import Point, RecordProblem, evaluate
from inputdesign_cli.identification.records import Records, centred

# A record that begins at rest is taken for one that does not with this probability.
_MISTAKEN = 0.01
# A step that promises to take off nearly all promises too much.
_MOST_PROMISED = 0.999
# Above this probability nothing is searched for.
_UNLIKELY = 0.2
# Settled: the step squared, in standard deviations; how far beside a kink the cost is looked at, in those.
_SETTLED = 1e-8
_ASIDE = 0.01
_MOST_HELD_STEPS = 60
# What ten steps of a quick search must take off -2 log likelihood.
_IDLE = 0.1
# Samples by which a dead time may grow while a search begun freely goes on.
_SPARE = 2
# How often they are counted anew; more than one unknown start for so many samples are many.
_MOST_COUNTS = 4
_MANY = 10
# Errors to spare beside unknown starts: with fewer nothing is said against rest.
_FEWEST = 8
# Of exp, so that it stays finite.
_LARGEST = 50.0


@dataclass(frozen=True)
class Search:
    """Where the search from the best of `starts` points ended.

    Attributes:
        first: (parts, p), the first residuals if each record began at rest about zero, noise as well.
        rivals: other minima that explain the records nearly as well.
        beside: those beyond sampling instants, near ones too, with what they have more in -2 log likelihood.
        rest_refuted: whether the records say that they do not begin at rest about zero.
    """

    records: Records
    point: Point
    converged: bool
    steps: int
    starts: int
    first: Array
    rivals: tuple[Rival, ...]
    beside: tuple[tuple[Point, float], ...]
    rest_refuted: bool = False


def search(
    records: Records, points: Array, *, starts: int, before: Array | int = 0, quick: int | None = None
) -> Search:
    """Return the likeliest minimum that Gauss-Newton steps find from `points` (n, k).

    Args:
        starts: how many points were looked at.
        before: (n,) steps that have been made from each.
        quick: the most steps from each, fewer if these gain nothing that matters. Kinks may stop the search,
            and no other minima are returned.
    """
    idle = _IDLE if quick else 0.0
    found = minimise(RecordProblem((records,) * len(points)), points, most=quick or MOST_STEPS, idle=idle)
    if not quick:
        found = beyond_instants(records, found)
        before = np.append(np.broadcast_to(before, len(points)), np.zeros(len(found.cost) - len(points)))
    best = best_run(found)
    steps = int(found.steps[best] + np.broadcast_to(before, len(found.cost))[best])
    point, converged = evaluate(records, found.theta[best]), bool(found.converged[best])
    if not converged and not quick and np.isfinite(point.cost):
        kinked = settled_at_kinks(records, point)
        point, converged = (point, False) if kinked is None else (kinked, True)
    others = () if quick else rivals(point, found)
    near = () if quick else minima_beside(records, point, found)
    return Search(records, point, converged, steps, starts, _first(records, point.theta), others, near)


def settled_at_kinks(records: Records, point: Point) -> Point | None:
    """Return where a search stopped by kinks of the cost settles, or None if kinks did not stop it.

    A dead time that passes a sampling instant makes a kink, and minima lie on kinks. There no step of Gauss
    and Newton gains what its slopes promise. The same happens if the edge of stability mirrors a root.
    Parameters that block the way are held, one after the other; only dead times, if there are some. The rest
    settles. Then each held one is moved to both sides, where the cost must be higher.
    """
    size = point.theta.size
    held = np.zeros(size, dtype=bool)
    blocking = records.dead_times.tolist() or range(size)
    for _ in range(_MOST_HELD_STEPS):
        step, gain = _newton(point, held)
        if gain * point.errors.size > _SETTLED * point.cost:
            trial = _moved(records, point, step)
            if trial.cost >= point.cost:
                more = [held | _unit(size, j) for j in blocking if not held[j]]
                if not more:
                    return None
                tried = [_moved(records, point, _newton(point, blocking)[0]) for blocking in more]
                best = int(np.argmin([other.cost for other in tried]))
                held, trial = more[best], tried[best]
            point = trial if trial.cost < point.cost else point
            continue
        lower = _beside(records, point, held)
        if lower is None:
            return point if np.any(held) else None
        held, point = np.zeros_like(held), lower
    return None


def _newton(point: Point, held: NDArray[np.bool_]) -> tuple[Array, float]:
    """Return the step (k,) of Gauss and Newton that leaves some parameters, and the gain that it promises."""
    free = np.flatnonzero(~held)
    scale = np.sqrt(np.maximum(np.diag(point.hessian)[free], 1e-300))
    step = np.zeros(held.size)
    slope = point.slope[free] / scale
    matrix = point.hessian[np.ix_(free, free)] / np.outer(scale, scale)
    step[free] = np.linalg.lstsq(matrix, slope, rcond=1e-12)[0] / scale
    return step, float(abs(step @ point.slope))


def _moved(records: Records, point: Point, step: Array) -> Point:
    return evaluate(records, records.stabilised(point.theta + step))


def _beside(records: Records, point: Point, held: NDArray[np.bool_]) -> Point | None:
    """Return a point of lower cost where a held parameter is a little more or less; None if there is none."""
    variance = point.cost / point.errors.size
    for j in map(int, np.flatnonzero(held)):
        size = _ASIDE * np.sqrt(variance / max(float(point.hessian[j, j]), 1e-300))
        for sign in (1.0, -1.0):
            trial = _moved(records, point, sign * size * _unit(held.size, j))
            if trial.cost < point.cost:
                return trial
    return None


def _unit(size: int, index: int) -> NDArray[np.bool_]:
    return np.arange(size) == index


def _first(records: Records, theta: Array) -> Array:
    return np.array([records.kind.errors_and_gradient(theta, *part)[0][0] for part in records.parts])


def _deviance(records: Records, point: Point) -> float:
    """-2 log of the likelihood at the likeliest levels and states, up to a constant."""
    products = point.near.all_errors.T @ point.near.all_errors
    return float(records.samples * np.linalg.slogdet(products)[1]) + point.near.of_noise


@dataclass(frozen=True)
class _FromRest:
    """The search of records from rest, against which unknown starts are held."""

    found: Search

    def more(self, point: Point) -> int:
        """Return the unknowns beyond the ones from rest; 0 if too few errors are left to compare."""
        records = self.found.records
        few = records.y.size <= records.size + point.near.unknowns + _FEWEST
        return 0 if few else point.near.unknowns - self.found.point.near.unknowns

    def probability(self, records: Records, point: Point, gain: float = 0.0) -> float:
        """Return the probability that unknown starts, if useless, lower -2 log likelihood as far.

        Many unknowns shrink the estimated noise, which chi-squared does not account for: F does.
        """
        more, errors = max(self.more(point), 1), records.y.size
        fell = max(_deviance(self.found.records, self.found.point) - _deviance(records, point) + gain, 0.0)
        left = errors - records.size - point.near.unknowns
        if left < 1:
            return float(scipy.special.chdtrc(more, fell))
        ratio = np.expm1(min(fell / errors, _LARGEST))
        return float(scipy.special.fdtrc(more, left, ratio * left / more))

    def unless_by_chance(self, begun: Search) -> Search:
        """Return the search with unknown starts if chance does not explain what it gains."""
        refuted = self.more(begun.point) > 0 and self.probability(begun.records, begun.point) < _MISTAKEN
        return replace(begun, rest_refuted=True) if refuted else self.found

    def hopeless(self, free: Records, near: Point) -> bool:
        """Return whether a search from rest on, with unknown starts, is not worth the while.

        What errors promise of one step is about what the search would find. Near the edge of stability the
        determinant allows short steps only.
        """
        errors = near.of_errors
        step = np.linalg.lstsq(errors.hessian, errors.slope, rcond=1e-12)[0]
        # Where nothing is left of the errors there is nothing to gain.
        share = min(float(errors.slope @ step) / near.cost, _MOST_PROMISED) if near.cost else 0.0
        gain = -near.near.freedom * np.log1p(-share)
        return self.more(near) <= 0 or self.probability(free, near, gain) > _UNLIKELY


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
        records: from rest.
        rest: whether the records begin at rest about zero; None: as the data say.
        searched: what searches from its own starts and, if given, from the parameters (k,).
        about: (k,), parameters that show roughly how long unknown inputs act.
    """
    # An unknown level makes up for the means.
    deviations = replace(records, parts=tuple(centred(records.parts)))

    def later(theta: Array | None) -> int:
        late = 0 if theta is None else records.kind.lateness(theta)
        return late + _SPARE if late else 0

    def begun_free(known: Array | None, late: int) -> Search:
        tried = {late: (found := searched(deviations.begun_freely(late), known))}
        # The dead time may come out another than was thought when the unknown inputs were counted.
        while abs((now := later(found.point.theta)) - late) > _SPARE:
            # Unknown inputs may explain half of a record, whatever the model.
            swamped = 2 * now * records.u.shape[1] > max(records.lengths)
            if now in tried or len(tried) > _MOST_COUNTS or swamped:
                found = tried[min(tried)]  # the fewest unknown inputs explain the least by chance
                break
            late = now
            tried[late] = found = searched(deviations.begun_freely(late), found.point.theta)
        return replace(found, first=_first(records, found.point.theta))

    if rest is False:
        return begun_free(None, later(about))
    at_rest = searched(records, None)
    if rest or at_rest.point.cost <= 0.0:
        return at_rest
    judge, late = _FromRest(at_rest), later(at_rest.point.theta)
    free = deviations.begun_freely(late)
    near = evaluate(free, at_rest.point.theta)
    if records.dead_times.size and near.near.unknowns * _MANY > records.y.size:
        # A wrong level or a spike may feign a dead time, and the inputs before it explain whatever they like.
        return judge.unless_by_chance(begun_free(None, later(about)))
    return (
        at_rest
        if judge.hopeless(free, near)
        else judge.unless_by_chance(begun_free(at_rest.point.theta, late))
    )
