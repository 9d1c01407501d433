"""The inputs of a log do not determine a plant: they only answer, move too simply, or move together."""

from __future__ import annotations

import numpy as np

from inputdesign_cli.explore import (
    Found,
    Parts,
    left_of_inputs,
    like_answers,
    only_answers,
    order_of_excitation,
)
from inputdesign_cli.finding import DOUBT, Finding, FindingKind, finding
from inputdesign_cli.identification.checks import signal_name

DRIVE = "move the reference of the loop, or add dither to the input, and record again"
# Unexplained share of an input's power, by the others, below which minima that swap effects are many.
_FOLLOWS = 0.02
# A parameter is not determined at all where it deviates by more than this share of its value.
_OPEN = 100.0


def doubtful_inputs(found: Found, parts: Parts, *, loop: bool) -> list[Finding]:
    """Return why the inputs of records leave the plant open.

    Args:
        parts: all records, u (n, r), y (n, p).
        loop: whether inputs answer the outputs.
    """
    moving = [(u[:, found.moving], y) for u, y in parts]
    inverses = [] if loop else _inverses(found, moving)
    return [*undriven(parts), *inverses, *(_too_simple(found, moving) or _open(found))]


@finding(DOUBT, "input-only-answers", "Move the reference of the loop, or add dither to the input.")
def undriven(kind: FindingKind, parts: Parts) -> list[Finding]:
    """An input follows from the outputs alone. The inverse of the controller explains the data as well."""
    names = [signal_name("u", j, parts[0][0].shape[1]) for j in only_answers(parts)]
    return [kind.found(f"{name}, and the plant is not identifiable", where=name) for name in names]


@finding(DOUBT, "like-inverse-controller", "Move the reference of the loop, or add dither to the input.")
def _inverses(kind: FindingKind, found: Found, moving: Parts) -> list[Finding]:
    """The model may be the inverse of a controller. The output responds in the same sample.

    No external signal seems to drive the input. In a loop, -1/C explains these data ([ljung-1999], Section
    13.4).
    """
    pairs = [
        (signal_name("y", i, found.model.outputs), signal_name("u", j, found.model.inputs))
        for i, candidate in enumerate(found.taken)
        for k, j in enumerate(found.moving)
        if not candidate.orders.delays[k] and like_answers(moving, i, k)
    ]
    return [kind.found(f"{y} responds to {u} in the same sample, as -1/C does", where=y) for y, u in pairs]


@finding(DOUBT, "excitation-too-simple", "Apply inputs that move more and independently (`idesign signal`).")
def _too_simple(kind: FindingKind, found: Found, moving: Parts) -> list[Finding]:
    """The inputs determine fewer parameters than the model has. Other models explain as much."""
    needed = max(candidate.orders.unknowns for candidate in found.taken)
    order = order_of_excitation(moving)
    if order < needed:
        single = [[(u[:, [j]], y) for u, y in moving] for j in range(len(found.moving))]
        together = min(map(order_of_excitation, single)) >= needed
        why = "the inputs move together" if together else "the input moves too simply"
        fact = f"{why}, persistently exciting of order {order}, and the model needs {needed}"
        return [kind.found(fact, order=order, needed=needed)]
    left, j = min(zip(left_of_inputs(moving), found.moving, strict=True))
    fact = f"u{j + 1} follows from the other inputs and their pasts but for {100.0 * left:.2g} % of its power"
    return kind.when(left < _FOLLOWS, fact, where=f"u{j + 1}", left=left)


@finding(DOUBT, "parameter-undetermined", "Move that input more, or leave it out with `--columns`.")
def _open(kind: FindingKind, found: Found) -> list[Finding]:
    """The record does not determine a parameter. Its deviation is many times its value."""
    named = open_parameters(found, _OPEN)
    return kind.when(named, ", ".join(named), where="".join(named[:1]).split(" = ")[0])


def open_parameters(found: Found, share: float = 1.0) -> list[str]:
    """Return parameters of plants in s (no dead times) that deviate by more than a share of their value."""
    estimate, model = found.estimate, found.model
    if not all(candidate.orders.physical for candidate in found.taken):
        return []
    deviations = np.sqrt(np.diag(estimate.covariance))
    open_ = model.in_plant & ~model.dead_times & ~(deviations <= share * np.abs(estimate.theta))
    return [
        f"{estimate.names[k]} = {estimate.theta[k]:.3g} +- {deviations[k]:.2g}"
        for k in np.flatnonzero(open_).tolist()
    ]
