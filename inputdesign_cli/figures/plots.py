"""One entry for every figure: the type of the curves determines the drawing."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from matplotlib.figure import Figure

from inputdesign_cli.figures import estimates, frequency, records, spectrum
from inputdesign_cli.figures.style import FILE_TYPES, FileType, Width, painted, rendered
from inputdesign_cli.outcome import curves as of
from inputdesign_cli.outcome.curves import Curves
from inputdesign_cli.outcome.results import Results

# Each function draws its curves on an empty page; its last argument is the unit of time.
_DRAWN_BY: dict[type[Curves], Callable[[Figure, Any, str], None]] = {
    of.BoundCurves: frequency.draw_bound,
    of.CampaignCurves: estimates.draw_campaign,
    of.DeviationCurves: frequency.draw_deviations,
    of.DirectionCurves: spectrum.draw_directions,
    of.EllipseCurves: estimates.draw_ellipses,
    of.EstimateCurves: estimates.draw_estimates,
    of.ErrorBandCurves: frequency.draw_error_bands,
    of.ErrorCurves: estimates.draw_error,
    of.FanCurves: frequency.draw_fan,
    of.FitCurves: records.draw_fit,
    of.MomentsCurves: estimates.draw_moments,
    of.NyquistCurves: frequency.draw_nyquist,
    of.OptimalityCurves: spectrum.draw_optimality,
    of.OrderCurves: estimates.draw_orders,
    of.RunCurves: estimates.draw_runs,
    of.ResidualCurves: records.draw_residuals,
    of.ResponseCurves: frequency.draw_response,
    of.SignalCurves: records.draw_signal,
    of.SpectrumCurves: spectrum.draw_spectrum,
    of.TradeCurves: estimates.draw_trade,
}


def painter(curves: Curves, time_unit: str = "s") -> Callable[[Figure], None]:
    """Return the function that draws curves on a page; frequencies are labelled in rad per `time_unit`."""
    return lambda page: _DRAWN_BY[type(curves)](page, curves, time_unit)


def draw(curves: Curves, time_unit: str = "s", file_type: FileType = "png", width: Width = "page") -> bytes:
    """Return the figure of curves as a file, see `rendered`."""
    return rendered(painter(curves, time_unit), file_type, width=width)


def figure(results: Results, name: str) -> Figure:
    """Return a figure of a run, by its name ("bound"), as a matplotlib object to show or change.

    Raises:
        KeyError: the run has no such figure; the message names all that it has.
    """
    if name not in results.curves:
        raise KeyError(f"this run has no figure {name!r}: there are {', '.join(results.curves) or 'none'}")
    return painted(painter(results.curves[name], results.time_unit))


def draw_all(results: Results, file_type: str = "png", width: Width = "page") -> dict[str, bytes]:
    """Return the figures of a run by their file names: bound.png, spectrum.png, .., or in another format."""
    kind, unit = FILE_TYPES[file_type], results.time_unit
    return {f"{stem}.{kind}": draw(curves, unit, kind, width) for stem, curves in results.curves.items()}
