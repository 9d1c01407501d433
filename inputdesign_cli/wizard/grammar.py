"""One grammar of answers: words, a number behind or before them, and its unit. No word may stay unread.

Text that cannot be read is a SpecError `bad-answer`.
"""

from __future__ import annotations

import math
import re
from dataclasses import dataclass

from inputdesign_cli.wizard import gains
from inputdesign_cli.wizard.gains import in_one_form
from inputdesign_cli.wizard.questions import bad_answer

# Squares of sizes beyond these would overflow or vanish.
LARGEST, SMALLEST = 1e15, 1e-15
_DIGITS = r"(?:\d+(?:\.\d*)?|\.\d+)(?:[eE][-+]?\d+)?"
NUMBER = rf"([-+]?{_DIGITS})"
UNREAD = "_"
"""A mark before a number that answers no question."""
ALONE = r"(?<![\w.])"  # before a number that is no part of another
PLUS_MINUS = r"(?:plus(?:/| or | )minus|give or take|\+/?-|±)"
# The unit of a number: "%", "bar", "degC", "m/s"; not a word of the answers.
_UNIT = r"(?:[^\s,;|.:+±]|[.:](?=[^\s|]))"  # a character of a unit
_NO_UNIT = "to|around|about|at|by|and|up|over|per|within|not|no|never|white|peak|may|can|must"
UNIT = rf"(?:\s*(?!(?:{_NO_UNIT})\b)(?![\d+±.-]){_UNIT}+)?"
_PER_CENT = r"\s*(?:%|per ?cent\b)"
ABOUT = r"(?:\b(?:about|around|roughly|approximately|approx|circa|ca|some|nearly|near)\b\.?|~|≈)"
OF = rf"\s*(?:,\s+(?={ABOUT})|(?:of|is)\b\s*|{ABOUT}\s*|[:=]\s*)*"
_SHARE_UNIT = r"(?:\s*(?P<share_unit>ms|s|sec|min|h)\b)?"
WITHIN = (
    rf"(?:\s*(?:within|{PLUS_MINUS})\s*(?P<share>[-+]?{_DIGITS})"
    rf"(?:(?P<per_cent>{_PER_CENT}(?P<itself>\s+itself\b)?)|{_SHARE_UNIT}"
    r"(?=\s*(?:[,;.:|)]|$|(?:and|with)\b))))?"
)
_MINUTE, _HOUR, _SHIFT, _DAY = 60.0, 3600.0, 28800.0, 86400.0
VAGUE = 0.2
"""The largest relative error that is assumed of a value with "about"."""
_TIMES = {"us": 1e-6, "microsecond": 1e-6, "ms": 1e-3, "msec": 1e-3, "millisecond": 1e-3, "s": 1.0,
          "sec": 1.0, "second": 1.0, "min": _MINUTE, "minute": _MINUTE, "h": _HOUR, "hr": _HOUR,
          "hour": _HOUR, "shift": _SHIFT, "d": _DAY, "day": _DAY, "week": 7 * _DAY}  # fmt: skip
_FREQUENCIES = {"rad/s": 1.0, "rad/min": 1.0 / _MINUTE, "rad/h": 1.0 / _HOUR, "mhz": 2e-3 * math.pi,
                "hz": 2.0 * math.pi, "khz": 2e3 * math.pi}  # fmt: skip
# Groups of units whose differences convert into each other, in the first unit of each: a degree is a kelvin.
_ALIKE: tuple[dict[str, float], ...] = (
    {"k": 1.0, "kelvin": 1.0, "mk": 1e-3, "degc": 1.0, "°c": 1.0, "celsius": 1.0, "degf": 5 / 9, "°f": 5 / 9},
    {"%": 1.0, "percent": 1.0},
    {"v": 1.0, "volt": 1.0, "volts": 1.0, "mv": 1e-3, "kv": 1e3},
    {"a": 1.0, "ma": 1e-3},
    {"bar": 1.0, "mbar": 1e-3, "pa": 1e-5, "kpa": 1e-2},
    {"m": 1.0, "cm": 1e-2, "mm": 1e-3},
    {"w": 1.0, "kw": 1e3},
    {"rad/s": 1.0, "rpm": math.pi / 30.0, "1/min": math.pi / 30.0, "deg/s": math.pi / 180.0},
)
# "a minute", "half an hour", "two shifts": words in place of numbers.
_COUNTED = {"half an": 0.5, "half a": 0.5, "an": 1, "a": 1, "one": 1, "two": 2, "three": 3, "four": 4,
            "five": 5, "six": 6, "seven": 7, "eight": 8, "nine": 9, "ten": 10, "twelve": 12, "fifteen": 15,
            "a couple of": 2, "half a dozen": 6, "a dozen": 12, "dozen": 12}  # fmt: skip
