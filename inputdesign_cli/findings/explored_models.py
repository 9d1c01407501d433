"""A model that was found in a log deserves no trust: it explains too little, or the record leaves it open."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import scipy

from inputdesign_cli.arrays import Array, ComplexArray
from inputdesign_cli.explore import Found, Parts, by_chance, unhelpful, unstable_pole
from inputdesign_cli.finding import Finding, doubt
from inputdesign_cli.findings.rivals import most_apart
from inputdesign_cli.identification.checks import signal_name
from inputdesign_cli.identification.response_chance import driven_by_nothing
from inputdesign_cli.outcome.shares import chance

# A simulation that explains less of data it has not seen is no model; one that is refuted needs more.
LEAST_FIT, HALF = 5.0, 50.0
# The static gain is within so many deviations of none, that at some frequency of the record is not; and the
# first is larger by this factor: G still rises there towards low frequencies.
_OPEN, _CLEAR, _RISING = 3.0, 4.0, 2.0
_FREQUENCIES, _STATIC = 40, 1e-6
# A rival of a twentieth of the likelihood, -2 log of that, and how far its G is off, in shares of its peak.
_AS_LIKELY, _ELSEWHERE = 2.0 * float(np.log(20.0)), 0.1
_TESTS = ({"recent_inputs", "older_inputs"}, {"recent_residuals", "older_residuals"})

UNJUDGED = doubt(
    "model-not-judged",
    "No data remain to validate the model. An input moves in only one stretch of the record, and the "
    "estimate needs it.",
    "Use another record (`idesign explore OTHER --validate model.yaml`), or let the inputs step more.",
)
EXPLAINS_LITTLE = doubt(
    "simulation-explains-little",
    "The simulation explains next to nothing. From the inputs alone, the model explains no more of the "
    "validation part than chance would.",
    "Move the inputs more, or record for longer.",
)
UNRELATED = doubt(
    "inputs-unrelated",
    "The inputs do not help to predict an output. Signals that wander, drift or share a cycle agree for "
    "long without any link. The prediction errors of the output do not depend on the inputs.",
    "Move the inputs by steps of your own, at times that nothing else follows.",
)
UNEXPLAINED = doubt(
    "structure-unexplained",
    "No tested structure explains an output. The simulation explains less than half of it, and tests refute "
    "the model. The plant may be nonlinear, time-varying, or have unrecorded inputs.",
    "Record about one operating point, or record what else acts on the output.",
)
LIKE_INTEGRATOR = doubt(
    "like-integrator",
    "The plant may be an integrator. G rises towards the lowest frequencies of the record. The record "
    "determines only the slope, not static gain and time constant.",
    "Record until the output settles. If it never does, use `idesign explore DATA --structure integrator`.",
)
UNSTABLE = doubt(
    "plant-unstable",
    "The plant is unstable. The samples place a pole outside the unit circle. Without a spec, only stable "
    "models are searched.",
    "Identify the plant with its loop: `idesign identify DATA --spec SPEC`.",
)
OPEN_PARAMETERS = doubt(
    "rival-explains-log",
    "Another set of parameters explains the log as well. The likelihood has another minimum of about the "
    "same depth, with a different G.",
    "Move the inputs independently of each other, and at more frequencies.",
)


def doubtful_model(
    found: Found, parts: Parts, step: float, unit: str, *, integrates: bool = False
) -> list[Finding]:
    """Return what speaks against a model that was found in records.

    Args:
        parts: all records, u (n, r), y (n, p).
        step, unit: the sample time.
        integrates: whether the user says that the plant is an integrator.
    """
    unstable = list(_unstable(parts, step, unit))
    if unstable:  # what stable models say of such a plant is wrong
        return unstable
    integrators = [] if integrates else list(_like_integrators(found, step, unit))
    return [
        *_unjudged(found),
        *_explains_little(found),
        *_unrelated(found),
        *_unexplained(found),
        *integrators,
        *_rivalled(found),
        *([] if found.steady or integrators else [_unsteady()]),
    ]


def _unjudged(found: Found) -> list[Finding]:
    message = (
        "an input moves in one stretch of the record only, so that the model is judged by the data that it "
        "is estimated from: judge it by another record (idesign explore OTHER --validate model.yaml), or "
        "let the inputs step up and down several times"
    )
    return [UNJUDGED.found(message)] if found.split == "none" else []


def _explains_little(found: Found) -> Iterator[Finding]:
    unseen = int(np.sum(found.validation.counted))
    for i, (fit, chosen) in enumerate(zip(found.validation.simulation, found.outputs, strict=True)):
        output = signal_name("y", i, found.model.outputs)
        luck = by_chance(unseen, chosen.best.orders.order + 2, len(chosen.candidates))
        # What wanders leaves any simulation; what is new in it from sample to sample does not wander.
        little = not found.helped[i] > 0.0 if found.wanders[i] else fit < max(LEAST_FIT, luck)
        if little:
            yield EXPLAINS_LITTLE.found(
                f"the simulation explains {fit:.1f} % of {output} in {unseen} samples"
                f"{'' if found.split == 'none' else ' that it has not seen'}, and of noise alone it may "
                f"explain {luck:.1f} %: the inputs hardly act on it, or by more than "
                f"{chosen.swept.most} samples later, or the record is too short or too noisy; move the "
                "inputs more, or record for longer",
                where=output,
                fit_percent=fit,
                chance_percent=luck,
            )


def _unrelated(found: Found) -> Iterator[Finding]:
    idle = set(driven_by_nothing(found.model, found.estimate)) | set(unhelpful(found.model, found.used))
    worse = {i for i, fit in enumerate(found.estimate.simulation.fit) if fit is not None and fit <= 0.0}
    for i in sorted(idle | {i for i in worse if not found.wanders[i]}):
        output = signal_name("y", i, found.model.outputs)
        message = (
            f"nothing that the inputs do helps to predict {output} beyond its own past: two signals that "
            "wander, drift, or follow one cycle (as of days) agree for long without one moving the other; "
            "move the inputs by steps of your own, at times that nothing else follows"
        )
        yield UNRELATED.found(message, where=output)


def _unexplained(found: Found) -> Iterator[Finding]:
    """Yield outputs of which a model explains less than half, where every kind of test refutes it as well.

    Tests alone do not take trust away: with samples enough they refute every model of a real plant, also one
    that explains almost everything. Nor does a poor fit alone: the noise may be strong.
    """
    failed = {test.name: test for test in found.estimate.tests.failed}
    if not all(failed.keys() & kind for kind in _TESTS):
        return
    worst = min(failed.values(), key=lambda test: test.probability)
    most = "" if worst.lag is None else f", most at lag {worst.lag}"
    for i, fit in enumerate(found.validation.simulation):
        output = signal_name("y", i, found.model.outputs)
        message = (
            "past inputs explain residuals, residuals explain each other (probability "
            f"{chance(worst.probability)}{most}), and the simulation explains {fit:.1f} % of {output}: no "
            "structure that was tried explains it. The plant may be nonlinear, vary with time, or have "
            "inputs that the log lacks: record about one operating point, or log what acts on it"
        )
        if fit < HALF:
            yield UNEXPLAINED.found(message, where=output, fit_percent=fit, probability=worst.probability)


def _like_integrators(found: Found, step: float, unit: str) -> Iterator[Finding]:
    """Yield every entry of G whose static gain, hence whose slowest time constant, the record leaves open."""
    if found.integrates:
        yield LIKE_INTEGRATOR.found(
            "no time constant follows from this record, and the plant was taken for an integrator: record "
            "until the output settles; or say that it never does (--structure integrator)"
        )
        return
    model, lowest = found.model, 2.0 * np.pi / max(len(y) for _, y in found.used)
    w = np.concatenate([[_STATIC * lowest], np.geomspace(lowest, max(1.0, lowest), _FREQUENCIES)])
    with np.errstate(all="ignore"):
        change, G = model.plant_gradient(w), model.plant_at(w)
    for i, j in ((i, j) for i in range(model.outputs) for j in found.moving):
        size, deviations = np.abs(G[:, i, j]), _deviations(found, change[:, :, i, j].T)
        # |G| is clear where it rises, and its end is not.
        clear = (size > _CLEAR * deviations) & (_RISING * size < size[0])
        if not (np.all(np.isfinite(size + deviations)) and size[0] < _OPEN * deviations[0] and np.any(clear)):
            continue
        at = 1 + int(np.argmin(deviations[1:] / size[1:]))
        slope = float(np.copysign(w[at] * size[at] / step, G[0, i, j].real))
        where = "" if model.inputs == model.outputs == 1 else f" from u{j + 1} to y{i + 1}"
        message = (
            f"the plant{where} may be an integrator (its static gain is {size[0]:.3g} +- "
            f"{deviations[0]:.1g}): no time constant follows from this record, only the slope, {slope:.4g} "
            f"per {unit} for an input of one. Record until the output settles; or, if it never does, take "
            "--structure integrator"
        )
        yield LIKE_INTEGRATOR.found(message, where=where.strip(), slope=slope, static_gain=float(size[0]))


def _deviations(found: Found, change: ComplexArray) -> Array:
    """Return deviations (n,) of values whose real and imaginary parts have gradients `change` (k, n)."""
    if not np.all(np.isfinite(change)):
        return np.full(change.shape[1], np.nan)
    parts = np.hstack([change.real, change.imag])
    scaled = scipy.linalg.solve_triangular(found.estimate.factor, parts, lower=True)
    return np.linalg.norm(np.vstack(np.hsplit(scaled, 2)), axis=0)


def _rivalled(found: Found) -> list[Finding]:
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
            message = (
                f"two sets of parameters explain the record about equally well ({values}; -2 log likelihood "
                f"differs by {rival.excess:.2g}), and their G by {100.0 * apart:.3g} % of its peak: move "
                "the inputs independently of each other, and at more frequencies"
            )
            return [OPEN_PARAMETERS.found(message, excess=rival.excess, apart=apart)]
    return []


def _unsteady() -> Finding:
    return LIKE_INTEGRATOR.found(
        "a mode of the plant loses less than a hundredth in the whole record: it may be an integrator, or "
        "drift. Record in a loop or until the output settles, or remove the drift: --detrend linear"
    )


def _unstable(parts: Parts, step: float, unit: str) -> Iterator[Finding]:
    outputs = parts[0][1].shape[1]
    clock = f"sample_time: {step:.6g}{'' if unit == 's' else f', time_unit: {unit}'}"
    for i in range(outputs):
        pole, output = unstable_pole(parts, i), signal_name("y", i, outputs)
        if pole is None:
            continue
        A = ", ".join(f"{a:.4g}" for a in pole.denominator)
        B = ", ".join(["0", "1", "1"][: pole.denominator.size])
        message = (
            f"the plant of {output} is unstable: it has a pole at a radius of {abs(pole.pole):.4g} +- "
            f"{pole.deviation:.1g}, and only stable ones are looked for here. Identify it with its loop: "
            f"idesign identify DATA --spec SPEC, in SPEC {clock}, plant: {{A: [{A}], B: [{B}]}}, noise: "
            "{C: [1, -0.1], variance: 1}, and the controller as it was, experiment: {controller: "
            "{numerator: [..], denominator: [..]}}; raise the orders where tests fail"
        )
        yield UNSTABLE.found(message, where=output, radius=abs(pole.pole), deviation=pole.deviation)
