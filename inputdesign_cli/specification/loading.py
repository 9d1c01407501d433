"""YAML text or file to `Spec`, its variants before validation, and estimates in model files.

All diagnostics of a file come together.
"""

from __future__ import annotations

import copy
import hashlib
import os
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from math import isclose
from pathlib import Path as FilePath

import yaml
from pydantic import ValidationError

from inputdesign_cli.errors import Diagnostic, Location, SpecError
from inputdesign_cli.regular_file import read_regular
from inputdesign_cli.specification.checks import related, run_checks
from inputdesign_cli.specification.fading_noise import in_filters
from inputdesign_cli.specification.models.experiment import Cost, Estimated
from inputdesign_cli.specification.models.pydantic_errors import shorten, translate
from inputdesign_cli.specification.models.section import PathDiagnostic
from inputdesign_cli.specification.models.spec import OF_DESIGNS, Spec
from inputdesign_cli.specification.models.spectrum import FirSpectrum
from inputdesign_cli.specification.models.sweep import Sweep
from inputdesign_cli.specification.models.wording import show
from inputdesign_cli.specification.plugins import install
from inputdesign_cli.specification.schema import keep_inside, named_files
from inputdesign_cli.specification.yaml.files import is_outside, read_text
from inputdesign_cli.specification.yaml.overrides import KEY, apply_includes, apply_overrides
from inputdesign_cli.specification.yaml.places import Path, Places, format_key
from inputdesign_cli.specification.yaml.plain import Plain, fingerprint
from inputdesign_cli.specification.yaml.reader import Tree, read

_WHOLE = 1e-9  # rounding of a number of samples


def in_samples(data: dict[str, Plain]) -> Iterator[PathDiagnostic]:
    """Add `samples` to each section with a `duration`: the largest number that fits.

    An experiment without a length is as long as limits allow, unless the shortest one is asked for.
    """

    def positive(value: Plain) -> bool:
        return isinstance(value, int | float) and not isinstance(value, bool) and 0 < value < 1e40

    step, limits, experiment = data.get("sample_time", 1.0), data.get("limits"), data.get("experiment", {})
    for name, section in (("experiment", experiment), ("limits", limits)):
        if not isinstance(section, dict) or "duration" not in section:
            continue
        duration, path = section["duration"], (name, "duration")
        if "samples" in section:
            message = "{key} and samples state the same"
            yield PathDiagnostic("conflicting-keys", message, "remove one of the two", path, at_key=True)
        elif positive(duration) and positive(step):
            section["samples"] = samples = int(duration / step + _WHOLE)
            if samples < 1:
                del section["samples"]
                message = f"{{key}} is {show(float(duration))}, less than sample_time"
                yield PathDiagnostic("out-of-range", message, "look at sample_time and time_unit", path)
    most = limits.get("samples") if isinstance(limits, dict) else None
    stated = not isinstance(experiment, dict) or {"samples", "duration"} & experiment.keys()
    whole = isinstance(most, int) and positive(most)
    if whole and not stated and data.get("objective") != "shortest_experiment":
        data["experiment"] = {**experiment, "samples": most}


# Sections in place of ones that could not be read, so that the rest can still be checked.
_STAND_IN: dict[str, dict[str, Plain]] = {"plant": {"B": [0, 1]}, "noise": {"variance": 1}}

_MOST_ROUNDS = 50
_MOST_REPORTED = 100


def load_spec(
    path: str | os.PathLike[str],
    overrides: Sequence[str] = (),
    *,
    confine: FilePath | None = None,
    design: bool | None = True,
) -> Spec:
    """Read a spec file, with `key.path=value` texts applied in order; `null` removes a key.

    Outside the folder `confine` the spec may name no files. With `design` it must ask for a design, or for
    an analysis, that can be answered; None: only if it has some key of a design. Raises `SpecError`, with
    everything that is wrong in the order of the file.
    """
    text, folder = read_text(path), FilePath(path).parent
    return parse_spec(text, os.fspath(path), overrides, folder=folder, confine=confine, design=design)


def parse_spec(
    text: str,
    file: str = "<spec>",
    overrides: Sequence[str] = (),
    *,
    folder: FilePath | None = None,
    confine: FilePath | None = None,
    design: bool | None = True,
) -> Spec:
    """Read a spec from its text in YAML, as `load_spec` does from a file, with the same arguments.

    `file` is its name in diagnostics; paths in it are relative to `folder`, by default the current one.
    """
    return build(_read_tree(text.removeprefix("\ufeff"), file, overrides, folder, confine), design)


