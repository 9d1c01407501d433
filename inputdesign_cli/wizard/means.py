"""What the experiment may use, and the noise it has to do with, in the words of a spec."""

from __future__ import annotations

import re
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from inputdesign_cli.wizard.faults import in_their_words
from inputdesign_cli.wizard.phrases import NUMBER, PLUS_MINUS, Phrase, needed, seconds, short
from inputdesign_cli.wizard.plant_answer import PlantAnswer
from inputdesign_cli.wizard.questions import bad_answer, file_of
from inputdesign_cli.wizard.wishes import pid

_TYPES = {"any": "multisine", "multisine": "multisine", "two levels": "binary", "three levels": "ternary"}
_MADE = {"multisine": "  # how samples are made of the spectrum: sinusoids as dense as the record allows"}
_LEAST_BITS, _MOST_BITS = 2, 32
DRIFTING = (1.0, -0.8)  # C of noise that drifts
# A unit, which is not converted: "%", "bar", "degC", "m/s"; not a word of the phrases.
_UNIT = r"(?:\s*(?!(?:to|around|about|at|by|and|up|over|per|within)\b)[^\s\d,;|+±-][^\s,;|]*)?"
_MOVED = r"(?:\s*(?!(?:per|and)\b)[^\s\d,;|/]+)?"
_PER = r"(?:\s*(?:per|/)\s*(s|sec|second|min|minute|h|hour)\b)?"
_SPANS = {"s": 1.0, "m": 60.0, "h": 3600.0}  # seconds, by the first letter
_SAME_STEP = 0.01  # of rows and samples
_WHITE = 3.0  # correlations above so many deviations of chance colour the noise


@dataclass(frozen=True)
class Range:
    """The amplitude about an operating point."""

    amplitude: float
    offset: float


def input_range(text: str) -> Range:
    """`plus/minus 5 around 40`, or `35 to 45`.

    Raises:
        SpecError: `bad-answer`.
    """
    said = Phrase(text, "range")
    ends = said.take(rf"^\s*(?:from\s*)?{NUMBER}{_UNIT}\s*(?:to\b|\.\.)\s*{NUMBER}{_UNIT}\s*$")
    if ends is not None:
        low, high = float(ends[1]), float(ends[2])
        if not low < high:
            raise bad_answer("range", f"{low:g} is not below {high:g}")
        return Range(0.5 * (high - low), 0.5 * (low + high))
    about = said.take(rf"^\s*{NUMBER}{_UNIT}\s*{PLUS_MINUS}\s*{NUMBER}{_UNIT}\s*$")
    if about is not None:
        return Range(needed(float(about[2]), "range", "the amplitude"), float(about[1]))
    middle = said.after_if_named("around|about|at", _UNIT)
    side = said.number(rf"(?:{PLUS_MINUS}|\bby\b)\s*{NUMBER}{_UNIT}")
    if side is None and middle is not None:
        side = said.number(rf"{NUMBER}{_UNIT}")
    if side is None:
        raise bad_answer("range", f'"{text}" is no range')
    said.finish()
    return Range(needed(side, "range", "the amplitude"), middle or 0.0)


def limit_lines(span: Range, text: str, duration: float, step: float) -> list[str]:
    """The lines of `limits`.

    Raises:
        SpecError: `bad-answer`.
    """
    rate, output = _limited(text)
    peak = short(span.amplitude)
    lines = ["limits:  # counted from the operating point"]
    if output is None:
        lines.append(f"  amplitude: {peak}")
    else:
        lines.append(
            f"  amplitude: {{input: {peak}, output: {short(needed(output, 'limits', 'the output'))}}}"
        )
    if rate is not None:
        move = needed(rate, "limits", "the rate") * step
        lines.append(f"  rate: {short(move)}  # {short(rate)} per second, {short(step)} s a sample")
    return [*lines, f"  duration: {short(duration)}  # seconds"]


