"""Inputs that did not move the plant: they answer the outputs, or explain nothing of them."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from inputdesign_cli.arrays import Array
from inputdesign_cli.finding import DOUBT, REFUTED, Finding, FindingKind, doubt, finding, note
from inputdesign_cli.identification import Estimate, ScoreTest
from inputdesign_cli.identification.checks import signal_name
from inputdesign_cli.identification.response_chance import perhaps_other_inputs, perhaps_zero
from inputdesign_cli.outcome.shares import chance
from inputdesign_cli.outcome.units import Units
from inputdesign_cli.plant import Model

# G of the spec is ruled out if the probability of this estimate is below the threshold.
_RULED_OUT = 1e-6
# An input whose future explains more than this share of the squared prediction errors was logged late.
_LOGGED_LATE = 0.5
# An output that moves in fewer rows than every input, by this factor, may be an input itself.
_HELD = 20.0

UNEXPLAINED = doubt(
    "output-unexplained",
    "The inputs explain nothing of an output. Their simulation fits it worse than its mean. No effect can "
    "be distinguished from zero.",
    "Check that the columns belong to the plant, in the right order and units.",
)
NOISE_PREVAILS = note(
    "noise-prevails",
    "Noise moves an output more than the inputs. The effect of the inputs is visible, but noise and drift "
    "are larger.",
    "Apply more power, or compare models by prediction instead of simulation.",
)


@finding(REFUTED, "input-answers-output", "Correct the columns, or state a loop as `experiment.controller`.")
def answering(kind: FindingKind, units: Units, estimate: Estimate) -> list[Finding]:
    """An input responds to the outputs. In open loop no input responds to the noise."""
    found = []
    for test in estimate.tests.answering:
        if test.statistic > _LOGGED_LATE * estimate.errors.size:
            found.append(_late(units.inputs, units.outputs, test))
            continue
        name, p = signal_name("u", test.source, units.inputs), test.probability
        found.append(kind.found(f"{name} (probability {chance(p)} by chance)", where=name, probability=p))
    return found


@finding(REFUTED, "input-logged-late", "Find when the plant really gets its input, and log both together.")
def _late(kind: FindingKind, inputs: int, outputs: int, test: ScoreTest) -> Finding:
    """An output moves before the input. The input was logged late, or the columns use different clocks.

    Or columns are swapped.
    """
    name, output = signal_name("u", test.source, inputs), signal_name("y", test.output, outputs)
    p, early = test.probability, f"{test.lag} sample{'s' * (test.lag != 1)}"
    fact = f"{output} responds to {name} up to {early} early (probability {chance(p)} by chance)"
    return kind.found(fact, where=name, samples=test.lag, probability=p)


def late_inputs(units: Units, estimate: Estimate) -> list[Finding]:
    """Return a finding for each input whose future explains prediction errors, in open loop."""
    return [_late(units.inputs, units.outputs, test) for test in estimate.tests.answering]


@finding(DOUBT, "columns-perhaps-swapped", "Exchange u and y in `--columns`.")
def perhaps_swapped(kind: FindingKind, parts: Sequence[tuple[Array, Array]]) -> list[Finding]:
    """Columns of inputs and outputs may be swapped. An output is held, and the inputs move in most rows.

    Args:
        parts: all records, u (n, r), y (n, p).
    """
    u, y = (np.concatenate([np.diff(signals[k], axis=0) != 0.0 for signals in parts]) for k in (0, 1))
    inputs, outputs = u.mean(axis=0), y.mean(axis=0)
    seldom, often = int(np.argmin(outputs)), float(inputs.min(initial=1.0))
    name = signal_name("y", seldom, len(outputs))
    share = f"{100.0 * outputs[seldom]:.2g} % of the rows"
    fact = f"{name} moves in {share}, and the inputs in {100.0 * often:.2g} %"
    held = _HELD * outputs[seldom] < often
    return kind.when(outputs[seldom] > 0.0 and held and often > 0.5, fact, where=name)


@finding(
    REFUTED,
    "input-without-effect",
    "Check that the columns are of one experiment. If the plant does not respond, correct the spec.",
)
def idle(
    kind: FindingKind, units: Units, nominal: Model, estimated: Model, estimate: Estimate
) -> list[Finding]:
    """An input explains nothing. Its G cannot be distinguished from zero.

    Args:
        nominal, estimated: models of one structure.
    """
    found = []
    for j, zero, expected in perhaps_other_inputs(nominal, estimated, estimate, units.step):
        name = signal_name("u", j, units.inputs)
        fact = f"{name} (probability {chance(zero)}, and {chance(expected)} for G of the spec)"
        found += kind.when(expected < _RULED_OUT, fact, where=name, probability=zero)
    return found


def hardly_explained(units: Units, model: Model, estimate: Estimate) -> list[Finding]:
    """Return a finding for outputs that are farther from the simulation than from their mean."""
    far = {i for i, fit in enumerate(estimate.simulation.fit) if fit is not None and fit < 0.0}
    unrelated = set(perhaps_zero(model, estimate, units.step)) if far else set()
    found = []
    for kind, idle_ in ((UNEXPLAINED, far & unrelated), (NOISE_PREVAILS, far - unrelated)):
        outputs = " and ".join(signal_name("y", i, len(estimate.noise)) for i in sorted(idle_))
        found += kind.when(outputs, outputs, where=outputs)
    return found
