"""Find gains in a sentence: a change of the input, and the change of the output that it causes.

"10 % more makes it 2 degC warmer" and "2 degC for every 10 %" are both "gain 2 degC per 10 %". A gain
consists of two neighbouring sizes. The words around them show which is the cause, and the sign.
"""

from __future__ import annotations

import itertools
import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

_KNOWN = (
    r"deg[cf]|degrees?(?:\s+(?:c|celsius|f))?|celsius|kelvin|k|[mk]?v|volts?|m?a|amps?|amperes?|k?hz|rpm|m?bar|"
    r"[hkm]?pa|psi|[ckm]?m|(?:micro|milli|centi)?met(?:re|er)s?|m?l|lit(?:re|er)s?|t|kg|g|k?n|k?w|(?:kilo)?watts?|"
    r"rad|ph|ppm|per\s?cent"
)
UNIT = rf"(?:[^\W\d]*[%°³²][^\s,;|.]*|[^\W\d]+[³²]?/[^\W\d]+[³²]?|(?:{_KNOWN})(?![\w/³²]))"
"""A unit: with a sign as in "%" and "°C", with a slash as in "m/s", or a word that is known."""
_TIME = r"(?P<time>s|min|h|sec|seconds?|minutes?|hours?)\b"
_TOKEN = re.compile(
    rf"(?P<size>(?<![\w.])-?\d+(?:\.\d+)?(?:e[-+]?\d+)?(?:\s*(?P<unit>{UNIT})|\s*(?P<timed>{_TIME}|days?\b|shifts?\b|ms\b))?)"
    r"|(?P<word>[^\W\d]+(?:['-][^\W\d]+)*)|\S",
    re.I,
)
_RATE = re.compile(rf"\s*(?:/|\b(?:per|an?|each|every|in\s+(?:an?|one|1)|1)\b)\s*{_TIME}", re.I)
_SPEED = re.compile(rf"(?P<size>[^/]+)/{_TIME}", re.I)
_CLAUSE = re.compile(r"(?:[^;.|]|\.(?=\d))+")
_ONE_OF = re.compile(
    rf"\b(each|every|another|(?:an?|one)(?=\s+(?:extra|additional|more|further)))\s+"
    rf"(?:(?:extra|additional|more|further)\s+)?(?={UNIT})",
    re.I,
)
"""Words before a unit without a number, as in "each extra kilowatt"."""
_MORE_OF = re.compile(rf"(\d)\s+(extra|additional|more|further)\s+({UNIT})", re.I)
_NAMES = re.compile(r"\b(?:(?:pressure )?reducing|lower) valve\b", re.I)
"""Names of valves that do not describe a movement."""


def _stem(word: str) -> str:
    """Return a word in small letters without the ending of a verb."""
    word = word.lower()
    for ending in ("ing", "ed", "es", "s"):
        if len(word) > len(ending) + 2 and word.endswith(ending):
            word = word.removesuffix(ending)
            break
    return word.rstrip("e")


def _stems(words: str) -> frozenset[str]:
    return frozenset(map(_stem, words.split()))


