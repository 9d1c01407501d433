"""A whole wish in a sentence, taken apart into the answers that its clauses give."""

from __future__ import annotations

import re

from inputdesign_cli.wizard.grammar import AMOUNT, NUMBER, PLUS_MINUS
from inputdesign_cli.wizard.plants import INTEGRATES
from inputdesign_cli.wizard.questions import Answers, bad_answer, question

_TURNS = ("wish", "noise", "plant", "hold", "converter", "return", "limits", "range", "time")
"""The questions that a clause may answer: the first of which it has a word."""
_PATTERNS = {"AMOUNT": AMOUNT, "INTEGRATES": INTEGRATES, "NUMBER": NUMBER, "PLUS_MINUS": PLUS_MINUS}
_FILE = re.compile(r"\s*(?:(?:time|[uy]\d*)\s*=|(?:step|log)\s+\S*\.\w)", re.I)  # and its columns
_WHAT = re.compile(r"\s*(?:for\s+)?(?:an?|the|my|our)\s+\w+(?:\s+\w+)?\s*", re.I)  # "a tank", for the reader
_LASTS = re.compile(rf"\s*\b(?:for|in|within|during)\s+({AMOUNT})\s*$", re.I)
_ENDS = re.compile(r"(?<!\bca)(?<!\bapprox)([,;:.])(?:\s+|$)|\s+and\s+(?=(?:i|we|the)\b)", re.I)


def question_of(clause: str) -> str | None:
    """Return the question that a clause answers, by the words in it."""
    if _FILE.match(clause):
        return "plant"
    return next((key for key in _TURNS if _found(question(key).clause, clause)), None)


def _found(pattern: str, clause: str) -> re.Match[str] | None:
    """Return the first match of a pattern, in which <NUMBER> and the like stand for pieces of the grammar."""
    return re.search(re.sub(r"<(\w+)>", lambda name: _PATTERNS[name[1]], pattern), clause, re.I)


def in_sentence(text: str) -> dict[str, str]:
    """Return the answers by question, or none if the text answers a single question at most.

    Raises:
        SpecError: `bad-answer` for a clause that answers no question.
    """
    found: dict[str, list[str]] = {}
    pieces, unread = _ENDS.split(text.strip()), []
    for clause, end in zip(pieces[::2], [*pieces[1::2], ""], strict=True):
        key = question_of(clause)
        lasts = _LASTS.search(clause) if key in ("wish", "range") else None
        if lasts is not None:
            clause = clause[: lasts.start()]
            found.setdefault("time", []).append(lasts[1])
        if key is None:
            known = end == ":" or _WHAT.fullmatch(clause) or not clause.strip()  # what it is about
            unread += [] if known else [clause]
            continue
        part = _found(question(key).part, clause)
        found.setdefault(key, []).append(part[0] if part else clause)
    if len(found) < 2:
        return {}
    if unread:
        raise bad_answer("plant", f'"{unread[0].strip()}" is not understood')
    if "return" in found:
        found["return"] = [
            "no" if re.search(r"\b(?:not?|never)\b", " ".join(found["return"]), re.I) else "yes"
        ]
    return {key: ", ".join(parts).strip() for key, parts in found.items()}


def spread(answers: Answers) -> bool:
    """Put the answers of a sentence in the place of the plant; return whether there is one.

    Raises:
        SpecError: `bad-answer` for a clause that answers no question.
    """
    with answers.located():
        found = in_sentence(answers.texts.get("plant", ""))
    if found:
        del answers.texts["plant"]
    for key, text in found.items():
        if answers.texts.setdefault(key, text) is text and "plant" in answers.places:
            answers.places[key] = answers.places["plant"]
    return bool(found)
