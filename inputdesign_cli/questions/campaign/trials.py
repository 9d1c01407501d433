"""Run whole campaigns on a simulated true system: each run estimates, plans and stops as a real one does."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from functools import partial
from typing import Literal

import numpy as np

from inputdesign_cli.accuracy import model_errors
from inputdesign_cli.arrays import Array
from inputdesign_cli.design.convex.cost import weighted_sum
from inputdesign_cli.errors import IdesignError, InaccurateError, InfeasibleError, SpecError
from inputdesign_cli.findings.neglected import mattering, neglected
from inputdesign_cli.identification import Estimate, fit_batch, identify, information_of_data
from inputdesign_cli.information import POWER_KINDS, Experiment, FiniteRecord, PowerKind
from inputdesign_cli.monte_carlo.study import responses
from inputdesign_cli.plant import Model
from inputdesign_cli.questions.campaign.plans import Planner, standing
from inputdesign_cli.questions.campaign.schedule import Rules, Standing

Ending = Literal["stopped", "missed", "undecided", "unplanned"]
Reference = Literal["true", "estimate", "design"]
_REFERENCES: tuple[Reference, ...] = ("true", "estimate", "design")
_SEEDS = 2**31


@dataclass(frozen=True)
class CampaignStudy:
    """Holds a study of whole campaigns.

    Attributes:
        true: the experiment on the true system, of the planned length.
        white: whether to compare with white excitation that suffices at the estimate.
        uncertain: whether the spec or a pilot bounds the error of the first estimate.
        has_prior: whether the spec states information that runs would have to draw.
    """

    planner: Planner
    rules: Rules
    true: Experiment
    runs: int
    seed: int
    white: bool
    uncertain: bool
    has_prior: bool


@dataclass(frozen=True)
class Ended:
    """Describes the end of one run.

    Attributes:
        status: `stopped` if the data met what is asked; `unplanned` if no experiment could be planned.
        ratio: the largest r_u / r_adm of the true plant by the samples applied; None if the true system has
            other parameters than the model.
        energy: cost per sample times samples, on the true plant.
        within: whether the error of the estimate is within r_adm of the truth, of the estimate and of the
            plant of the spec; None if r_adm cannot be evaluated.
        parts: number of applied parts; `shrunk`: number of parts after which the estimate was not used.
    """

    status: Ending
    samples: int
    energy: float
    theta: Array
    ratio: float | None
    within: Mapping[Reference, bool | None]
    parts: int
    shrunk: int


def run_campaigns(study: CampaignStudy, runs: int, rng: np.random.Generator) -> list[Ended]:
    """Run several campaigns from rest, one after the other, and return their ends."""
    return [_Run(study, rng).end() for _ in range(runs)]


@dataclass
class _Run:
    """Runs one campaign. The noise of all samples is drawn first, so that other ways meet the same noise."""

    study: CampaignStudy
    rng: np.random.Generator
    known: Standing | None = None
    first: float | None = None
    parts: int = 0
    shrunk: set[int] = field(default_factory=set)  # parts, by their numbers

    def __post_init__(self) -> None:
        true = self.study.true
        size = (self.study.rules.schedule.most, true.model.outputs)
        self.e = self.rng.standard_normal(size) @ np.linalg.cholesky(true.model.covariance).T
        self.r: Array = np.zeros((0, true.inputs))
        self.sound = self.last = self.study.planner.nominal.model

    def end(self) -> Ended:
        """Run the campaign from its first plan to its end."""
        rules, planner = self.study.rules, self.study.planner
        while True:
            seed = int(self.rng.integers(_SEEDS))
            try:
                plan = planner.plan(rules, self.known, len(self.r), seed, self.first, self.r)
            except (InfeasibleError, InaccurateError, SpecError):
                return self._ended("unplanned")
            if self.first is None and plan.designed:
                self.first = plan.cost
            self.r = np.concatenate([self.r, plan.applied])
            signals = responses(self.study.true, self.r[None], self.e[None, : len(self.r)], planner.step)
            u, y = (total[0] for _, total in signals)
            self.parts += 1
            self._estimate(u, y)
            over = rules.over(len(self.r), met=self._met)
            asks = rules.stops and not over and self.known is not None
            near = self._identified(u, y, near=True) if asks else None
            if not over and (near is None or not rules.refuted(near)):
                continue
            full = self._anew(u, y)
            if full is not None and not over and rules.refuted(full):
                return self._ended("undecided")
            if rules.over(len(self.r), met=self._met):
                against = full is not None and self._speaks_against(full)
                return self._ended("undecided" if against else "stopped" if self._met else "missed")

    @property
    def _met(self) -> bool:
        return self.known is not None and self.known.met

    def _estimate(self, u: Array, y: Array) -> None:
        """Estimate from the last estimate, or from several starts if there is none."""
        model, step = self.last, self.study.planner.step
        if self.known is not None:
            found = fit_batch(model, u[None], y[None], step, start=model.theta)
            if found.converged[0]:
                self._stand(model.at(found.theta[0], found.noise[0]), u, y)
                return
        self._anew(u, y)

    def _anew(self, u: Array, y: Array) -> Estimate | None:
        """Return the estimate from several starts, which is built on from now on; None if there is none."""
        full = self._identified(u, y)
        if full is not None:
            self._stand(self.last.at(full.theta, full.noise), u, y)
        return full

    def _identified(self, u: Array, y: Array, *, near: bool = False) -> Estimate | None:
        model, step, feedback = self.last, self.study.planner.step, self.study.true.loop is not None
        try:
            return identify(model, u, y, step, start=model.theta, feedback=feedback, rest=True, near=near)
        except SpecError:  # too little is known yet
            return None

    def _speaks_against(self, full: Estimate) -> bool:
        """Return whether the estimate contradicts the structure at the end."""
        if full.tests.failed or not full.search.converged:
            return True
        known = self.known
        if known is None or not known.met:  # more parameters miss it all the more
            return False
        question = self.study.planner.question(known.model, known.information)
        errors = model_errors(question.requirements)
        return bool(mattering(neglected(known.model, full, errors, question.information)))

    def _stand(self, estimate: Model, u: Array, y: Array) -> None:
        informed = partial(information_of_data, u=u, y=y, step=self.study.planner.step)
        stands = standing(self.study.planner, estimate, informed, self.sound)
        if stands is None:
            return
        self.known, self.last = stands, stands.model
        self.shrunk.discard(self.parts)  # a part may be estimated anew
        if stands.share == 1.0:
            self.sound = stands.model
        else:
            self.shrunk.add(self.parts)

    def _ended(self, status: Ending) -> Ended:
        samples = len(self.r)
        return Ended(
            status,
            samples,
            energy_of(self.study.planner, self.r, self.study.true) if samples else 0.0,
            self.last.theta,
            self._true_ratio() if samples else None,
            {of: within(self.study, self.last, of) for of in _REFERENCES},
            self.parts,
            len(self.shrunk),
        )

    def _true_ratio(self) -> float | None:
        """Return the largest r_u / r_adm of the true plant, by the samples applied."""
        true = replace(self.study.true, samples=len(self.r))
        if true.model.names != self.last.names:
            return None
        information = FiniteRecord(true, len(self.r), self.study.planner.step).information(self.r)
        try:
            question = self.study.planner.question(true.model, information)
            return question.ratio(question.information)
        except (IdesignError, np.linalg.LinAlgError):
            return None


def energy_of(planner: Planner, r: Array, true: Experiment) -> float:
    """Return the cost of a record (n, r) on the true plant, summed over its samples."""
    at = FiniteRecord(true, len(r), planner.step)
    powers: dict[PowerKind, list[float]] = {
        kind: np.mean(at.signals(kind, r) ** 2, axis=0).tolist() for kind in POWER_KINDS
    }
    return len(r) * weighted_sum(planner.cost, powers)


def within(study: CampaignStudy, estimate: Model, of: Reference) -> bool | None:
    """Return whether |G_hat - G_0| <= r_adm of the truth, the estimate or the spec at all frequencies."""
    models: dict[Reference, Model] = {
        "true": study.true.model,
        "estimate": estimate,
        "design": study.planner.nominal.model,
    }
    try:
        errors = model_errors(study.planner.question(models[of], np.eye(len(models[of].names))).requirements)
    except IdesignError:
        return None
    kept = []
    for error in errors:
        w = error.grid
        off = np.abs(error.concerned(estimate.plant_at(w) - study.true.model.plant_at(w)))
        kept.append(bool(np.all(np.linalg.norm(off, axis=1) <= error.admissible.at(w))))
    return all(kept) if kept else None
