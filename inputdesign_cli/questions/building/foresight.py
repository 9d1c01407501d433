"""Spec -> whether the data of its experiment may fit other dead times as well, and what to do about it."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial

import numpy as np

from inputdesign_cli.information import Experiment
from inputdesign_cli.outcome import Outcome
from inputdesign_cli.questions.building.header import build_units
from inputdesign_cli.questions.building.knowledge import build_knowledge
from inputdesign_cli.questions.building.model_error import unstated_errors
from inputdesign_cli.questions.building.prior import build_earlier
from inputdesign_cli.questions.common.foresight import Foresight
from inputdesign_cli.specification import Spec

# Orders of filtered noise with power between the lines of a multisine, where other dead times differ.
_ORDERS = (12, 60)


def build_foresight(
    spec: Spec, nominal: Experiment, design: Callable[[Spec], Outcome] | None
) -> Foresight | None:
    """Return how rival dead times are foreseen; None for plants that have none to be estimated.

    Args:
        nominal: the experiment, in raw parameters.
        design: solves a spec without a look at other spectra; None if nothing is designed.
    """
    model = nominal.model
    late = np.flatnonzero(model.dead_times)
    if late.size == 0:
        return None
    names = ", ".join(_quoted(model.names[i]) for i in late)
    stated = spec.spectrum
    # Designs for several plants take long, and filtered noise needs no other spectrum.
    alone = spec.uncertainty is not None or stated is None or stated.type == "fir"

    def solved(order: int) -> Outcome:
        assert design is not None
        return design(spec.with_(spectrum={"type": "fir", "order": order}))

    return Foresight(
        units=build_units(spec),
        nominal=nominal,
        entries=unstated_errors(spec, nominal),
        earlier=build_earlier(spec, model),
        advice=f"excite more frequencies, or hold what is known (plant.known: [{names}])",
        knowledge=build_knowledge(spec),
        looks=spec.solver.any_spectrum,
        richer={}
        if design is None or alone
        else {f"{{type: fir, order: {order}}}": partial(solved, order) for order in _ORDERS},
    )


def _quoted(name: str) -> str:
    """Write a name as in a list of YAML."""
    return f'"{name}"' if "[" in name else name
