"""What a draft comes to, in the user's words; every number is that of a design that was computed."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from inputdesign_cli.errors import IdesignError
from inputdesign_cli.outcome.results import Result
from inputdesign_cli.outcome.shares import per_cent
from inputdesign_cli.specification import Spec
from inputdesign_cli.wizard.composing import LEAST
from inputdesign_cli.wizard.margins import has_room_everywhere, margins_kept
from inputdesign_cli.wizard.phrases import short
from inputdesign_cli.wizard.spectra import Solve

_MOST_OF = 0.99  # of a limit, which then binds
_LIMITS = {"rate": "the rate", "amplitude.output": "the output"}
_ROOM, _TRIES = 1.1, 6
_LONGER = 2.0  # times as many samples, at most, from one try to the next
_MINUTE, _HOUR = 60.0, 3600.0


@dataclass(frozen=True)
class Verdict:
    """How the best record within the means stands to what is asked: `ratio` of errors, one is enough."""

    ratio: float
    sentences: tuple[str, ...]

    @property
    def enough(self) -> bool:
        """Whether the means are enough."""
        return self.ratio <= 1.0


def verdict(spec: Spec, result: Result, solve: Solve, there: float | None = None) -> Verdict:
    """What is to be told, with a length that would do at the estimate too, which is tried.

    Args:
        there: seconds that may be taken, where the experiment is shorter.
    """
    ratio, taken = float(result["signal"]["worst_ratio"]), result["samples"] * spec.sample_time
    means = f"{lasting(taken)} at {_used(spec, result)}"
    times = f"the model that it leaves errs {ratio:.3g} times as much as is admitted"
    surely = ratio * _scatter(result)
    found = _length_that_does(spec, surely, solve)
    said = [f"{means} is {_for_which(result, ratio)}: {times}."]
    if ratio <= 1.0 < surely:
        said.append(
            "But assess judges at the plant that the data tell, and that scatters: where the plant is the "
            "worst that you allow, 5 % of such experiments would tell one at which it errs "
            f"{surely:.3g} times as much or more, and be called missed."
        )
    if found is not None:
        needed = found * spec.sample_time
        would = f"{lasting(needed)} would do"
        said.append(f"{would} (a record of {found} samples was designed, and does).")
        if there is not None and taken < needed <= there:
            said.append(
                f"Of the {lasting(there)} that there are, {lasting(taken)} were used, which are "
                f"{result['samples']} samples: write duration: {short(needed)} into the spec, and solve it."
            )
    said += margins_kept(spec, result, enough=ratio <= 1.0)
    return Verdict(ratio, (*said, *_elsewhere(result, ratio), *_open_dead_times(result)))


def _for_which(result: Result, ratio: float) -> str:
    """Enough or not, and for which of the plants that were tried."""
    if ratio > 1.0:
        return "not enough"
    robust = result.get("robust", {})
    if not has_room_everywhere(robust):
        return (
            "enough wherever this controller has the margin with room to spare, as it does not at every plant"
        )
    fresh = robust.get("fresh") or {"missed": 0, "largest": 0.0}
    if not fresh["missed"] or fresh["largest"] * ratio <= 1.0:
        return "enough"
    return (
        f"enough at the plant as you stated it and at {robust['scenarios']} others, but not at every one "
        "within what you said of it"
    )


def _used(spec: Spec, result: Result) -> str:
    """How far the input is allowed to move, and does."""
    allowed, moved = _peak(spec), max(result["signal"].get("input_peak", [_peak(spec)]))
    told = f"plus/minus {short(allowed)}"
    if moved >= _MOST_OF * allowed:
        return told
    limits = result["signal"].get("of_limits", {})
    why = [_LIMITS[name] for name, share in limits.items() if name in _LIMITS and share >= _MOST_OF]
    binding = f"; {' and '.join(why)} {'is' if len(why) == 1 else 'are'} at the limit" if why else ""
    return f"{told} (it moves by {moved:.3g} at most{binding})"


def _elsewhere(result: Result, ratio: float) -> list[str]:
    """What is known of other plants within what was said."""
    robust = result.get("robust", {})
    if not robust.get("scenarios"):
        return []
    searched = robust.get("searched")
    others = f"{robust['scenarios'] - (searched or {}).get('added', 0)} others within what you said of it"
    at = f"at the plant as you stated it and at {others}"
    if searched:
        values = ", ".join(f"{name} {value:.3g}" for name, value in searched["parameters"].items())
        at = (
            f"at the plant as you stated it, at {others}, and at the worst one that a search found ({values})"
        )
    said, fresh = [f"This was tried {at}."], robust.get("fresh")
    if not fresh:
        return said
    worst, draws = max(fresh["largest"], 1.0) * ratio, fresh["draws"]
    if not fresh["missed"]:
        said.append(f"Nor is it worse at {draws} more of them.")
    else:
        enough = "which is enough, too" if worst <= 1.0 else "which is too much"
        said.append(
            f"Of {draws} more of them {fresh['missed']} would be known less well: there it errs up to "
            f"{worst:.3g} times as much as is admitted, {enough}."
        )
    peaks = fresh.get("beyond_limits")
    if peaks and peaks["draws"]:
        said.append(
            f"Input and output stay within your limits {at}, without noise; at {peaks['draws']} of {draws} "
            f"more they go beyond, up to {per_cent(peaks['largest'])} of a limit. Leave some room."
        )
    elif peaks:
        said.append(
            f"Input and output stay within your limits {at}, and at {draws} more; noise comes on top of that."
        )
    return said


def _scatter(result: Result) -> float:
    """How many times as large errors are at plants that data of the worst one may tell."""
    foreseen = result.get("robust", {}).get("estimates", {})
    return max(1.0, float(foreseen.get("largest", 1.0)))


def _open_dead_times(result: Result) -> list[str]:
    """Where the record would not tell dead times apart."""
    if not result.get("foreseen", {}).get("rivals"):
        return []
    return [
        "Another dead time would explain such a record nearly as well, and assess may not decide between the "
        "two: say how well you know it (each within 30 %)."
    ]


def _length_that_does(spec: Spec, ratio: float, solve: Solve) -> int | None:
    """Samples of a record that was designed and meets what is asked; None where none was found.

    Args:
        ratio: of errors, at estimates too; one is enough.
    """
    # Errors fall with the root of the length, but not in records hardly longer than the plant is slow.
    samples = max(int(np.ceil(spec.experiment.samples * ratio**2 * _ROOM)), LEAST)
    if ratio <= 1.0 and samples >= spec.experiment.samples:
        return None
    for _ in range(_TRIES):
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
        if ratio <= 1.0 and samples >= spec.experiment.samples:
            return None
    return None


def lasting(seconds: float) -> str:
    """A time as one says it."""
    if seconds >= 2 * _HOUR:
        return f"{seconds / _HOUR:.3g} h"
    return f"{seconds / _MINUTE:.3g} min" if seconds >= 2 * _MINUTE else f"{seconds:.3g} s"


def _peak(spec: Spec) -> float:
    amplitude = spec.limits.amplitude
    assert amplitude is not None
    return float(np.max(amplitude.input or np.inf))
