"""Build campaigns from a spec, real and simulated ones."""

from __future__ import annotations

from dataclasses import replace
from functools import partial

import numpy as np

from inputdesign_cli.questions.assessment.build import build_identification, question_at
from inputdesign_cli.questions.building.rebuild import Rebuild
from inputdesign_cli.questions.building.signal_settings import (
    build_signal_settings,
    chosen_hold,
    operating_points,
    per_channel,
    stated_peaks,
)
from inputdesign_cli.questions.building.system import build_cost, build_experiment, record_step
from inputdesign_cli.questions.building.uncertainty import build_simulation, farthest_radius
from inputdesign_cli.questions.campaign.directory import Rounds
from inputdesign_cli.questions.campaign.plans import Planner
from inputdesign_cli.questions.campaign.schedule import Rules, Schedule
from inputdesign_cli.questions.campaign.study import CampaignTask, ways_of
from inputdesign_cli.questions.least_cost.build import build_convex
from inputdesign_cli.specification import Spec
from inputdesign_cli.specification.models.experiment import Campaign, Pilot

_TENTH, _LONGEST, _CAP = 10, 3, 10.0


def build_rules(spec: Spec) -> Rules:
    """Return the rules of the campaign; raise `SpecError` if there is none, or it cannot go in parts."""
    stated = spec.campaign
    if stated is None:
        raise spec.complain(
            "missing-key",
            "the spec has no campaign: its experiment has no parts",
            hint="add campaign: {block: 50}, or design the whole experiment with idesign solve",
            key="campaign",
        )
    _check(spec, stated)
    pilot, rate = stated.pilot, None
    if spec.limits.rate is not None and not spec.closed_loop:  # in a loop the reference is applied
        limit = np.asarray(spec.limits.rate, dtype=float)
        rate = tuple(np.broadcast_to(limit, (spec.plant.inputs,)).tolist())
    return Rules(
        schedule=_schedule(spec, stated, pilot),
        pilot_power=None if pilot is None else pilot.power,
        power_cap=stated.power_cap or _CAP,
        robust_last=stated.last == "robust",
        stops=stated.stop == "data",
        rate=rate,
        least=_least_moves(spec),
        seed=spec.signal.seed or 0,
    )


def _schedule(spec: Spec, stated: Campaign, pilot: Pilot | None) -> Schedule:
    samples, has = spec.experiment.samples, "has"
    if pilot is not None and pilot.power is not None:  # a pilot of its own power goes before
        samples, has = samples + pilot.samples, "and its pilot have"
    most = stated.max_samples or max(spec.limits.samples or _LONGEST * samples, samples)
    tenth = max(spec.experiment.samples // _TENTH, 1)
    block = stated.block or tenth
    parts = stated.stages or (min(block, tenth) if pilot is None else pilot.samples,)
    message = f"the experiment {has} {samples} samples, and the campaign ends at {most}"
    raised = "raise campaign.max_samples, or lower experiment.samples"
    conflicts = [("max_samples", most < samples, message, raised)]
    if stated.stages is not None:
        block = parts[-1]
        message = f"the stages have {sum(parts)} samples together, and the experiment {samples}"
        agree = "make them agree: experiment.samples is the length of the whole"
        conflicts += [("stages", sum(parts) != samples, message, agree)]
    for key, length in (("block", block), ("pilot", parts[0])) if stated.stages is None else ():
        message = f"the {key} has {length} samples, and the whole experiment {samples}"
        conflicts += [(key, length > samples, message, "parts are shorter than the whole")]
    for key, wrong, message, hint in conflicts:
        if wrong:
            raise spec.complain("conflicting-keys", message, hint=hint, key=f"campaign.{key}")
    return Schedule(parts, block, samples, most, chosen_hold(spec))


def _least_moves(spec: Spec) -> tuple[float, ...] | None:
    """Return `signal.least_move` of each input; raise `SpecError` (`not-supported`) where it is not kept."""
    least = per_channel(spec.signal.least_move, spec.plant.inputs)
    if least is None:
        return None
    amplitude = spec.limits.amplitude
    for beside, what in (
        (spec.closed_loop, "a loop, whose controller moves the input"),
        (spec.limits.rate is not None, "limits.rate: a move that waits is faster"),
        (amplitude is not None and amplitude.output is not None, "limits.amplitude.output"),
    ):
        if beside:
            message, hint = f"signal.least_move does not go with {what}", "remove one of them"
            raise spec.complain("not-supported", message, hint=hint, key="signal.least_move")
    peak = stated_peaks(spec)[0]
    if peak is not None and np.any(least > peak):
        message = "moves of at least signal.least_move exceed limits.amplitude"
        raise spec.complain("conflicting-keys", message, hint="lower it", key="signal.least_move")
    return tuple(least.tolist())


def _check(spec: Spec, stated: Campaign) -> None:
    """Raise `SpecError` (`not-supported`) for designs that cannot go in parts."""
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
    if what:
        raise spec.complain("not-supported", f"a campaign does not go with {what}", hint=hint, key=key)


def build_planner(spec: Spec) -> Planner:
    """Return the planner of the parts; it raises as `build_experiment` and `farthest_radius` do."""
    nominal, inputs = build_experiment(spec), spec.plant.inputs
    peak = stated_peaks(spec)[0]
    converter = spec.signal.quantisation is not None  # a converter has no values at other scales
    sections = spec
    if spec.signal.hold == "auto":  # chosen once, for the plant of the spec
        sections = spec.revised({"signal.hold": chosen_hold(spec)})
    return Planner(
        nominal=nominal,
        farthest=farthest_radius(spec, nominal),
        cost=build_cost(spec),
        step=record_step(spec),
        bounded=spec.limits.bounds_power,
        seed=spec.signal.seed or 0,
        designs=Rebuild(sections, build_convex),
        asked=partial(question_at, spec),
        block=build_signal_settings(sections).block,
        reach=np.zeros(inputs) if converter else np.full(inputs, np.inf) if peak is None else peak,
    )


def build_campaign(spec: Spec) -> CampaignTask:
    """Return the design of the whole experiment, and the study of whole campaigns; see `build_rules`."""
    rules, planner = build_rules(spec), build_planner(spec)
    design, study = build_convex(spec), build_simulation(spec, planner.nominal)
    truth = planner.nominal.model if study.truth is None else study.truth.model
    loop = planner.nominal.loop if study.truth is None else study.truth.loop
    uncertain = spec.uncertainty is not None or rules.pilot_power is not None
    return CampaignTask(
        design=design,
        planner=planner,
        ways=ways_of(rules, uncertain=uncertain, white="white" in study.compare),
        true=replace(planner.nominal, model=truth, loop=loop),
        runs=study.runs,
        seed=study.seed,
        has_prior=spec.experiment.prior is not None,
    )


def build_rounds(spec: Spec, *, begins: bool = False) -> Rounds:
    """Return the objects for the rounds of a real campaign, a new one if it `begins`; see `build_rules`.

    Raises:
        SpecError: `not-supported` for keys of `signal` that do not apply to parts.
    """
    lengths = "campaign.block or campaign.stages state the lengths of parts"
    also = "remove it: signal.csv is the file of a part"
    stated = ("signal.samples", spec.signal.samples, lengths), ("signal.also", spec.signal.also, also)
    for key, value, hint in stated:
        if begins and value is not None:  # a campaign that has begun goes on
            raise spec.complain("not-supported", f"parts of a campaign have no {key}", hint=hint, key=key)
    rules, planner = build_rules(spec), build_planner(spec)
    return Rounds(build_identification(spec), planner, rules, operating_points(spec))
