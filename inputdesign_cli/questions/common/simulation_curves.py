"""Curves and tables of a Monte Carlo study: errors of the models, their parameters, and what r alone does."""

from __future__ import annotations

import numpy as np

from inputdesign_cli.arrays import Array
from inputdesign_cli.monte_carlo.trials import PredictedError, Trials
from inputdesign_cli.outcome.curves import CloudCurves, ErrorBandCurves, ErrorBandPanel, SignalCurves
from inputdesign_cli.outcome.results import Table
from inputdesign_cli.outcome.units import Units
from inputdesign_cli.plant import Loop

QUANTILES = (0.05, 0.5, 0.95)
_PAIRS = 4
_CLOUD = 2000
# Time constants of the loop that a figure shows after the end of the excitation.
_FADED = 3.0


def error_bands(units: Units, predicted: PredictedError, errors: Array, name: str) -> ErrorBandCurves:
    """Quantiles of the errors (runs, n) over frequency, of every entry that the prediction is about."""
    frequency = predicted.w / units.frequency
    r_u = predicted.r_u if name == "design" else None

    def panel(own: Array, entry: tuple[int, int] | None) -> ErrorBandPanel:
        return ErrorBandPanel(
            frequency=frequency[own],
            quantiles={q: np.quantile(errors[:, own], q, axis=0) for q in QUANTILES},
            r_u=None if r_u is None else r_u[own],
            r_adm=None if predicted.r_adm is None else predicted.r_adm[own],
            entry=entry,
            names=units.passage(entry),
        )

    entries = predicted.entries
    if entries is None:
        panels = [panel(np.ones(frequency.size, dtype=bool), None)]
    else:
        places = np.unique(entries, axis=0).tolist()
        panels = [panel(np.all(entries == (i, j), axis=1), (i, j)) for i, j in places]
    return ErrorBandCurves(tuple(panels), name.replace("_", " "), len(errors))


def cloud(trials: Trials, covariance: Array | None) -> CloudCurves | None:
    """The estimates in some planes; None without a covariance (k, k) in theory, or for a single parameter."""
    size = len(trials.names)
    if covariance is None or size < 2:
        return None
    pairs = sorted({round(i) for i in np.linspace(0, size - 2, _PAIRS)})
    return CloudCurves(
        names=trials.names,
        pairs=tuple((i, i + 1) for i in pairs),
        theta=trials.theta[:_CLOUD],
        centre=trials.truth,
        covariance=covariance,
    )


def disturbance(units: Units, loop: Loop, excitation: Array) -> tuple[Table, SignalCurves]:
    """r, u_r and y_r of an excitation (n, r) of the true loop, until they have faded."""
    slowest = float(np.abs(loop.closed_poles).max(initial=0.0))
    tail = min(int(np.ceil(_FADED / (1.0 - slowest))), len(excitation))
    r = np.concatenate([excitation, np.zeros((tail, units.inputs))])
    y, u = loop.signals(r, np.zeros((len(r), units.outputs)))
    instants = units.sample_time * np.arange(len(r), dtype=np.float64)
    columns, shown = {units.time_header: instants}, {}
    for letter, cause, signals in (("r", "", r), ("u", "r", u), ("y", "r", y)):
        for number, samples in enumerate(signals.T, start=1):
            columns[f"{letter}{number}" + (f"_{cause}" if cause else "")] = samples
            shown[f"{letter}{'' if units.single else number}{cause}"] = samples
    first = "ruy" if units.single else "yur"
    return Table(columns), SignalCurves(
        instants,
        {name: shown[name] for name in sorted(shown, key=lambda name: first.index(name[0]))},
        held=False,
    )
