"""Spec -> how its experiment goes in parts, and the plan of each part: an ordinary spec at the estimate."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property, partial

import numpy as np

from inputdesign_cli.errors import IdesignError, InfeasibleError, SpecError
from inputdesign_cli.information import Experiment
from inputdesign_cli.monte_carlo.excitations import Redrawn
from inputdesign_cli.plant import Model
from inputdesign_cli.plant.polynomial import Array
from inputdesign_cli.runs.results import Json, Results
from inputdesign_cli.specification import Spec, parse_spec
from inputdesign_cli.specification.models.campaign import Campaign, Pilot
from inputdesign_cli.specification.models.uncertainty import SOURCES
from inputdesign_cli.tasks.build.convex import build_convex
from inputdesign_cli.tasks.build.given import build_given
from inputdesign_cli.tasks.build.identification import ask, build_identification, restated
from inputdesign_cli.tasks.build.simulation import build_simulation
from inputdesign_cli.tasks.build.system import build_experiment, build_loop, record_step
from inputdesign_cli.tasks.build.uncertainty import farthest_radius
from inputdesign_cli.tasks.campaign import Kind, Planned, Rules, Schedule, Standing
from inputdesign_cli.tasks.campaign_rounds import Rounds
from inputdesign_cli.tasks.campaign_study import CampaignStudy, CampaignTask
from inputdesign_cli.tasks.convex import ConvexTask
from inputdesign_cli.tasks.identification import ModelQuestion
from inputdesign_cli.tasks.record import design_cost
from inputdesign_cli.tasks.record_search import fitting_record

_TENTH, _LONGEST = 10, 3
_INSIDE = 1.0 + 1e-9
_SOURCE = "plan"
# What says how well the plant is known before any data.
_PRIOR = {*SOURCES, "parameters"}


def build_rules(spec: Spec) -> Rules:
    """How the campaign of a spec goes.

    Raises:
        SpecError: it states none, or what this version does not do in parts; `conflicting-keys`.
    """
    stated = spec.campaign
    if stated is None:
        raise spec.complain(
            "missing-key",
            "the spec has no campaign, so that there is one experiment and no parts of it",
            hint="add campaign: {block: 50}, or design the one with idesign solve",
            key="campaign",
        )
    _check(spec, stated)
    pilot = stated.pilot
    return Rules(
        schedule=_schedule(spec, stated, pilot),
        pilot_power=None if pilot is None else pilot.power,
        power_cap=stated.power_cap,
        robust_last=stated.last == "robust",
        stops=stated.stop == "data",
    )


def _schedule(spec: Spec, stated: Campaign, pilot: Pilot | None) -> Schedule:
    samples = spec.experiment.samples
    if pilot is not None and pilot.power is not None:  # what is known before the experiment begins
        samples += pilot.samples
    most = stated.max_samples or max(spec.limits.samples or _LONGEST * samples, samples)
    if most < samples:
        raise spec.complain(
            "conflicting-keys",
            f"the experiment has {samples} samples with its pilot, and the campaign ends at {most}",
            hint="raise campaign.max_samples, or lower experiment.samples",
            key="campaign.max_samples",
        )
    if stated.stages is not None:
        if sum(stated.stages) != samples:
            raise spec.complain(
                "conflicting-keys",
                f"the stages have {sum(stated.stages)} samples together, and the experiment {samples}",
                hint="make them agree: experiment.samples is the length of the whole",
                key="campaign.stages",
            )
        return Schedule(stated.stages, stated.stages[-1], samples, most)
    tenth = max(spec.experiment.samples // _TENTH, 1)
    block = stated.block or tenth
    first = min(block, tenth) if pilot is None else pilot.samples
    for key, length in (("block", block), ("pilot", first)):
        if length > samples:
            raise spec.complain(
                "conflicting-keys",
                f"the {key} has {length} samples, and the whole experiment {samples}",
                hint="parts are shorter than the whole",
                key=f"campaign.{key}",
            )
    return Schedule((first,), block, samples, most)


def _check(spec: Spec, stated: Campaign) -> None:
    """Raise `SpecError` (`not-supported`) for what is not done in parts."""
    what, hint, key = "", "state accuracy.model_error and let the power follow", "campaign"
    accuracy = spec.accuracy
    elsewhere = accuracy.closed_loop_error is not None or accuracy.frequency_response is not None
    if spec.plant.kind == "regression" or elsewhere:
        what = "this kind of design"
    elif not spec.designs:
        what, hint = "a given excitation", "let it be designed: spectrum: {type: fir, order: 20}"
    elif not accuracy.requirements or spec.goal != "least_cost":
        what, hint = "another goal than the least cost", "ask for an accuracy that ends the campaign"
    elif not spec.plant.sampled:
        what, hint = "an experiment in continuous time", "write plant.sample: zoh"
    elif spec.experiment.samples < 2:
        what, hint, key = "an experiment without a length", "state experiment.samples", "experiment.samples"
    elif stated.power_cap is not None and spec.limits.excitation_power is not None:
        what, hint, key = (
            "a power_cap beside limits.excitation_power",
            "keep one of them",
            "campaign.power_cap",
        )
    if what:
        raise spec.complain("not-supported", f"a campaign does not go with {what}", hint=hint, key=key)


def build_campaign(spec: Spec) -> CampaignTask:
    """The design of the first plan in one shot, and the study of whole campaigns.

    Raises:
        SpecError, DataError: see `build_rules` and the builders of a design.
    """
    rules, planner = build_rules(spec), SpecPlanner(spec)
    design, study = build_convex(spec), build_simulation(spec, planner.nominal)
    truth = planner.nominal.model if study.truth is None else study.truth.model
    loop = planner.nominal.loop if study.truth is None else study.truth.loop
    return CampaignTask(
        design=design,
        study=CampaignStudy(
            planner=planner,
            rules=rules,
            true=replace(planner.nominal, model=truth, loop=loop),
            step=record_step(spec),
            cost=study.cost,
            runs=study.runs,
            seed=study.seed,
            white="white" in study.compare,
            has_prior=spec.experiment.prior is not None,
        ),
    )


def build_rounds(spec: Spec) -> Rounds:
    """What the rounds of a real campaign need.

    Raises:
        SpecError, DataError: see `build_rules` and the builders of a design.
    """
    rules, planner = build_rules(spec), SpecPlanner(spec)
    offset = 0.0 if spec.signal.offset is None else spec.signal.offset
    offsets = np.broadcast_to(np.asarray(offset, dtype=float), (planner.nominal.inputs,))
    return Rounds(build_identification(spec), planner, rules, offsets)


@dataclass(frozen=True)
class SpecPlanner:
    """Asks and plans by the spec with an estimate in place of its plant; see `tasks.campaign.Planner`."""

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
        controller = self.spec.experiment.controller
        if controller is None:
            return model.radius
        try:
            return build_loop(self.spec, model, controller).radius
        except SpecError:
            return np.inf

    def question(self, model: Model, information: Array) -> ModelQuestion:
        """What is asked, at a model and in coordinates where the information of the data is I."""
        factor: Array = np.asarray(np.linalg.cholesky(information), dtype=float)
        return ask(restated(self.spec, model, _SOURCE), self.nominal.samples, factor)

    def plan(
        self, rules: Rules, known: Standing | None, done: int, seed: int, first: float | None
    ) -> Planned:
        """The experiment after so many samples."""
        take = rules.schedule.take(done)
        if known is None and done == 0 and rules.pilot_power is not None:
            return self._pilot(rules.pilot_power, take, seed)
        rest, last = rules.schedule.rest(done), rules.schedule.last(done)
        robust, on = rules.robust_last and last, rules.stops or not last
        changes = self._changes(known, rest, seed, white=rules.white, robust=robust, goes_on=on)
        try:
            return self._planned(changes, known, take, rules.power_cap, first)
        except IdesignError:
            if not robust or known is None:
                raise
        # Some plant that the data leave open asks for what cannot be done; the estimate itself may not.
        changes = self._changes(known, rest, seed, white=rules.white, robust=False, goes_on=on)
        return self._planned(changes, known, take, rules.power_cap, first)

    def cheapest(self, model: Model) -> float:
        """Cost, summed over the samples, of the design that knows the plant: the oracle."""
        changes = self._changes(None, self.nominal.samples, 1)
        spec = restated(self.spec, model, _SOURCE).to_yaml()
        overrides = _overrides({**changes, "uncertainty": None, "solver.any_spectrum": False})
        folder = self.spec.resolve_path(".")
        done, _ = build_convex(parse_spec(spec, _SOURCE, overrides, folder=folder)).designed()
        return done.experiment.samples * design_cost(done.design, done.cost)

    def _planned(
        self,
        changes: Mapping[str, Json],
        known: Standing | None,
        take: int,
        cap: float | None,
        first: float | None,
    ) -> Planned:
        """The cheapest experiment; where the cap forbids it, the best that it leaves."""
        most = None if cap is None or first is None else cap * first
        try:
            plan = self._designed(changes, known, take, capped=False)
            if most is None or plan.power <= most * _INSIDE:
                return plan
        except InfeasibleError:
            if most is None:
                raise
        limited = {**changes, "objective": "best_accuracy", "limits.excitation_power": most}
        return self._designed(limited, known, take, capped=True)

    def _designed(
        self, changes: Mapping[str, Json], known: Standing | None, take: int, *, capped: bool
    ) -> Planned:
        quick = self._task({**changes, "solver.any_spectrum": False}, known)
        done, _ = quick.designed()
        made = fitting_record(quick.record, done.question, done.design, done.experiment).record
        rest, cost = done.experiment.samples, design_cost(done.design, done.cost)
        record = np.zeros((rest, done.experiment.inputs)) if made is None else made.samples
        kind: Kind = "white" if "spectrum" in changes else "nominal" if quick.plants is None else "robust"
        solved = partial(self._solved, changes, known)
        return Planned(record, take, _power(record), cost, kind, capped=capped, solved=solved)

    def _task(self, changes: Mapping[str, Json], known: Standing | None) -> ConvexTask:
        return build_convex(self._spec(changes, known))

    def _solved(self, changes: Mapping[str, Json], known: Standing | None) -> Results:
        return self._task(changes, known).solve()

    def _pilot(self, power: float, take: int, seed: int) -> Planned:
        """White noise of this power, even over the inputs."""
        nominal, step = self.nominal, record_step(self.spec)
        powers = np.full(nominal.inputs, power / nominal.inputs)
        drawn = Redrawn.flat("pilot", "white", powers, nominal.band, take, step)
        record = drawn.draw(1, take, np.random.default_rng(seed))[0]
        changes: dict[str, Json] = {
            **self._changes(None, take, seed),
            "spectrum": {"given": {"type": "white", "power": power}},
            "objective": None,
        }

        def solved() -> Results:
            return build_given(self._spec(changes, None)).solve()

        return Planned(record, take, _power(record), 0.0, "pilot", capped=False, solved=solved)

    def _spec(self, changes: Mapping[str, Json], known: Standing | None) -> Spec:
        spec = self.spec if known is None else restated(self.spec, known.model, _SOURCE)
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
            changes["uncertainty"] = {**own, **told} if robust else None
        elif white:
            changes["uncertainty"] = None
        return changes


def _power(record: Array) -> float:
    """Mean square of all channels together."""
    return float(np.sum(np.mean(record**2, axis=0)))


def _overrides(changes: Mapping[str, Json]) -> list[str]:
    return [f"{key}={json.dumps(value)}" for key, value in changes.items()]
