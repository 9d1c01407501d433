"""The charts of a report, drawn from the CSV files of a run as SVG within the page."""

from __future__ import annotations

import base64
import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import partial
from pathlib import Path

import numpy as np

from inputdesign_cli.figures.plots import draw
from inputdesign_cli.regular_file import read_regular
from inputdesign_cli.report.numbers import spoken
from inputdesign_cli.runs.curves import (
    BoundCurves,
    BoundPanel,
    Curves,
    OptimalityCurves,
    SignalCurves,
    SpectrumCurves,
)
from inputdesign_cli.runs.objectives import white_labels
from inputdesign_cli.runs.results import Array, Result
from inputdesign_cli.runs.text_formats import read_csv

# Curves, what they show in words, and a caption.
Drawn = tuple[Curves, str, str]

# An entry of G limits the design where its r_u / r_adm is above this.
_LIMITS = 0.999
_CAPTIONS = {
    "bound": "Above: the error that the model may have (r_u) against the error that is admitted (r_adm). "
    "Below: their ratio, which is to stay below one; white excitation that spends the same goes higher.",
    "deviations": "The standard deviation of the measured frequency response at every line, against what is "
    "admitted.",
    "fan": "How near every plant that the true one might be comes to what is admitted: r_u / r_adm at "
    "each, those that bind in colour. The plants are those that the uncertainty of the spec describes; "
    "nothing is said of the true plant.",
    "spectrum": "Where in frequency the excitation has its power, and white excitation for comparison.",
    "optimality": "The certificate of the bound over every spectrum: what a unit of cost buys at each "
    "frequency, relative to the best. It is nowhere above one, and one where power pays.",
    "signal": "The signal to apply (signal.csv), and how its values are distributed.",
    "ellipses": "The confidence ellipses that the design buys, for pairs of parameters.",
    "directions": "The gains of the plant, and how the design shares its power among their directions.",
    "moments": "The second moments of the regressors.",
    "error": "The mean squared error against the energy of the regressors, bias and variance apart.",
    "frequency_response": "What the data say of G without a model, with the range that holds |G| with 95 % "
    "at each frequency, beside the model: where the model leaves the range, it is wrong there.",
    "loss": "The loss in simulated experiments.",
    "campaign": "The worst ratio at the estimate and the energy applied, after each part of the campaign.",
    "estimates": "The estimates after each part of the campaign, with two standard deviations.",
    "true_ratio": "The largest r_u / r_adm of the true plant in simulated campaigns and in experiments in "
    "one shot: beyond one what is asked is missed, far below one power was wasted.",
    "cost_coverage": "What campaigns and experiments in one shot cost, against the share of runs whose model "
    "is within r_adm of the true plant.",
}


@dataclass(frozen=True)
class Chart:
    """A picture for an <img>: its data, what it shows in words, and a caption."""

    uri: str
    alt: str
    caption: str


def run_charts(run: Path, result: Result, time_unit: str, *, closed_loop: bool) -> dict[str, Chart]:
    """The charts of a run by file stem. What has no table we know of is taken from its PNG file."""
    spectrum = partial(_spectrum, symbol="r" if closed_loop else "u")
    makers: dict[str, Callable[[Mapping[str, Array], Result], Drawn | None]]
    makers = {"bound": _bound, "spectrum": spectrum, "optimality": _optimality, "signal": _signal}
    charts = {}
    for stem, make in makers.items():
        path = run / f"{stem}.csv"
        found = make(read_csv(path), result) if path.is_file() else None
        if found is not None:
            curves, alt, caption = found
            charts[stem] = Chart(svg_uri(draw(curves, time_unit, "svg", narrow=True)), alt, caption)
    for name in result.get("files", ()):
        stem, _, kind = name.rpartition(".")
        if kind == "png" and stem not in charts and (run / name).is_file():
            charts[stem] = png_chart(run / name)
    return charts


def svg_uri(content: bytes) -> str:
    """An SVG file as a data URI: in an image its ids meet no others of the page."""
    return "data:image/svg+xml;base64," + base64.b64encode(content).decode()


def png_chart(path: Path) -> Chart:
    """A figure of the run as it is."""
    data = base64.b64encode(read_regular(path)).decode()
    name = path.stem.replace("_", " ")
    caption = _CAPTIONS.get(path.stem) or _caption_by_kind(path.stem) or f"The figure {name} of the run."
    return Chart(f"data:image/png;base64,{data}", caption, caption)


