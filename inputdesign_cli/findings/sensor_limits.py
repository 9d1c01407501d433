"""A sensor stays at an end of its range, or rounds to steps that one can see."""

from __future__ import annotations

import numpy as np

from inputdesign_cli.arrays import Array
from inputdesign_cli.finding import Finding, FindingKind, Severity

SENSOR_SATURATED = FindingKind(
    "sensor-saturated",
    Severity.NOTE,
    "an output stays at its largest or smallest value",
    "A sensor at the end of its range shows one value while the plant moves on. Two per cent of the samples "
    "or more, in runs of three or more, are at an extreme value.",
    "Leave these rows out with `--without`, or measure with another range.",
)
SENSOR_ROUNDED = FindingKind(
    "sensor-rounded",
    Severity.NOTE,
    "an output moves in visible steps",
    "All values lie on a grid. Its step is more than a tenth of the standard deviation. Rounding acts as "
    "noise.",
    "Log with more digits, or excite with larger moves.",
)

_FEW_LEVELS = 10
_CLIPPED, _RUN = 0.02, 3
_COARSE = 0.1
# Evidence that a signal is rounded: off a grid by these shares of its step, at least as counted and at most;
# the chance that a value comes again, for ten returns at most; the chance of all that by accident.
_LEAST_OFF, _MOST_OFF, _REFINED, _PARTS = 1e-3, 0.1, 3, (1, 2, 3)
_AGAIN, _ENOUGH_RETURNS = 0.1, 10
_BY_CHANCE = 2e-4


def sensor_limits(name: str, x: Array) -> list[Finding]:
    """Say whether a measured signal x (n,) stays at an extreme value, or moves in visible steps."""
    levels = np.unique(x)
    found = []
    if levels.size > _FEW_LEVELS:
        for word, value in (("largest", levels[-1]), ("smallest", levels[0])):
            at = x == value
            # At the beginning it may be at rest, before the input moves.
            at[: int(np.argmin(at))] = False
            runs = np.diff(np.flatnonzero(np.diff(np.concatenate([[0], at.astype(int), [0]]))))[::2]
            stays = int(runs[runs >= _RUN].sum())
            if stays > _CLIPPED * x.size:
                said = f"{name} stays at its {word} value {value:.6g} for {stays} samples: is it saturated?"
                found.append(SENSOR_SATURATED.found(said, where=name, value=float(value), samples=stays))
    spread = float(np.std(x))
    step, chance = _grid(x, levels)
    if step > _COARSE * spread > 0.0 and chance < _BY_CHANCE:
        said = f"{name} is rounded to steps of {step:.3g}, {step / spread:.2f} of its standard deviation."
        found.append(SENSOR_ROUNDED.found(said, where=name, step=step, share=step / spread))
    return found


def _grid(x: Array, levels: Array) -> tuple[float, float]:
    """The step between the distinct levels of x, and how probable it is that they lie on a grid by chance.

    Of continuous values the gaps in units of the step lie anywhere between two integers, and no value comes
    again after another. Where levels are missing the smallest gap is a few steps.
    """
    gaps = np.diff(levels)
    if not gaps.size:
        return 0.0, 1.0
    returns = min(int(np.sum(np.diff(x) != 0.0)) + 1 - levels.size, _ENOUGH_RETURNS)
    tried = [_on_grid(gaps, float(gaps.min()) / part) for part in _PARTS]
    step, chance = min(tried, key=lambda one: one[1])
    return step, min(len(_PARTS) * chance, 1.0) * (_AGAIN**returns if chance < 1.0 or gaps.size == 1 else 1.0)


def _on_grid(gaps: Array, step: float) -> tuple[float, float]:
    """Return the step that suits the gaps best, near to one, and the probability that all suit it as well."""
    for _ in range(_REFINED):
        whole = np.round(gaps / step)
        step = float(whole @ gaps / (whole @ whole))
    off = max(float(np.max(np.abs(gaps / step - np.round(gaps / step)))), _LEAST_OFF)
    return step, (2.0 * off) ** (gaps.size - 1) if off < _MOST_OFF else 1.0
