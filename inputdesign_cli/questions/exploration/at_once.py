"""Plants that answer in the same sample, as the inverse of a controller does."""

from __future__ import annotations

import numpy as np

from inputdesign_cli.explore import Found, set_apart, together_at_once
from inputdesign_cli.explore.fits import Parts
from inputdesign_cli.identification.checks import signal_name

# The static gain is as good as none below this share of the largest one; what falls to this share of its peak
# has a resonance.
_NO_GAIN, _FALLS = 0.05, 0.6
_FREQUENCIES = 100


def like_inverses(found: Found, moving: Parts) -> tuple[str, ...]:
    """A sentence for every plant that may be the inverse of a controller, -1/C ([ljung-1999], Section 13.4).

    It answers at once, and either nobody sets the input without a look at the output, as far as the input
    tells, or a plant of one input and output has no static gain and |G| hardly falls with frequency, as where
    C integrates.

    Args:
        moving: records of the inputs that move.
    """
    at_once, told = together_at_once(moving), []
    for i, candidate in enumerate(found.taken):
        for k, j in enumerate(found.moving):
            if candidate.orders.delays[k] or not at_once[i, k]:
                continue
            integrates = _like_integral_action(found, i, j)
            if not integrates and set_apart(moving, k):
                continue
            y, u = signal_name("y", i, found.model.outputs), signal_name("u", j, found.model.inputs)
            why = (
                "and not at all at rest, as the inverse of a controller with integral action does (-1/C)"
                if integrates
                else f"as the inverse of a controller does (-1/C), and {u}, which is not held, switched, "
                f"periodic or white, does not tell that it was set without a look at {y}"
            )
            told.append(
                f"{y} answers {u} in the same sample {why}: if {u} was made from {y}, as in a loop, this is "
                "no model of the plant"
            )
    return tuple(told)


def _like_integral_action(found: Found, i: int, j: int) -> bool:
    if found.model.inputs > 1 or found.model.outputs > 1:
        return False
    G = np.abs(found.model.plant_at(np.linspace(1e-6, np.pi, _FREQUENCIES))[:, i, j])
    highest = np.maximum.accumulate(G)
    return bool(G[0] <= _NO_GAIN * highest[-1] and np.all(_FALLS * highest <= G))
