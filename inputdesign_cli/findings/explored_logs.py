"""A log does not determine a plant, or the model that was found in it deserves no trust."""

from __future__ import annotations

import numpy as np

from inputdesign_cli.errors import Diagnostic
from inputdesign_cli.explore.fits import Parts, by_chance
from inputdesign_cli.explore.joint import Found
from inputdesign_cli.explore.relation import (
    left_of_inputs,
    like_answers,
    only_answers,
    order_of_excitation,
    unhelpful,
    unstable_pole,
)
from inputdesign_cli.finding import DOUBT, Finding, FindingKind, finding
from inputdesign_cli.findings.rivals import most_apart
from inputdesign_cli.identification.checks import signal_name
from inputdesign_cli.identification.response_chance import perhaps_zero
from inputdesign_cli.outcome.shares import chance

DRIVE = "move the reference of the loop, or add dither to the input, and record again"
# Below this share of an input's power that the other inputs do not explain, many minima swap their effects.
_FOLLOWS = 0.02
# A parameter is not determined at all where it deviates by more than this share of its value.
_UNDETERMINED = 100.0
# The least fit to unseen data, in per cent, below which a model is doubted, a refuted model, and a surely
# refuted one.
LEAST_FIT, HALF, _MOSTLY = 5.0, 50.0, 90.0
_SURELY = 1e-6  # the probability below which tests refute a model that explains more than half, too
# The static gain is less than _OPEN deviations from zero, but |G| at some frequency of the record more than
# _CLEAR, and smaller by the factor _RISING: G still rises towards low frequencies.
_OPEN, _CLEAR, _RISING = 3.0, 4.0, 2.0
_FREQUENCIES, _STATIC = 40, 1e-6  # the frequency of the static gain, relative to the lowest of the record
# The excess of a rival with a twentieth of the likelihood; the least change of its G, relative to the peak.
_AS_LIKELY, _ELSEWHERE = 2.0 * float(np.log(20.0)), 0.1
_TESTS = ({"recent_inputs", "older_inputs"}, {"recent_residuals", "older_residuals"})


def doubtful_inputs(found: Found, parts: Parts, *, loop: bool) -> list[Finding]:
    """Return the reasons why the inputs of records do not determine the plant.

    Args:
        parts: all records, u (n, r), y (n, p).
        loop: whether inputs respond to the outputs.
    """
    moving = [(u[:, found.moving], y) for u, y in parts]
    inverses = [] if loop else _inverses(found, moving)
    return [*inverses, *(_too_simple(found, moving) or _open(found))]


@finding(DOUBT, "input-only-answers", "Move the reference of the loop, or add dither to the input.")
def undriven(kind: FindingKind, parts: Parts) -> list[Finding]:
    """An input follows from the outputs alone. The inverse of the controller explains the data as well.

    A controller has a reference at rest, or one column was computed from the other.
    """
    inputs, found = parts[0][0].shape[1], []
    for j in only_answers(parts):
        name = signal_name("u", j, inputs)
        fact = f"{name}, and the plant is not identifiable"
        found.append(kind.found(fact, where=name))
    return found


@finding(DOUBT, "like-inverse-controller", "Move the reference of the loop, or add dither to the input.")
def _inverses(kind: FindingKind, found: Found, moving: Parts) -> list[Finding]:
    """The model may be the inverse of a controller. The output responds in the same sample.

    No external signal seems to drive the input. In a loop, -1/C explains these data ([ljung-1999], Section
    13.4).
    """
    pairs = [
        (signal_name("y", i, found.model.outputs), signal_name("u", j, found.model.inputs))
        for i, candidate in enumerate(found.taken)
        for k, j in enumerate(found.moving)
        if not candidate.orders.delays[k] and like_answers(moving, i, k)
    ]
    return [kind.found(f"{y} responds to {u} in the same sample, as -1/C does", where=y) for y, u in pairs]


@finding(DOUBT, "excitation-too-simple", "Apply inputs that move more and independently (`idesign signal`).")
def _too_simple(kind: FindingKind, found: Found, moving: Parts) -> list[Finding]:
    """The inputs determine fewer parameters than the model has. Other models explain as much."""
    needed = max(candidate.orders.unknowns for candidate in found.taken)
    order = order_of_excitation(moving)
    if order < needed:
        fact = f"persistently exciting of order {order}, alone or together, and the model needs {needed}"
        return [kind.found(fact, order=order, needed=needed)]
    left, j = min(zip(left_of_inputs(moving), found.moving, strict=True))
    fact = f"u{j + 1} follows from the other inputs and their pasts but for {100.0 * left:.2g} % of its power"
    return kind.when(left < _FOLLOWS, fact, where=f"u{j + 1}", left=left)


