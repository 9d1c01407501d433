"""Where no record of the cheapest spectrum fits within limits on samples: a spectrum of less input power."""

from __future__ import annotations

from dataclasses import replace

from inputdesign_cli.design.convex.designs import Design, Question, solve_design
from inputdesign_cli.design.convex.limits import PowerLimit
from inputdesign_cli.information import Experiment
from inputdesign_cli.tasks.record import RecordRequest, make_record

# From the design towards the least input power that meets the accuracy, with a little room there.
_SHARES = (0.8, 0.6, 0.4, 0.2, 0.0)
_ROOM = 1.02
_TOLERANCE = 1e-5


def power_that_fits(
    request: RecordRequest, question: Question, design: Design, experiment: Experiment
) -> float | None:
    """A limit on the input power with which a record is found; None when none is.

    What costs least need not fit: where outputs are dear the inputs may be strong.
    """
    if question.goal != "cost" or set(question.cost) == {"input"}:
        return None
    own = design.problem.on(design.result.basis).power("input", None).at(design.result.x)
    cheapest = solve_design(replace(question, cost={"input": 1.0}), tolerance=_TOLERANCE)
    least = _ROOM * cheapest.result.objective
    for share in _SHARES if least < own else ():
        power = float(f"{least * (own / least) ** share:.4g}")
        limited = replace(question, limits=[*question.limits, PowerLimit("input", power)])
        record = make_record(request, solve_design(limited, tolerance=_TOLERANCE), experiment, longer=False)
        if record is not None and record.met:
            return power
    return None
