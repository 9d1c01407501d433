"""The charts of a report, drawn from figures.json of a run as SVG within the page."""

from __future__ import annotations

import base64
import json
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from inputdesign_cli.figures.plots import draw
from inputdesign_cli.figures.readings import readings
from inputdesign_cli.outcome.curves import Curves
from inputdesign_cli.outcome.curves_file import read_curves
from inputdesign_cli.regular_file import read_regular
from inputdesign_cli.report.described import captioned, described
from inputdesign_cli.report.numbers import spoken

if TYPE_CHECKING:
    from matplotlib.figure import Figure

_PICTURES = {"png": "image/png", "svg": "image/svg+xml"}
# Figures of simulated runs: there is one of each for every input that was tried.
_OF_RUNS = ("errors", "cloud", "disturbance")


@dataclass(frozen=True)
class Chart:
    """A picture for an <img>: its data, its text, a caption, and values for who points at it (JSON)."""

    uri: str
    alt: str
    caption: str
    readings: str = ""


def run_charts(run: Path, files: object, time_unit: str) -> dict[str, Chart]:
    """The charts of a run by file stem, drawn for a page; of an older run the pictures that it has.

    Args:
        run: its directory.
        files: the names that its result lists.
        time_unit: of the spec.
    """
    charts = {stem: _readable(stem, curves, time_unit) for stem, curves in read_curves(run).items()}
    for name in files if isinstance(files, list) else ():
        stem, _, kind = name.rpartition(".")
        if kind in _PICTURES and stem not in charts and (run / name).is_file():
            charts[stem] = file_chart(run / name)
    return charts


def _readable(stem: str, curves: Curves, time_unit: str) -> Chart:
    caption = _caption(stem, curves)
    return readable_chart(
        lambda seen: draw(curves, time_unit, "svg", narrow=True, seen=seen),
        described(curves, time_unit) or caption,
        caption,
    )


def _caption(stem: str, curves: Curves) -> str:
    kind, _, name = stem.partition("_")
    loop = kind == "disturbance"
    caption = "What the excitation alone does to the loop." if loop else captioned(curves)
    return f"{caption[:-1]}: {spoken(name)}." if kind in _OF_RUNS and name else caption


def readable_chart(drawn: Callable[[Callable[[Figure], object]], bytes], alt: str, caption: str) -> Chart:
    """A chart of which values can be read; `drawn` makes the SVG and hands its page to what it is given."""
    panels: list[dict[str, object]] = []
    content = drawn(lambda page: panels.extend(readings(page)))
    told = json.dumps(panels, separators=(",", ":")) if panels else ""
    return Chart(_svg_uri(content), alt, caption, told)


def _svg_uri(content: bytes) -> str:
    """An SVG file as a data URI: in an image its ids meet no others of the page."""
    return "data:image/svg+xml;base64," + base64.b64encode(content).decode()


def file_chart(path: Path) -> Chart:
    """A figure of an older run as it is: what it shows is not known."""
    data = base64.b64encode(read_regular(path)).decode()
    caption = f"The figure {spoken(path.stem)} of the run."
    return Chart(f"data:{_PICTURES[path.suffix[1:]]};base64,{data}", caption, caption)
