"""Spec -> limits on powers and on the density of the excitation."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from inputdesign_cli.arrays import Array, ComplexArray
from inputdesign_cli.design.convex.limits import DensityLimit, PowerLimit
from inputdesign_cli.information import POWER_KINDS, Experiment, PowerKind
from inputdesign_cli.plant import graded_grid
from inputdesign_cli.questions.building.header import build_units
from inputdesign_cli.questions.building.signal_settings import stated_moves, stated_peaks
from inputdesign_cli.questions.building.tables import bad_table, read_frequency_table
from inputdesign_cli.questions.building.weights import build_weight, check_finite, on_the_limit
from inputdesign_cli.specification import Spec
from inputdesign_cli.specification.models.limits import Curve

_KEY = "limits.spectrum"


def build_power_limits(spec: Spec) -> list[PowerLimit]:
    """Return the upper and lower limits on the powers, without lower limits of zero."""
    limits = spec.limits
    stated = (limits.input_power, limits.output_power, limits.excitation_power)
    return [
        PowerLimit(kind, float(v), upper, None if np.size(value) == 1 else channel)
        for kind, bounds in zip(POWER_KINDS, stated, strict=True)
        if bounds is not None
        for value, upper in ((bounds.max, True), (bounds.min, False))
        if value is not None
        for channel, v in enumerate(np.ravel(value))
        if upper or v > 0
    ]


def implied_limits(spec: Spec) -> list[PowerLimit]:
    """Return the limits on powers that follow from limits on samples and moves: a^2 from |u| <= a."""
    kinds: list[PowerKind] = ["input", "output", "moves"]
    most = [*stated_peaks(spec), stated_moves(spec) if spec.plant.sampled else None]
    return [
        PowerLimit(kind, float(a) ** 2, channel=channel if peak.size > 1 else None, implied=True)
        for kind, peak in zip(kinds, most, strict=True)
        if peak is not None
        for channel, a in enumerate(peak)
        if np.isfinite(a)
    ]


def build_density_limits(spec: Spec, experiment: Experiment) -> list[DensityLimit]:
    """Return the bounds on the density of the excitation at every frequency of its band."""
    stated = spec.limits.spectrum
    if stated is None:
        return []
    units, limits = build_units(spec), []
    for curve, upper in ((stated.max, True), (stated.min, False)):
        if curve is None or curve == 0.0:
            continue
        key = f"{_KEY}.{'max' if upper else 'min'}" if stated.min is not None else _KEY
        level, knots, singular, zero = _level(spec, curve, key, experiment.band)
        grid = graded_grid(
            np.concatenate([experiment.singularities, singular]), *experiment.band, knots=knots
        )
        if upper and zero is None and level(grid).min() <= 0.0:
            zero = float(grid[int(np.argmin(level(grid)))])
        if zero is not None:
            message = f"the {'upper' if upper else 'lower'} bound vanishes at {units.named(zero)}"
            raise spec.complain("bad-limit", message, hint="give a small positive bound instead", key=key)
        limits.append(DensityLimit(level, grid, upper))
    if len(limits) == 2:
        grid = np.union1d(limits[0].grid, limits[1].grid)
        room = limits[0].level(grid) - limits[1].level(grid)
        if room.min() <= 0:
            at = units.named(grid[int(np.argmin(room))])
            message = f"min reaches max at {at}: no spectrum fits in between"
            raise spec.complain("bad-limit", message, hint="lower min or raise max there", key=_KEY)
    return limits


def _level(
    spec: Spec, curve: Curve, key: str, band: tuple[float, float]
) -> tuple[Callable[[Array], Array], Array, ComplexArray, float | None]:
    """Return the level over frequency, its kinks, points of fast change, and its zero; or raise."""
    nowhere, smooth = np.zeros(0), np.zeros(0, dtype=complex)
    if isinstance(curve, float | int):
        constant = float(curve)
        return lambda w: np.full(np.shape(w), constant), nowhere, smooth, None
    if curve.kind == "table":
        columns = read_frequency_table(spec, curve.table, ["phi"], key)
        frequency, value = columns["frequency"], columns["phi"]
        if np.any(value < 0):
            raise bad_table(spec, curve.table, "phi must not be negative", "correct the values", key)
        return lambda w: np.interp(w, frequency, value), frequency, smooth, None
    W = build_weight(spec, curve, key)
    check_finite(spec, W, band, "bad-limit", key)
    return lambda w: np.abs(W.at(w)) ** 2, nowhere, W.singularities, on_the_limit(W.zero_points, band)
