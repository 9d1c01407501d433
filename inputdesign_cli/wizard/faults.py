"""Errors of the spec of the answers become errors of the answer that caused them, in its words."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import replace

from inputdesign_cli.errors import Diagnostic, IdesignError, OutputError
from inputdesign_cli.wizard.questions import KEYS, question

# Which answer a section of the spec comes from, the longer paths first.
_ANSWERS = {
    "experiment.controller": "loop",
    "experiment": "time",
    "limits.amplitude.output": "limits",
    "limits.amplitude": "range",
    "limits.duration": "time",
    "limits": "limits",
    "noise.drift": "drift",
    "noise": "noise",
    "plant": "plant",
    "uncertainty": "plant",
    "sample_time": "plant",
    "signal.quantisation": "converter",
    "signal.offset": "range",
    "signal": "signals",
}
_OPEN = {"unstable-loop": "wish", "infinite-information": "loop"}  # in open loop
_OF_CODE = {"coarse-converter": "converter", "delay-beyond-record": "time", "too-few-lines": "wish"}
# What a code says, or how it is mended, where the spec's own words would puzzle.
_MESSAGES = {
    "unstable-loop": "with these settings the loop is unstable even with the plant as stated",
    "unbounded-error": "the plant integrates, and no experiment bounds its error at the lowest frequencies",
    "delay-beyond-record": "the dead time of the plant is as long as the experiment, or longer",
    "not-identifiable": "no experiment separates the parameters of this plant",
}
_HINTS = {
    "unstable-loop": "take a smaller Kp, of the same sign as the gain of the plant, or a larger Ti",
    "unbounded-error": 'ask for "parameters within 5 %", or for a Bode plot from a frequency above zero on',
    "delay-beyond-record": "take more time; what is a second, and what a minute?",
    "infinite-information": "let a controller hold the plant in the experiment, and write its settings",
    "not-identifiable": "has it a factor that cancels, or is it too small to be seen?",
    "coarse-converter": "move the operating point, or let the converter reach further",
    "data-missing-column": "name the columns in the first line of the file: time, u, y (at rest: y)",
}
# Terms of the spec -> words of the answers.
_TERMS = {
    r"\bnominal plant\b": "plant as stated",
    r"\bthe offset\b": "the operating point",
    r"tune more slowly .* or (?=ask for less)": "",
    r"\bmax_sensitivity_db: ([\d.]+)": r"\1 dB",
    r"\bphase_margin: ([\d.]+)": r"\1 degrees",
    r"\bgain_margin: ([\d.]+)": r"gain margin \1",
    r"\b(?:accuracy|experiment|limits|noise|plant|signal|spectrum|uncertainty)(?:\.\w+)*\.(\w+)": r"the \1",
}
_LONG_ENOUGH = re.compile(r"samples or ([\d.e+]+) s in all")


@contextmanager
def in_their_words(said: Mapping[str, str], key: str = "") -> Iterator[None]:
    """Turn errors inside into errors of an answer.

    Args:
        said: the answers.
        key: of the question that an error is about where it has no key.
    """
    try:
        yield
    except OutputError:
        raise
    except IdesignError as error:
        raise type(error)([_reworded(one, said, key) for one in error.diagnostics]) from error


def _reworded(one: Diagnostic, said: Mapping[str, str], key: str) -> Diagnostic:
    if one.code == "bad-answer" and one.key in KEYS:
        return one
    asked = question(_question(one, said) or key or "wish")
    if one.message.startswith(f"{asked.asks} ({asked.key}): "):
        return one  # by a block inside
    place = one.location if one.location and not one.location.file.startswith("<") else None
    hint = "; ".join(filter(None, (_remedy(one, asked.key), f"allowed: {asked.allowed}")))
    message = f"{asked.asks} ({asked.key}): {_in_words(_MESSAGES.get(one.code, one.message))}"
    return replace(one, message=message, hint=hint, key=asked.key, location=place)


def _remedy(one: Diagnostic, key: str) -> str:
    if one.code == "admissible-not-positive":
        return _in_words(one.hint)
    if one.code == "too-few-lines":
        enough = _LONG_ENOUGH.search(one.hint)
        return f"take {enough[1]} s or more, or a band that reaches higher" if enough else "take more time"
    held = one.code == "infinite-information" and key != "loop"  # a controller holds it already
    return "" if held else _HINTS.get(one.code, "")


def _question(one: Diagnostic, said: Mapping[str, str]) -> str:
    """Return the question whose answer an entry of the spec comes from; empty where that is not known."""
    # In open loop the only controller is that of the wish, and none holds a plant that integrates.
    held = re.search(r"\bKp\b", said.get("loop", ""), re.I)
    if not held and one.code in _OPEN:
        return _OPEN[one.code]
    if one.code in _OF_CODE:
        return _OF_CODE[one.code]
    found = (name for path, name in _ANSWERS.items() if f"{one.key}.".startswith(f"{path}."))
    return next(found, one.key if one.key in KEYS else "")


def _in_words(text: str) -> str:
    """Return a message or a hint without paths and terms of the spec."""
    for term, words in _TERMS.items():
        text = re.sub(term, words, text)
    return text
