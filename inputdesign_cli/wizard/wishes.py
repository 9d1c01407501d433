"""The purpose of the model and the limits of the experiment, as entries of a spec.

An answer that cannot be understood is a SpecError `bad-answer`.
"""

from __future__ import annotations

import math
import re
from collections.abc import Mapping
from dataclasses import dataclass

from inputdesign_cli.findings.prepared_records import name_and_unit
from inputdesign_cli.specification.models.loop import MOST_DECIBELS
from inputdesign_cli.wizard.grammar import (
    ALONE,
    DRIVE,
    NUMBER,
    PLUS_MINUS,
    RESTING,
    SIGNAL,
    UNIT,
    Phrase,
    needed,
    short,
)
from inputdesign_cli.wizard.plants import PlantAnswer
from inputdesign_cli.wizard.questions import bad_answer

_NORMAL, _RAYLEIGH = 1.96, math.sqrt(math.log(20.0))  # 95 % limits of real and complex errors, in deviations
_LINES = 20
_FASTER = 4.0  # time constant of a plant without dead time over that of its loop
_HIGHER = 2.0  # upper end of the band of a prediction over the corner frequency of the plant
_SAFE = 6.0  # dB of |S|, for a gain margin of 2 and a phase margin of 29 degrees
_LEAST_BITS, _MOST_BITS = 2, 32
LOOP = r"\b(?:loop|control(?:ler)?|regulator)\b"
_WITHIN = {
    "prediction": r"\bpredict\w*(?:\s+(?:of\s+)?(?:the|a|my|our)\s+[a-z ]+?(?=\s+within|[|,;]|\s*$))?",
    "parameters": r"\bparameters?\b",
    "response": r"\b(?:bode(?: plot| diagram)?|frequency response)\b",
}


PRECISE = re.compile("|".join(_WITHIN.values()), re.I)
"""A wish for numbers, beside which a loop is the name of a plant."""
_OF_UNIT = {"V": "voltage", "volt": "voltage", "volts": "voltage", "mV": "voltage", "A": "current"}
NAMES_A_LOOP = re.compile(rf"(?:{SIGNAL} )?{LOOP}", re.I)

# The share of the amplitude by which an operating point may differ from the middle of the range.
_MIDDLE = 0.05

IN_UNIT = r"(?:\s*(?:\bin\s+|\(\s*(?:in\s+)?)(?P<in_unit>[^\s\d,;:.()|]+)\)?)?"
"""The unit behind a name of an input, as in "valve in %" and "valve (%)"."""
STANDS = rf"(?:{RESTING}\s+)*(?:(?:held|kept)\s+)?(?:around|about|at|near)"
MOVES = (
    r"(?:(?:i|we|it|and|which|that|may|can|could|might|should|(?:is )?allowed to|be)\s+)*"
    r"(?<!has )(?<!had )(?<!have )"
    r"(?:moved?|moves|go|goes|swings?|vary|varied|varies|changed?|changes|stepped|deviates?)\b"
    r"(?:\s+(?:it|by|over))*"
)
BOTH_WAYS = (
    r"(?:up (?:and|or) down|(?:either|each|both) ways?|(?:(?:to|on) )?(?:either|each|both) sides?"
    r"|in (?:both|either) directions?|more or less)"
)
ACTUATOR = rf"(?:(?!(?:the|our|my|move|may|can|by|from|around|when|open|if|i)\b)[a-z]+ )?{DRIVE}"


@dataclass(frozen=True)
class Range:
    """Holds the amplitude about an operating point, and name and unit of the input."""

    amplitude: float
    offset: float
    name: str = ""
    unit: str = ""


