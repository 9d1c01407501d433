"""Spec -> whether the data of its experiment may leave other dead times, and what to do about it."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial

import numpy as np

from inputdesign_cli.information import Experiment
from inputdesign_cli.outcome import Outcome
from inputdesign_cli.questions.building.knowledge import build_knowledge
from inputdesign_cli.questions.building.model_error import unstated_errors
from inputdesign_cli.questions.building.prior import build_earlier
from inputdesign_cli.questions.common.foresight import Foresight
from inputdesign_cli.specification import Spec, parse_spec
from inputdesign_cli.tasks.build.header import build_units

# Filtered noise: power between the lines of a multisine, where whole periods of them differ.
_RICHER = ("{type: fir, order: 12}", "{type: fir, order: 60}")


def build_foresight(
    spec: Spec, nominal: Experiment, design: Callable[[Spec], Outcome] | None
) -> Foresight | None:
    """How rivals are foreseen; None for plants without dead times that are estimated.

    Args:
        nominal: the experiment, in raw parameters.
        design: the result of a design, without looking at others; None where nothing is designed.
    """
    model = nominal.model
    late = np.flatnonzero(model.dead_times)
    if late.size == 0:
        return None
    names = ", ".join(_quoted(model.names[i]) for i in late)
    stated = spec.spectrum
    # Several plants take their time, and noise of a filter has no other spectrum beside it.
    alone = spec.uncertainty is not None or stated is None or stated.type == "fir"

    def solved(words: str) -> Outcome:
        assert design is not None
        overrides, folder = [f"spectrum={words}"], spec.resolve_path(".")
        return design(parse_spec(spec.to_yaml(), "other spectrum", overrides, folder=folder))

    return Foresight(
        units=build_units(spec),
        nominal=nominal,
        entries=unstated_errors(spec, nominal),
        earlier=build_earlier(spec, model),
        advice=f"excite more frequencies, or hold what is known (plant.known: [{names}])",
        knowledge=build_knowledge(spec),
        looks=spec.solver.any_spectrum,
        richer={} if design is None or alone else {words: partial(solved, words) for words in _RICHER},
    )


def _quoted(name: str) -> str:
    """A name as it is written in a list of YAML."""
    return f'"{name}"' if "[" in name else name
