"""Design the lines of a frequency response, realise and reread them, and try them on a true system."""

from __future__ import annotations

import time
from dataclasses import dataclass, replace
from functools import partial

import numpy as np
from numpy.typing import NDArray

from inputdesign_cli.arrays import Array
from inputdesign_cli.compute.executor import Executor
from inputdesign_cli.design.convex.response_lines import (
    ResponseDesign,
    UnreachableError,
    cheapest,
    most_accurate,
)
from inputdesign_cli.errors import Diagnostic, InfeasibleError, bad_spec
from inputdesign_cli.identification.periodic_response import response_at
from inputdesign_cli.monte_carlo.response import study_response
from inputdesign_cli.outcome import Simulation as SimulationOutcome
from inputdesign_cli.outcome.results import Results, Table
from inputdesign_cli.outcome.shares import rounded_up
from inputdesign_cli.plant.noise_spectrum import NoiseSpectrum
from inputdesign_cli.questions.common.delivery import timing, with_study
from inputdesign_cli.questions.common.infeasible import contradictory, named
from inputdesign_cli.questions.common.record import RecordRequest, no_record
from inputdesign_cli.questions.common.simulation import Simulation
from inputdesign_cli.questions.frequency_response import outcome
from inputdesign_cli.questions.frequency_response.outcome import KEY, Planned, ResponseTerms, audit_response
from inputdesign_cli.signal.kind import Draft
from inputdesign_cli.signal.limits import limited_responses
from inputdesign_cli.signal.lines import Lines
from inputdesign_cli.signal.multisine import Multisine
from inputdesign_cli.signal.selection import Record
from inputdesign_cli.signal.settings import Phases

_ROUNDING = 1e-9
_STREAM = 0x5EED