def build(tree: Tree, design: bool | None = True) -> Spec:
    """Return the spec of plain data, checked as a whole; arguments and errors as for `load_spec`."""
    install()
    _check_mapping(tree)
    design = any(key in tree.data for key in OF_DESIGNS) if design is None else design
    spec, found = _validate(tree, design=design)
    diagnostics = [*tree.diagnostics, *(one.placed(tree.places, "the spec") for one in found)]
    if diagnostics or spec is None:
        raise SpecError(_reported(diagnostics, tree.places))
    spec = _with_defaults(spec)
    spec._source, spec._design = tree, design
    return spec


Spec.build = build


def _read_tree(
    text: str, file: str, overrides: Sequence[str], folder: FilePath | None, confine: FilePath | None
) -> Tree:
    """Return the plain data of a spec with included files and overrides, not yet checked.

    A file outside `confine` is a diagnostic of the tree. Raises `SpecError`: it is no mapping in YAML, or
    a file cannot be included.
    """
    tree = read(text, file)
    tree.folder = folder or FilePath()
    _check_mapping(tree)
    first = [override for override in overrides if override.partition("=")[0].strip() == KEY]
    apply_overrides(tree, first)
    apply_includes(tree, Spec.model_fields.keys(), confine)
    apply_overrides(tree, [override for override in overrides if override not in first])
    if confine is not None:
        keep_inside(tree, confine)
    return tree


def _check_mapping(tree: Tree) -> None:
    """Raise `SpecError` (`empty-file`, `not-a-mapping`) unless the data of a spec are a mapping."""
    if isinstance(tree.data, dict):
        return
    code, message = "not-a-mapping", 'a spec is a mapping of keys ("plant: ..", "noise: ..")'
    if tree.data is None:
        code, message = "empty-file", "the spec is empty"
    first = next((Location(file, 1, 1) for file in tree.places.files), None)
    hint = "`idesign init` writes a spec to start from"
    raise SpecError.because(code, message, hint, location=tree.places.at(()) or first)


def _validate(tree: Tree, *, design: bool) -> tuple[Spec | None, list[PathDiagnostic]]:
    """Validate, remove wrong parts, and validate again, until the rest is a spec that can be checked.

    A wrong number in `plant` does not hide a contradiction in `accuracy`. Errors in a removed part, or in a
    section around it, are consequences and are not reported.
    """
    data = copy.deepcopy(tree.data)
    noise = None if design else data.setdefault("noise", {})
    if isinstance(noise, dict) and "standard_deviation" not in noise:
        noise.setdefault("variance", 1.0)  # it may be left out if it is to be estimated
    reported: list[PathDiagnostic] = []
    broken = set(tree.broken)
    for find in (in_filters, _empty, in_samples):  # in this order: noise of empty size gets a variance
        for one in list(find(data)):
            reported.append(one)
            broken.add(one.path)
            _prune(data, one.path)
    for attempt in range(_MOST_ROUNDS):
        try:
            spec = Spec.model_validate(data)
        except ValidationError as error:
            found = translate(error, data, Spec)
            # The right name of a misspelt key counts as present: neither missing nor without effect.
            broken |= {(*one.path[:-1], one.meant) for one in found if one.meant}
            reported += [one for one in found if not _consequence(one, broken, attempt)]
            for one in found:
                broken.add(one.path)
                _prune(data, one.path)
            if len(reported) > _MOST_REPORTED:
                return None, reported
            continue
        checked = [shorten(one, tree.data) for one in run_checks(spec, broken, design=design)]
        return spec, reported + [one for one in checked if not related(one.path, broken)]
    return None, reported


def _consequence(found: PathDiagnostic, broken: set[Path], attempt: int) -> bool:
    """Return whether an error follows from parts that were removed before.

    A removed part may have decided the kind of plant or spectrum. Later attempts therefore report no missing
    or unknown keys and names: the first attempt has reported them.
    """
    if attempt > 0 and found.code in ("unknown-key", "unsuitable-key", "unknown-name", "unused-parameter"):
        return True
    if found.keys:
        return any(related((*found.path, key), broken) for key in found.keys)
    missing = attempt > 0 and found.code == "missing-key"
    return related(found.path[:-1] if missing else found.path, broken)


def _empty(data: Plain, path: Path = ()) -> Iterator[PathDiagnostic]:
    """Yield a diagnostic for every key and entry without a value."""
    if data is None:
        comma = isinstance(path[-1], str) and path[-1].isdecimal()
        mend = "use a decimal point: a comma begins the next key"
        hint = mend if comma else "write a value, or remove the key"
        yield PathDiagnostic("empty-value", "{key} has no value", hint, path, at_key=True)
    items = data.items() if isinstance(data, dict) else enumerate(data) if isinstance(data, list) else ()
    for step, value in items:
        yield from _empty(value, (*path, step))


