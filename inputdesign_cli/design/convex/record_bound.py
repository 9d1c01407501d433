"""A bound that no record within an amplitude can beat, proved for a finite number of samples.

The autocovariances of signals within an amplitude lie in a polytope (`design.amplitude`). A design over all
spectra with such autocovariances has a certificate: price - value >= 0 at every frequency. One part of its
price is a form of a few lags, u^T T(form) u of a record u. Dynamic programming finds the largest form of all
records of n samples from rest. Cutting a record off only loses information, so that

    t tr(Y (M(u) - M0)) <= u^T T(price) u <= what the other limits allow + max over u of u^T T(form) u.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from inputdesign_cli.arrays import Array
from inputdesign_cli.compute.time_limit import OutOfTimeError
from inputdesign_cli.design.amplitude.polytope import LagPolytope
from inputdesign_cli.design.amplitude.windows import Windows
from inputdesign_cli.design.convex.exchange import ExchangeResult
from inputdesign_cli.design.convex.feasible import UnreachableError, solve_limited
from inputdesign_cli.design.convex.limits import PowerLimit
from inputdesign_cli.design.convex.problem import Problem
from inputdesign_cli.errors import InaccurateError
from inputdesign_cli.spectrum.held import HeldLines

# Values of the first windows, and by which they grow until the bound gains less than this share.
_FIRST, _MORE, _GAIN = 4, 4, 1e-3
_MOST_BITS = 13  # the number of states is at most 2 to this power
_ON_THE_CIRCLE = 1e-9
_TOLERANCE = 1e-4
_INPUTS = ("input", "excitation")


@dataclass(frozen=True)
class RecordBound:
    """A lower bound on the objective for every record of `samples` samples within the amplitude.

    For the goal "samples" it is the least number of samples itself. Windows of `length` values are used.
    `result` is the design over all spectra with such lags, and `best` (values, r) the record that the form of
    its certificate values most.
    """

    bound: float
    samples: int
    length: int
    result: ExchangeResult
    best: Array


def amplitude_of(limits: tuple[PowerLimit, ...], inputs: int) -> Array | None:
    """Return the largest modulus of each input (r,); None if one has no limit."""
    found = np.full(inputs, np.inf)
    for limit in limits:
        if limit.implied and limit.kind == "input":
            here = slice(None) if limit.channel is None else limit.channel
            found[here] = np.sqrt(limit.bound)
    return found if np.isfinite(found).all() else None


def bound_over_records(
    problem: Problem, free: ExchangeResult, samples: int, *, windows: int, hold: int = 1
) -> RecordBound | None:
    """Bound the objective over all records from rest within the amplitude of the inputs, in open loop.

    Limits on outputs, on moves and from below are left out, which leaves the bound valid.

    Args:
        free: the design over every spectrum, to begin with.
        samples: length of the records; not used for the goal "samples".
        windows: the longest windows.
        hold: the samples for which each value is held.

    Returns:
        None if no bound is known: in a loop, without an amplitude, for costs of outputs, for plants with a
        pole on the unit circle.
    """
    inputs = problem.experiment.inputs
    amplitude = amplitude_of(problem.limits, inputs)
    dear = problem.goal == "cost" and any(kind not in _INPUTS for kind in problem.cost)
    if amplitude is None or problem.experiment.loop is not None or dear or windows < 2:
        return None
    # At a pole on the circle a relaxed record would have unlimited information.
    poles = [one.experiment.model.singularities.imag.min(initial=np.inf) for one in problem.scenarios]
    if min(poles) <= _ON_THE_CIRCLE:
        return None
    kept = tuple(limit for limit in problem.limits if limit.upper and limit.kind in _INPUTS)
    basis, x, known = free.basis, free.x, free.active
    if hold > 1:
        basis = HeldLines.of(hold, inputs).in_units(amplitude)
        x = basis.spread(amplitude**2)
    relaxed = replace(problem, limits=kept, densities=(), side=(), floors_fixed=False, finer=None)
    polytope, found = LagPolytope(Windows.within(amplitude, 2), hold), None
    values = samples // hold if problem.goal != "samples" else windows
    longest = min(windows, values, 1 + _MOST_BITS // inputs)
    for length in (*range(_FIRST, longest, _MORE), longest) if longest > 1 else ():
        polytope = polytope.longer(length)
        limited = replace(relaxed.on(basis), polytope=polytope)
        try:
            result = solve_limited(limited, x, _TOLERANCE, known=known)
        except (OutOfTimeError, UnreachableError, InaccurateError):
            break
        basis, x, known = result.basis, result.x, result.active
        before, found = found, _proved(limited, polytope, result, samples, hold)
        if before is not None and found.bound <= (1.0 + _GAIN) * before.bound:
            break
    return found


def _proved(
    problem: Problem, polytope: LagPolytope, result: ExchangeResult, samples: int, hold: int
) -> RecordBound:
    certificate, windows = result.certificate, polytope.windows
    form = certificate.form
    if form is None:  # the amplitude costs no more than its power
        form = np.zeros((windows.length, problem.experiment.inputs, problem.experiment.inputs))
    left = 1.0 - certificate.form_share
    if problem.goal == "samples":
        samples = _least(certificate.bound, left, form, windows, hold)
        bound = float(samples)
    most, best = windows.largest_sum(form, max(samples // hold, 1))
    if problem.goal == "cost":
        bound = certificate.bound + certificate.form_share - most * hold / samples
    elif problem.goal == "factor":
        bound = certificate.bound / (left + most * hold / samples)
    return RecordBound(bound, samples, windows.length, result, best)


def _least(wanted: float, left: float, form: NDArray[np.float64], windows: Windows, hold: int) -> int:
    """Return the fewest samples n, a multiple of `hold`, with n left + hold max u^T T(form) u >= wanted."""
    low, high = 0, max(int(np.ceil(wanted / hold)), 1)

    def enough(values: int) -> bool:
        return hold * (values * left + windows.largest_sum(form, values)[0]) >= wanted * (1.0 - 1e-9)

    while not enough(high):
        low, high = high, 2 * high
    while high > low + 1:
        middle = (low + high) // 2
        low, high = (low, middle) if enough(middle) else (middle, high)
    return high * hold