_TENS = ["twenty", "thirty", "forty", "fifty", "sixty", "seventy", "eighty", "ninety"]
_COUNTED |= {ten: 10 * n for n, ten in enumerate(_TENS, 2)}
_COUNTED |= {f"{ten}-five": 10 * n + 5 for n, ten in enumerate(_TENS, 2)}
_TIME = rf"(?P<unit>{'|'.join(_TIMES)})s?\b"
UNIT_OF_TIME = _TIME.replace("?P<unit>", "?:")
_FRACTIONS = {"tenth": 0.1, "fifth": 0.2, "quarter": 0.25, "third": 1 / 3}
_FRACTION = re.compile(rf"\b(?:(?:a|one) )?({'|'.join(_FRACTIONS)}) of an? (?={UNIT_OF_TIME})", re.I)
RESTING = (
    "(?:is|stands?|sits?|rests?|runs?|works?|operates?|stays?|running|sitting|operating|working"
    "|now|normally|usually|currently|nominally)"
)
SIGNAL = "(?:level|temp(?:erature)?|speed|pressure|flow|position|concentration|output|sensor|measurement)"
LATE = (
    r"dead time|(?:transport |pure )?delay(?:ed by)?"
    r"|(?:reacts?|responds?|(?:begins?|starts?) to [a-z]+)(?: only)? after"
)
"""Words for a dead time."""
_TIMED = rf"(?:time constant|lag|{LATE})"
_SOME = rf"(?:only\s+)?\ba\s+few\s+(?P<unit>{UNIT_OF_TIME})"
_FEW = re.compile(
    rf"(?P<what>\b{_TIMED}\s+(?:(?:of|is)\s+)*){_SOME}"
    rf"|{_SOME.replace('?P<unit>', '?P<of>')}(?P<late>\s+(?:of\s+)?{_TIMED}\b)",
    re.I,
)
_SETTLES = re.compile(
    r"\b(?:(?P<settled>(?:settles|is settled)\s+(?:in|within|after)|settling time)|(?P<risen>rise time)|"
    r"(?:reaches\s+)?63\s*%(?:\s+of (?:it|the way|its final value))?\s+(?:is reached\s+)?(?:in|within|after))"
    rf"(?P<of>{OF})\s*(?P<number>{_DIGITS})(?:\s*(?:to|-|–)\s*(?P<high>{_DIGITS}))?\s*(?P<unit>{UNIT_OF_TIME})",
    re.I,
)
# Numbers of time constants in which a lag settles within 2 %, and rises from 10 to 90 %.
_SETTLED, _RISEN = 4.0, 2.2
_OR_SO = re.compile(rf"({_DIGITS}\s*{UNIT_OF_TIME})\s+or\s+so\b", re.I)
_SYMBOLS = {
    "k": "gain",
    **dict.fromkeys(("t", "tau", "t63"), "time constant"),
    **dict.fromkeys(("l", "theta"), "dead time"),
}
_SYMBOL = re.compile(
    rf"\b(?:({'|'.join(_SYMBOLS)})\s*=\s*|(tau|theta|t63|[tl](?=\s+[\d.]+\s*{UNIT_OF_TIME}))\s+(?:is\s+)?)"
    rf"(?=(?:{ABOUT}\s*)?[-+.\d])",
    re.I,
)
_MINUS_SIGN = re.compile(r"−|(?<=\s)–(?=\d)")
_NEGATIVE = re.compile(r"\b(gain|of|by|gives?)\s+[-−–]\s+(?=\d)", re.I)
_CUBED = re.compile(r"(?<=[ %/(0-9kcdm]m)[23](?![\w.])")
_MINUS = re.compile(
    r"(?<!plus/)(?<!plus or )(?<!plus and )(?<!plus )\b"
    r"(?:(?P<gain>negative gain)(?: of)?|minus|negative(?: of)?)\s+(?=[\d.])",
    re.I,
)
_SCATTER = re.compile(
    r"\b(?P<what>(?P<loose>noise|noisy|scatters?|fluctuates?)|standard deviation|std|rms|sigma"
    rf"|deviation(?=\s*{PLUS_MINUS}))(?P<of>(?:\s+(?:by|of|with|is)\b)?(?:\s*{ABOUT})?)\s*{PLUS_MINUS}\s*(?P<size>[\d.]+)",
    re.I,
)
_HOURS_AND_MINUTES = re.compile(
    r"(?<![\w.])(\d+(?:\.\d+)?)\s*h(?:ours?)?\s*(?:and\s+)?(\d+)\s*min(?:utes?)?\b", re.I
)
_KNOWN_TO = re.compile(
    r"\b(?:not\s+)?(known|good|accurate|precise)\s+(?:only\s+)?(?:to|within|(?:no\s+)?better than)\s+"
    rf"(?={_DIGITS}\s*%)",
    re.I,
)
_AT_63 = re.compile(
    r"\b(?:(?:the )?time to\s+)?63\s*%\s+(?:(?:of|it|the|way|its|final|value|that|change|is|are|reached|"
    r"after|in|within)\s+)*(?=(?:about\s+)?\d)",
    re.I,
)
_FALLS = re.compile(
    rf"\b(?:falls|drops|decreases|sinks|cools(?: down)?(?: the [a-z]+)?|goes down)(?: by)?\s+"
    rf"(?P<about>(?:{ABOUT}\s*)?)(?=\d)",
    re.I,
)
_ENDS = rf"(?P<low>{_DIGITS})\s*(?:to|and|-|–|\.\.+)\s*(?P<high>{_DIGITS})\s*(?P<unit>{UNIT_OF_TIME})"
# "dead time 3 to 6 min", and "3 to 6 min of dead time".
_BETWEEN = tuple(
    re.compile(pattern, re.I)
    for pattern in (
        rf"\b(?P<what>{_TIMED})\s+(?:(?:of|is|between|from|somewhere|{ABOUT})\s+)*{_ENDS}",
        rf"{ALONE}{_ENDS}\s+(?:of\s+)?(?P<what>{_TIMED})\b",
    )
)
_SPOKEN = re.compile(
    rf"(?<![\w-])({'|'.join(sorted(_COUNTED, key=len, reverse=True))})\s+"
    rf"(?=(?:{UNIT_OF_TIME}|(?:more\s+)?{gains.UNIT}|[^\s\d,;|]+\s+more\b"
    rf"|to\s+(?:{'|'.join(_COUNTED)}|\d+)\s+{UNIT_OF_TIME}))",
    re.I,
)
_DIES_AWAY = re.compile(r"\b(?:dies (?:away|out|down)|decays(?: away)?)(?=\s+(?:in|within|over)\b)", re.I)
_NOTHING = re.compile(
    r"\bnothing (?:happens|moves|changes) (?:in|for|during|within) (?:the )?(?:first )?(?:a )?"
    r"(?=(?P<few>few\b)?)",
    re.I,
)
_PIECE = re.compile(r"(?:(?!\s(?:and|but)\s)[^,;.|]|\.(?=\d))+", re.I)
_ONE_TIME = re.compile(
    rf"(?P<before>[^\d%]*)(?P<amount>{ALONE}{_DIGITS}(?:\s*(?:to|-|–)\s*{_DIGITS})?\s*{UNIT_OF_TIME})"
    r"(?P<behind>[^\d%]*)",
    re.I,
)
# Patterns of a clause around its only time (#), and the words under which that time is read.
_TRIAL = r"\b(?:test|trial|experiment)s?\b"
_TIMES_SAID = (
    (r"\bsettl|\bsteady\b|\bfully\b|\bfinal\b", "settles in"),
    (
        rf"^(?!.*{_TRIAL}).*\b(?:react|respo|answer|begin|start|first)\w*(?:\s+\w+){{0,3}}?\s+(?:only )?"
        r"(?:#\s+(?:after|later)|after (?:\w+ )?#)",
        "dead time",
    ),
    (rf"{_TRIAL}(?!.*\b(?:begin|start)s?\b)|\bspend\b|\bcannot have\b", "for"),
    (
        r"^\s*(?:(?:and|but|it|that|this|which|all|everything|the \w+)\s+)*takes?\s+(?:only\s+)?"
        r"(?:about\s+|roughly\s+)?#\s*$",
        "time constant",
    ),
)
# Words of such a clause that are understood; others are returned in a remark.
_OF_TIMES = re.compile(
    rf"#|{ABOUT}|(?:settl|react|respo|answer|begin|start|first|test|trial|experiment|spend|reach|need|last|take)\w*$"
    r"|(?:steady|fully|final|value|state|after|later|only|cannot|more|than|up|longer|most|time|half|long)$",
    re.I,
)
_TIMES_READ = re.compile(
    rf"\b(?:{_TIMED}|time constant|noise|fad\w+|positions?|every|sampl\w+|keeps?|stays?|settles in|"
    r"settling time|rise time)\b",
    re.I,
)
_OF_DAY = re.compile(r"(?:\bfrom\s+)?\b(\d\d?):(\d\d)\s*(?:to|until|-|–)\s*(\d\d?):(\d\d)\b", re.I)
_SIZE_OF = rf"[-+]?{_DIGITS}\s*{gains.UNIT}"
_MAY_MOVE = rf"(?:(?:and|it|which|that|we)\s+)*(?:may|can|could|swings?|moves?|var|{PLUS_MINUS})"
_STANDING = re.compile(
    rf"\b(?P<name>[a-z]+)(?:\s+{RESTING})*?\s+(?P<at>at|around|near|normally|usually|now)\s+(?P<size>{_SIZE_OF})"
    rf"(?=,?\s+{_MAY_MOVE})",
    re.I,
)
_OUTPUT = r"\b(?:the\s+)?(?:level|temp(?:erature)?|concentration|output|sensor)\s+"
OUTPUT_RESTS = re.compile(rf"{_OUTPUT}(?:(?:{RESTING}|kept|held)\s+)+(?:at|around|near)\s+{_SIZE_OF}", re.I)
"""The level of an output at rest, as in "the level is kept at 60 %"."""
_ENDS_OF = rf"{NUMBER}\s*(?:{gains.UNIT})?\s*(?:to|-|–|\.\.|{PLUS_MINUS})\s*{NUMBER}"
_OUTPUT_RANGE = re.compile(rf"{_OUTPUT}(?:(?:may|can|could|moves?|goes|go|from|is)\s+)*{_ENDS_OF}", re.I)
# Patterns of inputs and their standard forms, as "12 bits up to 100 %" for "12 bits from 0 to 100 %".
_OF_INPUTS = (
    (rf"({_SIZE_OF})\s+up,?\s+(?:and\s+|or\s+)?\1\s+down", r"\1 either way"),
    (rf"\b(up (?:and|or) down) by ({_SIZE_OF})", r"by \2 \1"),
    (
        rf"(?:and )?\bnot (?:above|over) ({_SIZE_OF}),? (?:and|or) (?:not )?(?:below|under) ({_SIZE_OF})",
        r"\2 to \1",
    ),
    (
        r"(?<=, )(?:it |which )?(?:may|must|can|should) ?not (?:change|move|vary|go)(?: by)? more than "
        rf"(?={_SIZE_OF}(?!\s*(?:per\b|/)))",
        "may move by ",
    ),
    (
        rf"\b({SIGNAL}) (?:must|is to|has to|should|may) (?:stay|remain) within (?={_SIZE_OF})",
        r"\1 may deviate by ",
    ),
    (r",\s+which (?=(?:is|stands|sits|runs|rests)\s+(?:at|around|near))", " "),
    (r"\b(\d+ bits?) (?:from|over|for) 0\s*(?:to|-|–)\s*(?=\d)", r"\1 up to "),
    (
        rf"\b(power|range|span|scale|stroke)\s+(?:(?:of|is|from)\s+)*0\s*(?:to|-|–)\s*{_SIZE_OF}",
        r"\1 (its span)",
    ),
)
AMOUNT = rf"(?:(?:{'|'.join(_COUNTED)})\s+|(?:\d+(?:\.\d*)?|\.\d+)\s*){UNIT_OF_TIME}"
"""A time, as in "45 min" or "one shift"."""
_SETTING = rf"{OF}{NUMBER}(?:\s*(?:ms|s|sec|min|h)\b)?"
SETTINGS = rf"(?:PID?\s+)?Kp{_SETTING}(?:(?:\s*,\s*|\s+and\s+|\s+)T[id]{_SETTING})*"
"""Settings of a controller, as in "Kp 1, Ti 60 s"."""
SENSOR = r"(?:sensor|encoder|thermocouple|transmitter|thermometer)\b"
DRIVE = (
    "(?:valve|heater|heating|pump|voltage|power|flow|steam|reflux|damper|fan|current|opening|radiator|drive"
    "|gate|input|actuator)"
)
# "per minute", and of a gain "per 10 % of valve".
_SIZE = r"(?P<size>(?!(?:per|and)\b)(?:[^\s\d,;|/.:]|[.:](?=[^\s|]))+)"
_RATE = rf"(?:\s*{_SIZE})?(?:\s*(?:per|/)\s*{_TIME})?"
_BASE = (
    rf"\s*(?:/|\bper\b|\bfor (?:each|every)\b)\s*(?P<many>{_DIGITS}\s*)?(?P<base>(?![\d-]){_UNIT}+)"
    rf"(?:\s+of\s+(?:the\s+)?{DRIVE})?(?P<less>\s+less\b)?"
)
UP = "rises|grows|increases|climbs|goes up|warms|heats|raises|lifts"
"""Verbs of an output that moves upwards."""
_OF_SPEED = re.compile(
    rf"\b(?P<what>(?:angle|position|speed|velocity|flow)\s+)?(?:{UP}|changes)"
    rf"(?:\s+(?:by|with))?\s+(?P<size>(?:{ABOUT}\s*)?-?{_DIGITS}\s*(?P<unit>[^\s\d,;|/]+)/[a-z]+)(?=\s+per\b|\s*/)",
    re.I,
)
# Patterns behind the number of each kind of quantity.
_BEHIND = {
    "time": rf"(?:\s*{_TIME}|(?![\d.]|\s*(?:[%°'’″′½¼¾]|[a-z]+\s*/|[a-z]+ per\b"
    r"|(?:[mk]?hz|ks|samples?|rad|[nµμ]s|m)\b)))",
    "frequency": rf"(?:\s*(?P<unit>{'|'.join(_FREQUENCIES)})\b)?",
    "rate": rf"{_RATE}(?!\s*[^\s,;]*\s*(?:\bper\b|/)\s*[a-z])",
    "slope": rf"{_RATE}(?:{_BASE})?",
    "speed": rf"(?:\s*{_SIZE})?\s*(?:per|/)\s*{_TIME}(?:{_BASE})?",
    "gain": rf"(?:\s*(?!plus/)(?P<size>(?:[^\s\d,;|+±][^\s,;|+±]*)?){_BASE})?",
    "any": rf"(?P<size>{UNIT})",
    "none": "",
}
# Words without content: they join others, or name the subject of every sentence here.
_FILLING = (
    "a an the of and with in at each all about is for by i want we it its this that there has have am are "
    "be been to my our me us on as so then please need needs would like should must may can will do does "
    "measured also tune design level temperature speed pressure flow position concentration "
    "sensor measurement take takes experiment"
)
# Properties that no linear model has: a design for one ignores them.
_NONLINEAR = (
    r"friction|stiction|stick[- ]slip|sticks?|sticky|backlash|hysteresis|dead[- ]?(?:band|zone)|saturat\w*"
    r"|non-?linear\w*"
)
_GROWS = (
    r"(?:\s+(?:that|which|and))?(?:\s+slowly)?\s+(?:grows?|rises?|increases?|depends?)(?:\s+slowly)?\s+(?:with|on)"
    r"\s+(?:(?:the|its)\s+)?\w+"
)
_LEAKS = rf"(?:leak\w*(?:{_GROWS}|\s+slowly)?|(?:outflow|outlet|losses|drain)(?:\s+flow)?{_GROWS})"
BEYOND = re.compile(
    r"(?:\b(?:and|with|has|some|an?|a (?:bit|little) of|much|strong|dry|static|coulomb|slow|small)\s+)*"
    rf"(?<!viscous )\b(?:(?P<what>(?:{_NONLINEAR})\b(?![-/\w]*\.[a-z])"
    rf"(?:\s+(?:a (?:bit|little)|sometimes|at low speeds?|of {_DIGITS}[^,;]*))*)|(?P<leak>{_LEAKS})\b)",
    re.I,
)
"""Properties of a plant that no model of the wizard has; a remark names them."""


