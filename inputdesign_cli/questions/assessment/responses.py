"""frequency_response.csv: what the data say of G without a model, beside what the model says."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from inputdesign_cli.identification import FrequencyResponse
from inputdesign_cli.outcome.curves import ResponseCurves, ResponsePanel
from inputdesign_cli.outcome.results import Array, Json, Table
from inputdesign_cli.outcome.units import Units
from inputdesign_cli.plant import Model

_BY_U = (
    "the frequency response without a model is from u to y in a loop: where the noise is strong it is drawn "
    "towards -1/C; record the reference as column r, and it is estimated from r"
)
# Beyond a disc by more than this share of G, and at how many of the frequencies no model is right any more.
_FAR, _MOST_FAR = 0.2, 0.1


def response_of_data(
    units: Units,
    model: Model,
    found: FrequencyResponse,
    *,
    by_reference: bool,
    inputs: Sequence[int] | None = None,
    loop: bool = False,
) -> tuple[Table, ResponseCurves, dict[str, Json]]:
    """The table, its figure, and what `frequency_response` of the result says of it.

    Args:
        model: the estimate that it stands beside.
        by_reference: whether a reference from outside was used.
        inputs: those (from zero) that `found` has; None: all.
        loop: whether the data come from one, of which the spec need not tell.
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
    told: dict[str, Json] = {
        "method": found.method,
        "excitation": "r" if by_reference else "u",
        "frequencies": int(w.size),
        "entries": len(panels),
        "model_outside": float(np.mean(outside)),
        "model_far_outside": float(np.mean(far)),
    }
    if (units.closed_loop or loop) and not by_reference:
        told["caveat"] = _BY_U
    return Table(columns), ResponseCurves(tuple(panels)), told


def contradicted(told: dict[str, Json]) -> tuple[str, ...]:
    """That the data alone say otherwise of G than a model does, where both are of one plant: in open loop."""
    if "caveat" in told or told["model_far_outside"] < _MOST_FAR:
        return ()
    return (
        "what the data say of G without a model contradicts it: the model is farther off than the discs of "
        f"95 %, and by a fifth of |G| besides, at {100 * told['model_far_outside']:.0f} % of the frequencies "
        "(frequency_response.png): the data may come from a loop that was not seen, the plant may not be "
        "linear, or something else moves it along with the inputs",
    )


def response_note(told: dict[str, Json]) -> list[str]:
    """What a user should know of it, in sentences."""
    share = told["model_outside"]
    usual = "" if "caveat" in told else " (a right model: at about 5 %)"
    entries = "" if told["entries"] == 1 else f", counted over {told['entries']} entries of G"
    sentence = (
        "frequency_response.csv has what the data say of G without a model"
        f"{', by the reference' if told['excitation'] == 'r' else ''}, with discs of 95 %: the model is "
        f"outside at {100 * share:.0f} % of {told['frequencies']} frequencies{entries}{usual}"
    )
    return [sentence, *([told["caveat"]] if "caveat" in told else [])]
