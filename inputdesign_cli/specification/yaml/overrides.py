"""What is joined to a spec: files by `include: model.yaml`, then values by `--set key.path=value`."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from pathlib import Path as FilePath

from inputdesign_cli.errors import Location, SpecError
from inputdesign_cli.specification.yaml.files import is_outside, outside, read_text
from inputdesign_cli.specification.yaml.places import Mark, Path, Places, format_key, parse_key
from inputdesign_cli.specification.yaml.plain import Plain
from inputdesign_cli.specification.yaml.reader import MAX_DEPTH, Tree, read

KEY = "include"
# The parts of these blocks belong together and cannot be joined from two files.
_WHOLE = ("plant", "noise")
# An estimate holds at its own sample time only: two files may state the same one.
_CLOCK = ("sample_time", "time_unit")


def apply_includes(tree: Tree, folder: FilePath, *, known: Collection[str], confine: FilePath | None) -> None:
    """Add the blocks of included files that the spec does not have; join other mappings key by key.

    A key that stands in both becomes a diagnostic of the tree. Nothing is shown of a file that has none of
    the `known` blocks: it may be any file of the machine. Raises `SpecError`: A name is no text, or a file
    cannot be read, holds no blocks or includes others.
    """
    if not isinstance(tree.data, dict) or KEY not in tree.data:
        return
    stated = tree.data.pop(KEY)
    names = stated if isinstance(stated, list) else [stated]
    for number, name in enumerate(names):
        path: Path = (KEY, number) if isinstance(stated, list) else (KEY,)
        if not isinstance(name, str) or not name:
            raise _refused(tree, path, "{key} is not the name of a file", "write include: model.yaml")
        if confine is not None and is_outside(folder / name, confine):
            location = tree.places.location(tree.places.mark(path, at_key=True))
            raise SpecError(outside(name, confine, format_key(path), location))
        included = _read(tree, path, folder, name)
        found = included.data if isinstance(included.data, dict) else {}
        if KEY in found or not known & found.keys():
            what = "includes others itself" if KEY in found else "holds no blocks of a spec"
            raise _refused(tree, path, f"{name} {what}", "name a file with plant: and noise:")
        tree.included.append(name)
        tree.places.sources.append(included.places.sources[0])
        tree.diagnostics.extend(included.diagnostics)
        tree.broken |= included.broken
        for key, value in found.items():
            _join(tree, included, (key,), value)
    tree.places.forget((KEY,))


def _read(tree: Tree, path: Path, folder: FilePath, name: str) -> Tree:
    file = folder / name
    try:
        return read(read_text(file), str(file), source=len(tree.places.sources))
    except SpecError as error:
        found = error.diagnostics[0]
        if found.code.startswith("file-") and found.code != "file-encoding":
            raise _refused(tree, path, found.message, found.hint) from error
        if found.code == "file-encoding" or is_outside(file, folder):
            line = f", line {found.location.line}," if found.location else ""
            what = f"{name}{line} is not YAML of a spec"
            raise _refused(tree, path, what, "name a file of blocks") from error
        raise


def _join(tree: Tree, included: Tree, path: Path, value: Plain) -> None:
    holder = tree.data if len(path) == 1 else tree.data[path[0]]
    key = path[-1]
    if key not in holder:
        holder[key] = value
        tree.places.adopt(included.places, path)
    elif len(path) == 1 and key not in _WHOLE and isinstance(holder[key], dict) and isinstance(value, dict):
        for inner, item in value.items():
            _join(tree, included, (*path, inner), item)
    elif not (key in _CLOCK and holder[key] == value):
        where = tree.places.location(included.places.mark(path, at_key=True))
        place = f"{where.file}, line {where.line}" if where else "the included file"
        message = f"{{key}} stands here and in {place}"
        hint = "remove one of them: the spec and what it includes are put together"
        if key in _CLOCK:
            message = f"{{key}} is {holder[key]} here and {value} in {place}"
            hint = f"remove {key} here, or write plant and noise here to sample them otherwise"
        tree.diagnostics.extend(_refused(tree, path, message, hint).diagnostics)
        tree.broken.add(path)


def _refused(tree: Tree, path: Path, message: str, hint: str) -> SpecError:
    key = format_key(path)
    location = tree.places.location(tree.places.mark(path, at_key=True))
    return SpecError.because("bad-include", message.replace("{key}", key), hint, key, location)


def apply_overrides(tree: Tree, overrides: Sequence[str]) -> None:
    """Apply each `key.path=value` to the tree, in order; `null` as the value removes the key.

    A wrong override becomes a diagnostic of the tree. Missing mappings are created.
    """
    for override in overrides:
        try:
            _apply(tree, override)
        except SpecError as error:
            tree.diagnostics.extend(error.diagnostics)


def _error(override: str, message: str, hint: str, column: int = 1) -> SpecError:
    """Return the error of an override, at a column of its text."""
    location = Location(f"--set {override}", 1, column, override.partition("\n")[0])
    return SpecError.because("bad-override", message, hint, location=location)


def replace_values(tree: Tree, changes: Mapping[str, Plain], file: str) -> None:
    """Put plain values at dotted keys of the tree, in place, as of a `file`; None removes a key.

    Raises `SpecError` (`bad-override`): a key leads nowhere.
    """
    mark = Mark(len(tree.places.sources), 1, 1)
    tree.places.sources.append((file, []))
    for key, value in changes.items():
        _put(tree, _resolve(tree.data, key, f"{key}=.."), Tree(value, Places()), mark)


def _apply(tree: Tree, override: str) -> None:
    key, equals, text = override.partition("=")
    name = key.strip()
    where = _resolve(tree.data, key if equals else "", override)
    if not text.strip():
        hint = f"write {name}=VALUE, or {name}=null to remove the key"
        raise _error(override, f"no value is given for {name}", hint, len(key) + 2)
    number = len(tree.places.sources)
    value = read(text, f"--set {override}", source=number, before=key + equals, at=where)
    tree.places.sources.append(value.places.sources[0])
    _put(tree, where, value, Mark(number, 1, 1))
    tree.diagnostics.extend(value.diagnostics)
    tree.broken = {p for p in tree.broken if p[: len(where)] != where} | value.broken


def _resolve(data: Plain, key: str, override: str) -> Path:
    """Return the path of a dotted key, with indices in lists; `SpecError` (`bad-override`)."""
    path = tuple(step.strip() if isinstance(step, str) else step for step in parse_key(key.strip()))
    if not path or "" in path or not key.isprintable():
        message = f"{override!r} is not of the form key.path=value"
        raise _error(override, message, "write --set noise.variance=0.5")
    if len(path) > MAX_DEPTH:
        raise _error(override, "the key has too many steps", "no key has more than six")
    found: list[str | int] = []
    for step in path:
        above = format_key(found)
        if isinstance(data, list):
            index = int(step) if str(step).isascii() and str(step).isdecimal() else len(data)
            if index >= len(data):
                message = f"{above} is a list of {len(data)}, counted from 0; there is no entry {step}"
                raise _error(override, message, f"give the whole list: --set {above}=[..]")
            found.append(index)
            data = data[index]
        elif data is None or isinstance(data, dict):
            found.append(str(step))
            data = data.get(str(step)) if data else None
        else:
            message = f"{above} is a single value, so it has no part {step}"
            raise _error(override, message, f"give the whole value: --set {above}=..")
    return tuple(found)


def _put(tree: Tree, path: Path, value: Tree, mark: Mark) -> None:
    if not isinstance(tree.data, dict):
        tree.data = {}
    places = tree.places
    node: Plain = tree.data
    for depth, step in enumerate(path[:-1], start=1):
        child = node.get(step) if isinstance(node, dict) else node[step]
        if child is None:
            child = node[step] = {}
            places.keys[path[:depth]] = places.values[path[:depth]] = mark
        node = child
    places.forget(path)
    if value.data is None and isinstance(node, dict):
        node.pop(path[-1], None)
        return
    node[path[-1]] = value.data
    places.keys[path] = places.values[path] = mark
    places.adopt(value.places, path)
