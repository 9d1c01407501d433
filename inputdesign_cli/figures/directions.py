"""directions.png: the gains of the plant, and how the input shares its power among their directions."""

from __future__ import annotations

from matplotlib.artist import Artist
from matplotlib.figure import Figure

from inputdesign_cli.figures.spectrum import MOST, logarithmic, plot_power, plot_white
from inputdesign_cli.figures.style import PALETTE, frequency_axis, legend_above
from inputdesign_cli.runs.results import DirectionCurves


def draw_directions(page: Figure, curves: DirectionCurves, time_unit: str) -> None:
    """The gains of the plant above; below, the power of the input along each of its input directions."""
    w = curves.frequency
    upper, lower = page.subplots(2, 1, sharex=True)
    gains: list[Artist] = []
    powers: list[Artist] = []
    for i, (gain, power) in enumerate(zip(curves.gain.T, curves.power.T, strict=True)):
        gains += upper.plot(w, gain, color=PALETTE[i % MOST], label=rf"$\sigma_{i + 1}(G)$")
        label = rf"$v_{i + 1}^* \Phi_u v_{i + 1}$"
        powers += plot_power(lower, w, power, lines=curves.lines, number=i, label=label)
    upper.set_yscale("log", nonpositive="mask")
    upper.set_ylabel("gains of the plant")
    legend_above(upper, gains)
    if curves.white is not None:
        powers.append(plot_white(lower, curves.white))
    logarithmic(lower, curves.power)
    lower.set_ylabel("input along them")
    frequency_axis(lower, w, time_unit)
    legend_above(lower, powers)
