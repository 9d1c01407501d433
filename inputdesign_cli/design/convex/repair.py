"""Make an iterate of the exchange meet all requirements and limits, by scaling or by mixing.

The optimum of a relaxation slightly violates constraints that it does not contain. If scaling up can only
help (no limits, or limits that scale along), the smallest sufficient factor repairs it. Otherwise it is
mixed with a design that meets everything strictly. The violation is convex along the line between them: a
step of its chord already gives a feasible design, and a few steps find the best mixture.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from inputdesign_cli.arrays import Array
from inputdesign_cli.design.convex.demands import FEW
from inputdesign_cli.design.convex.problem import Candidate, Problem

Place = tuple[int, float | None]

_MEETS = 1e-12
_MIXINGS = 12


def least_scale(problem: Problem, z: Array) -> float:
    """Return the least s for which z keeps to its upper limits."""
    used = [
        functional.at(z) / limit.bound
        for limit, functional in zip(problem.limits, problem.limit_functionals, strict=True)
        if limit.upper
    ]
    breaches = problem.density_breaches(z, 1.0, above=-np.inf) if problem.densities else []
    used += [breach.ratio for breach in breaches if problem.densities[breach.place.limit].upper]
    if problem.polytope is not None:
        used.append(problem.amplitude_facet(z)[0])
    return max(used, default=0.0)


def scaled_up(problem: Problem, z: Array, s: float, places: Sequence[Place]) -> Candidate:
    """Scale z (and s) by the smallest factor that meets every requirement, found by the secant method.

    The search looks at `places` (requirement, frequency) only; the full check follows, and adds to them.
    """
    if problem.scaled:
        if problem.floors_fixed:
            z = z * max(1.0, missing_floor(problem, z))
        s = max(least_scale(problem, z), s if problem.goal == "samples" else 0.0)
    if problem.goal == "factor":
        # All of M' scales, so that one look at the ratios gives the factor, above or below one.
        informations = problem.candidate(z, s).informations
        factor = problem.demands.largest(informations, default=1.0) ** 2
        return problem.candidate(factor * z, factor * s)
    factor, at = 1.0, set(places)
    for _ in range(12 + len(problem.others)):
        factor = _smallest_factor(problem, z, s, at, factor)
        scaled = problem.candidate(factor * z, factor * s if problem.scaled else 1.0)
        found = problem.demands.violations(scaled.informations, above=1.0, few=FEW)
        missed = [(i, v) for i, v in found if v.ratio > 1.0 + _MEETS]
        if not missed:
            break
        at |= {(i, v.frequency) for i, v in missed}
    return scaled


def missing_floor(problem: Problem, z: Array) -> float:
    """Return the factor by which z must grow to reach its lower limits (below one: it exceeds them)."""
    shares = [
        limit.bound / functional.at(z)
        for limit, functional in zip(problem.limits, problem.limit_functionals, strict=True)
        if not limit.upper
    ]
    if problem.densities:
        breaches = problem.density_breaches(z, 1.0, above=-np.inf)
        lower = [2.0 - b.ratio for b in breaches if not problem.densities[b.place.limit].upper]
        shares += [1.0 / max(share, 1e-12) for share in lower]
    return max(shares, default=0.0)


def _smallest_factor(problem: Problem, z: Array, s: float, at: set[Place], factor: float) -> float:
    fixed, places = problem.fixed_information, dict[int, list[float | None]]()
    excited = problem.candidate(z, s).informations - fixed
    for index, frequency in at:
        places.setdefault(index, []).append(frequency)
    looked = [(problem.demands.asked[i], np.array(w)) for i, w in places.items()]

    def excess(f: float) -> float:
        most = 0.0
        for asked, w in looked:
            information = fixed[asked.scenario] + f * excited[asked.scenario]
            most = max(most, float(asked.requirement.ratios(information, w).max()))
        return most**2 - 1.0

    value = excess(factor)
    while value > _MEETS:
        # The squared ratio falls at most like 1 / factor, so this step never overshoots.
        step = factor * (1.0 + value)
        slope = (excess(step) - value) / (step - factor)
        factor = max(step, factor - value / slope) if slope < 0 else step
        value = excess(factor)
    return factor


def excess(problem: Problem, candidate: Candidate) -> float:
    """Return the largest violation of requirements and limits, negative when all are met."""
    z, s, informations = candidate.z, candidate.s, candidate.informations
    try:
        ratios = [v.ratio**2 for _, v in problem.demands.violations(informations)]
        ratios += [s * v.ratio**2 for _, v in problem.demands.violations(informations, side=True)]
    except np.linalg.LinAlgError:
        return np.inf
    for limit, functional in zip(problem.limits, problem.limit_functionals, strict=True):
        level = limit.bound * problem.bound_factor(limit.upper, s)
        share = functional.at(z) / level if level > 0 else 2.0
        ratios.append(share if limit.upper else 2.0 - share)
    ratios += [breach.ratio for breach in problem.density_breaches(z, s, above=-np.inf)]
    if problem.polytope is not None:
        ratios.append(problem.amplitude_facet(z)[0] / problem.bound_factor(True, s))
    return max(ratios, default=0.0) - 1.0


def mixed(problem: Problem, z: Array, s: float, interior: Candidate) -> Candidate:
    """Return the feasible design nearest to (z, s) on the line to the strictly feasible `interior`."""

    def at(share: float) -> Candidate:
        return problem.candidate(z + share * (interior.z - z), s + share * (interior.s - s))

    start = at(0.0)
    missed = excess(problem, start)
    if missed <= _MEETS:
        return start
    room = -excess(problem, interior)
    low, high, good = 0.0, 1.0, interior
    trial = missed / (missed + room) if np.isfinite(missed) and room > 0 else 0.5
    for _ in range(_MIXINGS):
        candidate = at(trial)
        left = excess(problem, candidate)
        if left <= _MEETS:
            high, good, room = trial, candidate, -left
        else:
            low, missed = trial, left
        if high - low <= 1e-3 * high:
            break
        share = missed / (missed + room) if np.isfinite(missed) and missed + room > 0 else 0.5
        trial = low + (high - low) * min(max(share, 0.02), 0.98)
    return good
