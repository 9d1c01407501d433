"""Why limits exclude the accuracy of a frequency response, in the words of the spec, and what would do."""

from __future__ import annotations

import numpy as np

from inputdesign_cli.design.response import UnreachableError
from inputdesign_cli.errors import Diagnostic, InfeasibleError
from inputdesign_cli.runs.units import Units
from inputdesign_cli.tasks.result.within_limits import named, rounded_up


def unreachable(units: Units, error: UnreachableError, samples: int) -> InfeasibleError:
    """Why the limits exclude the accuracy, in the words of the spec, and what would do."""
    if not np.isfinite(error.factor):
        names = " and ".join(dict.fromkeys(limit.key for limit in error.limits))
        return InfeasibleError(
            Diagnostic(
                "contradictory-limits",
                f"{names} contradict each other: no powers of these lines keep all of them",
                "lower min or raise max of these limits",
                error.limits[0].key,
            )
        )
    factor = error.factor
    exhausted = " and ".join(dict.fromkeys(named(limit) for limit in error.limits))
    needed = [
        f"{limit.key} to {rounded_up(limit.bound * factor**2)}" for limit in dict.fromkeys(error.limits)
    ]
    more = int(np.ceil(samples * factor**2))
    return InfeasibleError(
        Diagnostic(
            "infeasible",
            f"the limits buy standard deviations {rounded_up(factor, 4)} times those admitted; {exhausted} "
            "is exhausted",
            f"raise {' and '.join(needed)}, count {more} samples in place of {samples} "
            f"({units.length(more).split(':')[0]}), or admit {rounded_up(factor, 4)} times as much",
            error.limits[0].key,
            details={"factor": factor},
        )
    )


def too_long(units: Units, length: int, most: int) -> InfeasibleError:
    """The shortest record is longer than limits allow."""
    limit = units.length(length, "limits")
    return InfeasibleError(
        Diagnostic(
            "too-long",
            f"the shortest record of whole periods takes {length} samples, transient included, and {most} "
            "are allowed",
            f"write {limit}, allow more power, or ask for less accuracy",
            limit.split(":")[0],
        )
    )
