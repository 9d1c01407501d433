"""fit.png and residuals.png: a model against the data that it was estimated from."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import product

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray

from inputdesign_cli.figures.style import BLACK, BLUE, DOTTED, GREY, ORANGE, legend_above, legend_over_all
from inputdesign_cli.outcome.curves import FitCurves, FitPanel, ResidualCurves
from inputdesign_cli.outcome.results import Array

# A record up to the first length is drawn whole, of a longer one the second number of samples.
_WHOLE, SHOWN = 600, 400
_AS_LIVELY = 0.5
_LINE = 2e-3  # the width of a curve, as a share of the height drawn


@dataclass(frozen=True)
class _Shown:
    """The samples that are drawn, and at which of them (counted from the first of these) a record begins."""

    samples: slice
    begins: NDArray[np.int64]

    @classmethod
    def of(cls, curves: FitCurves) -> _Shown:
        """Choose the samples in which the outputs move most."""
        samples = stretch([panel.y for panel in curves.panels])
        begins = np.cumsum(curves.lengths, dtype=np.int64)[:-1]
        return cls(samples, begins[(begins > samples.start) & (begins < samples.stop)] - samples.start)

    def broken(self, values: Array) -> Array:
        """Return values (n,) of all samples for drawing: no curve goes from one record to the next."""
        return np.insert(values[self.samples], self.begins, np.nan)

    def borders(self, time: Array) -> Array:
        """Between which times (n,) of all samples a record ends and another one begins: the middle."""
        own = time[self.samples]
        return 0.5 * (own[self.begins - 1] + own[self.begins])


def draw_fit(page: Figure, curves: FitCurves, time_unit: str) -> None:
    """Each output with its simulation and its one-step prediction; below a single one its residuals.

    Records are parted: no curve goes from one to the next, and their borders are marked.
    """
    single = len(curves.panels) == 1
    rows = 2 if single else len(curves.panels)
    axes = page.subplots(rows, 1, sharex=True, squeeze=False, height_ratios=[2, 1] if single else None)[:, 0]
    shown = _Shown.of(curves)
    part, size = shown.samples, curves.time.size
    unit = time_unit
    if part.stop - part.start < size:
        told = f"samples {part.start + 1} to {part.stop}" if part.start else f"first {SHOWN}"
        unit = f"{time_unit}; {told} of {size}{'' if part.start else ' samples'}"
    axes[-1].set_xlabel(f"time ({unit})")
    axes[-1].set_xlim(curves.time[part][0], curves.time[part][-1])
    time = shown.broken(curves.time)
    same = all(_coincide(panel, part) for panel in curves.panels)
    if single:
        (panel,) = curves.panels
        explained = "" if panel.fit is None else f" (fit {panel.fit:.1f} %)"
        _plot(axes[0], time, panel, shown, "y", f"simulated from u{explained}", same=same)
        axes[0].set_ylabel(panel.label or "output")
        axes[1].plot(time, shown.broken(panel.y - panel.predicted), color=BLUE, linewidth=0.8)
        axes[1].set_ylabel("residual")
    for panel, place in () if single else zip(curves.panels, axes, strict=True):
        _plot(place, time, panel, shown, "recorded", "simulated from u", same=same)
        explained = "" if panel.fit is None else f", fit {panel.fit:.1f} %"
        name = f"y{panel.output + 1}"
        place.set_title(f"{name}{explained}", loc="left", color=GREY)
        place.set_label(name)
        place.set_ylabel(panel.label or "output")
    for place, at in product(axes, shown.borders(curves.time).tolist()):
        place.axvline(at, color=GREY, linestyle=DOTTED, linewidth=1.2, label="another record begins")
    if single:
        legend_above(axes[0])
    else:
        legend_over_all(page)


def stretch(outputs: Sequence[Array]) -> slice:
    """Return the first samples of outputs (n,), or the window where they vary most, if that is far more."""
    size = len(outputs[0])
    if size <= _WHOLE:
        return slice(0, size)
    begins = np.arange(0, size - SHOWN + 1, SHOWN // 4)
    moves = np.zeros(begins.size)
    for y in outputs:
        windows = np.lib.stride_tricks.sliding_window_view(y, SHOWN)[begins]
        moves += np.nanvar(windows, axis=1) / max(float(np.nanvar(y)), 1e-300)
    best = int(np.argmax(moves))
    begin = 0 if moves[0] >= _AS_LIVELY * moves[best] else int(begins[best])
    return slice(begin, begin + SHOWN)


def _plot(
    axes: Axes, time: Array, panel: FitPanel, shown: _Shown, recorded: str, simulated: str, *, same: bool
) -> None:
    """Curves of an output; one for prediction and simulation where these are the `same` in all panels."""
    axes.plot(time, shown.broken(panel.y), color=BLACK, linewidth=1.0, label=recorded)
    label = f"predicted one step ahead, and {simulated}" if same else "predicted one step ahead"
    axes.plot(time, shown.broken(panel.predicted), color=BLUE, linewidth=1.0, label=label)
    if panel.simulated is not None and not same:
        axes.plot(time, shown.broken(panel.simulated), color=ORANGE, linewidth=1.0, label=simulated)


def _coincide(panel: FitPanel, shown: slice) -> bool:
    """Whether prediction and simulation are one curve to the eye, as where the noise is white."""
    if panel.simulated is None:
        return False
    y, predicted, simulated = panel.y[shown], panel.predicted[shown], panel.simulated[shown]
    width = _LINE * float(np.nanmax(y) - np.nanmin(y))
    return np.allclose(predicted, simulated, rtol=0.0, atol=width, equal_nan=True)


def draw_residuals(page: Figure, curves: ResidualCurves, time_unit: str) -> None:
    """Correlations of the residuals with themselves and with past inputs; 99 % bands of a right model.

    A row for every output, a column for every residual and every input.
    """
    _, p, r = curves.cross_correlation.shape
    grid = page.subplots(p, p + r, sharex=True, sharey=True, squeeze=False)
    for i in range(p):
        for j in range(p):
            _stems(grid[i][j], curves.lags, curves.autocorrelation[:, i, j], curves.limit)
        for j in range(r):
            _stems(grid[i][p + j], curves.input_lags, curves.cross_correlation[:, i, j], curves.limit)
        grid[i][0].set_ylabel(f"residual {i + 1}")
    for j, name in enumerate([f"residual {j + 1}" for j in range(p)] + [f"u{j + 1}" for j in range(r)]):
        grid[0][j].set_title(f"with {name}", color=GREY)
        grid[-1][j].set_xlabel("lag (samples)")
    page.suptitle(
        f"correlations of the residuals; probabilities\n{curves.whiteness:.2g} (among each other), "
        f"{curves.independence:.2g} (with inputs)",
        x=0.01,
        ha="left",
    )


def _stems(axes: Axes, lags: Array, values: Array, limit: float) -> None:
    axes.axhspan(-limit, limit, color=GREY, alpha=0.2, linewidth=0)
    axes.vlines(lags, 0.0, values, color=BLUE, linewidth=1.6)
    axes.plot(lags, values, "o", color=BLUE, markersize=4)
    axes.axhline(0.0, color=BLACK, linewidth=0.6)
