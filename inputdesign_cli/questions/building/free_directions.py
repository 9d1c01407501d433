"""Does what the design pays for, or what limits it, count every combination of the inputs?"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from inputdesign_cli.design.convex.question import Question
from inputdesign_cli.errors import IdesignError
from inputdesign_cli.questions.building.for_nothing import counted_powers, price_density
from inputdesign_cli.specification import Spec

# Where the price is looked at, in shares of the band: none is a frequency that a controller or plant favours.
_PLACES = np.array([0.137, 0.293, 0.461, 0.618, 0.787, 0.911])
_SINGULAR = 1e-12


def check_every_direction_counts(spec: Spec, question: Question) -> None:
    """Refuse a design in which some combination of the inputs may have any power.

    Powers of fewer outputs than inputs leave such combinations, and so do weights of zero: what is
    unlimited has no best value, and what is free has no least cost.

    Raises:
        SpecError: `no-cost` or `needs-limits`.
    """
    counted = counted_powers(question)
    if counted is None:
        return
    lo, hi = question.experiment.band
    density = price_density(question.experiment, counted, lo + (hi - lo) * _PLACES)
    size = np.sqrt(np.einsum("naa->na", density).real)
    unit = np.where(size > 0.0, size, 1.0)
    correlation = density / (unit[:, :, None] * unit[:, None, :])
    if np.linalg.eigvalsh(correlation)[:, 0].max() <= _SINGULAR:
        raise _complaint(spec, np.flatnonzero(np.all(size == 0.0, axis=0)))


def _complaint(spec: Spec, silent: NDArray[np.intp]) -> IdesignError:
    which = f"a combination of the {spec.plant.inputs} inputs"
    if silent.size:
        which = f"the power of input {silent[0] + 1}"
    if spec.goal == "least_cost":
        unseen = "" if silent.size else ": it does not show in the powers that are paid for"
        return spec.complain(
            "no-cost",
            f"{which} costs nothing{unseen}",
            hint="give input_power a weight for every input, however small",
            key="cost",
        )
    unseen = "" if silent.size else ": it does not show in the powers that are limited"
    return spec.complain(
        "needs-limits",
        f"nothing limits {which}{unseen}",
        hint="add limits.input_power, or limits.excitation_power in closed loop",
        key="limits",
    )