def input_range(text: str, plant: PlantAnswer | None = None) -> Range:
    """Return the range of "valve 40 +- 5 %", of "may move +-5 around 40", or of "35 to 45".

    A per cent is a unit of the input here, never a share of the operating point. Where the plant has a gain
    with another unit of the input, the range is converted into that.
    """
    ours = plant.units[1] if plant else ""
    said, number = Phrase(text, "range", unit=ours), f"{NUMBER}({UNIT})"
    at = rf"\b{STANDS}\s*{number}"
    named = said.take(rf"\b(?:(?:the|our|my)\s+)?({ACTUATOR})\b{IN_UNIT}")
    ends = said.take(rf"(?<![-+±\w.]){number}\s*(?:to\b|\.\.|[-–](?=\s*\d))\s*{number}") or said.take(
        rf"\bbetween\s+{number}\s*and\s+{number}"
    )
    about = None if ends else said.take(rf"(?<![-+±\w.]){number}\s*{PLUS_MINUS}\s*{number}")
    if found := ends or about:
        sizes = [(found[1], found[2]), (found[3], found[4])]
    else:
        around = said.take(at)
        by = (
            said.take(rf"(?:{PLUS_MINUS}|\bby\b)\s*{number}")
            or said.take(rf"{number}\s*{BOTH_WAYS}")
            or (around and said.take(number))
        )
        if by is None:
            raise bad_answer("range", f'"{text}" is no range')
        if by[1].startswith(("+", "-")):
            raise bad_answer("range", f'"{by[0]}" goes one way: say how far it may move to either side')
        sizes = [(around[1], around[2]) if around else ("0", ""), (by[1], by[2])]
    points = list(iter(lambda: said.take(at), None))  # it may be said twice
    said.take(MOVES)
    said.take(BOTH_WAYS)
    said.finish("move stands sits rests runs run operate keep from allowed possible permitted only")
    units = [*(one.strip() for _, one in sizes), (named and named["in_unit"]) or ""]
    unit = next(filter(None, units), "")
    one, other = (said.sized(float(number), own.strip() or unit, ours or unit) for number, own in sizes)
    middle, side = (one, other) if ends is None else (0.5 * (one + other), 0.5 * (other - one))
    if ends is not None and not one < other:
        raise bad_answer("range", f"{one:g} is not below {other:g}")
    for point in points:
        rest, low, high = said.sized(float(point[1]), point[2].strip() or unit), middle - side, middle + side
        if abs(rest - middle) > _MIDDLE * side:
            why = f"the input is at {rest:g}, and the middle of {low:g} to {high:g} is {middle:g}"
            raise bad_answer("range", f'{why}: write "{rest:g} +- .."')
    name = named[1].strip() if named and named[1].lower() not in ("input", "actuator") else ""
    return Range(needed(side, "range", "the amplitude"), middle, name, ours or unit)


def channels_of(said: Mapping[str, str], plant: PlantAnswer, span: Range) -> dict[str, dict[str, str]]:
    """Return names and units of the channels: as stated, or else from a log, the range and the gain."""
    names = [f"{letter}{i + 1}" for letter in "uy" for i in range(plant.channels)]
    named = {"u1": (span.name or _OF_UNIT.get(span.unit, ""), span.unit), "y1": ("", plant.units[0])}
    named |= {channel: name_and_unit(header) for channel, header in plant.called.items()}
    parts = [one.strip().partition(" in ") for one in said["names"].split(",")]
    owners = ["u1" if _drives(name, span) else "y1" for name, *_ in parts]
    as_said = said["names"].lower() == "as said"
    output = re.fullmatch(SIGNAL, said["names"], re.I)
    alone = output or (len({*owners}) == len(parts) and all(unit for *_, unit in parts))
    if plant.channels == 1 and alone and not as_said:
        for own, (name, _, unit) in zip(owners, parts, strict=True):  # "level in cm": the other is as said
            if unit:
                Phrase(said["names"], "names", unit=named[own][1]).sized(1.0, unit)
            named[own] = (name, named[own][1] or unit)
    elif not as_said:
        if len(parts) != len(names) or not all(name for name, _, _ in parts):
            raise bad_answer("names", f"{len(names)} channels have names, inputs first: {', '.join(names)}")
        named = {name: (called, unit.strip()) for name, (called, _, unit) in zip(names, parts, strict=True)}
    rows = {name: {"name": called, "unit": unit} for name, (called, unit) in named.items()}
    return {name: kept for name, row in rows.items() if (kept := {k: v for k, v in row.items() if v})}


