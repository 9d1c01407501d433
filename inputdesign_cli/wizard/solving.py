"""The verdict on a design in the user's words: whether it is enough, and which length would be.

Every number comes from a design that was computed. `templates/verdict.txt` has the sentences.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping

import numpy as np

from inputdesign_cli.errors import IdesignError
from inputdesign_cli.outcome.results import Result
from inputdesign_cli.outcome.sentences import of_plant, sentences
from inputdesign_cli.specification import Spec
from inputdesign_cli.specification.models.accuracy import DEFAULT_CONFIDENCE
from inputdesign_cli.specification.models.units import SECONDS
from inputdesign_cli.wizard.composing import LEAST, Solve

_BINDING = 0.99  # a limit binds if this share of it is used
_LIMITS = {"rate": "the rate", "amplitude.output": "the output"}
_ROOM, _TRIES = 1.1, 3  # factor on the length that theory asks for; designs that are tried
_LONGER = 2.0  # largest factor on the length from one try to the next
_MINUTE, _HOUR = 60.0, 3600.0


def verdict(spec: Spec, result: Result, solve: Solve, there: float | None = None) -> list[str]:
    """Return whether a design is accurate enough, also at its estimates, and which length would be.

    Args:
        there: the time available, in time_unit, if the experiment is shorter.
    """
    signal, robust, kept = result["signal"], result.get("robust", {}), spec.accuracy.loop
    ratio, amplitude = float(signal["worst_ratio"]), spec.limits.amplitude
    assert amplitude is not None
    allowed = float(np.max(amplitude.input or np.inf))
    shares = signal.get("of_limits", {})
    does = _length_that_does(spec, ratio * _scatter(result), solve)
    loop = next((item["loop"] for item in result.get("requirements", []) if "loop" in item), None)
    known = [*robust.get("floor", {}).get("worst", ()), robust.get("searched", {})]
    # Plants at which the controller has no margin, even if they were known exactly.
    fresh, lost = robust.get("fresh") or {}, len(robust.get("floor", {}).get("lost", ()))
    without_margin = [f"{lost} of the {robust.get('scenarios')} other plants that were tried"] if lost else []
    without_margin += [f"{fresh['lost']} of {fresh['draws']} more"] if fresh.get("lost") else []
    facts = {
        "taken": result["samples"] * spec.sample_time,
        "samples": result["samples"],
        "ratio": ratio,
        "surely": ratio * _scatter(result),
        "does": does,
        "needed": (does or 0) * spec.sample_time,
        "there": there,
        "allowed": allowed,
        "moved": max(signal.get("input_peak", [allowed])),
        "binding": [words for name, words in _LIMITS.items() if shares.get(name, 0.0) >= _BINDING],
        "robust": robust,
        "limits_output": amplitude.output is not None,
        "fresh": fresh,
        "lost": without_margin or ["a plant within what you said"] * ("lost" in robust.get("searched", {})),
        "worst": max((one for one in known if "peak" in one), key=lambda one: one["peak"], default=None),
        "wished": None if kept is None or not loop else decibels(kept.peak),
        "sure": 100.0 * ((None if kept is None else kept.confidence) or DEFAULT_CONFIDENCE),
        "loop_kept": loop,
        "rivals": result.get("foreseen", {}).get("rivals"),
        "warnings": _warnings(result, "few-samples", "loop-moves-every-sample"),
    }
    return _said("verdict", facts, SECONDS[spec.time_unit])


def _said(part: str, facts: Mapping[str, object], clock: float = 1.0) -> list[str]:
    filters: dict[str, Callable[..., str]] = {
        "lasting": lambda time: lasting(time * clock),
        "decibels": decibels,
        "listed": lambda parameters: ", ".join(of_plant(parameters, 3)),
    }
    return sentences("inputdesign_cli.wizard", "verdict.txt", part, facts, filters)


def _scatter(result: Result) -> float:
    """Return the largest factor by which errors grow at estimates from the data of the worst plant."""
    foreseen = result.get("robust", {}).get("estimates", {})
    return max(1.0, float(foreseen.get("largest", 1.0)))


def _warnings(result: Result, *codes: str) -> list[str]:
    """Return the messages of the findings with these codes."""
    return [one["message"] for one in result.get("findings", ()) if one["code"] in codes]


def _length_that_does(spec: Spec, ratio: float, solve: Solve) -> int | None:
    """Return the length in samples of a designed record that meets the requirements, or None.

    Records with few samples per parameter do not count: their estimates scatter more than in theory.

    Args:
        ratio: the ratio of the error to the admissible one, at estimates too; one is enough.
    """
    # Errors fall with the root of the length, except in records hardly longer than the time constant.
    samples = max(int(np.ceil(spec.experiment.samples * ratio**2 * _ROOM)), LEAST)
    for _ in range(_TRIES):
        if ratio <= 1.0 and samples >= spec.experiment.samples:
            return None
        changes = {"limits.duration": None, "experiment.samples": samples, "solver.any_spectrum": False}
        try:
            result = solve(spec.with_(**changes))
        except IdesignError:
            result = {}
        found, few = result.get("signal", {}).get("worst_ratio"), _warnings(result, "few-samples")
        if found is not None and (found := float(found) * _scatter(result)) <= 1.0 and not few:
            return int(result["signal"]["samples"])
        longer = _LONGER if found is None or few else float(np.clip(_ROOM * found**2, _ROOM, _LONGER))
        samples = int(np.ceil(samples * longer))
    return None


def decibels(peak: float) -> str:
    """Write a factor in dB."""
    return f"{20.0 * np.log10(peak):.3g} dB"


def lasting(seconds: float) -> str:
    """Write a time in a usual unit: s, min or h."""
    if seconds >= 2 * _HOUR:
        return f"{seconds / _HOUR:.3g} h"
    return f"{seconds / _MINUTE:.3g} min" if seconds >= 2 * _MINUTE else f"{seconds:.3g} s"
