"""Validators of single values: each returns a plain Python value or raises findings in plain words.

Pydantic's own messages are not written for control engineers, and its unions report every alternative
that failed; so the types of `fields` are made of these functions.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import partial
from itertools import pairwise
from typing import Any

from pydantic_core import PydanticCustomError

from inputdesign_cli.specification.models.findings import CARRIER, Finding, Findings, describe, fail, show
from inputdesign_cli.specification.models.polynomials import MAX_ORDER, Polynomial, product
from inputdesign_cli.specification.yaml.scalars import why_not_number

PolynomialList = tuple[Polynomial, ...]
PolynomialMatrix = tuple[tuple[Polynomial, ...], ...]
Matrix = tuple[tuple[float, ...], ...]


def number(
    value: Any,
    *,
    above: float | None = None,
    least: float | None = None,
    below: float | None = None,
    hint: str = "",
) -> float:
    """A finite float within the limits: `above` and `below` are excluded, `least` is included."""
    if isinstance(value, str):
        code, wrong, mend = why_not_number(value)
        raise fail(code, f"{{key}} {wrong}", mend or hint)
    if isinstance(value, bool) or not isinstance(value, int | float):
        raise fail("not-a-number", f"{{key}} must be a number, not {describe(value)}", hint)
    try:
        result = float(value)
    except OverflowError:
        result = float("inf")
    if result - result != 0.0:
        raise fail("not-finite", "{key} must be finite", "numbers must stay below 1.8e308")
    if above is not None and not result > above:
        raise fail("out-of-range", f"{{key}} must be greater than {show(above)}, not {show(result)}", hint)
    if least is not None and not result >= least:
        raise fail("out-of-range", f"{{key}} must be at least {show(least)}, not {show(result)}", hint)
    if below is not None and not result < below:
        raise fail("out-of-range", f"{{key}} must be less than {show(below)}, not {show(result)}", hint)
    return result


def whole(value: Any, *, least: int, most: int = 2**53) -> int:
    """An integer of at least `least`; 500.0 is one, 500.5 is not."""
    result = number(value)
    if result != int(result):
        raise fail(
            "not-a-whole-number",
            f"{{key}} must be a whole number, not {show(result)}",
            f"write {int(result)} or {int(result) + 1}",
        )
    if result < least:
        raise fail("out-of-range", f"{{key}} must be at least {least}, not {show(result)}")
    if result > most:
        raise fail("out-of-range", f"{{key}} must be at most {most:.4g}, not {show(result)}")
    return int(result)


def fraction(value: Any) -> float:
    """A probability strictly between 0 and 1."""
    result = number(value)
    if not 0.0 < result < 1.0:
        hint = f"write {result / 100:g} for {result:g} percent" if 1.0 < result < 100.0 else ""
        raise fail("out-of-range", f"{{key}} must lie between 0 and 1, not {show(result)}", hint)
    return result


def text(value: Any) -> str:
    """A text; an unquoted number or true/false is taken as one."""
    if isinstance(value, bool):
        return "true" if value else "false"
    if not isinstance(value, str | int | float):
        raise fail("not-a-text", f"{{key}} must be a text, not {describe(value)}", "put it in quotes")
    return str(value)


def flag(value: Any) -> bool:
    """true or false."""
    if isinstance(value, bool):
        return value
    raise fail("unknown-word", f"{{key}} must be true or false, not {describe(value)}", "write true or false")


def name(value: Any, *, what: str) -> str:
    """A non-empty text that names something: `what` says what."""
    if not isinstance(value, str) or not value.strip():
        raise fail("not-a-text", f"{{key}} must be {what}, not {describe(value)}")
    return value


def several(value: Any, item: Callable[[Any], Any], what: str, *, nonempty: bool = True) -> tuple[Any, ...]:
    """A list whose items each pass `item`; every bad item is reported."""
    if not isinstance(value, list | tuple):
        raise fail("wrong-shape", f"{{key}} must be a list of {what}, not {describe(value)}", "[.., ..]")
    if nonempty and not value:
        raise fail("wrong-shape", f"{{key}} is an empty list; it must hold {what}")
    findings = Findings()
    result = tuple(collect(findings, item, entry, i) for i, entry in enumerate(value))
    findings.stop()
    return result


def collect(findings: Findings, check: Callable[[Any], Any], value: Any, *path: str | int) -> Any:
    """Run a validator on a part; what it finds goes into `findings` under `path`."""
    try:
        return check(value)
    except PydanticCustomError as error:
        for f in (error.context or {})[CARRIER]:
            findings.append(replace(f, path=path + f.path))
        return None


def one_or_several(value: Any, item: Callable[[Any], Any], what: str) -> Any:
    """One value, or a list with one per channel."""
    return several(value, item, what) if isinstance(value, list | tuple) else item(value)


def harmonics(value: Any) -> int | str | tuple[int, ...]:
    """A number of harmonics, the word odd, or a rising list of harmonic numbers."""
    if isinstance(value, list | tuple):
        listed: tuple[int, ...] = several(value, partial(whole, least=0), "harmonic numbers")
        if any(b <= a for a, b in pairwise(listed)):
            raise fail("not-increasing", "{key} must increase", "sort the harmonics, remove repetitions")
        return listed
    if isinstance(value, str):
        if value != "odd":
            raise fail(
                "unknown-word",
                f"{{key}} has no word {value!r}",
                "write odd, a number of harmonics, or a list of them",
            )
        return value
    return whole(value, least=1)


def polynomial(value: Any, *, check: tuple[Callable[[Polynomial], Finding | None], ...] = ()) -> Polynomial:
    """A list of coefficients, not all zero, that passes every check."""
    if not isinstance(value, list | tuple):
        raise fail(
            "wrong-shape",
            f"{{key}} must be a list of coefficients, not {describe(value)}",
            f"write [{show(value)}]"
            if isinstance(value, int | float) and not isinstance(value, bool)
            else "",
        )
    coefficients: Polynomial = several(value, number, "coefficients")
    findings = Findings(f for f in (rule(coefficients) for rule in check) if f)
    findings[1:] = []
    findings.stop()
    return coefficients


def not_zero(coefficients: Polynomial) -> Finding | None:
    """Some coefficient differs from zero."""
    if any(coefficients):
        return None
    return Finding("zero-polynomial", "all coefficients of {key} are zero", "write at least one that is not")


def leading(coefficients: Polynomial) -> Finding | None:
    """The first coefficient differs from zero."""
    if coefficients[0] != 0.0:
        return None
    return not_zero(coefficients) or Finding(
        "zero-leading-coefficient", "{key} must not start with 0", "remove the leading zeros"
    )


def depth(value: Any) -> int:
    """How deeply lists are nested: 0 for a number, 1 for a list of numbers."""
    if not isinstance(value, list | tuple):
        return 0
    return 1 + max((depth(v) for v in value), default=0)


def polynomials(value: Any, *, depths: dict[int, str], check: tuple[Any, ...] = ()) -> Any:
    """Polynomials nested in lists: depth 1 is one polynomial, 2 a list, 3 rows of columns of them.

    `depths` says which depths are allowed and how each is called in a diagnostic.
    """
    levels = depth(value)
    if levels not in depths:
        allowed = ", or ".join(depths.values())
        hint = ""
        if levels == 2 and 3 in depths:
            hint = "for several inputs or outputs write rows of columns of polynomials: [[[0, 1], [0, 2]]]"
        raise fail("wrong-shape", f"{{key}} must be {allowed}", hint)
    return _nested(value, levels, check)


def denominator(value: Any, *, depths: dict[int, str]) -> Any:
    """A denominator or its factors, whose product can be formed."""
    result = polynomials(value, depths=depths, check=(leading,))
    if depth(result) != 2:
        return result
    order = sum(len(factor) - 1 for factor in result)
    if order > MAX_ORDER:
        raise fail("bad-polynomial", f"{{key}} has order {order}; orders above {MAX_ORDER} are not supported")
    if not all(c - c == 0.0 for c in product(result)):
        raise fail(
            "bad-polynomial", "the product of the factors of {key} is too large", "rescale the factors"
        )
    return result


def _nested(value: Any, levels: int, check: tuple[Any, ...]) -> Any:
    if levels == 1:
        return polynomial(value, check=check)
    result = several(value, lambda v: _nested(v, levels - 1, check), "polynomials")
    if levels == 3 and len({len(row) for row in result}) > 1:
        lengths = ", ".join(str(len(row)) for row in result)
        raise fail(
            "wrong-shape",
            f"the rows of {{key}} must have the same number of columns (they have {lengths})",
            "one row per output, one column per input; write [0] where an input has no effect",
        )
    return result


def matrix(value: Any) -> Matrix:
    """A square symmetric matrix of finite numbers as rows."""
    if depth(value) != 2:
        raise fail(
            "wrong-shape", f"{{key}} must be a matrix, not {describe(value)}", "write rows: [[1, 0], [0, 1]]"
        )
    rows: Matrix = several(value, lambda row: several(row, number, "numbers"), "rows")
    for row in rows:
        if len(row) != len(rows):
            raise fail(
                "wrong-shape",
                f"{{key}} must be square: it has {len(rows)} rows, and one of them has {len(row)} entries",
            )
    scale = max(abs(x) for row in rows for x in row)
    for i, row in enumerate(rows):
        for j in range(i):
            if abs(row[j] - rows[j][i]) > 1e-9 * scale:
                raise fail(
                    "not-symmetric",
                    f"{{key}} is not symmetric: entry ({i + 1}, {j + 1}) is {show(row[j])} "
                    f"but ({j + 1}, {i + 1}) is {show(rows[j][i])}",
                )
    return rows


def band(value: Any) -> tuple[float, float]:
    """A frequency band [low, high] with 0 <= low < high."""
    if not isinstance(value, list | tuple) or len(value) != 2:
        raise fail("bad-band", "{key} must be two frequencies, [low, high]", "write [0.01, 3.0]")
    low, high = several(value, partial(number, least=0.0), "frequencies")
    if not low < high:
        raise fail(
            "bad-band", f"{{key}} must ascend: {show(low)} is not below {show(high)}", "write [low, high]"
        )
    return low, high


def rising(value: Any) -> tuple[float, ...]:
    """A strictly increasing list of frequencies >= 0."""
    result: tuple[float, ...] = several(value, partial(number, least=0.0), "frequencies")
    for i in range(1, len(result)):
        if not result[i - 1] < result[i]:
            raise fail(
                "not-increasing",
                f"{{key}} must increase: {show(result[i])} follows {show(result[i - 1])}",
                "sort the frequencies and remove repetitions",
            )
    return result