def _limited(text: str) -> tuple[float | None, float | None]:
    """What the answer `limits` says of the rate, a second, and of the output."""
    said = Phrase(text, "limits")
    output = said.after_if_named("output", _UNIT)
    found = said.take(rf"\brate\b\s*(?:of\s*)?{NUMBER}{_MOVED}{_PER}")
    if found is None and said.take(r"\brate\b"):
        raise bad_answer("limits", '"rate" has no number behind it')
    if found is None and output is None and text.lower() not in ("none", "no"):
        raise bad_answer("limits", f'"{text}" is none of these')
    said.finish("none no")
    rate = None if found is None else float(found[1]) / _SPANS[(found[2] or "s")[:1].lower()]
    return rate, output


def noise_lines(text: str, drift: str, folder: Path, step: float) -> list[str]:
    """The lines of `noise`.

    Args:
        step: seconds between samples.

    Raises:
        SpecError: `bad-answer`.
        DataError: a file cannot be used.
    """
    size, colour, comment = noise_level(text, folder, step)
    lines = ["noise:", f"  variance: {short(size)}  # {comment}"]
    if drifts(drift):
        return [*lines, "  drift: true  # an integrator in the noise", f"  C: {list(DRIFTING)}"]
    return [*lines, f"  D: [1, {short(-colour)}]  # {comment}"] if colour else lines


def drifts(text: str, *, otherwise: bool = False) -> bool:
    """Whether the noise has an integrator.

    Args:
        otherwise: where that is not known.

    Raises:
        SpecError: `bad-answer`.
    """
    known = {"yes": True, "no": False, "not known": otherwise}
    if text.lower() not in known:
        raise bad_answer("drift", f'"{text}" is neither yes nor no')
    return known[text.lower()]


def at_rest(text: str) -> bool:
    """Whether the answer `noise` names data at rest."""
    return text.partition(" ")[0].lower() == "rest"


def noise_level(text: str, folder: Path, step: float) -> tuple[float, float, str]:
    """The variance of white noise, or of what a pole (0 where there is none) colours, and how it is known.

    Args:
        step: seconds between samples.

    Raises:
        SpecError: `bad-answer`.
        DataError: a file cannot be used.
    """
    if at_rest(text):
        name = text.partition(" ")[2]
        level, colour, comment = _at_rest(folder / name.strip(), step)
        return level, colour, f"of {name.strip()}: {comment}"
    said = Phrase(text, "noise")
    deviation, rounding = said.after("standard deviation|deviation|std", _UNIT), _resolution(said)
    if deviation is None and rounding is None:
        raise bad_answer("noise", "it does not say a standard deviation or a resolution")
    said.finish()
    told, size = [], 0.0
    if deviation is not None:
        size += needed(deviation, "noise", "the standard deviation") ** 2
        told.append(f"standard deviation {short(deviation)}")
    if rounding is not None:
        size += needed(rounding, "noise", "the resolution") ** 2 / 12.0
        least = "" if told else ": the least that noise can be"
        told.append(f"rounding to {short(rounding)} has a variance of its square over 12{least}")
    return size, 0.0, "; ".join(told)


def _resolution(said: Phrase) -> float | None:
    """The step of a sensor; of one with so many bits, from what it spans."""
    bits = said.take(rf"\bresolution\b\s*(?:of\s*)?(\d+)\s*bits?\s*(?:up to|over|to|range)\s*{NUMBER}{_UNIT}")
    if bits is None:
        counted = said.take(
            rf"\bresolution\b\s*(?:of\s*)?{NUMBER}[\s-]*(bits?|digits?|levels?|counts?|steps?)\b"
        )
        if counted is not None:
            raise bad_answer(
                "noise",
                f"{counted[1]} {counted[2]} are no size without a range: "
                '"resolution 12 bits up to 100", or the step itself',
            )
        return said.after_if_named("resolution", _UNIT)
    return needed(float(bits[2]), "noise", "its range") / 2.0 ** int(bits[1])


def names_resolution(text: str) -> bool:
    """Whether the answer `noise` says how a sensor rounds."""
    return not at_rest(text) and re.search(r"\bresolution\b", text, re.I) is not None


