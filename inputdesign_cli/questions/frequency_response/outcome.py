"""A frequency response that is designed or tried -> `result.json`, tables and figures."""

from __future__ import annotations

import time
from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
import scipy
from numpy.typing import NDArray

from inputdesign_cli.design.convex.cost import Weight, weighted_sum
from inputdesign_cli.design.convex.limits import PowerLimit
from inputdesign_cli.design.response import Goal, ResponseDesign, ResponseLines, ResponseProblem
from inputdesign_cli.findings.limits_not_kept import StatedLimits, limits_not_kept
from inputdesign_cli.identification.periodic_response import Periods
from inputdesign_cli.information import POWER_KINDS, Experiment, PowerKind
from inputdesign_cli.monte_carlo.response import ResponseStudy
from inputdesign_cli.outcome.curves import DeviationCurves, DeviationPanel, SpectrumCurves
from inputdesign_cli.outcome.results import Array, Json, Results, Table, typed
from inputdesign_cli.outcome.units import Header
from inputdesign_cli.questions.common.record import RecordRequest
from inputdesign_cli.questions.common.signal_outcome import other_files, signal_curves, signal_entry
from inputdesign_cli.questions.common.simulation import Simulation
from inputdesign_cli.questions.common.spectrum import hermitian_columns
from inputdesign_cli.questions.common.status import proof_status
from inputdesign_cli.signal import Record
from inputdesign_cli.signal.harmonic_grid import HarmonicGrid

_KINDS: dict[Goal, str] = {
    "cost": "least_cost",
    "factor": "accuracy_factor",
    "samples": "shortest_experiment",
}
_ROUNDING = 1e-9
# A shift by what the start leaves that is worth a note, in standard deviations.
_SHIFTED = 0.2
_CHANCE = 0.05


@dataclass(frozen=True)
class ResponseTerms:
    """How the question was put, as far as its results repeat it.

    Attributes:
        experiment: with the samples that count (one where the shortest is asked for).
        asked: samples that the spec gives the experiment.
        most_samples: of the longest record, where the spec limits it.
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

    @property
    def frequency(self) -> Array:
        """(L,): of the lines, in the user's unit."""
        return self.grid.frequencies / self.header.units.frequency


@dataclass(frozen=True)
class Planned:
    """What is to be applied: powers (L, r), `counted` of `length` samples, the record, and its deviations.

    Attributes:
        problem: for the samples that count.
        deviations: (L, p, r): of the record, noise seen through its finite length where `modelled`.
        shift: by what the start leaves, in these deviations.
    """

    design: ResponseDesign
    problem: ResponseProblem
    powers: NDArray[np.float64]
    counted: int
    length: int
    record: Record
    deviations: NDArray[np.float64]
    shift: float
    modelled: bool

    @property
    def applied(self) -> NDArray[np.float64]:
        """(L, r): the powers that the record has."""
        return self.powers * (1.0 + self.record.extra_power)


def flat_powers(plan: Planned) -> NDArray[np.float64]:
    """(L, r): equal lines of the power that the record has in each input."""
    return np.broadcast_to(plan.applied.mean(axis=0), plan.powers.shape)


def design_result(terms: ResponseTerms, plan: Planned) -> dict[str, Json]:
    """`result.json` but for the signal."""
    units, lines = terms.header.units, terms.lines
    ratios = lines.ratios(lines.deviations(plan.powers, plan.counted))
    worst = int(np.argmax(ratios))
    power = _power(terms, plan.powers)
    result: dict[str, Json] = {
        "format": 1,
        "title": terms.header.title,
        "samples": plan.length,
        "cost": weighted_sum(terms.cost, power),
        "power": power,
        "frequency_response": {
            "lines": int(ratios.size),
            "period": terms.grid.period,
            "periods": terms.periods.each(plan.length),
            "blocks": terms.periods.blocks,
            "transient": terms.periods.skip,
            "counted": plan.counted,
            "worst_ratio": float(ratios[worst]),
            "worst_frequency": float(terms.frequency[worst]),
            **_detection(terms),
        },
        "spectrum": {
            "type": "multisine",
            "frequencies": terms.frequency,
            "powers": _matrices(plan.powers) if units.inputs > 1 else plan.powers[:, 0],
        },
    }
    if terms.goal == "given":
        met = bool(ratios[worst] <= 1.0 + _ROUNDING)
        return result | {"status": "met" if met else "missed"}
    result["status"] = proof_status(plan.design.gap, terms.tolerance)
    return result | _objective(terms, plan) | {"solver": {"method": "lines", "tolerance": terms.tolerance}}


