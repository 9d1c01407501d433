"""Requirements of a spec from what the model is for."""

from __future__ import annotations

import math
import re

from inputdesign_cli.specification.models.loop import MOST_DECIBELS
from inputdesign_cli.wizard.grammar import ALONE, NUMBER, Phrase, needed, short
from inputdesign_cli.wizard.questions import bad_answer
from inputdesign_cli.wizard.stated_plants import PlantAnswer

_NORMAL, _RAYLEIGH = 1.96, math.sqrt(math.log(20.0))  # 95 % of real and of complex errors, in deviations
_LINES = 20
_WITHIN = {
    "prediction": r"\bpredict\w*",
    "parameters": r"\bparameters?\b",
    "response": r"\b(?:bode(?: plot| diagram)?|frequency response)\b",
}


def wished(text: str, plant: PlantAnswer, controlled: bool, duration: float) -> list[str]:
    """Return the lines of `accuracy`.

    Args:
        controlled: whether the experiment runs under a controller.
        duration: of the experiment, in seconds.

    Raises:
        SpecError: `bad-answer`.
    """
    said = Phrase(text, "wish")
    if said.take(r"\bloop\b"):
        return _loop(said, plant, controlled)
    part = said.share()
    if part is None or not 0.0 < part < 1.0:
        raise bad_answer("wish", "it does not say within how many per cent, between 0 and 100")
    kind = next((kind for kind, words in _WITHIN.items() if said.take(words)), None)
    if kind is None:
        raise bad_answer("wish", f'"{text}" is none of these')
    if kind == "parameters":
        said.finish("physical")
        return _parameters(plant, part)
    begins, ends = said.band()
    high = needed(ends, "wish", "up to which frequency (rad/s)")
    said.finish()
    highest, step = math.pi / plant.sample_time, short(plant.sample_time)
    if high > highest:
        why = f"a sample every {step} s, which suits this plant, reaches up to {highest:.3g} rad/s"
        raise bad_answer("wish", why)
    if kind == "prediction" and begins is None:
        begins = min(2.0 * math.pi / duration, 0.1 * high)  # one period in the experiment
    low = needed(begins, "wish", "from which frequency (rad/s)")
    if low >= high:
        raise bad_answer("wish", f"{low:g} is not below {high:g}")
    band = f"band: [{short(low)}, {short(high)}]"
    if kind == "prediction":
        return [
            f"accuracy:  # G known within {100 * part:g} %, from one period in the experiment to what you "
            "named",
            f"  model_error: {{relative: {short(part)}, {band}}}",
        ]
    return [
        f"accuracy:  # {100 * part:g} % is {_RAYLEIGH:.3g} deviations of a complex error: 95 % are within it",
        f"  frequency_response: {{relative: {short(part / _RAYLEIGH)}, {band}, lines: {_LINES}}}",
    ]


def _parameters(plant: PlantAnswer, part: float) -> list[str]:
    if not plant.values:
        why = "this plant has no parameters with names; ask for a prediction or a Bode plot"
        raise bad_answer("wish", why)
    sizes = {name: short(part * abs(value) / _NORMAL) for name, value in plant.values.items()}
    listed = ", ".join(f"{name}: {size}" for name, size in sizes.items())
    return [
        f"accuracy:  # {100 * part:g} % is 1.96 standard deviations, so that 95 % of estimates are within it",
        f"  standard_deviation: {{{listed}}}",
    ]


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
    settings = pid(said, stated=said.take(r"\b(?:my\s+)?own\b|\bmy\b") is not None)
    tuned = settings is None and plant.tunable
    fast = tuned and not derivative
    speed = said.after(r"(?:closed[- ]loop )?time constant|tau_c", "time") if fast else None
    said.finish("PI controller margin")
    if settings is not None:
        return ["accuracy:", f"  loop: {{controller: {{pid: {settings}}}, {margin}}}"]
    if tuned:
        rule, named = "{simc: {}}", "Skogestad, as fast as the dead time"
        if derivative:
            rule, named = "{amigo: {type: pid}}", "Astrom and Hagglund"
        elif speed is not None:
            rule = f"{{simc: {{tau_c: {short(needed(speed, 'wish', 'tau_c'))}}}}}"
            named = "Skogestad, as fast as you said"
        return [
            "accuracy:  # the controller follows from the plant; all that the data leave keep the margin",
            f"  loop: {{tuning: {rule}, {margin}}}  # tuned by the rule of {named}",
        ]
    if controlled:
        return ["accuracy:  # with the controller of the experiment", f"  loop: {{{margin}}}"]
    raise bad_answer(
        "wish",
        "no rule of tuning is at hand for this plant (they are for a gain, one or two lags and a dead time); "
        'name your own settings, as in "own loop with 6 dB, Kp 1.5, Ti 180"',
    )


def _margin(said: Phrase) -> str:
    """Return the margin of a loop as an entry of the spec."""
    factor = said.take(rf"\bgain margin\b\s*(?:of\s*)?{ALONE}{NUMBER}(\s*dB\b)?")
    if factor is not None:
        size = 10.0 ** (float(factor[1]) / 20.0) if factor[2] else float(factor[1])
        if not 1.0 < size < math.inf:
            why = f"a gain margin is a factor above one, or dB above zero, not {factor[1]}"
            raise bad_answer("wish", why)
        return f"gain_margin: {short(size)}"
    peak = said.number(rf"{ALONE}{NUMBER}\s*dB\b")
    if peak is not None:
        if peak > MOST_DECIBELS:
            why = f"{peak:g} dB are no margin: 6 dB are usual, and {MOST_DECIBELS:g} the most"
            raise bad_answer("wish", why)
        return f"max_sensitivity_db: {short(needed(peak, 'wish', 'the margin in dB'))}"
    said.take(r"\bphase margin\b")
    degrees = said.number(rf"{ALONE}{NUMBER}\s*(?:degrees\b|deg\b|°)")
    if degrees is None:
        raise bad_answer("wish", "it does not say the margin: 6 dB, 29 degrees or gain margin 2")
    if not 0.0 < degrees < 60.0:
        raise bad_answer("wish", "a phase margin is between 0 and 60 degrees here")
    return f"phase_margin: {short(degrees)}"


def pid(said: Phrase, *, stated: bool) -> str | None:
    """Return the settings "Kp 1, Ti 60, Td 5" as YAML, or None without settings.

    Args:
        stated: whether there must be settings.

    Raises:
        SpecError: `bad-answer`.
    """
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
