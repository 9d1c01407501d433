"""Captions speak of what there is in a figure."""

import numpy as np
import pytest

from inputdesign_cli.report.described import captioned
from inputdesign_cli.runs.curves import (
    BoundCurves,
    BoundPanel,
    NyquistCurves,
    PredictedPanel,
    SignalCurves,
    SpectrumCurves,
)

W = np.array([0.1, 1.0])
ONES = np.ones(2)


def bound(**entries):
    return BoundCurves((BoundPanel(W, 0.5 * ONES, ONES, **entries),))


def spectrum(**entries):
    return SpectrumCurves(W, np.ones((2, 1, 1), dtype=complex), **entries)


def nyquist(**entries):
    return NyquistCurves(W, ONES.astype(complex), ONES, **entries)


@pytest.mark.parametrize(
    ("curves", "there", "missing"),
    [
        (bound(r_adm=ONES, r_u_equal=2.0 * ONES), "white excitation that spends the same goes higher", ""),
        (bound(r_adm=ONES, r_u_equal=0.5 * ONES), "is to stay below one.", "white"),
        (bound(r_adm=ONES), "the error that the model may have", "white"),
        (bound(r_adm=ONES, label="data"), "the error that these data leave", "may have"),
        (bound(), "The error that the model may have (r_u), and the gain |G|", "below one"),
        (spectrum(white=1.0), "and white excitation for comparison", ""),
        (spectrum(), "has its power.", "white"),
        (spectrum(white=1.0, lines=True), "has its power.", "white"),
        (nyquist(circle=0.5, limiting=W), "circle about -1", ""),
        (nyquist(), "leave it.", "circle"),
        (nyquist(), "leave it.", "limiting"),
        (SignalCurves(W, {"u1": ONES}), "values are distributed.", "output"),
        (
            SignalCurves(W, {"u1": ONES}, predicted=(PredictedPanel("y1", ONES, ONES),)),
            "the output that it is to cause",
            "",
        ),
    ],
)
def test_a_caption_names_no_more_than_is_drawn(curves, there, missing):
    said = captioned(curves)
    assert there in said
    assert not missing or missing not in said
