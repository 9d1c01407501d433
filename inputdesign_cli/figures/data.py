"""fit.png and residuals.png: a model against the data that it was estimated from."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from matplotlib.artist import Artist
from matplotlib.axes import Axes

from inputdesign_cli.figures.style import BLACK, BLUE, GREY, ORANGE, figure, legend_above
from inputdesign_cli.runs.results import (
    Array,
    ChannelFitCurves,
    ChannelResidualCurves,
    FitCurves,
    ResidualCurves,
)

SHOWN = 400


def draw_fit(curves: FitCurves, path: Path, time_unit: str) -> None:
    """The output with its simulation and one-step prediction above, the prediction errors below."""
    with figure(path) as page:
        upper, lower = page.subplots(2, 1, sharex=True, height_ratios=[2, 1])
        explained = "" if curves.fit is None else f" (fit {curves.fit:.1f} %)"
        handles = _outputs(upper, curves, "y", f"simulated from u{explained}")
        shown = slice(0, SHOWN)
        lower.plot(curves.time[shown], (curves.y - curves.predicted)[shown], color=BLUE, linewidth=0.8)
        lower.set_ylabel("residual")
        upper.set_ylabel("output")
        _time_axis(lower, curves, time_unit)
        _tell_part(upper, curves)
        legend_above(upper, handles)


def draw_channel_fit(curves: ChannelFitCurves, path: Path, time_unit: str) -> None:
    """A panel for every output, with its simulation and its one-step prediction."""
    with figure(path) as page:
        panels = page.subplots(len(curves.outputs), 1, sharex=True, squeeze=False)[:, 0]
        handles: list[Artist] = []
        for axes, (name, output) in zip(panels, curves.outputs.items(), strict=True):
            handles = max(handles, _outputs(axes, output, "recorded", "simulated from u"), key=len)
            explained = "" if output.fit is None else f", fit {output.fit:.1f} %"
            axes.set_title(f"{name}{explained}", loc="left", color=GREY)
        first = next(iter(curves.outputs.values()))
        _tell_part(panels[0], first)
        _time_axis(panels[-1], first, time_unit)
        page.legend(handles=handles, loc="outside upper left", ncols=len(handles))


def _outputs(axes: Axes, curves: FitCurves, recorded: str, simulated: str) -> list[Artist]:
    shown = slice(0, SHOWN)
    time = curves.time[shown]
    handles: list[Artist] = []
    handles += axes.plot(time, curves.y[shown], color=BLACK, linewidth=1.0, label=recorded)
    handles += axes.plot(
        time, curves.predicted[shown], color=BLUE, linewidth=1.0, label="predicted one step ahead"
    )
    if curves.simulated is not None:
        handles += axes.plot(time, curves.simulated[shown], color=ORANGE, linewidth=1.0, label=simulated)
    return handles


def _time_axis(axes: Axes, curves: FitCurves, time_unit: str) -> None:
    axes.set_xlabel(f"time ({time_unit})")
    axes.set_xlim(curves.time[0], curves.time[:SHOWN][-1])


def _tell_part(axes: Axes, curves: FitCurves) -> None:
    if curves.time.size > SHOWN:
        axes.set_title(f"first {SHOWN} of {curves.time.size}", loc="right", color=GREY)


def draw_residuals(curves: ResidualCurves, path: Path) -> None:
    """Correlations of the residuals with themselves and with past inputs; 99 % bands of a right model."""
    with figure(path) as page:
        upper, lower = page.subplots(2, 1)
        _stems(upper, curves.lags, curves.autocorrelation, curves.limit)
        upper.set_ylabel("with themselves")
        upper.set_title(f"correlations of the residuals; probability {curves.whiteness:.2g}", loc="left")
        _stems(lower, curves.input_lags, curves.cross_correlation, curves.limit)
        lower.set_ylabel("with past inputs")
        lower.set_title(f"probability {curves.independence:.2g}", loc="left")
        lower.set_xlabel("lag (samples)")


def draw_channel_residuals(curves: ChannelResidualCurves, path: Path) -> None:
    """A row for every output: its residuals' correlations with all residuals, and with all past inputs."""
    _, p, r = curves.cross_correlation.shape
    with figure(path) as page:
        grid: Any = page.subplots(p, p + r, sharex=True, sharey=True, squeeze=False)
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
            f"correlations of the residuals; probabilities {curves.whiteness:.2g} (among each other), "
            f"{curves.independence:.2g} (with inputs)",
            fontsize=10,
        )


def _stems(axes: Axes, lags: Array, values: Array, limit: float) -> None:
    axes.axhspan(-limit, limit, color=GREY, alpha=0.2, linewidth=0)
    axes.vlines(lags, 0.0, values, color=BLUE, linewidth=1.6)
    axes.plot(lags, values, "o", color=BLUE, markersize=4)
    axes.axhline(0.0, color=BLACK, linewidth=0.6)
