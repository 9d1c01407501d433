"""A whole wish in a sentence, taken apart into pieces that answer questions.

What is left over is refused, or said back.
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from functools import cache

from inputdesign_cli.wizard import grammar, plants, wishes
from inputdesign_cli.wizard.grammar import BEYOND, beyond_models, check_numbers, in_figures, orders, unread
from inputdesign_cli.wizard.questions import Answers, bad_answer, question

_TURNS = ("loop", "wish", "noise", "plant", "hold", "converter", "return", "limits", "range", "names", "time")
"""The questions that a sentence may answer, in the order in which their pieces are taken out of it."""
_PLANT = "|".join(f"<{kind}: {words}>" for words, kind in plants.QUANTITIES.values())
# <NUMBER> and the like in a pattern of a piece.
_MACROS = {**vars(grammar), **vars(plants), **vars(wishes), "PLANT": _PLANT}
_MACRO = re.compile(r"<([A-Z_]+|[a-z]+: [^<>]*)>")
_GROUP = re.compile(r"(?<!\\)\((?!\?)|\(\?P<\w+>")
_ENDS = re.compile(r"(?<!\bca)(?<!\bapprox)[,;:.](?:\s+|$)|\s+and\s+(?=(?:i|we|the)\b)", re.I)
_NEGATION = re.compile(r"\b(?:not?|never|without|except|unless|neither|nor|but)\b|n't\b", re.I)
# Words whose number is missing, or is none that is understood: to drop them would say something else.
_SIZED = re.compile(
    r"\b(?:dead time|delay|time constant|lag|react\w*|respon[ds]\w*|answers|"
    r"(?:(?:milli|micro)?second|minute|hour|day|night|week|month)s?|half|twice|doubled?|peak\S*)\b",
    re.I,
)
# The size of a device says nothing of its dynamics.
_RATED = re.compile(
    r"\b\d+(?:\.\d+)?\s*-?(?:k?W|k?VA?|A|hp|l|m3|litres?)\s+"
    r"(?:motor|drive|heater|pump|fan|supply|tank|boiler|radiator)\b",
    re.I,
)
_OTHER_LAWS = re.compile(r"\b(?:PD|P|I|LQG?|MPC)[- ](?:loop|controller|control|regulator)\b")
_JOINS = r"(?:for|of|in|with|a|an|the|my|our|i|we|have|is|and|to)"
_BARE = re.compile(rf"^(?:{_JOINS}\s+)*|(?:[\s,;.:]+{_JOINS}\b)*[\s,;.:]*$", re.I)
_WORD = r"(?!(?:is|are|was|has|have|does|do|will|must|should|may|can)\b)[a-z'-]+"
_ABOUT_WHAT = re.compile(
    r"[\s|]*(?:(?:(?:i|we) (?:have|want|need)|this is|it is|there is|consider|for)\b[\s|]*)?"
    rf"(?:{_WORD}(?:[\s|]+{_WORD}){{0,5}}|(?:the )?(?:less|shorter|sooner|faster) (?:is )?(?:the )?better)"
    r"[\s|]*",
    re.I,
)


@dataclass(frozen=True)
class Heard:
    """Holds what a sentence says: answers by question, and remarks on what answers none."""

    answers: dict[str, str]
    remarks: tuple[str, ...] = ()


def question_of(text: str) -> str | None:
    """Return the question that a text answers, by its first piece."""
    return next((key for key in _TURNS if any(re.search(one, text, re.I) for one, _ in _pieces(key))), None)


@cache
def _pieces(key: str) -> tuple[tuple[str, str], ...]:
    """Return the patterns of the pieces that answer a question, and what each piece says."""
    listed = [one if isinstance(one, list) else [one, ""] for one in question(key).pieces]
    return tuple((_expanded(pattern), template) for pattern, template in listed)


def _expanded(pattern: str) -> str:
    """Return a pattern in which <NUMBER> and the like stand for pieces of the grammar."""

    def piece(found: re.Match[str]) -> str:
        kind, _, words = found[1].partition(": ")
        made = "|".join(orders(words, kind)) if words else _expanded(_MACROS[kind])
        return f"(?:{_GROUP.sub('(?:', made)})"

    while _MACRO.search(pattern):
        pattern = _MACRO.sub(piece, pattern)
    return pattern


def in_sentence(text: str, least: int = 2) -> Heard:
    """Return the answers by question, or none if the text answers fewer questions than `least`.

    Raises:
        SpecError: `bad-answer` for what answers no question, where it has a number, a negation or a verb.
    """
    check_numbers(text, "plant")
    if other := _OTHER_LAWS.search(text):
        raise bad_answer("wish", f'"{other[0]}": settings are found for PI and PID')
    found: dict[str, list[tuple[int, str]]] = {}  # where each piece begins, and what it says
    left = BEYOND.sub(_taken, in_figures(text))
    for key in _TURNS:
        for pattern, template in _pieces(key):
            while piece := re.search(pattern, left, re.I):
                said = piece.expand(template or (r"\g<said>" if "said" in piece.re.groupindex else r"\g<0>"))
                found.setdefault(key, []).append((piece.start(), said.strip(" ,.")))
                left = left[: piece.start()] + _taken(piece) + left[piece.end() :]
    if len(found) < least:
        return Heard({})
    beside = [part for clause in _ENDS.split(left) for part in _left_over(clause)]
    answers = {key: ", ".join(dict.fromkeys(said for _, said in sorted(found[key]))) for key in found}
    remarks = [*beyond_models(text), *([f"nothing follows from: {', '.join(beside)}"] if beside else [])]
    if "wish" in answers and wishes.unbounded(answers["wish"]):
        answers["wish"] += " with a safe margin"
        remarks.append("no margin was named: a safe one is taken, 6 dB")
    return Heard(answers, tuple(remarks))


def _taken(piece: re.Match[str]) -> str:
    """Return what stands in the place of a piece, as long as it is: the part of it that is left."""
    rest = piece.groupdict().get("rest") or ""
    before = piece.start("rest") - piece.start() if rest else len(piece[0])
    return ("|".ljust(before) + rest).ljust(len(piece[0]), "|")


def _left_over(clause: str) -> list[str]:
    """Return the words of a clause that no piece has and that have content.

    Raises:
        SpecError: `bad-answer` where they may change the meaning of the rest.
    """
    parts = [part.strip() for part in clause.split("|") if unread(part)]
    understood = "|" in clause or not parts or _ABOUT_WHAT.fullmatch(clause)
    unsized = next((sized[0] for part in parts if (sized := _SIZED.search(part))), None)
    if unsized:
        raise bad_answer("plant", f'"{unsized}" has no number that is understood, as in "dead time 3 min"')
    rest = [_RATED.sub("", part) for part in parts]
    wrong = next((part for part in rest if re.search(r"\d", part) or _NEGATION.search(part)), None)
    if wrong or not understood:
        raise bad_answer("plant", f'"{wrong or clause.strip()}" is not understood')
    return [_BARE.sub("", part) for part in parts]


def spread(answers: Answers, sentence: str | None = None) -> bool:
    """Add what a sentence says to answers, of which none is replaced; return whether it says anything.

    Without a sentence the answer on the plant may be one.

    Raises:
        SpecError: `bad-answer` as `in_sentence`, or for a sentence that says nothing beside a plant.
    """
    known = sentence is not None and "plant" in answers.texts
    with answers.located():
        heard = in_sentence(sentence or answers.texts.get("plant", ""), least=1 if known else 2)
    if sentence is not None and not heard.answers:
        if known:
            raise bad_answer("wish", f'"{sentence}" is not understood')
        answers.texts["plant"] = sentence
    if heard.answers:
        if sentence is None:
            del answers.texts["plant"]
        answers.remarks.extend(heard.remarks)
    for key, text in heard.answers.items():
        if answers.texts.setdefault(key, text) is text and "plant" in answers.places:
            answers.places[key] = answers.places["plant"]
    return bool(heard.answers)
