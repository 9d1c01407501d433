"""Why limits exclude the accuracy of a frequency response, in the words of the spec, and what would do."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from inputdesign_cli.design.convex.limits import PowerLimit
from inputdesign_cli.design.response import UnreachableError
from inputdesign_cli.errors import Diagnostic, InfeasibleError
from inputdesign_cli.outcome.rounding import rounded_up
from inputdesign_cli.outcome.units import Units
from inputdesign_cli.questions.common.within_limits import named


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
    needed = [f"{limit.key} to {rounded_up(_raised(limit, factor))}" for limit in dict.fromkeys(error.limits)]
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


def _raised(limit: PowerLimit, factor: float) -> float:
    """The number of the spec with which deviations `factor` times as large become those admitted."""
    return factor * limit.bound**0.5 if limit.implied else factor**2 * limit.bound


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


def too_tight(units: Units, keys: Sequence[str], beyond: float, length: int) -> InfeasibleError:
    """The lines would do, but no record of them that was found keeps to the limits on single samples."""
    more = int(np.ceil(length * beyond**2))
    return InfeasibleError.because(
        "limits-too-tight",
        f"no record of {length} samples within {' and '.join(keys)} was found that meets the accuracy: that "
        f"of the lowest peaks would have to be {rounded_up(beyond, 4)} times as large as they allow",
        f"about {more} samples do ({units.length(more)}); raise the limits, admit {rounded_up(beyond, 4)} "
        "times as much, or write objective: shortest_experiment",
        keys[0],
    )
