"""Spec -> the model to be estimated from data, and the question of the design at the estimate."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import partial

import numpy as np

from inputdesign_cli.accuracy.calibration import with_alpha
from inputdesign_cli.arrays import Array
from inputdesign_cli.errors import bad_spec
from inputdesign_cli.identification import Earlier, Noise
from inputdesign_cli.outcome.model_words import blocks_of
from inputdesign_cli.outcome.results import Results
from inputdesign_cli.plant import Model
from inputdesign_cli.questions.assessment.identify import Identification, ModelQuestion
from inputdesign_cli.questions.building.controllers import controller_matrix
from inputdesign_cli.questions.building.header import build_header
from inputdesign_cli.questions.building.model_error import build_confidence, unstated_errors
from inputdesign_cli.questions.building.requirements import build_requirements
from inputdesign_cli.questions.building.signal_settings import operating_points
from inputdesign_cli.questions.building.system import (
    build_earlier,
    build_experiment,
    build_model,
    prior_record,
    record_step,
    stated_prior,
)
from inputdesign_cli.questions.building.uncertainty import (
    build_foreseen,
    build_knowledge,
    build_nominal_covariance,
)
from inputdesign_cli.questions.least_cost.build import build_convex
from inputdesign_cli.specification import Spec


def build_identification(spec: Spec) -> Identification:
    """Return the task of `identify` and `assess`.

    Raises:
        SpecError: the plant has no such model.
    """
    if spec.plant.kind == "regression":
        raise bad_spec(
            "not-supported",
            "a regression is no model of a plant that could be estimated from u and y",
            hint="write the plant as polynomials A, B, F in q^-1, or in s under continuous",
            key="plant",
        )
    nominal = build_model(spec)
    # Errors of a prior are raised before any data are read, even if it does not count for these data.
    stated_prior(spec, nominal.names)
    prior_record(spec)
    controller = spec.experiment.controller
    record_step(spec)  # raises if samples are too far apart for the plant
    return Identification(
        header=build_header(spec),
        nominal=nominal,
        nominal_covariance=build_nominal_covariance(spec, nominal),
        assessable=bool(spec.accuracy.requirements),
        operating_point=operating_point(spec),
        earlier=build_earlier(spec, nominal),
        has_prior=spec.experiment.prior is not None,
        hold=spec.signal.hold if isinstance(spec.signal.hold, int) else 1,
        controller=None
        if controller is None
        else controller_matrix(controller, spec.sample_time, (nominal.inputs, nominal.outputs)),
        knowledge=build_knowledge(spec),
        foreseen=build_foreseen(spec, nominal),
        at=partial(question_at, spec),
        with_noise=lambda model, more: build_identification(_with_noise(spec, model, more)),
    )


def _with_noise(spec: Spec, model: Model, more: Sequence[Noise]) -> Spec:
    """Return the spec with the noise of a model, whose C and D are multiplied by further factors.

    Raises:
        SpecError: the noise is known, or this plant cannot have it (one that is not sampled, say).
    """
    stated = blocks_of(model)["noise"]
    if "known" in stated:
        raise bad_spec("not-supported", "noise.known fixes the noise", hint="leave it out", key="noise.known")
    changes: dict[str, object] = {"noise": stated}
    for letter, factors in zip("CD", zip(*more, strict=True), strict=True):
        own = stated.get(letter, [1.0])
        rows = own if isinstance(own[0], list) else [own] * len(factors)
        longer = [np.convolve(row, factor).tolist() for row, factor in zip(rows, factors, strict=True)]
        changes[f"noise.{letter}"] = longer if len(longer) > 1 else longer[0]
    return spec.revised(changes, file="noise", design=False)


def operating_point(spec: Spec) -> dict[str, float]:
    """Return the levels of u, `signal.offset`; empty in closed loop, where they are levels of r."""
    if spec.closed_loop or spec.signal.offset is None:
        return {}
    return {f"u{j + 1}": float(level) for j, level in enumerate(operating_points(spec))}


def question_at(stated: Spec, model: Model, samples: int, factor: Array, source: str) -> ModelQuestion:
    """Return the question of a spec at a model, for data of some length and a factor of their information.

    Args:
        factor: (k, k), a factor of the information of the data.
        source: the name of the model in diagnostics.

    Raises:
        SpecError: the loop is unstable; see the builders of the parts.
    """
    spec = stated.revised(blocks_of(model), file=source, design=False)
    raw = build_experiment(spec).with_samples(samples)
    experiment = replace(raw, factor=factor)

    def topped_up(levels: Mapping[str, float]) -> Results:
        # With values, the prior also enters the estimate when the spec is assessed with further records.
        values = dict(zip(raw.model.names, raw.model.theta.tolist(), strict=True))
        prior = {"parameters": values, "information": factor @ factor.T}
        changes: dict[str, object] = {"experiment.prior": prior}
        # The record gets the levels of the data, and intervals are widened to contain the estimate.
        inputs = [f"u{j + 1}" for j in range(spec.plant.inputs)]
        if not spec.closed_loop and spec.signal.offset is None and set(inputs) & set(levels):
            offsets = [levels.get(name, 0.0) for name in inputs]
            changes["signal.offset"] = offsets if len(offsets) > 1 else offsets[0]
        if spec.uncertainty is not None and spec.uncertainty.intervals is not None:
            changes["uncertainty.intervals"] = {
                name: (min(low, values.get(name, low)), max(high, values.get(name, high)))
                for name, (low, high) in spec.uncertainty.intervals.items()
            }
        task = build_convex(spec.revised(changes, file="top-up", design=True))
        if task.foresight is None:
            return task.solve()
        # The top-up will be assessed together with the data.
        earlier = Earlier(raw.model.theta, factor @ factor.T)
        return replace(task, foresight=replace(task.foresight, earlier=earlier)).solve()

    requirements = [make(experiment) for make in build_requirements(spec, raw)]
    confidence = build_confidence(spec, raw).of(requirements, np.eye(experiment.size))
    return ModelQuestion(
        experiment=experiment,
        confidence=confidence,
        requirements=with_alpha(requirements, confidence.alpha),
        entries=[replace(error, experiment=experiment) for error in unstated_errors(spec, raw)],
        top_up=topped_up if spec.designs else None,
    )
