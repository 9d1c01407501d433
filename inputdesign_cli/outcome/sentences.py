"""Sentences from templates, and numbers in them as people read them."""

from __future__ import annotations

import json
import re
from collections.abc import Callable, Iterable, Mapping
from functools import cache
from types import MappingProxyType
from typing import TYPE_CHECKING

from inputdesign_cli.outcome.shares import per_cent

if TYPE_CHECKING:
    from jinja2 import Environment

_ITEM = re.compile(r"^\s*- ", re.MULTILINE)
_BLANK = "\ue000"  # placeholder of a blank that `_tidy` keeps
_OF_NOISE = re.compile(r"[cd]\d+(?:\[\d+\])?")  # names that the program gives to parameters of noise
_LOOSE = re.compile(r" ([,;)]|:(?!:)|\.(?!\.))")  # a blank before punctuation


def sentences(
    package: str,
    file: str,
    part: str,
    facts: Mapping[str, object],
    filters: Mapping[str, Callable[..., str]] = MappingProxyType({}),
) -> list[str]:
    """Return the items that a part of a template makes of facts.

    A part is a macro. Each of its items begins with `- ` on a line, and may go on over further lines.

    Args:
        package: the package with the folder `templates`.
        file: a template in that folder.
        part: the name of the macro.
        facts: the values that the template uses, by name.
        filters: how it writes some of them, besides the filters of all templates.
    """
    templates = _templates(package)
    templates.filters |= filters
    made = templates.get_template(file).make_module(dict(facts))
    return [_tidy(item) for item in _ITEM.split(str(vars(made)[part]()))[1:]]


def filled(package: str, file: str, facts: Mapping[str, object]) -> str:
    """Return the text of a template with its facts, escaped in HTML; the arguments are as for `sentences`."""
    return _templates(package).get_template(file).render(facts)


def _tidy(text: str) -> str:
    return _LOOSE.sub(r"\1", " ".join(text.split())).replace(_BLANK, " ")


@cache
def _templates(package: str) -> Environment:
    from jinja2 import Environment, PackageLoader, StrictUndefined, select_autoescape

    found = Environment(
        loader=PackageLoader(package),
        autoescape=select_autoescape(),
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    found.filters |= {
        "g": lambda value, digits=4: f"{value:.{digits}g}",
        "fixed": lambda value, digits=1: f"{value:.{digits}f}",
        "per_cent": per_cent,
        "json": lambda value: json.dumps(value, ensure_ascii=False),
        "verbatim": lambda command: command.replace(" ", _BLANK),
        "shown": shown,
        "precise": precise,
        "enumerated": enumerated,
        "spoken": spoken,
        "backwards": lambda name: " ".join(reversed(spoken(name).split("."))),
        "sentence": lambda text: f"{text[0].upper()}{text[1:]}.",
        "of_plant": of_plant,
        "parameter": parameter,
    }
    found.globals["joined"] = lambda mark, *parts: mark.join(filter(None, map(_tidy, parts)))
    return found


def of_plant(parameters: Mapping[str, float], digits: int = 4) -> list[str]:
    """Return the parameters of a plant in words, without its noise: `gain 2`."""
    return [
        f"{name} {value:.{digits}g}" for name, value in parameters.items() if not _OF_NOISE.fullmatch(name)
    ]


def parameter(name: str) -> str:
    """Return the name of a parameter, marked if it belongs to the noise: `noise d1`."""
    return f"noise {name}" if _OF_NOISE.fullmatch(name) else name


def shown(value: object) -> str:
    """Return a number with seven digits, and other values as text."""
    return f"{value:.7g}" if isinstance(value, float) else str(value)


def precise(ratio: float) -> str:
    """Return a ratio with four digits, or with seven if it is above one but would read as one."""
    return f"{ratio:.7g}" if ratio > 1.0 + 1e-6 and f"{ratio:.4g}" == "1" else f"{ratio:.4g}"


def enumerated(values: Iterable[float]) -> str:
    """Return numbers as a sentence has them: `1, 2 and 3`."""
    *others, last = [f"{value:.4g}" for value in values] or [""]
    return f"{', '.join(others)} and {last}" if others else last


def spoken(name: str) -> str:
    """Return a name of the program as words."""
    return name.replace("_", " ")
