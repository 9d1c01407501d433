"""The plan of a sweep: a grid of settings, a verb, and a permanent key of each point.

A trade of time against amplitude against accuracy is a sweep with settings and a table of its own.
"""

from __future__ import annotations

import hashlib
import itertools
import json
import math
import re
from collections.abc import Collection, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field, replace
from functools import cached_property
from pathlib import Path
from typing import get_args

import numpy as np

from inputdesign_cli.errors import STANDARD_STREAM, Location, OutputError, SpecError, bad_spec
from inputdesign_cli.figures.sweep_table import SweepAxis, SweepContent, SweepTable, Trade, read_content
from inputdesign_cli.outcome.run_directory import digest
from inputdesign_cli.outcome.run_files import environment
from inputdesign_cli.questions import Verb
from inputdesign_cli.regular_file import read_regular
from inputdesign_cli.specification import Spec, SpecTemplate, Sweep, moved_names, read_template, renamed
from inputdesign_cli.specification.models.sweep import range_values
from inputdesign_cli.specification.yaml.plain import plain, to_yaml
from inputdesign_cli.specification.yaml.reader import read
from inputdesign_cli.specification.yaml.scalars import resolve
from inputdesign_cli.sweeps.points import Layout, PointJob
from inputdesign_cli.version import __version__

Settings = Sequence[str] | Mapping[str, object]
"""The settings that are varied: texts as `--set` takes them, or keys and their values."""
MOST_POINTS = 1_000_000
_KEY_LENGTH = 24
_TRIED = 50  # points that are tried, evenly spread, before a spec is refused as a whole
_WORD = re.compile(r"[A-Za-z_][\w.-]*")
_LENGTHS = (0.25, 0.5, 1.0, 2.0)  # factors on the length of the experiment in a trade
_AMPLITUDES = (0.5, 1.0, 2.0)  # factors on its amplitude
# The ratio that the record reaches, or without a record that of the design.
_QUANTITIES = ("signal.worst_ratio", "objective.value")


@dataclass(frozen=True)
class Grid:
    """Holds the axes of a sweep; a point is a tuple of texts, one per axis. The last axis runs fastest."""

    axes: tuple[SweepAxis, ...]
    zipped: bool = False

    def __len__(self) -> int:
        lengths = [len(axis.values) for axis in self.axes]
        return (min(lengths) if self.zipped else math.prod(lengths)) if lengths else 0

    @cached_property
    def points(self) -> Sequence[tuple[str, ...]]:
        """Return all points, in order."""
        values = [axis.values for axis in self.axes]
        return list(zip(*values, strict=True) if self.zipped else itertools.product(*values))

    def overrides(self, index: int) -> list[str]:
        """Return a point as `--set` takes it."""
        return [f"{axis.key}={text}" for axis, text in zip(self.axes, self.points[index], strict=True)]

    def block(self) -> dict[str, object]:
        """Return the grid as the `sweep` block of a spec."""
        values = {axis.key: [_data(text) for text in axis.values] for axis in self.axes}
        return {"set": values, "zip": True} if self.zipped else {"set": values}


def parse_settings(settings: Settings) -> tuple[list[str], list[SweepAxis]]:
    """Read `KEY=V1,V2,..` and `KEY=LOW:HIGH:STEP` as axes; `KEY=VALUE` stays an override of every point.

    Commas inside brackets, braces and quotes belong to a value. A mapping of keys to values takes the place
    of the spec's `sweep` block.

    Raises:
        SpecError: `bad-range`, `bad-override`, `sweep-twice`.
    """
    if isinstance(settings, Mapping):
        return [f"sweep={json.dumps({'set': plain(settings)})}"], []
    fixed: list[str] = []
    axes: dict[str, SweepAxis] = {}
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
            axes[key] = SweepAxis(key, tuple(texts))
    for key in (setting.partition("=")[0].strip() for setting in fixed):
        if key in axes:
            hint = "leave one of them out"
            raise bad_spec("sweep-twice", f"{key} is swept, and has one value too", hint=hint, key=key)
    return fixed, list(axes.values())


def build_grid(
    block: Sweep | None, axes: Sequence[SweepAxis], *, zipped: bool, single: Collection[str] = ()
) -> Grid:
    """Return the grid of the spec's `sweep` block; axes of the command line replace or join them.

    Args:
        single: keys with one value on the command line, which are no axes.

    Raises:
        SpecError: `sweep-empty`, `sweep-lengths`, `sweep-too-large`, `sweep-twice`.
    """
    stated = {} if block is None else block.set
    merged = {key: SweepAxis(key, tuple(map(_text, values))) for key, values in stated.items()}
    merged = {key: axis for key, axis in merged.items() if key not in single}
    merged |= {axis.key: axis for axis in axes}
    grid = Grid(tuple(merged.values()), zipped or (block is not None and block.zip))
    if not merged:
        message = "nothing is varied: no key has several values"
        hint = "write --set experiment.samples=250,500,1000 or --set spectrum.order=0:40:5"
        raise bad_spec("sweep-empty", message, hint=hint)
    for key in merged:
        # A value inside a block that is swept would be lost: each point states the whole block.
        within = (f"{key}.", f"{key}[")
        if inner := next((one for one in (*merged, *single) if one.startswith(within)), None):
            message = f"{key} is swept, and {inner}, which it holds, has values of its own"
            raise bad_spec("sweep-twice", message, hint="leave one of them out", key=key)
    lengths = {axis.key: len(axis.values) for axis in grid.axes}
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
    """Return the value of a text for `--set`, or the text itself if it cannot be read."""
    try:
        return read(text, "--set").data
    except SpecError:
        return text


