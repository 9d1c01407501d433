"""The charts of a page: SVG within the page, drawn from the curves of a run or the table of a sweep."""

from __future__ import annotations

import base64
import json
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from inputdesign_cli.arrays import Array
from inputdesign_cli.figures.frequency import MOST_NAMED
from inputdesign_cli.figures.plots import painter
from inputdesign_cli.figures.readings import readings
from inputdesign_cli.figures.style import rendered
from inputdesign_cli.outcome.curves import BoundCurves, Curves
from inputdesign_cli.outcome.run_directory import read_curves
from inputdesign_cli.outcome.sentences import sentences, spoken

if TYPE_CHECKING:
    from matplotlib.figure import Figure

# Figures of simulated runs; each exists for every input that was tried.
_OF_RUNS = ("errors", "cloud", "disturbance")


@dataclass(frozen=True)
class Chart:
    """Holds a picture for an <img>: its data, a caption, and the values shown under the pointer (JSON)."""

    uri: str
    caption: str
    readings: str = ""


def run_charts(run: Path, time_unit: str) -> dict[str, Chart]:
    """Return the charts of the run in a directory by file stem; `time_unit` is that of the spec."""
    return {
        stem: chart(painter(curves, time_unit), _caption(stem, curves))
        for stem, curves in read_curves(run).items()
    }


def _caption(stem: str, curves: Curves) -> str:
    kind, _, name = stem.partition("_")
    loop = kind == "disturbance"
    caption = "What the excitation alone does to the loop." if loop else captioned(curves)
    return f"{caption[:-1]}: {spoken(name)}." if kind in _OF_RUNS and name else caption


def captioned(curves: Curves) -> str:
    """Return the caption of a figure, which describes the curves that it has."""
    known: dict[str, object] = {"curves": curves, "most_named": MOST_NAMED}
    if isinstance(curves, BoundCurves):
        panels = curves.panels
        designed = max(_highest(panel.r_u, panel.r_adm) for panel in panels)
        white = max(_highest(panel.r_u_equal, panel.r_adm) for panel in panels)
        known |= {
            "bounded": all(panel.r_adm is not None for panel in panels),
            "white_is_higher": white > designed,
        }
    return sentences("inputdesign_cli.report", "captions.txt", type(curves).__name__, known)[0]


def _highest(error: Array | None, admitted: Array | None) -> float:
    """Return the largest of the ratios (n,) that are known; zero if something is missing."""
    return 0.0 if error is None or admitted is None else float(np.nanmax(error / admitted))


def chart(paint: Callable[[Figure], object], caption: str) -> Chart:
    """Return the chart that `paint` draws on an empty page; as an image, its ids do not clash with others."""
    panels: list[dict[str, object]] = []
    content = rendered(paint, "svg", width="phone", seen=lambda page: panels.extend(readings(page)))
    uri = "data:image/svg+xml;base64," + base64.b64encode(content).decode()
    return Chart(uri, caption, json.dumps(panels, separators=(",", ":")) if panels else "")
