"""Say why limits exclude the accuracy of a frequency response, and which numbers of the spec would do."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from inputdesign_cli.design.convex.limits import PowerLimit
from inputdesign_cli.design.convex.response_lines import UnreachableError
from inputdesign_cli.errors import Diagnostic, InfeasibleError
from inputdesign_cli.outcome.rounding import rounded_up
from inputdesign_cli.outcome.units import Units
from inputdesign_cli.questions.common.within_limits import named


def unreachable(units: Units, error: UnreachableError, samples: int) -> InfeasibleError:
    """Return the error that limits exclude the accuracy, with the numbers of the spec that would do."""
    factor, limits = error.factor, tuple(dict.fromkeys(error.limits))
    if not np.isfinite(factor):
        names = " and ".join(dict.fromkeys(limit.key for limit in limits))
        return InfeasibleError.because(
            "contradictory-limits",
            f"{names} contradict each other: no powers of these lines keep all of them",
            "lower min or raise max of these limits",
            limits[0].key,
        )
    exhausted = " and ".join(dict.fromkeys(map(named, limits)))
    needed = (f"{limit.key} to {rounded_up(_raised(limit, factor))}" for limit in limits)
    more, times = int(np.ceil(samples * factor**2)), rounded_up(factor, 4)
    message = f"the limits buy standard deviations {times} times those admitted; {exhausted} is exhausted"
    hint = (
        f"raise {' and '.join(needed)}, count {more} samples in place of {samples} "
        f"({units.length(more).split(':')[0]}), or admit {times} times as much"
    )
    details = {"factor": factor}
    return InfeasibleError(Diagnostic("infeasible", message, hint, limits[0].key, details=details))


def _raised(limit: PowerLimit, factor: float) -> float:
    """Return the number of the spec at which deviations are smaller by `factor`."""
    return factor * limit.bound**0.5 if limit.implied else factor**2 * limit.bound


def too_long(units: Units, length: int, most: int) -> InfeasibleError:
    """Return the error that the shortest record is longer than limits allow."""
    limit = units.length(length, "limits")
    return InfeasibleError.because(
        "too-long",
        f"the shortest record of whole periods takes {length} samples, transient included, and {most} "
        "are allowed",
        f"write {limit}, allow more power, or ask for less accuracy",
        limit.split(":")[0],
    )


def too_tight(units: Units, keys: Sequence[str], beyond: float, length: int) -> InfeasibleError:
    """Return the error that no record of the lines was found within the limits on single samples."""
    more, times = int(np.ceil(length * beyond**2)), rounded_up(beyond, 4)
    return InfeasibleError.because(
        "limits-too-tight",
        f"no record of {length} samples within {' and '.join(keys)} was found that meets the accuracy: the "
        f"one of the lowest peaks would have to be {times} times as large as they allow",
        f"about {more} samples do ({units.length(more)}); raise the limits, admit {times} times as much, "
        "or write objective: shortest_experiment",
        keys[0],
    )
