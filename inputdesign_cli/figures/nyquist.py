"""nyquist.png: the loop with the discs in which the data leave it, and how near they come to -1."""

from __future__ import annotations

import numpy as np
from matplotlib.artist import Artist
from matplotlib.collections import EllipseCollection
from matplotlib.figure import Figure
from matplotlib.patches import Circle, Patch
from numpy.typing import NDArray

from inputdesign_cli.figures.readings import Traced
from inputdesign_cli.figures.style import (
    BLACK,
    BLUE,
    DASHED,
    GREY,
    ORANGE,
    frequency_label,
    labelled,
    legend_over_all,
    limiting_label,
    marked,
)
from inputdesign_cli.outcome.curves import NyquistCurves

_DISCS = 36
# Of the plane, what is shown: so far around -1 and 0 the loop decides on its margins.
_LEFT, _RIGHT, _HALF = -2.2, 1.2, 1.35


def draw_nyquist(page: Figure, curves: NyquistCurves, time_unit: str) -> None:
    """Draw C G over frequency, discs of radius |C| r_u along it, -1, and the circle that it must avoid."""
    axes = page.add_subplot()
    axes.set_aspect("equal", adjustable="box")
    axes.set_xlim(_LEFT, _RIGHT)
    axes.set_ylim(-_HALF, _HALF)
    L, radius = curves.loop, curves.radius
    at = np.union1d(
        _along(np.where(_shown(L), L, np.nan)), np.searchsorted(curves.frequency, curves.limiting)
    )
    at = at[at < L.size]
    widths = 2.0 * radius[at]
    discs = EllipseCollection(
        widths,
        widths,
        np.zeros(at.size),
        units="xy",
        offsets=np.column_stack([L.real[at], L.imag[at]]),
        offset_transform=axes.transData,
        facecolor=BLUE,
        edgecolor=BLUE,
        alpha=0.14,
        linewidth=0.5,
    )
    axes.add_collection(discs, autolim=False)
    told = {
        "real part": L.real,
        "imaginary part": L.imag,
        "radius of its disc": radius,
        "distance of the disc from −1": np.abs(1.0 + L) - radius,
    }
    line = Traced(L.real, L.imag, curves.frequency, frequency_label(time_unit), told, color=BLUE)
    line.set_label("C G, nominal")
    axes.add_line(line)
    handles: list[Artist] = [line, Patch(color=BLUE, alpha=0.3, label="where the data leave it (|C| r_u)")]
    if curves.circle is not None:
        axes.add_patch(Circle((-1.0, 0.0), curves.circle, color=ORANGE, alpha=0.07, linewidth=0))
        axes.add_patch(
            Circle((-1.0, 0.0), curves.circle, fill=False, edgecolor=ORANGE, linestyle=DASHED, linewidth=1.6)
        )
        label = f"to be kept off: |S| up to {1.0 / curves.circle:.3g}"
        handles.append(Patch(facecolor="#FDF1E9", edgecolor=ORANGE, linestyle=DASHED, label=label))
    limiting = np.interp(curves.limiting, curves.frequency, L)
    limiting = limiting[_shown(limiting)]  # rings are drawn beyond the axes too, and would push them aside
    if limiting.size:
        marked(axes, limiting.real, limiting.imag, color=BLUE, label=limiting_label(limiting.size))
    axes.plot([-1.0], [0.0], "+", color=BLACK, markersize=10, markeredgewidth=1.6)
    axes.annotate("−1", (-1.0, 0.0), (4, 5), textcoords="offset points")
    turn = np.linspace(0.0, 2.0 * np.pi, 200)
    axes.plot(np.cos(turn), np.sin(turn), color=GREY, linewidth=0.6)
    axes.set_xlabel("real part of C G")
    axes.set_ylabel("imaginary part of C G")
    legend_over_all(page, list(dict.fromkeys([*handles, *labelled(axes)])))


def _shown(L: NDArray[np.complex128]) -> NDArray[np.bool_]:
    """Return the mask (n,) of the points of L (n,) within the axes."""
    return (L.real > _LEFT) & (L.real < _RIGHT) & (np.abs(L.imag) < _HALF)


def _along(L: NDArray[np.complex128]) -> NDArray[np.int_]:
    """Return indices (m,) of points of L (n,) evenly along the curve, where it is shown (NaN where not)."""
    inside = np.flatnonzero(np.isfinite(L))
    if inside.size <= _DISCS:
        return inside
    steps = np.abs(np.diff(L[inside], prepend=L[inside[0]]))
    length = np.cumsum(np.minimum(steps, 0.2))
    return inside[
        np.unique(np.searchsorted(length, np.linspace(0.0, length[-1], _DISCS)).clip(0, inside.size - 1))
    ]