def _drives(name: str, span: Range) -> bool:
    """Return whether a name is that of the input of the range, or of a drive, as a valve."""
    called = name.lower() == span.name.lower() or re.fullmatch(ACTUATOR, name, re.I) is not None
    return called and re.fullmatch(SIGNAL, name, re.I) is None


def limited(text: str, plant: PlantAnswer) -> tuple[float | None, float | None]:
    """Return the limits on the rate, per unit of time, and on the output."""
    said = Phrase(text, "limits", plant.clock, plant.units[0])
    output = said.after("output", named=True)
    rate = said.after("rate", "rate", named=True, unit=plant.units[1])
    if rate is None and output is None and text.lower() not in ("none", "no"):
        raise bad_answer("limits", f'"{text}" is none of these')
    said.finish("none no")
    for what, value in (("the rate", rate), ("the output", output)):
        if value is not None:
            needed(value, "limits", what)
    return rate, output


def controller(text: str, plant: PlantAnswer, *, keeps: bool = False) -> str | None:
    """Return the controller of the experiment as YAML; None in open loop.

    Args:
        keeps: whether the actuator keeps positions, which excludes a controller.
    """
    known = {"as the plant": None if keeps else plant.controller, "open": None}
    if text.lower() in known:
        return known[text.lower()]
    if plant.channels > 1:
        raise bad_answer("loop", f"the plant has {plant.channels} channels, and one PI has one: write open")
    said = Phrase(text, "loop", plant.clock)
    settings = _pid(said, stated=True)
    said.finish("PI PID controller")
    return f"{{pid: {settings}}}"


def quantisation(text: str, span: Range) -> str | None:
    """Return the converter of "12 bits up to 100", or of "steps of 0.1 %", as YAML; None without one."""
    if text.lower() in ("no", "none"):
        return None
    said = Phrase(text, "converter", unit=span.unit)
    bits, most = said.number(r"(?<![\w.+-])(\d+)\s*bits?\b"), said.after("up to|over|to|range")
    if bits is None and most is None:
        step = said.after("steps?|resolution")
        step = said.number(rf"{NUMBER}({UNIT})") if step is None else step
        if (step or 0.0) > span.amplitude:
            why = f"steps of {step:g} are larger than the {span.amplitude:g} that the input may move"
            raise bad_answer("converter", f"{why}: name the finest step of the actuator, or no")
        reach = abs(span.offset) + span.amplitude
        bits = max(math.ceil(math.log2(reach / needed(step, "converter", "its step") + 1.0)) + 1, _LEAST_BITS)
        most = (step or 0.0) * 2.0 ** (bits - 1)
    if bits is None or most is None:
        raise bad_answer("converter", f'"{text}" is none of these')
    said.finish()
    if not _LEAST_BITS <= bits <= _MOST_BITS:
        raise bad_answer("converter", f"converters have {_LEAST_BITS} to {_MOST_BITS} bits")
    finest = f"  # values {short(most / 2.0 ** (bits - 1.0))} apart"
    return f"{{bits: {bits:.0f}, range: {short(needed(most, 'converter', 'its range'))}}}{finest}"


def dwell(text: str, plant: PlantAnswer) -> int:
    """Return the samples for which the actuator keeps a position, in answer to "60 s" or "no"."""
    if text.lower() in ("no", "none"):
        return 1
    return max(math.ceil(Phrase(text, "hold", plant.clock).lasting() / plant.sample_time - 1e-9), 1)