_ABOUT = _stems("about around roughly approximately approx circa ca some nearly near ~ ≈")
_MORE = _stems("more further extra additional another each every")
_RISES = _stems(
    "rise raise increase grow climb go warm heat lift give make bring cause mean add let get become fill "
    "yield produce lead result change respond push speed move"
)
_FALLS = _stems("fall drop decrease lower reduce cool sink drain down lose loss decline empty emptier")
_LESS = _stems("less colder cooler slower smaller lower down emptier")
_GREATER = _stems("more hotter warmer faster higher larger greater up")
_CLOSING = _stems(
    "close shut reduce lower throttle decrease fall drop less down back smaller slower slow cut remove "
    "weaken withdraw missing"
)
_OPENING = _stems("open raise increase more further extra additional up")
_LEADS = _stems(
    "when if with for open close shut raise lower increase decrease reduce drop turn step move change each "
    "every"
)
"""Words that begin a change of the input, as in "when the valve opens 10 %"."""
_LINKS = _stems("per for when if with")
_STANDS = _stems("at around near")
_NOUNS = {"drop", "fall", "decline", "loss", "decrease"}
_LETS = _stems("let make cause")
_STATES = _stems("get become")  # verbs before a comparative, as in "gets 2 degC warmer"
_ARTICLES = {"the", "a", "an", "my", "our"}
_NEVER = _stems(
    "may might can could must should would not never no cannot allowed most within between before than until "
    "but noise scatter margin limit peak kp ti gain integrates least reach used hope last "
    "year yesterday ago earlier once"
)
"""Words that no gain contains: possibility, negation, and sizes of something else."""
_CAUSAL = _stems(
    "give make bring cause mean add let yield produce lead result raise lift lower heat cool warm increase "
    "reduce drop"
)
_BEHIND = re.compile(
    r"(?:\s+(?:more|further|extra|less|up|down|open|"
    r"(?:hott|warm|cold|cool|fast|slow|high|low|larg|small|great)er)\b)*"
)
_PLAIN = _stems(
    "the a an my our it its this that of by in to i we you and so then is are be some opening valve heater "
    "pump heating voltage power steam fan drive input output level temperature pressure percent"
)
_UNDERSTOOD = (
    _PLAIN | _RISES | _FALLS | _LESS | _GREATER | _MORE | _CLOSING | _LEADS | _LINKS | _STANDS | _ABOUT
)
"""Words of a gain that are understood; others are returned in a remark."""
_MOST_BETWEEN = 5  # words between an unmarked cause and the verb
# Units whose quotient by time is no ramp of an output, and words for quantities that are speeds themselves.
_FLOWS = {"l", "ml", "t", "kg", "g", "m³", "rad", "deg", "°", "rev"}
_SPEEDS = _stems("speed velocity flow throughput faster slower")
_GROWING = _stems("rise grow increase climb go fill move fall drop drain sink")


@dataclass(frozen=True)
class _Token:
    """Holds a word, a sign or a number with its unit, and its place in the text."""

    text: str
    begin: int
    end: int
    size: bool
    unit: str

    @property
    def stem(self) -> str:
        return _stem(self.text)


@dataclass(frozen=True)
class Gain:
    """Holds the place of a gain in a text, and its standard form."""

    begin: int
    end: int
    form: str
    assumed: str  # the size that is taken as the change of the input without a word for it


def in_one_form(text: str) -> str:
    """Return a text with "gain 2 degC per 10 %", or "rises by 2 cm per min per 10 %", for all its gains."""
    text = _ONE_OF.sub(r"\1 1 ", _MORE_OF.sub(r"\1 \3 \2", _NAMES.sub("valve", text)))
    for gain in reversed(list(gains(text))):
        text = f"{text[: gain.begin]}{gain.form}{text[gain.end :]}"
    return text


def gains(text: str) -> Iterator[Gain]:
    """Find the gains of a text, from left to right."""
    for clause in _CLAUSE.finditer(text):
        tokens = [
            _Token(one[0], one.start(), one.end(), bool(one["size"]) and not one["timed"], one["unit"] or "")
            for one in _TOKEN.finditer(text, *clause.span())
        ]
        sizes, taken = [i for i, one in enumerate(tokens) if one.size], -1
        for first, second in itertools.pairwise(sizes):
            if first > taken and (found := _Pair.of(text, tokens, first, second).gain) is not None:
                taken = second
                yield found


