"""One entry for every figure: the type of the curves decides what is drawn."""

from __future__ import annotations

from pathlib import Path

from inputdesign_cli.outcome import BoundCurves, OptimalityCurves, SignalCurves, SpectrumCurves
from inputdesign_cli.report.bound import draw_bound
from inputdesign_cli.report.optimality import draw_optimality
from inputdesign_cli.report.signal import draw_signal
from inputdesign_cli.report.spectrum import draw_spectrum

Curves = SpectrumCurves | BoundCurves | OptimalityCurves | SignalCurves


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
        case BoundCurves():
            draw_bound(curves, path, time_unit)
        case OptimalityCurves():
            draw_optimality(curves, path, time_unit)
        case SignalCurves():
            draw_signal(curves, path, time_unit)
