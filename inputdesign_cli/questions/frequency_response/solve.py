"""The lines of a frequency response: designed, realised, reread, and tried on a simulated true system."""

from __future__ import annotations

import time
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from inputdesign_cli.arrays import Array
from inputdesign_cli.compute.executor import Executor
from inputdesign_cli.design.convex.cost import weights_of
from inputdesign_cli.design.response import (
    ResponseDesign,
    ResponseProblem,
    UnreachableError,
    cheapest,
    most_accurate,
)
from inputdesign_cli.errors import bad_spec
from inputdesign_cli.identification.periodic_response import response_at
from inputdesign_cli.information import PowerKind
from inputdesign_cli.monte_carlo.response import ResponseStudy, study_response
from inputdesign_cli.outcome.results import Results
from inputdesign_cli.plant.noise_spectrum import NoiseSpectrum
from inputdesign_cli.questions.common.record import RecordRequest
from inputdesign_cli.questions.common.simulation import Simulation
from inputdesign_cli.questions.frequency_response.audit import audit_response
from inputdesign_cli.questions.frequency_response.limits import too_long, too_tight, unreachable
from inputdesign_cli.questions.frequency_response.outcome import (
    Planned,
    ResponseTerms,
    design_result,
    flat_powers,
    response_results,
    study_results,
)
from inputdesign_cli.questions.frequency_response.record import LineRecords
from inputdesign_cli.signal import Record

KEY = "accuracy.frequency_response"
_ROUNDING = 1e-9


