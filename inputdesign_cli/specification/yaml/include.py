"""`include: model.yaml`: blocks that another file holds, such as the `plant` and `noise` of an estimate."""

from __future__ import annotations

from pathlib import Path as FilePath

from inputdesign_cli.errors import SpecError
from inputdesign_cli.specification.yaml.files import read_text
from inputdesign_cli.specification.yaml.places import Path, format_key
from inputdesign_cli.specification.yaml.plain import Plain
from inputdesign_cli.specification.yaml.reader import Tree, read

KEY = "include"
# These describe one thing: what two files say of it cannot be put together.
_WHOLE = ("plant", "noise")


def apply_includes(tree: Tree, folder: FilePath) -> None:
    """Put the blocks of included files where the spec has none; other mappings are joined key by key.

    A key that stands in both becomes a diagnostic of the tree.

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
        included = _read(tree, path, folder / name)
        if not isinstance(included.data, dict) or KEY in included.data:
            what = "includes others itself" if isinstance(included.data, dict) else "holds no blocks"
            raise _error(tree, path, f"{name} {what}", "name a file of blocks such as plant: and noise:")
        tree.places.sources.append(included.places.sources[0])
        tree.diagnostics.extend(included.diagnostics)
        tree.broken |= included.broken
        for key, value in included.data.items():
            _join(tree, included, (key,), value)
    tree.places.forget((KEY,))


def _read(tree: Tree, path: Path, file: FilePath) -> Tree:
    try:
        text = read_text(file)
    except SpecError as error:
        found = error.diagnostics[0]
        raise _error(tree, path, found.message, found.hint) from error
    return read(text, str(file), source=len(tree.places.sources))


def _join(tree: Tree, included: Tree, path: Path, value: Plain) -> None:
    holder = tree.data if len(path) == 1 else tree.data[path[0]]
    key = path[-1]
    if key not in holder:
        holder[key] = value
        tree.places.adopt(included.places, path)
    elif len(path) == 1 and key not in _WHOLE and isinstance(holder[key], dict) and isinstance(value, dict):
        for inner, item in value.items():
            _join(tree, included, (*path, inner), item)
    else:
        mark = included.places.mark(path, at_key=True)
        where = tree.places.location(mark)
        place = f"{where.file}, line {where.line}" if where else "the included file"
        hint = "remove one of them: the spec and what it includes are put together"
        tree.diagnostics.extend(_error(tree, path, f"{{key}} stands here and in {place}", hint).diagnostics)
        tree.broken.add(path)


def _error(tree: Tree, path: Path, message: str, hint: str) -> SpecError:
    key = format_key(path)
    location = tree.places.location(tree.places.mark(path, at_key=True))
    return SpecError.because("bad-include", message.replace("{key}", key), hint, key, location)