def orders(words: str, kind: str, within: str = WITHIN) -> tuple[str, str]:
    """Return the patterns of a quantity: "dead time of 25 s", and "25 s of dead time"."""
    number = rf"(?P<number>[-+]?{_DIGITS}){_BEHIND[kind]}"
    within = within if kind == "time" else within.replace(_SHARE_UNIT, "")  # "2 K within 5 min" is no share
    return (
        rf"(?P<words>(?:{ABOUT}\s*|\b)(?:{words})\b{OF}){number}{within}",
        rf"(?P<words>{ABOUT}\s*)?{ALONE}{number}\s*(?:of\s+)?\b(?:{words})\b{within}",
    )


@dataclass(frozen=True)
class Quantity:
    """Holds a value in units of the spec, and details of its statement."""

    value: float
    share: float | None = None  # "within 30 %"
    about: bool = False
    itself: bool = False  # the share holds for this value alone, as does a tolerance with a unit
    size: str = ""  # the unit of the quantity
    base: str = ""  # the unit of the input of a gain


class Phrase:
    """Reads an answer piece by piece; `finish` refuses a part that was not read.

    A method returns None if the text has no piece of its kind. Times become multiples of `clock` seconds,
    and sizes in other units become sizes in `unit`, where that is known.
    """

    def __init__(self, text: str, key: str, clock: float = 1.0, unit: str = "") -> None:
        """Begin with the whole answer to a question; refuse numbers too large or too small to be meant."""
        self.text, self.key, self._left, self._clock, self._unit = text, key, in_figures(text), clock, unit
        check_numbers(text, key)

    def take(self, pattern: str) -> re.Match[str] | None:
        """Take the first piece that matches a pattern out of the text, and return its match."""
        found = re.search(pattern, self._left, re.I)
        if found is not None:
            self._left = f"{self._left[: found.start()]} | {self._left[found.end() :]}"
        return found

    def number(self, pattern: str) -> float | None:
        """Read a piece and return the number in its first group; a second group has its unit."""
        found = self.take(pattern)
        if found is None:
            return None
        unit = (found[2] or "").strip() if found.re.groups > 1 else ""
        return self.sized(float(found[1]), unit)

    def quantity(
        self, words: str, kind: str, within: str = WITHIN, unit: str | None = None
    ) -> Quantity | None:
        """Read words (a pattern) and a number with its unit, in either order, and a share that follows."""
        found = next(filter(None, map(self.take, orders(words, kind, within))), None)
        if found is None:
            return None
        said = {name: (text or "").strip() for name, text in found.groupdict().items()}
        scaled = value = self._scaled(float(said["number"]), said.get("unit", ""), kind)
        if kind in ("any", "rate"):
            value = self.sized(value, said["size"], unit)
        value = -value if said.get("less") else value  # "rises by 2 degC per 5 % less"
        if said.get("many"):
            value /= needed(float(said["many"]), self.key, "what the gain is per")
        share = float(said["share"]) / 100.0 if said["share"] else None
        if said["share"] and not said.get("per_cent", "%"):  # in the unit of the number
            apart = self._scaled(float(said["share"]), said.get("share_unit") or said.get("unit", ""), kind)
            share = apart / max(abs(scaled), SMALLEST)
        about = re.search(ABOUT, said["words"], re.I) is not None
        itself = share is not None and bool(said.get("itself") or not said.get("per_cent", "%"))
        return Quantity(value, share, about, itself, said.get("size", "").strip("()"), said.get("base", ""))

    def after(
        self, words: str, kind: str = "any", *, named: bool = False, unit: str | None = None
    ) -> float | None:
        """Return the number behind these words, converted to the unit of the spec.

        Args:
            kind: the kind of unit: time, frequency, rate, slope, gain, any (a size) or none.
            named: whether words without a number are refused.
            unit: the unit of a size in the spec, if it is not that of the phrase.
        """
        found = self.quantity(words, kind, "(?P<share>)", unit)
        if found is None and named and (alone := re.search(rf"\b(?:{words})\b", self._left, re.I)):
            raise bad_answer(self.key, f'"{alone[0]}" has no number behind it')
        return None if found is None else found.value

    def band(self) -> tuple[float | None, float | None]:
        """Read the ends of a band of frequencies; one unit holds for both."""
        frequency = NUMBER + _BEHIND["frequency"].replace("?P<unit>", "")
        found = self.take(rf"\bfrom\b{OF}{frequency}\s*(?:\bup to\b|\bto\b|-)\s*{frequency}")
        if found is None:
            return self.after("from", "frequency"), self.after("up to|to", "frequency")
        low, high = (float(found[1]), found[2] or found[4]), (float(found[3]), found[4] or found[2])
        return self._scaled(*low, "frequency"), self._scaled(*high, "frequency")

    def share(self) -> float | None:
        """Read "within 30 %" and return the fraction."""
        found = self.take(rf"(?:\b(?:within)\b|{PLUS_MINUS})?\s*{NUMBER}{_PER_CENT}")
        return None if found is None else float(found[1]) / 100.0

    def lasting(self) -> float:
        """Read the whole answer as a time, as in "45 min" or "one shift"."""
        found = self.take(rf"{NUMBER}\s*([a-z]*)")
        if found is None:
            raise bad_answer(self.key, f'"{self.text}" is no time')
        unit = found[2].lower() or "s"
        unit = unit if unit in _TIMES else unit.removesuffix("s")
        if unit not in _TIMES:
            raise bad_answer(self.key, f'"{found[2]}" is no unit of time: ms, s, min, h, shifts or days')
        self.finish("there only for up to")
        return needed(self._scaled(float(found[1]), unit, "time"), self.key, "the time")

    def finish(self, also: str = "") -> None:
        """Refuse words that were not read, except words without content and `also` (separated by blanks)."""
        known = also.lower().split()
        for piece in BEYOND.sub(" ", self._left).split("|"):
            if any(word not in known for word in unread(piece)):
                raise bad_answer(self.key, f'"{piece.strip(" ,;.:")}" is not understood')

    def sized(self, value: float, unit: str, wanted: str | None = None) -> float:
        """Return a difference in units of the spec; unchanged if either unit is not stated."""
        wanted = self._unit if wanted is None else wanted
        ours, theirs = (one.strip("()").lower() for one in (wanted, unit))
        group, other = (next((group for group in _ALIKE if one in group), None) for one in (ours, theirs))
        if ours == theirs or not ours or not theirs:
            return value
        if group is not other or group is None or other is None:
            raise bad_answer(self.key, f"it is in {unit}, but the gain of the plant has {wanted} there")
        return value * group[theirs] / group[ours]

    def _scaled(self, value: float, unit: str | None, kind: str) -> float:
        unit = (unit or "").lower()
        if kind == "time":
            return value * _TIMES.get(unit, 1.0) / self._clock
        if kind == "frequency":
            return value * _FREQUENCIES.get(unit, 1.0) * self._clock
        return value / _TIMES.get(unit, 1.0) * self._clock if kind in ("rate", "slope", "speed") else value


