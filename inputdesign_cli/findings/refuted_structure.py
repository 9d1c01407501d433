"""Tests of the residuals refute the structure of a model, or name the parameter that it lacks."""

from __future__ import annotations

from inputdesign_cli.finding import Finding, refuted
from inputdesign_cli.findings.remedies import remedies_of
from inputdesign_cli.identification import Estimate, ScoreTest
from inputdesign_cli.outcome.shares import chance
from inputdesign_cli.plant import Model

_TESTED = "Residuals are compared with past inputs, past residuals and time by score tests. "

PLANT = refuted(
    "plant-structure",
    "Past inputs explain residuals. Residuals are compared with past inputs, past residuals and time by "
    "score tests. Past inputs explain what the model does not: the plant has more structure than the model.",
    "Raise the orders of the plant or change its delay; the message names the keys. A long FIR model shows "
    "what is missing.",
)
NOISE = refuted(
    "noise-structure",
    "The residuals are not white. Residuals are compared with past inputs, past residuals and time by score "
    "tests. Past residuals explain the next ones: the noise has more structure than its model. The "
    "covariance is then not to be trusted.",
    "Raise the orders of C and D under `noise`.",
)
DRIFT = refuted(
    "drift",
    "The residuals drift. Residuals are compared with past inputs, past residuals and time by score tests. "
    "The residuals follow a slow trend.",
    "Let the noise drift (`noise: {drift: true}`), remove the trend, or use a part of the record without it.",
)
MISSING = refuted(
    "parameter-missing",
    "The model lacks a parameter. One more parameter of plant or noise explains the data much better than "
    "chance would.",
    "Estimate it along.",
)
CHANGED = refuted(
    "plant-changed",
    "The plant did not stay the same. Parameters that change with time explain the data much better than "
    "constant ones.",
    "Assess the parts of the record one by one (`--range`), and look for what changed between them.",
)
NONLINEAR = refuted(
    "plant-nonlinear",
    "The plant is not linear. A nonlinear effect of the inputs explains the data much better than the "
    "linear model alone.",
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
    failing = sorted(estimate.tests.failed_besides, key=lambda test: test.probability)
    remedies, found = remedies_of(model), []
    for fault, (kind, sentence) in OF_MANY.items():
        test = next((test for test in failing if test.fault == fault and test not in directed), None)
        if test is not None:
            figures = {"probability": test.probability, "lag": test.lag}
            p, remedy, where = chance(test.probability), remedies[fault], _where(model, test)
            said = sentence.format(p=p, lag=test.lag, remedy=remedy, where=where)
            found.append(kind.found(said, where=test.name, **figures))
    for test in failing:
        if test in directed:
            kind, sentence = _OF_ONE[test.fault]
            first, *others = (one.phrase for one in directed[test])
            said = sentence.format(p=chance(test.probability), phrase=first, remedy=REMEDY[test.fault])
            said += f"; nearly the same on these data: {', '.join(others)}" if others else ""
            found.append(kind.found(said, where=test.name, probability=test.probability))
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
