"""Time against amplitude against accuracy: the sweep that shows the gain from more of each."""

from __future__ import annotations

import json
from collections.abc import Sequence

import numpy as np

from inputdesign_cli.errors import bad_spec
from inputdesign_cli.figures.sweep_table import SweepTable, Trade
from inputdesign_cli.specification import Spec

_LENGTHS = (0.25, 0.5, 1.0, 2.0)
_AMPLITUDES = (0.5, 1.0, 2.0)
# What the record reaches; without a record what the design does.
_QUANTITIES = ("signal.worst_ratio", "objective.value")


def trade_settings(spec: Spec, words: Sequence[str]) -> list[str]:
    """Return the settings of `sweep` for the best accuracy at several lengths and amplitudes.

    Args:
        spec: the experiment, tried at a quarter to twice its length and half to twice its amplitude.
        words: "samples", "amplitude" or both.

    Raises:
        SpecError: `needs-limits` where an amplitude is to be varied that is not limited.
    """
    lengths = ("limits.samples", "limits.duration", "signal.samples", "experiment.duration")
    settings = {"objective": "best_accuracy", "solver.any_spectrum": "false"} | dict.fromkeys(lengths, "null")
    shares = _LENGTHS if "samples" in words else (1.0,)
    counts = dict.fromkeys(max(round(share * spec.experiment.samples), 1) for share in shares)
    settings["experiment.samples"] = ",".join(map(str, counts))
    if "amplitude" in words:
        stated = spec.limits.amplitude
        if stated is None or stated.input is None:
            message = "amplitude is to be traded, but no amplitude is limited"
            raise bad_spec("needs-limits", message, hint="add limits.amplitude", key="limits")
        texts = [json.dumps((share * np.array(stated.input)).tolist()) for share in _AMPLITUDES]
        settings["limits.amplitude" if stated.output is None else "limits.amplitude.input"] = ",".join(texts)
    return [f"{key}={value}" for key, value in settings.items()]


def trade_of(table: SweepTable, spec: Spec) -> Trade:
    """Return the table of that sweep as a matrix."""
    samples = table.numbers("experiment.samples")
    found = np.full(table.rows, spec.experiment.samples, float) if samples is None else samples
    key = next((key for key in table.axes if key.startswith("limits.amplitude")), None)
    texts = [""] * table.rows if key is None else table.columns[key]
    criterion = spec.accuracy.criterion is not None
    known = (table.numbers(name) for name in (_QUANTITIES[1:] if criterion else _QUANTITIES))
    values = next((v for v in known if v is not None), np.full(table.rows, np.nan))
    lengths, names = np.unique(found), [f"amplitude {text}" if text else "best record" for text in texts]
    rows = {name: np.full(lengths.size, np.nan) for name in names}
    for name, place, value in zip(names, np.searchsorted(lengths, found), values, strict=True):
        rows[name][place] = value
    step, unit = (spec.sample_time, spec.time_unit) if spec.plant.sampled else (1.0, "samples")
    return Trade(lengths * step, unit, rows, criterion)