def _objective(terms: ResponseTerms, plan: Planned) -> dict[str, Json]:
    """The value with its bound, and that of lines of equal power."""
    design, problem = plan.design, plan.problem
    value, bound = design.value, design.bound
    flat = float(np.max(problem.needed)) * np.ones(problem.needed.size)
    white: dict[str, Json]
    if terms.goal == "cost":
        rows, floors = problem.lower
        flat = flat * float(np.max(floors / (rows @ (flat / problem.needed)), initial=1.0))
        cost = float(problem.price @ flat)
        white = {"cost": cost, "ratio": cost / value, "power": _power(terms, flat.reshape(plan.powers.shape))}
    else:
        within = problem.alike(flat / problem.needed)
        s = within * (plan.counted if terms.goal == "samples" else 1.0)
        if terms.goal == "samples":
            value, bound = 1.0 / value, 1.0 / bound
            white = {"samples": plan.counted / within}
        else:
            value, bound = value**-0.5, bound**-0.5
            white = {"value": float(s**-0.5)}
    listed = {
        "kind": _KINDS[terms.goal], "value": value, "lower_bound": min(bound, value),
        "relative_gap": abs(value - bound) / value,
    }  # fmt: skip
    return {"objective": listed, "baseline": {"white": white}}


def response_results(
    terms: ResponseTerms, plan: Planned, result: dict[str, Json], request: RecordRequest
) -> Results:
    """The result with its signal, tables and figures."""
    units = terms.header.units
    entry = signal_entry(request, units, terms.experiment, plan.record)
    entry |= {"worst_ratio": plan.record.worst_ratio, "start_shift": plan.shift}
    result["signal"] = entry
    notes = _notes(terms, plan)
    if notes:
        result["notes"] = notes
    signals, drawn = signal_curves(request, units, terms.experiment, plan.record)
    matrices = _matrices(plan.powers)
    spectrum = {units.frequency_header: terms.frequency, **hermitian_columns(matrices, "power")}
    deviations, curves = _deviations(terms, plan)
    for i in range(units.outputs):
        deviations[f"noise_spectrum{'' if units.outputs == 1 else f'_{i + 1}'}"] = terms.lines.noise[:, i]
    outcome = typed(result)
    if terms.goal == "given" and outcome.power is not None:
        stated = StatedLimits(terms.limits, None, None, None, terms.most_samples)
        outcome = outcome.saying(limits_not_kept(stated, plan.length, outcome.power, None))
    return Results(
        outcome,
        terms.header.resolved_spec,
        units.time_unit,
        {"deviations": Table(deviations), "spectrum": Table(spectrum), **signals},
        {
            "deviations": curves,
            "spectrum": SpectrumCurves(terms.frequency, matrices.astype(complex), lines=True),
            "signal": drawn,
        },
        other_files(request, units, plan.record),
    )


def _deviations(
    terms: ResponseTerms, plan: Planned, study: ResponseStudy | None = None
) -> tuple[dict[str, Array], DeviationCurves]:
    """Columns of deviations.csv and its figure, entry by entry, with simulated ones where there are any."""
    units, lines = terms.header.units, terms.lines
    designed = lines.deviations(plan.powers, plan.counted)
    columns: dict[str, Array] = {units.frequency_header: terms.frequency}
    panels = []
    for i, j in np.ndindex(designed.shape[1:]):
        admitted = lines.admitted[:, i, j]
        if not np.all(np.isfinite(admitted)):
            continue
        size = np.abs(lines.G[:, i, j])
        listed = {
            "G_abs": size, "r_adm": admitted, "deviation": designed[:, i, j],
            "deviation_record": plan.deviations[:, i, j],
        }  # fmt: skip
        found, label = None, ""
        if study is not None:
            found, label = study.deviation[:, i, j], f"{study.runs} simulated experiments"
            listed["deviation_simulated"] = found
        columns |= {f"{name}{units.suffix(i, j)}": values for name, values in listed.items()}
        entry = None if units.single else (i, j)
        shown = (terms.frequency, size, admitted, designed[:, i, j], found, label)
        panels.append(DeviationPanel(*shown, entry, units.passage(entry)))
    return columns, DeviationCurves(tuple(panels))


