"""Expressions in named parameters, as `K*(1 - exp(-h/T))`: read by a list of permitted syntax, never run.

The text is parsed by Python's `ast` alone and becomes a list of steps by our own rules. Derivatives come by
forward differentiation: every step carries its value and its slope in all parameters.
"""

from __future__ import annotations

import ast
import keyword
import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property, lru_cache
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
LONGEST = 500  # characters of an expression
_CACHED = 64  # sets of expressions: a search evaluates each of them at many points
_SHOWN = 60  # characters that are kept of the text of a composed expression longer than LONGEST
CONSTANTS = {"pi": math.pi}


class Step(NamedTuple):
    """One operation on the results of earlier steps: number, name, negative, a function, or + - * / **."""

    operation: str
    value: float | str = ""
    operands: tuple[int, ...] = ()


class Evaluated(NamedTuple):
    """Holds the values of K expressions in m parameters at one point; NaN where one is not defined."""

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
    with np.errstate(all="ignore"):  # overflow shows in the result
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
    """A value, NaN where it is not defined, and its slope (m,), which is None for a constant."""

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


class ExpressionError(ValueError):
    """Raised for a flawed expression, with the flaw; the second argument is a hint at the remedy."""

    def __init__(self, message: str, hint: str = "") -> None:
        super().__init__(message)
        self.message, self.hint = message, hint


@dataclass(frozen=True)
class Expression:
    """A checked text, or an expression composed of others, and its value.

    It is a list of steps without duplicates: a part that is used several times counts once. It is evaluated
    without recursion, so that its depth is not limited.

    Attributes:
        made: the steps of a composed expression; None if they follow from the text.

    Raises:
        ExpressionError: by `of`, if the text is no permitted expression.
    """

    text: str
    made: tuple[Step, ...] | None = None

    @classmethod
    def of(cls, text: str) -> Expression:
        """Return the expression of a text; raise `ExpressionError` for a text that is not allowed."""
        return cls(text, _read(_tree_of(text)))

    @cached_property
    def steps(self) -> tuple[Step, ...]:
        """Return the steps, each after its operands; the last one is the expression."""
        return _read(_tree_of(self.text)) if self.made is None else self.made

    @cached_property
    def names(self) -> frozenset[str]:
        """Return the parameters that the expression names."""
        return frozenset(str(step.value) for step in self.steps if step.operation == "name")

    @cached_property
    def affine(self) -> bool:
        """Return whether it is written as a sum of constants and of constant multiples of parameters."""
        degrees: list[int] = []
        for step in self.steps:
            degrees.append(_degree(step.operation, [degrees[i] for i in step.operands]))
        return degrees[-1] <= 1

    @cached_property
    def present(self) -> bool:
        """Return whether a coefficient is present as written: it names parameters, or is not zero.

        The structure of a plant depends on its text alone, not on the nominal values of its parameters.
        """
        return bool(self.names) or self.at((), np.zeros(0))[0] != 0.0

    def __mul__(self, other: Expression) -> Expression:
        return self._with("*", other)

    def __truediv__(self, other: Expression) -> Expression:
        return self._with("/", other)

    def _with(self, operation: str, other: Expression) -> Expression:
        table = _Table()
        operands = table.include(self), table.include(other)
        last = table.add(Step(operation, operands=operands))
        return table.expression(last, f"({self.text}){operation}({other.text})")

    def at(self, symbols: Sequence[str], values: Array) -> tuple[float, Array]:
        """Return the value and its gradient (m,) where the `symbols` have these `values` (m,).

        Both are NaN where the value is not defined, as one over zero or the root of minus one.
        Raises `KeyError`: a name is not among the symbols.
        """
        here = evaluated((self,), symbols, values)
        return float(here.values[0]), here.gradients[0]


def evaluated(expressions: tuple[Expression, ...], symbols: Sequence[str], values: Array) -> Evaluated:
    """Return the values of expressions where `symbols` have `values` (m,); shared steps are worked out once.

    Raises `KeyError`: a name is not among the symbols.
    """
    steps, places = _together(expressions)
    return worked_through(steps, places, symbols, values)


@lru_cache(maxsize=_CACHED)
def _together(expressions: tuple[Expression, ...]) -> tuple[tuple[Step, ...], tuple[int, ...]]:
    """Return all steps of expressions, none of them twice, and the place where each expression ends."""
    table = _Table()
    places = tuple(table.include(one) for one in expressions)
    return table.steps, places


