"""Design the lines of a frequency response, realise and reread them, and try them on a true system."""

from __future__ import annotations

import time
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from functools import partial

import numpy as np
import scipy
from numpy.typing import NDArray

from inputdesign_cli import outcome as out
from inputdesign_cli.arrays import Array
from inputdesign_cli.compute.executor import Executor
from inputdesign_cli.design.convex.limits import PowerLimit, Weight, weighted_sum, weights_of
from inputdesign_cli.design.convex.response_lines import (
    Goal,
    ResponseDesign,
    ResponseLines,
    ResponseProblem,
    UnreachableError,
    cheapest,
    most_accurate,
)
from inputdesign_cli.errors import Diagnostic, InfeasibleError, bad_spec
from inputdesign_cli.findings.designs import limits_not_kept
from inputdesign_cli.findings.frequency_responses import noise_leaks, record_of_whole_periods, start_shifts
from inputdesign_cli.identification.periodic_response import Periods, response_at
from inputdesign_cli.information import POWER_KINDS, Experiment, PowerKind
from inputdesign_cli.monte_carlo.response import ResponseStudy, study_response
from inputdesign_cli.outcome.curves import Curves, DeviationCurves, DeviationPanel, SpectrumCurves
from inputdesign_cli.outcome.estimate import DetectionLines
from inputdesign_cli.outcome.results import Results, Table
from inputdesign_cli.outcome.shares import rounded_up
from inputdesign_cli.outcome.simulation import Range, TriedInput
from inputdesign_cli.outcome.text_formats import csv_columns, csv_text
from inputdesign_cli.outcome.units import Header, Units
from inputdesign_cli.plant.noise_spectrum import NoiseSpectrum
from inputdesign_cli.questions.common import delivery
from inputdesign_cli.questions.common.bound_curves import hermitian_columns
from inputdesign_cli.questions.common.infeasible import contradictory, named
from inputdesign_cli.questions.common.record import RecordRequest, no_record
from inputdesign_cli.questions.common.signal_outcome import signal_of, with_record
from inputdesign_cli.questions.common.simulation import Simulation
from inputdesign_cli.signal.harmonic_grid import HarmonicGrid
from inputdesign_cli.signal.kind import Draft
from inputdesign_cli.signal.limits import limited_responses
from inputdesign_cli.signal.lines import Lines
from inputdesign_cli.signal.multisine import Multisine
from inputdesign_cli.signal.selection import Record
from inputdesign_cli.signal.settings import Phases

KEY = "accuracy.frequency_response"

_ROUNDING = 1e-9
_CHANCE = 0.05
_STREAM = 0x5EED


@dataclass(frozen=True)
class Planned:
    """Holds the experiment: powers (L, r), samples that count, the record, its deviations (L, p, r).

    The largest `shift` of G by the start is in units of these deviations.
    """

    design: ResponseDesign
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


