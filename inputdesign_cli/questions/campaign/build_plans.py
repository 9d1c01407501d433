"""The plan of each part of a campaign: an ordinary spec at the estimate, with the data as its prior."""

from __future__ import annotations

import json
from collections.abc import Mapping
from contextlib import suppress
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from inputdesign_cli.arrays import Array
from inputdesign_cli.design.convex.cost import weighted_sum
from inputdesign_cli.errors import IdesignError, InfeasibleError, SpecError
from inputdesign_cli.information import Experiment
from inputdesign_cli.monte_carlo.excitations import Redrawn
from inputdesign_cli.outcome.results import Json
from inputdesign_cli.plant import Model
from inputdesign_cli.questions.assessment.build import ask, restated
from inputdesign_cli.questions.assessment.identify import ModelQuestion
from inputdesign_cli.questions.building.system import build_cost, build_experiment, build_loop, record_step
from inputdesign_cli.questions.building.uncertainty import farthest_radius
from inputdesign_cli.questions.campaign.part_cost import within_caps
from inputdesign_cli.questions.campaign.schedule import REACHED, Kind, Planned, Rules, Standing
from inputdesign_cli.questions.common.record import RecordRequest, design_cost, given_record
from inputdesign_cli.questions.given.solve import GivenExcitation
from inputdesign_cli.questions.least_cost.audit import audit
from inputdesign_cli.questions.least_cost.build import build_convex
from inputdesign_cli.questions.least_cost.outcome import Designed, design_result
from inputdesign_cli.questions.least_cost.record_search import fitting_record
from inputdesign_cli.signal import DesignedSpectrum
from inputdesign_cli.specification import Spec, parse_spec
from inputdesign_cli.specification.models.uncertainty import SOURCES
from inputdesign_cli.spectrum import FlatBasis

# A length within the cap is near enough to the shortest: by this factor, or at this share of the cap.
_CLOSE, _MOSTLY = 1.1, 0.5
_LONGER = 4.0  # by which a length grows at once
# A part may cost so many times the cap at the plant of the spec where that depends on the plant, and the
# first plan after a pilot so many times the design for that plant.
_ELSEWHERE = 10.0
_SOURCE = "plan"
# What says how well the plant is known before any data.
_PRIOR = {*SOURCES, "parameters"}