def _prune(data: dict[str, Plain], path: Path) -> None:
    """Remove the deepest mapping entry on the path; replace a required section."""
    holder, key, node = data, "", data
    for step in path:
        if isinstance(node, dict) and step in node:
            holder, key = node, str(step)
        elif not (isinstance(node, list) and isinstance(step, int) and step < len(node)):
            break
        node = node[step]
    if holder is data and path and path[0] in _STAND_IN:
        data[str(path[0])] = copy.deepcopy(_STAND_IN[str(path[0])])
    else:
        holder.pop(key, None)


def _with_defaults(spec: Spec) -> Spec:
    """Fill in the defaults that depend on other sections."""
    update: dict[str, Plain] = {}
    if "cost" not in spec.model_fields_set and spec.closed_loop:
        update["cost"] = Cost(input_power=1.0, output_power=1.0)
    single = (spec.plant.inputs, spec.plant.outputs) == (1, 1)
    lines = spec.accuracy.frequency_response is not None  # its lines are the spectrum
    if spec.spectrum is None and not lines and spec.goal == "least_cost" and spec.plant.sampled and single:
        update["spectrum"] = FirSpectrum(type="fir")
    return spec.model_copy(update=update) if update else spec


def _reported(diagnostics: list[Diagnostic], places: Places) -> list[Diagnostic]:
    """Return the first diagnostics, in the order of file and overrides; the last one counts the others."""

    def place(diagnostic: Diagnostic) -> tuple[int, int, int]:
        at, files = diagnostic.location, places.files
        if at is None:
            return -1, 0, 0
        return files.index(at.file) if at.file in files else len(files), at.line, at.column

    found = sorted(dict.fromkeys(diagnostics), key=place)
    left = len(found) - _MOST_REPORTED
    if left > 0:
        more = Diagnostic("more-errors", f"{left} more errors are not shown", "mend these first")
        found[_MOST_REPORTED:] = [more]
    return found


@dataclass(frozen=True)
class SpecTemplate:
    """The text of a spec, its file, the overrides of all variants, and their data.

    `included` are files whose blocks are in the data; outside `confine` the spec may name no files.
    """

    text: str
    file: str
    folder: FilePath
    overrides: tuple[str, ...]
    data: dict[str, Plain]
    included: tuple[str, ...] = ()
    confine: FilePath | None = None

    def spec(self, overrides: Sequence[str]) -> Spec:
        """Return the checked spec of one variant, without the `sweep` block; errors as for `load_spec`."""
        every = [*self.overrides, *overrides, "sweep=null"]
        return parse_spec(self.text, self.file, every, folder=self.folder, confine=self.confine)

    def variant(self, overrides: Sequence[str]) -> dict[str, Plain]:
        """Return the plain data of one variant, without the `sweep` block; only overrides are checked."""
        tree = Tree(copy.deepcopy(self.data))
        apply_overrides(tree, [*overrides, "sweep=null"])
        return tree.sound().data

    def digest(self, data: dict[str, Plain]) -> str:
        """Return the SHA-256 of a variant and of the contents of every file that it names."""
        contents = {n: hashlib.sha256(read_regular(self.folder / n)).hexdigest() for n in self.files(data)}
        return fingerprint({"spec": data, "files": contents} if contents else data)

    def files(self, data: dict[str, Plain]) -> list[str]:
        """Return the names of existing files that a variant names and may read."""
        named = {name for _, name in named_files(data) if os.path.isfile(self.folder / name)}
        return sorted(n for n in named if not (self.confine and is_outside(self.folder / n, self.confine)))

    def sweep(self) -> Sweep | None:
        """Return the checked `sweep` block, or None; `SpecError` with the place of every error in it."""
        if "sweep" not in self.data:
            return None
        try:
            return Sweep.model_validate(self.data["sweep"])
        except ValidationError as error:
            found, places = translate(error, self.data["sweep"], Sweep), read(self.text, self.file).places
            absolute = [replace(one, path=("sweep", *one.path)) for one in found]
            raise SpecError([one.placed(places, "the spec") for one in absolute]) from None


