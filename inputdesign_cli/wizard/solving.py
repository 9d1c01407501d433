"""What a design comes to in the user's words: is it enough, what would do, what to apply and to log.

Every number is that of a design that was computed.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from inputdesign_cli.errors import IdesignError
from inputdesign_cli.outcome.results import Json, Result, Results
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


@dataclass(frozen=True)
class Verdict:
    """What is said of the best record within the means; one is enough for the `ratio` of its errors."""

    ratio: float
    sentences: tuple[str, ...]

    @property
    def enough(self) -> bool:
        """Whether the means are enough."""
        return self.ratio <= 1.0


def verdict(spec: Spec, result: Result, solve: Solve, there: float | None = None) -> Verdict:
    """Compare a design with what is asked, and look for a length that would do at its estimates, too.

    Args:
        there: seconds that may be taken, where the experiment is shorter.
    """
    ratio, taken = float(result["signal"]["worst_ratio"]), result["samples"] * spec.sample_time
    others, surely = _Others(result.get("robust", {})), ratio * _scatter(result)
    said = [
        f"{lasting(taken)} at {_used(spec, result)} is {others.enough(ratio)}: the model that it leaves errs "
        f"{ratio:.3g} times as much as is admitted."
    ]
    if ratio <= 1.0 < surely:
        said.append(
            "But assess judges at the estimated plant, which scatters: where the plant is the worst that "
            f"you allow, 5 % of experiments would give one at which it errs {surely:.3g} times as "
            "much or more, and be called missed."
        )
    if (found := _length_that_does(spec, surely, solve)) is not None:
        needed = found * spec.sample_time
        said.append(f"{lasting(needed)} would do (a record of {found} samples was designed, and does).")
        if there is not None and taken < needed <= there:
            said.append(
                f"Of the {lasting(there)} that there are, {lasting(taken)} were used, which are "
                f"{result['samples']} samples: write duration: {short(needed)} into the spec, and solve it."
            )
    said += [*_margins(spec, result, others, ratio <= 1.0), *others.sentences(ratio)]
    if result.get("foreseen", {}).get("rivals"):
        said.append(
            "Another dead time would explain this record nearly as well, and assess may not decide between "
            "the two: say how well you know it (each within 30 %)."
        )
    return Verdict(ratio, tuple(said))


@dataclass(frozen=True)
class _Others:
    """What is known of other plants within what was said: the entry `robust` of a result."""

    robust: Mapping[str, Json]

    @property
    def fresh(self) -> Mapping[str, Json]:
        """How the design does at plants that it was not designed for."""
        return self.robust.get("fresh") or {}

    @property
    def lost(self) -> list[str]:
        """At how many plants of which the controller has no margin even if they were known exactly."""
        others, fresh = self.robust.get("scenarios"), self.fresh
        known = {
            f"{{}} of the {others} other plants that were tried": len(self._floor["lost"]),
            f"{{}} of {fresh.get('draws')} more": fresh.get("lost", 0),
        }
        said = [text.format(number) for text, number in known.items() if number]
        return said or ["a plant within what you said"] * ("lost" in self.robust.get("searched", {}))

    @property
    def barely(self) -> int:
        """The number of plants at which the controller has a margin, and r_adm is the floor."""
        raised, lost = (len(self._floor[key]) + int(self.fresh.get(key, 0)) for key in ("raised", "lost"))
        return raised - lost

    @property
    def _floor(self) -> Mapping[str, Json]:
        return {"raised": [], "lost": [], "worst": []} | self.robust.get("floor", {})

    def enough(self, ratio: float) -> str:
        """Return whether a ratio of errors is enough, and for which of the plants that were tried."""
        if ratio > 1.0:
            return "not enough"
        if self.lost or self.barely:
            room = "this controller has the margin with room to spare, as it does not at every plant"
            return f"enough wherever {room}"
        if not self.fresh.get("missed") or self.fresh["largest"] * ratio <= 1.0:
            return "enough"
        return (
            f"enough at the plant as you stated it and at {self.robust['scenarios']} others, but not at "
            "every one within what you said of it"
        )

    def sentences(self, ratio: float) -> list[str]:
        """Return at which plants errors and limits were tried, and how that ended."""
        if not self.robust.get("scenarios"):
            return []
        searched, fresh = self.robust.get("searched"), self.fresh
        number = self.robust["scenarios"] - (searched or {}).get("added", 0)
        at = f"at the plant as you stated it and at {number} others within what you said of it"
        if searched:
            at = at.replace(" and", ",") + f", and at the worst one that a search found ({_values(searched)})"
        said = [f"This was tried {at}."]
        if not fresh:
            return said
        worst, draws, peaks = max(fresh["largest"], 1.0) * ratio, fresh["draws"], fresh.get("beyond_limits")
        if fresh["missed"]:
            said.append(
                f"Of {draws} more of them {fresh['missed']} would be known less well: there it errs up to "
                f"{worst:.3g} times as much as is admitted, which is "
                f"{'enough, too' if worst <= 1.0 else 'too much'}."
            )
        else:
            said.append(f"Nor is it worse at {draws} more of them.")
        if peaks:
            beyond = f", and at {draws} more; noise comes on top of that."
            if peaks["draws"]:
                beyond = (
                    f", without noise; at {peaks['draws']} of {draws} more they go beyond, up to "
                    f"{per_cent(peaks['largest'])} of a limit. Leave some room."
                )
            said.append(f"Input and output stay within your limits {at}{beyond}")
        return said

    def no_margin(self, wished: str) -> str:
        """Return that the controller does not keep the margin at some plants, and the worst of them."""
        known = [*self._floor["worst"], self.robust.get("searched", {})]
        worst = max((one for one in known if "peak" in one), key=lambda one: one["peak"], default=None)
        example = ""
        if worst is not None:
            example = f", such as {_values(worst)}, where |S| reaches {_decibels(worst['peak'])}"
        return (
            f"But at {' and at '.join(self.lost)} this controller does not keep {wished} even if the plant "
            f"were known exactly{example}. No experiment changes that: if the true plant is one of these, "
            "the verdict of assess will be undecided. A slower controller (a smaller Kp), one that is tuned "
            "to the plant, or a smaller margin helps."
        )


def _values(plant: Mapping[str, Json]) -> str:
    return ", ".join(f"{name} {value:.3g}" for name, value in plant["parameters"].items())


def _decibels(peak: float) -> str:
    return f"{20.0 * np.log10(peak):.3g} dB"


def _margins(spec: Spec, result: Result, others: _Others, enough: bool) -> list[str]:
    """Return what is promised of the loop where the record is `enough`, and where the promise ends."""
    kept = spec.accuracy.loop
    loop = next((item["loop"] for item in result.get("requirements", []) if "loop" in item), None)
    if kept is None or not loop:
        return []
    wished, said = _decibels(kept.peak), list[str]()
    if others.lost:
        said.append(others.no_margin(wished))
    if enough:
        sure = 100.0 * (kept.confidence or DEFAULT_CONFIDENCE)
        where = "At the other plants that were tried the" if others.lost or others.barely else "The"
        said.append(
            f"{where} peak of |S| of the loop stays below {wished} for every plant within the error of the "
            f"model (r_u, to first order, {sure:.3g} % confidence): "
            f"a gain margin of {loop['gain_margin']:.3g} and a phase margin of {loop['phase_margin']:.3g} "
            "degrees are kept."
        )
    if others.barely:
        said.append(
            f"At {others.barely} of the plants that were tried the controller has hardly any room left. "
            "There the error is held against a share of the room at the plant as you stated it, and whether "
            "the margin is kept this experiment may leave open."
        )
    return said


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