@dataclass(frozen=True)
class _Pair:
    """Holds two neighbouring sizes, and the words around them up to the next comma or size."""

    text: str
    first: _Token
    second: _Token
    rate: re.Match[str] | None  # "per minute" behind the first
    before: list[_Token]
    between: list[_Token]
    behind: list[_Token]
    per_third: bool  # the second is per a third: "rises 2 cm for 5 %"

    @classmethod
    def of(cls, text: str, tokens: Sequence[_Token], first: int, second: int) -> _Pair:
        """Return two neighbouring sizes among the tokens of a clause."""
        begin = next((i + 1 for i in range(first - 1, -1, -1) if tokens[i].text in ",:" or tokens[i].size), 0)
        after = tokens[second + 1 :]
        end = next((i for i, one in enumerate(after) if one.size or one.text == ","), len(after))
        behind, rate = list(after[:end]), _RATE.match(text, tokens[first].end)
        between = [one for one in tokens[first + 1 : second] if rate is None or one.begin >= rate.end()]
        stems = {one.stem for one in behind}
        per_third = end < len(after) and after[end].size and bool(stems & _LINKS) and not stems & _NEVER
        pair = tokens[first], tokens[second]
        return cls(text, *pair, rate, list(tokens[begin:first]), between, behind, per_third)

    @property
    def gain(self) -> Gain | None:
        """Return the gain that the two sizes state; None if they state none."""
        signs = (one for one in (*self.before[-1:], *self.between, *self.behind[:1]) if not one.size)
        if {one.stem for one in (*self.before, *self.between)} & _NEVER or any(
            set(one.text) & set("+-±–:=") for one in signs
        ):
            return None
        if any(one.text.lower() in ("to", "from") for one in (*self.before[-1:], *self.between[-1:])):
            return None  # an end point is no change
        link = next((i for i, one in enumerate(self.between) if one.stem in _LINKS), None)
        if link is not None:
            return self._effect_first(link)
        return None if self.rate or self.per_third else self._cause_first()

    def _effect_first(self, link: int) -> Gain | None:
        """Return the gain of "rises 2 cm when the valve opens 5 %"."""
        effect, cause, verb = self.first, self.second, next(reversed(_verbs(self.before)), None)
        per = self.between[link].stem in ("per", "for")
        marked = any(one.stem in _MORE for one in (*self.between, *self.behind[:1]))
        if verb is None and not (marked and self.between[link].stem == "for"):
            return None
        if per and any(one.stem not in _UNDERSTOOD for one in self.between[link:]):
            return None
        stands = verb is not None and self.rate is None and self.before[-1].stem in _STANDS
        if not cause.unit or stands or (cause.unit == effect.unit and not marked):
            return None
        does = [] if verb is None else self.before[verb:]
        of_cause = [*self.between[link:], *self.behind[:2]]
        return self._written(effect, cause, does, self.between[:link], of_cause, "")

    def _cause_first(self) -> Gain | None:
        """Return the gain of "when the valve opens 5 % the level rises 2 cm"."""
        cause, effect, before, between = self.first, self.second, self.before, self.between
        lead = next((i for i, one in enumerate(before) if one.stem in _LEADS and _free(before, i)), None)
        more = any(one.stem in _MORE | _stems("less") for one in (*between[:2], *before))
        verbs, marked = _verbs(between), lead is not None or more
        verb = verbs[-1] if verbs else None
        compared = bool(self.behind) and self.behind[0].stem in _GREATER | _LESS
        if not cause.unit or (cause.unit == effect.unit and not marked):
            return None
        if verb is None and not (more and compared):
            return None
        if not effect.unit and "by" not in {one.stem for one in between[-2:]}:
            return None
        near = before[-1:] if before and before[-1].stem in _STANDS | _ABOUT | {"by"} else []
        if not marked:
            direct = verbs[:1] == [0] or between[0].stem in ("of", "on")
            causal = bool(verbs) and verbs[0] <= _MOST_BETWEEN and between[verbs[0]].stem in _CAUSAL
            if near or not (direct and causal) or any(one.stem in _CLOSING for one in before):
                return None
        start = near if lead is None else before[lead:]
        does, of_cause = (
            ([], [*start, *between]) if verb is None else (between[verb:], [*start, *between[:verb]])
        )
        return self._written(effect, cause, does, self.behind, of_cause, "" if marked else cause.text)

    def _written(
        self,
        effect: _Token,
        cause: _Token,
        does: list[_Token],
        compared: list[_Token],
        moved: list[_Token],
        assumed: str,
    ) -> Gain | None:
        """Write the gain in one form, or return None if its sign is not clear.

        Args:
            does: the words on the effect from its verb on; `compared`: the words behind its size.
            moved: the words on the cause.
        """
        rate, behind = self.rate or _RATE.match(self.text, effect.end), compared[0].stem if compared else ""
        if does and does[0].stem in _STATES and not (rate or behind in _LESS | _GREATER):
            return None  # "it gets 70 degC" is no change
        negative = _negative(effect, cause, does, compared, moved)
        if negative is None:
            return None
        time, size = (rate["time"], effect.text) if rate else self._ramp(effect, behind)
        touching = (self.text[: one.begin].rstrip() for one in (effect, cause))
        about = any(_stem(re.split(r"\s", words)[-1]) in _ABOUT for words in touching)
        begin = min(one.begin for one in (effect, cause, *does, *moved))
        end = max(effect.end, cause.end, rate.end() if rate else 0)
        of_rate = rate.span() if rate else (end, end)
        beside = [
            one.text
            for one in sorted({*does, *compared, *moved}, key=lambda one: one.begin)
            if begin <= one.begin < end
            and not of_rate[0] <= one.begin < of_rate[1]
            and one.stem not in _UNDERSTOOD
        ]
        what = f"{'rises by' if time else 'gain'} {'about ' * about}{'-' * negative}{size.lstrip('-')}"
        form = f"{what}{f' per {time}' * bool(time)} per {cause.text.lstrip('-')}"
        comparatives = _BEHIND.match(self.text, end)
        return Gain(begin, comparatives.end() if comparatives else end, " ".join([*beside, form]), assumed)

    def _ramp(self, effect: _Token, behind: str) -> tuple[str, str]:
        """Return the time and the size of "rises 2 cm/s"; no time for "gives 2 m/s", which is a speed."""
        speed, stems = _SPEED.fullmatch(effect.unit), {one.stem for one in (*self.before, *self.between)}
        if (
            speed is None
            or speed["size"].lower() in _FLOWS
            or {*stems, behind} & _SPEEDS
            or not stems & _GROWING
        ):
            return "", effect.text
        return speed["time"], f"{effect.text[: -len(effect.unit)]}{speed['size']}"