def check_numbers(text: str, key: str) -> None:
    """Refuse numbers that are implausible, that can be read in two ways, or that are shares of a signal."""
    sizes = (one for one in re.findall(rf"{ALONE}{NUMBER}", text) if float(one))
    strange = next((one for one in sizes if not SMALLEST <= abs(float(one)) <= LARGEST), None)
    if strange is not None:
        why = f"{strange} is beyond what can be meant: sizes lie between {SMALLEST:g} and {LARGEST:g}"
        raise bad_answer(key, why)
    if nan := re.search(r"(?<![\w./])(nan|inf|infinity)(?![\w./])", text, re.I):
        raise bad_answer(key, f"{nan[1]} is no number")
    if comma := re.search(r"\d+,\d+", text):
        why = f"{comma[0]} is a number with a comma, or two: write 2.5, and a blank behind commas"
        raise bad_answer(key, why)
    if share := re.search(
        r"(?<!63)(?<!63 )(?:%|per ?cent)\s+of\s+(?:the\s+)?"
        rf"(?:{SIGNAL}|that|it|this|range|span|reading|value)\b",
        text,
        re.I,
    ):
        raise bad_answer(key, f'"{share[0]}": write the size itself, in its unit')


def in_figures(text: str) -> str:
    """Return a text with "0.1 second" for "a tenth of a second", and "rises by -2" for "falls by 2".

    "dead time 3 to 6 min" becomes "dead time 4.5 min within 33.3 % itself", "an hour" becomes "1 hour", and
    "T = 3 s" becomes "time constant 3 s".
    """
    figures = _MINUS_SIGN.sub("-", _NEGATIVE.sub(r"\1 -", re.sub(r"\bper cent\b", "%", text, flags=re.I)))
    figures = re.sub(r"(?<=\d)\.(?=\s|$)", " .", figures)  # the end of a sentence
    figures = _DIES_AWAY.sub("fades", figures)
    figures = _NOTHING.sub(lambda found: f"dead time of {'a ' * bool(found['few'])}", figures)
    figures = _CUBED.sub(lambda found: "²³"[found[0] == "3"], figures)  # no digits of a number
    figures = _SYMBOL.sub(lambda found: f"{_SYMBOLS[(found[1] or found[2]).lower()]} ", figures)
    figures = _SCATTER.sub(r"\g<what>\g<of> \g<size>", figures)
    figures = _MINUS.sub(lambda found: "gain -" if found["gain"] else "-", figures)
    figures = _HOURS_AND_MINUTES.sub(lambda found: f"{60 * float(found[1]) + float(found[2]):g} min", figures)
    figures = _FRACTION.sub(lambda found: f"{_FRACTIONS[found[1].lower()]:g} ", figures)
    figures = _FEW.sub(lambda found: f"{found['what'] or found['late']} {_few(found)}", figures)
    figures = _counted(figures)
    figures = _KNOWN_TO.sub(lambda found: f"{'known ' * (found[1].lower() == 'known')}within ", figures)
    figures = in_one_form(_AT_63.sub("time constant ", _OR_SO.sub(r"about \1", figures)))
    figures = _PIECE.sub(_of_time, _OF_DAY.sub(_hours, figures))
    for said, form in _OF_INPUTS:
        figures = re.sub(said, form, figures, flags=re.I)
    figures = _OUTPUT_RANGE.sub(lambda found: re.sub(r"(?<![\w.])(?=\d)", UNREAD, found[0]), figures)
    figures = _STANDING.sub(_standing, figures)
    figures = _SETTLES.sub(
        lambda found: f"time constant {'about ' * _vague(found['of'])}{_time_constant(found)}", figures
    )
    for between in _BETWEEN:
        figures = between.sub(_middle, figures)
    figures = _FALLS.sub(r"rises by \g<about>-", figures)
    return _OF_SPEED.sub(_size_of_a_speed, figures)


