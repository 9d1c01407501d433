"""Range, limits, loop and signal of a spec from the answers."""

from __future__ import annotations

from dataclasses import dataclass

from inputdesign_cli.wizard.grammar import NUMBER, PLUS_MINUS, UNIT, Phrase, needed, short
from inputdesign_cli.wizard.questions import bad_answer, chosen
from inputdesign_cli.wizard.stated_plants import PlantAnswer
from inputdesign_cli.wizard.wishes import pid

_TYPES = {"any": "multisine", "multisine": "multisine", "two levels": "binary", "three levels": "ternary"}
_MADE = {"multisine": "  # how samples are made of the spectrum: sinusoids as dense as the record allows"}
_LEAST_BITS, _MOST_BITS = 2, 32


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
    rate, output = limited(text)
    peak = short(span.amplitude)
    if output is not None:
        peak = f"{{input: {peak}, output: {short(needed(output, 'limits', 'the output'))}}}"
    lines = ["limits:  # counted from the operating point", f"  amplitude: {peak}"]
    if rate is not None:
        move = needed(rate, "limits", "the rate") * step
        lines.append(f"  rate: {short(move)}  # {short(rate)} per second, {short(step)} s a sample")
    return [*lines, f"  duration: {short(duration)}  # seconds"]


def limited(text: str) -> tuple[float | None, float | None]:
    """Return the limits on the rate, per second, and on the output.

    Raises:
        SpecError: `bad-answer`.
    """
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


def signal_lines(kind: str, converter: str, span: Range, *, fitted: bool) -> list[str]:
    """Return the lines of `signal`.

    Args:
        fitted: whether one record is fitted to a limit on the output, which takes its time.

    Raises:
        SpecError: `bad-answer`.
    """
    made = chosen("signals", kind, _TYPES)
    lines = ["signal:", f"  type: {made}{_MADE.get(made, '')}", "  seed: 1"]
    if fitted:
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
