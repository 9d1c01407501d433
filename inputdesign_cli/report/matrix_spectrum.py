"""spectrum.png and directions.png of several inputs: eigenvalues, entries, and where the plant is weak."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.axes import Axes

from inputdesign_cli.outcome import Array, DirectionCurves, MatrixSpectrumCurves
from inputdesign_cli.report.style import (
    BLACK,
    BLUE,
    GREEN,
    GREY,
    ORANGE,
    figure,
    frequency_axis,
    legend_above,
)

COLOURS = (BLUE, ORANGE, GREEN, BLACK, GREY)
DASHED = (0, (5, 2))
# Entries of a nearly singular spectrum lie on each other: the dashes let the lower ones show through.
DASHES: tuple[Any, ...] = ("solid", (0, (4, 4)), (4, (4, 4)))
DECADES = 5.0


def draw_matrix_spectrum(curves: MatrixSpectrumCurves, path: Path, time_unit: str) -> None:
    """Eigenvalues above, moduli of the entries below, both over frequency."""
    n = curves.spectrum.shape[1]
    what = "mass" if curves.lines else r"density"
    with figure(path) as page:
        upper, lower = page.subplots(2, 1, sharex=True)
        values = np.asarray(np.linalg.eigvalsh(curves.spectrum)[:, ::-1], dtype=float)
        handles = []
        for i in range(n):
            handles += _curve(upper, curves, values[:, i], COLOURS[i % 5], rf"$\lambda_{i + 1}(\Phi_u)$")
        if curves.white is not None:
            handles.append(_white(upper, curves.white))
        _logarithmic(upper, values)
        upper.set_ylabel(f"eigenvalues, {what}")
        legend_above(upper, handles)
        handles = []
        entries = np.asarray(np.abs(curves.spectrum), dtype=float)
        for i in range(n):
            for j in range(i, n):
                colour, dashes = COLOURS[len(handles) % 5], DASHES[len(handles) % 3]
                label = rf"$|\Phi_{{{i + 1}{j + 1}}}|$"
                handles += _curve(lower, curves, entries[:, i, j], colour, label, dashes)
        _logarithmic(lower, entries)
        lower.set_ylabel(f"entries, {what}")
        frequency_axis(lower, curves.frequency, time_unit)
        legend_above(lower, handles)


def draw_directions(curves: DirectionCurves, path: Path, time_unit: str) -> None:
    """The gains of the plant above; below, the power of the input along each of its input directions."""
    with figure(path) as page:
        upper, lower = page.subplots(2, 1, sharex=True)
        n = curves.gain.shape[1]
        handles = []
        for i in range(n):
            label = rf"$\sigma_{i + 1}(G)$"
            handles += upper.plot(curves.frequency, curves.gain[:, i], color=COLOURS[i % 5], label=label)
        upper.set_yscale("log", nonpositive="mask")
        upper.set_ylabel("gains of the plant")
        legend_above(upper, handles)
        handles = []
        for i in range(n):
            label = rf"$v_{i + 1}^* \Phi_u v_{i + 1}$"
            handles += _curve(lower, curves, curves.power[:, i], COLOURS[i % 5], label)
        if curves.white is not None:
            handles.append(_white(lower, curves.white))
        _logarithmic(lower, curves.power)
        lower.set_ylabel("input along them")
        frequency_axis(lower, curves.frequency, time_unit)
        legend_above(lower, handles)


def _curve(
    axes: Axes,
    curves: MatrixSpectrumCurves | DirectionCurves,
    values: Array,
    colour: str,
    label: str,
    dashes: Any = "solid",
) -> list[Any]:
    marks: dict[str, Any] = {"linestyle": "none", "marker": "o", "markersize": 4}
    style = marks if curves.lines else {"linewidth": 1.8, "linestyle": dashes}
    return axes.plot(curves.frequency, values, color=colour, label=label, **style)


def _white(axes: Axes, level: float) -> Any:
    return axes.axhline(level, color=GREY, linestyle=DASHED, label="white, same power")


def _logarithmic(axes: Axes, values: Array) -> None:
    """A logarithmic axis over the leading decades: zeros of a spectrum would stretch it without end."""
    axes.set_yscale("log", nonpositive="mask")
    peak = float(values.max())
    low, high = axes.get_ylim()
    axes.set_ylim(max(low, peak * 10.0**-DECADES), high)