@dataclass(frozen=True)
class ResponseTask(ResponseTerms):
    """A design of lines, or the analysis of given ones, and its study.

    Attributes:
        given: (L, r) powers that are not designed.
        tabulated: whether the noise comes from a table, so that there is no model of it.
    """

    given: NDArray[np.float64] | None
    tabulated: bool
    record: RecordRequest
    simulation: Simulation

    def solve(self) -> Results:
        """The powers of the lines, their proof, and a record.

        Raises:
            InfeasibleError: the limits exclude the accuracy.
            InaccurateError: `solver-failed`, `gap-not-closed`, `internal-disagreement`.
        """
        return self._solved()[1]

    def simulate(self, executor: Executor | None = None) -> Results:
        """The same, with the deviations of many simulated experiments beside the designed ones.

        Raises:
            SpecError: `not-supported` for inputs to compare with; see `solve`.
        """
        if any(name != "white" for name in self.simulation.compare):
            raise bad_spec(
                "not-supported",
                "a frequency response is compared with that of equal lines only",
                hint="write compare: [white], which stands for lines of equal power",
                key="simulation.compare",
            )
        if self.simulation.runs < 2:
            raise bad_spec(
                "out-of-range",
                "a single run has no standard deviation",
                hint="write simulation.runs: 1000, whose deviations are known to 2 %",
                key="simulation.runs",
            )
        plan, results = self._solved()
        begun = time.perf_counter()
        records = {"design": plan.record.samples}
        if self.simulation.compare:
            records["white"] = self._records.best(flat_powers(plan), len(plan.record.samples))
        truth, nominal = self.simulation.truth, self.experiment
        if truth is not None:
            nominal = truth.experiment(nominal, results.result["power"]["output"])
        studies: dict[str, ResponseStudy] = {
            name: study_response(
                nominal.model,
                u,
                self.periods,
                self.grid.excited,
                runs=self.simulation.runs,
                seed=self.simulation.seed,
                executor=executor,
            )
            for name, u in records.items()
        }
        return study_results(self, plan, results, studies, self.simulation, begun)

    def _problem(self, samples: int) -> ResponseProblem:
        shape = self.lines.G.shape[0], self.experiment.inputs
        price = sum(
            (w * self._row(kind, channel) for kind, channel, w in weights_of(self.cost)), np.zeros(shape)
        )
        rows = [self._row(limit.kind, limit.channel).ravel() for limit in self.limits]
        return ResponseProblem(
            self.lines.needed(samples).ravel(),
            price.ravel(),
            self.limits,
            np.array(rows).reshape(len(rows), np.prod(shape)),
        )

    def _row(self, kind: PowerKind, channel: int | None) -> NDArray[np.float64]:
        """(L, r): what a unit of power of each line adds to a power."""
        gains = np.abs(self.experiment.response(kind, self.grid.frequencies)) ** 2
        return np.asarray(gains.sum(axis=1) if channel is None else gains[:, channel])

    def _designed(self) -> tuple[ResponseDesign, int]:
        """The powers and the samples that count."""
        samples = self.experiment.samples
        problem = self._problem(samples)
        if self.given is not None:
            flat = self.given.ravel()
            return ResponseDesign(flat, float(problem.price @ flat), float(problem.price @ flat)), samples
        try:
            design = cheapest(problem) if self.goal == "cost" else most_accurate(problem)
        except UnreachableError as error:
            raise unreachable(self.header.units, error, samples) from error
        if self.goal == "samples":
            samples = self._whole(1.0 / design.value)
        return design, samples

    def _whole(self, samples: float) -> int:
        """So many samples at least, in whole periods."""
        whole = self.periods.blocks * self.periods.period
        return whole * int(np.ceil(samples / whole * (1.0 - 1e-12)))

    def _solved(self) -> tuple[Planned, Results]:
        started = time.perf_counter()
        design, counted = self._designed()
        flat = self._problem(counted)
        powers = design.powers.reshape(-1, self.experiment.inputs)
        length = counted + self.periods.blocks * self.periods.skip * self.periods.period
        self._check_length(length)
        solved = time.perf_counter()
        samples = self._records.best(powers, length)
        beyond = self._records.beyond(samples)
        if self.goal == "samples" and beyond > 1.0:
            # The lines are scaled into the limits, and more periods make up for it.
            length -= counted
            counted = self._whole(beyond**2 / design.value)
            length += counted
            self._check_length(length)
            samples = self._records.best(powers, length)
            beyond = self._records.beyond(samples)
        experiment = replace(self.experiment, samples=counted)
        noise = self.lines.noise
        if not self.tabulated:
            spectrum = NoiseSpectrum.of(self.experiment.model)
            noise = spectrum.averaged(
                self.grid.period, self.grid.excited, counted // (self.periods.blocks * self.periods.period)
            )
        exact = self.lines.deviations(powers, counted, noise)
        worst = float(np.max(self.lines.ratios(exact)))
        scale = 1.0
        if self.goal == "cost" and self.record.meets:
            scale = min(worst, float(np.sqrt(flat.alike(design.powers / flat.needed))))
            if scale * beyond > 1.0 + _ROUNDING:
                raise too_tight(self.header.units, self.record.limit_keys, scale * beyond, length)
        elif self.given is None:
            scale = 1.0 / max(beyond, 1.0)
        samples, exact = scale * samples, exact / scale
        record = Record(samples, "multisine", worst / scale, extra_power=scale**2 - 1.0)
        plan = Planned(
            design,
            flat,
            powers,
            counted,
            length,
            record,
            exact,
            self._shifted(samples, exact),
            not self.tabulated,
        )
        timing = {"design": solved - started, "signal": time.perf_counter() - solved}
        terms = replace(self, experiment=experiment)
        result = {**design_result(terms, plan), "timing_s": timing}
        results = response_results(terms, plan, result, self.record)
        audit_response(terms, plan, results)
        return plan, results

    def _check_length(self, length: int) -> None:
        """Raise where the shortest experiment is longer than it may be, or than records are."""
        if self.goal == "samples" and self.most_samples is not None and length > self.most_samples:
            raise too_long(self.header.units, length, self.most_samples)
        if length > self.record.longest:
            raise bad_spec(
                "too-large",
                f"the record has {length} samples, and at most {self.record.longest} are computed",
                hint="ask for less accuracy, or allow more power",
                key=KEY,
            )

    @property
    def _records(self) -> LineRecords:
        return LineRecords(self.experiment, self.grid, self.record.settings, self.record.bounds)

    def _shifted(self, u: Array, deviations: NDArray[np.float64]) -> float:
        """How far what the start leaves shifts G, in standard deviations at most."""
        quiet = np.zeros((1, 1, self.experiment.model.outputs))
        y = self.experiment.model.simulate(u[None], quiet, 1.0)[0][0]
        U, Y = (self.periods.means(signal, self.grid.excited) for signal in (u, y))
        return float(np.max(np.abs(response_at(U, Y) - self.lines.G) / deviations))
