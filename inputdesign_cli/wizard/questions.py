"""The questions of `idesign wizard`, their answers, and errors in words of the answers."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from importlib import resources
from pathlib import Path
from typing import Any, TypeVar

import yaml

from inputdesign_cli.errors import Diagnostic, IdesignError, Location, OutputError, SpecError
from inputdesign_cli.specification.models.wording import unknown_word
from inputdesign_cli.specification.yaml.files import read_text
from inputdesign_cli.specification.yaml.reader import read


@dataclass(frozen=True)
class Question:
    """Holds a question, the answers that it allows, its default, and the sections of a spec that it sets."""

    key: str
    asks: str
    allowed: str
    default: str | None = None
    unsaid: str = ""  # the meaning of a default that is taken unasked; it is asked after a sentence, too
    pieces: list[str | list[str]] = field(default_factory=list)  # see questions.yaml
    sets: tuple[str, ...] = ()  # sections of the spec


def package_data(name: str) -> Any:
    """Return the content of a YAML file of this package."""
    return yaml.safe_load((resources.files(__package__) / name).read_text(encoding="utf-8"))


QUESTIONS = tuple(Question(**entry) for entry in package_data("questions.yaml"))
KEYS = tuple(question.key for question in QUESTIONS)
_FAULTS = package_data("faults.yaml")
# Sections of a spec -> their questions, the longer paths first.
_SECTIONS = dict(
    sorted(((path, one.key) for one in QUESTIONS for path in one.sets), key=lambda at: -len(at[0]))
)
_ALL = f"the questions are {', '.join(KEYS)}"
UNCLEAR = "unclear"
"""The key of the question about a part of a sentence. No answer can name it."""
AS_LOGGED = ("as the log", "as in the log", "as in this log")
_COLUMNS = re.compile(r'--columns "([^"]*)"')
_LONG_ENOUGH = re.compile(r"samples or ([\d.e+]+) s in all")


def question(key: str) -> Question:
    """Return the question of a key."""
    return next(one for one in QUESTIONS if one.key == key)


def in_other_words(part: str) -> Question:
    """Return the question about a part of a sentence that is not understood."""
    examples = '"valve 40 +- 15 %", "noise 0.2 degC", "log FILE columns u=valve, y=level" or "time=2 h"'
    allowed = f"the same in other words, as in {examples}"
    return Question(UNCLEAR, f'"{part}" is not understood. In other words?', allowed, "leave it out")


def known_from(answers: Mapping[str, str]) -> dict[str, str]:
    """Return the answers that the answer `plant` implies: a log shows the noise, and whether it drifts."""
    explored = answers.get("plant", "").strip().lower().startswith("log ")
    return {"noise": AS_LOGGED[0], "drift": "not known"} if explored else {}


def needed_of(answers: Mapping[str, str]) -> list[str]:
    """Return the questions without a default that the answers leave open."""
    there = {*answers, *known_from(answers)}
    return [one.key for one in QUESTIONS if one.default is None and one.key not in there]


def taken_for_granted(answers: Mapping[str, str]) -> list[str]:
    """Return a remark on the questions that a sentence leaves open and that were not asked."""
    unsaid = [one.unsaid for one in QUESTIONS if one.unsaid and one.key not in answers]
    return [f"taken for granted: {', '.join(unsaid)}"] if unsaid else []


def complete(answers: Mapping[str, str]) -> dict[str, str]:
    """Return the answers, with defaults where none is given.

    Raises:
        SpecError: `bad-answer` for questions that need one.
    """
    given = known_from(answers) | dict(answers)
    found = {one.key: (given.get(one.key, one.default) or "").strip() for one in QUESTIONS}
    for key, text in found.items():
        if not text:
            raise bad_answer(key, "there is no answer")
    return found


def bad_answer(key: str, why: str) -> SpecError:
    """Return the error that names the question and the allowed answers."""
    asked = question(key)
    return SpecError.because("bad-answer", f"{asked.asks} ({key}): {why}", f"allowed: {asked.allowed}", key)


Choice = TypeVar("Choice")


def chosen(key: str, text: str, choices: Mapping[str, Choice]) -> Choice:
    """Return the choice of an answer by its words; a SpecError `bad-answer` for other words."""
    if text.lower() not in choices:
        raise bad_answer(key, f'"{text}" is none of these')
    return choices[text.lower()]


def file_of(key: str, path: Path) -> Path:
    """Return the path of the file that an answer names; a SpecError `bad-answer` if there is none."""
    if path.is_file():
        return path
    there = f"{path} is a folder" if path.is_dir() else f"{path} is a pipe or a device, not a file"
    raise bad_answer(key, there if path.exists() else f"there is no file {path}")


@dataclass(frozen=True)
class Answers:
    """Holds the answers by question, and the places of answers in a file (else of its beginning).

    `remarks` are on parts of a sentence that answer no question, `unclear` its parts that are not understood.
    """

    texts: dict[str, str] = field(default_factory=dict)
    places: dict[str, Location] = field(default_factory=dict)
    remarks: list[str] = field(default_factory=list)
    unclear: list[str] = field(default_factory=list)

    @contextmanager
    def located(self) -> Iterator[None]:
        """Add to errors inside the place of the answer that they are about."""
        try:
            yield
        except IdesignError as error:
            placed = [
                replace(one, location=one.location or self.places.get(one.key)) for one in error.diagnostics
            ]
            raise type(error)(placed) from error


def read_answers(file: Path | None, given: Sequence[str] = ()) -> Answers:
    """Read the answers of a YAML file and of `KEY=TEXT`, which come first.

    Raises:
        SpecError: `bad-answer` for an unknown question or an answer that is no text; the file cannot be read.
    """
    answers = Answers() if file is None else _of_file(file)
    for text in given:
        key, equals, value = (part.strip() for part in text.partition("="))
        if not equals:
            message = f'"{text}" is no answer'
            raise SpecError.because("bad-answer", message, 'write KEY=TEXT, as in time="1 h"')
        answers.texts[key] = value
        answers.places.pop(key, None)
    for key in answers.texts:
        if key not in KEYS:
            message, hint = unknown_word(key, KEYS)
            message = message.replace("{key}", "the question")
            raise SpecError.because("bad-answer", message, hint or _ALL, location=answers.places.get(key))
    return answers


def _of_file(file: Path) -> Answers:
    tree = read(read_text(file), str(file))
    if tree.diagnostics:
        raise SpecError(tree.diagnostics)
    begins = tree.places.at(()) or Location(str(file), 1, 1)
    if not isinstance(tree.data, dict):
        message = "answers are a mapping of questions to texts"
        raise SpecError.because("bad-answer", message, _ALL, location=begins)
    answers = Answers(places=dict.fromkeys((one.key for one in QUESTIONS if one.default is None), begins))
    for key, value in tree.data.items():
        answers.places[key] = tree.places.at((key,)) or begins
        if isinstance(value, dict | list):
            what = "a mapping" if isinstance(value, dict) else "a list"
            message, hint = f"the answer to {key} is {what}", 'an answer is one text: put it in quotes ("..")'
            raise SpecError.because("bad-answer", message, hint, key, answers.places[key])
        # YAML reads yes and no as truth values; 1 and 0 are numbers.
        plain = {True: "yes", False: "no"}[value] if isinstance(value, bool) else value
        answers.texts[key] = "" if plain is None else str(plain)
    return answers


@contextmanager
def in_their_words(said: Mapping[str, str], key: str = "") -> Iterator[None]:
    """Turn errors inside into errors of an answer.

    Args:
        said: the answers.
        key: the question of an error without a key.
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
    # In open loop the only controller is that of the wish, and none stabilises a plant that integrates.
    held = re.search(r"\bKp\b", said.get("loop", ""), re.I)
    by_code: dict[str, str] = _FAULTS["codes"] | ({} if held else _FAULTS["open"])
    found = (name for path, name in _SECTIONS.items() if f"{one.key}.".startswith(f"{path}."))
    blamed = by_code.get(one.code) or next(found, one.key if one.key in KEYS else "")
    asked = question(blamed or key or "wish")
    begins = f"{asked.asks} ({asked.key}): "
    if one.message.startswith(begins):
        return one  # an inner block has reworded it
    place = one.location if one.location and not one.location.file.startswith("<") else None
    remedy = _FAULTS["hints"].get(one.code, "")
    if one.code == "admissible-not-positive":
        remedy = _in_words(one.hint)
    elif one.code == "too-few-lines":
        enough = _LONG_ENOUGH.search(one.hint)
        remedy = f"take {enough[1]} s or more, or a band that reaches higher" if enough else "take more time"
    elif asked.key == "plant" and (named := _COLUMNS.search(one.hint)):
        remedy = f"write behind the file: columns {named[1]}"
    elif one.code == "infinite-information" and asked.key != "loop":  # a controller is there already
        remedy = ""
    hint = "; ".join(filter(None, (remedy, f"allowed: {asked.allowed}")))
    message = begins + _in_words(_FAULTS["messages"].get(one.code, one.message))
    return replace(one, message=message, hint=hint, key=asked.key, location=place)


def _in_words(text: str) -> str:
    """Return a message or a hint without paths and terms of the spec."""
    for term, words in _FAULTS["terms"].items():
        text = re.sub(term, words, text)
    return text
