"""Tests refute the structure of a model, or name the parameter that it lacks."""

from __future__ import annotations

from inputdesign_cli.finding import Finding, refuted
from inputdesign_cli.identification import Estimate, ScoreTest
from inputdesign_cli.outcome.shares import chance
from inputdesign_cli.plant import Model

PLANT = refuted(
    "plant-structure",
    "The residuals still depend on past inputs. By a score test, the plant has more structure than the "
    "model.",
    "Raise the orders of the plant (B, F or A; numerator and denominator; a further lag), or change its "
    "delay. Values in `plant.known` may be wrong.",
)
NOISE = refuted(
    "noise-structure",
    "The residuals are not white. Past residuals explain the next ones (score test): the noise has more "
    "structure than its model. The covariance is then unreliable.",
    "Raise the orders of C and D under `noise`. A plant in s needs `plant.sample: zoh` for them.",
)
DRIFT = refuted(
    "drift",
    "The residuals drift. They follow a slow trend (score test).",
    "Let the noise drift (`noise: {drift: true}`), remove the trend, or use a part of the record without it.",
)
MISSING = refuted(
    "parameter-missing",
    "The model lacks a parameter. A further parameter of plant or noise explains the data much better than "
    "chance would.",
    "Estimate this parameter too.",
)
CHANGED = refuted(
    "plant-changed",
    "The plant changed during the record. Time-varying parameters explain the data much better than "
    "constant ones.",
    "Assess the parts of the record one by one (`--range`), and find out what changed between them.",
)
NONLINEAR = refuted(
    "plant-nonlinear",
    "The plant is not linear. A nonlinear effect of the inputs explains the data much better than the "
    "linear model alone.",
    "Use the input range for which the model is meant, or record the true output of the actuator as u.",
)
# Drift makes other tests fail; an error of G makes tests of the noise fail.
_OF_MANY = {"drift": DRIFT, "plant": PLANT, "noise": NOISE}
_MOST = {"plant": "most on inputs {} earlier", "noise": "residuals {} apart are correlated most"}
OF_ONE = {"plant": MISSING, "noise": MISSING, "change": CHANGED, "nonlinear": NONLINEAR}


def refutations(model: Model, estimate: Estimate) -> list[Finding]:
    """Return the strongest test of each kind of fault, and the single parameters that are missing."""
    directed = {one.test: one.alternatives for one in estimate.tests.directed}
    failing = sorted(estimate.tests.failed_besides, key=lambda test: test.probability)
    found = []
    for fault, kind in _OF_MANY.items():
        test = next((test for test in failing if test.fault == fault and test not in directed), None)
        if test is not None:
            p = test.probability
            fact = f"{_where(model, test)}; with a right model the probability of that is {chance(p)}"
            found.append(kind.found(fact, where=test.name, probability=p, lag=test.lag))
    for test in failing:
        if test in directed:
            first, *others = (one.phrase for one in directed[test])
            fact = f"{first} (probability {chance(test.probability)} without it)"
            fact += f"; nearly the same on these data: {', '.join(others)}" if others else ""
            found.append(OF_ONE[test.fault].found(fact, where=test.name, probability=test.probability))
    return found


def _where(model: Model, test: ScoreTest) -> str:
    """Return the lag and the channels in which a test fails most; empty for a trend of a single output."""
    samples = f"{test.lag} sample{'s' * (test.lag != 1)}"
    lag = "" if test.lag is None else _MOST.get(test.fault, "").format(samples)
    source = f"of {'u' if test.fault == 'plant' else 'y'}{test.source + 1} " * (test.fault != "drift")
    channels = f"{source}in y{test.output + 1}" * (model.outputs + model.inputs > 2)
    return ", ".join(filter(None, (lag, channels))) or "they follow a trend"
