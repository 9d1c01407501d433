"""Turn numbers beyond double precision into errors at the border of every task."""

from __future__ import annotations

import math
import warnings
from collections.abc import Iterator
from contextlib import contextmanager

import numpy as np

from inputdesign_cli.errors import InaccurateError
from inputdesign_cli.outcome.results import Results

# Numbers of a spec within this many powers of ten of one are not to blame.
_USUAL = 6.0


@contextmanager
def sound_arithmetic(extreme: tuple[str, float]) -> Iterator[None]:
    """Raise overflow, division by zero and singular matrices inside as errors of the spec.

    Args:
        extreme: the key of the spec whose number is farthest from one, and how many powers of ten that is.

    Raises:
        InaccurateError: `beyond-precision`, `numerically-singular`.
    """
    with np.errstate(over="raise", divide="raise", invalid="raise"), warnings.catch_warnings():
        warnings.simplefilter("error", RuntimeWarning)
        try:
            yield
        except np.linalg.LinAlgError as error:
            raise InaccurateError.because(
                "numerically-singular",
                "the information matrix is singular to working precision: parameters are nearly alike",
                "lower the orders, or look for poles and zeros that nearly cancel",
                "plant",
            ) from error
        except (ArithmeticError, RuntimeWarning) as error:
            raise _beyond(extreme, str(error)) from error


def finite(results: Results, extreme: tuple[str, float]) -> Results:
    """Return the results if every number of them is finite.

    Raises:
        InaccurateError: `beyond-precision`.
    """
    try:
        _ = results.result
    except ValueError as error:
        raise _beyond(extreme, str(error)) from error
    for name, table in results.tables.items():
        for column, values in table.columns.items():
            if not np.all(np.isfinite(values)):
                raise _beyond(extreme, f"{column} of {name}.csv has values that are not finite")
    return results


def most_extreme(data: object) -> tuple[str, float]:
    """Return the key of the number in plain data that is farthest from one, and its powers of ten."""

    def walk(node: object, key: str) -> Iterator[tuple[str, float]]:
        if isinstance(node, dict):
            for name, value in node.items():
                yield from walk(value, f"{key}.{name}" if key else str(name))
        elif isinstance(node, list | tuple):
            for index, value in enumerate(node):
                yield from walk(value, f"{key}[{index}]")
        elif isinstance(node, int | float) and not isinstance(node, bool) and node:
            yield key, abs(math.log10(abs(node)))

    return max(walk(data, ""), key=lambda found: found[1], default=("", 0.0))


def _beyond(extreme: tuple[str, float], why: str) -> InaccurateError:
    key, far = extreme
    hint = "choose units in which the signals and the parameters are of the order of one"
    if far > _USUAL:
        hint = f"{key} is the most extreme number of the spec: {hint}"
    message = f"the numbers of this question leave the range of double precision: {why}"
    return InaccurateError.because("beyond-precision", message, hint, key if far > _USUAL else "")
