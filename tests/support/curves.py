"""Curves of every kind by name: typical ones of runs, and extreme ones."""

from dataclasses import replace

import numpy as np

from inputdesign_cli.outcome import curves as c

W = np.geomspace(1e-3, np.pi, 200)
Z = np.exp(-1j * W)
G = np.abs(3.6 * Z / (1 - 0.7 * Z))
DENSITY = 0.03 + 2.5 * np.exp(-((W / 0.22) ** 2))
PAIR = DENSITY[:, None, None] * np.array([[1.0, 0.9j], [-0.9j, 1.0]])


def bound(*panels):
    return c.BoundCurves(tuple(panels))


def one_input(values, *more, **settings):
    """Curves of the spectrum of one input from real values (n,)."""
    return c.SpectrumCurves(W, values[:, None, None], *more, **settings)


def lines(frequencies, powers, **settings):
    """Curves of sinusoids of one input."""
    power = np.array(powers)[:, None, None]
    return c.SpectrumCurves(np.array(frequencies), power, lines=True, **settings)


def correlations(p, r):
    lags = np.arange(1, 21)
    values = 0.1 * np.cos(np.arange(20 * p * (p + r)).reshape(20, p, p + r))
    return c.ResidualCurves(lags, values[:, :, :p], lags, values[:, :, p:], 0.1, 0.5, 0.7)


T = np.arange(500.0)
FIT = c.FitPanel(np.sin(T), np.sin(T) + 0.1, np.sin(T) - 0.1, 83.2)
BANDS = c.ErrorBandPanel(W, {0.05: 0.1 * G, 0.5: 0.2 * G, 0.95: 0.4 * G}, 0.5 * G, 0.6 * G)

SEEN = c.ResponsePanel(W, 1.1 / (1 + 1j * W), 0.01 * W, 1 / (1 + 1j * W))

