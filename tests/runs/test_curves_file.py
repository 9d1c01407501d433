"""figures.json: what figures show comes back as it was, of every kind."""

from dataclasses import fields, is_dataclass

import numpy as np
import pytest

from inputdesign_cli.errors import DataError
from inputdesign_cli.figures.plots import draw
from inputdesign_cli.runs import curves as of
from inputdesign_cli.runs.curves import Curves
from inputdesign_cli.runs.curves_file import curves_json, read_curves
from inputdesign_cli.runs.record import FIGURES

W = np.geomspace(1e-3, 3.0, 25)
RATIO = np.where(W < 1e-2, np.nan, 1.0 / (1.0 + W))
DISC = of.ResponsePanel(W, 1.0 / (1.0 + 1j * W), 0.1 * W, 1.0 / (1.0 + 1.1j * W), (0, 1), "valve, level")
MADE = [
    of.SpectrumCurves(W, (W[:, None, None] * np.eye(2)).astype(complex), white=0.5, band=(1e-3, 2.0)),
    of.DirectionCurves(W, np.stack([W, 2 * W], 1), np.stack([2 * W, W], 1)),
    of.LossCurves({"design": W, "white": 2 * W}, {"design": 0.5}),
    of.BoundCurves((of.BoundPanel(W, 1e-40 * W, W, RATIO, active=W[3:5], entry=(0, 0), names="x"),)),
    of.NyquistCurves(W, 1.0 / (1j * W), W, 0.5, W[:1]),
    of.ResponseCurves((DISC, DISC)),
    of.DeviationCurves((of.DeviationPanel(W, W, W, W, None, "design"),)),
    of.OptimalityCurves(W, W / 3.0, W[-1:]),
    of.FanCurves(W, np.stack([W, 2 * W]), W, {"plant 2": 2 * W}),
    of.CampaignCurves(W[:3], W[:3], W[:3], 200),
    of.EstimateCurves(W[:3], {"b1": W[:3]}, {"b1": W[:3]}),
    of.RatioCurves({"campaign": W, "one_shot": 2 * W}),
    of.TradeCurves({"campaign": (1.0, 0.9, 1.1, 0.95, 0.9, 0.99)}),
    of.EllipseCurves((of.Ellipse(("b1", "f1"), np.ones(2), np.eye(2)),), 0.9),
    of.CloudCurves(("b1", "f1"), ((0, 1),), np.stack([W, W], 1), np.ones(2), np.eye(2)),
    of.ErrorBandCurves((of.ErrorBandPanel(W, {0.05: W, 0.5: 2 * W, 0.95: 3 * W}, W, W),), "white", 100),
    of.FitCurves(W, (of.FitPanel(W, W, None, 90.0, 1, "level (m)"),)),
    of.ResidualCurves(W, W[:, None, None], W, W[:, None, None], 0.2, 0.5, 0.6),
    of.OrderCurves({"ARX": (W[:3], W[:3])}, (2.0, 90.0)),
    of.SignalCurves(W, {"u1": W}, {"u1": (-1.0, 1.0)}, {"u1": "valve (%)"}, (of.PredictedPanel("y1", W, W),)),
    of.ErrorCurves(W, W, W, W, (1.0, 2.0), None),
    of.MomentsCurves(np.eye(2), 1, W, W),
]


def same(one, other):
    """Whether two values are of one kind, and equal to the digits that a figure shows."""
    if is_dataclass(one):
        return type(one) is type(other) and all(
            same(getattr(one, field.name), getattr(other, field.name)) for field in fields(one)
        )
    if isinstance(one, np.ndarray):
        alike = one.dtype == other.dtype and one.shape == other.shape
        return alike and np.allclose(one, other, rtol=2e-7, atol=0.0, equal_nan=True)
    if isinstance(one, dict):
        return list(one) == list(other) and all(same(one[key], other[key]) for key in one)
    if isinstance(one, tuple):
        return len(one) == len(other) and all(map(same, one, other))
    return one == other and type(one) is type(other)


def test_every_kind_is_tried():
    assert {type(one) for one in MADE} == set(Curves.__subclasses__())


@pytest.mark.parametrize("made", MADE, ids=lambda one: type(one).__name__)
def test_what_a_figure_shows_comes_back_and_is_drawn_alike(made, tmp_path):
    (tmp_path / FIGURES).write_bytes(curves_json({"it": made}))
    found = read_curves(tmp_path)["it"]
    assert same(made, found)
    assert draw(found, "s", "svg").startswith(b"<?xml")


@pytest.mark.parametrize(
    "content",
    [b"", b"[]", b'{"a": 1}', b'{"a": {}}', b'{"a": {"kind": "Path"}}', b'{"a": {"kind": "LossCurves"}}',
     b'{"a": {"kind": "ErrorCurves", "energy": "x"}}', b'{"a": {"kind": "BoundCurves", "panels": [3]}}'],
)  # fmt: skip
def test_what_is_no_such_file_is_told_by_its_name(content, tmp_path):
    (tmp_path / FIGURES).write_bytes(content)
    with pytest.raises(DataError, match=r"figures\.json") as caught:
        read_curves(tmp_path)
    assert caught.value.diagnostics[0].code == "run-unreadable"


def test_a_run_of_an_older_version_has_none(tmp_path):
    assert read_curves(tmp_path) == {}
