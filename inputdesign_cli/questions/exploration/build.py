"""A model that was found in a log -> a complete spec, commented, and the task of `identify` on it."""

from __future__ import annotations

import json
import textwrap
from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from inputdesign_cli.errors import SpecError, bad_spec
from inputdesign_cli.explore.fits import output_error_form
from inputdesign_cli.explore.joint import Found
from inputdesign_cli.findings.prepared_records import name_and_unit
from inputdesign_cli.identification.checks import signal_name
from inputdesign_cli.outcome.model_words import blocks_of
from inputdesign_cli.plant import Model
from inputdesign_cli.plant.loop import INTEGRATES
from inputdesign_cli.questions.assessment.build import build_identification
from inputdesign_cli.questions.assessment.identify import Identification
from inputdesign_cli.questions.assessment.outcome import determined
from inputdesign_cli.questions.building.system import build_model
from inputdesign_cli.records import Record
from inputdesign_cli.specification import Spec, parse_spec
from inputdesign_cli.specification.models.experiment import is_label

_MOST_SAMPLES = 100_000
_DIGITS = 6
_DOUBTED = "On a model that deserves no trust: "
_UNTRUSTED = "No model of this record deserves trust, and no design on this one: "
_LOOP = (
    "The inputs seem to answer the outputs, as in a loop. Then identify and assess need its controller, "
    "experiment: {controller: {numerator: [..], denominator: [..]}}; solve then designs in the loop."
)


_USUAL = {
    "accuracy": [
        "D: the most informative experiment within the limits. For an accuracy at the least cost write",
        "  accuracy: {model_error: {relative: 0.05, confidence: 0.95}}",
    ],
    "limits": ["As in the record: mean squares about the mean, and amplitudes that keep to its range."],
    "spectrum": ["The family of spectra to search, and the signal to apply about the middle of the range."],
}
# Sections of a spec that ask for a design, whatever the plant.
_WISHES = (
    *("experiment", "cost", "accuracy", "objective", "limits"),
    *("spectrum", "signal", "solver", "figures"),
)


@dataclass(frozen=True)
class Asked:
    """Holds what a spec asks for, by its sections, and the unit of its times."""

    time_unit: str
    sections: Mapping[str, Any]
    title: str = ""
    channels: Mapping[str, Mapping[str, str]] = field(default_factory=dict)
    drifts: bool = False  # whether its noise drifts
    integrates: bool = False  # whether its plant integrates

    @classmethod
    def of(cls, spec: Spec) -> Asked:
        """Return what a spec asks for, whatever the plant."""
        sections = {key: part for key, part in spec.content.items() if key in _WISHES}
        match sections:
            case {"experiment": {"prior": _, **rest}}:  # the prior has other parameters
                sections["experiment"] = rest
        integrates = False
        with suppress(SpecError):  # a plant that no log is compared with
            integrates = bool(np.any(np.abs(build_model(spec).plant_points) < INTEGRATES))
        drifts = bool(np.any(spec.noise.drift))
        named = {one: own.model_dump(exclude_none=True) for one, own in (spec.channels or {}).items()}
        return cls(spec.time_unit, sections, spec.title or "", named, drifts, integrates)

    def check_unit(self, time_unit: str) -> None:
        """Raise `SpecError` (`data-wrong-unit`) unless a log counts times in the same unit."""
        if self.time_unit != time_unit:
            message = f"the spec counts times in {self.time_unit}, and the log in {time_unit}"
            raise bad_spec("data-wrong-unit", message, hint=f"write it in {time_unit}", key="time_unit")


def spec_text(
    log: Record,
    found: Found,
    sources: Sequence[Path],
    reasons: Sequence[str] = (),
    *,
    loop: bool = False,
    asked: Asked | None = None,
) -> str:
    """Return a spec that `idesign solve` accepts: the model, and the most informative input of that power.

    Args:
        reasons: why the model deserves no trust.
        loop: whether inputs seem to answer the outputs.
        asked: the sections on the design of another spec, in place of that input.
    """
    source = " ".join(" and ".join(path.name for path in sources).split())
    blocks = blocks_of(found.model)
    blocks["noise"], drawn = _inside(blocks["noise"], len(log.y))
    comments = {
        "title": [
            f"Written by `idesign explore` from {source}. `idesign solve FILE` designs what it asks; every "
            "entry can be changed here or by --set key=value.",
            *(_UNTRUSTED + one for one in reasons),
            *([_LOOP] if loop else []),
        ],
        "plant": _of_the_model(log, found),
        "noise": [
            f"Roots of {one} on the circle were drawn into it by one in {len(log.y)}." for one in drawn
        ],
        **_USUAL,
    }
    if asked is None or not asked.sections:
        asked = _as_in_the_record(log, integrates=bool(found.integrates))
    else:
        comments = {key: comments[key] for key in ("title", "plant", "noise")}
        comments["estimate"] = ["How well the record determines the parameters; it changes no design."]
        if "covariance" in (known := determined(found.estimate)):
            blocks["estimate"] = known
        if asked.drifts and "drift" not in blocks["noise"]:
            comments["noise"].append("The given spec lets the noise drift. This record shows no sign of it.")
        comments[next(iter(asked.sections))] = ["From here on as in the spec that explore was given."]
    # The log names its columns; the units come from the spec that explore was given.
    stated, own = dict(asked.channels), _channels(log)
    named = {one: {**stated.get(one, {}), **own.get(one, {})} for one in sorted({*stated, *own})}
    sections = {
        "title": f"{_DOUBTED * bool(reasons)}{asked.title or f'The next experiment after {source}'}",
        "sample_time": log.step,
        "time_unit": log.time_unit,
        **({"channels": named} if named else {}),
        **blocks,
        **asked.sections,
    }
    return _commented(sections, comments)