class _Table:
    """A list of steps without duplicates."""

    def __init__(self) -> None:
        self._places: dict[Step, int] = {}

    def add(self, step: Step) -> int:
        """Add a step unless it is there, and return its place."""
        return self._places.setdefault(step, len(self._places))

    def include(self, expression: Expression) -> int:
        """Add all steps of an expression, and return the place of the expression."""
        places: list[int] = []
        for step in expression.steps:
            places.append(self.add(step._replace(operands=tuple(places[i] for i in step.operands))))
        return places[-1]

    @property
    def steps(self) -> tuple[Step, ...]:
        """Return all steps, each after its operands."""
        return tuple(self._places)

    def expression(self, place: int, text: str) -> Expression:
        """Return the expression whose last step is at `place`, without the steps that it does not need."""
        steps, needed = list(self._places), {place}
        for i in range(place, -1, -1):
            if i in needed:
                needed.update(steps[i].operands)
        kept = {i: n for n, i in enumerate(sorted(needed))}
        made = tuple(steps[i]._replace(operands=tuple(kept[o] for o in steps[i].operands)) for i in kept)
        return Expression(text if len(text) <= LONGEST else f"{text[:_SHOWN]}..", made)


def product_of(factors: Sequence[Sequence[Expression]]) -> tuple[Expression, ...]:
    """Return the product of polynomials whose coefficients are expressions."""
    table = _Table()
    result = [table.add(Step("number", 1.0))]
    for factor in factors:
        own, sums = [table.include(one) for one in factor], [-1] * (len(result) + len(factor) - 1)
        for i, a in enumerate(result):
            for j, b in enumerate(own):
                term = table.add(Step("*", operands=(a, b)))
                sums[i + j] = term if sums[i + j] < 0 else table.add(Step("+", operands=(sums[i + j], term)))
        result = sums
    text = "*".join(f"[{', '.join(one.text for one in factor)}]" for factor in factors)
    return tuple(table.expression(place, text) for place in result)


def _tree_of(text: str) -> ast.expr:
    if len(text) > LONGEST:
        raise ExpressionError(
            f"has {len(text)} characters, and at most {LONGEST} are taken", "name a part of it"
        )
    try:
        return ast.parse(text.strip(), mode="eval").body
    except (SyntaxError, ValueError, MemoryError, RecursionError) as error:
        hint = "write * for a product, ** for a power, and close every bracket"
        raise ExpressionError("is no expression", hint) from error


def is_name(text: str) -> bool:
    """Return whether a word may name a parameter."""
    taken = text in CONSTANTS or text in FUNCTIONS or keyword.iskeyword(text)
    return text.isidentifier() and text.isascii() and not taken


def _number(value: float) -> float:
    try:
        return float(value)
    except OverflowError:
        return math.inf


def _read(tree: ast.expr) -> tuple[Step, ...]:
    """Return the steps of a syntax tree, which is walked from its leaves.

    Raises:
        ExpressionError: It is not arithmetic in names and numbers.
    """
    table, places = _Table(), dict[ast.AST, int]()
    for node in reversed(list(ast.walk(tree))):
        match node:
            case ast.operator() | ast.unaryop() | ast.expr_context():
                continue
            case ast.Constant(value=int() | float() as number) if not isinstance(number, bool):
                step = Step("number", _number(number))
                if not math.isfinite(float(step.value)):
                    raise ExpressionError("holds a number that is too large")
            case ast.Name(id=name):
                step = Step("number", CONSTANTS[name]) if name in CONSTANTS else Step("name", name)
            case ast.UnaryOp(op=ast.UAdd(), operand=operand):
                places[node] = places[operand]
                continue
            case ast.UnaryOp(op=ast.USub(), operand=operand):
                step = Step("negative", operands=(places[operand],))
            case ast.Call(func=ast.Name(id=name), args=[argument], keywords=[]) if name in FUNCTIONS:
                step = Step(name, operands=(places[argument],))
            case ast.Call(func=ast.Name(id=name)):
                wrong = "takes one argument" if name in FUNCTIONS else f"is none of {', '.join(FUNCTIONS)}"
                raise ExpressionError(f"calls {name}(..)", f"{name} {wrong}")
            case ast.BinOp(op=ast.BitXor()):
                raise ExpressionError("holds ^", "write ** for a power")
            case ast.BinOp(left=left, op=op, right=right) if type(op) in _SIGNS:
                step = Step(_SIGNS[type(op)], operands=(places[left], places[right]))
            case _:
                hint = f"+ - * / ** and brackets are taken, numbers, names and {', '.join(FUNCTIONS)}"
                raise ExpressionError("holds what is not arithmetic", hint)
        places[node] = table.add(step)
    return table.expression(places[tree], "").steps


_SIGNS: dict[type[ast.AST], str] = {ast.Add: "+", ast.Sub: "-", ast.Mult: "*", ast.Div: "/", ast.Pow: "**"}


def _degree(operation: str, degrees: Sequence[int]) -> int:
    """Return 0 for a constant, 1 for a term affine in the parameters as it is written, 2 otherwise."""
    match operation, degrees:
        case (("number" | "name"), _):
            return int(operation == "name")
        case (("negative" | "+" | "-"), _):
            return max(degrees)
        case "*", [a, b]:
            return min(a + b, 2)
        case "/", [a, 0]:
            return a
    return 2 * min(sum(degrees), 1)