def taken_as(text: str) -> list[str]:
    """Return how "a few minutes", "settles in 2 s", "noise +- 2" and "9 V gives 18 K" are understood."""
    text, said = _counted(text), []
    for piece in _PIECE.finditer(text):
        form = _of_time(piece)
        if form != piece[0] and (quantity := re.search(r"(?:dead time|time constant).*", form)):
            said.append(f'"{piece[0].strip()}" is taken as {quantity[0]}')
    text = _PIECE.sub(_of_time, text)
    return [
        *said,
        *(f'"a few {one["unit"] or one["of"]}" is taken as {_few(one)}' for one in _FEW.finditer(text)),
        *(
            f'"{one[0]}" is taken as a time constant of {_time_constant(one, said=True)}'
            for one in _SETTLES.finditer(text)
        ),
        *(
            f'"{one[0]}" is taken as a standard deviation of {one["size"]}'
            for one in _SCATTER.finditer(text)
            if one["loose"]
        ),
        *(
            f'"{text[one.begin : one.end]}" is taken as the effect of a change of {one.assumed}'
            for one in gains.gains(text)
            if one.assumed
        ),
    ]


def _few(found: re.Match[str]) -> str:
    return f"2 to 5 {found['unit'] or found['of']}"


def _standing(found: re.Match[str]) -> str:
    """Return an operating point apart from its name, "feeder, at 45 %", unless that is a known word."""
    if re.fullmatch(rf"{RESTING}|held|kept|point|which|that|it|i|we|and", found["name"], re.I):
        return found[0]
    if re.fullmatch(DRIVE, found["name"], re.I):
        return (
            found[0]
            if found["at"].lower() in ("at", "around", "near")
            else f"{found['name']} at {found['size']}"
        )
    return f"{found['name']}, at {found['size']}"


