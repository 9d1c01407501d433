"""The ten questions of `idesign wizard`, and the answers to them: given one by one, or in a file."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from inputdesign_cli.errors import SpecError
from inputdesign_cli.specification.wording import unknown_word
from inputdesign_cli.specification.yaml.files import read_text
from inputdesign_cli.specification.yaml.reader import read


@dataclass(frozen=True)
class Question:
    """What is asked, what is allowed as an answer, and what holds where nothing is answered."""

    key: str
    asks: str
    allowed: str
    default: str | None = None


QUESTIONS = (
    Question(
        "plant",
        "What do you know of the plant?",
        'a template (heater, tank, motor, axis, column); "gain 2, time constant 180 s, dead time 25 s, each '
        'within 30 %"; "step FILE" or "log FILE" (columns u and y); or FILE.json with num and den in s',
    ),
    Question(
        "wish",
        "What is the model for?",
        '"PI loop with 6 dB" (or PID; 45 degrees, gain margin 2); "own loop with 6 dB, Kp 1.5, Ti 180"; '
        '"prediction within 5 % up to 0.05"; "parameters within 5 %"; '
        '"Bode plot within 5 % from 0.001 to 0.05" (rad/s)',
    ),
    Question(
        "range", "How far may the input move?", '"plus/minus 5 around 40", "35 to 45", or "plus/minus 5"'
    ),
    Question("time", "How much time is there?", '"1 h", "45 min", "3600 s"', "1 h"),
    Question(
        "limits",
        "How fast may the input move, and how far the output?",
        '"none", "rate 0.5" (per second), "output 3", or both',
        "none",
    ),
    Question(
        "noise",
        "What is the noise of the output?",
        '"standard deviation 0.2", "resolution 0.1" (of the sensor), or "rest FILE" (column y, u at rest)',
    ),
    Question(
        "drift",
        "Does the output drift by itself?",
        '"yes", "no", or "not known": then a log tells, and without one it does not',
        "not known",
    ),
    Question(
        "loop",
        "Does the experiment run in open loop, or under a controller?",
        '"open", "PI Kp 1, Ti 60", or "as the plant" (a template knows it)',
        "as the plant",
    ),
    Question(
        "signals", "Which signals can the hardware apply?", '"any", "two levels", "three levels"', "any"
    ),
    Question("converter", "Is the input quantised?", '"no", or "12 bits up to 100"', "no"),
)
KEYS = tuple(question.key for question in QUESTIONS)


def question(key: str) -> Question:
    """The question of a key."""
    return next(one for one in QUESTIONS if one.key == key)


AS_LOG = "as the log"


def told_by_plant(answers: Mapping[str, str]) -> dict[str, str]:
    """What needs no answer since the plant tells it: of a log what the noise is, and whether it drifts."""
    explored = answers.get("plant", "").strip().lower().startswith("log ")
    return {"noise": AS_LOG, "drift": "not known"} if explored else {}


def bad_answer(key: str, why: str) -> SpecError:
    """The error that names the question and tells what is allowed."""
    asked = question(key)
    return SpecError.because("bad-answer", f"{asked.asks} ({key}): {why}", f"allowed: {asked.allowed}", key)


def read_answers(file: Path | None, given: Sequence[str] = ()) -> dict[str, str]:
    """The answers of a YAML file and of `KEY=TEXT`, which come first.

    Raises:
        SpecError: `bad-answer` for a question that there is not; the file cannot be read.
    """
    found: dict[str, str] = {}
    if file is not None:
        tree = read(read_text(file), str(file))
        if tree.diagnostics:
            raise SpecError(tree.diagnostics)
        if not isinstance(tree.data, dict):
            message = "answers are a mapping of questions to texts"
            raise SpecError.because("bad-answer", message, f"the questions are {', '.join(KEYS)}")
        found |= {str(key): _plain(value) for key, value in tree.data.items()}
    for text in given:
        key, equals, value = text.partition("=")
        if not equals:
            message = f'"{text}" is no answer'
            raise SpecError.because("bad-answer", message, 'write KEY=TEXT, as in time="1 h"')
        found[key.strip()] = value.strip()
    for key in found:
        if key not in KEYS:
            message, hint = unknown_word(key, KEYS)
            told = message.replace("{key}", "the question")
            raise SpecError.because("bad-answer", told, hint or f"the questions are {', '.join(KEYS)}")
    return found


def complete(answers: Mapping[str, str]) -> dict[str, str]:
    """The answers with what holds where nothing is said.

    Raises:
        SpecError: `bad-answer` for questions that need one.
    """
    found, told = {}, told_by_plant(answers)
    for one in QUESTIONS:
        text = answers.get(one.key, told.get(one.key, one.default))
        if text is None or not text.strip():
            raise bad_answer(one.key, "there is no answer")
        found[one.key] = text.strip()
    return found


def _plain(value: object) -> str:
    """A value of YAML as it would be typed; 1 and 0 are numbers."""
    if isinstance(value, bool):
        return "yes" if value else "no"
    return "" if value is None else str(value)
