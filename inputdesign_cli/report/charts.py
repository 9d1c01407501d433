"""The charts of a report, drawn from figures.json of a run as SVG within the page."""

from __future__ import annotations

import base64
import json
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from inputdesign_cli.compute.executor import Executor
from inputdesign_cli.figures.plots import draw
from inputdesign_cli.figures.readings import readings
from inputdesign_cli.regular_file import read_regular
from inputdesign_cli.report.described import captioned, described
from inputdesign_cli.report.numbers import spoken
from inputdesign_cli.runs.curves import Curves
from inputdesign_cli.runs.curves_file import read_curves
from inputdesign_cli.runs.results import Json, Result

if TYPE_CHECKING:
    from matplotlib.figure import Figure

_PICTURES = {"png": "image/png", "svg": "image/svg+xml"}
_CAPTIONS = {
    "deviations": "The standard deviation of the measured frequency response at every line, against what is "
    "admitted.",
    "fan": "How near every plant that the true one might be comes to what is admitted: r_u / r_adm at "
    "each, those that bind in colour. The plants are those that the uncertainty of the spec describes; "
    "nothing is said of the true plant.",
    "optimality": "The certificate of the bound over every spectrum: what a unit of cost buys at each "
    "frequency, relative to the best. It is nowhere above one, and one where power pays.",
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


def run_charts(run: Path, result: Result, time_unit: str, by: Executor) -> dict[str, Chart]:
    """The charts of a run by file stem, drawn for a page; of an older run the pictures that it has.

    Args:
        by: draws them.
    """
    jobs = [(stem, curves, time_unit) for stem, curves in read_curves(run).items()]
    drawn: dict[str, Chart] = {}
    for done in by.run(_readable, jobs):
        if done.answer is None:
            raise done.error or RuntimeError(f"{done.job[0]} was not drawn")
        drawn[done.job[0]] = done.answer
    charts = {stem: drawn[stem] for stem, _, _ in jobs}
    for name in result.get("files", ()):
        stem, _, kind = name.rpartition(".")
        if kind in _PICTURES and stem not in charts and (run / name).is_file():
            charts[stem] = file_chart(run / name)
    return charts


def _readable(job: tuple[str, Curves, str]) -> Chart:
    """The chart of a file stem, of its curves and the unit of time."""
    stem, curves, time_unit = job
    caption = _caption_by_kind(stem) or captioned(curves) or _caption(stem)
    return readable_chart(
        lambda seen: draw(curves, time_unit, "svg", narrow=True, seen=seen),
        described(curves, time_unit) or caption,
        caption,
    )


def readable_chart(drawn: Callable[[Callable[[Figure], object]], bytes], alt: str, caption: str) -> Chart:
    """A chart of which values can be read; `drawn` makes the SVG and hands its page to what it is given."""
    panels: list[dict[str, Json]] = []
    content = drawn(lambda page: panels.extend(readings(page)))
    told = json.dumps(panels, separators=(",", ":")) if panels else ""
    return Chart(_svg_uri(content), alt, caption, told)


def _svg_uri(content: bytes) -> str:
    """An SVG file as a data URI: in an image its ids meet no others of the page."""
    return "data:image/svg+xml;base64," + base64.b64encode(content).decode()


def file_chart(path: Path) -> Chart:
    """A figure of the run as it is."""
    data = base64.b64encode(read_regular(path)).decode()
    caption = _caption(path.stem)
    return Chart(f"data:{_PICTURES[path.suffix[1:]]};base64,{data}", caption, caption)


def _caption(stem: str) -> str:
    return _CAPTIONS.get(stem) or _caption_by_kind(stem) or f"The figure {spoken(stem)} of the run."


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
        "structures": "How well each structure that was tried simulates data that it has not seen.",
    }.get(stem.removeprefix("data_"))