@dataclass(frozen=True)
class ResponseTask:
    """Designs lines, or analyses given ones, and studies them.

    The experiment has the samples that count (one if the shortest is sought); `asked` is their number in the
    spec. Noise that is `tabulated` has no model. Powers (L, r) that are `given` are not designed.
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
    tabulated: bool
    record: RecordRequest
    given: Array | None
    simulation: Simulation

    def solve(self) -> Results:
        """Return the design, or the accuracy of given lines, with its signal and its curves."""
        return self.solved()[1]

    def solved(self) -> tuple[Planned, Results]:
        """Return the plan, and what is written of it, which has passed the audit."""
        started = time.perf_counter()
        design, counted = self._designed()
        solved = time.perf_counter()
        plan = self._planned(design, counted)
        results = self._results(plan, delivery.timing(started, solved))
        audit_response(self, plan, results)
        return plan, results

    def simulate(self, executor: Executor | None = None) -> Results:
        """Return the design, and beside its deviations the scatter of many simulated experiments."""
        study = self.simulation
        if study.runs < 2:
            hint = "write simulation.runs: 1000, whose deviations are known to 2 %"
            message = "a single run has no standard deviation"
            raise bad_spec("out-of-range", message, hint=hint, key="simulation.runs")
        plan, results = self.solved()
        begun = time.perf_counter()
        nominal, power = self.experiment, results.outcome.power
        if study.truth is not None and power is not None:
            nominal = study.on_truth(nominal, power.output or ())
        tried = partial(study_response, runs=study.runs, seed=study.seed, executor=executor)
        at = self.periods, self.grid.excited
        designed = tried(nominal.model, plan.record.samples, *at)
        inputs = {"design": self._tried(plan, plan.applied, designed)}
        if study.compare:
            white = tried(nominal.model, self._best(plan.flat, plan.length), *at)
            inputs["white"] = self._tried(plan, plan.flat, white)
        columns, curves = self.deviations(plan, designed)
        tables = {"deviations": Table({**results.tables["deviations"].columns, **columns})}
        entry = out.Simulation(study.runs, study.seed, inputs, samples=plan.length)
        return delivery.with_study(results, entry, begun, tables=tables, curves={"deviations": curves})

    def _designed(self) -> tuple[ResponseDesign, int]:
        """Return the powers and the samples that count."""
        samples = self.experiment.samples
        problem = self.problem(samples)
        if self.given is not None:
            flat = self.given.ravel()
            return ResponseDesign(flat, float(problem.price @ flat), float(problem.price @ flat)), samples
        try:
            design = cheapest(problem) if self.goal == "cost" else most_accurate(problem)
        except UnreachableError as error:
            raise self._unreachable(error, samples) from error
        return design, self._whole(1.0 / design.value) if self.goal == "samples" else samples

    def _whole(self, samples: float) -> int:
        """Return a number of samples rounded up to whole periods."""
        whole = self.periods.blocks * self.periods.period
        return whole * int(np.ceil(samples / whole * (1.0 - 1e-12)))

    def _planned(self, design: ResponseDesign, counted: int) -> Planned:
        """Return the record of a design, scaled so that it meets the accuracy or keeps to the limits."""
        powers = design.powers.reshape(-1, self.experiment.inputs)
        samples, beyond, exact = self._drawn(powers, counted)
        if self.goal == "samples" and beyond > 1.0:
            # The lines are scaled down to the limits, and more periods compensate for that.
            counted = self._whole(beyond**2 / design.value)
            samples, beyond, exact = self._drawn(powers, counted)
        worst, scale, periods = float(np.max(self.lines.ratios(exact))), 1.0, self.periods
        if self.goal == "cost" and self.record.meets:
            problem = self.problem(counted)
            scale = min(worst, float(np.sqrt(problem.alike(design.powers / problem.needed))))
            if scale * beyond > 1.0 + _ROUNDING:
                factor = rounded_up(worst * beyond, 4)
                best = f"meets the accuracy: its peaks are {factor} times as large as they allow"
                hint = f"raise the limits, or admit {factor} times as much{self._longer}"
                raise no_record(self.record, len(samples), best, hint)
        elif self.given is None:
            scale = 1.0 / max(beyond, 1.0)
        samples, exact = scale * samples, exact / scale
        record = Record(samples, "multisine", worst / scale, extra_power=scale**2 - 1.0)
        # The largest shift of G by the start, in standard deviations.
        U, Y = (periods.means(x, self.grid.excited) for x in (samples, self._answer(samples)))
        shift = float(np.max(np.abs(response_at(U, Y) - self.lines.G) / exact))
        return Planned(design, powers, counted, record, exact, shift)

    def _unreachable(self, error: UnreachableError, samples: int) -> InfeasibleError:
        """Return the error that limits exclude the accuracy, with the numbers of the spec that would do."""
        factor, limits = error.factor, tuple(dict.fromkeys(error.limits))
        if not np.isfinite(factor):
            return contradictory(limits, "contradict each other: no powers of these lines keep all of them")
        exhausted = " and ".join(dict.fromkeys(map(named, limits)))
        message = f"the limits buy deviations {rounded_up(factor, 4)} times those admitted; "
        message += f"the {exhausted} is exhausted"
        raised = [f"{one.key} to {rounded_up(factor**2 * one.bound)}" for one in limits if not one.implied]
        # The peaks of a record exceed the root of its power, so that limits on samples need more than that.
        powers = self.problem(samples).needed.reshape(-1, self.experiment.inputs)
        _, beyond, exact = self._drawn(powers, samples)
        peaks = beyond * float(np.max(self.lines.ratios(exact)))
        if peaks > 1.0:
            raised += [f"{key} to {rounded_up(peaks, 4)} times its value" for key in self.record.limit_keys]
        admitted = rounded_up(max(factor, peaks), 4)
        hint = f"raise {' and '.join(raised)}, or admit {admitted} times as much{self._longer}"
        details = {"factor": factor}
        return InfeasibleError(Diagnostic("infeasible", message, hint, limits[0].key, details=details))

    @property
    def _longer(self) -> str:
        """Return the end of a hint: let the length be found at these lines, if a limit bounds their power."""
        if all(limit.kind == "moves" or not limit.upper for limit in self.limits):
            return ""
        return f"; or write objective: shortest_experiment, with {KEY}.period: {self.grid.period}"

    def _drawn(self, powers: NDArray[np.float64], counted: int) -> tuple[Array, float, NDArray[np.float64]]:
        """Return a record of these lines, the share of its limits that it takes, and exact deviations."""
        samples, noise, periods = self._best(powers, self._length(counted)), self.lines.noise, self.periods
        if not self.tabulated:
            times = counted // (periods.blocks * periods.period)
            spectrum = NoiseSpectrum.of(self.experiment.model)
            noise = spectrum.averaged(self.grid.period, self.grid.excited, times)
        return samples, self._beyond(samples), self.lines.deviations(powers, counted, noise)

    def _length(self, counted: int) -> int:
        """Return the length of a record with its transient; raise `too-long` or `too-large`."""
        request, periods = self.record, self.periods
        length = counted + periods.blocks * periods.skip * periods.period
        most = request.most_samples
        if self.goal == "samples" and most is not None and length > most:
            limit, takes = request.units.length(length, "limits"), f"{length} samples, transient included"
            message = f"the shortest record of whole periods takes {takes}, and {most} are allowed"
            hint = f"write {limit}, allow more power, or ask for less accuracy"
            raise InfeasibleError.because("too-long", message, hint, limit.split(":")[0])
        if length > request.longest:
            message = f"the record has {length} samples, and at most {request.longest} are computed"
            raise bad_spec("too-large", message, hint="ask for less accuracy, or allow more power", key=KEY)
        return length

    def _best(self, powers: NDArray[np.float64], length: int) -> Array:
        """Return the record (length, r), with powers (L, r) of the lines, of the lowest peak of several."""
        settings, bounds, r, period = (
            self.record.settings,
            self.record.bounds,
            powers.shape[1],
            self.grid.period,
        )
        limited = partial(limited_responses, self.experiment, bounds, 1.0, 1)
        lines = Lines(self.grid.frequencies, matrices_of(powers).astype(complex), period)

        def drawn(number: int) -> Array:
            rng = np.random.default_rng(np.random.SeedSequence(settings.seed, spawn_key=(_STREAM, number)))
            phases: Phases = "orthogonal" if settings.phases == "random" else settings.phases
            phases = "even" if (phases, number) == ("optimised", 0) else phases
            draft = Draft(lines, r * period, replace(settings, phases=phases), limited=limited)
            blocks = np.split(Multisine().draw(draft, rng), r)  # all with the same number of periods
            return np.concatenate([np.tile(block, (length // (r * period), 1)) for block in blocks])

        height = self._beyond if bounds.hard else lambda u: float(np.max(np.abs(u)))
        number = 1 if settings.phases == "schroeder" else settings.candidates
        return min(map(drawn, range(number)), key=height)

    def _beyond(self, u: Array) -> float:
        """Return the largest share of their limits that samples of u (n, r), its moves and outputs take."""
        y = None if self.record.bounds.output is None else self._answer(u)
        return max(self.record.bounds.shares(u, y).values(), default=0.0)

    def _answer(self, u: Array) -> Array:
        """Return the outputs (n, p) to inputs u (n, r) from rest, without noise."""
        model = self.experiment.model
        return np.asarray(model.simulate(u[None], np.zeros((1, 1, model.outputs)), 1.0)[0][0])

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
        price = sum((w * added(kind, channel) for kind, channel, w in weights_of(self.cost)), 0.0 * needed)
        rows = [added(limit.kind, limit.channel) for limit in self.limits]
        return ResponseProblem(needed, price, self.limits, np.array(rows).reshape(-1, needed.size))

    def powers(self, lines: NDArray[np.float64]) -> tuple[out.Powers, float]:
        """Return mean squares by channel, and the cost, of lines with powers (L, r)."""
        found = {
            kind: tuple(np.einsum("lar,lr->a", self.gains(kind), lines).tolist()) for kind in POWER_KINDS
        }
        return out.Powers(**found), weighted_sum(self.cost, found)

    def _outcome(self, plan: Planned, timing: dict[str, float]) -> out.Outcome:
        """Return the content of result.json for a design or given lines."""
        units, lines, designed = self.header.units, self.lines, self.goal != "given"
        ratios = lines.ratios(lines.deviations(plan.powers, plan.counted))
        worst, each = int(np.argmax(ratios)), self.periods.each(plan.length)
        power, cost = self.powers(plan.powers)
        odd, even = (self.grid.at(silent) / units.frequency for silent in (self.grid.odd, self.grid.even))
        met = "met" if ratios[worst] <= 1.0 + _ROUNDING else "missed"
        objective, baseline = self._objective(plan) if designed else (None, None)
        powers = matrices_of(plan.powers) if units.inputs > 1 else plan.powers[:, 0]
        # Findings that a user should know before applying the record.
        found = start_shifts(plan.shift)
        if self.goal in ("cost", "samples"):
            found += noise_leaks(plan.record.worst_ratio)
        if self.goal != "samples":
            times = self.periods.blocks * each
            found += record_of_whole_periods(plan.length, self.asked, times, self.grid.period)
        if self.goal == "given":
            found += limits_not_kept(self.limits, self.record.most_samples, plan.length, power)
        return out.Outcome(
            title=self.header.title,
            status=delivery.proof_status(plan.design.gap, self.tolerance) if designed else met,
            objective=objective,
            cost=cost,
            samples=plan.length,
            power=power,
            spectrum=out.Spectrum("multisine", {"frequencies": self.frequency, "powers": powers}),
            baseline=baseline,
            frequency_response=out.MeasuredLines(
                lines=int(ratios.size),
                period=self.grid.period,
                periods=each,
                blocks=self.periods.blocks,
                transient=self.periods.skip,
                counted=plan.counted,
                worst_ratio=float(ratios[worst]),
                worst_frequency=float(self.frequency[worst]),
                detection=DetectionLines(odd, even) if even.size else None,
            ),
            solver=out.Solver("lines", self.tolerance) if designed else None,
            timing_s=timing,
        ).saying(found)

    def _objective(self, plan: Planned) -> tuple[out.Objective, out.Baseline]:
        """Return the value with its bound, and what lines of equal power need."""
        problem, value, bound = self.problem(plan.counted), plan.design.value, plan.design.bound
        flat = float(np.max(problem.needed)) * np.ones(problem.needed.size)
        if self.goal == "cost":
            rows, floors = problem.lower
            flat = flat * float(np.max(floors / (rows @ (flat / problem.needed)), initial=1.0))
            cost = float(problem.price @ flat)
            power, _ = self.powers(flat.reshape(plan.powers.shape))
            white = out.White(cost=cost, ratio=cost / value, power=power)
        else:
            within = problem.alike(flat / problem.needed)
            if self.goal == "samples":
                value, bound, white = 1.0 / value, 1.0 / bound, out.White(samples=plan.counted / within)
            else:
                value, bound, white = value**-0.5, bound**-0.5, out.White(value=float(within**-0.5))
        gap = abs(value - bound) / value
        objective = out.Objective(
            delivery.KINDS[self.goal], value, lower_bound=min(bound, value), relative_gap=gap
        )
        return objective, out.Baseline(white)

    def _results(self, plan: Planned, timing: dict[str, float]) -> Results:
        """Return the outcome with its tables and figures."""
        units, experiment, request = self.header.units, self.experiment, self.record
        signal = signal_of(request, experiment, plan.record)
        signal = replace(signal, worst_ratio=plan.record.worst_ratio, start_shift=plan.shift)
        matrices = matrices_of(plan.powers)
        spectrum = {units.frequency_header: self.frequency, **hermitian_columns(matrices, "power")}
        columns, drawn = self.deviations(plan)
        for i in range(units.outputs):
            columns[f"noise_spectrum{'' if units.outputs == 1 else f'_{i + 1}'}"] = self.lines.noise[:, i]
        tables = {"deviations": Table(columns), "spectrum": Table(spectrum)}
        lines = SpectrumCurves(self.frequency, matrices.astype(complex), lines=True)
        curves: dict[str, Curves] = {"deviations": drawn, "spectrum": lines}
        results = delivery.results_of(self.header, self._outcome(plan, timing), tables, curves)
        return with_record(results, request, experiment, plan.record, signal)

    def deviations(
        self, plan: Planned, study: ResponseStudy | None = None
    ) -> tuple[dict[str, Array], DeviationCurves]:
        """Return deviations.csv and its figure, of the designed lines, the record, and simulated ones."""
        designed, name, shown = self.lines.deviations(plan.powers, plan.counted), "deviation_simulated", None
        listed = {"deviation": designed, "deviation_record": plan.deviations}
        if study is not None:
            listed[name], shown = study.deviation, (name, f"{study.runs} simulated experiments")
        return deviation_curves(self.header.units, self.frequency, self.lines, listed, shown)

    def _tried(self, plan: Planned, powers: NDArray[np.float64], study: ResponseStudy) -> TriedInput:
        """Return simulated over expected deviations of lines of powers (L, r), their limits, and the bias."""
        expected = plan.deviations * np.sqrt(plan.applied / powers)[:, None, :]
        bounded = np.isfinite(self.lines.admitted)
        ratio = (study.deviation / expected)[bounded]
        freedom, each = 2 * (study.runs - 1), _CHANCE / (2.0 * ratio.size)
        low, high = np.sqrt(2.0 * scipy.special.gammaincinv(0.5 * freedom, [each, 1.0 - each]) / freedom)
        bias = np.abs(study.mean - self.lines.G) / expected
        power, cost = self.powers(powers)
        return TriedInput(
            deviation_ratio=Range(float(ratio.min()), float(ratio.max()), float(ratio.mean())),
            chance=(float(low), float(high)),
            worst_ratio=float(np.max(self.lines.ratios(study.deviation))),
            bias=float(np.max(bias[bounded])),
            cost=cost,
            power=power,
        )


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


def matrices_of(powers: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the powers of uncorrelated inputs as matrices (L, r, r)."""
    return np.einsum("lr,rs->lrs", powers, np.eye(powers.shape[1]))


