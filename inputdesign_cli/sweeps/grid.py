"""The points of a sweep: axes, each a key with its values, in every combination or side by side."""

from __future__ import annotations

import json
import math
import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace

from inputdesign_cli.errors import Location, SpecError, bad_spec
from inputdesign_cli.specification import Sweep
from inputdesign_cli.specification.models.sweep import range_values
from inputdesign_cli.specification.yaml.plain import plain
from inputdesign_cli.specification.yaml.reader import read
from inputdesign_cli.specification.yaml.scalars import resolve

Settings = Sequence[str] | Mapping[str, object]
"""What is varied: texts as `--set` takes them, or keys and their values."""
MOST_POINTS = 1_000_000
_WORD = re.compile(r"[A-Za-z_][\w.-]*")


@dataclass(frozen=True)
class Axis:
    """Holds a key of the spec and the texts of its values, each as `--set KEY=TEXT` takes it."""

    key: str
    texts: tuple[str, ...]


@dataclass(frozen=True)
class Grid:
    """Generates the points as tuples of texts, one per axis, when asked for. The last axis runs fastest."""

    axes: tuple[Axis, ...]
    zipped: bool = False

    def __len__(self) -> int:
        lengths = [len(axis.texts) for axis in self.axes]
        return (min(lengths) if self.zipped else math.prod(lengths)) if lengths else 0

    def __getitem__(self, index: int) -> tuple[str, ...]:
        if not 0 <= index < len(self):
            raise IndexError(index)
        if self.zipped:
            return tuple(axis.texts[index] for axis in self.axes)
        texts = []
        for axis in reversed(self.axes):
            index, place = divmod(index, len(axis.texts))
            texts.append(axis.texts[place])
        return tuple(reversed(texts))

    def __iter__(self) -> Iterator[tuple[str, ...]]:
        return (self[i] for i in range(len(self)))

    def overrides(self, point: tuple[str, ...]) -> list[str]:
        """Return the point as `--set` takes it."""
        return [f"{axis.key}={text}" for axis, text in zip(self.axes, point, strict=True)]

    def block(self) -> dict[str, object]:
        """Return the grid as the `sweep` block of a spec."""
        values = {axis.key: [_data(text) for text in axis.texts] for axis in self.axes}
        return {"set": values, "zip": True} if self.zipped else {"set": values}


def parse_settings(settings: Settings) -> tuple[list[str], list[Axis]]:
    """Read `KEY=V1,V2,..` and `KEY=LOW:HIGH:STEP` as axes; `KEY=VALUE` stays an override of every point.

    Commas inside brackets, braces and quotes belong to a value. A mapping of keys to values takes the place
    of the spec's `sweep` block.

    Raises:
        SpecError: `bad-range`, `bad-override`, `sweep-twice`.
    """
    if isinstance(settings, Mapping):
        return [f"sweep={json.dumps({'set': plain(settings)})}"], []
    fixed: list[str] = []
    axes: dict[str, Axis] = {}
    for setting in settings:
        key, equals, text = setting.partition("=")
        parts = _split(text)
        try:
            texts = range_values(text) or parts
        except SpecError as error:
            (found,) = error.diagnostics
            place = Location(f"--set {setting}", 1, len(key) + 2, setting)
            raise SpecError(replace(found, location=place)) from None
        key = key.strip()
        if not equals or len(texts) < 2:
            fixed.append(setting)
        elif "" in texts:
            message = f"a value of --set {setting} is empty"
            raise bad_spec("bad-override", message, hint="remove the extra comma")
        elif key in axes:
            hint = "give all its values at once: key=v1,v2,v3"
            raise bad_spec("sweep-twice", f"{key} is swept by two settings", hint=hint, key=key)
        else:
            axes[key] = Axis(key, tuple(texts))
    return fixed, list(axes.values())


def build_grid(block: Sweep | None, axes: Sequence[Axis], *, zipped: bool) -> Grid:
    """Return the grid of the spec's `sweep` block; axes of the command line replace or join them.

    Raises:
        SpecError: `sweep-empty`, `sweep-lengths`, `sweep-too-large`.
    """
    merged: dict[str, Axis] = {}
    if block is not None:
        for key, values in block.set.items():
            merged[key] = Axis(key, tuple(_text(value) for value in values))
    for axis in axes:
        merged[axis.key] = axis
    grid = Grid(tuple(merged.values()), zipped or (block is not None and block.zip))
    if not merged:
        message = "nothing is varied: no key has several values"
        hint = "write --set experiment.samples=250,500,1000 or --set spectrum.order=0:40:5"
        raise bad_spec("sweep-empty", message, hint=hint)
    lengths = {axis.key: len(axis.texts) for axis in grid.axes}
    if grid.zipped and len(set(lengths.values())) > 1:
        listed = ", ".join(f"{key} has {n}" for key, n in lengths.items())
        message = f"values that are taken side by side must be equally many ({listed})"
        hint = "give each key as many values, or leave out --zip for every combination"
        raise bad_spec("sweep-lengths", message, hint=hint)
    if len(grid) > MOST_POINTS:
        message = f"the sweep has {len(grid)} points, and at most {MOST_POINTS} are run"
        hint = "vary fewer keys at once, or --zip them"
        raise bad_spec("sweep-too-large", message, hint=hint)
    return grid


def _split(text: str) -> tuple[str, ...]:
    """Return the parts between the commas that stand outside brackets and quotes."""
    parts, start, depth, quote = [], 0, 0, ""
    for i, character in enumerate(text):
        if quote:
            quote = "" if character == quote else quote
        elif character in "\"'" and not text[start:i].strip():
            quote = character
        elif character in "[{":
            depth += 1
        elif character in "]}":
            depth -= 1
        elif character == "," and depth == 0:
            parts.append(text[start:i].strip())
            start = i + 1
    return (*parts, text[start:].strip())


def _text(value: object) -> str:
    """Return a value of the `sweep` block as the text that `--set` takes."""
    if isinstance(value, str) and _WORD.fullmatch(value) and resolve(value) == value:
        return value
    return json.dumps(value, ensure_ascii=False)


def _data(text: str) -> object:
    """Return the value of a text for `--set`; a text that cannot be read stays one."""
    try:
        return read(text, "--set").data
    except SpecError:
        return text
