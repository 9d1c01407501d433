"""Write the outcome, tables and figures of a frequency response that is designed or tried."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import scipy
from numpy.typing import NDArray

from inputdesign_cli.design.convex.response_lines import Goal
from inputdesign_cli.finding import Finding
from inputdesign_cli.findings.designs import StatedLimits, limits_not_kept
from inputdesign_cli.findings.frequency_responses import noise_leaks, record_of_whole_periods, start_shifts
from inputdesign_cli.monte_carlo.response import ResponseStudy
from inputdesign_cli.outcome import (
    Baseline,
    MeasuredLines,
    Objective,
    Outcome,
    Powers,
    Solver,
    Spectrum,
    White,
)
from inputdesign_cli.outcome.curves import Curves, DeviationCurves, SpectrumCurves
from inputdesign_cli.outcome.estimate import DetectionLines
from inputdesign_cli.outcome.results import Results, Table
from inputdesign_cli.outcome.simulation import Range, TriedInput
from inputdesign_cli.questions.common.delivery import proof_status, results_of
from inputdesign_cli.questions.common.record import RecordRequest
from inputdesign_cli.questions.common.signal_outcome import signal_of, with_record
from inputdesign_cli.questions.common.spectrum import hermitian_columns
from inputdesign_cli.questions.frequency_response.terms import Planned, ResponseTerms, deviation_curves

_KINDS: dict[Goal, str] = {
    "cost": "least_cost",
    "factor": "accuracy_factor",
    "samples": "shortest_experiment",
}
_ROUNDING = 1e-9
_CHANCE = 0.05


def response_outcome(terms: ResponseTerms, plan: Planned, timing: dict[str, float]) -> Outcome:
    """Return what result.json says of a design or of given lines."""
    units, lines, designed = terms.header.units, terms.lines, terms.goal != "given"
    ratios = lines.ratios(lines.deviations(plan.powers, plan.counted))
    worst, (power, cost) = int(np.argmax(ratios)), terms.powers(plan.powers)
    odd, even = (terms.grid.at(silent) / units.frequency for silent in (terms.grid.odd, terms.grid.even))
    met = "met" if ratios[worst] <= 1.0 + _ROUNDING else "missed"
    objective, baseline = _objective(terms, plan) if designed else (None, None)
    powers = _matrices(plan.powers) if units.inputs > 1 else plan.powers[:, 0]
    return Outcome(
        title=terms.header.title,
        status=proof_status(plan.design.gap, terms.tolerance) if designed else met,
        objective=objective,
        cost=cost,
        samples=plan.length,
        power=power,
        spectrum=Spectrum("multisine", {"frequencies": terms.frequency, "powers": powers}),
        baseline=baseline,
        frequency_response=MeasuredLines(
            lines=int(ratios.size),
            period=terms.grid.period,
            periods=terms.periods.each(plan.length),
            blocks=terms.periods.blocks,
            transient=terms.periods.skip,
            counted=plan.counted,
            worst_ratio=float(ratios[worst]),
            worst_frequency=float(terms.frequency[worst]),
            detection=DetectionLines(odd, even) if even.size else None,
        ),
        solver=Solver("lines", terms.tolerance) if designed else None,
        timing_s=timing,
    ).saying(_findings(terms, plan, power))


def _objective(terms: ResponseTerms, plan: Planned) -> tuple[Objective, Baseline]:
    """Return the value with its bound, and what lines of equal power need."""
    problem, value, bound = plan.problem, plan.design.value, plan.design.bound
    flat = float(np.max(problem.needed)) * np.ones(problem.needed.size)
    if terms.goal == "cost":
        rows, floors = problem.lower
        flat = flat * float(np.max(floors / (rows @ (flat / problem.needed)), initial=1.0))
        cost = float(problem.price @ flat)
        power, _ = terms.powers(flat.reshape(plan.powers.shape))
        white = White(cost=cost, ratio=cost / value, power=power)
    else:
        within = problem.alike(flat / problem.needed)
        if terms.goal == "samples":
            value, bound, white = 1.0 / value, 1.0 / bound, White(samples=plan.counted / within)
        else:
            value, bound, white = value**-0.5, bound**-0.5, White(value=float(within**-0.5))
    gap = abs(value - bound) / value
    kind = _KINDS[terms.goal]
    return Objective(kind, value, lower_bound=min(bound, value), relative_gap=gap), Baseline(white)


def _findings(terms: ResponseTerms, plan: Planned, power: Powers) -> list[Finding]:
    """Return what a user should know before applying the record."""
    found = start_shifts(plan.shift)
    if terms.goal in ("cost", "samples"):
        found += noise_leaks(plan.record.worst_ratio)
    if terms.goal != "samples":
        times = terms.periods.blocks * terms.periods.each(plan.length)
        found += record_of_whole_periods(plan.length, terms.asked, times, terms.grid.period)
    if terms.goal == "given":
        stated = StatedLimits(terms.limits, None, None, None, terms.most_samples)
        found += limits_not_kept(stated, plan.length, power, None)
    return found


def response_results(
    terms: ResponseTerms, plan: Planned, request: RecordRequest, timing: dict[str, float]
) -> Results:
    """Return the outcome with its tables and figures."""
    units, experiment = terms.header.units, terms.experiment
    signal = signal_of(request, units, experiment, plan.record)
    signal = replace(signal, worst_ratio=plan.record.worst_ratio, start_shift=plan.shift)
    matrices = _matrices(plan.powers)
    spectrum = {units.frequency_header: terms.frequency, **hermitian_columns(matrices, "power")}
    columns, deviations = deviation_curves(units, terms.frequency, terms.lines, _deviations(terms, plan))
    for i in range(units.outputs):
        columns[f"noise_spectrum{'' if units.outputs == 1 else f'_{i + 1}'}"] = terms.lines.noise[:, i]
    tables = {"deviations": Table(columns), "spectrum": Table(spectrum)}
    lines = SpectrumCurves(terms.frequency, matrices.astype(complex), lines=True)
    curves: dict[str, Curves] = {"deviations": deviations, "spectrum": lines}
    results = results_of(terms.header, response_outcome(terms, plan, timing), tables, curves)
    return with_record(results, request, units, experiment, plan.record, signal)


def _deviations(terms: ResponseTerms, plan: Planned) -> dict[str, NDArray[np.float64]]:
    """Return the deviations (L, p, r) of the designed lines and of the record."""
    designed = terms.lines.deviations(plan.powers, plan.counted)
    return {"deviation": designed, "deviation_record": plan.deviations}


def studied_deviations(
    terms: ResponseTerms, plan: Planned, results: Results, study: ResponseStudy
) -> tuple[Table, DeviationCurves]:
    """Return deviations.csv and its figure with the simulated deviations."""
    name = "deviation_simulated"
    listed = {**_deviations(terms, plan), name: study.deviation}
    shown = (name, f"{study.runs} simulated experiments")
    columns, curves = deviation_curves(terms.header.units, terms.frequency, terms.lines, listed, shown)
    return Table({**results.tables["deviations"].columns, **columns}), curves


def tried_lines(
    terms: ResponseTerms, plan: Planned, powers: NDArray[np.float64], study: ResponseStudy
) -> TriedInput:
    """Return simulated over expected deviations of lines with powers (L, r), their limits, and the bias."""
    expected = plan.deviations * np.sqrt(plan.applied / powers)[:, None, :]
    bounded = np.isfinite(terms.lines.admitted)
    ratio = (study.deviation / expected)[bounded]
    freedom, each = 2 * (study.runs - 1), _CHANCE / (2.0 * ratio.size)
    low, high = np.sqrt(2.0 * scipy.special.gammaincinv(0.5 * freedom, [each, 1.0 - each]) / freedom)
    bias = np.abs(study.mean - terms.lines.G) / expected
    power, cost = terms.powers(powers)
    return TriedInput(
        deviation_ratio=Range(float(ratio.min()), float(ratio.max()), float(ratio.mean())),
        chance=(float(low), float(high)),
        worst_ratio=float(np.max(terms.lines.ratios(study.deviation))),
        bias=float(np.max(bias[bounded])),
        cost=cost,
        power=power,
    )


def _matrices(powers: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the powers of uncorrelated inputs as matrices (L, r, r)."""
    return np.einsum("lr,rs->lrs", powers, np.eye(powers.shape[1]))
