"""Captions speak of what there is in a figure."""

from dataclasses import replace

import numpy as np
import pytest

from inputdesign_cli.outcome.curves import (
    BoundCurves,
    BoundPanel,
    Curves,
    FanCurves,
    FitCurves,
    NyquistCurves,
    OrderCurves,
    PredictedPanel,
    SignalCurves,
    SpectrumCurves,
)
from inputdesign_cli.outcome.curves_file import curves_json
from inputdesign_cli.outcome.record import FIGURES
from inputdesign_cli.report.charts import captioned, run_charts
from tests.support.curves import CURVES

# What was told of figures of which nobody knows what they show.
PLACEHOLDER = "The figure"
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
        (bound(r_adm=ONES), "which is to stay below one.", "plant of the spec"),
        (replace(bound(r_adm=ONES), of_several=True), "At the plant of the spec; at others", "white"),
        (bound(), "The error that the model may have (r_u), and the gain |G|", "below one"),
        (spectrum(white=1.0), "and white excitation for comparison", ""),
        (spectrum(), "has its power.", "white"),
        (spectrum(white=1.0, lines=True), "has its power.", "white"),
        (nyquist(circle=0.5, limiting=W), "circle about -1", ""),
        (nyquist(), "leave it.", "circle"),
        (nyquist(), "leave it.", "limiting"),
        (FitCurves(W, (), (1, 1)), "Dotted lines part the records", ""),
        (FitCurves(W, (), (2,)), "from the input alone.", "Dotted"),
        (OrderCurves({}, (1.0, 2.0), "ARX", 1), "was tried for y2, estimated on one part", ""),
        (OrderCurves({}, (1.0, 2.0), "ARX"), "was tried, estimated on one part", "y1"),
        (
            OrderCurves({}, (1.0, 2.0), "ARX", unseen=False),
            "the record that it is estimated from",
            "one part",
        ),
        (FanCurves(W, ONES[None], ONES, dict.fromkeys("abc", ONES)), "the binding plants in colour", "5 of"),
        (
            FanCurves(W, ONES[None], ONES, dict.fromkeys("abcdefg", ONES)),
            "each, 5 of the 7 binding plants in colour",
            "each, the binding",
        ),
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


def test_every_kind_of_figure_has_a_caption():
    """Whatever a run calls its files."""
    assert {type(one) for one in CURVES.values()} == set(Curves.__subclasses__())
    for curves in CURVES.values():
        assert not captioned(curves).startswith(PLACEHOLDER)


@pytest.mark.parametrize(
    ("stem", "name", "said"),
    [
        ("structures_2", "structures", "for y2"),
        ("data_fit", "fit", "predicted one step ahead"),
        ("errors_white", "error bands", "r_adm: white."),
        ("cloud_shift_register", "cloud", "theory: shift register."),
        ("disturbance_design", "signal", "does to the loop: design."),
        ("frequency_response", "response without a model", "at up to 5 % of the frequencies"),
    ],
)
def test_figures_of_a_run_are_captioned_by_what_they_show(stem, name, said, tmp_path):
    (tmp_path / FIGURES).write_bytes(curves_json({stem: CURVES[name]}))
    chart = run_charts(tmp_path, "s")[stem]
    assert said in chart.caption
