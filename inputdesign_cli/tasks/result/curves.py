"""Tables and curves of a design or an analysis, in the units of the spec."""

from __future__ import annotations

import numpy as np

from inputdesign_cli.accuracy import error_bound
from inputdesign_cli.design.convex.designs import Design
from inputdesign_cli.information import Experiment
from inputdesign_cli.plant.polynomial import Array
from inputdesign_cli.runs.results import BoundCurves, BoundPanel, OptimalityCurves, SpectrumCurves, Table
from inputdesign_cli.specification import Spec
from inputdesign_cli.spectrum import Basis, LinesBasis
from inputdesign_cli.tasks.build.model_error import sampled_band
from inputdesign_cli.tasks.build.task import Task

_POINTS = 800
# Logarithmic axes start where the band does, or three decades below its end if it starts at zero.
_DECADES = 1e-3
_ZERO = 1e-5
_PRICED = 1e-12


def axis(lo: float, hi: float, extra: Array) -> Array:
    """Frequencies that look smooth on a logarithmic axis, with the `extra` ones among them."""
    start = lo if lo > _ZERO * hi else _DECADES * hi
    inside = extra[(extra >= start) & (extra <= hi)]
    return np.unique(
        np.concatenate([np.geomspace(start, hi, _POINTS), np.linspace(start, hi, _POINTS // 2), inside])
    )


def frequency_header(spec: Spec) -> str:
    """The header of a column of frequencies."""
    return f"frequency_rad_per_{spec.time_unit}"


def spectrum_curves(spec: Spec, basis: Basis, x: Array, white: float | None) -> tuple[Table, SpectrumCurves]:
    """spectrum.csv and its plot; a density from 0 to pi / sample_time, or sinusoids with their powers."""
    symbol = "r" if spec.closed_loop else "u"
    if isinstance(basis, LinesBasis):
        order = np.argsort(basis.frequencies)
        kept = order[x[order] > 1e-9 * x.sum()] if x.any() else order[:0]
        frequency, power = basis.frequencies[kept] / spec.sample_time, x[kept]
        table = Table({frequency_header(spec): frequency, "power": power})
        span = np.array([frequency.min() / 3, np.pi / spec.sample_time]) if kept.size else np.array([0.01, 1])
        return table, SpectrumCurves(
            span, white=white, line_frequency=frequency, line_power=power, symbol=symbol
        )
    w = np.concatenate([[0.0], axis(0.0, np.pi, np.zeros(0))])
    phi = basis.density(x, w)  # type: ignore[attr-defined]
    return density_curves(spec, w, phi, white)


def density_curves(spec: Spec, w: Array, phi: Array, white: float | None) -> tuple[Table, SpectrumCurves]:
    """spectrum.csv and its plot for a density Phi at frequencies `w` in rad/sample, the first of them 0."""
    symbol = "r" if spec.closed_loop else "u"
    frequency = w / spec.sample_time
    table = Table({frequency_header(spec): frequency, "phi": phi})
    return table, SpectrumCurves(frequency[1:], density=phi[1:], white=white, symbol=symbol)


def bound_curves(
    spec: Spec, experiment: Experiment, task: Task, information: Array, *, white: Array | None, active: Array
) -> tuple[Table, BoundCurves]:
    """bound.csv and its plot over the band of the requirement on the model error (all frequencies if none).

    Args:
        information: M (k, k) in the coordinates of `experiment`; `white`: that of the baseline.
        active: frequencies (rad/sample) of the requirements that bind.
    """
    stated = task.model_error
    band = stated.band if stated is not None else sampled_band(spec, None)
    extra = active
    if stated is not None:
        grid = stated.grid
        extra = np.concatenate([active, grid[:: max(len(grid) // 400, 1)]])
    w = axis(*band, extra)
    r_u = error_bound(experiment, information, task.alpha, w)
    G = np.abs(experiment.model.plant_at(w))
    frequency = w / spec.sample_time
    columns = {frequency_header(spec): frequency, "r_u": r_u}
    r_adm = None
    if stated is not None:
        r_adm = stated.admissible.at(w)
        columns["r_adm"] = r_adm
    columns["G_abs"] = G
    panel = BoundPanel(
        frequency=frequency,
        r_u=r_u,
        G_abs=G,
        r_adm=r_adm,
        r_u_white=None if white is None else error_bound(experiment, white, task.alpha, w),
        active=distinct(np.maximum(active, w[0])) / spec.sample_time if stated is not None else np.zeros(0),
    )
    return Table(columns), BoundCurves((panel,))


def optimality_curves(spec: Spec, design: Design) -> OptimalityCurves | None:
    """value(w) / price(w) of the bound over every spectrum: at most one, one where power pays."""
    anything = design.any_spectrum
    price, value = anything.certificate.price, anything.certificate.value
    if price is None or value is None:
        return None
    assert isinstance(anything.basis, LinesBasis)
    lines = anything.basis.frequencies
    # By what is paid, not by power: power is almost free near DC in a loop with integral action.
    paid = anything.x * price.density(lines)
    support = lines[paid > 1e-3 * paid.sum()]
    lo, hi = (lines.min(), lines.max()) if spec.limits.band is not None else (0.0, np.pi)
    w = axis(float(lo), float(hi), support)
    cost = price.density(w)
    seen = cost > _PRICED * cost.max()
    w, ratio = w[seen], value.density(w)[seen] / cost[seen]
    marks = distinct(np.maximum(support, w[0]))
    return OptimalityCurves(w / spec.sample_time, ratio, marks / spec.sample_time)


def distinct(w: Array) -> Array:
    """One frequency for each cluster within a thousandth: the exchange visits an optimum several times."""
    ordered = np.sort(w)
    return ordered[np.diff(ordered, prepend=-1.0) > 1e-3 * ordered]
