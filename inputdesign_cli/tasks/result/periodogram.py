"""The record over its design: smoothed periodograms, and the model error that it buys itself."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from inputdesign_cli.accuracy import error_bound
from inputdesign_cli.information import Experiment
from inputdesign_cli.plant.polynomial import Array
from inputdesign_cli.runs.results import BoundCurves, SpectrumCurves, Table
from inputdesign_cli.signal.single import record_information
from inputdesign_cli.specification import Spec
from inputdesign_cli.tasks.result.curves import frequency_header


def with_periodogram(
    table: Table, curves: SpectrumCurves, spec: Spec, samples: Array
) -> tuple[Table, SpectrumCurves]:
    """The spectrum with the smoothed periodogram of the record over it; lines are left as they are."""
    if curves.density is None:
        return table, curves
    w, smooth = smoothed_periodogram(samples, spec.sample_time)
    record = np.interp(table.columns[frequency_header(spec)], w, smooth)
    shown = np.interp(curves.frequency, w, smooth)
    return Table({**table.columns, "phi_record": record}), replace(curves, record=shown)


def smoothed_periodogram(samples: Array, step: float) -> tuple[Array, Array]:
    """Frequencies in rad per unit of the `step`, and the smoothed periodogram there of samples (n,)."""
    periodogram = np.abs(np.fft.rfft(samples)) ** 2 / samples.size
    reach = int(samples.size**0.4 / 4)
    window = np.ones(2 * reach + 1) / (2 * reach + 1)
    smooth = np.convolve(np.pad(periodogram, reach, mode="reflect"), window, mode="valid")
    return 2 * np.pi * np.arange(periodogram.size) / samples.size / step, smooth


def with_record(
    curves: BoundCurves, spec: Spec, experiment: Experiment, alpha: float, samples: Array
) -> BoundCurves:
    """The model error with that of the record itself."""
    (panel,) = curves.panels
    try:
        information = record_information(experiment, samples)
        r_u = error_bound(experiment, information, alpha, panel.frequency * spec.sample_time)
    except np.linalg.LinAlgError:  # the record does not excite every parameter
        return curves
    return BoundCurves((replace(panel, r_u_record=r_u),))