def _notes(terms: ResponseTerms, plan: Planned) -> list[str]:
    """What a user should know before applying the record."""
    notes = []
    if plan.shift > _SHIFTED:
        notes.append(
            f"what the start leaves shifts the response by {plan.shift:.2g} standard deviations at most: "
            "raise accuracy.frequency_response.transient, or take a longer period"
        )
    ratio = plan.record.worst_ratio
    if terms.goal in ("cost", "samples") and ratio > 1.0 + _ROUNDING:
        notes.append(
            f"the record leaves {ratio:.7g} times the deviation admitted, by the noise that leaks through "
            "its finite length, and the limits leave no room to mend that: a little more power or a few "
            "more periods would do"
        )
    if terms.goal != "samples" and plan.length < terms.asked:
        times = terms.periods.blocks * terms.periods.each(plan.length)
        notes.append(
            f"the record has {plan.length} of the {terms.asked} samples: {times} whole periods of "
            f"{terms.grid.period}"
        )
    return notes


def study_results(
    terms: ResponseTerms,
    plan: Planned,
    results: Results,
    studies: Mapping[str, ResponseStudy],
    simulation: Simulation,
    begun: float,
) -> Results:
    """The results with the entry `simulation`, and the simulated deviations beside the designed ones."""
    entries: dict[str, Json] = {}
    for name, study in studies.items():
        powers = plan.applied if name == "design" else flat_powers(plan)
        expected = plan.deviations * np.sqrt(plan.applied / powers)[:, None, :]
        power = _power(terms, powers)
        entries[name] = _study_entry(terms, expected, study)
        entries[name] |= {"cost": weighted_sum(terms.cost, power), "power": power}
    columns, curves = _deviations(terms, plan, studies["design"])
    columns = {**results.tables["deviations"].columns, **columns}
    told: dict[str, Json] = {
        "runs": simulation.runs, "seed": simulation.seed, "samples": plan.length, "inputs": entries
    }  # fmt: skip
    timing = {**results.result["timing_s"], "simulation": time.perf_counter() - begun}
    return replace(
        results,
        outcome=typed({**results.result, "simulation": told, "timing_s": timing}),
        tables={**results.tables, "deviations": Table(columns)},
        curves={**results.curves, "deviations": curves},
    )


def _study_entry(
    terms: ResponseTerms, expected: NDArray[np.float64], study: ResponseStudy
) -> dict[str, Json]:
    """Simulated deviations over those expected of the record, what chance leaves of that, and the bias."""
    told = np.isfinite(terms.lines.admitted)
    ratio = (study.deviation / expected)[told]
    freedom = 2 * (study.runs - 1)
    each = _CHANCE / (2.0 * ratio.size)
    chance = (
        np.sqrt(2.0 * scipy.special.gammaincinv(0.5 * freedom, [each, 1.0 - each]) / freedom)
        if freedom
        else [0.0, 0.0]
    )
    bias = np.abs(study.mean - terms.lines.G) / expected
    return {
        "deviation_ratio": {
            "least": float(ratio.min()), "largest": float(ratio.max()), "mean": float(ratio.mean()),
        },
        "chance": [float(edge) for edge in chance],
        "worst_ratio": float(np.max(terms.lines.ratios(study.deviation))),
        "bias": float(np.max(bias[told])),
    }  # fmt: skip


def _power(terms: ResponseTerms, powers: NDArray[np.float64]) -> dict[PowerKind, list[float]]:
    """By kind and channel, of lines with powers (L, r)."""
    found: dict[PowerKind, list[float]] = {}
    for kind in POWER_KINDS:
        gains = np.abs(terms.experiment.response(kind, terms.grid.frequencies)) ** 2
        found[kind] = np.einsum("lar,lr->a", gains, powers).tolist()
    return found


def _detection(terms: ResponseTerms) -> dict[str, Json]:
    grid, unit = terms.grid, terms.header.units.frequency
    if not grid.even.size:
        return {}
    return {"detection": {"odd": grid.at(grid.odd) / unit, "even": grid.at(grid.even) / unit}}


def _matrices(powers: NDArray[np.float64]) -> NDArray[np.float64]:
    """(L, r, r): uncorrelated inputs."""
    return np.einsum("lr,rs->lrs", powers, np.eye(powers.shape[1]))
