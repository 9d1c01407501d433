"""A spec in words: the system, the experiment and what is asked."""

from __future__ import annotations

from dataclasses import dataclass

from inputdesign_cli.outcome.objectives import objective
from inputdesign_cli.report.numbers import spoken
from inputdesign_cli.specification import PolynomialPlant, Spec, parse_spec
from inputdesign_cli.specification.models.accuracy import FrequencyResponse, ModelError
from inputdesign_cli.specification.models.experiment import Noise
from inputdesign_cli.specification.models.spectrum import FirSpectrum, GivenSpectrum, PolynomialSpectrum
from inputdesign_cli.specification.models.uncertainty import SOURCES
from inputdesign_cli.specification.plugins import added

_SPECTRA = {
    "white": "white excitation",
    "fir": "spectra of finite impulse response type",
    "multisine": "sums of sinusoids on given frequencies",
    "free": "every spectrum",
    "polynomial": "spectra that are polynomials in frequency",
    "pointwise": "spectra given point by point on a grid",
    "moments": "second moments of the regressors",
}


@dataclass(frozen=True)
class Question:
    """Holds the question of a spec in words, and the facts of the spec that a page needs besides."""

    title: str
    sentences: tuple[str, ...]  # the system, the experiment, what is asked
    time_unit: str
    closed_loop: bool
    regression: bool
    linearised: bool  # r_u is of first order in the parameters
    asked: frozenset[str]  # the keys under `accuracy`
    family: str  # the type of the spectrum; empty for a given one
    seed: int  # of the signal
    units: str  # of the values on the page


def read_question(text: str, file: str = "spec.yaml", verb: str = "solve") -> Question:
    """The question of the spec of a run.

    Args:
        text: the spec as resolved (YAML).
        file: its name in messages.
        verb: the command that answered.

    Raises:
        SpecError: `text` is no spec of this version.
    """
    spec = parse_spec(text, file, design=verb != "identify")
    error = spec.accuracy.error
    # Data that are only to be explained ask for no accuracy, whatever the spec was written for.
    designs = [] if verb == "identify" else [*_uncertain(spec), *_accuracy(spec), *_limits(spec)]
    sentences = [_system(spec), _experiment(spec), *designs, _goal(spec, verb)]
    return Question(
        title=spec.title or "",
        sentences=tuple(sentences),
        time_unit=spec.time_unit,
        closed_loop=spec.closed_loop,
        regression=spec.plant.kind == "regression",
        linearised=error is None or error.region != "ellipsoid",
        asked=frozenset(name for name, value in spec.accuracy if value is not None),
        family=_family(spec),
        seed=spec.signal.seed or 0,
        units=_units(spec),
    )


def _units(spec: Spec) -> str:
    """Return in which units the numbers are."""
    named = [f"{name} in {one.unit}" for name, one in (spec.channels or {}).items() if one.unit]
    signals = ", ".join(named) or "signals in the units of the spec"
    clock = f"time in {spec.time_unit}, frequencies in rad/{spec.time_unit}"
    return f"{signals}; powers are mean squares, in the squares of these; {clock}"


def _family(spec: Spec) -> str:
    stated = spec.spectrum
    return "" if stated is None or isinstance(stated, GivenSpectrum) else stated.type


def _system(spec: Spec) -> str:
    plant = spec.plant
    if plant.kind == "regression":
        return "The system is a linear regression with neglected regressors."
    kinds = {"state_space": "a state-space", "continuous": "a continuous-time"}
    kind = _structure(plant, spec.noise) if plant.kind == "polynomial" else kinds[plant.kind]
    size = f"{_count(plant.inputs, 'input')} and {_count(plant.outputs, 'output')}"
    clock = f", sampled every {spec.sample_time:g} {spec.time_unit}" if plant.sampled else ""
    called = "; ".join(
        f"{name} is {one.name or 'measured'}{f' in {one.unit}' if one.unit else ''}"
        for name, one in (spec.channels or {}).items()
    )
    return f"The system is {kind} system with {size}{clock}.{f' {called}.' if called else ''}"


def _structure(plant: PolynomialPlant, noise: Noise) -> str:
    there = {"A": plant.A != (1.0,), "C": noise.C != (1.0,), "D": noise.D != (1.0,), "F": plant.F is not None}
    names = {
        "": "a finite impulse response", "A": "an ARX", "AC": "an ARMAX", "F": "an output-error",
        "CF": "a Box-Jenkins", "DF": "a Box-Jenkins", "CDF": "a Box-Jenkins",
    }  # fmt: skip
    return names.get("".join(name for name, is_there in there.items() if is_there), "a general polynomial")


def _experiment(spec: Spec) -> str:
    samples = spec.experiment.samples
    length = f"{samples} samples" if samples > 1 else "one sample, so that figures are per sample"
    if spec.plant.kind == "regression":
        return f"The experiment has {length}; the moments of its regressors are summed over all samples."
    loop = "in closed loop, with the controller in operation" if spec.closed_loop else "in open loop"
    if spec.designs and spec.goal == "shortest_experiment":
        return f"The length of the experiment is sought; it runs {loop}."
    return f"The experiment has {length}, {loop}."


