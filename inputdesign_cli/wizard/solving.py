"""What a design comes to in the user's words: is it enough, what would do, what to apply and to log.

Every number is that of a design that was computed.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np

from inputdesign_cli.errors import IdesignError
from inputdesign_cli.outcome.results import Result, Results
from inputdesign_cli.outcome.shares import per_cent
from inputdesign_cli.specification import Spec
from inputdesign_cli.specification.models.accuracy import DEFAULT_CONFIDENCE
from inputdesign_cli.wizard.composing import LEAST
from inputdesign_cli.wizard.grammar import short
from inputdesign_cli.wizard.spectra import Solve

_MOST_OF = 0.99  # of a limit, which then binds
_LIMITS = {"rate": "the rate", "amplitude.output": "the output"}
_ROOM, _TRIES = 1.1, 6
_LONGER = 2.0  # times as many samples, at most, from one try to the next
_MINUTE, _HOUR = 60.0, 3600.0


def verdict(spec: Spec, result: Result, solve: Solve, there: float | None = None) -> Iterator[str]:
    """Say whether a design is enough for what is asked, and which length would do, at its estimates, too.

    Args:
        there: seconds that may be taken, where the experiment is shorter.
    """
    ratio, taken = float(result["signal"]["worst_ratio"]), result["samples"] * spec.sample_time
    robust, surely = result.get("robust", {}), ratio * _scatter(result)
    yield (
        f"{lasting(taken)} at {_used(spec, result)} is {_enough(ratio, robust)}: the model that it leaves "
        f"errs {ratio:.3g} times as much as is admitted."
    )
    if ratio <= 1.0 < surely:
        yield (
            "But assess judges at the estimated plant, which scatters: where the plant is the worst that "
            f"you allow, 5 % of experiments would give one at which it errs {surely:.3g} times as "
            "much or more, and be called missed."
        )
    if (found := _length_that_does(spec, surely, solve)) is not None:
        needed = found * spec.sample_time
        yield f"{lasting(needed)} would do (a record of {found} samples was designed, and does)."
        if there is not None and taken < needed <= there:
            yield (
                f"Of the {lasting(there)} that there are, {lasting(taken)} were used, which are "
                f"{result['samples']} samples: write duration: {short(needed)} into the spec, and solve it."
            )
    yield from _margins(spec, result, enough=ratio <= 1.0)
    if robust.get("scenarios"):
        yield from _elsewhere(ratio, robust)
    if result.get("foreseen", {}).get("rivals"):
        yield (
            "Another dead time would explain this record nearly as well, and assess may not decide between "
            "the two: say how well you know it (each within 30 %)."
        )


def _enough(ratio: float, robust: Mapping[str, Any]) -> str:
    """Return whether a ratio of errors is enough, and for which of the plants that were tried."""
    fresh = robust.get("fresh") or {}
    if ratio > 1.0:
        return "not enough"
    if _without_margin(robust):
        return "enough wherever this controller has the margin"
    if not fresh.get("missed") or fresh["largest"] * ratio <= 1.0:
        return "enough"
    return (
        f"enough at the plant as you stated it and at {robust['scenarios']} others, but not at "
        "every one within what you said of it"
    )


def _without_margin(robust: Mapping[str, Any]) -> list[str]:
    """Return at how many plants of which the controller has no margin even if they were known exactly."""
    fresh, lost = robust.get("fresh") or {}, len(robust.get("floor", {}).get("lost", ()))
    said = [f"{lost} of the {robust.get('scenarios')} other plants that were tried"] if lost else []
    said += [f"{fresh['lost']} of {fresh['draws']} more"] if fresh.get("lost") else []
    return said or ["a plant within what you said"] * ("lost" in robust.get("searched", {}))


def _elsewhere(ratio: float, robust: Mapping[str, Any]) -> Iterator[str]:
    """Say at which plants errors and limits were tried, and how that ended."""
    searched, fresh = robust.get("searched"), robust.get("fresh") or {}
    number = robust["scenarios"] - (searched or {}).get("added", 0)
    at = f"at the plant as you stated it and at {number} others within what you said of it"
    if searched:
        at = at.replace(" and", ",") + f", and at the worst one that a search found ({_values(searched)})"
    yield f"This was tried {at}."
    if not fresh:
        return
    worst, draws, peaks = max(fresh["largest"], 1.0) * ratio, fresh["draws"], fresh.get("beyond_limits")
    if fresh["missed"]:
        yield (
            f"Of {draws} more of them {fresh['missed']} would be known less well: there it errs up to "
            f"{worst:.3g} times as much as is admitted, which is "
            f"{'enough, too' if worst <= 1.0 else 'too much'}."
        )
    else:
        yield f"Nor is it worse at {draws} more of them."
    if peaks:
        beyond = f", and at {draws} more; noise comes on top of that."
        if peaks["draws"]:
            share = f"up to {per_cent(peaks['largest'])} of a limit. Leave some room."
            beyond = f", without noise; at {peaks['draws']} of {draws} more they go beyond, {share}"
        yield f"Input and output stay within your limits {at}{beyond}"


def _values(plant: Mapping[str, Any]) -> str:
    return ", ".join(f"{name} {value:.3g}" for name, value in plant["parameters"].items())


def _decibels(peak: float) -> str:
    return f"{20.0 * np.log10(peak):.3g} dB"


def _margins(spec: Spec, result: Result, *, enough: bool) -> Iterator[str]:
    """Say what is promised of the loop where the record is enough, and where the promise ends."""
    kept, robust = spec.accuracy.loop, result.get("robust", {})
    loop = next((item["loop"] for item in result.get("requirements", []) if "loop" in item), None)
    if kept is None or not loop:
        return
    wished, lost = _decibels(kept.peak), _without_margin(robust)
    if lost:
        known = [*robust.get("floor", {}).get("worst", ()), robust.get("searched", {})]
        worst = max((one for one in known if "peak" in one), key=lambda one: one["peak"], default=None)
        example = ""
        if worst is not None:
            example = f", such as {_values(worst)}, where |S| reaches {_decibels(worst['peak'])}"
        yield (
            f"But at {' and at '.join(lost)} this controller does not keep {wished} even if the plant "
            f"were known exactly{example}. No experiment changes that: if the true plant is one of these, "
            "the verdict of assess will be undecided. A slower controller (a smaller Kp), one that is tuned "
            "to the plant, or a smaller margin helps."
        )
    if enough:
        sure = 100.0 * (kept.confidence or DEFAULT_CONFIDENCE)
        yield (
            f"{'At the other plants that were tried the' if lost else 'The'} peak of |S| of the loop stays "
            f"below {wished} for every plant within the error of the model (r_u, to first order, {sure:.3g} "
            f"% confidence): a gain margin of {loop['gain_margin']:.3g} and a phase margin of "
            f"{loop['phase_margin']:.3g} degrees are kept."
        )


def _used(spec: Spec, result: Result) -> str:
    """Return how far the input may move, and does."""
    amplitude = spec.limits.amplitude
    assert amplitude is not None
    allowed = float(np.max(amplitude.input or np.inf))
    moved, limits = max(result["signal"].get("input_peak", [allowed])), result["signal"].get("of_limits", {})
    means = f"plus/minus {short(allowed)}"
    if moved >= _MOST_OF * allowed:
        return means
    why = [_LIMITS[name] for name, share in limits.items() if name in _LIMITS and share >= _MOST_OF]
    binding = f"; {' and '.join(why)} {'is' if len(why) == 1 else 'are'} at the limit" if why else ""
    return f"{means} (it moves by {moved:.3g} at most{binding})"


def _scatter(result: Result) -> float:
    """Return how many times as large errors are at estimates from the data of the worst plant."""
    foreseen = result.get("robust", {}).get("estimates", {})
    return max(1.0, float(foreseen.get("largest", 1.0)))


def _length_that_does(spec: Spec, ratio: float, solve: Solve) -> int | None:
    """Return the samples of a record that was designed and meets what is asked, or None.

    Args:
        ratio: of errors, at estimates too; one is enough.
    """
    # Errors fall with the root of the length, but not in records hardly longer than the plant is slow.
    samples = max(int(np.ceil(spec.experiment.samples * ratio**2 * _ROOM)), LEAST)
    for _ in range(_TRIES):
        if ratio <= 1.0 and samples >= spec.experiment.samples:
            return None
        changes = {"limits.duration": None, "experiment.samples": samples, "solver.any_spectrum": False}
        try:
            result = solve(spec.with_(**changes))
        except IdesignError:
            result = {}
        found = result.get("signal", {}).get("worst_ratio")
        if found is not None and (found := float(found) * _scatter(result)) <= 1.0:
            return int(result["signal"]["samples"])
        longer = _LONGER if found is None else float(np.clip(_ROOM * found**2, _ROOM, _LONGER))
        samples = int(np.ceil(samples * longer))
    return None


def lasting(seconds: float) -> str:
    """Write a time in the unit in which one says it."""
    if seconds >= 2 * _HOUR:
        return f"{seconds / _HOUR:.3g} h"
    return f"{seconds / _MINUTE:.3g} min" if seconds >= 2 * _MINUTE else f"{seconds:.3g} s"


def to_log(spec: Spec, results: Results, file: str) -> list[str]:
    """Return what to apply and to record, and how the record is judged."""
    applied, caused = (
        [name for name in results.tables[table].columns if re.fullmatch(r"[ruy]\d+", name)]
        for table in ("signal", "predicted_output")
    )
    inputs, outputs = [f"u{name[1:]}" for name in applied], [name for name in caused if name.startswith("y")]
    # A coarse converter holds none but levels of its own, and the record swings about one of these.
    point_of = results.result.get("signal", {}).get("operating_point", spec.signal.offset or 0.0)
    levels = np.broadcast_to(np.asarray(point_of, dtype=float), len(inputs))
    known = [f"{name}={level:g}" for name, level in zip(inputs, levels, strict=True)]
    apply, references = "apply signal.csv", []
    if any(name.startswith("r") for name in applied):
        apply += " as r in u = r - C y (C y counted from rest; r is no position of the actuator)"
        into, listed = "r has no level", " and ".join(f"{level:g}" for level in levels)
        if np.any(levels):
            into = f"r in signal.csv has the level {listed} of the input in it"
        references = [
            f"{into}: while y rests, u = r. Log u as it is, level included; r need not be logged, and where "
            "it is, it is logged as applied: its level does not matter to assess."
        ]
    return [
        f"Bring the plant to rest at the operating point, {apply}, and log "
        f"{', '.join(['time', *inputs, *outputs[:-1]])} and {outputs[-1]} every {short(spec.sample_time)} "
        f"{spec.time_unit}.",
        *references,
        f"Then: idesign assess {file} log.csv --operating-point "
        f"{','.join([*known, *(f'{name}=REST' for name in outputs)])}   (REST: the level of "
        f"{' and '.join(outputs)} before it began)",
    ]
