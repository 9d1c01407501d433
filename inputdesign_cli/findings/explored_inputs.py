"""The inputs of a log do not determine a plant: they only answer, move too simply, or move together."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from inputdesign_cli.explore import (
    Found,
    Parts,
    left_of_inputs,
    like_answers,
    only_answers,
    order_of_excitation,
)
from inputdesign_cli.finding import Finding, doubt
from inputdesign_cli.identification.checks import signal_name

DRIVE = "move the reference of the loop, or add dither to the input, and record again"
# Unexplained share of an input's power, by the others, below which minima that swap effects are many.
_FOLLOWS = 0.02
# A parameter is not determined at all where it deviates by more than this share of its value.
_OPEN = 100.0

UNDRIVEN = doubt(
    "input-only-answers",
    "An input follows from the outputs alone. It is an exact function of outputs and its own past: a loop "
    "without excitation. The inverse of the controller explains these data as well as the plant.",
    "Move the reference of the loop, or add dither to the input.",
)
INVERSE = doubt(
    "like-inverse-controller",
    "The model may be the inverse of a controller. The output responds in the same sample, and no external "
    "signal seems to drive the input. In a loop, -1/C explains these data ([ljung-1999], Section 13.4).",
    "Move the reference of the loop, or add dither to the input.",
)
TOO_SIMPLE = doubt(
    "excitation-too-simple",
    "The inputs determine fewer parameters than the model has. Their order of persistent excitation is too "
    "low for the model. Other models explain the record as well.",
    "Apply inputs that move more and independently; `idesign signal` makes some.",
)
OPEN = doubt(
    "parameter-undetermined",
    "The record does not determine a parameter. Its standard deviation is many times its value, or a time "
    "constant is much longer than the record.",
    "Move that input more, or leave it out with `--columns`.",
)


def doubtful_inputs(found: Found, parts: Parts, *, loop: bool) -> list[Finding]:
    """Return why the inputs of records leave the plant open.

    Args:
        parts: all records, u (n, r), y (n, p).
        loop: whether inputs answer the outputs.
    """
    moving = [(u[:, found.moving], y) for u, y in parts]
    return [
        *undriven(parts),
        *([] if loop else _inverses(found, moving)),
        *(list(_too_simple(found, moving)) or _open(found)),
    ]


def undriven(parts: Parts) -> list[Finding]:
    """Return a finding for each input that only answers the outputs."""
    found = []
    for j in only_answers(parts):
        name = signal_name("u", j, parts[0][0].shape[1])
        message = (
            f"{name} follows from the outputs and its own past: data from a loop without excitation, from "
            "which a plant is not identifiable (the inverse of the controller explains them as well): "
        )
        found.append(UNDRIVEN.found(f"{message}{DRIVE}", where=name))
    return found


def _inverses(found: Found, moving: Parts) -> Iterator[Finding]:
    for i, candidate in enumerate(found.taken):
        for k, j in enumerate(found.moving):
            y, u = signal_name("y", i, found.model.outputs), signal_name("u", j, found.model.inputs)
            message = (
                f"{y} answers {u} in the same sample, as the inverse of a controller does (-1/C): if {u} "
                f"was made from {y}, as in a loop, this is no model of the plant: {DRIVE}"
            )
            if not candidate.orders.delays[k] and like_answers(moving, i, k):
                yield INVERSE.found(message, where=y)


def _too_simple(found: Found, moving: Parts) -> Iterator[Finding]:
    needed = max(candidate.orders.unknowns for candidate in found.taken)
    order = order_of_excitation(moving)
    if order < needed:
        single = [[(u[:, [j]], y) for u, y in moving] for j in range(len(found.moving))]
        together = min(map(order_of_excitation, single)) >= needed
        message = (
            f"{'the inputs move together' if together else 'the input moves too simply'}: persistently "
            f"exciting of order {order}, and the model needs {needed}. Other models explain this record as "
            "well; apply inputs that move more, and independently (idesign signal makes some)"
        )
        yield TOO_SIMPLE.found(message, order=order, needed=needed)
        return
    left, j = min(zip(left_of_inputs(moving), found.moving, strict=True))
    message = (
        f"u{j + 1} follows from the other inputs and their pasts but for {100.0 * left:.2g} % of its power: "
        "models in which the inputs exchange their effects explain this record about as well; move them one "
        "by one, or independently"
    )
    if left < _FOLLOWS:
        yield TOO_SIMPLE.found(message, where=f"u{j + 1}", left=left)


def _open(found: Found) -> list[Finding]:
    named = open_parameters(found, _OPEN)
    message = (
        f"{', '.join(named)}: the record leaves open what acts there; move that input more, or leave it out "
        "(--columns)"
    )
    return [OPEN.found(message, where=named[0].split(" = ")[0])] if named else []


def open_parameters(found: Found, share: float = 1.0) -> list[str]:
    """Return parameters of plants in s (no dead times) that deviate by more than a share of their value."""
    estimate, model = found.estimate, found.model
    if not all(candidate.orders.physical for candidate in found.taken):
        return []
    counted = model.in_plant & ~model.dead_times
    deviations = np.sqrt(np.diag(estimate.covariance))
    return [
        f"{name} = {value:.3g} +- {deviation:.2g}"
        for name, value, deviation, counts in zip(
            estimate.names, estimate.theta, deviations, counted, strict=True
        )
        if counts and not deviation <= share * abs(value)
    ]