def _counted(text: str) -> str:
    """Return a text with figures for number words before a unit."""
    return _SPOKEN.sub(lambda found: f"{_COUNTED[found[1].lower()]} ", text)


def of_outputs(text: str) -> list[str]:
    """Return the parts of a text on the level of an output at rest: it is no operating point of the input."""
    return [found[0].strip() for found in OUTPUT_RESTS.finditer(text)]


def _hours(found: re.Match[str]) -> str:
    """Return the time between two times of day."""
    begin, end = (60 * int(found[i]) + int(found[i + 1]) for i in (1, 3))
    return f"for {(end - begin) % 1440} min"


def _of_time(piece: re.Match[str]) -> str:
    """Return a clause with its only time named: as settling time, dead time, lag or time available."""
    found = _ONE_TIME.fullmatch(piece[0])
    if found is None or _TIMES_READ.search(piece[0]):
        return piece[0]
    around = f"{found['before']}#{found['behind']}"
    form = next((form for words, form in _TIMES_SAID if re.search(words, around, re.I)), None)
    if form is None:
        return piece[0]
    others = [word for word in unread(around) if not _OF_TIMES.match(word)]
    blank, about = piece[0][: len(piece[0]) - len(piece[0].lstrip())], ["about"] * _vague(found["before"])
    return blank + " ".join([*others, form, *about, found["amount"]])


