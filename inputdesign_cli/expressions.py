"""Expressions in named parameters, as `K*(1 - exp(-h/T))`: read by a list of what is allowed, never run.

The text is parsed by Python's `ast` alone and walked by our own rules, with derivatives by forward
differentiation through the tree: every step carries its value and its slope in all parameters.
"""

from __future__ import annotations

import ast
import keyword
import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

LONGEST = 500
CONSTANTS = {"pi": math.pi}

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


class ExpressionError(ValueError):
    """What is wrong with an expression; its second argument says how to mend it."""

    def __init__(self, message: str, hint: str = "") -> None:
        super().__init__(message)
        self.message, self.hint = message, hint


class _Dual(NamedTuple):
    """A value and its slope (m,) in all parameters."""

    value: float
    slope: Array


@dataclass(frozen=True)
class Expression:
    """A text that has been checked, and what it is worth.

    Raises:
        ExpressionError: by `of`, for what is no expression.
    """

    text: str

    @classmethod
    def of(cls, text: str) -> Expression:
        """The expression of a text; raises `ExpressionError` for anything that is not allowed."""
        found = cls(text)
        _check(found._tree)
        return found

    @cached_property
    def _tree(self) -> ast.expr:
        if len(self.text) > LONGEST:
            raise ExpressionError(
                f"has {len(self.text)} characters, and at most {LONGEST} are taken", "name a part of it"
            )
        try:
            return ast.parse(self.text.strip(), mode="eval").body
        except (SyntaxError, ValueError, MemoryError, RecursionError) as error:
            hint = "write * for a product, ** for a power, and close every bracket"
            raise ExpressionError("is no expression", hint) from error

    @cached_property
    def names(self) -> frozenset[str]:
        """The parameters that it names."""
        functions = {node.func for node in ast.walk(self._tree) if isinstance(node, ast.Call)}
        return frozenset(
            node.id
            for node in ast.walk(self._tree)
            if isinstance(node, ast.Name) and node not in functions and node.id not in CONSTANTS
        )

    @cached_property
    def affine(self) -> bool:
        """Whether it is a sum of constants and of constant multiples of parameters, as it is written."""
        return _degree(self._tree) <= 1

    def at(self, symbols: Sequence[str], values: Array) -> tuple[float, Array]:
        """Its value and its gradient (m,) where the `symbols` have these `values` (m,).

        Both are not a number where it is not defined, as one over zero or the root of a negative number.

        Raises:
            KeyError: a name is not among the symbols.
        """
        slopes = np.eye(len(symbols))
        known = {symbol: _Dual(float(values[i]), slopes[i]) for i, symbol in enumerate(symbols)}
        try:
            found = _evaluated(self._tree, known, np.zeros(len(symbols)))
        except (ArithmeticError, ValueError):
            return math.nan, np.full(len(symbols), np.nan)
        return found.value, found.slope


def is_name(text: str) -> bool:
    """Whether a parameter may be called so."""
    taken = text in CONSTANTS or text in FUNCTIONS or keyword.iskeyword(text)
    return text.isidentifier() and text.isascii() and not taken


def _check(tree: ast.expr) -> None:
    """Raise `ExpressionError` for what is not arithmetic in names and numbers."""
    for node in ast.walk(tree):
        match node:
            case ast.Constant(value=int() | float() as number) if not isinstance(number, bool):
                if not math.isfinite(_number(number)):
                    raise ExpressionError("holds a number that is too large")
            case ast.Call(func=ast.Name(id=name), args=[_], keywords=[]) if name in FUNCTIONS:
                pass
            case ast.Call(func=ast.Name(id=name)):
                taken = (
                    "takes one argument"
                    if name in FUNCTIONS
                    else f"is no function: {', '.join(FUNCTIONS)} are"
                )
                raise ExpressionError(f"calls {name}(..)", f"{name} {taken}")
            case ast.BinOp(op=ast.BitXor()):
                raise ExpressionError("holds ^", "write ** for a power")
            case ast.BinOp(op=ast.Add() | ast.Sub() | ast.Mult() | ast.Div() | ast.Pow()):
                pass
            case ast.UnaryOp(op=ast.USub() | ast.UAdd()) | ast.Name() | ast.operator() | ast.unaryop():
                pass
            case ast.expr_context():
                pass
            case _:
                raise ExpressionError(
                    "holds what is not arithmetic",
                    f"+ - * / ** and brackets are taken, numbers, names and {', '.join(FUNCTIONS)}",
                )


def _number(value: float) -> float:
    try:
        return float(value)
    except OverflowError:
        return math.inf


def _evaluated(node: ast.AST, known: Mapping[str, _Dual], zero: Array) -> _Dual:
    match node:
        case ast.Constant(value=int() | float() as number):
            return _Dual(float(number), zero)
        case ast.Name(id=name):
            return known[name] if name in known or name not in CONSTANTS else _Dual(CONSTANTS[name], zero)
        case ast.UnaryOp(op=op, operand=operand):
            a = _evaluated(operand, known, zero)
            return _Dual(-a.value, -a.slope) if isinstance(op, ast.USub) else a
        case ast.Call(func=ast.Name(id=name), args=[argument]):
            a, (value, slope) = _evaluated(argument, known, zero), FUNCTIONS[name]
            # A constant has no slope, also where the function has none: sqrt(0).
            return _Dual(value(a.value), slope(a.value) * a.slope if np.any(a.slope) else zero)
        case ast.BinOp(left=left, op=op, right=right):
            return _combined(op, _evaluated(left, known, zero), _evaluated(right, known, zero))
    raise ValueError("the expression has been checked")


def _combined(op: ast.operator, a: _Dual, b: _Dual) -> _Dual:
    match op:
        case ast.Add():
            return _Dual(a.value + b.value, a.slope + b.slope)
        case ast.Sub():
            return _Dual(a.value - b.value, a.slope - b.slope)
        case ast.Mult():
            return _Dual(a.value * b.value, b.value * a.slope + a.value * b.slope)
        case ast.Div():
            ratio = a.value / b.value
            return _Dual(ratio, (a.slope - ratio * b.slope) / b.value)
        case _:
            power = math.pow(a.value, b.value)
            slope = np.zeros_like(a.slope)
            if np.any(a.slope) and b.value:
                slope = slope + b.value * math.pow(a.value, b.value - 1.0) * a.slope
            if np.any(b.slope):
                slope = slope + power * math.log(a.value) * b.slope
            return _Dual(power, slope)


def _degree(node: ast.AST) -> int:
    """0 of a constant, 1 of what is affine in the parameters as it is written, 2 of anything else."""
    match node:
        case ast.Name(id=name):
            return int(name not in CONSTANTS)
        case ast.UnaryOp(operand=operand):
            return _degree(operand)
        case ast.Call(args=[argument]):
            return 2 * min(_degree(argument), 1)
        case ast.BinOp(left=left, op=op, right=right):
            a, b = _degree(left), _degree(right)
            match op:
                case ast.Add() | ast.Sub():
                    return max(a, b)
                case ast.Mult():
                    return min(a + b, 2)
                case ast.Div() if b == 0:
                    return a
            return 2 * min(a + b, 1)
    return 0
