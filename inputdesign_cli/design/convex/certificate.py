"""Lower bounds that we prove ourselves: dual points, evaluated and made exactly feasible.

M' of a scenario is its information matrix (see `Problem`), s the factor or number of samples that is
minimised, M_fixed + s M_scaled the part of M' without a spectrum; "side" marks requirements on M' / s.

Every cut gives tr(Y M') >= r for all admissible M' of its scenario; every limit a(z) <= b (times s) takes a
weight w >= 0. With price = cost + sum w a over the upper limits and value = sum_s tr(Y_s M_s(.)) + sum w a
over the lower ones, let t be the largest number with price - t value >= 0 on the whole cone of spectra. Then,
for the goal "cost",

    cost(z) >= t (sum r - sum_s tr(Y_s M0_s) + sum_lower w b) - sum_upper w b

(for the largest of several costs, "cost" is their mean with weights mu >= 0 of the sum one, which is never
larger than the largest)

and for the goals with s, from 0 <= sum_upper w (s b - a(z)) + t (tr(Y M') - r ...) and cost = 0, with the
sum over the scenarios understood,

    s >= t (sum r - tr(Y M_fixed)) / (sum_upper w b - t sum_lower w b + t tr(Y M_scaled) - t sum_side r).

The multipliers of the solver only suggest Y, w and mu; the bounds hold whatever they are.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from inputdesign_cli.arrays import Array
from inputdesign_cli.design.convex.master import Proof, Row
from inputdesign_cli.design.convex.problem import Problem, weighty_ones
from inputdesign_cli.plant import local_maxima
from inputdesign_cli.spectrum import Functional, weighted_mean

# Every power limit gets this share of the weight of all limits in addition, so that no spectrum is free; the
# bound falls by as much. The multiplier of a weak limit is below the accuracy of the solver, and spectra that
# only this limit prices would then set the scale. The largest share is tried last.
_LEAST_SHARES = (1e-9, 1e-8, 5e-8, 2e-7, 1e-6)
# The price of forms of the lags nearly vanishes at some frequencies, and needs larger shares.
_FORM_SHARES = (1e-4, 1e-3)
_LIFT = 1e-12
_TINY = np.finfo(float).tiny


@dataclass(frozen=True)
class Certificate:
    """Holds a proved lower bound on the objective, and the dual point that proves it.

    `weights` Y_s (S, k, k) and `limits` (a weight for each power limit) are scaled so that price - value >= 0
    on the cone of spectra. `price` and `value` are the functionals of the module's text. `directions` are the
    spectra where the inequality is tightest (see `spectrum.Pricing`). `costs` are the weights of the costs
    whose maximum is minimised. `form` (m, r, r) is the price of the amplitude, a form of the lags of the
    excitation, which is at most `form_share` for signals within the amplitude.
    """

    bound: float
    weights: NDArray[np.float64]
    directions: Array
    limits: Array
    price: Functional | None = None
    value: Functional | None = None
    costs: Array = field(default_factory=lambda: np.ones(1))
    form: NDArray[np.float64] | None = None
    form_share: float = 0.0

    @property
    def shares(self) -> Array:
        """Return the part (S,) that each scenario takes in the proof, by its requirements or by its cost."""
        required = np.trace(self.weights, axis1=1, axis2=2)
        shares = required / max(float(required.sum()), _TINY)
        return np.maximum(shares, self.costs) if self.costs.size > 1 else shares


def certify(problem: Problem, proof: Proof, rows: Sequence[Row] = ()) -> Certificate:
    """Prove a lower bound with these multipliers for the spectra of the problem.

    Args:
        rows: the limits that the weights `proof.rows` belong to.
    """
    weights = np.zeros_like(problem.baselines)
    for cut in proof.cuts:
        weights[cut.scenario] += cut.weight
    value = problem.value(weights)
    formed = problem.polytope is not None
    first, *others = _FORM_SHARES if formed else _LEAST_SHARES
    found = _certified(problem, proof, weights, value, rows, first)
    for share in others if problem.goal != "cost" else ():
        other = _certified(problem, proof, weights, value, rows, share)
        if other.bound > found.bound:
            found = other
        elif not formed:
            break
    return found


def _certified(
    problem: Problem,
    proof: Proof,
    weights: NDArray[np.float64],
    value: Functional,
    rows: Sequence[Row],
    share: float,
) -> Certificate:
    required = sum(cut.level for cut in proof.cuts if not cut.side)
    scaled_required = sum(cut.level for cut in proof.cuts if cut.side)
    of_rows = proof.rows if problem.goal == "cost" else _kept(rows, proof.rows, share)
    price = weighted_mean(problem.costs, proof.costs) if problem.goal == "cost" else None
    upper = lower = fixed_lower = 0.0
    forms = [(row, w) for row, w in zip(rows, of_rows, strict=True) if row.form is not None]
    form, of_forms = np.asarray(sum(w * row.form for row, w in forms)), sum(w * row.bound for row, w in forms)
    if np.any(form):  # one functional for all forms of the lags: many of them may count
        together, upper = problem.form(form), upper + of_forms
        price = together if price is None else price + together
    for row, w in zip(rows, of_rows, strict=True):
        if w == 0.0 or row.form is not None:
            continue
        if row.upper:
            price = row.functional * w if price is None else price + row.functional * w
            upper += w * row.bound
        else:
            value = value + row.functional * w
            if problem.scaled and not problem.floors_fixed:
                lower += w * row.bound
            else:
                fixed_lower += w * row.bound
    if price is None:
        raise ValueError("a goal with s needs an upper limit")
    grid, lift, lifted = _grid(problem, weights, proof.costs), 0.0, 0.0
    if forms:
        grid = problem.with_form_grid(grid)
        price, lift = _lifted(problem, price, grid)
        lifted = lift * problem.amplitude_power
        upper += lifted
    pricing = problem.basis.price(price, value, grid)
    gain = required - float(np.sum(weights * problem.fixed_information)) + fixed_lower
    t = pricing.scale if gain > 0 and np.isfinite(pricing.scale) else 0.0
    if problem.goal == "cost":
        bound, unit = t * gain - upper, 1.0
    else:
        scaled = float(np.sum(weights * problem.scaled_information))
        spent = upper + t * (scaled - lower - scaled_required)
        bound, unit = (t * gain / spent, 1.0 / spent) if spent > 0 else (0.0, 0.0)
    t = t if bound > 0.0 else 0.0
    return Certificate(
        bound=max(bound, 0.0),
        weights=t * unit * weights,
        directions=pricing.directions,
        limits=_of_limits(problem, rows, unit * of_rows, t),
        price=price * unit,
        value=value * (t * unit),
        costs=proof.costs,
        form=unit * _raised(form, lift) if forms else None,
        form_share=unit * (lifted + of_forms),
    )


def _of_limits(problem: Problem, rows: Sequence[Row], of_rows: Array, scale: float) -> Array:
    """Return the multipliers of the limits that rows stand for; lower limits count `scale` times."""
    shares = np.zeros(len(problem.limits))
    for row, w in zip(rows, of_rows, strict=True):
        if row.limit is not None:
            shares[row.limit] = w * (1.0 if row.upper else scale)
    return shares


def _grid(problem: Problem, weights: NDArray[np.float64], costs: Array) -> Array:
    """Return the frequencies at which the plants that matter, and whose cost is paid, may change fast."""
    paid = np.flatnonzero(costs) if costs.size > 1 else np.zeros(0, dtype=int)
    return problem.gradients.grid_of(sorted({*weighty_ones(weights), *paid.tolist()}))


def _lifted(problem: Problem, price: Functional, grid: Array) -> tuple[Functional, float]:
    """Return the price plus a multiple of the power that makes it nowhere negative, and that multiple.

    A form of the lags may be negative at some frequencies, where spectra would have a negative price.
    """

    def below(w: Array) -> Array:
        density = price.density(w)
        return -density if density.ndim == 1 else -np.linalg.eigvalsh(density)[:, 0]

    on_grid = below(grid)
    size = float(np.abs(on_grid).max())
    _, depths = local_maxima(below, grid, on_grid)
    lift = max(float(np.max(depths, initial=0.0)), float(on_grid.max()), 0.0) + _LIFT * size
    return price + problem.power("excitation") * lift, lift


def _raised(form: NDArray[np.float64], lift: float) -> NDArray[np.float64]:
    raised = form.copy()
    raised[0] += lift * np.eye(form.shape[1])
    return raised


def _kept(rows: Sequence[Row], weights: Array, share: float) -> Array:
    """Return the weights, raised for each power limit by a `share` of the weighted sum of upper bounds."""
    if not len(rows):
        return weights
    powers = np.array([row.upper and row.limit is not None for row in rows])
    bounds = np.array([row.bound for row in rows])
    spent = float(np.sum((weights * bounds)[[row.upper for row in rows]]))
    added = np.zeros(len(rows))
    added[powers] = share * max(spent, 1e-30) / bounds[powers]
    return weights + added
