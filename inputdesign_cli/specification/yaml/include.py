"""`include: model.yaml`: blocks that another file holds, such as the `plant` and `noise` of an estimate."""

from __future__ import annotations

from collections.abc import Collection
from pathlib import Path as FilePath

from inputdesign_cli.errors import SpecError
from inputdesign_cli.specification.yaml.files import is_outside, outside, read_text
from inputdesign_cli.specification.yaml.places import Path, format_key
from inputdesign_cli.specification.yaml.plain import Plain
from inputdesign_cli.specification.yaml.reader import Tree, read

KEY = "include"
# These describe one thing: what two files say of it cannot be put together.
_WHOLE = ("plant", "noise")
# What is estimated holds at its own sample time only: two files may say the same one.
_CLOCK = ("sample_time", "time_unit")


def apply_includes(tree: Tree, folder: FilePath, *, known: Collection[str], confine: FilePath | None) -> None:
    """Put the blocks of included files where the spec has none; other mappings are joined key by key.

    A key that stands in both becomes a diagnostic of the tree. Nothing is shown of a file that has none of
    the `known` blocks: it may be any file of the machine.

    Raises:
        SpecError: A name is no text, or a file cannot be read, holds no blocks or includes others.
    """
    if not isinstance(tree.data, dict) or KEY not in tree.data:
        return
    stated = tree.data.pop(KEY)
    names = stated if isinstance(stated, list) else [stated]
    for number, name in enumerate(names):
        path: Path = (KEY, number) if isinstance(stated, list) else (KEY,)
        if not isinstance(name, str) or not name:
            raise _error(tree, path, "{key} is not the name of a file", "write include: model.yaml")
        if confine is not None and is_outside(folder / name, confine):
            location = tree.places.location(tree.places.mark(path, at_key=True))
            raise SpecError(outside(name, confine, format_key(path), location))
        included = _read(tree, path, folder, name)
        if not isinstance(included.data, dict) or KEY in included.data:
            what = "includes others itself" if isinstance(included.data, dict) else "holds no blocks"
            raise _error(tree, path, f"{name} {what}", "name a file of blocks such as plant: and noise:")
        if not known & included.data.keys():
            raise _error(tree, path, f"{name} holds no block of a spec", "name a file with plant: and noise:")
        tree.included.append(name)
        tree.places.sources.append(included.places.sources[0])
        tree.diagnostics.extend(included.diagnostics)
        tree.broken |= included.broken
        for key, value in included.data.items():
            _join(tree, included, (key,), value)
    tree.places.forget((KEY,))


def _read(tree: Tree, path: Path, folder: FilePath, name: str) -> Tree:
    file = folder / name
    try:
        text = read_text(file)
    except SpecError as error:
        found = error.diagnostics[0]
        message = f"{name} is not UTF-8" if found.code == "file-encoding" else found.message
        raise _error(tree, path, message, found.hint) from error
    try:
        return read(text, str(file), source=len(tree.places.sources))
    except SpecError as error:
        if not is_outside(file, folder):
            raise
        place = error.diagnostics[0].location
        line = f", line {place.line}," if place else ""
        raise _error(tree, path, f"{name}{line} is not YAML of a spec", "name a file of blocks") from error


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
        mark = included.places.mark(path, at_key=True)
        where = tree.places.location(mark)
        place = f"{where.file}, line {where.line}" if where else "the included file"
        message = f"{{key}} stands here and in {place}"
        hint = "remove one of them: the spec and what it includes are put together"
        if key in _CLOCK:
            message = f"{{key}} is {holder[key]} here and {value} in {place}"
            hint = (
                f"remove {key} here: what a file includes holds at the sample time of its data; to sample "
                "otherwise, write plant and noise here"
            )
        tree.diagnostics.extend(_error(tree, path, message, hint).diagnostics)
        tree.broken.add(path)


def _error(tree: Tree, path: Path, message: str, hint: str) -> SpecError:
    key = format_key(path)
    location = tree.places.location(tree.places.mark(path, at_key=True))
    return SpecError.because("bad-include", message.replace("{key}", key), hint, key, location)
