"""The ten questions of `idesign wizard`, and the answers to them: given one by one, or in a file."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from pathlib import Path

from inputdesign_cli.errors import Diagnostic, IdesignError, Location, SpecError
from inputdesign_cli.specification.models.wording import unknown_word
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
        '"PI loop with 6 dB" (or PID; 29 degrees, gain margin 2); "own loop with 6 dB, Kp 1.5, Ti 180"; '
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


@dataclass(frozen=True)
class Answers:
    """Answers by question, and where those of a file stand.

    Args:
        texts: what was answered.
        places: of the answers in the file; for questions that it leaves open, its beginning.
    """

    texts: dict[str, str] = field(default_factory=dict)
    places: dict[str, Location] = field(default_factory=dict)

    @contextmanager
    def located(self) -> Iterator[None]:
        """Errors inside that are about an answer of the file tell where it stands."""
        try:
            yield
        except IdesignError as error:
            raise type(error)([self._placed(one) for one in error.diagnostics]) from error

    def _placed(self, one: Diagnostic) -> Diagnostic:
        return replace(one, location=one.location or self.places.get(one.key))


def file_of(key: str, path: Path) -> Path:
    """The path of a file that an answer names, which is there.

    Raises:
        SpecError: `bad-answer`.
    """
    if path.is_dir():
        raise bad_answer(key, f"{path} is a folder")
    if path.exists() and not path.is_file():
        raise bad_answer(key, f"{path} is a pipe or a device, not a file")
    if not path.is_file():
        raise bad_answer(key, f"there is no file {path}")
    return path


def read_answers(file: Path | None, given: Sequence[str] = ()) -> Answers:
    """The answers of a YAML file and of `KEY=TEXT`, which come first.

    Raises:
        SpecError: `bad-answer` for a question that there is not, or for what is no text; the file cannot
            be read.
    """
    answers = Answers() if file is None else _of_file(file)
    for text in given:
        key, equals, value = text.partition("=")
        if not equals:
            message = f'"{text}" is no answer'
            raise SpecError.because("bad-answer", message, 'write KEY=TEXT, as in time="1 h"')
        answers.texts[key.strip()] = value.strip()
        answers.places.pop(key.strip(), None)
    for key in answers.texts:
        if key not in KEYS:
            message, hint = unknown_word(key, KEYS)
            told = message.replace("{key}", "the question")
            hint = hint or f"the questions are {', '.join(KEYS)}"
            raise SpecError.because("bad-answer", told, hint, location=answers.places.get(key))
    return answers


def _of_file(file: Path) -> Answers:
    tree = read(read_text(file), str(file))
    if tree.diagnostics:
        raise SpecError(tree.diagnostics)
    begins = tree.places.location(tree.places.mark(())) or Location(str(file), 1, 1)
    if not isinstance(tree.data, dict):
        message, hint = "answers are a mapping of questions to texts", f"the questions are {', '.join(KEYS)}"
        raise SpecError.because("bad-answer", message, hint, location=begins)
    answers = Answers(places=dict.fromkeys((one.key for one in QUESTIONS if one.default is None), begins))
    for key, value in tree.data.items():
        place = tree.places.location(tree.places.mark((key,)))
        if isinstance(value, dict | list):
            what = "a mapping" if isinstance(value, dict) else "a list"
            message, hint = f"the answer to {key} is {what}", 'an answer is one text: put it in quotes ("..")'
            raise SpecError.because("bad-answer", message, hint, key, place)
        answers.texts[key] = _plain(value)
        if place is not None:
            answers.places[key] = place
    return answers


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
