"""nyquist.csv and its plot: where the data leave the loop of one input and one output."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from inputdesign_cli.accuracy import OnModelError
from inputdesign_cli.arrays import Array
from inputdesign_cli.outcome.curves import Curves, NyquistCurves
from inputdesign_cli.outcome.results import Table
from inputdesign_cli.outcome.units import Units
from inputdesign_cli.questions.common.spectrum import axis, distinct

_NOTHING, _ROUNDING = 1e-9, 1e-9


def nyquist_curves(
    units: Units, errors: Sequence[OnModelError], information: Array, active: Sequence[Array] = ()
) -> tuple[dict[str, Table], dict[str, Curves]]:
    """C G with discs of radius |C| r_u, by file stem; nothing without a loop, or for several channels.

    The loop is that whose sensitivity is bounded, else that of the experiment.

    Args:
        errors: the first has r_u and a band; information (k, k) is in its coordinates.
        active: of each error the frequencies of the experiment at which it binds; empty for none.
    """
    if not errors or not units.single:
        return {}, {}
    error, limiting = errors[0], active[0] if active else np.zeros(0)
    kept = error.admissible.kept
    loop = error.experiment.loop if kept is None else kept.loop
    if loop is None:
        return {}, {}
    limiting = distinct(limiting, error.band[1])
    w = axis(*error.band, np.concatenate([error.grid, limiting]))
    S, applied = (part[:, 0, 0] for part in loop.sensitivity(w))
    # With integral action S vanishes at frequency zero, where the loop has no end.
    inside = np.abs(S) > _NOTHING
    w, S, applied = w[inside], S[inside], applied[inside]
    L, radius = 1.0 / S - 1.0, np.abs(applied / S) * error.error_bound(information, w)
    frequency = w / units.frequency
    columns = {units.frequency_header: frequency, "CG_re": L.real, "CG_im": L.imag, "radius": radius}
    circle = None
    if kept is not None:
        columns["distance_kept"] = np.abs(kept.weight.at(w))
        lowest, highest = columns["distance_kept"].min(), columns["distance_kept"].max()
        circle = float(lowest) if highest - lowest <= _ROUNDING * highest else None
    curves = NyquistCurves(frequency, L, radius, circle, limiting / units.frequency)
    return {"nyquist": Table(columns)}, {"nyquist": curves}
