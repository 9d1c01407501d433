"""What the figures of a sweep share: the names of keys, scales, curves, and marks for what has no result."""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.axis import Axis
from matplotlib.ticker import FixedLocator, FuncFormatter, LogLocator, MaxNLocator, NullLocator

from inputdesign_cli.figures.style import ORANGE, log_axes
from inputdesign_cli.outcome.results import Array

# Values over a wider ratio are drawn on a logarithmic scale; keys from the second ratio on.
LOG_FROM = 10.0
_LOG_KEYS_FROM = 100.0
_DECADES_IN_FULL = 3.0
# Ticks at points: their largest number, and their least distance as a share of the axis.
_MOST_TICKS, _ROOM = 12, 0.055
_NAMES = {
    "experiment.samples": "number of samples N",
    "spectrum.order": "order of the FIR spectrum",
    "accuracy.mean_squared_error.neglected_norm": "bound α on the neglected parameters",
    "accuracy.mean_squared_error.target": "mean squared error γ that is admitted",
}


def key_label(key: str) -> str:
    """What an axis over a key of the spec is called."""
    return _NAMES.get(key, key)


def curve(axes: Axes, x: Array, y: Array, **style: Any) -> None:
    """A curve through the points in the order of x."""
    order = np.argsort(x, kind="stable")
    axes.plot(x[order], y[order], **style)


def mark_failures(axes: Axes, where: Array) -> None:
    """Crosses at the foot of the axes where a point has no result."""
    where = where[np.isfinite(where)]
    if not where.size:  # the layout would make room for a line without points
        return
    foot = np.full(where.size, 0.02)
    axes.plot(where, foot, "x", color=ORANGE, transform=axes.get_xaxis_transform(), clip_on=False)


def scale_key(axes: Axes, key: str, x: Array) -> None:
    """The scale and the name of the axis of a key: logarithmic for N and over decades.

    Up to a dozen points that stand apart have their ticks, and no others.
    """
    low, high = float(np.nanmin(x)), float(np.nanmax(x))
    if low > 0 and (key == "experiment.samples" or high > _LOG_KEYS_FROM * low):
        log_axes(axes, "x")
        plain_numbers(axes.xaxis, high / low)
    elif np.all(x == np.round(x)):
        axes.xaxis.set_major_locator(MaxNLocator(integer=True))
    points = np.unique(x[np.isfinite(x)])
    if _apart(points, logarithmic=axes.get_xscale() == "log"):
        axes.xaxis.set_major_locator(FixedLocator(points.tolist()))
        axes.xaxis.set_minor_locator(NullLocator())
        axes.xaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
    axes.set_xlabel(key_label(key))


def _apart(points: Array, *, logarithmic: bool) -> bool:
    """Whether there is room for a number at each of the points."""
    if not 1 < points.size <= _MOST_TICKS:
        return False
    place = np.log(points) if logarithmic else points
    return bool(np.diff(place).min() > _ROOM * np.ptp(place))


def plain_numbers(axis: Axis, ratio: float) -> None:
    """Ticks of a logarithmic axis, written out: powers of ten, over few decades 2 and 5 times them too."""
    subs = (1.0, 2.0, 5.0) if ratio < 10.0**_DECADES_IN_FULL else (1.0,)
    axis.set_major_locator(LogLocator(subs=subs))
    axis.set_minor_locator(NullLocator())
    axis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
