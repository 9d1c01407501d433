"""A spec in words: the system, the experiment and its goal. `question.txt` has the sentences."""

from __future__ import annotations

from dataclasses import dataclass

from inputdesign_cli.outcome.design import objective
from inputdesign_cli.outcome.sentences import sentences
from inputdesign_cli.specification import Spec, parse_spec
from inputdesign_cli.specification.models.spectrum import FirSpectrum, GivenSpectrum, PolynomialSpectrum
from inputdesign_cli.specification.models.uncertainty import SOURCES
from inputdesign_cli.specification.plugins import added

# Names of structures by the polynomials besides B that are not one.
_STRUCTURES = {
    "": "a finite impulse response", "A": "an ARX", "AC": "an ARMAX", "F": "an output-error",
    "CF": "a Box-Jenkins", "DF": "a Box-Jenkins", "CDF": "a Box-Jenkins",
}  # fmt: skip


@dataclass(frozen=True)
class Question:
    """Holds the question of a spec in words, and further facts of the spec for a page."""

    title: str
    sentences: tuple[str, ...]  # on the system, the experiment and its goal
    time_unit: str
    closed_loop: bool
    regression: bool
    linearised: bool  # r_u is of first order in the parameters
    asked: frozenset[str]  # the keys under `accuracy`
    family: str  # the type of the spectrum; empty for a given one
    seed: int  # the seed of the signal
    units: str  # the units of the values on the page


def read_question(text: str, file: str = "spec.yaml", verb: str = "solve") -> Question:
    """Return the question of the spec of a run.

    Args:
        text: the spec as resolved (YAML).
        file: its name in messages.
        verb: the command that answered.

    Raises:
        SpecError: `text` is no spec of this version.
    """
    spec = parse_spec(text, file, design=verb != "identify")
    error, stated = spec.accuracy.error, spec.spectrum
    family = "" if stated is None or isinstance(stated, GivenSpectrum) else stated.type
    return Question(
        title=spec.title or "",
        sentences=tuple(_sentences(spec, verb, family)),
        time_unit=spec.time_unit,
        closed_loop=spec.closed_loop,
        regression=spec.plant.kind == "regression",
        linearised=error is None or error.region != "ellipsoid",
        asked=frozenset(name for name, value in spec.accuracy if value is not None),
        family=family,
        seed=spec.signal.seed or 0,
        units=_units(spec),
    )


def _sentences(spec: Spec, verb: str, family: str) -> list[str]:
    stated, uncertainty, accuracy = spec.spectrum, spec.uncertainty, dict(spec.accuracy)
    plants = None if uncertainty is None else uncertainty.scenarios
    listed = len(plants) if isinstance(plants, tuple) else 0
    named = {"input": spec.cost.input_power, "output": spec.cost.output_power}
    named["excitation"] = spec.cost.excitation_power
    known = {
        "spec": spec,
        "verb": verb,
        "family": family,
        "structure": _structure(spec),
        "accuracy": accuracy,
        "added": {name: (one.__doc__ or name).splitlines()[0] for name, one in added("requirements").items()},
        "limits": [name for name, value in spec.limits if value is not None],
        "listed": listed,
        "source": "" if uncertainty is None or listed else uncertainty.stated(*SOURCES)[0],
        "order": stated.order if isinstance(stated, FirSpectrum | PolynomialSpectrum) else None,
        "words": objective(_objective(spec)),
        "costs": {
            name: weight for name, weight in named.items() if isinstance(weight, int | float) and weight
        },
    }
    return sentences("inputdesign_cli.report", "question.txt", "question", known)


def _units(spec: Spec) -> str:
    """Return the units of the numbers in words."""
    named = [f"{name} in {one.unit}" for name, one in (spec.channels or {}).items() if one.unit]
    signals = ", ".join(named) or "signals in the units of the spec"
    clock = f"time in {spec.time_unit}, frequencies in rad/{spec.time_unit}"
    return f"{signals}; powers are mean squares, in the squares of these; {clock}"


def _structure(spec: Spec) -> str:
    plant, noise = spec.plant, spec.noise
    if plant.kind != "polynomial":
        return "a state-space" if plant.kind == "state_space" else "a continuous-time"
    there = {"A": plant.A != (1.0,), "C": noise.C != (1.0,), "D": noise.D != (1.0,), "F": plant.F is not None}
    return _STRUCTURES.get("".join(name for name, holds in there.items() if holds), "a general polynomial")


def _objective(spec: Spec) -> str:
    """Return the `objective.kind` of the result."""
    if spec.goal != "best_accuracy":
        return spec.goal
    errors = ("closed_loop_error", "mean_squared_error")
    asked = (name for name, value in spec.accuracy if name in errors and value is not None)
    return next(asked, spec.accuracy.criterion or "accuracy_factor")
