"""The charts of a report, drawn from the CSV files of a run as SVG within the page."""

from __future__ import annotations

import base64
import json
from dataclasses import dataclass
from pathlib import Path

from inputdesign_cli.figures.plots import draw
from inputdesign_cli.figures.readings import readings
from inputdesign_cli.regular_file import read_regular
from inputdesign_cli.report.drawn import READERS, WITHOUT_LIMIT
from inputdesign_cli.report.numbers import spoken
from inputdesign_cli.runs.curves import Curves
from inputdesign_cli.runs.results import Json, Result
from inputdesign_cli.runs.text_formats import read_csv

_PICTURES = {"png": "image/png", "svg": "image/svg+xml"}
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
    "signal": "The signal to apply (signal.csv), how its values are distributed, and the output that it is "
    "to cause, with two standard deviations of noise.",
    "nyquist": "The loop C G with the discs in which the data leave it, and the circle about -1 that it is "
    "to keep off. The limiting frequencies are those at which a disc touches what is admitted.",
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
    """A picture for an <img>: its data, its text, a caption, and values for who points at it (JSON)."""

    uri: str
    alt: str
    caption: str
    readings: str = ""


def run_charts(run: Path, result: Result, time_unit: str, *, closed_loop: bool) -> dict[str, Chart]:
    """The charts of a run by file stem. What has no table that we know of is taken from its file."""
    names = (*READERS, "predicted_output")
    tables = {name: read_csv(run / f"{name}.csv") for name in names if (run / f"{name}.csv").is_file()}
    charts = {}
    for stem, read in READERS.items():
        found = read(tables, result, closed_loop) if stem in tables else None
        if found is not None:
            curves, alt = found
            caption = alt if alt == WITHOUT_LIMIT else _CAPTIONS[stem]
            charts[stem] = _readable(curves, time_unit, alt, caption)
    for name in result.get("files", ()):
        stem, _, kind = name.rpartition(".")
        if kind in _PICTURES and stem not in charts and (run / name).is_file():
            charts[stem] = file_chart(run / name)
    return charts


def _readable(curves: Curves, time_unit: str, alt: str, caption: str) -> Chart:
    panels: list[dict[str, Json]] = []
    drawn = draw(curves, time_unit, "svg", narrow=True, seen=lambda page: panels.extend(readings(page)))
    return Chart(svg_uri(drawn), alt, caption, json.dumps(panels, separators=(",", ":")) if panels else "")


def svg_uri(content: bytes) -> str:
    """An SVG file as a data URI: in an image its ids meet no others of the page."""
    return "data:image/svg+xml;base64," + base64.b64encode(content).decode()


def file_chart(path: Path) -> Chart:
    """A figure of the run as it is."""
    data = base64.b64encode(read_regular(path)).decode()
    name = path.stem.replace("_", " ")
    caption = _CAPTIONS.get(path.stem) or _caption_by_kind(path.stem) or f"The figure {name} of the run."
    return Chart(f"data:{_PICTURES[path.suffix[1:]]};base64,{data}", caption, caption)


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
