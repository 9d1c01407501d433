"""What the model is for, in the words of a spec."""

from __future__ import annotations

import math
import re

from inputdesign_cli.specification.models.loop import MOST_DECIBELS
from inputdesign_cli.wizard.phrases import NUMBER, Phrase, needed, short
from inputdesign_cli.wizard.plant_answer import PlantAnswer
from inputdesign_cli.wizard.questions import bad_answer

_NORMAL, _RAYLEIGH = 1.96, math.sqrt(math.log(20.0))  # 95 % of real and of complex errors, in deviations
_LINES = 20
_ALONE = r"(?<![\w.])"  # the number that follows is no part of another


def wished(text: str, plant: PlantAnswer, controlled: bool, duration: float) -> list[str]:
    """The lines of `accuracy`.

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
    per_cent = f"{100 * part:g} %"
    if said.take(r"\bpredict\w*"):
        high = needed(said.frequency_after("up to|to"), "wish", "up to which frequency (rad/s)")
        said.finish()
        _below_nyquist(high, plant)
        low = min(2.0 * math.pi / duration, 0.1 * high)
        return [
            f"accuracy:  # G known within {per_cent}, from one period in the experiment to what you named",
            f"  model_error: {{relative: {short(part)}, band: [{short(low)}, {short(high)}]}}",
        ]
    if said.take(r"\bparameters?\b"):
        said.finish("physical")
        if not plant.values:
            raise bad_answer(
                "wish", "this plant has no parameters with names; ask for a prediction or a Bode plot"
            )
        listed = ", ".join(
            f"{name}: {short(part * abs(value) / _NORMAL)}" for name, value in plant.values.items()
        )
        return [
            f"accuracy:  # {per_cent} is 1.96 standard deviations, so that 95 % of estimates are within it",
            f"  standard_deviation: {{{listed}}}",
        ]
    if said.take(r"\b(?:bode(?: plot| diagram)?|frequency response)\b"):
        begins, ends = said.band()
        low = needed(begins, "wish", "from which frequency (rad/s)")
        high = needed(ends, "wish", "to which frequency (rad/s)")
        said.finish()
        if low >= high:
            raise bad_answer("wish", f"{low:g} is not below {high:g}")
        _below_nyquist(high, plant)
        return [
            f"accuracy:  # {per_cent} is {_RAYLEIGH:.3g} deviations of a complex error: 95 % are within it",
            f"  frequency_response: {{relative: {short(part / _RAYLEIGH)}, "
            f"band: [{short(low)}, {short(high)}], lines: {_LINES}}}",
        ]
    raise bad_answer("wish", f'"{text}" is none of these')


def _below_nyquist(high: float, plant: PlantAnswer) -> None:
    highest = math.pi / plant.sample_time
    if high > highest:
        step = short(plant.sample_time)
        raise bad_answer(
            "wish", f"a sample every {step} s, which suits this plant, reaches up to {highest:.3g} rad/s"
        )


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
    own = said.take(r"\b(?:my\s+)?own\b|\bmy\b") is not None
    settings = pid(said, stated=own)
    if settings is not None:
        said.finish("PI controller margin")
        return ["accuracy:", f"  loop: {{controller: {{pid: {settings}}}, {margin}}}"]
    if plant.tunable:
        speed = None if derivative else said.seconds_after(r"(?:closed[- ]loop )?time constant|tau_c")
        said.finish("PI controller margin")
        simc = (
            "{simc: {}}" if speed is None else f"{{simc: {{tau_c: {short(needed(speed, 'wish', 'tau_c'))}}}}}"
        )
        rule = "{amigo: {type: pid}}" if derivative else simc
        pace = "as fast as the dead time" if speed is None else "as fast as you said"
        named = "Astrom and Hagglund" if derivative else f"Skogestad, {pace}"
        return [
            "accuracy:  # the controller follows from the plant; all that the data leave keep the margin",
            f"  loop: {{tuning: {rule}, {margin}}}  # tuned by the rule of {named}",
        ]
    said.finish("PI controller margin")
    if controlled:
        return ["accuracy:  # with the controller of the experiment", f"  loop: {{{margin}}}"]
    raise bad_answer(
        "wish",
        "no rule of tuning is at hand for this plant (they are for a gain, one or two lags and a dead time); "
        'name your own settings, as in "own loop with 6 dB, Kp 1.5, Ti 180"',
    )


def _margin(said: Phrase) -> str:
    factor = said.take(rf"\bgain margin\b\s*(?:of\s*)?{_ALONE}{NUMBER}(\s*dB\b)?")
    if factor is not None:
        size = 10.0 ** (float(factor[1]) / 20.0) if factor[2] else float(factor[1])
        if not 1.0 < size < math.inf:
            raise bad_answer(
                "wish", f"a gain margin is a factor above one, or dB above zero, not {factor[1]}"
            )
        return f"gain_margin: {short(size)}"
    peak = said.number(rf"{_ALONE}{NUMBER}\s*dB\b")
    if peak is not None:
        if peak > MOST_DECIBELS:
            raise bad_answer(
                "wish", f"{peak:g} dB are no margin: 6 dB are usual, and {MOST_DECIBELS:g} the most"
            )
        return f"max_sensitivity_db: {short(needed(peak, 'wish', 'the margin in dB'))}"
    said.take(r"\bphase margin\b")
    degrees = said.number(rf"{_ALONE}{NUMBER}\s*(?:degrees\b|deg\b|°)")
    if degrees is not None:
        if not 0.0 < degrees < 60.0:
            raise bad_answer("wish", "a phase margin is between 0 and 60 degrees here")
        return f"phase_margin: {short(degrees)}"
    raise bad_answer("wish", "it does not say the margin: 6 dB, 29 degrees or gain margin 2")


def pid(said: Phrase, *, stated: bool) -> str | None:
    """The settings "Kp 1, Ti 60, Td 5" as YAML; None where there are none and none must be."""
    gain = said.after("Kp")
    times = {name: said.seconds_after(name) for name in ("Ti", "Td")}
    if not gain:
        if not stated and gain is None and not any(times.values()):
            return None
        raise bad_answer(said.key, "it does not say Kp, as in Kp 1, Ti 60")
    named = re.search(r"\b(PID?)\b", said.text, re.I)
    if named is not None:
        wanted = ("Ti", "Td") if named[1].upper() == "PID" else ("Ti",)
        for name, time in times.items():
            if (time is not None) != (name in wanted):
                lack = "needs" if name in wanted else "has no"
                raise bad_answer(said.key, f"a {named[1].upper()} controller {lack} {name}")
    parts = [f"Kp: {short(gain)}"]
    for name, time in times.items():
        if time is not None:
            parts.append(f"{name}: {short(needed(time, said.key, name))}")
    return "{" + ", ".join(parts) + "}"
