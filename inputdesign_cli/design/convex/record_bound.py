"""What no record within an amplitude can beat, whatever it is: proved for a finite number of samples.

The autocovariances of signals within an amplitude lie in a polytope (`design.amplitude`). A design over all
spectra whose autocovariances lie there has a certificate in which price - value >= 0 at every frequency. The
price has a form of a few lags: u^T T(form) u of a record u. Its maximum over all records of N samples from
rest is found by dynamic programming. Cutting a record off only loses information, so that

    t tr(Y (M(u) - M0)) <= u^T T(price) u <= what the other limits leave + max over u of u^T T(form) u.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from inputdesign_cli.arrays import Array
from inputdesign_cli.compute.time_limit import time_is_over
from inputdesign_cli.design.amplitude.polytope import LagPolytope
from inputdesign_cli.design.amplitude.windows import Windows
from inputdesign_cli.design.convex.exchange import ExchangeResult
from inputdesign_cli.design.convex.feasible import solve_limited
from inputdesign_cli.design.convex.problem import Problem
from inputdesign_cli.spectrum.held import HeldLines

# Windows of these lengths follow each other until the bound gains less than the share.
_LENGTHS, _GAIN = (4, 8, 10, 12, 14), 1e-3
_MOST_STATES = 2**13
_TOLERANCE = 1e-4


@dataclass(frozen=True)
class RecordBound:
    """A lower bound on the objective for every record of `samples` samples within the amplitude.

    `result` is the design over all spectra with such lags; windows of `length` values were looked at. `cycles`
    are the periodic signals (period, r) that came with the proof, `best` (samples, r) the record that the form
    of the proof values most.
    """

    bound: float
    length: int
    result: ExchangeResult
    cycles: tuple[Array, ...]
    best: Array


def bound_over_records(problem: Problem, free: ExchangeResult, amplitude: Array, samples: int, lengths=_LENGTHS, hold: int = 1) -> RecordBound:
    """Bound the objective over all records of this many samples with |u_i| <= amplitude_i (r,).

    Args:
        free: the design over every spectrum without the amplitude, to begin with.
    """
    windows = Windows.within(amplitude, 2)
    polytope, found = LagPolytope(windows), None
    basis, x, known = free.basis, free.x, free.active
    if hold > 1:
        basis = HeldLines.of(hold, amplitude.size).in_units(amplitude)
        x = basis.spread(amplitude**2)
    for length in lengths:
        if len(windows.letters) ** (length - 1) > _MOST_STATES or (found and time_is_over()):
            break
        polytope = polytope.longer(min(length, samples // hold))
        limited = replace(problem.on(basis), polytope=polytope, finer=None)
        result = solve_limited(limited, x, _TOLERANCE, known=known)
        basis, x, known = result.basis, result.x, result.active
        before, found = found, _proved(limited, result, samples // hold)
        if before and found.bound <= (1.0 + _GAIN) * before.bound:
            break
    assert found is not None
    return found


def _proved(problem: Problem, result: ExchangeResult, samples: int) -> RecordBound:
    certificate, polytope = result.certificate, problem.polytope
    assert polytope is not None
    form = certificate.form
    if form is None:  # the amplitude costs no more than its power
        form = np.zeros((polytope.windows.length, *result.basis.directions.shape[1:] * 2))
    most, best = polytope.windows.largest_sum(form, samples)
    most /= samples
    if problem.goal == "cost":
        bound = certificate.bound + certificate.form_share - most
    else:
        bound = certificate.bound / (1.0 - certificate.form_share + most)
    return RecordBound(bound, polytope.windows.length, result, tuple(polytope.cycles), best)