@dataclass(frozen=True)
class ResponseTask:
    """Designs lines, or analyses given ones, and studies them.

    Attributes:
        given: (L, r) powers that are not designed.
    """

    terms: ResponseTerms
    given: Array | None
    record: RecordRequest
    simulation: Simulation

    def solve(self) -> Results:
        """Return the design, or the accuracy of given lines, with its signal and its curves."""
        return self._solved()[1]

    def simulate(self, executor: Executor | None = None) -> Results:
        """Return the design, and beside its deviations the scatter of many simulated experiments."""
        terms, study = self.terms, self.simulation
        if study.runs < 2:
            hint = "write simulation.runs: 1000, whose deviations are known to 2 %"
            message = "a single run has no standard deviation"
            raise bad_spec("out-of-range", message, hint=hint, key="simulation.runs")
        plan, results = self._solved()
        begun = time.perf_counter()
        nominal, power = terms.experiment, results.outcome.power
        if study.truth is not None and power is not None:
            nominal = study.on_truth(nominal, power.output or ())
        tried = partial(study_response, runs=study.runs, seed=study.seed, executor=executor)
        at = terms.periods, terms.grid.excited
        designed = tried(nominal.model, plan.record.samples, *at)
        inputs = {"design": outcome.tried_lines(terms, plan, plan.applied, designed)}
        if study.compare:
            white = tried(nominal.model, self._best(plan.flat, plan.length), *at)
            inputs["white"] = outcome.tried_lines(terms, plan, plan.flat, white)
        columns, curves = outcome.deviations(terms, plan, designed)
        tables = {"deviations": Table({**results.tables["deviations"].columns, **columns})}
        entry = SimulationOutcome(study.runs, study.seed, inputs, samples=plan.length)
        return with_study(results, entry, begun, tables=tables, curves={"deviations": curves})

    def _designed(self) -> tuple[ResponseDesign, int]:
        """Return the powers and the samples that count."""
        terms, samples = self.terms, self.terms.experiment.samples
        problem = terms.problem(samples)
        if self.given is not None:
            flat = self.given.ravel()
            return ResponseDesign(flat, float(problem.price @ flat), float(problem.price @ flat)), samples
        try:
            design = cheapest(problem) if terms.goal == "cost" else most_accurate(problem)
        except UnreachableError as error:
            raise self._unreachable(error, samples) from error
        return design, self._whole(1.0 / design.value) if terms.goal == "samples" else samples

    def _whole(self, samples: float) -> int:
        """Return a number of samples rounded up to whole periods."""
        whole = self.terms.periods.blocks * self.terms.periods.period
        return whole * int(np.ceil(samples / whole * (1.0 - 1e-12)))

    def _solved(self) -> tuple[Planned, Results]:
        started = time.perf_counter()
        design, counted = self._designed()
        solved = time.perf_counter()
        plan = self._planned(design, counted)
        terms = replace(self.terms, experiment=replace(self.terms.experiment, samples=plan.counted))
        results = outcome.response_results(terms, plan, self.record, timing(started, solved))
        audit_response(terms, plan, results)
        return plan, results

    def _planned(self, design: ResponseDesign, counted: int) -> Planned:
        """Return the record of a design, scaled so that it meets the accuracy or keeps to the limits."""
        terms = self.terms
        powers = design.powers.reshape(-1, terms.experiment.inputs)
        samples = self._best(powers, self._length(counted))
        beyond = self._beyond(samples)
        if terms.goal == "samples" and beyond > 1.0:
            # The lines are scaled into the limits, and more periods make up for it.
            counted = self._whole(beyond**2 / design.value)
            samples = self._best(powers, self._length(counted))
            beyond = self._beyond(samples)
        problem, noise, periods = terms.problem(counted), terms.lines.noise, terms.periods
        if not terms.tabulated:
            times = counted // (periods.blocks * periods.period)
            spectrum = NoiseSpectrum.of(terms.experiment.model)
            noise = spectrum.averaged(terms.grid.period, terms.grid.excited, times)
        exact = terms.lines.deviations(powers, counted, noise)
        worst, scale = float(np.max(terms.lines.ratios(exact))), 1.0
        if terms.goal == "cost" and self.record.meets:
            scale = min(worst, float(np.sqrt(problem.alike(design.powers / problem.needed))))
            if scale * beyond > 1.0 + _ROUNDING:
                length, factor = len(samples), rounded_up(scale * beyond, 4)
                more = self.record.units.length(int(np.ceil(length * (scale * beyond) ** 2)))
                best = f"meets the accuracy: its peaks are {factor} times as large as they allow"
                hint = f"write {more}; raise the limits, admit {factor} times as much, or write "
                hint += "objective: shortest_experiment"
                raise no_record(self.record, length, best, hint)
        elif self.given is None:
            scale = 1.0 / max(beyond, 1.0)
        samples, exact = scale * samples, exact / scale
        record = Record(samples, "multisine", worst / scale, extra_power=scale**2 - 1.0)
        # The largest shift of G by the start, in standard deviations.
        U, Y = (periods.means(x, terms.grid.excited) for x in (samples, self._answer(samples)))
        shift = float(np.max(np.abs(response_at(U, Y) - terms.lines.G) / exact))
        return Planned(design, problem, powers, counted, record, exact, shift)

    def _unreachable(self, error: UnreachableError, samples: int) -> InfeasibleError:
        """Return the error that limits exclude the accuracy, with the numbers of the spec that would do."""
        factor, limits = error.factor, tuple(dict.fromkeys(error.limits))
        if not np.isfinite(factor):
            return contradictory(limits, "contradict each other: no powers of these lines keep all of them")
        exhausted = " and ".join(dict.fromkeys(map(named, limits)))
        raised = (factor * one.bound**0.5 if one.implied else factor**2 * one.bound for one in limits)
        needed = (f"{one.key} to {rounded_up(to)}" for one, to in zip(limits, raised, strict=True))
        more, times = int(np.ceil(samples * factor**2)), rounded_up(factor, 4)
        message = f"the limits buy deviations {times} times those admitted; the {exhausted} is exhausted"
        longer = f"count {more} samples in place of {samples}"
        hint = f"raise {' and '.join(needed)}, {longer}, or admit {times} times as much"
        details = {"factor": factor}
        return InfeasibleError(Diagnostic("infeasible", message, hint, limits[0].key, details=details))

    def _length(self, counted: int) -> int:
        """Return the length of a record with its transient; raise `too-long` or `too-large`."""
        periods, most = self.terms.periods, self.terms.most_samples
        length = counted + periods.blocks * periods.skip * periods.period
        if self.terms.goal == "samples" and most is not None and length > most:
            limit, takes = self.record.units.length(length, "limits"), f"{length} samples, transient included"
            message = f"the shortest record of whole periods takes {takes}, and {most} are allowed"
            hint = f"write {limit}, allow more power, or ask for less accuracy"
            raise InfeasibleError.because("too-long", message, hint, limit.split(":")[0])
        if length > self.record.longest:
            message = f"the record has {length} samples, and at most {self.record.longest} are computed"
            raise bad_spec("too-large", message, hint="ask for less accuracy, or allow more power", key=KEY)
        return length

    def _best(self, powers: NDArray[np.float64], length: int) -> Array:
        """Return the record (length, r), with powers (L, r) of the lines, of the lowest peak of several."""
        grid, settings, bounds = self.terms.grid, self.record.settings, self.record.bounds
        r, period = powers.shape[1], grid.period
        diagonal = np.einsum("lr,rs->lrs", powers, np.eye(r)).astype(complex)
        limited = partial(limited_responses, self.terms.experiment, bounds, 1.0, 1)
        lines = Lines(grid.frequencies, diagonal, period)

        def drawn(number: int) -> Array:
            rng = np.random.default_rng(np.random.SeedSequence(settings.seed, spawn_key=(_STREAM, number)))
            phases: Phases = "orthogonal" if settings.phases == "random" else settings.phases
            phases = "even" if (phases, number) == ("optimised", 0) else phases
            draft = Draft(lines, r * period, replace(settings, phases=phases), limited=limited)
            blocks = np.split(Multisine().draw(draft, rng), r)  # each in as many periods
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
        model = self.terms.experiment.model
        return np.asarray(model.simulate(u[None], np.zeros((1, 1, model.outputs)), 1.0)[0][0])
