"""Time against amplitude against accuracy: the small sweep that tells what more of each means would buy."""

from __future__ import annotations

import json
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from inputdesign_cli.compute.executor import Executor
from inputdesign_cli.errors import bad_spec
from inputdesign_cli.figures.sweep_table import SweepTable, read_sweep
from inputdesign_cli.figures.trade import Trade
from inputdesign_cli.specification import Spec
from inputdesign_cli.sweeps.running import run_sweep

_LENGTHS = (0.25, 0.5, 1.0, 2.0)
_AMPLITUDES = (0.5, 1.0, 2.0)
# What the record reaches; without one what the design does.
_QUANTITIES = ("signal.worst_ratio", "objective.value")


def run_trade(
    file: Path,
    spec: Spec,
    words: Sequence[str],
    directory: Path,
    *,
    overrides: Sequence[str] = (),
    confine: Path | None = None,
    executor: Executor | None = None,
    figure_format: str = "png",
) -> Trade:
    """The best accuracy at a quarter to twice the length, at half to twice the amplitude, as a sweep.

    Args:
        file: of the spec, to which the `overrides` belong.
        words: "samples", "amplitude" or both.
        directory: of the sweep.
        figure_format: of its figures: png, svg or pdf.

    Raises:
        SpecError: `needs-limits` where an amplitude is to be varied that is not limited; see `run_sweep`.
        OutputError: see `run_sweep`.
    """
    settings = [*overrides, *trade_settings(spec, words)]
    # The directory belongs to the run beside it, whatever was traded there before.
    run_sweep(
        file,
        settings,
        directory=directory,
        confine=confine,
        executor=executor,
        figure_format=figure_format,
        overwrite=True,
    )
    return read_trade(read_sweep(directory), spec)


def trade_settings(spec: Spec, words: Sequence[str]) -> list[str]:
    """What `sweep` is to vary and to hold."""
    fixed = {"objective": "best_accuracy", "solver.any_spectrum": "false"}
    lengths = ("limits.samples", "limits.duration", "signal.samples", "experiment.duration")
    fixed |= dict.fromkeys(lengths, "null")
    samples = spec.experiment.samples
    fixed["experiment.samples"] = str(samples)
    if "samples" in words:
        counts = dict.fromkeys(max(round(share * samples), 1) for share in _LENGTHS)
        fixed["experiment.samples"] = ",".join(map(str, counts))
    if "amplitude" in words:
        stated = spec.limits.amplitude
        if stated is None or stated.input is None:
            message = "amplitude is to be traded, but no amplitude is limited"
            raise bad_spec("needs-limits", message, hint="add limits.amplitude", key="limits")
        peak = stated.input
        texts = [json.dumps((share * np.array(peak)).tolist()) for share in _AMPLITUDES]
        whole = stated.output is None
        fixed["limits.amplitude" if whole else "limits.amplitude.input"] = ",".join(texts)
    return [f"{key}={value}" for key, value in fixed.items()]


def read_trade(table: SweepTable, spec: Spec) -> Trade:
    """The table of the sweep as a matrix."""
    samples = table.numbers("experiment.samples")
    found = np.full(table.rows, spec.experiment.samples, float) if samples is None else samples
    key = next((key for key in table.axes if key.startswith("limits.amplitude")), None)
    texts = [""] * table.rows if key is None else table.columns[key]
    criterion = spec.accuracy.criterion is not None
    names = _QUANTITIES[1:] if criterion else _QUANTITIES
    known = (table.numbers(name) for name in names)
    values = next((v for v in known if v is not None), np.full(table.rows, np.nan))
    lengths, amplitudes = np.unique(found), tuple(dict.fromkeys(texts))
    cells = np.full((len(amplitudes), lengths.size), np.nan)
    for n, text in enumerate(texts):
        cells[amplitudes.index(text), int(np.searchsorted(lengths, found[n]))] = values[n]
    unit = spec.time_unit if spec.plant.sampled else "samples"
    step = spec.sample_time if spec.plant.sampled else 1.0
    return Trade(lengths * step, unit, amplitudes, cells, criterion)
