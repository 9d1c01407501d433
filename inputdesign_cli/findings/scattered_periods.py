"""Periods of a measured frequency response differ by spikes, by a drift, or so much that chance decides."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from inputdesign_cli.arrays import Array
from inputdesign_cli.finding import Finding, unsure
from inputdesign_cli.findings.nonlinear_response import MATTERS
from inputdesign_cli.identification.checks import signal_name
from inputdesign_cli.identification.faults import Spikes
from inputdesign_cli.identification.periodic_response import PeriodDrift
from inputdesign_cli.outcome.units import Units

SPIKES = unsure(
    "spiked-periods",
    "A few samples decide how the periods differ. A few samples hold most of the squares by which the "
    "periods differ from their median. Noise, nonlinearity and needed periods cannot be judged then.",
    "Empty the cells that are faults of measurement, and assess again. The other whole periods count.",
    "spikes",
)
DRIFT = unsure(
    "drifting-periods",
    "Outputs drift from period to period. The means of the periods follow a polynomial in time. A drift "
    "leaks into every line and changes the response or its scatter.",
    "Add `--detrend linear`. If the drift is no line, subtract its slow course from the column before.",
    "drift",
)
CHANCE = unsure(
    "response-within-chance",
    "The scatter of the periods leaves the verdict open. The true deviation lies between two limits that "
    "hold for all lines with 95 %. What is admitted lies between them.",
    "Record as many periods as the finding names.",
    "chance",
)


def spiked_periods(
    units: Units, found: Sequence[Spikes], places: Sequence[str], samples: int, periods: int
) -> Iterator[Finding]:
    """Yield a finding for every output with spikes.

    Args:
        places: where the samples of each of them stand, in words.
        samples: of the record.
        periods: of the same phase; of two nobody knows which one is wrong.
    """
    either = ", one of each two a period apart" if periods == 2 else ""
    for one, place in zip(found, places, strict=True):
        name = signal_name("y", one.output, units.outputs)
        message = (
            f"spikes decide how the periods of {name} differ: {len(one.samples)} of {samples} samples (at "
            f"{place}{either}) hold {100 * one.share:.3g} % of the squares. Noise, nonlinearity and needed "
            "periods cannot be judged. Empty the cells that are faults of measurement, and assess again: "
            "the other whole periods count"
        )
        yield SPIKES.found(message, where=name, samples=list(one.samples), share=one.share)


def drifting_periods(
    units: Units, drift: PeriodDrift, moved: Array, w: Array, *, lined: bool
) -> list[Finding]:
    """Return a finding on a drift that changes the response enough to decide.

    Args:
        moved: (L,), the change over what is admitted, at frequencies w in the unit of the user.
        lined: whether a line was taken away already.
    """
    at = int(np.argmax(moved))
    share, frequency = float(moved[at]), float(w[at])
    moving = np.flatnonzero(drift.degree).tolist()
    sizes = {signal_name("y", i, units.outputs): float(np.ptp(drift.curve[:, i])) for i in moving}
    listed = " and ".join(f"{name} drifts by {size:.3g}" for name, size in sizes.items())
    straight = int(drift.degree.max()) == 1 and not lined
    remedy = "add --detrend linear" if straight else "subtract its course, which is no line, from the column"
    message = (
        f"{listed} over the record, by the means of the periods. This changes the response, or its scatter, "
        f"by up to {share:.2g} of what is admitted, at {frequency:.3g} {units.per_time}. Neither more "
        f"periods nor another amplitude helps: {remedy}, and assess again"
    )
    figures = {"drift": sizes, "share": share, "frequency": frequency, "straight": straight}
    return [DRIFT.found(message, where=", ".join(sizes), **figures)] if share >= MATTERS else []


def within_chance(
    units: Units, ratio: float, limits: tuple[float, float], frequency: float, enough: str
) -> Finding:
    """Return the finding that limits of the largest deviation over the admitted one enclose 1.

    Args:
        frequency: of the largest ratio, in the unit of the user.
        enough: how many periods are needed, in words.
    """
    message = (
        f"the largest deviation is {ratio:.4g} of what is admitted, at {frequency:.4g} {units.per_time}. By "
        f"chance the true one may lie between {limits[0]:.3g} and {limits[1]:.3g}: {enough}"
    )
    return CHANCE.found(message, ratio=ratio, limits=limits, frequency=frequency)