def _caption_by_kind(stem: str) -> str | None:
    """What a figure of data or of simulated runs shows; None for other figures."""
    kind, _, name = stem.partition("_")
    if kind in ("errors", "cloud", "disturbance") and name:
        what = {
            "errors": "The errors |G_hat - G_0| of the models of all runs, against r_u and r_adm",
            "cloud": "The estimates of all runs, with the ellipses of theory",
            "disturbance": "What the excitation alone does to the loop",
        }[kind]
        return f"{what}: {spoken(name)}."
    return {
        "fit": "The recorded outputs, predicted one step ahead, and simulated from the input alone.",
        "residuals": "Correlations of the residuals with themselves and with past inputs; chance leaves them "
        "within the grey.",
        "bound": "The error r_u that these data leave, against the admitted error r_adm.",
        "structures": "How well each structure that was tried simulates data that it has not seen.",
    }.get(stem.removeprefix("data_"))


def _frequency(table: Mapping[str, Array]) -> Array:
    return next(values for name, values in table.items() if name.startswith("frequency"))


def _bound(table: Mapping[str, Array], result: Result) -> Drawn | None:
    w = _frequency(table)
    error = result.get("model_error", {})
    places = [name.removeprefix("r_u") for name in table if re.fullmatch(r"r_u(_\d\d)?", name)]
    if not all({f"r_u{place}", f"G_abs{place}"} <= set(table) for place in places) or not places:
        return None
    frequencies = np.clip(np.array(error.get("active_frequencies", []), dtype=float), w[0], w[-1])

    def panel(place: str) -> BoundPanel:
        r_u, r_adm = table[f"r_u{place}"], table.get(f"r_adm{place}")
        # Of several entries each limits at frequencies of its own.
        near = np.interp(frequencies, w, np.zeros(w.size) if r_adm is None else r_u / r_adm) > _LIMITS
        return BoundPanel(
            w,
            r_u,
            table[f"G_abs{place}"],
            r_adm,
            table.get(f"r_u_white{place}"),
            frequencies if len(places) == 1 else frequencies[near],
            table.get(f"r_u_record{place}"),
            # Beside a design the figure of the data is one of its own.
            label="data" if "identification" in result and "objective" not in result else "design",
            r_u_equal=table.get(f"r_u_equal{place}"),
            white_labels=white_labels(result),
            entry=(int(place[1]) - 1, int(place[2]) - 1) if place else None,
        )

    curves = BoundCurves(tuple(panel(place) for place in places))
    if all(one.r_adm is None for one in curves.panels):
        alone = "The error r_u that the model may have, and the gain |G|, against frequency."
        return curves, alone, alone
    worst = f"; the largest ratio is {error['worst_ratio']:.6g}" if "worst_ratio" in error else ""
    alt = f"Model error r_u and admissible error r_adm against frequency{worst}."
    return curves, alt, _CAPTIONS["bound"]


def _spectrum(table: Mapping[str, Array], result: Result, *, symbol: str) -> Drawn | None:
    if "phi" not in table:
        return None
    w, phi = _frequency(table), table["phi"]
    white = result.get("baseline", {}).get("white", {}).get("power", {}).get("excitation", [None])[0]
    record = table["phi_record"][:, None] if "phi_record" in table else None
    density = phi[:, None, None].astype(np.complex128)
    curves = SpectrumCurves(w, density, white=white, symbol=symbol, record=record)
    peak = w[int(np.argmax(phi))]
    alt = f"Spectral density of the excitation against frequency, with its peak at {peak:.3g}."
    return curves, alt, _CAPTIONS["spectrum"]


def _optimality(table: Mapping[str, Array], result: Result) -> Drawn | None:
    if "ratio" not in table:
        return None
    w, ratio = _frequency(table), table["ratio"]
    curves = OptimalityCurves(w, ratio, np.zeros(0))
    alt = f"Worth of a unit of cost against frequency; its maximum is {ratio.max():.4g}."
    return curves, alt, _CAPTIONS["optimality"]


def _signal(table: Mapping[str, Array], result: Result) -> Drawn | None:
    names = list(table)
    channels = {name: table[name] for name in names if not name.startswith("time")}
    if len(channels) == len(names) or not channels:
        return None
    curves = SignalCurves(table[names[0]], channels)
    listed = ", ".join(channels)
    alt = f"The signal {listed} against time, and the distribution of its values."
    return curves, alt, _CAPTIONS["signal"]
