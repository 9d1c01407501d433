"""Tests refute the structure of a model, or name the parameter that it lacks, with what to do in the spec."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from inputdesign_cli.finding import Finding, refuted
from inputdesign_cli.identification import Estimate, ScoreTest
from inputdesign_cli.outcome.model_words import Plain, blocks_of
from inputdesign_cli.outcome.shares import chance
from inputdesign_cli.plant import Model

_SHARE = 0.1  # of the lag that is there: where the search for another one begins
_LAG = "a further lag, [T2, 1] as another factor of the denominator (a list of factors) and T2 in parameters"


def remedies_of(model: Model, *, leaks: bool = True) -> dict[str, str]:
    """Return the keys to change, by what the tests find: `plant`, `noise` or `drift`.

    Args:
        leaks: whether a drift may come from a leak.
    """
    blocks = blocks_of(model)
    plant, known = _of_plant(blocks["plant"]), blocks["plant"].get("known")
    if known:
        plant = f"see whether what is known is right (plant.known: {', '.join(known)}; without it, it is "
        plant += f"estimated), or {_of_plant(blocks['plant'])}"
    return {"plant": plant, **_of_noise(model, blocks, leaks=leaks)}


def quantities(model: Model) -> NDArray[np.bool_]:
    """Return whether each parameter is a physical quantity, of which no order can be too high, (k,)."""
    plant = blocks_of(model)["plant"]
    named = "parameters" in plant or "gain" in plant.get("continuous", {})
    return np.asarray((model.in_plant & named) | model.dead_times)


def _of_plant(plant: Mapping[str, Plain]) -> str:
    stated = plant.get("continuous", {})
    if "gain" in stated:
        return _lag_more(stated)
    if "state_space" in plant:
        return "give A, B and C of the state space a further state"
    if "parameters" not in plant:
        if "continuous" in plant:
            return "raise the orders of numerator and denominator"
        return "raise the orders of B and F (or A), or change the delay"
    if "continuous" in plant:
        return f"give the numerator a further coefficient, or the denominator {_LAG}"
    return "give B or F (or A) a further coefficient, by a name in parameters"


def _lag_more(stated: Mapping[str, Plain]) -> str:
    """Return the advice that writes a plant given by gain and time constants with an additional lag."""
    kept = ", ".join(stated)
    if not all(isinstance(value, (int, float)) for value in stated.values()):
        return f"write entries by numerator and denominator, with a further lag, in place of {kept}"
    if "time_constant" in stated:
        slow, poles, own = stated["time_constant"], "[T1, 1]", {"T1": stated["time_constant"]}
    else:
        slow, poles = 1.0 / stated["natural_frequency"], "[1/w**2, 2*zeta/w, 1]"
        own = {"zeta": stated["damping"], "w": stated["natural_frequency"]}
    values = {"K": stated["gain"], **own, "T2": _SHARE * slow}
    late = ""
    if stated.get("dead_time"):
        late, values["L"] = ", delay: L", stated["dead_time"]
    listed = ", ".join(f"{name}: {value:.4g}" for name, value in values.items())
    written = f"{{numerator: [K], denominator: [{poles}, [T2, 1]]{late}}}"
    return (
        f"write, to begin a search from, plant.parameters: {{{listed}}} and plant.continuous: {written} in "
        f"place of {kept} (uncertainty, if there is one, needs the new names)"
    )


def leaking(model: Model) -> str:
    """Return the denominator with a leak of a plant that is known to integrate; empty for another plant.

    A tank whose outflow grows with its level looks as if its noise drifted.
    """
    plant = blocks_of(model)["plant"]
    match plant, plant.get("continuous", {}):
        case {"parameters": known}, {"denominator": [*others, 0 | "0"]} if "leak" not in known and not any(
            isinstance(one, list) for one in others
        ):
            return f"[{', '.join(f'{one}' for one in others)}, leak]"
    return ""


def no_leak(estimate: Estimate) -> bool:
    """Return whether past inputs explain the residuals better than a leak: a lag is missing, for example."""
    failing = (test.probability for test in estimate.tests.failed_besides if test.fault == "plant")
    leak = (test.probability for test in estimate.tests.scores if test.name == "leak")
    return min(failing, default=1.0) < min(leak, default=1.0)


def _of_noise(model: Model, blocks: Mapping[str, Mapping[str, Plain]], *, leaks: bool) -> dict[str, str]:
    plant, noise = blocks["plant"], blocks["noise"]
    if model.continuous:
        sampled = "sample the plant (plant.sample: zoh), so that noise may have"
        return {"noise": f"{sampled} C and D", "drift": f"{sampled} drift: true"}
    first = " (for example noise: {C: [1, -0.1], D: [1, -0.8]})" if not {"C", "D"} & set(noise) else ""
    polynomials = "" if "continuous" in plant or "state_space" in plant else " (or A)"
    drifts = "drift" in noise
    drift = "raise the order of D under noise" if drifts else "let the noise drift (noise: {drift: true})"
    drift += ", remove the trend from the record, or use a part of it without drift"
    if leaks and (denominator := leaking(model)):
        drift = (
            f"let the plant leak (plant.continuous.denominator: {denominator}, and leak in plant.parameters)"
        )
    return {"noise": f"raise the orders of C and D under noise{first}{polynomials}", "drift": drift}


PLANT = refuted(
    "plant-structure",
    "The residuals still depend on past inputs. By a score test, the plant has more structure than the "
    "model.",
    "Raise the orders of the plant or change its delay; the message in result.json names the keys.",
)
NOISE = refuted(
    "noise-structure",
    "The residuals are not white. Past residuals explain the next ones (score test): the noise has more "
    "structure than its model. The covariance is then unreliable.",
    "Raise the orders of C and D under `noise`.",
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
OF_MANY = {"drift": DRIFT, "plant": PLANT, "noise": NOISE}
_MOST = {
    "drift": "they follow a trend",
    "plant": "most on inputs {} earlier",
    "noise": "those {} apart are correlated most",
}
OF_ONE = {"plant": MISSING, "noise": MISSING, "change": CHANGED, "nonlinear": NONLINEAR}
_LONG = ", or compare with a long FIR model (B: [0, 1, 1, ..])"


def refutations(model: Model, estimate: Estimate) -> list[Finding]:
    """Return the strongest test of each kind of fault, and the single parameters that are missing."""
    directed = {one.test: one.alternatives for one in estimate.tests.directed}
    failing = sorted(estimate.tests.failed_besides, key=lambda test: test.probability)
    remedies, found = remedies_of(model, leaks=not no_leak(estimate)), []
    for fault, kind in OF_MANY.items():
        test = next((test for test in failing if test.fault == fault and test not in directed), None)
        if test is not None:
            p, samples = test.probability, f"{test.lag} sample{'s' * (test.lag != 1)}"
            most = f"{_MOST[fault].format(samples)}{_where(model, test)}"
            fact = f"{most}; with a right model the probability of that is {chance(p)}"
            remedy = _sentence(f"{remedies[fault]}{_LONG * (fault == 'plant')}")
            found.append(kind.found(fact, where=test.name, remedy=remedy, probability=p, lag=test.lag))
    for test in failing:
        if test in directed:
            first, *others = (one.phrase for one in directed[test])
            fact = f"{first} (probability {chance(test.probability)} without it)"
            fact += f"; nearly the same on these data: {', '.join(others)}" if others else ""
            found.append(OF_ONE[test.fault].found(fact, where=test.name, probability=test.probability))
    return found


def drifting(model: Model, fact: str) -> Finding:
    """Return the finding that an output drifts, with the remedy for this model."""
    return DRIFT.found(fact, where="y", remedy=_sentence(remedies_of(model)["drift"]))


def _sentence(advice: str) -> str:
    return f"{advice[:1].upper()}{advice[1:]}."


def _where(model: Model, test: ScoreTest) -> str:
    """Return a phrase for the channels in which a test fails most; empty for a single one."""
    if model.outputs == model.inputs == 1:
        return ""
    output, source = f"y{test.output + 1}", test.source + 1
    if test.fault == "plant":
        return f", for {output} by u{source}"
    own = test.fault == "drift" or test.output == test.source
    return f", for {output}" if own else f", for {output} after y{source}"
