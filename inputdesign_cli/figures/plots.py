"""One entry for every figure: the type of the curves decides what is drawn."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from matplotlib.figure import Figure

from inputdesign_cli.figures.bound import draw_bound
from inputdesign_cli.figures.campaign import draw_campaign, draw_estimates, draw_trade, draw_true_ratio
from inputdesign_cli.figures.data import draw_fit, draw_residuals
from inputdesign_cli.figures.deviations import draw_deviations
from inputdesign_cli.figures.ellipses import draw_ellipses
from inputdesign_cli.figures.exploration import draw_orders
from inputdesign_cli.figures.fan import draw_fan
from inputdesign_cli.figures.moments import draw_error, draw_moments
from inputdesign_cli.figures.nyquist import draw_nyquist
from inputdesign_cli.figures.response import draw_response
from inputdesign_cli.figures.signal import draw_signal
from inputdesign_cli.figures.spectrum import draw_directions, draw_optimality, draw_spectrum
from inputdesign_cli.figures.style import FILE_TYPES, FileType, painted, rendered
from inputdesign_cli.figures.trials import draw_cloud, draw_error_bands, draw_loss
from inputdesign_cli.outcome import curves as of
from inputdesign_cli.outcome.curves import Curves
from inputdesign_cli.outcome.results import Results

# Each draws its curves on an empty page; the text is the unit of time.
_DRAWN_BY: dict[type[Curves], Callable[[Figure, Any, str], None]] = {
    of.BoundCurves: draw_bound,
    of.CampaignCurves: draw_campaign,
    of.CloudCurves: draw_cloud,
    of.DeviationCurves: draw_deviations,
    of.DirectionCurves: draw_directions,
    of.EllipseCurves: draw_ellipses,
    of.EstimateCurves: draw_estimates,
    of.ErrorBandCurves: draw_error_bands,
    of.ErrorCurves: draw_error,
    of.FanCurves: draw_fan,
    of.FitCurves: draw_fit,
    of.LossCurves: draw_loss,
    of.MomentsCurves: draw_moments,
    of.NyquistCurves: draw_nyquist,
    of.OptimalityCurves: draw_optimality,
    of.OrderCurves: draw_orders,
    of.RatioCurves: draw_true_ratio,
    of.ResidualCurves: draw_residuals,
    of.ResponseCurves: draw_response,
    of.SignalCurves: draw_signal,
    of.SpectrumCurves: draw_spectrum,
    of.TradeCurves: draw_trade,
}


def painter(curves: Curves, time_unit: str = "s") -> Callable[[Figure], None]:
    """Return what draws curves on an empty page; frequencies are labelled rad per `time_unit`."""
    return lambda page: _DRAWN_BY[type(curves)](page, curves, time_unit)


def draw(curves: Curves, time_unit: str = "s", file_type: FileType = "png") -> bytes:
    """Return the figure of curves as a file, see `rendered`."""
    return rendered(painter(curves, time_unit), file_type)


def figure(results: Results, name: str) -> Figure:
    """Return a figure of a run, by its name ("bound"), as a matplotlib object to show or change.

    Raises:
        KeyError: the run has no such figure.
    """
    return painted(painter(results.curves[name], results.time_unit))


def draw_all(results: Results, file_type: str = "png") -> dict[str, bytes]:
    """Return the figures of a run by their file names: bound.png, spectrum.png, .., or in another format."""
    kind = FILE_TYPES[file_type]
    return {
        f"{stem}.{kind}": draw(curves, results.time_unit, kind) for stem, curves in results.curves.items()
    }
