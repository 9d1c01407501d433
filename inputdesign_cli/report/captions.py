"""Captions of figures: what the curves of each kind show."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

import numpy as np

from inputdesign_cli.figures.fan import MOST_NAMED
from inputdesign_cli.outcome import curves as of
from inputdesign_cli.outcome.curves import Curves

OF_DATA = "data"  # what r_u of an estimate is called


def captioned(curves: Curves) -> str:
    """Return the caption, which depends on the curves in this figure."""
    found = _CAPTIONS[type(curves)]
    return found if isinstance(found, str) else found(curves)


def _bound_caption(curves: of.BoundCurves) -> str:
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
        + (" At the plant of the spec; at others it may be higher." if curves.of_several else "")
    )


def _nyquist_caption(curves: of.NyquistCurves) -> str:
    circle = "" if curves.circle is None else ", and the circle about -1 that it is to keep off"
    limiting = " The limiting frequencies are those at which a disc touches what is admitted."
    return f"The loop C G with the discs in which the data leave it{circle}." + limiting * bool(
        curves.limiting.size
    )


def _spectrum_caption(curves: of.SpectrumCurves) -> str:
    white = "" if curves.white is None or curves.lines else ", and white excitation for comparison"
    return f"Where in frequency the excitation has its power{white}."


def _signal_caption(curves: of.SignalCurves) -> str:
    if not curves.predicted:
        return "The signal to apply (signal.csv), and how its values are distributed."
    return (
        "The signal to apply (signal.csv), how its values are distributed, and the output that it is to "
        "cause, with two standard deviations of noise."
    )


def _fan_caption(curves: of.FanCurves) -> str:
    binding = len(curves.active)
    named = "those that bind" if binding <= MOST_NAMED else f"{MOST_NAMED} of the {binding} that bind"
    return (
        "How near every plant that the true one might be comes to what is admitted: r_u / r_adm at each, "
        f"{named} in colour. The plants are those that the uncertainty of the spec describes, each with no "
        "less than its floor admitted; nothing is said of the true plant."
    )


def _fit_caption(curves: of.FitCurves) -> str:
    several = " Dotted lines part the records." if len(curves.lengths) > 1 else ""
    return f"The recorded outputs, predicted one step ahead, and simulated from the input alone.{several}"


def _orders_caption(curves: of.OrderCurves) -> str:
    which = "" if curves.output is None else f" for y{curves.output + 1}"
    if not curves.unseen:
        return (
            f"How well each structure that was tried{which} simulates the record that it is estimated from."
        )
    return (
        f"How well each structure that was tried{which}, estimated on one part of the record, simulates the "
        "other."
    )


# Every kind has its caption.
_CAPTIONS: Mapping[type[Curves], str | Callable[[Any], str]] = {
    of.BoundCurves: _bound_caption,
    of.CampaignCurves: (
        "The worst ratio at the estimate and the energy applied, after each part of the campaign."
    ),
    of.CloudCurves: "The estimates of all runs, with the ellipses of theory.",
    of.DeviationCurves: (
        "The standard deviation of the measured frequency response at every line, against what is admitted."
    ),
    of.DirectionCurves: (
        "The gains of the plant, and how the design shares its power among their directions."
    ),
    of.EllipseCurves: "The confidence ellipses that the design buys, for pairs of parameters.",
    of.ErrorBandCurves: "The errors |G_hat - G_0| of the models of all runs, against r_u and r_adm.",
    of.ErrorCurves: ("The mean squared error against the energy of the regressors, bias and variance apart."),
    of.EstimateCurves: ("The estimates after each part of the campaign, with two standard deviations."),
    of.FanCurves: _fan_caption,
    of.FitCurves: _fit_caption,
    of.LossCurves: "The loss in simulated experiments.",
    of.MomentsCurves: "The second moments of the regressors.",
    of.NyquistCurves: _nyquist_caption,
    of.OptimalityCurves: (
        "The certificate of the bound over every spectrum: what a unit of cost buys at each frequency, "
        "relative to the best. It is nowhere above one, and one where power pays."
    ),
    of.OrderCurves: _orders_caption,
    of.RatioCurves: (
        "The largest r_u / r_adm of the true plant in simulated campaigns and in experiments in one shot: "
        "beyond one what is asked is missed, far below one power was wasted."
    ),
    of.ResidualCurves: (
        "Correlations of the residuals with themselves and with past inputs; chance leaves them within the "
        "grey."
    ),
    of.ResponseCurves: (
        "What the data say of G without a model, with the range that holds |G| with 95 % at each frequency, "
        "beside the model. Chance takes a right model out of the range, too, at up to 5 % of the frequencies."
    ),
    of.SignalCurves: _signal_caption,
    of.SpectrumCurves: _spectrum_caption,
    of.TradeCurves: (
        "What campaigns and experiments in one shot cost, against the share of runs whose model is within "
        "r_adm of the true plant. Costs are over that of the spectrum of the design that knows the plant; "
        "the record that such a design delivers costs something else (dotted)."
    ),
}
