"""Say a result in words and in tables, for the terminal and for a page; see `templates`."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from inputdesign_cli.outcome import Outcome, Simulation
from inputdesign_cli.outcome.design import LossMoments, TheoreticalLoss, objective
from inputdesign_cli.outcome.sentences import parameter, sentences, shown, spoken
from inputdesign_cli.outcome.simulation import Limits, Spread, TriedInput

# The template of each part of a result; templates that a run does not need are not compiled.
_TEMPLATES = {
    **dict.fromkeys(("asked", "facts", "proofs"), "design.txt"),
    **dict.fromkeys(("estimate", "verdict", "campaign_stands", "next"), "data.txt"),
    **dict.fromkeys(("answer", "assumptions"), "answer.txt"),
}
# The status of an excitation that was given, in words.
_GIVEN = {"given": "", "met": ": it meets the accuracy", "missed": ": it misses the accuracy"}
BREAK = "\n"  # begins a remark within a cell
_SPREAD = "{:.4g} ± {:.2g}"
# An estimate below this share of its standard deviation is shown as zero: its digits have no meaning.
_NOTHING = 1e-3
_NORMAL = 1.96  # standard deviations from the mean to the limits of 95 %


class Fact(NamedTuple):
    """Holds a line of a table: its name, the value, and a note that may be empty."""

    name: str
    value: str
    note: str = ""


def said(part: str, outcome: Outcome, **more: object) -> list[str]:
    """Return the sentences of a part of the templates about a result.

    Args:
        part: asked, proofs (bounds on all other experiments), verdict, assumptions, ..
        more: further facts of the part by name.
    """
    template = _TEMPLATES[part]
    of_data = outcome.identification, outcome.assessment, outcome.validation, outcome.campaign
    if template == "data.txt" and not any(section is not None for section in of_data):
        return []
    kind = None if outcome.objective is None else outcome.objective.kind
    known = vars(outcome) | {
        "kind": kind,
        "words": objective(kind),
        "length": outcome.samples if outcome.signal is None else outcome.signal.samples,
        "given": None if outcome.identification is not None else _GIVEN.get(outcome.status or ""),
    }
    return sentences("inputdesign_cli.report", template, part, known | more)


def facts(outcome: Outcome, time_unit: str = "", part: str = "facts") -> list[Fact]:
    """Return the cost of an experiment and its accuracy, if the result has them.

    Args:
        time_unit: the unit of time of frequencies.
        part: `facts`, or the fit of an `estimate` to data, or the state of a campaign (`campaign_stands`).
    """
    parts = (text.split("::") for text in said(part, outcome, time_unit=time_unit))
    return [Fact(*(one.strip() for one in each)) for each in parts]


def answer(verb: str, outcome: Outcome) -> str:
    """Return the sentences that answer a command, by its name (`verb`)."""
    stands, verdicts = facts(outcome, part="campaign_stands"), said("verdict", outcome)
    return " ".join(said("answer", outcome, verb=verb, stands=stands, verdicts=verdicts))


def provenance(environment: Mapping[str, object], more: Iterable[Fact] = ()) -> list[Fact]:
    """Return the versions, and further facts on the origin of the numbers."""
    return [*more, *(Fact(name, str(version)) for name, version in environment.items() if version)]


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
        rows.append((parameter(name), said, f"{float(f'{spread:.2g}'):g}", limits))
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
    cells = [_cells(entry) for entry in found.inputs.values()]
    columns = {name: [row[name] for row in cells] for name in (cells[0] if cells else ())}
    filled = {name: column for name, column in columns.items() if any(column)}
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

    It is empty unless `several` agrees with whether the true plant has an r_adm of its own.
    """
    own = (one.within_r_adm_true is None) != several
    return _share(one.within_r_adm, one.within_r_adm_limits) if own else ""


def _mean_and_tail(found: Spread | None) -> str:
    return "" if found is None else f"{found.mean:.3g}{BREAK}95 % below {found.quantile_95:.3g}"


def _spread(found: LossMoments | None) -> str:
    return "" if found is None else _SPREAD.format(found.mean, found.sd)


def _cells(one: TriedInput) -> dict[str, str]:
    """Return the results of the runs with an input as text by column; empty where one is not known."""
    model, found, theory = one.on_design_model, one.mean_estimate, one.theory
    known = one.mse is not None and isinstance(found, np.ndarray)
    deviations = ""
    if one.deviation_ratio is not None and one.chance is not None:
        low, high = one.chance
        ratio = one.deviation_ratio
        deviations = f"{ratio.least:.4g} to {ratio.largest:.4g}{BREAK}chance {low:.3g} to {high:.3g}"
    predicted = ""
    if theory is not None:
        predicted = _spread(theory.loss) if isinstance(theory, TheoreticalLoss) else shown(theory.mse)
    ways = {"stopped": one.stopped, "missed": one.missed, "undecided": one.undecided}
    ended = (f"{n} {way}" for way, n in (ways | {"unplanned": one.unplanned}).items() if n)
    return {
        "loss": _spread(one.loss),
        "mean squared error": ""
        if one.mse is None
        else _SPREAD.format(one.mse, one.mse_standard_error or 0.0),
        "theory": predicted,
        "mean estimate": " ".join(f"{value:.4g}" for value in found) if known and found is not None else "",
        "deviations over theory": deviations,
        "worst over admitted": "" if one.worst_ratio is None else shown(one.worst_ratio),
        "within r_adm": _within(one, several=False),
        "errors within r_adm of the plant of the spec": _within(one, several=True),
        "were the design model true": ""
        if model is None
        else _share(model.within_r_adm, model.within_r_adm_limits),
        "within r_u": _share(one.within_r_u, one.within_r_u_limits),
        "cost": "" if one.cost is None else f"{one.cost:.5g}",
        "errors within r_adm of the true plant": _share(one.within_r_adm_true, one.within_r_adm_true_limits),
        "over the spectrum that knows the plant": _mean_and_tail(one.cost_over_oracle),
        "over the record of that": _mean_and_tail(one.cost_over_oracle_record),
        "true ratio": _mean_and_tail(one.true_ratio),
        "samples": "" if one.samples is None else f"{one.samples.mean:.0f}",
        "ended": ", ".join(ended),
        "unstable loops": str(one.unstable or ""),
        "not settled": str(one.not_converged or ""),
    }