CURVES = {
    "bound": bound(c.BoundPanel(W, 0.008 * G, G, 0.01 * G, 0.01 * G, np.array([0.5, np.pi]))),
    "bound beside white": bound(
        c.BoundPanel(
            W, 0.008 * G, G, 0.01 * G, 0.01 * G, r_u_equal=0.03 * G, white_labels=("white, 4 × the cost", "w")
        )
    ),
    "bound without a target": bound(c.BoundPanel(W, 0.008 * G, G)),
    "bound with a gap in r_adm": bound(c.BoundPanel(W, 0.008 * G, G, np.where(W < 1, 0.01 * G, -1.0))),
    "spectrum": one_input(DENSITY, 1.7),
    "spectrum with zeros": one_input(1e4 * np.maximum(np.cos(20 * W), 0.0) / W**2, 1.0),
    "spectrum with its record": one_input(
        DENSITY, 1.7, record=(DENSITY * (1 + 0.2 * np.sin(90 * W)))[:, None]
    ),
    "bound with its record": bound(c.BoundPanel(W, 0.008 * G, G, 0.01 * G, r_u_record=0.009 * G)),
    "limited signal": c.SignalCurves(
        np.arange(50.0), {"u1": 3 + np.sin(np.arange(50.0))}, {"u1": (1.5, 4.5)}
    ),
    "predicted signal": c.SignalCurves(
        np.arange(50.0),
        {"u1": 3 + np.sin(np.arange(50.0))},
        {"u1": (1.5, 4.5)},
        {"u1": "valve (%)"},
        (c.PredictedPanel("y1", T[:50], np.sqrt(T[:50]), (-60.0, 60.0), "level (m)"),),
    ),
    "lines": lines([0.1553], [0.1925], white=1.7, band=(1e-3, np.pi)),
    "lines in a loop": lines([0.02, 0.1], [0.1, 0.2], symbol="r"),
    "matrix": c.SpectrumCurves(W, PAIR, 1.7),
    "matrix of lines": c.SpectrumCurves(W[::20], PAIR[::20], lines=True),
    "matrix with zeros": c.SpectrumCurves(W, PAIR * np.maximum(np.cos(20 * W), 0.0)[:, None, None]),
    "directions": c.DirectionCurves(W, np.stack([G, 0.01 * G], 1), np.stack([DENSITY, W], 1), 1.7),
    "directions of lines": c.DirectionCurves(W, np.stack([G, 0.01 * G], 1), np.stack([G, W], 1), lines=True),
    "loss": c.RunCurves({"design": W, "white": 2 * W}, {"design": 1.0}),
    "nyquist": c.NyquistCurves(W, 0.8 * Z**2 / (1 - Z), 0.1 + 0 * W, 0.5, W[150:151]),
    "nyquist without a bound": c.NyquistCurves(W, 0.8 * Z**2 / (1 - Z), 0.1 + 0 * W),
    "optimality": c.OptimalityCurves(W, 1 / (1 + np.log(W / 0.1553) ** 2), np.array([0.1553])),
    "matrix of one direction": c.SpectrumCurves(W, PAIR * np.array([[1, 1e-14], [1e-14, 1]]), symbol="r"),
    "matrix with a peak": c.SpectrumCurves(W, PAIR / (1e-4 + (W - 1) ** 2)[:, None, None]),
    "one line of channels": c.SpectrumCurves(np.array([0.3]), PAIR[:1], lines=True),
    "bounds of entries": bound(
        c.BoundPanel(W, 0.008 * G, G, 0.01 * G, entry=(0, 1)), c.BoundPanel(W, 0.008 * G, G, entry=(1, 0))
    ),
    "error bands": c.ErrorBandCurves((BANDS,), "design", 100),
    "error bands of entries": c.ErrorBandCurves((replace(BANDS, entry=(0, 0)), replace(BANDS, entry=(1, 0)))),
    "fit": c.FitCurves(T, (FIT,)),
    "fit of two outputs": c.FitCurves(T, (FIT, c.FitPanel(T, T + 1, output=1))),
    "fit of two records": c.FitCurves(T, (replace(FIT, label="level (m)"),) * 2, (240, 260)),
    "long fit with a gap": c.FitCurves(
        np.r_[0:2000.0, 3000:4000.0],
        (replace(FIT, y=np.tile(FIT.y, 6), predicted=np.tile(FIT.predicted, 6), simulated=None, left_out=T),),
        (2000, 1000),
        2200.0 + T,
    ),
    "residuals": correlations(1, 1),
    "residuals of two outputs": correlations(2, 1),
    "ellipses": c.EllipseCurves(
        tuple(
            c.Ellipse(("b1", f"a{i}"), np.array([1.0, i]), np.array([[2.0, 1.0], [1.0, 1.0]]), np.eye(2))
            for i in range(4)
        )
    ),
    "signal": c.SignalCurves(np.arange(50.0), {"u1": np.sin(np.arange(50.0))}),
    "long signal": c.SignalCurves(
        np.arange(3000.0), {f"u{i}": np.sin(np.arange(3000.0)) for i in range(1, 7)}
    ),
    "error": c.ErrorCurves(W, 0.2 + 0 * W, 1 / W, 0.5 + 2 / W, (1.0, 1.2), 1.2),
    "error without a target": c.ErrorCurves(W, 0.2 + 0 * W, 1 / W, 0.5 + 2 / W, (1.0, 1.2)),
    "moments": c.MomentsCurves(np.eye(3), 1),
    "many moments": c.MomentsCurves(np.eye(12), 4, np.array([0.0, 2.8]), np.array([1.0, 0.3])),
    "response without a model": c.ResponseCurves((SEEN,)),
    "responses of entries": c.ResponseCurves((replace(SEEN, entry=(0, 0)), replace(SEEN, entry=(1, 0)))),
    "many structures": c.OrderCurves(
        dict.fromkeys(
            ("ARMAX", "ARX", "BJ", "FIR", "FOPDT", "OE", "SOPDT", "TOPDT"), (T[2:8], 10 * T[2:8] - 40)
        ),
        (3.0, 33.0),
    ),
    "structures": c.OrderCurves({"ARX": (T[2:8], 10 * T[2:8]), "OE": (T[2:4], 11 * T[2:4])}, (3.0, 33.0), 1),
    "fan": c.FanCurves(W, np.stack([0.3 * G, 0.5 * G]), 0.4 * G, {"plant 2": 0.5 * G}),
    "campaign": c.CampaignCurves(T[20:80:20], 60.0 / T[20:80:20], T[20:80:20], 200),
    "estimates": c.EstimateCurves(T[20:80:20], {"b1": W[:3], "f1": W[3:6]}, {"b1": W[:3], "f1": W[:3]}),
    "true ratios": c.RunCurves({"campaign": 0.5 + W / 5, "one_shot": 0.8 + W / 5}, limit=1.0),
    "costs and shares": c.TradeCurves({"campaign": (1.0, 0.9, 1.1, 0.95, 0.9, 0.99)}),
    "costs beside a record": c.TradeCurves({"campaign": (1.0, 0.9, 1.1, 0.95, 0.9, 0.99)}, 0.85),
    "cloud": c.EllipseCurves(
        (c.Ellipse(("b1", "f1"), np.ones(2), np.eye(2), estimates=np.stack([W, np.cos(W)], 1)),)
    ),
    "deviations": c.DeviationCurves((c.DeviationPanel(W, G, 0.05 * G, 0.04 * G, None, "design"),)),
    "named bound": bound(c.BoundPanel(W, 1e-40 * G, G, 0.01 * G, names="heating → temperature")),
    "constant signal": c.SignalCurves(np.arange(5.0), {"r1": np.ones(5)}),
}


def lines_by_label(axes):
    """The artists on axes, by their labels in the legend."""
    handles, labels = axes.get_legend_handles_labels()
    return dict(zip(labels, handles, strict=True))
