"""What the model is for, in the words of a spec."""

from __future__ import annotations

import math
import re

from inputdesign_cli.specification.models.loop import MOST_DECIBELS
from inputdesign_cli.wizard.phrases import NUMBER, after, needed, number, seconds_after, share, short
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
    if re.search(r"\bloop\b", text, re.I):
        return _loop(text, plant, controlled)
    part = share(text)
    if part is None or not 0.0 < part < 1.0:
        raise bad_answer("wish", "it does not say within how many per cent, between 0 and 100")
    per_cent = f"{100 * part:g} %"
    if re.search(r"predict", text, re.I):
        high = needed(after(text, "up to|to"), "wish", "up to which frequency (rad/s)")
        _below_nyquist(high, plant)
        low = min(2.0 * math.pi / duration, 0.1 * high)
        return [
            f"accuracy:  # G known within {per_cent}, from one period in the experiment to what you named",
            f"  model_error: {{relative: {short(part)}, band: [{short(low)}, {short(high)}]}}",
        ]
    if re.search(r"parameter", text, re.I):
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
    if re.search(r"bode|frequency response", text, re.I):
        low = needed(after(text, "from"), "wish", "from which frequency (rad/s)")
        high = needed(after(text, "to"), "wish", "to which frequency (rad/s)")
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


def _loop(text: str, plant: PlantAnswer, controlled: bool) -> list[str]:
    margin = _margin(text)
    if plant.channels > 1:
        raise bad_answer(
            "wish",
            f"the plant has {plant.channels} channels, and the settings of a PI or PID are for one input and "
            'one output. Ask for "prediction within 10 % up to ..", or name the plant of one of its loops '
            '("gain .., time constant .., dead time ..")',
        )
    if re.search(r"\bown\b", text, re.I):
        return ["accuracy:", f"  loop: {{controller: {{pid: {pid(text, 'wish')}}}, {margin}}}"]
    if plant.tunable:
        rule = "{amigo: {type: pid}}" if re.search(r"\bpid\b", text, re.I) else "{simc: {}}"
        named = "Astrom and Hagglund" if "amigo" in rule else "Skogestad, as fast as the dead time"
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


def _margin(text: str) -> str:
    peak = number(rf"{_ALONE}{NUMBER}\s*dB", text)
    if peak is not None:
        if peak > MOST_DECIBELS:
            raise bad_answer(
                "wish", f"{peak:g} dB are no margin: 6 dB are usual, and {MOST_DECIBELS:g} the most"
            )
        return f"max_sensitivity_db: {short(needed(peak, 'wish', 'the margin in dB'))}"
    degrees = number(rf"{_ALONE}{NUMBER}\s*(?:degrees|deg|°)", text)
    if degrees is not None:
        if not 0.0 < degrees < 60.0:
            raise bad_answer("wish", "a phase margin is between 0 and 60 degrees here")
        return f"phase_margin: {short(degrees)}"
    factor = after(text, "gain margin")
    if factor is not None and factor > 1.0:
        return f"gain_margin: {short(factor)}"
    raise bad_answer("wish", "it does not say the margin: 6 dB, 45 degrees or gain margin 2")


def pid(text: str, key: str) -> str:
    """The settings "Kp 1, Ti 60, Td 5" as YAML."""
    gain = after(text, "Kp")
    if not gain:
        raise bad_answer(key, "it does not say Kp, as in Kp 1, Ti 60")
    times = {name: seconds_after(text, name, key) for name in ("Ti", "Td")}
    parts = [
        f"Kp: {short(gain)}",
        *(f"{n}: {short(needed(t, key, n))}" for n, t in times.items() if t is not None),
    ]
    return "{" + ", ".join(parts) + "}"