def _at_rest(path: Path, step: float) -> tuple[float, float, str]:
    """Variance of the innovation, the pole of the noise (0 where it is white), and how that is known.

    Rows that are farther apart than samples, or nearer, tell of noise with one pole: its correlation fades
    by the same factor in the same time.
    """
    from inputdesign_cli.questions.building.tables import read_samples

    file_of("noise", path)
    with in_their_words({}, "noise"):
        y, apart = read_samples(path, {"y": "y"}, key="noise")["y"], _seconds_apart(path) or step
    if y.size < 20:
        raise bad_answer("noise", f"{path.name} has {y.size} rows, and 20 are the least")
    v = y - y.mean()
    power = float(np.mean(v**2))
    if power == 0.0:
        raise bad_answer("noise", f"y of {path.name} does not change; write the resolution of the sensor")
    rho = float(np.mean(v[1:] * v[:-1]) / power)
    elsewhere = "" if abs(apart - step) <= _SAME_STEP * step else f", {short(apart)} s apart"
    if abs(rho) <= _WHITE / np.sqrt(y.size):
        return power, 0.0, f"{y.size} samples{elsewhere}, white as far as they tell"
    seen, rho = rho, min(rho, 0.98)
    if elsewhere:
        rho = min(max(rho, 0.0) ** (step / apart), 0.98)
    return (
        power * (1.0 - rho**2),
        rho,
        f"{y.size} samples{elsewhere}, correlation {seen:.2g} from one to the next",
    )


def _seconds_apart(path: Path) -> float | None:
    """The time between the rows of a file, where a column tells it."""
    from inputdesign_cli.records import read_sheet
    from inputdesign_cli.records.columns import column_named, columns_of, time_columns
    from inputdesign_cli.records.signals import time_unit_in

    sheet = read_sheet(path, key="noise")
    for name in time_columns(sheet)[:1]:
        unit = time_unit_in(sheet, name, dated=column_named(sheet, name).dated) or "s"
        apart = float(np.median(np.diff(columns_of(sheet, {"time": name})["time"])))
        return seconds(f"{apart!r} {unit}", "noise") if apart > 0.0 else None
    return None


def loop_line(text: str, plant: PlantAnswer) -> str | None:
    """The controller of the experiment as YAML; None in open loop.

    Raises:
        SpecError: `bad-answer`.
    """
    if text.lower() == "as the plant":
        return plant.controller
    if text.lower() == "open":
        return None
    if plant.channels > 1:
        raise bad_answer("loop", f"the plant has {plant.channels} channels, and one PI has one: write open")
    said = Phrase(text, "loop")
    settings = pid(said, stated=True)
    said.finish("PI PID controller")
    return f"{{pid: {settings}}}"


def signal_lines(kind: str, converter: str, span: Range, limits: str) -> list[str]:
    """The lines of `signal`.

    Args:
        limits: where they name the output, one record is fitted to them, which takes its time.

    Raises:
        SpecError: `bad-answer`.
    """
    if kind.lower() not in _TYPES:
        raise bad_answer("signals", f'"{kind}" is none of these')
    lines = ["signal:", f"  type: {_TYPES[kind.lower()]}{_MADE.get(_TYPES[kind.lower()], '')}", "  seed: 1"]
    if _limited(limits)[1] is not None:
        lines.append("  candidates: 1  # it is fitted to the limit on the output at every plant")
    lines.append(f"  offset: {short(span.offset)}  # the operating point, added to signal.csv")
    if converter.lower() in ("no", "none"):
        return lines
    said = Phrase(converter, "converter")
    bits = said.take(r"(?<![\w.+-])(\d+)\s*bits?\b")
    most = said.after("up to|over|to|range", _UNIT)
    if bits is None or most is None:
        raise bad_answer("converter", f'"{converter}" is none of these')
    said.finish()
    if not _LEAST_BITS <= int(bits.group(1)) <= _MOST_BITS:
        raise bad_answer("converter", f"converters have {_LEAST_BITS} to {_MOST_BITS} bits")
    return [
        *lines,
        f"  quantisation: {{bits: {bits.group(1)}, range: {short(needed(most, 'converter', 'its range'))}}}",
    ]
