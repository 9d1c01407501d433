"""Steps of expressions, worked through once, each with its value and its slopes in all parameters."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

# Value and derivative of the functions of one argument.
_Function = tuple[Callable[[float], float], Callable[[float], float]]
FUNCTIONS: dict[str, _Function] = {
    "sqrt": (math.sqrt, lambda x: 0.5 / math.sqrt(x)),
    "exp": (math.exp, math.exp),
    "log": (math.log, lambda x: 1.0 / x),
    "sin": (math.sin, math.cos),
    "cos": (math.cos, lambda x: -math.sin(x)),
    "tan": (math.tan, lambda x: 1.0 + math.tan(x) ** 2),
    "asin": (math.asin, lambda x: 1.0 / math.sqrt(1.0 - x * x)),
    "acos": (math.acos, lambda x: -1.0 / math.sqrt(1.0 - x * x)),
    "atan": (math.atan, lambda x: 1.0 / (1.0 + x * x)),
    "sinh": (math.sinh, math.cosh),
    "cosh": (math.cosh, math.sinh),
    "tanh": (math.tanh, lambda x: 1.0 - math.tanh(x) ** 2),
}


class Step(NamedTuple):
    """One operation on the results of earlier steps: number, name, negative, a function, or + - * / **."""

    operation: str
    value: float | str = ""
    operands: tuple[int, ...] = ()


class Evaluated(NamedTuple):
    """Holds K expressions in m parameters at one point; not a number where one is not defined there."""

    values: Array  # (K,)
    gradients: Array  # (K, m)


def worked_through(
    steps: tuple[Step, ...], places: tuple[int, ...], symbols: Sequence[str], values: Array
) -> Evaluated:
    """Return the values of the expressions that end at `places`, where `symbols` have `values` (m,).

    Raises `KeyError`: a name is not among the symbols.
    """
    known, unit = {symbol: i for i, symbol in enumerate(symbols)}, np.eye(len(symbols))
    found: list[_Result] = []
    with np.errstate(all="ignore"):  # overflow is seen in the result
        for step in steps:
            if step.operation == "number":
                found.append(_Result(float(step.value)))
            elif step.operation == "name":
                at = known[str(step.value)]
                found.append(_Result(float(values[at]), unit[at]))
            else:
                found.append(_result(step.operation, *(found[i] for i in step.operands)))
    ends = [found[place] for place in places]
    rows = [np.full(len(unit), np.nan if math.isnan(end.value) else 0.0) for end in ends]
    gradients = [row if end.slope is None else end.slope for row, end in zip(rows, ends, strict=True)]
    return Evaluated(np.array([end.value for end in ends]), np.array(gradients).reshape(len(ends), len(unit)))


class _Result(NamedTuple):
    """A value, not a number where it is not defined, and its slope (m,), which is None for a constant."""

    value: float
    slope: Array | None = None


def _result(operation: str, *operands: _Result) -> _Result:
    """Return the value of a step and, by the chain rule, its slope."""
    first, *others = operands
    try:
        if any(math.isnan(operand.value) for operand in operands):
            raise ValueError
        over = 1.0
        if others:
            value, *partial = _combined(operation, first, others[0])
            over = others[0].value if operation == "/" else 1.0
        elif operation == "negative":
            value, *partial = -first.value, -1.0
        else:
            function, derivative = FUNCTIONS[operation]
            # A constant has no slope, also where the function has none: sqrt(0).
            value, *partial = function(first.value), 0.0 if first.slope is None else derivative(first.value)
    except (ArithmeticError, ValueError):
        return _Result(math.nan)
    moved = zip(partial, operands, strict=True)
    parts = [share * one.slope for share, one in moved if one.slope is not None and share != 0.0]
    return _Result(value, sum(parts[1:], parts[0]) / over if parts else None)


def _combined(sign: str, first: _Result, second: _Result) -> tuple[float, float, float]:
    """Return the value of a sum, difference, product, ratio or power, and its slopes in both operands.

    The slopes of a ratio are still to be divided by the second operand.
    """
    a, b = first.value, second.value
    if sign == "+":
        return a + b, 1.0, 1.0
    if sign == "-":
        return a - b, 1.0, -1.0
    if sign == "*":
        return a * b, b, a
    if sign == "/":
        return a / b, 1.0, -(a / b)
    power = math.pow(a, b)
    in_base = b * math.pow(a, b - 1.0) if first.slope is not None and b else 0.0
    return power, in_base, power * math.log(a) if second.slope is not None else 0.0