def _negative(
    effect: _Token, cause: _Token, does: list[_Token], compared: list[_Token], moved: list[_Token]
) -> bool | None:
    """Return whether a gain is negative; None if that is not clear. The arguments are as in `_written`."""
    # "makes the cooler warmer", "10 degC of cooling": the word may be a name, or give the sign.
    if any(one.stem in _FALLS | _LESS for one in (*does[1:], *compared[1:3])):
        return None
    falls = any(one.stem in _LESS for one in compared[:1]) or any(one.stem in _FALLS for one in does[:1])
    closes = any(one.stem in _CLOSING and _free(moved, i) for i, one in enumerate(moved))
    opens = any(
        one.stem in _OPENING and not (i + 1 < len(moved) and moved[i + 1].stem in _CLOSING)
        for i, one in enumerate(moved)
    )
    if closes and opens:  # "opening the valve that is closed", "5 % more in the lower tank"
        return None
    return sum((falls, closes, effect.text.startswith("-"), cause.text.startswith("-"))) % 2 == 1


def _verbs(words: Sequence[_Token]) -> list[int]:
    """Return the places of the verbs that may describe the output.

    No such verb follows an article. "drop" is a verb in "lets it drop", a noun in "raises the pressure drop".
    """
    found = list[int]()
    for i, one in enumerate(words):
        noun = one.text.lower() in _NOUNS and any(words[j].stem not in _LETS for j in found)
        adjective = one.text.lower() in ("lower", "cooler")
        if one.stem in _RISES | _FALLS and _free(words, i) and not (noun or adjective):
            found.append(i)
    return found


def _free(words: Sequence[_Token], at: int) -> bool:
    """Return whether a word has no article before it, unlike "lower" in "the lower valve"."""
    return at == 0 or words[at - 1].text.lower() not in _ARTICLES