def _size_of_a_speed(found: re.Match[str]) -> str:
    """Return a change of a speed or a flow, whose unit has a time, as a gain: it is no ramp."""
    what, unit = (found["what"] or "").strip().lower(), found["unit"].lower()
    ramp = what in ("angle", "position") or (not what and unit not in ("rad", "deg", "°", "rev"))
    return found[0] if ramp else f"gain {found['size']}"


def _vague(text: str) -> bool:
    return re.search(ABOUT, text, re.I) is not None


def _time_constant(found: re.Match[str], *, said: bool = False) -> str:
    """Return the time constant of a settling time, in the form of an answer, or of a remark if `said`."""
    constants = _SETTLED if found["settled"] else _RISEN if found["risen"] else 1.0
    low, high = float(found["number"]), float(found["high"] or found["number"])
    if not 0.0 < low < high:
        return f"{low / constants:.4g} {found['unit']}"
    if said:
        return f"{low / constants:.4g} to {high / constants:.4g} {found['unit']}"
    return _between(low / constants, high / constants, found["unit"])


def _middle(found: re.Match[str]) -> str:
    """Return a quantity between two ends by their middle and its share."""
    one, other = float(found["low"]), float(found["high"])
    if not 0.0 < one < other:
        return found[0]
    return f"{found['what']} {_between(one, other, found['unit'])}"


