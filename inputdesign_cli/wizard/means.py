"""Limits, signal, loop and noise of a spec from the answers."""

from __future__ import annotations

import re
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from inputdesign_cli.wizard.faults import in_their_words
from inputdesign_cli.wizard.grammar import NUMBER, PLUS_MINUS, UNIT, Phrase, needed, seconds, short
from inputdesign_cli.wizard.questions import bad_answer, chosen, file_of
from inputdesign_cli.wizard.stated_plants import PlantAnswer
from inputdesign_cli.wizard.wishes import pid

_TYPES = {"any": "multisine", "multisine": "multisine", "two levels": "binary", "three levels": "ternary"}
_MADE = {"multisine": "  # how samples are made of the spectrum: sinusoids as dense as the record allows"}
_LEAST_BITS, _MOST_BITS = 2, 32
DRIFTING = (1.0, -0.8)  # C of noise that drifts
_SAME_STEP = 0.01  # of rows and samples
_WHITE = 3.0  # correlations above this number of standard deviations colour the noise
_FEWEST = 20  # rows of data at rest


@dataclass(frozen=True)
class Range:
    """The amplitude about an operating point."""

    amplitude: float
    offset: float


def input_range(text: str) -> Range:
    """Return the range of "plus/minus 5 around 40", or of "35 to 45".

    Raises:
        SpecError: `bad-answer`.
    """
    said = Phrase(text, "range")
    ends = said.take(rf"^\s*(?:from\s*)?{NUMBER}{UNIT}\s*(?:to\b|\.\.)\s*{NUMBER}{UNIT}\s*$")
    if ends is not None:
        low, high = float(ends[1]), float(ends[2])
        if not low < high:
            raise bad_answer("range", f"{low:g} is not below {high:g}")
        return Range(0.5 * (high - low), 0.5 * (low + high))
    about = said.take(rf"^\s*{NUMBER}{UNIT}\s*{PLUS_MINUS}\s*{NUMBER}{UNIT}\s*$")
    if about is not None:
        return Range(needed(float(about[2]), "range", "the amplitude"), float(about[1]))
    middle = said.after("around|about|at", named=True)
    side = said.number(rf"(?:{PLUS_MINUS}|\bby\b)\s*{NUMBER}{UNIT}")
    if side is None and middle is not None:
        side = said.number(rf"{NUMBER}{UNIT}")
    if side is None:
        raise bad_answer("range", f'"{text}" is no range')
    said.finish()
    return Range(needed(side, "range", "the amplitude"), middle or 0.0)


def limit_lines(span: Range, text: str, duration: float, step: float) -> list[str]:
    """Return the lines of `limits`.

    Raises:
        SpecError: `bad-answer`.
    """
    rate, output = _limited(text)
    peak = short(span.amplitude)
    if output is not None:
        peak = f"{{input: {peak}, output: {short(needed(output, 'limits', 'the output'))}}}"
    lines = ["limits:  # counted from the operating point", f"  amplitude: {peak}"]
    if rate is not None:
        move = needed(rate, "limits", "the rate") * step
        lines.append(f"  rate: {short(move)}  # {short(rate)} per second, {short(step)} s a sample")
    return [*lines, f"  duration: {short(duration)}  # seconds"]


def _limited(text: str) -> tuple[float | None, float | None]:
    """Return the limits on the rate, per second, and on the output."""
    said = Phrase(text, "limits")
    output, rate = said.after("output", named=True), said.after("rate", "rate", named=True)
    if rate is None and output is None and text.lower() not in ("none", "no"):
        raise bad_answer("limits", f'"{text}" is none of these')
    said.finish("none no")
    return rate, output


def loop_line(text: str, plant: PlantAnswer) -> str | None:
    """Return the controller of the experiment as YAML; None in open loop.

    Raises:
        SpecError: `bad-answer`.
    """
    known = {"as the plant": plant.controller, "open": None}
    if text.lower() in known:
        return known[text.lower()]
    if plant.channels > 1:
        raise bad_answer("loop", f"the plant has {plant.channels} channels, and one PI has one: write open")
    said = Phrase(text, "loop")
    settings = pid(said, stated=True)
    said.finish("PI PID controller")
    return f"{{pid: {settings}}}"


def signal_lines(kind: str, converter: str, span: Range, limits: str) -> list[str]:
    """Return the lines of `signal`.

    Args:
        limits: where they name the output, one record is fitted to them, which takes its time.

    Raises:
        SpecError: `bad-answer`.
    """
    made = chosen("signals", kind, _TYPES)
    lines = ["signal:", f"  type: {made}{_MADE.get(made, '')}", "  seed: 1"]
    if _limited(limits)[1] is not None:
        lines.append("  candidates: 1  # it is fitted to the limit on the output at every plant")
    lines.append(f"  offset: {short(span.offset)}  # the operating point, added to signal.csv")
    if converter.lower() in ("no", "none"):
        return lines
    said = Phrase(converter, "converter")
    bits, most = said.number(r"(?<![\w.+-])(\d+)\s*bits?\b"), said.after("up to|over|to|range")
    if bits is None or most is None:
        raise bad_answer("converter", f'"{converter}" is none of these')
    said.finish()
    if not _LEAST_BITS <= bits <= _MOST_BITS:
        raise bad_answer("converter", f"converters have {_LEAST_BITS} to {_MOST_BITS} bits")
    spans = short(needed(most, "converter", "its range"))
    return [*lines, f"  quantisation: {{bits: {bits:.0f}, range: {spans}}}"]


