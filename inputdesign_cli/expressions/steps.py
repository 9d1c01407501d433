"""Steps of expressions, worked through once: each has its value and its slopes in what it works on.

The chain rule makes of these the slopes in all parameters, where they are asked for.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
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


@dataclass(frozen=True)
class Evaluated:
    """K expressions in m parameters at one point; not a number where one is not defined there."""

    _steps: tuple[Step, ...]
    _places: tuple[int, ...]
    _found: tuple[_Local | None, ...]
    _known: Mapping[str, int]

    @cached_property
    def values(self) -> Array:
        """Return the values (K,) of the steps."""
        ends = [self._found[place] for place in self._places]
        return np.array([math.nan if end is None else end.value for end in ends])

    @cached_property
    def gradients(self) -> Array:
        """Return the gradients (K, m) of the steps."""
        unit, slopes = np.eye(len(self._known)), list[Array | None]()
        # Overflow is seen in the result.
        with np.errstate(all="ignore"):
            for step, local in zip(self._steps, self._found, strict=True):
                slopes.append(unit[self._known[str(step.value)]] if step.operation == "name" else None)
                if local is not None and step.operands:
                    below = zip(local.slopes, (slopes[i] for i in step.operands), strict=True)
                    parts = [partial * own for partial, own in below if own is not None]
                    slopes[-1] = sum(parts[1:], parts[0]) / local.over if parts else None
        rows = []
        for place in self._places:
            own = np.zeros(len(unit)) if (found := slopes[place]) is None else found
            rows.append(np.full(len(unit), np.nan) if self._found[place] is None else own)
        return np.array(rows).reshape(len(rows), len(unit))


def worked_through(
    steps: tuple[Step, ...], places: tuple[int, ...], symbols: Sequence[str], values: Array
) -> Evaluated:
    """What the expressions that end at `places` are worth where `symbols` have `values` (m,).

    Raises:
        KeyError: a name is not among the symbols.
    """
    known = {symbol: i for i, symbol in enumerate(symbols)}
    found: list[_Local | None] = []
    for step in steps:
        found.append(_local(step, [found[i] for i in step.operands], known, values))
    return Evaluated(steps, places, tuple(found), known)


class _Local(NamedTuple):
    """A value and its slopes in what it was made of, in units of one over `over`.

    Attributes:
        varies: whether any parameter moves it.
    """

    value: float
    slopes: tuple[float, ...]
    varies: bool
    over: float = 1.0


def _local(
    step: Step, operands: Sequence[_Local | None], known: Mapping[str, int], values: Array
) -> _Local | None:
    """Return the value and slopes of a step, or None if it or one of its operands is not defined."""
    operation = step.operation
    if operation == "number":
        return _Local(float(step.value), (), False)
    if operation == "name":
        return _Local(float(values[known[str(step.value)]]), (), True)
    if any(operand is None for operand in operands):
        return None
    first, *others = [operand for operand in operands if operand is not None]
    try:
        if others:
            value, *slopes = _combined(operation, first, others[0])
        elif operation == "negative":
            value, *slopes = -first.value, -1.0
        else:
            function, slope = FUNCTIONS[operation]
            # A constant has no slope, also where the function has none: sqrt(0).
            value, *slopes = function(first.value), slope(first.value) if first.varies else 0.0
    except (ArithmeticError, ValueError):
        return None
    moved = zip(slopes, (first, *others), strict=True)
    varies = any(slope != 0.0 and operand.varies for slope, operand in moved)
    return _Local(value, tuple(slopes), varies, others[0].value if operation == "/" else 1.0)


def _combined(sign: str, first: _Local, second: _Local) -> tuple[float, float, float]:
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
    in_base = b * math.pow(a, b - 1.0) if first.varies and b else 0.0
    return power, in_base, power * math.log(a) if second.varies else 0.0