def _between(low: float, high: float, unit: str) -> str:
    """Return the middle of two ends, and the share to either side that reaches them."""
    share = 100.0 * (high - low) / (high + low)
    return f"{0.5 * (low + high):.4g} {unit} within {share:.7g} % itself"


def unread(text: str) -> list[str]:
    """Return the words of a text that have content, in small letters."""
    return [word for word in re.split(r"[\s,;.:|]+", text.lower()) if word and word not in _FILLING.split()]


def beyond_models(text: str) -> list[str]:
    """Return remarks on properties that no model of the wizard has: friction and the like, and leaks."""
    said = list(BEYOND.finditer(text))
    rough, leaks = (
        ", ".join(dict.fromkeys(one[group].lower() for one in said if one[group]))
        for group in ("what", "leak")
    )
    why = "no linear model has it, and the design leaves it out. Move so far that it matters little; assess"
    found = [f"{rough}: {why} tests whether the plant is linear"] if rough else []
    if leaks:
        found.append(f"{leaks}: the model of a plant that integrates has no leak; assess tests for one")
    return found


def needed(value: float | None, key: str, what: str) -> float:
    """Return the value; refuse one that is missing or not positive."""
    if value is None:
        raise bad_answer(key, f"it does not say {what}")
    if not value > 0.0:
        raise bad_answer(key, f"{what} must be positive, not {value:g}")
    return value


def short(value: float) -> str:
    """Write a number with the six digits of a spec."""
    return f"{value:.6g}"