def _of_the_model(log: Record, found: Found) -> list[str]:
    """Return comments on the model: its form, and channels whose names a spec cannot have."""
    families = ", ".join(
        f"{signal_name('y', i, found.model.outputs)}: {c.orders.family}" for i, c in enumerate(found.taken)
    )
    kind = f"plants in s, times in {log.time_unit}, inputs held between samples"
    if not any(c.orders.physical for c in found.taken):
        kind = "A y = (B/F) u + (C/D) e, polynomials in q^-1"
    named = _channels(log)
    others = [
        f"{x} is {' '.join(name.split())}" for x, name in log.names.items() if x != "time" and x not in named
    ]
    return [f"Known from the record: {kind} ({families}).", *([", ".join(others)] if others else [])]


def _as_in_the_record(log: Record, *, integrates: bool) -> Asked:
    """Ask for the most informative input that has the power and the range of a record."""
    power, level, width = _usual(log)
    spectrum, signal = {"type": "fir", "order": 20}, {"type": "filtered_noise", "seed": 1, "offset": level}
    if integrates:  # power at frequency zero determines the gain of an integrator without end
        spectrum, signal = {"type": "multisine", "lines": 100}, signal | {"type": "multisine"}
    sections = {
        "experiment": {"samples": min(len(log.y), _MOST_SAMPLES)},
        "accuracy": {"criterion": "D"},
        "limits": {"input_power": power, "amplitude": width},
        "spectrum": spectrum,
        "signal": signal,
    }
    return Asked(log.time_unit, sections)


def _channels(log: Record) -> dict[str, dict[str, str]]:
    """Return names and units of the channels in the header of the log, where a spec may have them."""
    found = {}
    for channel, header in log.names.items():
        name, unit = name_and_unit(" ".join(header.split()))
        stated = {"name": name, "unit": unit} if unit else {"name": name}
        own = channel[0] in "uy" and name.lower() not in (channel, channel[0]) and not name.isdigit()
        if own and all(is_label(text) for text in stated.values()):
            found[channel] = stated
    return found


def _usual(log: Record) -> list[float | list[float]]:
    """Return power, middle and half of the range of every input; one at rest gets the largest of others."""
    power, low, high = log.u.var(axis=0), log.u.min(axis=0), log.u.max(axis=0)
    power, half = (np.where(x > 0.0, x, x.max()) for x in (power, 0.5 * (high - low)))
    # Six digits of the distance that the input moves: a level far from zero takes more.
    rows = []
    for values, scale in ((power, power), (0.5 * (low + high), half), (half, half)):
        places = [_DIGITS - 1 - int(np.floor(np.log10(x))) for x in scale]
        rows.append([round(float(x), n) for x, n in zip(values, places, strict=True)])
    return [row[0] if len(row) == 1 else row for row in rows]


def _commented(sections: Mapping[str, Any], comments: Mapping[str, Sequence[str]]) -> str:
    """Return sections as YAML, the entries of each on lines of their own, under comments."""
    lines = list[str]()
    for key, value in sections.items():
        lines += [""] if key in comments else []
        for text in comments.get(key, ()):
            lines += textwrap.wrap(text, 110, initial_indent="# ", subsequent_indent="#   ")
        if isinstance(value, Mapping):
            lines += [f"{key}:", *(f"  {name}: {json.dumps(entry)}" for name, entry in value.items())]
        else:
            lines.append(f"{key}: {json.dumps(value)}")
    return "\n".join(lines[1:]) + "\n"


def _inside(noise: Mapping[str, Any], samples: int) -> tuple[dict[str, Any], list[str]]:
    """Return the block with roots of C and D not too near to the unit circle, and the letters that changed.

    Their modulus is at most 1 - 1 / samples: a record of this length cannot resolve nearer roots. One factor
    scales all roots of a polynomial.
    """
    drawn = dict(noise)
    for letter in {"C", "D"} & noise.keys():
        several = isinstance(noise[letter][0], list)
        own = []
        for row in noise[letter] if several else [noise[letter]]:
            radius = float(np.abs(np.roots(row)).max(initial=1e-9))
            share = min((1.0 - 1.0 / samples) / radius, 1.0)
            own.append([float(c * share**k) for k, c in enumerate(row)])
        drawn[letter] = own if several else own[0]
    return drawn, sorted(letter for letter in noise if drawn[letter] != noise[letter])


def build_explored(text: str) -> Identification:
    """Return the identification task of a spec that was written for a log."""
    return build_identification(parse_spec(text, "spec.yaml"))


def model_to_judge(spec: Spec) -> Model:
    """Return the model of a spec that is to be judged by data.

    Raises:
        SpecError: it is neither of polynomials nor of transfer functions that are sampled.
    """
    model = build_model(spec)
    try:
        output_error_form(model)
    except TypeError:
        raise bad_spec(
            "not-supported",
            "models in state space, and in s without sample: zoh, cannot be judged by data in this version",
            hint="idesign identify DATA --spec MODEL estimates them anew and shows the fit",
            key="plant",
        ) from None
    return model