def noise_lines(text: str, drift: str, folder: Path, step: float) -> list[str]:
    """Return the lines of `noise`; a step is the seconds between samples.

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
    """Return whether the noise has an integrator; `otherwise` where that is not known.

    Raises:
        SpecError: `bad-answer`.
    """
    return chosen("drift", text, {"yes": True, "no": False, "not known": otherwise})


def at_rest(text: str) -> bool:
    """Return whether the answer `noise` names data at rest."""
    return text.partition(" ")[0].lower() == "rest"


def noise_level(text: str, folder: Path, step: float) -> tuple[float, float, str]:
    """Return the variance of the innovation, the pole of the noise (0: white), and how they are known.

    Raises:
        SpecError: `bad-answer`.
        DataError: a file cannot be used.
    """
    if at_rest(text):
        name = text.partition(" ")[2].strip()
        level, colour, comment = _at_rest(folder / name, step)
        return level, colour, f"of {name}: {comment}"
    said = Phrase(text, "noise")
    deviation, rounding = said.after("standard deviation|deviation|std"), _resolution(said)
    if deviation is None and rounding is None:
        raise bad_answer("noise", "it does not say a standard deviation or a resolution")
    said.finish()
    why, size = [], 0.0
    if deviation is not None:
        size += needed(deviation, "noise", "the standard deviation") ** 2
        why.append(f"standard deviation {short(deviation)}")
    if rounding is not None:
        size += needed(rounding, "noise", "the resolution") ** 2 / 12.0
        least = "" if why else ": the least that noise can be"
        why.append(f"rounding to {short(rounding)} has a variance of its square over 12{least}")
    return size, 0.0, "; ".join(why)


def _resolution(said: Phrase) -> float | None:
    """Return the step of a sensor, which follows from its bits and its range where these are said."""
    begins = r"\bresolution\b\s*(?:of\s*)?"
    bits = said.take(rf"{begins}(\d+)\s*bits?\s*(?:up to|over|to|range)\s*{NUMBER}{UNIT}")
    if bits is not None:
        return needed(float(bits[2]), "noise", "its range") / 2.0 ** int(bits[1])
    counted = said.take(rf"{begins}{NUMBER}[\s-]*(bits?|digits?|levels?|counts?|steps?)\b")
    if counted is not None:
        why = f"{counted[1]} {counted[2]} are no size without a range"
        raise bad_answer("noise", f'{why}: "resolution 12 bits up to 100", or the step itself')
    return said.after("resolution", named=True)


def names_resolution(text: str) -> bool:
    """Return whether the answer `noise` says how a sensor rounds."""
    return not at_rest(text) and re.search(r"\bresolution\b", text, re.I) is not None


def _at_rest(path: Path, step: float) -> tuple[float, float, str]:
    """Return what `noise_level` does, from the column y of a file.

    Noise with one pole is assumed where rows are farther apart than samples, or nearer: its correlation fades
    by the same factor in the same time.
    """
    from inputdesign_cli.questions.building.tables import read_samples

    file_of("noise", path)
    with in_their_words({}, "noise"):
        y, apart = read_samples(path, {"y": "y"}, key="noise")["y"], _seconds_apart(path) or step
    if y.size < _FEWEST:
        raise bad_answer("noise", f"{path.name} has {y.size} rows, and {_FEWEST} are the least")
    v = y - y.mean()
    power = float(np.mean(v**2))
    if power == 0.0:
        raise bad_answer("noise", f"y of {path.name} does not change; write the resolution of the sensor")
    rho = float(np.mean(v[1:] * v[:-1]) / power)
    elsewhere = "" if abs(apart - step) <= _SAME_STEP * step else f", {short(apart)} s apart"
    if abs(rho) <= _WHITE / np.sqrt(y.size):
        return power, 0.0, f"{y.size} samples{elsewhere}, white as far as they show"
    seen, rho = rho, min(rho, 0.98)
    if elsewhere:
        rho = min(max(rho, 0.0) ** (step / apart), 0.98)
    comment = f"{y.size} samples{elsewhere}, correlation {seen:.2g} from one to the next"
    return power * (1.0 - rho**2), rho, comment


def _seconds_apart(path: Path) -> float | None:
    """Return the time between the rows of a file; None without a column of times."""
    from inputdesign_cli.records import read_sheet
    from inputdesign_cli.records.columns import column_named, columns_of, time_columns, time_unit_in

    sheet = read_sheet(path, key="noise")
    for name in time_columns(sheet)[:1]:
        unit = time_unit_in(sheet, name, dated=column_named(sheet, name).dated) or "s"
        apart = float(np.median(np.diff(columns_of(sheet, {"time": name})["time"])))
        return seconds(f"{apart!r} {unit}", "noise") if apart > 0.0 else None
    return None
