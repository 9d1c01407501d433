"""The largest counts and lists of a spec, and the reasons.

Beyond them memory or time runs out, or rounding dominates; `docs/sizes.md` shows them with measurements.
`questions/building/demand.py` estimates the demand of several keys together.
"""

from __future__ import annotations

from pydantic import AfterValidator

from inputdesign_cli.specification.models.section import Size, fail
from inputdesign_cli.specification.models.wording import show


def magnitude(least: float, most: float) -> AfterValidator:
    """Allow zero and magnitudes from `least` to `most`: products of a few larger ones would overflow."""

    def check(value: float) -> float:
        if value and not least <= abs(value) <= most:
            bound = f"at most {most:g}" if abs(value) > 1.0 else f"at least {least:g}"
            message = f"{{key}} is {show(value)}, and such a number is {bound} in size"
            raise fail("out-of-range", message, "choose another unit")
        return value

    return AfterValidator(check)


QUANTITIES, DEVIATIONS = (1e-40, 1e40), (1e-15, 1e15)
QUANTITY = magnitude(*QUANTITIES)
"""Powers, variances, errors, times, frequencies."""
COEFFICIENT = magnitude(0.0, 1e100)
"""Coefficients and entries of matrices: powers of s may be far apart, and rounding leaves small ones."""

SIZES = {
    "spectrum.order of fir": Size(1000, "the time of a design grows with the cube of the order"),
    "spectrum.order of polynomial": Size(80, "its integrals lose their digits beyond"),
    "spectrum.lines": Size(5000, "a design keeps a number for each pair of lines"),
    "spectrum.frequencies": Size(5000, "a design keeps a number for each pair of lines"),
    "spectrum.factor_columns": Size(20, "a factor has no more columns than there are inputs"),
    "spectrum.grid": Size(100_000, "every frequency has a matrix of its own"),
    "spectrum.given.frequencies": Size(5000, "a number is kept for each pair of lines"),
    "solver.windows": Size(14, "a window more doubles the work"),
    "solver.grid": Size(2000, "the program has a matrix inequality at every frequency"),
    "accuracy.model_error.confidence.draws": Size(100_000, "every draw is a model of its own"),
    "accuracy.model_error.confidence.runs": Size(100_000, "every run is a record that is identified"),
    "accuracy.frequency_response.lines": Size(100_000, "every line has a power and a deviation of its own"),
    "uncertainty.scenarios": Size(2000, "every plant has integrals and peaks of its own"),
    "uncertainty.fresh": Size(100_000, "every plant has integrals and peaks of its own"),
    "campaign.stages": Size(1000, "every stage has an estimate and a plan"),
    "signal.samples": Size(1_000_000, "a record has an entry for each sample and parameter"),
    "samples of a ready-made signal": Size(10_000_000, "it has a number for each sample and input"),
    "signal.lines": Size(1_000_000, "a period has no more harmonics than samples"),
    "signal.candidates": Size(1000, "every candidate takes as long as one record"),
    "signal.order": Size(100, "the filter is fitted by a search over its states"),
    "simulation.runs": Size(1_000_000, "every run is an experiment and an estimate"),
    "simulation.compare": Size(10, "every input is tried as often as there are runs"),
    "coefficients of a numerator": Size(1001, "a longer delay calls for slower sampling"),
    "coefficients of a denominator": Size(301, "roots of higher orders mean nothing in double precision"),
    "controller.delay": Size(1000, "a longer delay calls for slower sampling"),
    "states": Size(100, "responses at every frequency take the cube of their number"),
    "inputs or outputs": Size(20, "a model has parameters for each pair of them"),
    "plant.parameters": Size(200, "every coefficient has a derivative with respect to each"),
    "plant.regression": Size(200, "a design has an unknown for each pair of regressors"),
    "report.ellipses": Size(100, "every pair is a panel of the figure"),
}


def most(key: str) -> int:
    """Return the largest value of a key."""
    return SIZES[key].most
