"""Inputs that did not move the plant: they answer the outputs, or explain nothing of them."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from inputdesign_cli.arrays import Array
from inputdesign_cli.explore import early_answers
from inputdesign_cli.finding import Finding, doubt, note, refuted
from inputdesign_cli.identification import Estimate, ScoreTest
from inputdesign_cli.identification.checks import signal_name
from inputdesign_cli.identification.response_chance import driven_by_nothing, like_nothing_elsewhere
from inputdesign_cli.outcome.shares import chance
from inputdesign_cli.outcome.units import Units
from inputdesign_cli.plant import Model

# G of the spec is ruled out where chance alone makes such an estimate more seldom.
_OTHERWISE = 1e-6
# Of the squares of prediction errors: what the future of an input explains if it moves the output.
_MOSTLY = 0.5

ANSWERING = refuted(
    "input-answers-output",
    "An input responds to the outputs. Prediction errors help to predict an input. In open loop no input "
    "responds to the noise.",
    "Correct late or swapped columns, or state a loop as `experiment.controller`.",
)
LATE = refuted(
    "input-logged-late",
    "An output moves before the input. The input was logged some samples late, or the columns use different "
    "clocks.",
    "Find out when the plant really gets its input, and log both together.",
)
IDLE = refuted(
    "input-without-effect",
    "An input has no visible effect. Its G cannot be distinguished from zero, though the plant of the spec "
    "would respond clearly.",
    "Check that the columns are of one experiment. If the plant does not respond, correct the spec.",
)
UNEXPLAINED = doubt(
    "output-unexplained",
    "The inputs do not explain an output. Their simulation fits it worse than its mean. No effect can be "
    "distinguished from zero.",
    "Check that the columns belong to the plant, in the right order and units.",
)
NOISE_PREVAILS = note(
    "noise-prevails",
    "Noise moves an output more than the inputs. The effect of the inputs is visible, but noise and drift "
    "are larger.",
    "Apply more power, or compare models by prediction instead of simulation.",
)


def answering(units: Units, estimate: Estimate) -> list[Finding]:
    """Return a finding for each input that answers outputs, or comes after their answer; none in a loop."""
    found = []
    for test in estimate.tests.answering:
        name = signal_name("u", test.source, units.inputs)
        message = (
            f"prediction errors help to predict {name} (probability {chance(test.probability)}), and no "
            "input in open loop answers the noise: it was logged late, columns are swapped, or the data "
            "come from a loop; mend the columns, or state the loop as experiment.controller"
        )
        answers = ANSWERING.found(message, where=name, probability=test.probability)
        late = test.statistic > _MOSTLY * estimate.errors.size
        found.append(_late(units.inputs, units.outputs, test) if late else answers)
    return found


def _late(inputs: int, outputs: int, test: ScoreTest) -> Finding:
    """Return the finding for an input that an output answers some samples before it moves."""
    name, output, lag = (
        signal_name("u", test.source, inputs),
        signal_name("y", test.output, outputs),
        test.lag,
    )
    message = (
        f"{output} answers {name} up to {lag} {'sample' if lag == 1 else 'samples'} before that moves "
        f"(probability {chance(test.probability)} by chance): the input was logged late, columns are "
        "swapped, or the columns are not of one clock. See when the plant really gets its input, and write "
        "both at the same times"
    )
    return LATE.found(message, where=name, samples=lag, probability=test.probability)


def late_inputs(parts: Sequence[tuple[Array, Array]]) -> list[Finding]:
    """Return a finding for each input before which an output moves: u (n, r), y (n, p) without a model."""
    inputs, outputs = parts[0][0].shape[1], parts[0][1].shape[1]
    return [_late(inputs, outputs, test) for test in early_answers(parts)]


def idle(units: Units, nominal: Model, estimated: Model, estimate: Estimate) -> Iterator[Finding]:
    """Yield a finding for each input that explains nothing, though at the plant of the spec it would.

    Args:
        nominal, estimated: of one structure.
    """
    for j, zero, expected in like_nothing_elsewhere(nominal, estimated, estimate, units.step):
        name = signal_name("u", j, units.inputs)
        message = (
            f"{name} explains nothing of what was measured: G cannot be told from zero (probability "
            f"{chance(zero)}), and the plant of the spec can: see whether the columns are those of one "
            "experiment; if the plant does not answer, correct the spec"
        )
        if expected < _OTHERWISE:
            yield IDLE.found(message, where=name, probability=zero)


def hardly_explained(units: Units, model: Model, estimate: Estimate) -> Iterator[Finding]:
    """Yield a finding for outputs that are farther from the simulation than from their mean."""
    far = {i for i, fit in enumerate(estimate.simulation.fit) if fit is not None and fit < 0.0}
    unrelated = set(driven_by_nothing(model, estimate, units.step)) if far else set()
    for kind, sentence, listed in (
        (
            UNEXPLAINED,
            "the inputs explain nothing of {} in this model: see whether the columns are those of the "
            "plant, in their order and their units, before anything is built on it",
            far & unrelated,
        ),
        (
            NOISE_PREVAILS,
            "what the inputs cause in {} is seen, but noise and drift move it more: simulated from the "
            "inputs alone, the model is farther off than the mean",
            far - unrelated,
        ),
    ):
        outputs = " and ".join(signal_name("y", i, len(estimate.noise)) for i in sorted(listed))
        if listed:
            yield kind.found(sentence.format(outputs), where=outputs)
