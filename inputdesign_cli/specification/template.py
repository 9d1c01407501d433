"""A spec before validation, which a sweep varies many times without reading the file again."""

from __future__ import annotations

import copy
import hashlib
import os
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path as FilePath

from pydantic import ValidationError

from inputdesign_cli.errors import SpecError
from inputdesign_cli.regular_file import read_regular
from inputdesign_cli.specification.loading import parse_spec, read_tree
from inputdesign_cli.specification.models.pydantic_errors import translate
from inputdesign_cli.specification.models.spec import Spec
from inputdesign_cli.specification.models.sweep import Sweep
from inputdesign_cli.specification.schema import named_files
from inputdesign_cli.specification.yaml.files import is_outside, read_text
from inputdesign_cli.specification.yaml.overrides import apply_overrides
from inputdesign_cli.specification.yaml.places import Places
from inputdesign_cli.specification.yaml.plain import Plain, fingerprint
from inputdesign_cli.specification.yaml.reader import Tree, read


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
        """Return the checked spec of one variant, without the `sweep` block; errors as of `load_spec`."""
        every = [*self.overrides, *overrides, "sweep=null"]
        return parse_spec(self.text, self.file, every, folder=self.folder, confine=self.confine)

    def variant(self, overrides: Sequence[str]) -> dict[str, Plain]:
        """Return the plain data of one variant, without the `sweep` block; only overrides are checked."""
        tree = Tree(copy.deepcopy(self.data), Places())
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
    folder = FilePath(path).parent
    tree = read_tree(text, file, overrides, folder, confine).sound()
    return SpecTemplate(text, file, folder, tuple(overrides), tree.data, tuple(tree.included), confine)


def same_content(one: str, other: str) -> bool:
    """Return whether two texts of a spec agree but for comments and layout; `SpecError` if not YAML."""
    first, second = (read(text, "spec.yaml").data for text in (one, other))
    return fingerprint(first) == fingerprint(second)
