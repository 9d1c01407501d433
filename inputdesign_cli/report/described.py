"""What a figure shows: captions that speak of what is drawn, and sentences for those who do not see it."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

import numpy as np

from inputdesign_cli.runs.curves import (
    BoundCurves,
    Curves,
    FanCurves,
    NyquistCurves,
    OptimalityCurves,
    SignalCurves,
    SpectrumCurves,
)

OF_DATA = "data"  # what r_u of an estimate is called


def described(curves: Curves, time_unit: str) -> str | None:
    """The sentence, frequencies in rad per `time_unit`; None where the caption says as much."""
    tell = _TOLD.get(type(curves))
    return None if tell is None else tell(curves, f"rad/{time_unit}")


def captioned(curves: Curves) -> str | None:
    """The caption, of what there is in this figure; None where one caption does for all of its kind."""
    tell = _CAPTIONED.get(type(curves))
    return None if tell is None else tell(curves)


def _bound_caption(curves: BoundCurves) -> str:
    error = "the error that the model may have (r_u)"
    if curves.panels[0].label == OF_DATA:
        error = "the error that these data leave (r_u)"
    designed, white = [0.0], [0.0]
    for panel in curves.panels:
        if panel.r_adm is None:
            return f"{error[0].upper()}{error[1:]}, and the gain |G|, against frequency."
        designed.append(float(np.nanmax(panel.r_u / panel.r_adm)))
        if panel.r_u_equal is not None:
            white.append(float(np.nanmax(panel.r_u_equal / panel.r_adm)))
    told = "; white excitation that spends the same goes higher" if max(white) > max(designed) else ""
    return (
        f"Above: {error} against the error that is admitted (r_adm). Below: their ratio, which is to stay "
        f"below one{told}."
    )


def _nyquist_caption(curves: NyquistCurves) -> str:
    circle = "" if curves.circle is None else ", and the circle about -1 that it is to keep off"
    limiting = " The limiting frequencies are those at which a disc touches what is admitted."
    return f"The loop C G with the discs in which the data leave it{circle}." + limiting * bool(
        curves.limiting.size
    )


def _spectrum_caption(curves: SpectrumCurves) -> str:
    white = "" if curves.white is None or curves.lines else ", and white excitation for comparison"
    return f"Where in frequency the excitation has its power{white}."


def _signal_caption(curves: SignalCurves) -> str:
    if not curves.predicted:
        return "The signal to apply (signal.csv), and how its values are distributed."
    return (
        "The signal to apply (signal.csv), how its values are distributed, and the output that it is to "
        "cause, with two standard deviations of noise."
    )


def _bound(curves: BoundCurves, unit: str) -> str:
    stated = [panel for panel in curves.panels if panel.r_adm is not None]
    if not stated:
        return "Model error r_u and the gain |G| against frequency."
    worst = max(float(np.nanmax(panel.r_u / panel.r_adm)) for panel in stated if panel.r_adm is not None)
    return f"Model error r_u and admissible error r_adm against frequency; the largest ratio is {worst:.6g}."


def _nyquist(curves: NyquistCurves, unit: str) -> str:
    nearest = float((np.abs(1.0 + curves.loop) - curves.radius).min())
    told = f", of which {curves.circle:.4g} is asked" if curves.circle is not None else ""
    return (
        "Nyquist plot of the loop C G with the discs in which the data leave it: they stay "
        f"{nearest:.4g} away from -1{told}."
    )


def _spectrum(curves: SpectrumCurves, unit: str) -> str:
    power = np.trace(curves.spectrum, axis1=1, axis2=2).real
    peak = float(curves.frequency[int(np.argmax(power))])
    if curves.lines:
        return f"Powers of {power.size} sinusoids against frequency, the largest at {peak:.3g} {unit}."
    return f"Spectral density of the excitation against frequency, with its peak at {peak:.3g} {unit}."


def _optimality(curves: OptimalityCurves, unit: str) -> str:
    return f"Worth of a unit of cost against frequency; its maximum is {curves.ratio.max():.4g}."


def _signal(curves: SignalCurves, unit: str) -> str:
    names = ", ".join(panel.name for panel in curves.predicted)
    below = f" Below: the output to be expected of {names}." if names else ""
    return f"The signal {', '.join(curves.channels)} against time, and the distribution of its values.{below}"


def _fan(curves: FanCurves, unit: str) -> str:
    worst = max(float(np.max(curves.ratios, initial=0.0)), float(curves.nominal.max()))
    return f"r_u / r_adm against frequency at {len(curves.ratios)} plants; the largest is {worst:.4g}."


_CAPTIONED: Mapping[type[Curves], Callable[[Any], str]] = {
    BoundCurves: _bound_caption,
    NyquistCurves: _nyquist_caption,
    SignalCurves: _signal_caption,
    SpectrumCurves: _spectrum_caption,
}
_TOLD: Mapping[type[Curves], Callable[[Any, str], str]] = {
    BoundCurves: _bound,
    FanCurves: _fan,
    NyquistCurves: _nyquist,
    OptimalityCurves: _optimality,
    SignalCurves: _signal,
    SpectrumCurves: _spectrum,
}
