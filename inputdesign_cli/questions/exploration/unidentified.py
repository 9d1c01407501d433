"""Parameters of a model that a record cannot tell: more than its inputs excite, or beyond its frequencies."""

from __future__ import annotations

import numpy as np

from inputdesign_cli.arrays import Array
from inputdesign_cli.explore import Found, left_of_inputs, one_line, order_of_excitation
from inputdesign_cli.explore.fits import Parts
from inputdesign_cli.explore.processes import LONGER
from inputdesign_cli.findings.rivals import most_apart
from inputdesign_cli.identification.response_chance import chance_of_response, driving_nothing

# A parameter of a plant in s is told to no digit where it deviates by more than this share of its value, and
# not at all beyond the other.
_NO_DIGIT, _NOT_AT_ALL = 1.0, 100.0
# A rival of a twentieth of the likelihood, -2 log of that, and how far its G is off, in shares of its peak.
_AS_LIKELY, _ELSEWHERE = 2.0 * float(np.log(20.0)), 0.1
# G of a rival with other noise is off by chance so seldom.
_BY_CHANCE = 1e-3
_FREQUENCIES = 100
_OF_A_LINE = 2  # numbers that one frequency tells
# What others leave of an input, in shares of its power, where minima that exchange their effects are many.
_FOLLOWS = 0.02


def unidentified(
    found: Found, moving: Parts, step: float, unit: str, *, integrates: bool = False
) -> tuple[str, ...]:
    """A sentence for every reason why the parameters of the model are not those of the plant alone.

    Args:
        moving: records of the inputs that move.
        step, unit: the sample time.
        integrates: whether it is told already that the plant is like an integrator.
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
    for j, left in zip(found.moving, left_of_inputs(moving), strict=True):
        if left < _FOLLOWS:
            told.append(
                f"u{j + 1} follows from the other inputs and their pasts but for {100.0 * left:.2g} % of its "
                "power: other models, in which the inputs exchange what they do, explain this record about "
                "as well; move them one by one, or independently"
            )
            break
    share = one_line(moving) if len(found.moving) == 1 and order >= needed > _OF_A_LINE else None
    if share is not None:
        told.append(
            f"{100.0 * share:.3g} % of the power of the input are one sinusoid, and nothing that the rest "
            f"moves can be seen: it tells {_OF_A_LINE} numbers of the plant, not {needed}, and two signals "
            "that share a period (as of days) agree there without one moving the other; apply an input that "
            "moves more (idesign signal makes some)"
        )
    none = untold_parameters(found, _NOT_AT_ALL)
    if none:
        told.append(
            f"{', '.join(none)}: the record does not tell what acts there; move that input more, or leave it "
            "out (--columns)"
        )
    longest = max(len(y) for _, y in found.used)
    for candidate, theta in zip(found.taken, _by_output(found), strict=True):
        orders = candidate.orders
        if integrates:
            continue
        slow = orders.slowest(theta) if orders.physical is True else 0.0
        late = [("the longest time constant", slow)] if slow > LONGER * longest * step else []
        for letter, value in orders.beyond(theta, longest) or late:
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


def untold_parameters(found: Found, share: float = _NO_DIGIT) -> list[str]:
    """Those of plants in s, dead times apart, that deviate by more than a share of their value."""
    estimate, model = found.estimate, found.model
    if not all(candidate.orders.physical for candidate in found.taken):
        return []
    counted = model.in_plant & ~model.dead_times
    deviations = np.sqrt(np.diag(estimate.covariance))
    return [
        f"{name} = {value:.3g} +- {deviation:.2g}"
        for name, value, deviation, is_told in zip(
            estimate.names, estimate.theta, deviations, counted, strict=True
        )
        if is_told and not deviation <= share * abs(value)
    ]


def _remedy(found: Found) -> str:
    """What to do about parameters that are not told: inputs without an effect have any."""
    idle = set(driving_nothing(found.model, found.estimate)) - set(found.still)
    move = "move the inputs independently of each other, and at more frequencies"
    if not 0 < len(idle) < len(found.moving):
        return move
    names = " and ".join(f"u{j + 1}" for j in sorted(idle))
    return f"leave out {names}, of which no effect can be told from none (--columns), or {move}"


def rivalled(found: Found) -> tuple[str, ...]:
    """A sentence where parameters of another minimum explain the record about as well, with another G."""
    w = np.linspace(1e-6, np.pi, _FREQUENCIES)
    G = found.model.plant_at(w)
    peaks = np.maximum(np.abs(G).max(axis=0), 1e-300)
    for rival in found.estimate.rivals:
        other = found.model.at(rival.theta, found.model.covariance).plant_at(w)
        apart = float(np.max(np.abs(other - G) / peaks))
        if rival.excess <= _AS_LIKELY and not apart <= _ELSEWHERE:
            estimate, most = found.estimate, most_apart(found.estimate, rival)
            values = ", ".join(
                f"{estimate.names[i]} {estimate.theta[i]:.3g} or {rival.theta[i]:.3g}" for i in most
            )
            more = ", .." if len(most) < len(estimate.names) else ""
            share = f"{100.0 * apart:.3g} % of" if apart < 1.0 else f"{apart:.3g} times"
            return (
                f"two sets of parameters explain the record about equally well ({values}{more}; -2 log "
                f"likelihood differs by {rival.excess:.2g}), and their G by {share} its peak: "
                f"{_remedy(found)}",
            )
    if found.rival is None:
        return ()
    apart = float(np.max(np.abs(found.rival.plant_at(w) - G) / peaks))
    chance = chance_of_response(found.model, found.estimate, found.rival)
    if apart <= _ELSEWHERE or (chance is not None and chance > _BY_CHANCE):
        return ()
    return (
        "noise about a level explains the record somewhat better than a random walk, which is the safer "
        f"claim, and G of the two differs by {100.0 * apart:.3g} % of its peak, beyond chance: record "
        "for longer, and let the input step more often, so that what it does stands out from the drift",
    )
