"""fit.png and residuals.png: a model against the data that it was estimated from."""

from __future__ import annotations

from pathlib import Path

from matplotlib.artist import Artist
from matplotlib.axes import Axes

from inputdesign_cli.outcome import Array, FitCurves, ResidualCurves
from inputdesign_cli.report.style import BLACK, BLUE, GREY, ORANGE, figure, legend_above

SHOWN = 400


def draw_fit(curves: FitCurves, path: Path, time_unit: str) -> None:
    """The output with its simulation and one-step prediction above, the prediction errors below."""
    shown = slice(0, SHOWN)
    time = curves.time[shown]
    with figure(path) as page:
        upper, lower = page.subplots(2, 1, sharex=True, height_ratios=[2, 1])
        handles: list[Artist] = upper.plot(time, curves.y[shown], color=BLACK, linewidth=1.0, label="y")
        handles += upper.plot(
            time, curves.predicted[shown], color=BLUE, linewidth=1.0, label="predicted one step ahead"
        )
        if curves.simulated is not None:
            label = "simulated from u"
            if curves.fit is not None:
                label += f" (fit {curves.fit:.1f} %)"
            handles += upper.plot(time, curves.simulated[shown], color=ORANGE, linewidth=1.0, label=label)
        lower.plot(time, (curves.y - curves.predicted)[shown], color=BLUE, linewidth=0.8)
        lower.set_ylabel("residual")
        upper.set_ylabel("output")
        lower.set_xlabel(f"time ({time_unit})")
        lower.set_xlim(time[0], time[-1])
        if curves.time.size > SHOWN:
            upper.set_title(f"first {SHOWN} of {curves.time.size}", loc="right", color=GREY)
        legend_above(upper, handles)


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


def _stems(axes: Axes, lags: Array, values: Array, limit: float) -> None:
    axes.axhspan(-limit, limit, color=GREY, alpha=0.2, linewidth=0)
    axes.vlines(lags, 0.0, values, color=BLUE, linewidth=1.6)
    axes.plot(lags, values, "o", color=BLUE, markersize=4)
    axes.axhline(0.0, color=BLACK, linewidth=0.6)