@dataclass(frozen=True)
class SpecPlanner:
    """Asks and plans by the spec with an estimate in place of its plant; see `schedule.Planner`."""

    spec: Spec

    @cached_property
    def nominal(self) -> Experiment:
        """The experiment on the plant of the spec, in raw parameters."""
        return build_experiment(self.spec)

    @cached_property
    def farthest(self) -> float:
        """The radius beyond which an estimate is not built on."""
        return farthest_radius(self.spec, self.nominal)

    def radius(self, model: Model) -> float:
        """Of the farthest pole of the plant, or of its loop."""
        try:
            loop = self._experiment(model).loop
        except SpecError:
            return np.inf
        return model.radius if loop is None else loop.radius

    def _experiment(self, model: Model) -> Experiment:
        """The experiment on another plant, in raw parameters."""
        controller = self.spec.experiment.controller
        loop = None if controller is None else build_loop(self.spec, model, controller)
        return replace(self.nominal, model=model, loop=loop)

    def question(self, model: Model, information: Array) -> ModelQuestion:
        """What is asked, at a model and in coordinates where the information of the data is I."""
        factor: Array = np.asarray(np.linalg.cholesky(information), dtype=float)
        return ask(restated(self.spec, model, _SOURCE), self.nominal.samples, factor)

    def plan(
        self,
        rules: Rules,
        known: Standing | None,
        done: int,
        seed: int,
        first: float | None,
        before: Array | None = None,
    ) -> Planned:
        """The experiment after so many samples."""
        take = rules.schedule.take(done)
        earlier = np.zeros((0, self.nominal.inputs)) if before is None else before
        if known is None and done == 0 and rules.pilot_power is not None:
            return self._kept(self._pilot(rules.pilot_power, take, seed), rules, np.inf, None, earlier)
        cap = rules.cap(first)
        if first is None and known is not None and rules.learns_first:
            cap = _ELSEWHERE * self._unlearned
        last = rules.schedule.last(done)
        on = rules.stops or not last
        rest, longest = rules.schedule.rest(done), rules.end - done
        if rules.robust_last and last and known is not None:
            changes = self._changes(known, rest, seed, white=rules.white, robust=True, goes_on=on)
            # Some plant that the data leave open may ask for what cannot be done; the estimate need not.
            with suppress(IdesignError):
                found = self._designed(changes, known)
                if found.cost <= cap * REACHED:
                    return self._kept(found.planned.cut(take), rules, cap, known, earlier)
        changes = self._changes(known, rest, seed, white=rules.white, goes_on=on)
        if known is None and rules.robust_last:
            del changes["uncertainty"]  # what the spec knows of the plant
        try:
            plan = self._affordable(changes, known, cap, longest).cut(take)
            # The first plan sets the cap, which its own part keeps as well.
            own = rules.cap(plan.cost) if first is None else np.inf
            return self._kept(plan, rules, min(cap, own), known, earlier)
        except IdesignError as error:
            if known is None:
                raise
            # The estimate may be far off, and the next part will tell: nothing is decided by it.
            cost = np.inf if first is None else min(cap, first)
            gap = self._stopgap(rules, cost, rest, seed, error).cut(take)
            return self._kept(gap, rules, cap, None, earlier)

    @cached_property
    def _unlearned(self) -> float:
        """Cost of a sample of the design for the plant of the spec; infinite without one, or if free."""
        try:
            cost = self.cheapest(self.nominal.model) / self.nominal.samples
        except IdesignError:
            return np.inf
        return cost or np.inf

    def _kept(
        self, plan: Planned, rules: Rules, cap: float, known: Standing | None, before: Array
    ) -> Planned:
        """The plan whose first part costs no more than the cap, at its estimate and at the plant of the spec.

        A part may be stronger than its plan is on average. And where outputs are paid for, what costs little
        at an estimate (that of a sensor which is not connected) may cost any amount elsewhere; plants differ,
        so that the cap is wide there.
        """
        if before.size:
            plan = plan.following(before[-1], rules.rate)
        weights, caps = build_cost(self.spec), [(self.nominal, cap)]
        if known is not None:
            wide = _ELSEWHERE if any(map(self.nominal.depends_on_plant, weights)) else 1.0
            caps = [(self._experiment(known.model), cap), (self.nominal, wide * cap)]
        return within_caps(plan, caps, weights, record_step(self.spec), before)

    def cheapest(self, model: Model) -> float:
        """Cost, summed over the samples, of the spectrum of the design that knows the plant."""
        return self.nominal.samples * self._knowing(model).cost

    def knowing(self, model: Model) -> tuple[float, Array | None]:
        """That cost, and the record of that design."""
        found, record = self._knowing(model), None
        with suppress(IdesignError):
            record = found.planned.record
        return self.nominal.samples * found.cost, record

    def _knowing(self, model: Model) -> _Found:
        changes = self._changes(None, self.nominal.samples, self.spec.signal.seed or 0)
        return self._designed_at(model, changes)

    def _affordable(
        self, changes: Mapping[str, Json], known: Standing | None, cap: float, longest: int
    ) -> Planned:
        """The cheapest experiment; where a sample of it costs more than the cap, the shortest that does not.

        Where the longest still does, that at the cap; where limits leave none, the best within them.
        """

        def tried(samples: int) -> _Found | None:
            try:
                return self._designed({**changes, "experiment.samples": samples}, known)
            except InfeasibleError:
                return None

        rest = int(changes["experiment.samples"])
        short, found = rest, tried(rest)
        fits = found is not None and found.cost <= cap * REACHED
        while not fits and rest < longest:
            more = 2.0 if found is None else min(found.cost / cap, _LONGER)
            short, rest = rest, int(min(np.ceil(max(more, 1.1) * rest), longest))
            found = tried(rest)
            fits = found is not None and found.cost <= cap * REACHED
        if found is None:
            if not self.spec.limits.bounds_power:
                return self._designed(changes, known).planned  # says what is infeasible
            best = self._designed({**changes, "objective": "best_accuracy"}, known)
            return replace(best.planned, capped=True)
        while fits and rest > _CLOSE * short and found.cost < _MOSTLY * cap:
            middle = int(np.sqrt(short * rest))
            between = tried(middle)
            if between is not None and between.cost <= cap * REACHED:
                found, rest = between, middle
            else:
                short = middle
        return found.planned.at_most(cap)

    def _designed(self, changes: Mapping[str, Json], known: Standing | None) -> _Found:
        return self._designed_at(None if known is None else known.model, changes)

    def _designed_at(self, model: Model | None, changes: Mapping[str, Json]) -> _Found:
        task = build_convex(self._spec({**changes, "solver.any_spectrum": False}, model))
        done, how = task.designed()
        kind: Kind = "white" if "spectrum" in changes else "nominal" if task.plants is None else "robust"
        return _Found(task.record, done, how, task.tolerance, kind)

    def _pilot(self, power: float, take: int, seed: int) -> Planned:
        """White noise of this power, even over the inputs."""
        nominal, step = self.nominal, record_step(self.spec)
        powers = np.full(nominal.inputs, power / nominal.inputs)
        drawn = Redrawn.flat("pilot", "white", powers, nominal.band, take, step)
        record = drawn.draw(1, take, np.random.default_rng(seed))[0]
        return Planned(record, take, _power(record), 0.0, "pilot")

    def _stopgap(self, rules: Rules, cost: float, rest: int, seed: int, why: IdesignError) -> Planned:
        """White noise, a sample of which costs so much, or as the pilot where nothing else was applied."""
        task = build_convex(self._spec(self._changes(None, rest, seed), None))
        unit = weighted_sum(task.cost, GivenExcitation.even(self.nominal, 1.0).power)
        power = cost / unit if np.isfinite(cost) else rules.pilot_power or 0.0
        flat = FlatBasis(self.nominal.inputs, self.nominal.band)
        spectrum = DesignedSpectrum.of(
            flat, np.array([power]), inputs=self.nominal.inputs, step=task.record.step
        )
        record = given_record(task.record, self.nominal, spectrum, lambda information: 0.0)
        samples = np.zeros((rest, self.nominal.inputs)) if record is None else record.samples
        cost = power * unit
        return Planned(samples, rest, _power(samples), cost, "stopgap", why=why.diagnostics[0].message)

    def _spec(self, changes: Mapping[str, Json], model: Model | None) -> Spec:
        spec = self.spec if model is None else restated(self.spec, model, _SOURCE)
        return parse_spec(
            spec.to_yaml(), file=_SOURCE, overrides=_overrides(changes), folder=self.spec.resolve_path(".")
        )

    def _changes(
        self,
        known: Standing | None,
        rest: int,
        seed: int,
        *,
        white: bool = False,
        robust: bool = False,
        goes_on: bool = False,
    ) -> dict[str, Json]:
        """What the spec of a plan has in place of that of the campaign.

        Args:
            goes_on: whether another part follows, in which what this one has caused still tells: the record
                has then the power of the design, and does not make up for its own end.
        """
        stated = self.spec.uncertainty
        own = {} if stated is None else stated.model_dump(mode="json", exclude_unset=True, exclude=_PRIOR)
        changes: dict[str, Json] = {
            "campaign": None,
            "simulation": None,
            "experiment.samples": rest,
            "signal.samples": None,
            "signal.seed": seed,
            "uncertainty": None,
        }
        if self.spec.experiment.duration is not None:
            changes["experiment.duration"] = None
        if goes_on and self.spec.signal.scale is None and self.spec.signal.amplitudes is None:
            changes["signal.scale"] = "design"
        if white:
            changes["spectrum"] = {"type": "white"}
        if known is not None:
            told = {"parameters": list(known.model.names), "information": known.information.tolist()}
            changes["experiment.prior"] = told
            if robust:
                changes["uncertainty"] = {**own, **told}
        return changes


