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
_TERMS = {"nominal plant": "plant as stated", "the offset": "the operating point"}
_PATH = re.compile(r"\b(?:accuracy|experiment|limits|noise|plant|signal|spectrum|uncertainty)(?:\.\w+)+")
_LINES_THERE = re.compile(r"holds (\d+) .* (\d+) are asked")
_LONG_ENOUGH = re.compile(r"samples or ([\d.e+]+) s in all")
_QUIETER = re.compile(r"less of a margin than (\w+): ([\d.]+) .*for example \w+: ([\d.]+)")
# How to ask for a margin that is weaker than a first value, for example a second one.
_WEAKER = {
    "max_sensitivity_db": ("more than {} dB", "{} dB"),
    "phase_margin": ("less than {} degrees", "{} degrees"),
    "gain_margin": ("a gain margin below {}", "gain margin {}"),
}


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
    why = _MESSAGES.get(one.code) or _in_words(one.message)
    lines = _LINES_THERE.search(one.message) if one.code == "too-few-lines" else None
    if lines is not None:
        why = f"{lines[1]} frequencies between these two repeat within the time, and {lines[2]} are needed"
    place = one.location if one.location and not one.location.file.startswith("<") else None
    hint = "; ".join(filter(None, (_remedy(one, asked.key), f"allowed: {asked.allowed}")))
    return replace(
        one, message=f"{asked.asks} ({asked.key}): {why}", hint=hint, key=asked.key, location=place
    )


def _remedy(one: Diagnostic, key: str) -> str:
    if quieter := _QUIETER.search(one.hint):
        weaker, such = _WEAKER[quieter[1]]
        asks = f"ask for {weaker.format(quieter[2])} (the nearer, the longer the experiment)"
        return f"{asks}, for example {such.format(quieter[3])}"
    if one.code == "too-few-lines":
        enough = _LONG_ENOUGH.search(one.hint)
        return f"take {enough[1]} s or more, or a band that reaches higher" if enough else "take more time"
    if one.code == "infinite-information" and key != "loop":
        return ""  # a controller holds it already
    return _HINTS.get(one.code, "")


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


def _in_words(message: str) -> str:
    """Return a message without paths and terms of the spec."""
    for term, words in _TERMS.items():
        message = message.replace(term, words)
    return _PATH.sub(lambda path: "the " + path[0].rpartition(".")[2].replace("_", " "), message)