@dataclass(frozen=True)
class Plan:
    """Holds the points of a sweep, in order; `source` is the file of the spec, or standard input."""

    draft: SpecTemplate
    grid: Grid
    verb: Verb
    source: Path
    _keys: dict[int, str] = field(default_factory=dict, repr=False)

    def key(self, index: int) -> str:
        """Return the key of a point, which the spec, its files, the verb and the version determine."""
        if index not in self._keys:
            overrides = self.grid.overrides(index)
            try:
                found = self.draft.digest(self.draft.variant(overrides))
            except SpecError:
                found = json.dumps([self.draft.digest(self.draft.data), overrides])
            name = f"{__version__} {self.verb} {found}".encode(errors="backslashreplace")
            self._keys[index] = hashlib.sha256(name).hexdigest()[:_KEY_LENGTH]
        return self._keys[index]

    def names(self, index: int, directory: Path) -> dict[str, str]:
        """Return the names of files in the run of a point below `directory`, by their names in the spec."""
        try:
            files = self.draft.files(self.draft.variant(self.grid.overrides(index)))
        except SpecError:
            return {}
        return moved_names(files, self.draft.folder, Layout(directory).run(self.key(index)))

    def job(self, index: int, directory: Path, *, carries: bool, figures: str) -> PointJob:
        """Return the job of a point in the `directory` of the sweep; it may carry the files of the spec."""
        overrides, files = tuple(self.grid.overrides(index)), None
        if carries:
            with suppress(SpecError):
                names = [*self.draft.included, *self.draft.files(self.draft.variant(overrides))]
                files = {name: read_regular(self.draft.folder / name) for name in names}
        key, moved = self.key(index), self.names(index, directory)
        return PointJob(index, key, self.draft, overrides, self.verb, figures, moved, files)

    def resolved(self, index: int, directory: Path) -> str | None:
        """Return the `spec.yaml` of a point in the `directory` of the sweep, or None for an invalid spec."""
        try:
            spec = self.draft.spec(self.grid.overrides(index))
            return renamed(spec.to_yaml(), self.names(index, directory))
        except SpecError:
            return None

    @property
    def base(self) -> dict[str, object]:
        """Return the content of the spec without its parts about a sweep."""
        return {key: value for key, value in self.draft.data.items() if key != "sweep"}

    def summary(self, made_from: Sequence[str], statuses: Mapping[str, int]) -> SweepContent:
        """Return the content of sweep.json.

        Args:
            made_from: the spec file as it is seen from the directory.
            statuses: the number of points of each status.
        """
        return SweepContent(
            title=str(self.draft.data.get("title", "")),
            verb=self.verb,
            made_from=tuple(made_from),
            asked_sha256=digest(to_yaml(self.base)),
            axes=self.grid.axes,
            zip=self.grid.zipped,
            points=len(self.grid),
            statuses=statuses,
            environment=environment(),
        )

    def check_place(self, made_from: Sequence[str], root: Path) -> bool:
        """Refuse a directory with the sweep of another spec, of other keys, or of another command.

        The same spec file, or a spec with the same content, may go on with other values of the same keys.
        Return whether the spec has changed since then.

        Raises:
            OutputError: `output-other-run`.
        """
        try:
            there = read_content(root)
        except (OSError, ValueError, RecursionError):
            return False  # a sweep that was killed at its very start left nothing to compare
        edited = there.asked_sha256 != digest(to_yaml(self.base))
        ours, keys = ([axis.key for axis in axes] for axes in (self.grid.axes, there.axes))
        same_file = there.made_from == tuple(made_from) != (STANDARD_STREAM,)
        if there.verb != self.verb:
            what = f"the command {there.verb}, not {self.verb}"
        elif set(keys) != set(ours):
            what = f"{', '.join(keys)}, not {', '.join(ours)}"
        elif edited and not same_file:
            what = "another spec" + (f" ({there.made_from[0]} as seen from there)" if there.made_from else "")
        else:
            return edited
        raise OutputError.because(
            "output-other-run",
            f"{root} holds the sweep of {what}, and would lose its table",
            hint="choose another directory with -o, or replace the sweep with --overwrite",
        )


