"""predicted_output.csv: what the record causes at the outputs, and how much noise is to be expected there."""

from __future__ import annotations

import numpy as np

from inputdesign_cli.arrays import Array
from inputdesign_cli.information import Experiment, FiniteRecord
from inputdesign_cli.outcome.curves import PredictedPanel
from inputdesign_cli.outcome.results import Table
from inputdesign_cli.outcome.units import Units

# Noise whose deviation has grown by less than this in the second half of the record stands still.
_SETTLED = 0.02


def predicted_output(
    units: Units, experiment: Experiment, record: Array, output_limits: Array | None = None
) -> tuple[Table, tuple[PredictedPanel, ...]]:
    """What samples (n, r) cause from rest, with the standard deviation of the noise beside it.

    Args:
        output_limits: (p,) of |y|, for the figure.
    """
    n = len(record)
    y = FiniteRecord(experiment, n, units.step).signals("output", record)
    noise = noise_deviation(experiment, n, units.step)
    columns: dict[str, Array] = {units.time_header: units.sample_time * np.arange(n, dtype=np.float64)}
    panels = []
    for i in range(units.outputs):
        name = f"y{i + 1}"
        most = None if output_limits is None else float(output_limits[i])
        limits = None if most is None else (-most, most)
        panels.append(PredictedPanel(name, y[:, i], noise[:, i], limits, units.label(name)))
        columns |= {units.header(name): y[:, i], f"{name}_noise_deviation": noise[:, i]}
    return Table(columns), tuple(panels)


def noise_deviation(experiment: Experiment, samples: int, step: float) -> Array:
    """(n, p): standard deviations of the noise at the outputs, in the loop where there is one.

    From the response to an impulse of e, whose squares add up. Noise that settles within the record has been
    there before; one that drifts grows from the start on.

    Args:
        step: time between samples in the unit of the experiment's frequencies.
    """
    model, p = experiment.model, experiment.model.outputs
    e = np.zeros((p, samples, p))
    e[:, 0] = np.linalg.cholesky(model.covariance).T
    rest = np.zeros((p, samples, model.inputs))
    caused = (
        model.simulate(rest, e, step)[1] if experiment.loop is None else experiment.loop.signals(rest, e)[0]
    )
    grown = np.sqrt(np.cumsum(np.sum(caused**2, axis=0), axis=0))
    still = grown[samples // 2] >= (1.0 - _SETTLED) * grown[-1]
    return np.where(still, grown[-1], grown)
