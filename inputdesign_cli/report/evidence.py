"""What data and simulated experiments say, as tables."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from inputdesign_cli.outcome import Outcome, Simulation
from inputdesign_cli.outcome.design import LossMoments, TheoreticalLoss
from inputdesign_cli.outcome.sentences import shown, spoken
from inputdesign_cli.outcome.simulation import Limits, Spread, TriedInput

BREAK = "\n"  # within a cell: what follows is a remark
_SPREAD = "{:.4g} ± {:.2g}"
# Below this share of its standard deviation the digits of an estimate say nothing, not even its order.
_NOTHING = 1e-3
_NORMAL = 1.96  # standard deviations to either side of 95 %


@dataclass(frozen=True)
class Rows:
    """Holds a table: the first column has names, the others numbers."""

    head: tuple[str, ...]
    rows: tuple[tuple[str, ...], ...]


def estimate_table(outcome: Outcome) -> Rows | None:
    """Return the estimated parameters with their standard deviations and 95 % limits."""
    found = outcome.identification
    if found is None or found.theta is None or found.standard_deviation is None:
        return None
    rows = []
    for name, value in found.theta.items():
        spread = found.standard_deviation[name]
        said = "0" if abs(value) < _NOTHING * spread else f"{value:.6g}"
        limits = f"{value - _NORMAL * spread:.4g} to {value + _NORMAL * spread:.4g}"
        rows.append((name, said, f"{spread:.2g}", limits))
    return Rows(("parameter", "estimate", "standard deviation", "95 % limits"), tuple(rows))


def requirement_table(outcome: Outcome, time_unit: str) -> Rows | None:
    """Return each requirement with the ratio that the data reach."""
    assessment = outcome.assessment
    if assessment is None or not assessment.requirements:
        return None
    unclear = "undecided" if assessment.verdict == "undecided" else ""
    rows = tuple(
        (
            f"{spoken(entry.name)} {entry.entry or ''}".strip(),
            f"{entry.worst_ratio:.4g}",
            "" if entry.frequency is None else f"{entry.frequency:.4g}",
            unclear or ("met" if entry.worst_ratio <= 1.0 + 1e-9 else "missed"),
        )
        for entry in assessment.requirements
    )
    return Rows(("requirement", "of the admissible error", f"at (rad/{time_unit})", "verdict"), rows)


def simulation_table(found: Simulation | None) -> Rows | None:
    """Return one row for each input that was tried; None without a simulation."""
    if found is None:
        return None
    cells = {name: [cell(entry) for entry in found.inputs.values()] for name, cell in _COLUMNS.items()}
    filled = {name: column for name, column in cells.items() if any(column)}
    if not filled:
        return None
    each = zip(map(spoken, found.inputs), *filled.values(), strict=True)
    return Rows(("input", *filled), tuple(each))


def _share(value: float | None, limits: Limits | None) -> str:
    if value is None or limits is None:
        return ""
    low, high = (100 * limit for limit in limits)
    return f"{100 * value:.1f} %{BREAK}95 % limits {low:.1f} to {high:.1f}"


def _within(one: TriedInput, *, several: bool) -> str:
    """Return the share within r_adm of the design as text.

    It is empty unless `several` says rightly whether the true plant has an r_adm of its own.
    """
    own = (one.within_r_adm_true is None) != several
    return _share(one.within_r_adm, one.within_r_adm_limits) if own else ""


def _on_design_model(one: TriedInput) -> str:
    found = one.on_design_model
    return "" if found is None else _share(found.within_r_adm, found.within_r_adm_limits)


def _mean_squared_error(one: TriedInput) -> str:
    return "" if one.mse is None else _SPREAD.format(one.mse, one.mse_standard_error or 0.0)


def _mean_estimate(one: TriedInput) -> str:
    found = one.mean_estimate
    known = one.mse is not None and isinstance(found, np.ndarray)
    return " ".join(f"{value:.4g}" for value in found) if known and found is not None else ""


def _deviations(one: TriedInput) -> str:
    if one.deviation_ratio is None or one.chance is None:
        return ""
    low, high = one.chance
    found = one.deviation_ratio
    return f"{found.least:.4g} to {found.largest:.4g}{BREAK}chance {low:.3g} to {high:.3g}"


def _mean_and_tail(found: Spread | None) -> str:
    return "" if found is None else f"{found.mean:.3g}{BREAK}95 % below {found.quantile_95:.3g}"


def _spread(found: LossMoments | None) -> str:
    return "" if found is None else _SPREAD.format(found.mean, found.sd)


def _theory(one: TriedInput) -> str:
    if one.theory is None:
        return ""
    return _spread(one.theory.loss) if isinstance(one.theory, TheoreticalLoss) else shown(one.theory.mse)


def _endings(one: TriedInput) -> str:
    ways = {"stopped": one.stopped, "missed": one.missed, "undecided": one.undecided}
    return ", ".join(f"{n} {way}" for way, n in (ways | {"unplanned": one.unplanned}).items() if n)


_COLUMNS: dict[str, Callable[[TriedInput], str]] = {
    "loss": lambda one: _spread(one.loss),
    "mean squared error": _mean_squared_error,
    "theory": _theory,
    "mean estimate": _mean_estimate,
    "deviations over theory": _deviations,
    "worst over admitted": lambda one: "" if one.worst_ratio is None else shown(one.worst_ratio),
    "within r_adm": lambda one: _within(one, several=False),
    "errors within r_adm of the plant of the spec": lambda one: _within(one, several=True),
    "were the design model true": _on_design_model,
    "within r_u": lambda one: _share(one.within_r_u, one.within_r_u_limits),
    "cost": lambda one: "" if one.cost is None else f"{one.cost:.5g}",
    "errors within r_adm of the true plant": lambda one: _share(
        one.within_r_adm_true, one.within_r_adm_true_limits
    ),
    "over the spectrum that knows the plant": lambda one: _mean_and_tail(one.cost_over_oracle),
    "over the record of that": lambda one: _mean_and_tail(one.cost_over_oracle_record),
    "true ratio": lambda one: _mean_and_tail(one.true_ratio),
    "samples": lambda one: "" if one.samples is None else f"{one.samples.mean:.0f}",
    "ended": _endings,
    "unstable loops": lambda one: str(one.unstable or ""),
    "not settled": lambda one: str(one.not_converged or ""),
}
