"""One entry for every figure: the type of the curves decides what is drawn."""

from __future__ import annotations

from pathlib import Path

from inputdesign_cli.figures.bound import draw_bound
from inputdesign_cli.figures.channels import draw_channel_bounds
from inputdesign_cli.figures.data import draw_channel_fit, draw_channel_residuals, draw_fit, draw_residuals
from inputdesign_cli.figures.ellipses import draw_ellipses
from inputdesign_cli.figures.error import draw_error
from inputdesign_cli.figures.loss import draw_loss
from inputdesign_cli.figures.matrix_spectrum import draw_directions, draw_matrix_spectrum
from inputdesign_cli.figures.moments import draw_moments
from inputdesign_cli.figures.optimality import draw_optimality
from inputdesign_cli.figures.signal import draw_signal
from inputdesign_cli.figures.spectrum import draw_spectrum
from inputdesign_cli.figures.trials import draw_channel_error_bands, draw_cloud, draw_error_bands
from inputdesign_cli.runs.results import (
    BoundCurves,
    ChannelBoundCurves,
    ChannelErrorBandCurves,
    ChannelFitCurves,
    ChannelResidualCurves,
    CloudCurves,
    Curves,
    DirectionCurves,
    EllipseCurves,
    ErrorBandCurves,
    ErrorCurves,
    FitCurves,
    LossCurves,
    MatrixSpectrumCurves,
    MomentsCurves,
    OptimalityCurves,
    ResidualCurves,
    SignalCurves,
    SpectrumCurves,
)


def draw(curves: Curves, path: Path, time_unit: str = "s") -> None:
    """Draw `curves` to `path` as a PNG of 7 by 4.5 inches; frequencies are labelled rad per `time_unit`.

    Raises
    ------
    OSError
        `path` cannot be written.
    """
    match curves:
        case SpectrumCurves():
            draw_spectrum(curves, path, time_unit)
        case MatrixSpectrumCurves():
            draw_matrix_spectrum(curves, path, time_unit)
        case DirectionCurves():
            draw_directions(curves, path, time_unit)
        case LossCurves():
            draw_loss(curves, path)
        case BoundCurves():
            draw_bound(curves, path, time_unit)
        case OptimalityCurves():
            draw_optimality(curves, path, time_unit)
        case SignalCurves():
            draw_signal(curves, path, time_unit)
        case ErrorCurves():
            draw_error(curves, path)
        case MomentsCurves():
            draw_moments(curves, path, time_unit)
        case ChannelBoundCurves():
            draw_channel_bounds(curves, path, time_unit)
        case EllipseCurves():
            draw_ellipses(curves, path)
        case CloudCurves():
            draw_cloud(curves, path)
        case ErrorBandCurves():
            draw_error_bands(curves, path, time_unit)
        case ChannelErrorBandCurves():
            draw_channel_error_bands(curves, path, time_unit)
        case ChannelFitCurves():
            draw_channel_fit(curves, path, time_unit)
        case ChannelResidualCurves():
            draw_channel_residuals(curves, path)
        case FitCurves():
            draw_fit(curves, path, time_unit)
        case ResidualCurves():
            draw_residuals(curves, path)