def build_plan(
    spec: Path,
    settings: Settings,
    *,
    zipped: bool = False,
    verb: Verb = "solve",
    confine: Path | None = None,
    text: str | None = None,
    overrides: Sequence[str] = (),
) -> Plan:
    """Build the plan of a sweep from a spec and from settings as `parse_settings` reads them.

    Args:
        spec: the file, or with `text` the place where it would be.
        overrides: changes of the spec itself; settings may give other values to the same keys.
        confine: the folder outside of which the spec may name no files.
        text: the text of the spec, if it is in no file.

    Raises:
        SpecError: the spec, its `sweep` block or a setting cannot be used, or no point is a spec.
    """
    if verb not in get_args(Verb):
        hint = "sweep with --verb solve"
        raise bad_spec("not-supported", f"this version does not {verb} anything", hint=hint)
    fixed, axes = parse_settings(settings)
    draft = read_template(spec, [*overrides, *fixed], confine=confine, text=text)
    source = Path(STANDARD_STREAM) if text is not None else spec
    single = [setting.partition("=")[0].strip() for setting in fixed]
    grid, first = build_grid(draft.sweep(), axes, zipped=zipped, single=single), None
    # An error of the spec as a whole, as a misspelt key, is refused before every point fails.
    for index in dict.fromkeys(i * (len(grid) - 1) // _TRIED for i in range(_TRIED + 1)):
        try:
            draft.spec(grid.overrides(index))
        except SpecError as error:
            first = first or error
        else:
            return Plan(draft, grid, verb, source)
    assert first is not None  # a grid has points
    raise first


def trade_plan(
    file: Path, spec: Spec, words: Sequence[str], overrides: Sequence[str], confine: Path | None
) -> Plan:
    """Return the plan of a sweep for the best accuracy at several lengths and amplitudes.

    Args:
        file: the file of the spec, with its `overrides` and `confine`.
        spec: the experiment, tried at a quarter to twice its length and half to twice its amplitude.
        words: "samples", "amplitude" or both.

    Raises:
        SpecError: `--trade` cannot be done: `needs-limits` where nothing limits the power or the amplitude.
    """
    try:
        return build_plan(file, _trade_settings(spec, words), confine=confine, overrides=overrides)
    except SpecError as error:
        (found, *_) = error.diagnostics
        message = f"--trade looks for the best accuracy: {found.message}"
        hint = f"{found.hint}, or " * (found.code == "needs-limits") + "leave out --trade"
        # The user has not typed the settings of the trade: the error names the key, not a place in them.
        raise spec.complain(found.code, message, hint=hint, key=found.key) from error


def _trade_settings(spec: Spec, words: Sequence[str]) -> list[str]:
    lengths = ("limits.samples", "limits.duration", "signal.samples", "experiment.duration")
    settings = {"objective": "best_accuracy", "solver.any_spectrum": "false"}
    settings |= dict.fromkeys((*lengths, "sweep"), "null")
    shares = _LENGTHS if "samples" in words else (1.0,)
    counts = dict.fromkeys(max(round(share * spec.experiment.samples), 1) for share in shares)
    settings["experiment.samples"] = ",".join(map(str, counts))
    if "amplitude" in words:
        stated = spec.limits.amplitude
        if stated is None or stated.input is None:
            message = "amplitude is to be traded, but no amplitude is limited"
            raise bad_spec("needs-limits", message, hint="add limits.amplitude.input", key="limits")
        texts = [json.dumps((share * np.array(stated.input)).tolist()) for share in _AMPLITUDES]
        settings["limits.amplitude" if stated.output is None else "limits.amplitude.input"] = ",".join(texts)
    return [f"{key}={value}" for key, value in settings.items()]


def trade_of(table: SweepTable, spec: Spec) -> Trade:
    """Return the table of the sweep of `trade_plan` as a matrix."""
    samples = table.numbers("experiment.samples")
    found = np.full(table.rows, spec.experiment.samples, float) if samples is None else samples
    key = next((key for key in table.axes if key.startswith("limits.amplitude")), None)
    texts = [""] * table.rows if key is None else table.columns[key]
    criterion = spec.accuracy.criterion is not None
    known = (table.numbers(name) for name in (_QUANTITIES[1:] if criterion else _QUANTITIES))
    values = next((v for v in known if v is not None), np.full(table.rows, np.nan))
    lengths, names = np.unique(found), [f"amplitude {text}" if text else "best record" for text in texts]
    rows = {name: np.full(lengths.size, np.nan) for name in names}
    for name, place, value in zip(names, np.searchsorted(lengths, found), values, strict=True):
        rows[name][place] = value
    step, unit = (spec.sample_time, spec.time_unit) if spec.plant.sampled else (1.0, "samples")
    return Trade(lengths * step, unit, rows, criterion)
