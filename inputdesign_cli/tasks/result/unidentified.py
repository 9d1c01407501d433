"""Parameters of a model that a record cannot tell: more than its inputs excite, or beyond its frequencies."""

from __future__ import annotations

import numpy as np

from inputdesign_cli.identification.explore import Found
from inputdesign_cli.plant.polynomial import Array


def unidentified(found: Found, order: int, step: float, unit: str) -> tuple[str, ...]:
    """A sentence for every reason why the parameters of the model are not those of the plant alone.

    Args:
        order: of persistent excitation of the inputs that move.
        step, unit: the sample time.
    """
    needed = max(candidate.orders.unknowns for candidate in found.taken)
    told = []
    if order < needed:
        told.append(
            f"the input is persistently exciting of order {order} only, and the model needs {needed}: it "
            f"tells {order} numbers of the plant, and other models explain this record as well; apply an "
            "input that moves more (idesign signal makes some)"
        )
    longest = max(len(y) for _, y in found.used)
    for candidate, theta in zip(found.taken, _by_output(found), strict=True):
        for letter, value in candidate.orders.beyond(theta, longest):
            told.append(
                f"{letter} = {value:.3g} {unit} is not told by {longest} samples every {step:g} {unit}: a "
                "resonance beyond the Nyquist frequency is folded to another, and what is as slow as many "
                "records is a line in each; see whether the input moves enough, or sample otherwise"
            )
    return tuple(told)


def _by_output(found: Found) -> list[Array]:
    """The parameters of every output's plant, in the order of its structure."""
    widths = [len(candidate.orders.delays) * candidate.orders.unknowns for candidate in found.taken]
    return np.split(found.model.theta[: sum(widths)], np.cumsum(widths)[:-1])
