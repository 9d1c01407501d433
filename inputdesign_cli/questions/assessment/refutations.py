"""What speaks against an estimate, and what to do about it, in sentences."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np
from numpy.typing import NDArray

from inputdesign_cli.identification import Alternative, Estimate, ScoreTest
from inputdesign_cli.plant import Model
from inputdesign_cli.questions.assessment.remedies import remedies_of

FOUND = {
    "plant": "past inputs explain residuals{where} (probability {p}), most at lag {lag}: the plant has "
    "more structure than the model; {remedy}, or compare with an FIR model (B: [0, 1, 1, ..]) that is long "
    "enough",
    "noise": "the residuals are not white{where} (probability {p}), most at lag {lag}: the noise has "
    "more structure than the model, and the covariance is not to be trusted; {remedy}",
    "drift": "the residuals drift slowly{where} (probability {p}), which other tests notice too: {remedy}, "
    "remove the trend from the record, or use a part of it without drift",
}
# What drifts makes other tests fail, and what is missing in G those of the noise.
_FIRST = ("drift", "plant", "noise")
_MISSING = {
    "plant": "one parameter is missing (probability {p} without it): {phrase}",
    "noise": "one parameter is missing (probability {p} without it): {phrase}",
    "change": "the plant did not stay the same: {phrase} explains the data better (probability {p} without "
    "it); {remedy}",
    "nonlinear": "the plant is not linear: {phrase} explains the data better (probability {p} without it); "
    "{remedy}",
}
REMEDY = {
    "plant": "estimate it along",
    "noise": "estimate it along",
    "change": "assess the parts of the record one by one (--range), and look for what changed between them",
    "nonlinear": "a linear model holds for one range of the input only: use the range that the model is for, "
    "or give as u what the actuator really does",
}
# Experiments of one system differ as much with this probability; a prior, which decides along with the data
# and may hide what they say, and the data with this one, and so seldom do they agree as closely.
_ONE_SYSTEM, _PRIOR = 1e-3, 1e-2
_LEAST = 1e-300
# Of a standard deviation: nearer to where an expression ends, an estimate was stopped there.
_ASIDE = 0.001


def chance(probability: float) -> str:
    """A probability for a sentence, also one that is below the smallest number."""
    return f"{probability:.1e}" if probability >= _LEAST else f"below {_LEAST:.0e}"


def unsettled(model: Model, estimate: Estimate) -> list[str]:
    """What to say of a search that did not settle, or that the end of an expression stopped.

    Args:
        model: the estimate as a model.
    """
    found = []
    if not estimate.converged:
        begun = "its only start" if estimate.starts == 1 else f"the best of {estimate.starts} starts"
        found.append(
            f"the search did not settle after {estimate.steps} steps from {begun}: "
            "the estimate may be far from the minimum; the orders may be too high for these data"
        )
    return found + stopped_at_ends(model, estimate)


def stopped_at_ends(model: Model, estimate: Estimate) -> list[str]:
    """What to say of parameters that the search left where an expression ends."""
    found = []
    deviations = np.sqrt(np.diag(estimate.covariance))
    for k in np.flatnonzero(~model.dead_times).tolist():
        beside = [model.at(theta).flaw for theta in _beside(model.theta, k, _ASIDE * deviations[k])]
        flaw = next(filter(None, beside), None)
        if flaw is not None:
            found.append(
                f"the search stopped at {model.names[k]} = {model.theta[k]:.6g}, beyond which {flaw}: the "
                "likeliest parameters may lie there, and its deviation is not to be trusted; write the "
                "expression so that it is defined wherever the plant may be"
            )
    return found


def _beside(theta: NDArray[np.float64], index: int, step: float) -> Iterator[NDArray[np.float64]]:
    """theta with one parameter a little less, and a little more."""
    for sign in (-1.0, 1.0):
        moved = theta.copy()
        moved[index] += sign * step
        yield moved


def contradictions(estimate: Estimate, looks: int = 1) -> list[str]:
    """What to say where the prior and the data are not of one system, or of one record.

    Args:
        looks: how often it is asked as data come in; they share the level (Bonferroni).
    """
    if estimate.agreement is None or estimate.likeness is None:
        return []
    if estimate.agreement * looks < _PRIOR:
        return [
            "experiment.prior and these data contradict each other (probability "
            f"{chance(estimate.agreement)} for one system): remove the prior, or look for what has changed "
            "since"
        ]
    if estimate.likeness * looks < _PRIOR:
        return [
            "experiment.prior and these data agree more closely than others do (probability "
            f"{chance(estimate.likeness)}): the prior seems to be made of this record, or of a part or copy "
            "of it, which would count twice; leave it out, or give only records that it was not made of"
        ]
    return []


def differences(estimate: Estimate, files: Sequence[str], looks: int = 1) -> list[str]:
    """What to say where the experiments are not of one system; the level is shared by all (Bonferroni).

    Args:
        looks: see `contradictions`.
    """
    found = [
        (probability, name)
        for probability, name in zip(estimate.alike, files, strict=False)
        if probability * len(estimate.alike) * looks < _ONE_SYSTEM
    ]
    if not found:
        return []
    probability, name = min(found)
    others = [other for other in files if other != name]
    against = others[0] if len(others) == 1 else "the other records"
    return [
        f"{name} and {against} are not of one system (probability {chance(probability)} that their "
        "parameters differ as much by chance): assess each alone, and look for what has changed between them"
    ]


def repetitions(estimate: Estimate, files: Sequence[tuple[str, int]]) -> list[str]:
    """What to say where samples seem to be given twice; `files` are names and samples, if known."""
    found = estimate.repeated
    if found is None:
        return []
    files = files or [("the record", found.second + found.length)]
    ends = np.cumsum([samples for _, samples in files])
    # By their middle: the ends are not sharp.
    first, second = (
        files[int(np.searchsorted(ends, at + found.length // 2, side="right"))][0]
        for at in (found.first, found.second)
    )
    where = "others there" if first == second else f"those of {first}"
    return [
        f"the residuals of about {found.length} samples of {second} follow {where} as noise does not: either "
        "samples are given twice, which makes the estimate look surer than it is (give each once), or the "
        "model lacks something that comes again with the same input (raise its orders)"
    ]


def refutations(model: Model, estimate: Estimate) -> list[str]:
    """What the strongest test of every kind of fault says, and which single parameters are missing.

    Of an output that shifts see `level_shifts.py`.
    """
    strongest: dict[str, ScoreTest] = {}
    directed = {one.test: one.alternatives for one in estimate.directed}
    failing = estimate.failed_besides
    for test in failing:
        if test in directed:
            continue
        if test.fault not in strongest or test.probability < strongest[test.fault].probability:
            strongest[test.fault] = test
    remedies = remedies_of(model)
    of_many = [
        FOUND[fault].format(
            p=chance(strongest[fault].probability),
            lag=strongest[fault].lag,
            remedy=remedies[fault],
            where=_where(model, strongest[fault]),
        )
        for fault in _FIRST
        if fault in strongest
    ]
    of_one = [
        _MISSING[test.fault].format(
            p=chance(test.probability), phrase=directed[test][0].phrase, remedy=REMEDY[test.fault]
        )
        + _or_else(directed[test][1:])
        for test in sorted(directed, key=lambda test: test.probability)
        if test in failing
    ]
    return of_many + of_one


def _where(model: Model, test: ScoreTest) -> str:
    """Which of several channels, as u2 acts on y1."""
    if model.outputs == model.inputs == 1:
        return ""
    output, source = f"y{test.output + 1}", test.source + 1
    if test.fault == "plant":
        return f", those of {output} by u{source} most"
    own = test.fault == "drift" or test.output == test.source
    return f", those of {output} most" if own else f", those of {output} after those of y{source} most"


def _or_else(others: Sequence[Alternative]) -> str:
    """What these data hardly tell from it."""
    listed = ", ".join(other.phrase for other in others)
    return f"; nearly the same on these data: {listed}" if others else ""
