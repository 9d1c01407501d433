"""State how a frequency response is asked for; write the outcome of its design, and evaluate it once more."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace

import numpy as np
import scipy
from numpy.typing import NDArray

from inputdesign_cli import outcome as out
from inputdesign_cli.arrays import Array
from inputdesign_cli.design.convex.limits import PowerLimit, Weight, weighted_sum, weights_of
from inputdesign_cli.design.convex.response_lines import Goal, ResponseDesign, ResponseLines, ResponseProblem
from inputdesign_cli.findings.designs import limits_not_kept
from inputdesign_cli.findings.frequency_responses import noise_leaks, record_of_whole_periods, start_shifts
from inputdesign_cli.identification.periodic_response import Periods
from inputdesign_cli.information import POWER_KINDS, Experiment, PowerKind
from inputdesign_cli.monte_carlo.response import ResponseStudy
from inputdesign_cli.outcome.curves import Curves, DeviationCurves, DeviationPanel, SpectrumCurves
from inputdesign_cli.outcome.estimate import DetectionLines
from inputdesign_cli.outcome.results import Results, Table
from inputdesign_cli.outcome.simulation import Range, TriedInput
from inputdesign_cli.outcome.text_formats import csv_columns, csv_text
from inputdesign_cli.outcome.units import Header, Units
from inputdesign_cli.questions.common.bound import hermitian_columns
from inputdesign_cli.questions.common.delivery import (
    APART,
    KINDS,
    check_claims,
    of_bounds,
    of_cost,
    of_limit,
    proof_status,
    results_of,
)
from inputdesign_cli.questions.common.record import RecordRequest
from inputdesign_cli.questions.common.signal_outcome import signal_of, with_record
from inputdesign_cli.signal.harmonic_grid import HarmonicGrid
from inputdesign_cli.signal.selection import Record

KEY = "accuracy.frequency_response"


_ROUNDING = 1e-9
_CHANCE = 0.05


@dataclass(frozen=True)
class ResponseTerms:
    """Holds the lines and their accuracy, limits and cost.

    The experiment has the samples that count (one where the shortest is asked for), `asked` are stated in the
    spec. Of noise that is `tabulated` there is no model.
    """

    header: Header
    experiment: Experiment
    grid: HarmonicGrid
    lines: ResponseLines
    periods: Periods
    goal: Goal
    cost: Mapping[PowerKind, Weight]
    limits: tuple[PowerLimit, ...]
    tolerance: float
    asked: int
    most_samples: int | None
    tabulated: bool

    @property
    def frequency(self) -> Array:
        """Return the frequencies (L,) of the lines in the unit of the spec."""
        return self.grid.frequencies / self.header.units.frequency

    def gains(self, kind: PowerKind) -> Array:
        """Return the gains of a unit of power of each line to each power, (L, channels, r)."""
        return np.asarray(np.abs(self.experiment.response(kind, self.grid.frequencies)) ** 2)

    def problem(self, samples: int) -> ResponseProblem:
        """Return the prices and limits of the lines, and the powers that meet the accuracy in `samples`."""

        def added(kind: PowerKind, channel: int | None) -> NDArray[np.float64]:
            gains = self.gains(kind)
            return np.asarray(gains.sum(axis=1) if channel is None else gains[:, channel]).ravel()

        needed = self.lines.needed(samples).ravel()
        paid = (w * added(kind, channel) for kind, channel, w in weights_of(self.cost))
        rows = [added(limit.kind, limit.channel) for limit in self.limits]
        return ResponseProblem(
            needed, sum(paid, np.zeros(needed.size)), self.limits, np.array(rows).reshape(-1, needed.size)
        )

    def powers(self, lines: NDArray[np.float64]) -> tuple[out.Powers, float]:
        """Return mean squares by channel, and the cost, of lines with powers (L, r)."""
        found = {
            kind: tuple(np.einsum("lar,lr->a", self.gains(kind), lines).tolist()) for kind in POWER_KINDS
        }
        return out.Powers(**found), weighted_sum(self.cost, found)


@dataclass(frozen=True)
class Planned:
    """Holds the experiment: powers (L, r), samples that count, the record, its deviations (L, p, r).

    The largest `shift` of G by the start is in these deviations.
    """

    design: ResponseDesign
    problem: ResponseProblem
    powers: NDArray[np.float64]
    counted: int
    record: Record
    deviations: NDArray[np.float64]
    shift: float

    @property
    def length(self) -> int:
        """Return the number of samples of the record, transient included."""
        return len(self.record.samples)

    @property
    def applied(self) -> NDArray[np.float64]:
        """Return the powers (L, r) of the record."""
        return self.powers * (1.0 + self.record.extra_power)

    @property
    def flat(self) -> NDArray[np.float64]:
        """Return equal lines (L, r) with the power of the record in each input."""
        return np.broadcast_to(self.applied.mean(axis=0), self.powers.shape)


def deviation_curves(
    units: Units,
    w: Array,
    lines: ResponseLines,
    listed: Mapping[str, NDArray[np.float64]],
    found: tuple[str, str] | None = None,
) -> tuple[dict[str, Array], DeviationCurves]:
    """Return the columns of deviations.csv and its figure, for the entries of G that are bounded.

    At lines w (L,) columns (L, p, r) are `listed`, one of them `found` with a label.
    """
    columns: dict[str, Array] = {units.frequency_header: w}
    panels = []
    for i, j in np.ndindex(lines.admitted.shape[1:]):
        admitted, size = lines.admitted[:, i, j], np.abs(lines.G[:, i, j])
        if not np.all(np.isfinite(admitted)):
            continue
        of_entry = {"G_abs": size, "r_adm": admitted, **{name: x[:, i, j] for name, x in listed.items()}}
        columns |= {f"{name}{units.suffix(i, j)}": values for name, values in of_entry.items()}
        entry = None if units.single else (i, j)
        drawn, label = (None, "") if found is None else (of_entry[found[0]], found[1])
        shown = (w, size, admitted, of_entry["deviation"], drawn, label)
        panels.append(DeviationPanel(*shown, entry=entry, names=units.passage(entry)))
    return columns, DeviationCurves(tuple(panels))


def response_outcome(terms: ResponseTerms, plan: Planned, timing: dict[str, float]) -> out.Outcome:
    """Return the content of result.json for a design or given lines."""
    units, lines, designed = terms.header.units, terms.lines, terms.goal != "given"
    ratios, each = lines.ratios(lines.deviations(plan.powers, plan.counted)), terms.periods.each(plan.length)
    worst, (power, cost) = int(np.argmax(ratios)), terms.powers(plan.powers)
    odd, even = (terms.grid.at(silent) / units.frequency for silent in (terms.grid.odd, terms.grid.even))
    met = "met" if ratios[worst] <= 1.0 + _ROUNDING else "missed"
    objective, baseline = _objective(terms, plan) if designed else (None, None)
    powers = _matrices(plan.powers) if units.inputs > 1 else plan.powers[:, 0]
    # What a user should know before applying the record.
    found = start_shifts(plan.shift)
    if terms.goal in ("cost", "samples"):
        found += noise_leaks(plan.record.worst_ratio)
    if terms.goal != "samples":
        times = terms.periods.blocks * each
        found += record_of_whole_periods(plan.length, terms.asked, times, terms.grid.period)
    if terms.goal == "given":
        found += limits_not_kept(terms.limits, terms.most_samples, plan.length, power)
    return out.Outcome(
        title=terms.header.title,
        status=proof_status(plan.design.gap, terms.tolerance) if designed else met,
        objective=objective,
        cost=cost,
        samples=plan.length,
        power=power,
        spectrum=out.Spectrum("multisine", {"frequencies": terms.frequency, "powers": powers}),
        baseline=baseline,
        frequency_response=out.MeasuredLines(
            lines=int(ratios.size),
            period=terms.grid.period,
            periods=each,
            blocks=terms.periods.blocks,
            transient=terms.periods.skip,
            counted=plan.counted,
            worst_ratio=float(ratios[worst]),
            worst_frequency=float(terms.frequency[worst]),
            detection=DetectionLines(odd, even) if even.size else None,
        ),
        solver=out.Solver("lines", terms.tolerance) if designed else None,
        timing_s=timing,
    ).saying(found)


def _objective(terms: ResponseTerms, plan: Planned) -> tuple[out.Objective, out.Baseline]:
    """Return the value with its bound, and what lines of equal power need."""
    problem, value, bound = plan.problem, plan.design.value, plan.design.bound
    flat = float(np.max(problem.needed)) * np.ones(problem.needed.size)
    if terms.goal == "cost":
        rows, floors = problem.lower
        flat = flat * float(np.max(floors / (rows @ (flat / problem.needed)), initial=1.0))
        cost = float(problem.price @ flat)
        power, _ = terms.powers(flat.reshape(plan.powers.shape))
        white = out.White(cost=cost, ratio=cost / value, power=power)
    else:
        within = problem.alike(flat / problem.needed)
        if terms.goal == "samples":
            value, bound, white = 1.0 / value, 1.0 / bound, out.White(samples=plan.counted / within)
        else:
            value, bound, white = value**-0.5, bound**-0.5, out.White(value=float(within**-0.5))
    gap = abs(value - bound) / value
    kind = KINDS[terms.goal]
    return out.Objective(kind, value, lower_bound=min(bound, value), relative_gap=gap), out.Baseline(white)


def response_results(
    terms: ResponseTerms, plan: Planned, request: RecordRequest, timing: dict[str, float]
) -> Results:
    """Return the outcome with its tables and figures."""
    units, experiment = terms.header.units, terms.experiment
    signal = signal_of(request, experiment, plan.record)
    signal = replace(signal, worst_ratio=plan.record.worst_ratio, start_shift=plan.shift)
    matrices = _matrices(plan.powers)
    spectrum = {units.frequency_header: terms.frequency, **hermitian_columns(matrices, "power")}
    columns, drawn = deviations(terms, plan)
    for i in range(units.outputs):
        columns[f"noise_spectrum{'' if units.outputs == 1 else f'_{i + 1}'}"] = terms.lines.noise[:, i]
    tables = {"deviations": Table(columns), "spectrum": Table(spectrum)}
    lines = SpectrumCurves(terms.frequency, matrices.astype(complex), lines=True)
    curves: dict[str, Curves] = {"deviations": drawn, "spectrum": lines}
    results = results_of(terms.header, response_outcome(terms, plan, timing), tables, curves)
    return with_record(results, request, experiment, plan.record, signal)


def deviations(
    terms: ResponseTerms, plan: Planned, study: ResponseStudy | None = None
) -> tuple[dict[str, Array], DeviationCurves]:
    """Return deviations.csv and its figure, of the designed lines and of the record; with simulated ones."""
    designed, name, shown = terms.lines.deviations(plan.powers, plan.counted), "deviation_simulated", None
    listed = {"deviation": designed, "deviation_record": plan.deviations}
    if study is not None:
        listed[name], shown = study.deviation, (name, f"{study.runs} simulated experiments")
    return deviation_curves(terms.header.units, terms.frequency, terms.lines, listed, shown)


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


def audit_response(terms: ResponseTerms, plan: Planned, results: Results) -> None:
    """Raise `internal-disagreement` if the written lines or the written record do not bear out the claims."""
    written = out.read_plain(out.Outcome, results.result)
    _, *samples = csv_columns(csv_text(results.tables["signal"]).encode()).values()
    wrong = (*_of_lines(terms, written), *_of_record(terms, plan, written, np.stack(samples, axis=1)))
    check_claims(wrong, "rescale the signals, or leave out lines where |G| is very small")


def _of_lines(terms: ResponseTerms, written: out.Outcome) -> Iterator[str]:
    """Yield a sentence on each claim that the written powers contradict."""
    spectrum, claimed = written.spectrum, written.frequency_response
    assert spectrum is not None
    assert claimed is not None
    w = np.array(spectrum.details["frequencies"]) * terms.header.units.frequency
    listed = np.array(spectrum.details["powers"], dtype=float)
    powers = listed[:, None] if listed.ndim == 1 else np.einsum("laa->la", listed)
    counted, ratio = claimed.counted or 0, claimed.worst_ratio or 0.0
    variances = 2.0 * terms.lines.noise[:, :, None] / (counted * powers[:, None, :])
    worst = float(np.max(np.sqrt(variances) / terms.lines.admitted))
    asked = terms.goal in ("cost", "samples")
    if not (abs(worst - ratio) <= APART * worst and (not asked or worst <= 1.0 + APART)):
        yield f"the lines leave {worst:.10g} times the deviation admitted, not {ratio:.10g}"
    found = {
        "input": powers,
        "excitation": powers,
        "output": np.einsum("lpr,lr->lp", np.abs(terms.experiment.model.plant_at(w)) ** 2, powers),
        "moves": (2.0 - 2.0 * np.cos(w))[:, None] * powers,
    }

    def power(kind: str, channel: int | None) -> float:
        return float(found[kind].sum() if channel is None else found[kind][:, channel].sum())

    paid = sum(weight * power(kind, channel) for kind, channel, weight in weights_of(terms.cost))
    yield from of_cost(paid, written.cost or 0.0)
    for limit in terms.limits if terms.goal != "given" else ():
        yield from of_limit(limit, power(limit.kind, limit.channel))
    if written.objective is not None:
        yield from of_bounds(written.objective)


def _of_record(terms: ResponseTerms, plan: Planned, written: out.Outcome, record: Array) -> Iterator[str]:
    """Yield a sentence on each claim that the samples contradict: errors are noise over input transforms."""
    signal = written.signal
    assert signal is not None
    u = record - np.array(signal.operating_point or 0.0)
    spread = np.sum(np.abs(np.linalg.inv(terms.periods.means(u, terms.grid.excited))) ** 2, axis=1)
    noise = 0.5 * plan.deviations**2 * plan.powers[:, None, :] * (1.0 + (signal.extra_power or 0.0))
    found = np.sqrt(noise * spread[:, None, :] * terms.periods.blocks)
    apart = float(np.max(np.abs(found / plan.deviations - 1.0)))
    if not apart <= APART:
        yield f"the samples of the record leave deviations that are off those claimed by {apart:.3g}"
    worst, claimed = float(np.max(found / terms.lines.admitted)), signal.worst_ratio or 0.0
    if not abs(worst - claimed) <= APART * worst:
        yield f"the record leaves {worst:.10g} times what is admitted, not {claimed:.10g}"