def wished(text: str, plant: PlantAnswer, controlled: bool, duration: float) -> list[str]:
    """Return the spec's lines of `accuracy` for a wish.

    Args:
        controlled: whether the experiment runs under a controller.
        duration: the duration of the experiment, in the unit of time of the plant.
    """
    said = Phrase(text, "wish", plant.clock)
    said.take(r"\bfor (?:an?|the|my|our) [a-z][^,;]*$")  # the plant, for the reader only
    if said.take(LOOP) or re.search(r"\bPID?\b", text, re.I):
        return _loop(said, plant, controlled)
    part = said.share()
    if part is None or not 0.0 < part < 1.0:
        raise bad_answer("wish", "it does not say within how many per cent, between 0 and 100")
    kind = next((kind for kind, words in _WITHIN.items() if said.take(words)), None)
    if kind is None:
        raise bad_answer("wish", f'"{text}" is none of these')
    if kind == "parameters":
        while (more := said.share()) is not None and said.take(_WITHIN[kind]):
            part = min(part, more)
        said.finish("physical")
        if not plant.values:
            why = "this plant has no parameters with names; ask for a prediction or a Bode plot"
            raise bad_answer("wish", why)
        sizes = {name: short(part * abs(value) / _NORMAL) for name, value in plant.values.items()}
        listed = ", ".join(f"{name}: {size}" for name, size in sizes.items())
        how = f"{100 * part:g} % is 1.96 standard deviations, so that 95 % of estimates are within it"
        return [f"accuracy:  # {how}", f"  standard_deviation: {{{listed}}}"]
    begins, ends = said.band()
    until = "what you named"
    if kind == "prediction" and begins is ends is None:
        ends, until = _HIGHER / plant.slow, f"{_HIGHER:g} over its time constant, as no frequency was named"
    high = needed(ends, "wish", f"up to which frequency (rad/{plant.time_unit})")
    said.finish()
    highest, step = math.pi / plant.sample_time, short(plant.sample_time)
    if high > highest:
        unit = plant.time_unit
        why = f"a sample every {step} {unit}, which suits this plant, reaches up to {highest:.3g} rad/{unit}"
        raise bad_answer("wish", why)
    if kind == "prediction" and begins is None:
        begins = min(2.0 * math.pi / duration, 0.1 * high)  # one period in the experiment
    low = needed(begins, "wish", f"from which frequency (rad/{plant.time_unit})")
    if low >= high:
        raise bad_answer("wish", f"{low:g} is not below {high:g}")
    band = f"band: [{short(low)}, {short(high)}]"
    if kind == "prediction":
        how = f"G known within {100 * part:g} %, from one period in the experiment to {until}"
        return [f"accuracy:  # {how}", f"  model_error: {{relative: {short(part)}, {band}}}"]
    how = f"{100 * part:g} % is {_RAYLEIGH:.3g} deviations of a complex error: 95 % are within it"
    size = short(part / _RAYLEIGH)
    return [f"accuracy:  # {how}", f"  frequency_response: {{relative: {size}, {band}, lines: {_LINES}}}"]


def _loop(said: Phrase, plant: PlantAnswer, controlled: bool) -> list[str]:
    margin = _margin(said)
    if plant.channels > 1:
        raise bad_answer(
            "wish",
            f"the plant has {plant.channels} channels, and the settings of a PI or PID are for one input and "
            'one output. Ask for "prediction within 10 % up to ..", or name the plant of one of its loops '
            '("gain .., time constant .., dead time ..")',
        )
    derivative = said.take(r"\bPID\b") is not None
    settings = _pid(said, stated=said.take(r"\b(?:my\s+)?own\b|\bmy\b") is not None)
    tuned = settings is None and plant.tunable
    if tuned and derivative and plant.undelayed:
        raise bad_answer(
            "wish", "the rule for a PID needs a dead time, and this plant has hardly one: a PI will do"
        )
    fast = tuned and not derivative
    speed = said.after(r"(?:closed[- ]loop )?time constant|tau_c", "time") if fast else None
    said.finish("PI controller loop margin")
    if settings is not None:
        return ["accuracy:", f"  loop: {{controller: {{pid: {settings}}}, {margin}}}"]
    if tuned:
        rule, named = "{simc: {}}", "Skogestad, as fast as the dead time"
        if derivative:
            rule, named = "{amigo: {type: pid}}", "Astrom and Hagglund"
        elif speed is not None or plant.undelayed:
            how = f"{_FASTER:g} times as fast as the plant, for it has hardly a dead time"
            named = f"Skogestad, {how if speed is None else 'as fast as you said'}"
            speed = plant.slow / _FASTER if speed is None else needed(speed, "wish", "tau_c")
            rule = f"{{simc: {{tau_c: {short(speed)}}}}}"
        return [
            "accuracy:  # the controller follows from the plant; what the data allow keeps the margin",
            f"  loop: {{tuning: {rule}, {margin}}}  # tuned by the rule of {named}",
        ]
    if controlled:
        return ["accuracy:  # with the controller of the experiment", f"  loop: {{{margin}}}"]
    why = "no rule of tuning is at hand for this plant (they are for a gain, one or two lags and a dead time)"
    own = 'name your own settings, as in "own loop with 6 dB, Kp 1.5, Ti 180"'
    raise bad_answer("wish", "; ".join([why, own, *(one.removesuffix(".") for one in plant.doubts)]))


