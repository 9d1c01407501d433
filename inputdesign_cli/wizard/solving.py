"""What a draft comes to, in the user's words; every number is that of a design that was computed."""

from __future__ import annotations

import re
from dataclasses import dataclass

import numpy as np

from inputdesign_cli.errors import IdesignError
from inputdesign_cli.runs.results import Result, Results
from inputdesign_cli.specification import Spec
from inputdesign_cli.wizard.composing import LEAST
from inputdesign_cli.wizard.phrases import short
from inputdesign_cli.wizard.spectra import Solve

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


def verdict(spec: Spec, result: Result, solve: Solve) -> Verdict:
    """What is to be told, with a length that would do, which is tried."""
    ratio, there = float(result["signal"]["worst_ratio"]), result["samples"] * spec.sample_time
    means = f"{lasting(there)} at plus/minus {short(_peak(spec))}"
    times = f"the model that it leaves errs {ratio:.3g} times as much as is admitted"
    found = _length_that_does(spec, ratio, solve)
    said = [f"{means} is enough: {times}." if ratio <= 1.0 else f"{means} is not enough: {times}."]
    if found is not None:
        would = f"{lasting(found * spec.sample_time)} would do"
        said.append(f"{would} (a record of {found} samples was designed, and does).")
    loop = next((item["loop"] for item in result.get("requirements", []) if "loop" in item), None)
    kept = spec.accuracy.loop
    if kept is not None and loop and (ratio <= 1.0):
        peak = 20.0 * np.log10(kept.peak)
        said.append(
            f"The peak of |S| of the loop stays below {peak:.3g} dB for every plant that the data do not "
            f"rule out (95 % confidence): a gain margin of {loop['gain_margin']:.3g} and a phase margin of "
            f"{loop['phase_margin']:.3g} degrees are kept."
        )
    drawn = result.get("robust", {}).get("scenarios")
    if drawn:
        said.append(
            f"This was tried at the plant as you stated it and at {drawn} others within what you said of it."
        )
    return Verdict(ratio, tuple(said))


def _length_that_does(spec: Spec, ratio: float, solve: Solve) -> int | None:
    """Samples of a record that was designed and meets what is asked; None where none was found."""
    # Errors fall with the root of the length, but not in records hardly longer than the plant is slow.
    samples = max(int(np.ceil(spec.experiment.samples * ratio**2 * _ROOM)), LEAST)
    for _ in range(_TRIES):
        changes = {"limits.duration": None, "experiment.samples": samples, "solver.any_spectrum": False}
        try:
            result = solve(spec.with_(**changes))
        except IdesignError:
            result = {}
        found = result.get("signal", {}).get("worst_ratio")
        if found is not None and found <= 1.0:
            return int(result["signal"]["samples"])
        longer = _LONGER if found is None else float(np.clip(_ROOM * float(found) ** 2, _ROOM, _LONGER))
        samples = int(np.ceil(samples * longer))
        if ratio <= 1.0 and samples >= spec.experiment.samples:
            return None
    return None


def to_log(spec: Spec, results: Results, file: str) -> list[str]:
    """What to record, and how it is judged."""
    applied, caused = (
        [name for name in results.tables[table].columns if re.fullmatch(r"[ruy]\d+", name)]
        for table in ("signal", "predicted_output")
    )
    numbers = [name[1:] for name in applied]
    inputs, outputs = [f"u{n}" for n in numbers], [name for name in caused if name.startswith("y")]
    levels = np.broadcast_to(np.asarray(spec.signal.offset or 0.0, dtype=float), len(inputs))
    references = any(name.startswith("r") for name in applied)
    what = ", ".join(["time", *inputs, *outputs[:-1]])
    known = [f"{name}={level:g}" for name, level in zip(inputs, levels, strict=True)]
    point = ",".join([*known, *(f"{name}=REST" for name in outputs)])
    apply = "apply signal.csv"
    if references:
        apply = (
            "apply signal.csv as r in u = r - C y (C y counted from rest; r is no position of the actuator)"
        )
    return [
        f"Bring the plant to rest at the operating point, {apply}, and log "
        f"{what} and {outputs[-1]} every {short(spec.sample_time)} {spec.time_unit}.",
        f"Then: idesign assess {file} log.csv --operating-point {point}   (REST: the level of "
        f"{' and '.join(outputs)} before it began)",
    ]


def lasting(seconds: float) -> str:
    """A time as one says it."""
    if seconds >= 2 * _HOUR:
        return f"{seconds / _HOUR:.3g} h"
    return f"{seconds / _MINUTE:.3g} min" if seconds >= 2 * _MINUTE else f"{seconds:.3g} s"


def _peak(spec: Spec) -> float:
    amplitude = spec.limits.amplitude
    assert amplitude is not None
    return float(np.max(amplitude.input or np.inf))
