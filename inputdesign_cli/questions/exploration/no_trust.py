"""Why no model that was found in a log deserves trust."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from inputdesign_cli.explore import (
    Found,
    by_chance,
    interpolated_outputs,
    only_answers,
    own_cycles,
    unhelpful,
    unstable_pole,
)
from inputdesign_cli.findings.unrelated_inputs import late_inputs
from inputdesign_cli.identification.checks import signal_name
from inputdesign_cli.identification.response_chance import driven_by_nothing
from inputdesign_cli.outcome.shares import chance
from inputdesign_cli.questions.exploration.at_once import like_inverses
from inputdesign_cli.questions.exploration.integrating import CONTROLLER, clock_of, like_integrators
from inputdesign_cli.questions.exploration.unidentified import rivalled, unidentified
from inputdesign_cli.records import Record

DRIVE = "move the reference of the loop, or add dither to the input, and record again"

# A simulation that explains less than this of data it has not seen is no model.
LEAST_FIT = 5.0
# One that is refuted besides needs more.
HALF = 50.0
_UNSTEADY = (
    "a mode of the plant loses less than a hundredth in the whole record: it cannot be told from an "
    "integrator, or from drift. Record in a loop or until the output settles, or remove the drift: --detrend "
    "linear"
)
# By chance so seldom, noise that wanders has another colour than that of its model.
_ANOTHER_WALK = 1e-6
_KINDS = ({"recent_inputs", "older_inputs"}, {"recent_residuals", "older_residuals"})


def distrusted(
    log: Record, found: Found, undriven: Sequence[str], doubts: Sequence[str], *, loop: bool
) -> tuple[str, ...]:
    """A sentence for every reason; none where a model deserves trust.

    Args:
        undriven: see `undriven_inputs`.
        doubts: what else speaks against it.
        loop: whether inputs answer the outputs.
    """
    # Without excitation any pole explains the record.
    unstable = () if undriven else _unstable(log)
    if unstable:  # what stable models say of such a plant is wrong
        return unstable
    moving = [(part_u[:, found.moving], part_y) for part_u, part_y in log.parts]
    rising = like_integrators(found, log.step, log.time_unit, loop=loop)
    inverses = () if loop else like_inverses(found, moving)
    unseen = unidentified(found, moving, log.step, log.time_unit, integrates=bool(rising))
    return (
        *_unjudged(found),
        *_reasons(found),
        *(_idle(found) or _unrelated(found)),
        *_refuted(found),
        *_interpolated(log),
        *(_cycling(found, log) or _wandering_otherwise(found)),
        *rising,
        *unseen,
        *rivalled(found),
        *(() if found.steady or rising or unseen else (_UNSTEADY,)),
        *(f"{told}: {DRIVE}" for told in undriven),
        *(one.message for one in late_inputs(log.parts)),
        *(f"{told}: {DRIVE}" for told in inverses),
        *doubts,
    )


def _unjudged(found: Found) -> tuple[str, ...]:
    """That no data are left to judge by."""
    if found.split != "none":
        return ()
    return (
        "an input moves in one stretch of the record only, which cannot both estimate a model and judge it: "
        "the model was chosen and judged by the data that it is estimated from. Judge it by another record "
        "(idesign explore OTHER --validate model.yaml), or let the inputs step up and down again, several "
        "times",
    )


def _reasons(found: Found) -> tuple[str, ...]:
    """Why nothing that was found deserves trust."""
    which = "" if found.split == "none" else " that it has not seen"
    unseen = int(np.sum(found.validation.counted))
    told = []
    for i, (fit, chosen) in enumerate(zip(found.validation.simulation, found.outputs, strict=True)):
        output = signal_name("y", i, found.model.outputs)
        luck = by_chance(unseen, chosen.best.orders.order + 2, len(chosen.candidates))
        # What wanders leaves any simulation; what is new in it from sample to sample does not wander.
        if found.wanders[i] and not found.helped[i] > 0.0:
            told.append(
                f"{output} wanders, and what the inputs do by this model does not help to predict it in "
                f"{unseen} samples{which}: move the inputs more, or more often, or record for longer"
            )
        elif not found.wanders[i] and fit < max(LEAST_FIT, luck):
            told.append(
                f"the simulation explains {fit:.1f} % of {output} in {unseen} samples{which}, and of noise "
                f"alone it may explain {luck:.1f} %: the inputs hardly act on it, or by more than "
                f"{chosen.most} samples later, or the record is too short or too noisy to tell how"
            )
    return tuple(told)


def _idle(found: Found) -> tuple[str, ...]:
    """Outputs of which the whole record tells no effect of the inputs, though a part of it did."""
    nothing = driven_by_nothing(found.model, found.estimate)
    told = []
    for i, fit in enumerate(found.estimate.fit):
        worse = fit is not None and fit <= 0.0 and not found.wanders[i]
        if worse or i in nothing:
            why = f"the simulation explains {fit:.1f} %" if worse else "its standard deviations reach zero"
            output = signal_name("y", i, found.model.outputs)
            told.append(
                f"in the whole record no effect of the inputs on {output} can be told from none ({why}): "
                "what agreed in a part of it may be chance, as two slow signals often do, or the inputs act "
                f"by more than {found.outputs[i].most} samples later; move the inputs more, or for longer"
            )
    return tuple(told)


def _unrelated(found: Found) -> tuple[str, ...]:
    """Outputs whose own past foretells them as well without the inputs."""
    return tuple(
        f"nothing that the inputs do helps to predict {signal_name('y', i, found.model.outputs)} beyond its "
        "own past: two signals that wander, drift, or follow one cycle (as of days) agree for long without "
        "one moving the other; move the inputs by steps of your own, at times that nothing else follows"
        for i in unhelpful(found.model, found.used)
    )


def _interpolated(log: Record) -> tuple[str, ...]:
    """Outputs that a historian has drawn between the values that it keeps."""
    return tuple(
        f"{signal_name('y', i, log.y.shape[1])} is a straight line between some of its samples: it was "
        "measured at these only, and a line knows where the next one will be, so that delay and dynamics are "
        "not those of the plant; export the values as they were stored, and give that sample time"
        for i in interpolated_outputs(log.parts)
    )


def _cycling(found: Found, log: Record) -> tuple[str, ...]:
    """Outputs that follow a cycle of their own."""
    estimate = found.estimate
    told = []
    for one in own_cycles(found.model, found.used, estimate.factor, estimate.noise):
        output = signal_name("y", one.output, found.model.outputs)
        period = f"a period of {one.period * log.step:.3g} {log.time_unit}"
        what = (
            f"a mode with {period} goes on in {output} through the whole record, by itself more than by what "
            "the inputs do: it cannot be told from a cycle"
            if one.is_mode
            else f"what the model leaves of {output} is a cycle with {period}, which moves its parameters "
            "beyond chance: no input has it, and it may be one"
        )
        told.append(
            f"{what} that acts on the output (as of days, or another machine); log what causes it as one "
            "more input, or record while it rests"
        )
    return tuple(told)


def _wandering_otherwise(found: Found) -> tuple[str, ...]:
    """Outputs that wander, but not as random walks do: by the noise model slow moves count."""
    otherwise = {
        test.output: test.probability
        for test in found.estimate.failed
        if test.fault == "noise" and test.probability < _ANOTHER_WALK
    }
    return tuple(
        f"{signal_name('y', i, found.model.outputs)} wanders, and not as a random walk does (residuals "
        f"explain each other, probability {chance(otherwise[i])}): what slow moves tell of the gain rests on "
        "that, so that it may be off by more than is said; log what else acts on the output, or record for "
        "longer"
        for i in np.flatnonzero(found.wanders).tolist()
        if i in otherwise
    )


def _refuted(found: Found) -> tuple[str, ...]:
    """Outputs of which a model explains less than half, where every kind of test refutes it as well.

    Tests alone do not take trust away: with samples enough they refute every model of a real plant, also one
    that explains almost everything. Nor does a poor fit alone: the noise may be strong.
    """
    failed = {test.name for test in found.estimate.failed}
    if not all(failed & kind for kind in _KINDS):
        return ()
    unseen = "" if found.split == "none" else " in data that it has not seen"
    return tuple(
        f"past inputs explain residuals, residuals explain each other, and the simulation explains {fit:.1f} "
        f"% of {signal_name('y', i, found.model.outputs)}{unseen}: the plant acts otherwise than "
        "any structure that was tried. It may be nonlinear, vary with time, or have inputs that the log "
        "lacks: record about one operating point, or log what else acts on it"
        for i, fit in enumerate(found.validation.simulation)
        if fit < HALF
    )


def _unstable(log: Record) -> tuple[str, ...]:
    """Outputs of a plant that is unstable, and goes on only as it is in a loop."""
    outputs, told = log.y.shape[1], []
    clock = clock_of(log.step, log.time_unit)
    for i in range(outputs):
        pole = unstable_pole(log.parts, i)
        if pole is None:
            continue
        A = ", ".join(f"{a:.4g}" for a in pole.denominator)
        B = ", ".join(["0", "1", "1"][: pole.denominator.size])
        told.append(
            f"the plant of {signal_name('y', i, outputs)} is unstable: it has a pole at a radius of "
            f"{pole.radius:.4g} +- {pole.deviation:.1g}, and only stable ones are looked for here. Identify "
            f"it with its loop: idesign identify DATA --spec SPEC, in SPEC {clock}, "
            f"plant: {{A: [{A}], B: [{B}]}}, noise: {{C: [1, -0.1], variance: 1}}, and {CONTROLLER}; "
            "raise the orders where tests fail"
        )
    return tuple(told)


def undriven_inputs(log: Record) -> tuple[str, ...]:
    """Inputs that only answer the outputs."""
    return tuple(
        f"{signal_name('u', j, log.u.shape[1])} follows from the outputs and its own past: data from a loop "
        "without excitation, from which a plant is not identifiable (the inverse of the controller explains "
        "them as well)"
        for j in only_answers(log.parts)
    )
