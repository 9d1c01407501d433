"""Spec -> whether the data of its experiment may fit other dead times as well, and what to do about it."""

from __future__ import annotations

import numpy as np

from inputdesign_cli.information import Experiment
from inputdesign_cli.questions.building.header import build_units
from inputdesign_cli.questions.building.knowledge import build_knowledge
from inputdesign_cli.questions.building.model_error import unstated_errors
from inputdesign_cli.questions.building.prior import build_earlier
from inputdesign_cli.questions.common.foresight import Foresight
from inputdesign_cli.specification import Spec


def build_foresight(spec: Spec, nominal: Experiment) -> Foresight | None:
    """Return how rival dead times are foreseen; None for plants that have none to be estimated.

    Args:
        nominal: the experiment, in raw parameters.
    """
    model = nominal.model
    late = np.flatnonzero(model.dead_times)
    if late.size == 0:
        return None
    names = ", ".join(_quoted(model.names[i]) for i in late)
    stated = spec.spectrum
    # Filtered noise has power between the lines of a multisine, where other dead times differ.
    denser = "" if stated is None or stated.type == "fir" else " (spectrum: {type: fir, order: 12})"
    return Foresight(
        units=build_units(spec),
        nominal=nominal,
        entries=unstated_errors(spec, nominal),
        earlier=build_earlier(spec, model),
        advice=f"excite more frequencies{denser}, or hold what is known (plant.known: [{names}])",
        knowledge=build_knowledge(spec),
        looks=spec.solver.any_spectrum,
    )


def _quoted(name: str) -> str:
    """Write a name as in a list of YAML."""
    return f'"{name}"' if "[" in name else name