def unbounded(text: str) -> bool:
    """Return whether a wish asks for a loop and names no margin."""
    return bool(re.search(rf"{LOOP}|\bPID?\b", text, re.I)) and not re.search(
        r"\bmargin|\bdB\b|\bdeg|°|\bsafe\b|\bM_?s\b|sensitivity", text, re.I
    )


def _margin(said: Phrase) -> str:
    """Return the margin of a loop as an entry of the spec; a number overrides the words "safe margin"."""
    safe = said.take(r"\b(?:safe|usual|good)\b(?:\s*margins?\b)?") is not None
    factor = said.take(rf"\bgain margin\b\s*(?:(?:of|at least|above)\s+)*{ALONE}{NUMBER}(\s*dB\b)?")
    if factor is not None:
        size = 10.0 ** (float(factor[1]) / 20.0) if factor[2] else float(factor[1])
        if not 1.0 < size < math.inf:
            why = f"a gain margin is a factor above one, or dB above zero, not {factor[1]}"
            raise bad_answer("wish", why)
        return f"gain_margin: {short(size)}"
    peak = said.number(rf"{ALONE}{NUMBER}\s*dB\b")
    size = said.after(r"M_?s|max(?:imum|\.)? sensitivity", "none")
    if peak is None and size is not None:
        peak = 20.0 * math.log10(needed(size, "wish", "the largest sensitivity"))
    if peak is not None:
        if peak > MOST_DECIBELS:
            why = f"{peak:g} dB are no margin: 6 dB are usual, and {MOST_DECIBELS:g} the most"
            raise bad_answer("wish", why)
        return f"max_sensitivity_db: {short(needed(peak, 'wish', 'the margin in dB'))}"
    said.take(r"\bphase margin\b")
    degrees = said.number(rf"{ALONE}{NUMBER}\s*(?:degrees\b|deg\b|°)")
    if degrees is None and safe:
        return f"max_sensitivity_db: {_SAFE:g}"
    if degrees is None:
        raise bad_answer(
            "wish", "it does not say the margin: 6 dB, 29 degrees, gain margin 2 or a safe margin"
        )
    if not 0.0 < degrees < 60.0:
        raise bad_answer("wish", "a phase margin is between 0 and 60 degrees here")
    return f"phase_margin: {short(degrees)}"


def _pid(said: Phrase, *, stated: bool) -> str | None:
    """Return the settings "Kp 1, Ti 60, Td 5" as YAML; None without settings, unless they must be stated."""
    gain = said.after("Kp", "none")
    times = {name: said.after(name, "time") for name in ("Ti", "Td")}
    there = [name for name, time in times.items() if time is not None]
    if not gain:
        if not stated and gain is None and not any(times.values()):
            return None
        raise bad_answer(said.key, "it does not say Kp, as in Kp 1, Ti 60")
    named = re.search(r"\b(PID?)\b", said.text, re.I)
    if named is not None:
        kind = named[1].upper()
        for name in times:
            if (name in there) != (name == "Ti" or kind == "PID"):
                lack = "has no" if name in there else "needs"
                raise bad_answer(said.key, f"a {kind} controller {lack} {name}")
    parts = [f"{name}: {short(needed(times[name], said.key, name))}" for name in there]
    return "{" + ", ".join([f"Kp: {short(gain)}", *parts]) + "}"
