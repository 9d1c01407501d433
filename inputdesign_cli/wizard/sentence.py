"""A whole wish in a sentence, taken apart into pieces that answer questions.

Other parts are asked for in other words if they may matter, and else returned in a remark.
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from functools import cache

from inputdesign_cli.errors import Diagnostic, SpecError
from inputdesign_cli.wizard import grammar, plants, wishes
from inputdesign_cli.wizard.grammar import (
    BEYOND,
    beyond_models,
    check_numbers,
    in_figures,
    orders,
    taken_as,
    unread,
)
from inputdesign_cli.wizard.questions import KEYS, Answers, bad_answer, in_other_words, question

_TURNS = (
    *("loop", "wish", "drift", "noise", "plant", "hold", "signals"),
    *("converter", "return", "limits", "range", "names", "time"),
)
"""The questions that a sentence may answer, in the order in which their pieces are taken out of it."""
_QUANTITIES = {name: f"<{kind}: {words}>" for name, (words, kind) in plants.QUANTITIES.items()}
_PLANT = "|".join(_QUANTITIES.values())
# Values of <NUMBER> and the like in a pattern of a piece.
_MACROS = {**vars(grammar), **vars(plants), **vars(wishes), "PLANT": _PLANT}
_MACRO = re.compile(r"<([A-Z_]+|[a-z]+: [^<>]*)>")
_GROUP = re.compile(r"(?<!\\)\((?!\?)|\(\?P<\w+>")
_ENDS = re.compile(r"(?<!\bca)(?<!\bapprox)[,;:.](?:\s+|$)|\s+and\s+(?=(?:i|we|the)\b)", re.I)
# A rest is asked for again if it has a number or a negation, or words whose number is missing.
_MATTERS = re.compile(
    r"\d|^%|^one\b|n't\b|\b(?:two|three|four|five|six|eight|ten|twelve|twenty|thirty|"
    r"not?|never|without|except|unless|neither|nor|but|minus|negative|opposite|revers\w*|"
    r"invers\w*|clos(?:e|es|ed|ing)|shut\w*|reduc\w*|less(?! is)|unstable|off|manual|slower|faster|times|"
    r"factor|accura\w*|uncertain\w*|guess\w*|total|overall|upwards?|downwards?|PRBS|binary|weekend|overnight|"
    r"dead time|delay|time constant|lag|gain|react\w*|respon[ds]\w*|answers|cannot|or|pp|p-p|negligible|"
    r"hardly|range|span|band|old|had|used|hope|expect\w*|perhaps|might|predict\w*|humidity|"
    r"(?:(?:milli|micro)?second|minute|hour|day|night|week|month|morning|afternoon|evening)s?|half|twice|doubled?|"
    r"peak\S*|columns|cols|sampl(?:e|ing) time)\b|\w\s*=",
    re.I,
)
# Words that need no remark where the rest of their clause is understood.
_PLAIN = (
    "am allowed move moves moved voltage valve heater pump where started begins began start run runs running "
    "we just only like which that when after happens sits stands use keep has some per almost"
)
# Words of a clause on the time available for the experiment.
_OF_TIME = re.compile(
    r"(?:experiment|test|trial|record)\w*|time|available|free|plant|have|got|i've|we've|i'd|get|gets|spend|use|give|"
    r"most|least|max(?:imum)?|long(?:er|est)?|no|not|more|than|up|less|fine|okay?|enough|total|altogether|all|within|"
    r"during|over|last|run|runs|there's|duration|only|just|roughly|but|loop|pid?|\W+",
    re.I,
)
# The size of a device, which does not describe its dynamics.
_RATED = re.compile(
    r"\b\d+(?:\.\d+)?\s*-?(?:k?W|k?VA?|A|hp|l|m3|litres?)\s+"
    r"(?:(?:DC|AC|brush(?:ed|less)|electric|three-phase|servo)\s+)*"
    r"(?:motor|drive|heater|pump|fan|supply|tank|boiler|radiator)\b"
    r"|\b(?:motor|drive|heater|pump|fan|tank|boiler|radiator)\s+(?:has|is|of|with)\s+\d+(?:\.\d+)?\s*"
    r"(?:k?W|k?VA?|A|hp|l|m3|litres?)\b",
    re.I,
)
# A move with a negative sign: "closing the valve by 5 %", "when the valve closes 5 %", "gives 20 degC less".
_LESS = re.compile(
    rf"^(?:when |if )?(?:(?:i|we|the {grammar.DRIVE}) )?(?:(?:is|are) )?"
    r"(?:clos|shut|lower|reduc(?!ing valve))\w*"
    r"|(?<=when |..if )(?:[a-z]+\s+){0,4}?(?:closes?|closed|shuts?|reduces?|reduced|lowers|lowered)\b"
    r"|\bless$",
    re.I,
)
# Names of the output: "PI level loop", "temperature noise", "raises the level", "noise of the speed".
_CONTROLLED = re.compile(
    rf"\b({grammar.SIGNAL})\s+(?:loop|control(?:ler)?|regulator|noise|scatters|(?:has|with)\s+\S+\s+\S*\s*noise)\b"
    rf"|\b(?:{grammar.UP}|noise (?:of|on|in))\s+the\s+({grammar.SIGNAL})\b"
    # A speed, a position or a flow that is controlled may be the input of another loop.
    rf"|(?:^|[,;.]\s+|\b(?:the|my|our|room|tank|water)\s+)((?!speed|position|flow){grammar.SIGNAL})\s+is\s+controlled\s+by\b",
    re.I,
)
_OTHER_LAWS = re.compile(
    r"\b(?!I control\b(?! loop))(?:PD|P|I|LQG?|MPC)(?:[- ]only)?[- ](?:loop|controller|control|regulator)\b"
)
_JOINS = r"(?:for|of|in|with|after|within|a|an|the|my|our|i|we|have|is|and|to)"
_BARE = re.compile(rf"^(?:{_JOINS}\s+)*|(?:[\s,;.:]+{_JOINS}\b)*[\s,;.:]*$", re.I)


@dataclass(frozen=True)
class Heard:
    """Holds the content of a sentence: answers by question, and remarks on parts that answer none.

    `unclear` are parts that are not understood, and may change the meaning of the rest.
    """

    answers: dict[str, str]
    remarks: tuple[str, ...] = ()
    unclear: tuple[str, ...] = ()


def question_of(text: str) -> str | None:
    """Return the question that a text answers, by its first piece."""
    return next((key for key in _TURNS if any(re.search(one, text, re.I) for one, _ in _pieces(key))), None)


@cache
def _pieces(key: str) -> tuple[tuple[str, str], ...]:
    """Return the patterns of the pieces that answer a question, and templates of their answers."""
    listed = [one if isinstance(one, list) else [one, ""] for one in question(key).pieces]
    return tuple((_expanded(pattern), template) for pattern, template in listed)


@cache
def _unwanted() -> re.Pattern[str]:
    """Return the pattern of wishes that are negated, as in "avoid two levels": it answers no question."""
    levels = "|".join(pattern for pattern, _ in _pieces("signals"))
    return re.compile(
        r"\b(?:avoid\w*\b|(?:do not|don't|must not|should not|never|can ?not|can't)"
        r"\s+(?:use|want|like|take|play|apply)\b"
        rf"|(?:no|not|without|than|instead of|anything but)\s+(?:(?:an?|any|the)\s+)?(?=(?:{levels}))"
        rf"|(?=(?:{levels})(?:\s+signals?)?\s+(?:is|are)\s+(?:not|never|no|forbidden|excluded)\b))"
        r"(?:[^,;.|]|\.(?=\d))*",
        re.I,
    )


def _expanded(pattern: str) -> str:
    """Return a pattern in which <NUMBER> and the like stand for pieces of the grammar.

    Groups of a piece have no names, unless the piece is the whole pattern.
    """
    if pattern[1:-1] in _MACROS:
        pattern = _MACROS[pattern[1:-1]]

    def piece(found: re.Match[str]) -> str:
        kind, _, words = found[1].partition(": ")
        made = "|".join(orders(words, kind)) if words else _expanded(_MACROS[kind])
        return f"(?:{_GROUP.sub('(?:', made)})"

    while _MACRO.search(pattern):
        pattern = _MACRO.sub(piece, pattern)
    return pattern


@cache
def _behind_a_gain() -> tuple[re.Pattern[str], re.Pattern[str], re.Pattern[str]]:
    """Return the patterns of times behind a gain, of times that are named, and of a dead time."""
    time = r"(?:<ABOUT>\s*)?(?:<NUMBER>\s*(?:to|-|–)\s*)?<AMOUNT>(?=\s*(?:[,;.]|$|(?:and|after|with|but)\b))"
    joined = (
        r"(?:\s+more(?:\s+<DRIVE>)?)?[,;.]?\s+(?:(?:and|after|within|in|with|it|that|takes|slowly,?)\s+)*"
    )
    gain = f"{_QUANTITIES['gain']}|<BARE_GAIN>"
    times = (
        rf"(?:{gain})<UNIT>{joined}(?P<lag>{time})(?:[,;]\s+(?:(?:and|after|with|but)\s+)*(?P<late>{time}))?"
    )
    named = "|".join(_QUANTITIES[name] for name in ("rise", "slope", "time_constant"))
    late = f"{_QUANTITIES['dead_time']}|<NO_DELAY>"
    one, two, three = (re.compile(_expanded(pattern), re.I) for pattern in (times, named, late))
    return one, two, three


def _with_names(text: str) -> tuple[str, list[str]]:
    """Name times behind a gain, as in "gain 1.7 degC/%, 262 s, 31 s", and return remarks on them."""
    times, named, late = _behind_a_gain()
    found = times.search(text)
    if found is None or named.search(text):
        return text, []
    names = {"lag": "time constant"}
    if found["late"] and not late.search(text):
        names["late"] = "dead time"
    for group in reversed(names):
        text = f"{text[: found.start(group)]}{names[group]} {text[found.start(group) :]}"
    return in_figures(text), [
        f"{found[group]}, behind the gain, is taken as the {name}" for group, name in names.items()
    ]


def in_sentence(text: str, least: int = 2) -> Heard:
    """Return the answers by question, or none if the text answers fewer questions than `least`.

    Raises:
        SpecError: `bad-answer` for implausible numbers, and for controllers other than PI and PID.
    """
    check_numbers(text, "plant")
    if other := _OTHER_LAWS.search(text):
        raise bad_answer("wish", f'"{other[0]}": settings are found for PI and PID')
    found: dict[str, list[tuple[int, str]]] = {}  # the places and the answers of pieces
    said, named = _with_names(in_figures(text))
    left = grammar.OUTPUT_RESTS.sub(_taken, BEYOND.sub(_taken, said))
    unwanted = [part[0].strip() for part in _unwanted().finditer(left)]
    left = _unwanted().sub(_taken, left)
    pieces = [(key, *piece) for key in _TURNS for piece in _pieces(key)]
    # Names of files and columns come first: "good.csv" states no margin.
    for key, pattern, template in sorted(pieces, key=lambda piece: r"\S+\." not in piece[1]):
        while piece := _first(pattern, left, key):
            says = piece.expand(template or (r"\g<said>" if "said" in piece.re.groupindex else r"\g<0>"))
            rest = _taken(piece)
            if key == "plant" and " per " in says and (less := _LESS.search(piece[0])):
                says = f"{says.removesuffix(' less')} less"
                rest = rest.replace(less[0], "").ljust(len(rest), "|")
            found.setdefault(key, []).append((piece.start(), says.strip(" ,.")))
            left = left[: piece.start()] + rest + left[piece.end() :]
    if len(found) < least:
        return Heard({})
    if "wish" in found and any(wishes.PRECISE.search(said) for _, said in found["wish"]):  # "of a flow loop"
        found["wish"] = [one for one in found["wish"] if not wishes.NAMES_A_LOOP.fullmatch(one[1])]
    parts = [part.strip() for clause in _ENDS.split(left) for part in clause.split("|") if unread(part)]
    parts = [part for part in parts if part.lower() != "but"]
    unclear = unwanted + [part for part in parts if _MATTERS.search(_RATED.sub("", part))]
    beside = [_BARE.sub("", part) for part in parts if part not in unclear and re.search(r"[\w%]", part)]
    answers = {key: ", ".join(dict.fromkeys(said for _, said in sorted(found[key]))) for key in found}
    beside = [" ".join(_of_content(part)) for part in beside if _of_content(part)]
    said_already = " ".join(answers.values())
    beside = [
        part for part in beside if not re.search(rf"(?<!\w){re.escape(part)}(?!\w)", said_already, re.I)
    ]
    for word in [part for part in beside if re.fullmatch(grammar.ABOUT, part, re.I)]:
        beside.remove(word)
        if "plant" in answers:  # "gain 2, time constant 3 min, roughly"
            answers["plant"] += f", {word}"
    remarks = [
        *named,
        *taken_as(text),
        *beyond_models(text),
        *(f"{part}: assess takes that in --operating-point" for part in grammar.of_outputs(said)),
        *([f"words without effect on the spec: {', '.join(beside)}"] if beside else []),
    ]
    remarks += _of_the_wish(answers.get("wish", ""), text)
    controlled = {(one[1] or one[2] or one[3]).lower() for one in _CONTROLLED.finditer(text)}
    in_words = re.match(r"(?!log |step )\S+ ", answers.get("plant", ""))  # neither a file nor a template
    if in_words and len(controlled) == 1 and not controlled & {"output", "sensor", "measurement"}:
        answers.setdefault("names", *controlled)  # a log has a column of that name
    if "wish" in answers and wishes.unbounded(answers["wish"]):
        answers["wish"] += " with a safe margin"
        remarks.append("no margin was named: a safe one is taken, 6 dB")
    return Heard(answers, tuple(remarks), tuple(part.replace(grammar.UNREAD, "") for part in unclear))


def _of_content(part: str) -> list[str]:
    """Return the words of a part of a sentence that have content and need a remark."""
    words = (word.strip(",;:()") for word in part.split())
    return [word for word in words if unread(word) and word.lower() not in _PLAIN.split()]


def _first(pattern: str, text: str, key: str) -> re.Match[str] | None:
    """Return the first piece of a text that answers a question; a time answers none in a foreign clause."""
    found = re.finditer(pattern, text, re.I)
    return next((one for one in found if key != "time" or _of_experiment(one, text)), None)


def _of_experiment(piece: re.Match[str], text: str) -> bool:
    """Return whether a clause with a time has only words about an experiment and its length."""
    begin, end = piece.span("said") if "said" in piece.re.groupindex else piece.span()
    if re.search(r"\|\s*$", text[: piece.start()]) and re.match(r"(?:with)?in\b", piece[0], re.I):
        return False  # "it rises by 2 degC within 5 min"
    before, behind = re.split(r"[,;:|]|\.\s", text[:begin])[-1], re.split(r"[,;:|]|\.(?:\s|$)", text[end:])[0]
    return all(_OF_TIME.fullmatch(word) for word in unread(f"{before} {behind}"))


def _of_the_wish(wish: str, text: str) -> list[str]:
    """Return remarks on how a wish is taken if it goes beyond the text."""
    found = []
    if wish.count("parameters within") > len(re.findall(r"\bparameters\b", text, re.I)):
        found.append("every parameter is to be known within the smallest per cent that was named")
    if re.search(r"\bKp\b", wish, re.I) and not re.search(r"\bown\b|\bmy\b", text, re.I):
        found.append("the loop that is to keep the margin has the Kp that was named; no rule tunes it")
    return found


def _taken(piece: re.Match[str]) -> str:
    """Return the text in place of a piece, of the same length: the part of it that is left."""
    rest = piece.groupdict().get("rest") or ""
    before = piece.start("rest") - piece.start() if rest else len(piece[0])
    return ("|" * before + rest).ljust(len(piece[0]), "|")


def not_understood(*parts: str) -> SpecError:
    """Return the error about all parts of a sentence that are not understood, each with its question."""

    def about(part: str) -> Diagnostic:
        key = next((key for key in KEYS if re.search(rf"\b{key}\b", part, re.I)), "plant")
        hint = f"say {in_other_words(part).allowed}, or leave it out"
        return Diagnostic("bad-answer", f'"{part}" is not understood', hint=hint, key=key)

    return SpecError(list(map(about, parts)))


def spread(answers: Answers, sentence: str | None = None) -> bool:
    """Add the answers of a sentence to answers, of which none is replaced.

    Return whether it answers more than the question about the plant.

    Without a sentence the answer on the plant may be one.

    Raises:
        SpecError: `bad-answer` as `in_sentence`, or for a sentence without answers beside a plant.
    """
    known = sentence is not None and "plant" in answers.texts
    with answers.located():
        heard = in_sentence(sentence or answers.texts.get("plant", ""), least=1)
    if sentence is not None and not heard.answers:
        if known:
            raise bad_answer("wish", f'"{sentence}" is not understood')
        answers.texts["plant"] = sentence
    if heard.answers:
        if sentence is None:
            del answers.texts["plant"]
        answers.remarks.extend(heard.remarks)
        answers.unclear.extend(heard.unclear)
    for key, text in heard.answers.items():
        if answers.texts.setdefault(key, text) is text and "plant" in answers.places:
            answers.places[key] = answers.places["plant"]
    return bool(heard.answers.keys() - {"plant"})
