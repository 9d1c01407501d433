"""Tables and curves of a design, in the units of the spec."""

from __future__ import annotations

import numpy as np

from inputdesign_cli.accuracy import ModelError
from inputdesign_cli.design.least_cost import LeastCost
from inputdesign_cli.outcome import BoundCurves, OptimalityCurves, SignalCurves, SpectrumCurves, Table
from inputdesign_cli.plant.polynomial import Array
from inputdesign_cli.spec import Spec
from inputdesign_cli.spectrum import FirBasis

_POINTS = 800
# Logarithmic axes start where the band does, or three decades below its end if it starts at zero.
_DECADES = 1e-3
_ZERO = 1e-5


def _axis(lo: float, hi: float, extra: Array) -> Array:
    start = lo if lo > _ZERO * hi else _DECADES * hi
    inside = extra[(extra >= start) & (extra <= hi)]
    return np.unique(
        np.concatenate([np.geomspace(start, hi, _POINTS), np.linspace(start, hi, _POINTS // 2), inside])
    )


def _frequency_header(spec: Spec) -> str:
    return f"frequency_rad_per_{spec.time_unit}"


def spectrum_curves(spec: Spec, basis: FirBasis, x: Array, white: float) -> tuple[Table, SpectrumCurves]:
    """spectrum.csv and its plot; w from 0 to pi / sample_time."""
    w = np.concatenate([[0.0], _axis(0.0, np.pi, np.zeros(0))])
    phi = basis.density(x, w)
    frequency = w / spec.sample_time
    table = Table({_frequency_header(spec): frequency, "phi": phi})
    symbol = "r" if spec.closed_loop else "u"
    return table, SpectrumCurves(frequency[1:], density=phi[1:], white=white, symbol=symbol)


def bound_curves(spec: Spec, solution: LeastCost) -> tuple[Table, BoundCurves]:
    """bound.csv and its plot over the band of the requirement."""
    problem = solution.problem
    requirement = problem.requirements[0]
    assert isinstance(requirement, ModelError)
    information = solution.result.information
    active = solution.result.active_frequencies
    peaks = np.array([v.frequency for v in requirement.violations(information, above=0.5)])
    w = _axis(*requirement.band, np.concatenate([active, peaks]))
    r_u = requirement.error_bound(information, w)
    r_adm = requirement.admissible.at(w)
    G = np.abs(problem.experiment.model.plant_at(w))
    white = np.zeros(problem.basis.size)
    white[0] = solution.white_power
    frequency = w / spec.sample_time
    table = Table({_frequency_header(spec): frequency, "r_u": r_u, "r_adm": r_adm, "G_abs": G})
    curves = BoundCurves(
        frequency=frequency,
        r_u=r_u,
        G_abs=G,
        r_adm=r_adm,
        r_u_white=requirement.error_bound(problem.information(white), w),
        active=distinct(np.maximum(active, w[0])) / spec.sample_time,
    )
    return table, curves


def optimality_curves(spec: Spec, solution: LeastCost) -> OptimalityCurves:
    """tr(Y D(w)) / price(w) of the bound over every spectrum: at most one, one where power pays."""
    problem, anything = solution.problem, solution.any_spectrum
    value = problem.value(anything.certificate.weight)
    lines = getattr(anything.basis, "frequencies", np.zeros(0))
    support = lines[anything.x > 1e-3 * anything.x.sum()]
    w = _axis(0.0, np.pi, support)
    ratio = value.density(w) / problem.price.density(w)
    marks = distinct(np.maximum(support, w[0]))
    return OptimalityCurves(w / spec.sample_time, ratio, marks / spec.sample_time)


def signal_curves(spec: Spec, samples: Array) -> tuple[Table, SignalCurves]:
    """signal.csv and its plot."""
    time = spec.sample_time * np.arange(samples.size, dtype=np.float64)
    channel = "r1" if spec.closed_loop else "u1"
    return Table({f"time_{spec.time_unit}": time, channel: samples}), SignalCurves(time, {channel: samples})


def distinct(w: Array) -> Array:
    """One frequency for each cluster within a thousandth: the exchange visits an optimum several times."""
    ordered = np.sort(w)
    return ordered[np.diff(ordered, prepend=-1.0) > 1e-3 * ordered]
