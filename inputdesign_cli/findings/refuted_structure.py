"""Tests of the residuals refute the structure of a model, or name the parameter that it lacks."""

from __future__ import annotations

from collections.abc import Sequence

from inputdesign_cli.finding import Finding, FindingKind, Severity
from inputdesign_cli.findings.remedies import remedies_of
from inputdesign_cli.identification import Alternative, Estimate, ScoreTest
from inputdesign_cli.outcome.shares import chance
from inputdesign_cli.plant import Model

_TESTED = "Residuals are compared with past inputs, past residuals and time by score tests. "

PLANT = FindingKind(
    "plant-structure",
    Severity.REFUTED,
    "past inputs explain residuals",
    f"{_TESTED}Past inputs explain what the model does not: the plant has more structure than the model.",
    "Raise the orders of the plant or change its delay; the message names the keys. A long FIR model shows "
    "what is missing.",
)
NOISE = FindingKind(
    "noise-structure",
    Severity.REFUTED,
    "the residuals are not white",
    f"{_TESTED}Past residuals explain the next ones: the noise has more structure than its model. The "
    "covariance is then not to be trusted.",
    "Raise the orders of C and D under `noise`.",
)
DRIFT = FindingKind(
    "drift",
    Severity.REFUTED,
    "the residuals drift",
    f"{_TESTED}The residuals follow a slow trend.",
    "Let the noise drift (`noise: {drift: true}`), remove the trend, or use a part of the record without it.",
)
MISSING = FindingKind(
    "parameter-missing",
    Severity.REFUTED,
    "the model lacks a parameter",
    "One more parameter of plant or noise explains the data much better than chance would.",
    "Estimate it along.",
)
CHANGED = FindingKind(
    "plant-changed",
    Severity.REFUTED,
    "the plant did not stay the same",
    "Parameters that change with time explain the data much better than constant ones.",
    "Assess the parts of the record one by one (`--range`), and look for what changed between them.",
)
NONLINEAR = FindingKind(
    "plant-nonlinear",
    Severity.REFUTED,
    "the plant is not linear",
    "A nonlinear effect of the inputs explains the data much better than the linear model alone.",
    "Use the range of the input that the model is for, or give as u what the actuator really does.",
)

# Drift makes other tests fail; an error of G makes tests of the noise fail.
OF_MANY = {
    "drift": (
        DRIFT,
        "the residuals drift slowly{where} (probability {p}), which other tests notice too: {remedy}, "
        "remove the trend from the record, or use a part of it without drift",
    ),
    "plant": (
        PLANT,
        "past inputs explain residuals{where} (probability {p}), most at lag {lag}: the plant has more "
        "structure than the model; {remedy}, or compare with an FIR model (B: [0, 1, 1, ..]) that is long "
        "enough",
    ),
    "noise": (
        NOISE,
        "the residuals are not white{where} (probability {p}), most at lag {lag}: the noise has more "
        "structure than the model, and the covariance is not to be trusted; {remedy}",
    ),
}
_ONE_MISSING = "one parameter is missing (probability {p} without it): {phrase}"
_OF_ONE = {
    "plant": (MISSING, _ONE_MISSING),
    "noise": (MISSING, _ONE_MISSING),
    "change": (
        CHANGED,
        "the plant did not stay the same: {phrase} explains the data better (probability {p} without it); "
        "{remedy}",
    ),
    "nonlinear": (
        NONLINEAR,
        "the plant is not linear: {phrase} explains the data better (probability {p} without it); {remedy}",
    ),
}
REMEDY = {
    "plant": "estimate it along",
    "noise": "estimate it along",
    "change": "assess the parts of the record one by one (--range), and look for what changed between them",
    "nonlinear": "a linear model holds for one range of the input only: use the range that the model is for, "
    "or give as u what the actuator really does",
}


def refutations(model: Model, estimate: Estimate) -> list[Finding]:
    """Return the strongest test of each kind of fault, and the single parameters that are missing.

    Of an output that shifts see `level_shifts.py`.
    """
    directed = {one.test: one.alternatives for one in estimate.tests.directed}
    failing = estimate.tests.failed_besides
    strongest: dict[str, ScoreTest] = {}
    for test in failing:
        if test not in directed:
            first = strongest.setdefault(test.fault, test)
            strongest[test.fault] = min(first, test, key=lambda one: one.probability)
    remedies, found = remedies_of(model), []
    for fault, (kind, sentence) in OF_MANY.items():
        if fault in strongest:
            test = strongest[fault]
            said = sentence.format(
                p=chance(test.probability), lag=test.lag, remedy=remedies[fault], where=_where(model, test)
            )
            found.append(kind.found(said, where=test.name, probability=test.probability, lag=test.lag))
    for test in sorted(directed, key=lambda test: test.probability):
        if test in failing:
            kind, sentence = _OF_ONE[test.fault]
            said = sentence.format(
                p=chance(test.probability), phrase=directed[test][0].phrase, remedy=REMEDY[test.fault]
            )
            others = _or_else(directed[test][1:])
            found.append(kind.found(said + others, where=test.name, probability=test.probability))
    return found


def _where(model: Model, test: ScoreTest) -> str:
    """Return a phrase for the channels in which a test fails most; empty for a single one."""
    if model.outputs == model.inputs == 1:
        return ""
    output, source = f"y{test.output + 1}", test.source + 1
    if test.fault == "plant":
        return f", those of {output} by u{source} most"
    own = test.fault == "drift" or test.output == test.source
    return f", those of {output} most" if own else f", those of {output} after those of y{source} most"


def _or_else(others: Sequence[Alternative]) -> str:
    """Return a phrase for parameters whose effect is nearly the same on these data; empty without any."""
    listed = ", ".join(other.phrase for other in others)
    return f"; nearly the same on these data: {listed}" if others else ""