def audit_response(task: ResponseTask, plan: Planned, results: Results) -> None:
    """Raise `internal-disagreement` if the written lines or the written record do not bear out the claims."""
    written = out.read_plain(out.Outcome, results.result)
    _, *samples = csv_columns(csv_text(results.tables["signal"]).encode()).values()
    wrong = (*_of_lines(task, written), *_of_record(task, plan, written, np.stack(samples, axis=1)))
    delivery.check_claims(wrong, "rescale the signals, or leave out lines where |G| is very small")


def _of_lines(task: ResponseTask, written: out.Outcome) -> Iterator[str]:
    """Yield a sentence on each claim that the written powers contradict."""
    spectrum, claimed = written.spectrum, written.frequency_response
    assert spectrum is not None
    assert claimed is not None
    w = np.array(spectrum.details["frequencies"]) * task.header.units.frequency
    listed = np.array(spectrum.details["powers"], dtype=float)
    powers = listed[:, None] if listed.ndim == 1 else np.einsum("laa->la", listed)
    counted, ratio = claimed.counted or 0, claimed.worst_ratio or 0.0
    variances = 2.0 * task.lines.noise[:, :, None] / (counted * powers[:, None, :])
    worst = float(np.max(np.sqrt(variances) / task.lines.admitted))
    asked = task.goal in ("cost", "samples")
    if not (abs(worst - ratio) <= delivery.APART * worst and (not asked or worst <= 1.0 + delivery.APART)):
        yield f"the lines leave {worst:.10g} times the deviation admitted, not {ratio:.10g}"
    found = {
        "input": powers,
        "excitation": powers,
        "output": np.einsum("lpr,lr->lp", np.abs(task.experiment.model.plant_at(w)) ** 2, powers),
        "moves": (2.0 - 2.0 * np.cos(w))[:, None] * powers,
    }

    def power(kind: str, channel: int | None) -> float:
        return float(found[kind].sum() if channel is None else found[kind][:, channel].sum())

    paid = sum(weight * power(kind, channel) for kind, channel, weight in weights_of(task.cost))
    yield from delivery.of_cost(paid, written.cost or 0.0)
    for limit in task.limits if task.goal != "given" else ():
        yield from delivery.of_limit(limit, power(limit.kind, limit.channel))
    if written.objective is not None:
        yield from delivery.of_bounds(written.objective)


def _of_record(task: ResponseTask, plan: Planned, written: out.Outcome, record: Array) -> Iterator[str]:
    """Yield a sentence on each claim that the samples contradict: errors are noise over input transforms."""
    signal = written.signal
    assert signal is not None
    u = record - np.array(signal.operating_point or 0.0)
    spread = np.sum(np.abs(np.linalg.inv(task.periods.means(u, task.grid.excited))) ** 2, axis=1)
    noise = 0.5 * plan.deviations**2 * plan.powers[:, None, :] * (1.0 + (signal.extra_power or 0.0))
    found = np.sqrt(noise * spread[:, None, :] * task.periods.blocks)
    apart = float(np.max(np.abs(found / plan.deviations - 1.0)))
    if not apart <= delivery.APART:
        yield f"the samples of the record leave deviations that are off those claimed by {apart:.3g}"
    worst, claimed = float(np.max(found / task.lines.admitted)), signal.worst_ratio or 0.0
    if not abs(worst - claimed) <= delivery.APART * worst:
        yield f"the record leaves {worst:.10g} times what is admitted, not {claimed:.10g}"