@dataclass(frozen=True)
class _Found:
    """A design, of which the record is made when it is wanted."""

    request: RecordRequest
    done: Designed
    how: Mapping[str, Json]
    tolerance: float
    kind: Kind

    @cached_property
    def cost(self) -> float:
        """Of a sample."""
        return design_cost(self.done.design, self.done.cost)

    @property
    def planned(self) -> Planned:
        """With its record; zero where nothing needs to be applied."""
        done = self.done
        made = fitting_record(self.request, done.question, done.design, done.experiment.samples).record
        silent = np.zeros((done.experiment.samples, done.experiment.inputs))
        record = silent if made is None else made.samples
        return Planned(record, len(record), _power(record), self.cost, self.kind, claim=self._claim)

    def _claim(self) -> Mapping[str, Json]:
        """What is proved of the design, evaluated once more by other means.

        Raises:
            InaccurateError: `internal-disagreement`.
        """
        result = design_result(self.done, dict(self.how), self.tolerance)
        audit(self.done, result, on_grid=False)
        return {key: result[key] for key in ("status", "objective", "spectrum")}


def _power(record: Array) -> float:
    """Mean square of all channels together."""
    return float(np.sum(np.mean(record**2, axis=0)))


def _overrides(changes: Mapping[str, Json]) -> list[str]:
    return [f"{key}={json.dumps(value)}" for key, value in changes.items()]
