"""Additions to a spec: files by `include: model.yaml`, then values by `--set key.path=value`."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from pathlib import Path as FilePath

from inputdesign_cli.errors import Location, SpecError
from inputdesign_cli.specification.yaml.files import is_outside, outside, read_text
from inputdesign_cli.specification.yaml.places import Path, Places, format_key, parse_key
from inputdesign_cli.specification.yaml.plain import Plain
from inputdesign_cli.specification.yaml.reader import MAX_DEPTH, Tree, read

KEY = "include"
# The parts of these blocks belong together and cannot be joined from two files.
_WHOLE = ("plant", "noise")
# An estimate holds at its own sample time only. Two files may both state these keys if they agree.
_CLOCK = ("sample_time", "time_unit")


def apply_includes(tree: Tree, known: Collection[str], confine: FilePath | None) -> None:
    """Add the blocks of included files that the spec does not have; join other mappings key by key.

    A key that stands in both becomes a diagnostic of the tree. Errors show no content of a file without any
    of the `known` blocks: it may be any file of the machine. Raises `SpecError`: A name is no text, or a
    file cannot be read, holds no blocks or includes others.
    """
    if not isinstance(tree.data, dict) or KEY not in tree.data:
        return
    stated = tree.data.pop(KEY)
    for number, name in enumerate(stated if isinstance(stated, list) else [stated]):
        path: Path = (KEY, number) if isinstance(stated, list) else (KEY,)
        if not isinstance(name, str) or not name:
            raise _refused(tree, path, "{key} is not the name of a file", "write include: model.yaml")
        if confine is not None and is_outside(tree.folder / name, confine):
            location = tree.places.at(path, at_key=True)
            raise SpecError(outside(name, confine, format_key(path), location))
        included = _read(tree, path, name)
        found = included.data if isinstance(included.data, dict) else {}
        if KEY in found or not known & found.keys():
            what = "includes others itself" if KEY in found else "holds no blocks of a spec"
            raise _refused(tree, path, f"{name} {what}", "name a file with plant: and noise:")
        tree.included.append(name)
        tree.places.files += included.places.files
        tree.diagnostics.extend(included.diagnostics)
        tree.broken |= included.broken
        for key, value in found.items():
            _join(tree, included, (key,), value)
    tree.places.forget((KEY,))


def _read(tree: Tree, path: Path, name: str) -> Tree:
    file = tree.folder / name
    try:
        return read(read_text(file), str(file))
    except SpecError as error:
        found = error.diagnostics[0]
        if found.code.startswith("file-") and found.code != "file-encoding":
            raise _refused(tree, path, found.message, found.hint) from error
        if found.code == "file-encoding" or is_outside(file, tree.folder):
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
        where = included.places.at(path, at_key=True)
        place = f"{where.file}, line {where.line}" if where else "the included file"
        message = f"{{key}} stands here and in {place}"
        hint = "remove one of them: the spec and what it includes are put together"
        if key in _CLOCK:
            message = f"{{key}} is {holder[key]} here and {value} in {place}"
            hint = f"remove {key} here, or write plant and noise here to sample them otherwise"
        tree.diagnostics.extend(_refused(tree, path, message, hint).diagnostics)
        tree.broken.add(path)


def _refused(tree: Tree, path: Path, message: str, hint: str) -> SpecError:
    key, location = format_key(path), tree.places.at(path, at_key=True)
    return SpecError.because("bad-include", message.replace("{key}", key), hint, key, location)


def apply_overrides(tree: Tree, overrides: Sequence[str]) -> None:
    """Apply each `key.path=value` to the tree, in order; `null` as the value removes the key.

    A wrong override becomes a diagnostic of the tree. Missing mappings are created.
    """
    for override in overrides:
        key, equals, text = override.partition("=")
        try:
            where = _resolve(tree.data, key if equals else "", override)
            if not text.strip():
                hint = f"write {key.strip()}=VALUE, or {key.strip()}=null to remove the key"
                raise _error(override, f"no value is given for {key.strip()}", hint, len(key) + 2)
            value = read(text, f"--set {override}", before=key + equals, at=where)
        except SpecError as error:
            tree.diagnostics.extend(error.diagnostics)
            continue
        _put(tree, where, value)
        tree.diagnostics.extend(value.diagnostics)
        tree.broken = {p for p in tree.broken if p[: len(where)] != where} | value.broken


def replace_values(tree: Tree, changes: Mapping[str, Plain], file: str) -> None:
    """Put plain values at dotted keys of the tree, in place; diagnostics name `file`. None removes a key.

    Raises `SpecError` (`bad-override`): a key leads nowhere.
    """
    for key, value in changes.items():
        _put(tree, _resolve(tree.data, key, f"{key}=.."), Tree(value, Places([file])))


def _error(override: str, message: str, hint: str, column: int = 1) -> SpecError:
    """Return the error of an override, at a column of its text."""
    location = Location(f"--set {override}", 1, column, override.partition("\n")[0])
    return SpecError.because("bad-override", message, hint, location=location)


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


def _put(tree: Tree, path: Path, value: Tree) -> None:
    """Put the data of `value` at a path; new keys are located at the beginning of its text."""
    places, (file, *_) = tree.places, value.places.files
    root = value.places.values.get(path)
    place = Location(file, 1, 1, root.text if root else "")
    places.files.append(file)
    node: Plain = tree.data if isinstance(tree.data, dict) else {}
    tree.data = node
    for depth, step in enumerate(path[:-1], start=1):
        child = node.get(step) if isinstance(node, dict) else node[step]
        if child is None:
            child = node[step] = {}
            places.keys[path[:depth]] = places.values[path[:depth]] = place
        node = child
    places.forget(path)
    if value.data is None and isinstance(node, dict):
        node.pop(path[-1], None)
        return
    node[path[-1]] = value.data
    places.keys[path] = places.values[path] = place
    places.adopt(value.places, path)
