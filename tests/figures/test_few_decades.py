"""A logarithmic axis can be read, however little its values differ."""

import numpy as np
import pytest
from matplotlib.figure import Figure

from inputdesign_cli.figures.studies import draw_campaign
from inputdesign_cli.figures.style import painted
from inputdesign_cli.outcome.curves import CampaignCurves


@pytest.mark.parametrize("most", [1.02, 1.1, 1.64, 3.0, 7.0, 30.0, 2000.0])
def test_the_worst_ratio_of_a_campaign_stands_beside_three_numbers_or_more(most):
    ratios = np.array([most, np.sqrt(most), 0.99])
    curves = CampaignCurves(np.array([10.0, 20.0, 30.0]), ratios, np.array([1.0, 2.0, 3.0]), 500)

    def paint(page: Figure) -> None:
        draw_campaign(page, curves, "s")

    upper = painted(paint).axes[0]
    upper.figure.canvas.draw()
    low, high = upper.get_ylim()
    labels = [tick for tick in upper.get_yticklabels() if tick.get_text()]
    shown = [tick for tick in labels if low <= tick.get_position()[1] <= high]
    assert len(shown) >= 3
    assert len({tick.get_text() for tick in shown}) == len(shown)
    assert [float(tick.get_text()) for tick in shown] == pytest.approx([t.get_position()[1] for t in shown])
