"""Specs with some of their parts made extreme, removed, repeated or of another kind."""

from __future__ import annotations

import copy
import random
from pathlib import Path

import yaml

import inputdesign_cli

ROOT = Path(__file__).parents[2]
SHIPPED = sorted(
    [
        *(ROOT / "specs").glob("*.yaml"),
        *(Path(inputdesign_cli.__file__).parent / "cli/starters").glob("*.yaml"),
    ]
)

NUMBERS = (
    *(0, 1, -1, 2, 3, 31, 200, 2000, 100_000, 10**6, 10**9, 10**15, 2**53, 0.5, 1e-3, 0.999999, 1.000001),
    *(1e-300, 1e300, 1e-150, 1e150, 1e-40, 1e40, 1e-12, 1e12, 5e-324, float("nan"), float("inf")),
)
FACTORS = (-1.0, 1e-6, 1e-3, 1e3, 1e6, 1e-20, 1e20, 1.0 + 1e-9, 0.9)
OTHERS = ("", "x", "free", "white", "D", "multisine", "zoh", None, True, [], {}, [1], [[1]], {"type": "fir"})
# Parts that change the question of a spec into which they are put.
GRAFTS = (
    {"objective": "best_accuracy", "limits": {"input_power": 1.0}},
    {"objective": "shortest_experiment", "limits": {"output_power": 1.0}},
    *({"spectrum": {"type": kind}} for kind in ("free", "white")),
    {"spectrum": {"type": "multisine", "lines": 30}},
    {"spectrum": {"type": "polynomial", "order": 6, "band": [0.1, 1.0]}},
    {"accuracy": {"criterion": "D"}, "limits": {"input_power": 1.0}},
    {"accuracy": {"criterion": "T"}, "limits": {"output_power": 1.0}},
    {"limits": {"amplitude": 1.0}},
    {"signal": {"type": "binary"}},
)


def places(node, path=()):
    """The path of every value below a node."""
    items = node.items() if isinstance(node, dict) else enumerate(node) if isinstance(node, list) else ()
    for key, value in items:
        yield (*path, key)
        yield from places(value, (*path, key))


def mutated(draw: random.Random) -> dict:
    """A shipped spec with one to three changes."""
    data = yaml.safe_load(draw.choice(SHIPPED).read_text(encoding="utf-8"))
    data.pop("sweep", None)
    if draw.random() < 0.4:
        data |= copy.deepcopy(draw.choice(GRAFTS))
    for _ in range(draw.choice((0, 1, 1, 1, 2, 3))):
        _change(data, draw)
    # Long computations are not looked for.
    solver = data.setdefault("solver", {})
    if isinstance(solver, dict):
        solver.setdefault("time_limit", 20)
    return data


def _change(data: dict, draw: random.Random) -> None:
    found = list(places(data))
    numbers = [path for path in found if _is_number(_at(data, path))]
    extreme = bool(numbers) and draw.random() < 0.75
    path = draw.choice(numbers if extreme else found)
    holder, key = _at(data, path[:-1]), path[-1]
    value = holder[key]
    if extreme:
        holder[key] = draw.choice(NUMBERS) if draw.random() < 0.5 else value * draw.choice(FACTORS)
    elif isinstance(value, list) and draw.random() < 0.5:
        holder[key] = value + copy.deepcopy(value) * draw.choice((1, 1, 30))
    elif draw.random() < 0.5:
        del holder[key]
    else:
        holder[key] = copy.deepcopy(draw.choice(OTHERS + NUMBERS))


def _is_number(value) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool)


def _at(node, path):
    for step in path:
        node = node[step]
    return node
