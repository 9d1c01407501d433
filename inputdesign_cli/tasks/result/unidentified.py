"""Parameters of a model that a record cannot tell: more than its inputs excite, or beyond its frequencies."""

from __future__ import annotations

import numpy as np

from inputdesign_cli.identification.explore import Found, order_of_excitation
from inputdesign_cli.identification.explore.fits import Parts
from inputdesign_cli.plant.polynomial import Array


def unidentified(found: Found, moving: Parts, step: float, unit: str) -> tuple[str, ...]:
    """A sentence for every reason why the parameters of the model are not those of the plant alone.

    Args:
        moving: records of the inputs that move.
        step, unit: the sample time.
    """
    needed = max(candidate.orders.unknowns for candidate in found.taken)
    order, told = order_of_excitation(moving), []
    if (
        order
        < needed
        <= min(order_of_excitation([(u[:, [j]], y) for u, y in moving]) for j in range(len(found.moving)))
    ):
        told.append(
            "the inputs move together: each of them moves enough by itself, and some combination of them and "
            f"their pasts hardly does (persistently exciting of order {order} together, and the model needs "
            f"{needed}), so that their effects cannot be told apart; move them one by one, or independently"
        )
    elif order < needed:
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
