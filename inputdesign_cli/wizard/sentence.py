"""A whole wish in a sentence, taken apart into the answers that its clauses give."""

from __future__ import annotations

import re

from inputdesign_cli.wizard.grammar import AMOUNT, NUMBER, PLUS_MINUS
from inputdesign_cli.wizard.questions import Answers, bad_answer

# The question that a clause answers: the first of which it has a word.
_WORDS = {
    "wish": r"\b(?:loop|margin|Kp|Ti|Td|predict\w*|parameters?|bode|frequency response)\b",
    "noise": r"\b(?:nois\w*|fad\w*|white|drift\w*|standard deviation|std|sensor|lasts)\b|\brest \S+\.\w+",
    "plant": r"\b(?:gain|time constant|dead time|delay|lag|integrat\w*|each)\b",
    "hold": r"\b(?:keeps?|holds?|dwell\w*|at least|shortest)\b",
    "converter": r"\b(?:steps?|bits|resolution)\b",
    "return": r"\b(?:returns?|back|ends? where)\b",
    "limits": r"\b(?:rate|output)\b",
    "range": rf"{PLUS_MINUS}|\b(?:may|can) (?:be )?move|\baround\b|{NUMBER}\s*\S*\s+to\s+{NUMBER}",
    "time": rf"\b{AMOUNT}",
}
# What is taken of a clause where it is not all.
_PART = {"hold": AMOUNT, "time": AMOUNT, "converter": r"(?:\b\d+ bits|\bsteps?|\bresolution)\b.*"}
_FILE = re.compile(r"\s*(?:(?:time|[uy]\d*)\s*=|(?:step|log)\s+\S*\.\w)", re.I)  # and its columns
_LASTS = re.compile(rf"\s*\b(?:for|in|within|during)\s+({AMOUNT})\s*$", re.I)
_ENDS = re.compile(r"(?<!\bca)(?<!\bapprox)([,;:.])(?:\s+|$)|\s+and\s+(?=(?:i|we|the)\b)", re.I)


def in_sentence(text: str) -> dict[str, str]:
    """Return the answers by question, or none if the text answers a single question at most.

    Raises:
        SpecError: `bad-answer` for a clause that answers no question.
    """
    found: dict[str, list[str]] = {}
    pieces, unread = _ENDS.split(text.strip()), []
    for clause, end in zip(pieces[::2], [*pieces[1::2], ""], strict=True):
        words = _WORDS if not _FILE.match(clause) else {"plant": ""}
        key = next((key for key, known in words.items() if re.search(known, clause, re.I)), None)
        lasts = _LASTS.search(clause) if key in ("wish", "range") else None
        if lasts is not None:
            clause = clause[: lasts.start()]
            found.setdefault("time", []).append(lasts[1])
        if key is None:
            unread += [clause] * bool(clause.strip() and end != ":")  # before a colon stands what it is about
            continue
        part = re.search(_PART.get(key, ".*"), clause, re.I)
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