def read_template(
    path: str | os.PathLike[str],
    overrides: Sequence[str] = (),
    *,
    confine: FilePath | None = None,
    text: str | None = None,
) -> SpecTemplate:
    """Read a spec file, or its `text`, with `overrides` applied; nothing is checked yet.

    Raises `SpecError`: it is no mapping in YAML, or an override or an included file is wrong.
    """
    text, file = read_text(path) if text is None else text, os.fspath(path)
    tree = _read_tree(text, file, overrides, FilePath(path).parent, confine).sound()
    return SpecTemplate(text, file, tree.folder, tuple(overrides), tree.data, tuple(tree.included), confine)


def same_content(one: str, other: str) -> bool:
    """Return whether two texts of a spec agree but for comments and layout; `SpecError` if not YAML."""
    first, second = (read(text, "spec.yaml").data for text in (one, other))
    return fingerprint(first) == fingerprint(second)


def relocated(text: str, here: FilePath, there: FilePath) -> str:
    """Return the text of a spec moved from the folder `here` to `there`, with adapted names of files.

    Absolute names and names of files that do not exist stay.
    """
    names = {one for one in _texts(yaml.safe_load(text)) if os.path.isfile(here / one)}
    return renamed(text, moved_names(names, here, there)) if names else text


def moved_names(names: Iterable[str], here: FilePath, there: FilePath) -> dict[str, str]:
    """Return names relative to `there` by names relative to `here`; absolute names are left out."""
    own = [name for name in names if not FilePath(name).is_absolute()]
    return {name: FilePath(os.path.relpath(here / name, there)).as_posix() for name in own}


def renamed(text: str, names: Mapping[str, str]) -> str:
    """Return the text of a spec with new names of files; `names` maps old to new ones."""
    if not names:
        return text
    tree, lines = read(text, "spec.yaml"), text.splitlines(keepends=True)
    found = [(tree.places.at(path), name) for path, name in named_files(tree.data) if name in names]
    placed = [(place, name) for place, name in found if place is not None]
    for place, name in sorted(placed, key=lambda one: (one[0].line, -one[0].column)):
        line, at = lines[place.line - 1], place.column - 1
        lines[place.line - 1] = line[:at] + line[at:].replace(name, names[name], 1)
    return "".join(lines)


def _texts(data: Plain) -> Iterator[str]:
    """Yield every text among plain data."""
    if isinstance(data, str):
        yield data
    for value in data.values() if isinstance(data, dict) else data if isinstance(data, list) else ():
        yield from _texts(value)


# Largest relative difference between equal sample times, due to rounding in a text.
_SAME = 1e-6


def load_estimate(spec: Spec, name: str, key: str) -> Estimated:
    """Return the block `estimate` of a file that the spec names at `key`; errors show no other content.

    Raises `SpecError` if it cannot be read, has no sound block (`bad-model-file`), or has another sample time
    (`wrong-estimate`).
    """
    try:
        text = read_text(spec.resolve_path(name))
    except SpecError as error:
        found = error.diagnostics[0]
        hint = found.hint or "paths are relative to the folder of the spec"
        raise spec.complain(found.code, found.message, hint=hint, key=key) from error
    block, said = None, ""
    try:
        data = read(text, name).data
        block = data.get("estimate") if isinstance(data, dict) else None
        estimated = Estimated.model_validate(block)
    except (SpecError, ValidationError) as error:
        if isinstance(error, ValidationError):
            first = translate(error, block, Estimated)[0]
            said = f" ({first.code} at {format_key(['estimate', *first.path])})"
        message = f"{name} is no model that identify wrote: it has no sound block estimate{said}"
        hint = "name a model.yaml with estimate: {parameters: {..}, covariance: [[..]]}, positive definite"
        raise spec.complain("bad-model-file", message, hint=hint, key=key) from error
    step, unit = data.get("sample_time"), data.get("time_unit", spec.time_unit)
    # Older files have no sample time.
    if isinstance(step, int | float) and not (
        unit == spec.time_unit and isclose(step, spec.sample_time, rel_tol=_SAME)
    ):
        here = f"sample_time is {spec.sample_time:g} {spec.time_unit} here"
        message = f"{name} is an estimate from samples {step:g} {unit} apart, and {here}"
        hint = f"write sample_time: {step!r} and time_unit: {unit}, or take them by include: {name}"
        raise spec.complain("wrong-estimate", message, hint=hint, key=key)
    return estimated


def is_prior(parameters: Mapping[str, float], covariance: Sequence[Sequence[float]]) -> bool:
    """Return whether a later spec will accept an estimate: its covariance is clearly positive definite."""
    try:
        Estimated.model_validate({"parameters": parameters, "covariance": covariance})
    except ValidationError:
        return False
    return True