@finding(DOUBT, "parameter-undetermined", "Move that input more, or leave it out with `--columns`.")
def _open(kind: FindingKind, found: Found) -> list[Finding]:
    """The record does not determine a parameter. Its deviation is many times its value."""
    estimate, model = found.estimate, found.model
    if not all(candidate.orders.physical for candidate in found.taken):
        return []
    deviations = np.sqrt(np.diag(estimate.covariance))
    open_ = model.in_plant & ~model.dead_times & ~(deviations <= _UNDETERMINED * np.abs(estimate.theta))
    named = [
        f"{estimate.names[k]} = {estimate.theta[k]:.3g} +- {deviations[k]:.2g}" for k in np.flatnonzero(open_)
    ]
    return kind.when(named, ", ".join(named), where="".join(named[:1]).split(" = ")[0])


def doubtful_model(
    found: Found, parts: Parts, step: float, unit: str, *, integrates: bool = False
) -> list[Finding]:
    """Return what speaks against a model that was found in records.

    Args:
        parts: all records, u (n, r), y (n, p).
        step, unit: the sample time.
        integrates: whether the user says that the plant is an integrator.
    """
    unstable = _unstable(parts)
    if unstable:  # stable models of an unstable plant are wrong
        return unstable
    return [
        *_unjudged(found),
        *_explains_little(found),
        *_unrelated(found),
        *_unexplained(found),
        *_like_integrators(found, step, unit, integrates=integrates),
        *_rivalled(found),
    ]


@finding(
    DOUBT,
    "model-not-judged",
    "Use another record (`idesign explore OTHER --validate model.yaml`), or let the inputs step more.",
)
def _unjudged(kind: FindingKind, found: Found) -> list[Finding]:
    """No data remain to validate the model. An input moves in only one stretch of the record."""
    return kind.when(found.split == "none")


@finding(DOUBT, "simulation-explains-little", "Move the inputs more, or record for longer.")
def _explains_little(kind: FindingKind, found: Found) -> list[Finding]:
    """The simulation explains next to nothing. Chance would explain as much of the validation part."""
    unseen, doubtful = int(np.sum(found.validation.counted)), []
    for i, (fit, chosen) in enumerate(zip(found.validation.simulation, found.outputs, strict=True)):
        output = signal_name("y", i, found.model.outputs)
        luck = by_chance(unseen, chosen.best.orders.order + 2, len(chosen.candidates))
        # A wandering output leaves any simulation; whether inputs help to predict it is tested instead.
        little = not found.wanders[i] and fit < max(LEAST_FIT, luck)
        fact = f"{fit:.1f} % of {output} in {unseen} samples, and {luck:.1f} % of noise alone"
        doubtful += kind.when(little, fact, where=output, fit_percent=fit, chance_percent=luck)
    return doubtful


@finding(DOUBT, "inputs-unrelated", "Record again with steps of the input that you choose yourself.")
def _unrelated(kind: FindingKind, found: Found) -> list[Finding]:
    """An output does not respond to the inputs in this log. Its own past predicts it as well.

    If both drift or wander, they may look alike by chance.
    """
    idle = set(perhaps_zero(found.model, found.estimate)) | set(unhelpful(found.model, found.used))
    worse = {i for i, fit in enumerate(found.estimate.simulation.fit) if fit is not None and fit <= 0.0}
    idle |= {i for i in worse if not found.wanders[i]}
    names = [signal_name("y", i, found.model.outputs) for i in sorted(idle)]
    return [kind.found(f"past inputs do not help to predict {name}", where=name) for name in names]


@finding(
    DOUBT,
    "structure-unexplained",
    "Record smaller moves about one operating point, and log other causes as further inputs.",
)
def _unexplained(kind: FindingKind, found: Found) -> list[Finding]:
    """No linear model that was tried explains an output. Tests of past inputs and of residuals fail.

    The simulation explains less than half of it, or than 90 % where the tests leave no doubt. The plant may
    be nonlinear or change, or have unrecorded inputs.
    """
    # Enough samples refute every model of a real plant, and a poor fit alone may be strong noise.
    failing = {test.name: test for test in found.estimate.tests.failed}
    if not all(failing.keys() & names for names in _TESTS):
        return []
    least, doubtful = min(test.probability for test in failing.values()), []
    for i, fit in enumerate(found.validation.simulation):
        output = signal_name("y", i, found.model.outputs)
        fact = f"the best simulation explains {fit:.1f} % of {output} (tests: probability {chance(least)})"
        doubtful += kind.when(
            fit < (_MOSTLY if least < _SURELY else HALF),
            fact,
            where=output,
            fit_percent=fit,
            probability=least,
        )
    return doubtful


