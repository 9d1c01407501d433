"""frequency_response.csv: G of the data without a model, beside G of the model."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from inputdesign_cli.findings.frequency_responses import BY_U
from inputdesign_cli.identification import FrequencyResponse
from inputdesign_cli.outcome import MeasuredLines
from inputdesign_cli.outcome.curves import ResponseCurves, ResponsePanel
from inputdesign_cli.outcome.results import Array, Table
from inputdesign_cli.outcome.units import Units
from inputdesign_cli.plant import Model

# Beyond a disc by more than this share of G.
_FAR = 0.2


def response_of_data(
    units: Units,
    model: Model,
    found: FrequencyResponse,
    *,
    by_reference: bool,
    inputs: Sequence[int] | None = None,
    loop: bool = False,
) -> tuple[Table, ResponseCurves, MeasuredLines]:
    """Return the table, its figure, and `frequency_response` of the result.

    Args:
        model: the estimate that it stands beside.
        by_reference: whether a reference from outside was used.
        inputs: the inputs (from zero) of `found`; None: all.
        loop: whether the data come from a loop, which the spec need not state.
    """
    w = found.frequency / units.sample_time
    G = model.plant_at(w * units.frequency)
    columns: dict[str, Array] = {units.frequency_header: w}
    panels, outside, far = [], list[NDArray[np.bool_]](), list[NDArray[np.bool_]]()
    for i in range(units.outputs):
        for k, j in enumerate(range(units.inputs) if inputs is None else inputs):
            own, radius, modelled = found.G[:, i, k], found.radius[:, i, k], G[:, i, j]
            listed = {"G_re": own.real, "G_im": own.imag, "G_abs": np.abs(own), "radius": radius}
            listed["model_abs"] = np.abs(modelled)
            columns |= {f"{name}{units.suffix(i, j)}": values for name, values in listed.items()}
            entry = None if units.single else (i, j)
            panels.append(ResponsePanel(w, own, radius, modelled, entry, units.passage((i, j))))
            apart, size = np.abs(own - modelled), np.maximum(np.abs(own), np.abs(modelled))
            outside.append(apart > radius)
            far.append(apart > radius + _FAR * size)
        number = "" if units.single else f"_{i + 1}"
        columns |= {f"noise_spectrum{number}": found.noise[:, i], f"coherence{number}": found.coherence[:, i]}
    told = MeasuredLines(
        method=found.method,
        excitation="r" if by_reference else "u",
        frequencies=int(w.size),
        entries=len(panels),
        model_outside=float(np.mean(outside)),
        model_far_outside=float(np.mean(far)),
        caveat=BY_U if (units.closed_loop or loop) and not by_reference else None,
    )
    return Table(columns), ResponseCurves(tuple(panels)), told