def _uncertain(spec: Spec) -> list[str]:
    """For which plants the design is."""
    stated = spec.uncertainty
    if stated is None:
        return []
    if isinstance(stated.scenarios, tuple):
        return [f"What is asked must hold for this plant and {len(stated.scenarios)} others that are listed."]
    number = f"{stated.scenarios} plants" if stated.scenarios else "plants"
    if stated.risk is not None:
        number = f"as many plants as a risk of {stated.risk:g} takes,"
    source = {"covariance": "its covariance", "information": "what is known of it", "intervals": "intervals"}
    drawn = source[stated.stated(*SOURCES)[0]]
    return [f"What is asked must hold for this plant and {number} drawn from {drawn}."]


_SENTENCES = {
    "information": "The information matrix must exceed a given matrix.",
    "application": "The confidence region of the model must lie where the application tolerates it.",
    "weighted_variance": "The weighted variance of the frequency response is bounded.",
    "standard_deviation": "Standard deviations of parameters are bounded.",
    "closed_loop_error": "A controller is designed on the model; what counts is the error of its loop.",
}


def _accuracy(spec: Spec) -> list[str]:
    accuracy, sentences = spec.accuracy, []
    if accuracy.error is not None:
        sentences.append(_model_error(accuracy.error, spec.time_unit))
    if accuracy.frequency_response is not None:
        sentences.append(
            "The frequency response is measured line by line, without a model, by an input that repeats: its "
            f"standard deviation must not exceed {_admitted(accuracy.frequency_response)} at any line."
        )
    plugins = {name: (one.__doc__ or name).splitlines()[0] for name, one in added("requirements").items()}
    said, values = _SENTENCES | plugins, dict(accuracy)
    sentences += [text for name, text in said.items() if values.get(name) is not None]
    squared = accuracy.mean_squared_error
    if squared is not None:
        most = "is to be small" if squared.target is None else f"must not exceed {squared.target:g}"
        sentences.append(
            f"The mean squared error of the estimate, bias and variance together, {most}, whatever the "
            f"neglected parameters up to a norm of {squared.neglected_norm:g}."
        )
    if accuracy.criterion is not None:
        sentences.append(f"What counts is criterion {accuracy.criterion} of the information matrix.")
    return sentences


def _model_error(error: ModelError, time_unit: str) -> str:
    size = f"alpha = {error.alpha:g}" if error.alpha else f"{100 * (error.probability or 0):g} % confidence"
    what = f"the error r_u of the model ({size})"
    if error.calibrated is not None:
        what = f"the error of {100 * (error.calibrated.exact or 0):g} % of the estimates"
    band = ""
    if error.band is not None:
        band = f" from {error.band[0]:g} to {error.band[1]:.6g} rad/{time_unit}"
    admitted = f"the admissible error r_adm: {_admitted(error)}"
    return f"At every frequency{band}, {what} must not exceed {admitted}."


def _admitted(bound: ModelError | FrequencyResponse) -> str:
    if bound.relative is not None:
        return f"{100 * bound.relative:g} % of |G|"
    if bound.absolute is not None:
        return f"{bound.absolute:g}"
    if bound.table is not None:
        return f"the table {bound.table}"
    return "what keeps the sensitivity of the loop within its bound"


def _limits(spec: Spec) -> list[str]:
    names = [spoken(name) for name, value in spec.limits if value is not None]
    return [f"Limits hold for: {', '.join(names)}."] if names else []


_GOALS = {
    "identify": "the model that explains the recorded data, and how sure it is.",
    "assess": "do the recorded data meet this accuracy; if not, which experiment is still needed?",
    "campaign": "an experiment in parts, each designed on the data so far, until these meet the accuracy.",
    "analyse": "what accuracy the given excitation buys.",
}


def _goal(spec: Spec, verb: str) -> str:
    verb = verb if verb in ("identify", "assess", "campaign") or spec.designs else "analyse"
    if verb in _GOALS:
        return f"Asked: {_GOALS[verb]}"
    family, stated = _SPECTRA.get(_family(spec), ""), spec.spectrum
    among = f" among {family}" if family else ""
    if isinstance(stated, FirSpectrum | PolynomialSpectrum) and stated.order:
        among += f" of order {stated.order}"
    if spec.plant.kind == "regression" and spec.goal == "least_cost":
        return f"Asked: the least energy that does it{among}; the energy is their trace."
    asked = f"Asked: {objective(_objective(spec)).asked}{among}"
    if spec.goal != "least_cost":
        return f"{asked}."
    weights = {"input": spec.cost.input_power, "output": spec.cost.output_power}
    weights["excitation"] = spec.cost.excitation_power
    cost = " + ".join(
        f"{'' if weight == 1 else f'{weight:g} × '}{name} power"
        for name, weight in weights.items()
        if isinstance(weight, int | float) and weight
    )
    return f"{asked}; its cost is the {cost or 'weighted power'}."


def _objective(spec: Spec) -> str:
    """The `objective.kind` of the result."""
    if spec.goal != "best_accuracy":
        return spec.goal
    errors = ("closed_loop_error", "mean_squared_error")
    asked = (name for name, value in spec.accuracy if name in errors and value is not None)
    return next(asked, spec.accuracy.criterion or "accuracy_factor")


def _count(n: int, what: str) -> str:
    return f"{'one' if n == 1 else n} {what}{'' if n == 1 else 's'}"
