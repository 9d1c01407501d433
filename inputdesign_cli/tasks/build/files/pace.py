"""The sample time that a file of arrays states beside its signals."""

from __future__ import annotations

from dataclasses import dataclass

from inputdesign_cli.tasks.build.files.cells import is_number
from inputdesign_cli.tasks.build.files.isolated import NOTHING, Arrays

_SAMPLE_TIMES = ("ts", "sample_time", "dt")
_UNITS = ("timeunit", "time_unit")


@dataclass(frozen=True)
class Pace:
    """The sample time, and the unit of times as the file writes it; None where it says nothing.

    `fault` says what is wrong with a sample time that is no number.
    """

    sample_time: float | None = None
    unit: str | None = None
    fault: str = ""


def is_sample_time(name: str) -> bool:
    """Whether an array of this name is the sample time, not a signal."""
    return name.lower() in _SAMPLE_TIMES


def pace_of(found: Arrays) -> Pace:
    """What single numbers called Ts, sample_time or dt say, and a text called TimeUnit.

    An empty one says nothing, as that of an iddata with times of its own.
    """
    steps: dict[str, float] = {}
    unit = next((text for name, text in found.texts.items() if name.lower() in _UNITS), None)
    for name, array in found.arrays.items():
        if is_sample_time(name) and array.size == 1:
            if array.dtype.kind not in "fiu":
                what = "a truth value" if array.dtype.kind == "b" else "a date or a length of time"
                return Pace(None, unit, f"{name} holds {what}")
            steps[name] = float(array.item())
    for name, what in found.left_out.items():
        text = found.texts.get(name)
        if not is_sample_time(name) or what == NOTHING:
            continue
        if text is None or not is_number(text):
            return Pace(None, unit, f"{name} holds {what}" + (f" ({text!r})" if text else ""))
        steps[name] = float(text)
    if len(set(steps.values())) > 1:
        return Pace(None, unit, " and ".join(f"{name} says {step:g}" for name, step in steps.items()))
    return Pace(next(iter(steps.values()), None), unit)
