"""Estimate what a nonlinearity does to a measured frequency response, from lines that were not excited.

Excited lines are odd harmonics, so that a nonlinearity of even degree does not affect them. One of odd degree
adds as much to each as to the neighbouring odd lines without excitation. It changes the gain as well
([pintelon-schoukens-2012], Sections 3.4 and 4.3). The added part is measured. The change of the gain has the
frequencies of the excitation, so that no line shows it. It is estimated as for a cubic of a Gaussian signal.
With y = x + c x^3 and E x^2 = s the gain is 1 + 3 c s, and the rest of c x^3 has the mean square 6 c^2 s^3.
The square of the relative change is 9/6 of the ratio of the rest to the power of x. A third of the rest is
beyond the highest line (three times the band), so that the share that is seen counts 9/6 times 3/2.
Signals of low peaks leave less for the same change of the gain: see `cubes`.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from inputdesign_cli.arrays import Array
from inputdesign_cli.identification.periodic_response import PeriodicResponse
from inputdesign_cli.identification.silent_lines import SilentLines

_OF_THE_SHARE = 9.0 / 6.0 * 3.0 / 2.0


def response_error(
    found: PeriodicResponse, period: int, kept: int, odd: SilentLines, harmonics: NDArray[np.int_]
) -> NDArray[np.float64]:
    """Return the errors (L, p, r) of G at the excited lines: added part and change of gain, in mean square.

    Args:
        found: the response, from `kept` periods of `period` samples in all.
        odd: the power at odd lines without excitation, at these `harmonics`.
    """
    added = _between(harmonics, odd.beyond, found.harmonics)
    of_inverse = kept * period * found.deviation**2 / found.noise[:, :, None]  # sum over blocks of |U^-1|^2
    at_lines = added[:, :, None] * of_inverse
    # The power of the inputs behind each output, and of the added part, referred to the inputs.
    gain = np.sum(np.abs(found.G) ** 2, axis=2)
    before = found.explained / gain
    seen = _between(found.harmonics, gain, harmonics)
    shares = np.maximum(
        (odd.beyond.sum(axis=0) + added.sum(axis=0)) / found.explained.sum(axis=0),
        ((odd.beyond / seen).sum(axis=0) + (added / gain).sum(axis=0)) / before.sum(axis=0),
    )
    changed = _OF_THE_SHARE * shares[None, :, None] * np.abs(found.G) ** 2
    return np.asarray(np.sqrt(at_lines + changed))


def _between(known: NDArray[np.int_], values: NDArray[np.float64], at: NDArray[np.int_]) -> Array:
    """Return values (n, p) at harmonics `at`, interpolated from values (l, p) at `known` ones."""
    return np.stack([np.interp(np.log(at), np.log(known), column) for column in values.T], axis=1)
