"""What the experiment may use, and the noise it has to do with, in the words of a spec."""

from __future__ import annotations

import re
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from inputdesign_cli.wizard.faults import in_their_words
from inputdesign_cli.wizard.phrases import NUMBER, after, after_if_named, needed, number, short
from inputdesign_cli.wizard.plant_answer import PlantAnswer
from inputdesign_cli.wizard.questions import bad_answer, file_of
from inputdesign_cli.wizard.wishes import pid

_TYPES = {"any": "multisine", "multisine": "multisine", "two levels": "binary", "three levels": "ternary"}
_MADE = {"multisine": "  # how samples are made of the spectrum: sinusoids as dense as the record allows"}
_LEAST_BITS, _MOST_BITS = 2, 32
DRIFTING = (1.0, -0.8)  # C of noise that drifts
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
    ends = re.fullmatch(rf"(?:from\s*)?{NUMBER}\s*(?:to|\.\.)\s*{NUMBER}\s*\S{{0,3}}", text.strip(), re.I)
    if ends is not None:
        low, high = float(ends.group(1)), float(ends.group(2))
        if not low < high:
            raise bad_answer("range", f"{low:g} is not below {high:g}")
        return Range(0.5 * (high - low), 0.5 * (low + high))
    side = number(
        rf"(?:plus/minus|plus or minus|\+/?-|±|by)?\s*{NUMBER}\s*\S{{0,3}}\s*(?:around|about|at)", text
    )
    if side is None:
        side = number(rf"(?:plus/minus|plus or minus|\+/?-|±)\s*{NUMBER}", text)
    if side is None:
        raise bad_answer("range", f'"{text}" is no range')
    return Range(
        needed(side, "range", "the amplitude"), after_if_named(text, "around|about|at", "range") or 0.0
    )


def limit_lines(span: Range, text: str, duration: float, step: float) -> list[str]:
    """The lines of `limits`.

    Raises:
        SpecError: `bad-answer`.
    """
    rate, output = (after_if_named(text, word, "limits") for word in ("rate", "output"))
    if rate is None and output is None and text.lower() not in ("none", "no"):
        raise bad_answer("limits", f'"{text}" is none of these')
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


def noise_lines(text: str, drift: str, folder: Path) -> list[str]:
    """The lines of `noise`.

    Raises:
        SpecError: `bad-answer`.
        DataError: a file cannot be used.
    """
    size, colour, comment = noise_level(text, folder)
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


def noise_level(text: str, folder: Path) -> tuple[float, float, str]:
    """The variance of white noise, or of what a pole (0 where there is none) colours, and how it is known.

    Raises:
        SpecError: `bad-answer`.
        DataError: a file cannot be used.
    """
    if at_rest(text):
        name = text.partition(" ")[2]
        level, colour, comment = _at_rest(folder / name.strip())
        return level, colour, f"of {name.strip()}: {comment}"
    deviation, step = after(text, "standard deviation|deviation|std"), after(text, "resolution")
    if deviation is not None:
        size = needed(deviation, "noise", "the standard deviation")
        return size**2, 0.0, f"standard deviation {short(size)}"
    size = needed(step, "noise", "a standard deviation or a resolution")
    told = f"rounding to {short(size)} has a variance of its square over 12: the least that noise can be"
    return size**2 / 12.0, 0.0, told


def _at_rest(path: Path) -> tuple[float, float, str]:
    """Variance of the innovation, the pole of the noise (0 where it is white), and how that is known."""
    from inputdesign_cli.tasks.build.tables import read_samples

    file_of("noise", path)
    with in_their_words({}, "noise"):
        y = read_samples(path, {"y": "y"}, key="noise")["y"]
    if y.size < 20:
        raise bad_answer("noise", f"{path.name} has {y.size} rows, and 20 are the least")
    v = y - y.mean()
    power = float(np.mean(v**2))
    if power == 0.0:
        raise bad_answer("noise", f"y of {path.name} does not change; write the resolution of the sensor")
    rho = float(np.mean(v[1:] * v[:-1]) / power)
    if abs(rho) <= _WHITE / np.sqrt(y.size):
        return power, 0.0, f"{y.size} samples, white as far as they tell"
    rho = min(rho, 0.98)
    return power * (1.0 - rho**2), rho, f"{y.size} samples, correlation {rho:.2g} from one to the next"


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
    return f"{{pid: {pid(text, 'loop')}}}"


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
    if after(limits, "output") is not None:
        lines.append("  candidates: 1  # it is fitted to the limit on the output at every plant")
    lines.append(f"  offset: {short(span.offset)}  # the operating point, added to signal.csv")
    if converter.lower() in ("no", "none"):
        return lines
    bits = re.search(r"(?<![\w.+-])(\d+)\s*bits?", converter, re.I)
    most = after(converter, "up to|over|to|range")
    if bits is None or most is None:
        raise bad_answer("converter", f'"{converter}" is none of these')
    if not _LEAST_BITS <= int(bits.group(1)) <= _MOST_BITS:
        raise bad_answer("converter", f"converters have {_LEAST_BITS} to {_MOST_BITS} bits")
    return [
        *lines,
        f"  quantisation: {{bits: {bits.group(1)}, range: {short(needed(most, 'converter', 'its range'))}}}",
    ]