@finding(
    DOUBT,
    "like-integrator",
    "Record until the output settles. If it never does, use `idesign explore DATA --structure integrator`.",
)
def _like_integrators(
    kind: FindingKind, found: Found, step: float, unit: str, *, integrates: bool
) -> list[Finding]:
    """The plant may be an integrator. The record determines the slope, but not the static gain."""
    slow = [] if found.steady else [kind.found("a mode loses less than a hundredth in the whole record")]
    if integrates:
        return slow
    if found.integrates:
        return [kind.found("no time constant follows from this record")]
    model, lowest = found.model, 2.0 * np.pi / max(len(y) for _, y in found.used)
    w = np.concatenate([[_STATIC * lowest], np.geomspace(lowest, max(1.0, lowest), _FREQUENCIES)])
    with np.errstate(all="ignore"):
        change, G = model.plant_gradient(w), model.plant_at(w)
        variance = np.einsum("nkij,kl,nlij->nij", change.conj(), found.estimate.covariance, change).real
    rising = []
    for i, j in ((i, j) for i in range(model.outputs) for j in found.moving):
        size, deviations = np.abs(G[:, i, j]), np.sqrt(np.maximum(variance[:, i, j], 0.0))
        # |G| is certain at a frequency where it rises, and the static gain is not.
        clear = (size > _CLEAR * deviations) & (_RISING * size < size[0])
        if not (np.all(np.isfinite(size + deviations)) and size[0] < _OPEN * deviations[0] and np.any(clear)):
            continue
        at = 1 + int(np.argmin(deviations[1:] / size[1:]))
        slope = float(np.copysign(w[at] * size[at] / step, G[0, i, j].real))
        where = "" if model.inputs == model.outputs == 1 else f"from u{j + 1} to y{i + 1}"
        fact = f"{where} the static gain is {size[0]:.3g} +- {deviations[0]:.1g}, the slope {slope:.4g} per "
        fact = f"{fact}{unit}".lstrip()
        rising.append(kind.found(fact, where=where, slope=slope, static_gain=float(size[0])))
    return rising or slow


@finding(DOUBT, "rival-explains-log", "Move the inputs independently of each other, and at more frequencies.")
def _rivalled(kind: FindingKind, found: Found) -> list[Finding]:
    """Another set of parameters explains the log as well. It has another minimum of the likelihood."""
    w = np.linspace(1e-6, np.pi, 100)
    G, estimate = found.model.plant_at(w), found.estimate
    peaks = np.maximum(np.abs(G).max(axis=0), 1e-300)
    for rival in estimate.search.rivals:
        other = found.model.at(rival.theta, found.model.covariance).plant_at(w)
        apart = float(np.max(np.abs(other - G) / peaks))
        if rival.excess <= _AS_LIKELY and not apart <= _ELSEWHERE:
            values = ", ".join(
                f"{estimate.names[i]} {estimate.theta[i]:.3g} or {rival.theta[i]:.3g}"
                for i in most_apart(estimate, rival)
            )
            fact = f"{values}, where G differs by {100.0 * apart:.3g} % of its peak"
            return [kind.found(fact, excess=rival.excess, apart=apart)]
    return []


@finding(
    DOUBT,
    "plant-unstable",
    "Identify the plant with its loop: `idesign identify DATA --spec SPEC`. SPEC states A with this pole and "
    "the controller.",
)
def _unstable(kind: FindingKind, parts: Parts) -> list[Finding]:
    """The plant is unstable. It has a pole outside the unit circle, and only stable models are searched."""
    outputs, found = parts[0][1].shape[1], []
    for i in range(outputs):
        unstable, output = unstable_pole(parts, i), signal_name("y", i, outputs)
        if unstable is not None:
            pole, deviation = unstable
            A = ", ".join(f"{a:.4g}" for a in np.poly([pole, pole.conjugate()] if pole.imag else [pole]).real)
            radius = abs(pole)
            fact = f"{output} has a pole at a radius of {radius:.4g} +- {deviation:.1g}, A: [{A}]"
            found.append(kind.found(fact, where=output, radius=radius, deviation=deviation))
    return found


@finding(DOUBT, "written-spec-refused", "Mend `spec.yaml` before `solve` or `assess` read it.")
def written_spec_refused(kind: FindingKind, refusal: Diagnostic | None) -> list[Finding]:
    """The model does not fit what the given spec asks for. The spec that was written is refused."""
    if refusal is None:
        return []
    fact = f"{refusal.message} ({refusal.hint})" if refusal.hint else refusal.message
    return [kind.found(fact, where=refusal.key, error=refusal.code)]
