"""Why a measured frequency response is not to be trusted, and what to do: other things than its noise."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from inputdesign_cli.findings.places import places
from inputdesign_cli.identification.period_drift import PeriodDrift
from inputdesign_cli.identification.spikes import Spikes
from inputdesign_cli.outcome.results import Array
from inputdesign_cli.outcome.units import Units
from inputdesign_cli.questions.frequency_response.silent_lines import MATTERS, Distorted
from inputdesign_cli.records import Record


@dataclass(frozen=True)
class Doubts:
    """What besides noise decides on a response at L lines.

    Attributes:
        distorted: what a nonlinearity does to it; None where none is seen, or none is watched for.
        drifting: a sentence on a drift that changes it by much; empty where none does.
        moved: (L,), what that drift changes of it and of its scatter, over what is admitted.
        spiked: a sentence for every output of which few samples decide.
    """

    moved: Array
    distorted: Distorted | None = None
    drifting: str = ""
    spiked: tuple[str, ...] = ()

    @property
    def changed(self) -> Array:
        """(L,): what is known to change the response, over what is admitted."""
        bent = self.distorted is not None and self.distorted.matters
        return self.moved + (self.distorted.shares if self.distorted is not None and bent else 0.0)


def drift_told(units: Units, drift: PeriodDrift, moved: Array, w: Array, *, lined: bool) -> tuple[str, Array]:
    """A sentence on a drift where it changes the response by enough to decide, and what it changes (L,).

    Args:
        moved: (L,), the change over what is admitted, at frequencies w in the unit of the user.
        lined: whether a line was taken away already.
    """
    at = int(np.argmax(moved))
    if moved[at] < MATTERS:
        return "", np.zeros_like(moved)
    told = [
        f"y{i + 1 if units.outputs > 1 else ''} drifts by {np.ptp(drift.curve[:, i]):.3g} over the record"
        for i in np.flatnonzero(drift.degree)
    ]
    straight = int(drift.degree.max()) == 1 and not lined
    remedy = (
        "add --detrend linear, and assess again"
        if straight
        else "no line takes that away: subtract the slow course from the column before, and assess again"
    )
    return (
        f"{' and '.join(told)} beside what the inputs do (the means of the periods tell), which "
        f"leaks into every line and moves the response, or its scatter, by up to {moved[at]:.2g} of what is "
        f"admitted, at {w[at]:.3g} {units.per_time}; neither more periods nor another amplitude helps: "
        f"{remedy}"
    ), moved


def spikes_told(units: Units, found: Sequence[Spikes], data: Record, periods: int) -> tuple[str, ...]:
    """A sentence for every output of which a few samples decide how the periods differ.

    Args:
        periods: with the same phases.
    """
    # Of two periods nobody knows which one is wrong.
    which = ", one of each two a period apart" if periods == 2 else ""
    return tuple(
        f"{len(one.samples)} of {len(data.y)} samples of y{one.output + 1 if units.outputs > 1 else ''} "
        f"hold{'s' * (len(one.samples) == 1)} {100 * one.share:.3g} % of the squares by which its periods "
        f"differ (at {places(units, data, one.samples)}{which}): spikes decide, and nothing is said of "
        "noise, nonlinearity or needed periods; empty the cells that are faults of measurement, and assess "
        "again: the whole periods beside them count"
        for one in found
    )


def bent_told(units: Units, distorted: Distorted, w: Array) -> str:
    """What a nonlinearity of odd degree does to the response, and what to do."""
    share = f"{distorted.share:.2g} of what is admitted, at {w[distorted.line]:.3g} {units.per_time}"
    if not distorted.matters:
        return f"what a nonlinearity of odd degree changes of the response is small: about {share}"
    kind = f"the cube of {distorted.cubed}" if distorted.cubed else "a nonlinearity"
    return (
        f"odd lines that are not excited tell of {kind} (probability of chance "
        f"{distorted.probability:.2g}), that changes the response by about {share}; from {MATTERS:g} on "
        "that is not called met. More periods do not help: measure at a smaller amplitude, or with other "
        "phases, and see whether the response stays"
    )
