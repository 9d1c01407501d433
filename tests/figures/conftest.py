"""The page of a figure, in place of its pixels."""

import pytest
from matplotlib.backends.backend_agg import FigureCanvasAgg

from inputdesign_cli.figures.plots import draw


@pytest.fixture
def page(monkeypatch):
    """The figure that was drawn last, instead of its pixels."""
    kept = []

    def keep(canvas, _, **settings):
        canvas.draw()  # gives ticks their texts, and panels their places
        kept.append(canvas.figure)

    monkeypatch.setattr(FigureCanvasAgg, "print_png", keep)
    return lambda curves, unit="s": (draw(curves, unit), kept[-1])[1]
