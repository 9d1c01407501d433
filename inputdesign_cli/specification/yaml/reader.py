"""YAML text to plain data and the place of every key and value.

Aliases are expanded under the bounds of `nodes`; duplicate keys, tags and merge keys are refused.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace

from inputdesign_cli.errors import Diagnostic
from inputdesign_cli.specification.yaml.nodes import Document, Node, compose
from inputdesign_cli.specification.yaml.places import Mark, Path, Places, format_key
from inputdesign_cli.specification.yaml.plain import FORBIDDEN_IN_TEXT, Plain
from inputdesign_cli.specification.yaml.scalars import clip, resolve

_PLAIN_TAGS = (None, "!")


@dataclass
class Tree:
    """What a text holds: nested dicts, lists and scalars, their places, and what was wrong on the way.

    `diagnostics` are those that did not stop the reading; `broken` are the paths where something is lost;
    `included` are the files whose blocks it has, as it names them.
    """

    data: Plain
    places: Places
    diagnostics: list[Diagnostic] = field(default_factory=list)
    broken: set[Path] = field(default_factory=set)
    included: list[str] = field(default_factory=list)


def read(text: str, file: str, *, source: int = 0, before: str = "", at: Path = ()) -> Tree:
    """Read one YAML document.

    Args:
        text: YAML.
        file: The name that the text goes by in diagnostics.
        source: The number that its marks carry (see `Places`).
        before: What stands before the text on its first line (an override's value stands behind `key=`).
        at: The path of the text's root, if it is a part of a larger tree.

    Returns:
        The tree; what is wrong with single keys stands in its diagnostics.

    Raises:
        SpecError: The text is not YAML, or is too deep or too large.
    """
    lines = (before + text).splitlines()
    document = Document(file, lines, len(before))
    root = compose(text, document)
    tree = Tree(None, Places(sources=[(file, lines)]))
    if root is not None:
        tree.data = _Expansion(document, source, tree).expand(root, at, None)
    return tree


@dataclass
class _Expansion:
    """Nodes to plain data; marks and diagnostics go into the tree."""

    document: Document
    source: int
    tree: Tree

    def expand(self, node: Node, path: Path, key: Mark | None) -> Plain:
        """The plain data of the node at `path`; `key` marks the key in front of it, if there is one."""
        mark = self._mark(node)
        if node.kind == "alias":
            node = node.value
        self.document.spend(node.line, node.column, len(path))
        self.tree.places.values[path] = key if node.kind == "mapping" and key else mark
        if node.tag not in _PLAIN_TAGS:
            message = f"{format_key(path) or 'the spec'} carries the tag {clip(str(node.tag))}"
            hint = "remove the tag: a spec holds plain numbers, texts, lists and mappings"
            self._complain("yaml-tag", message, hint, path, mark)
        if node.kind == "scalar":
            return self._scalar(node, path, mark)
        if node.kind == "list":
            return [self.expand(item, (*path, i), None) for i, item in enumerate(node.value)]
        return self._mapping(node, path)

    def _scalar(self, node: Node, path: Path, mark: Mark) -> Plain:
        if node.plain:
            return resolve(node.value)
        if bad := FORBIDDEN_IN_TEXT.search(node.value):
            what = f"the unprintable character U+{ord(bad.group()):04X}"
            message = f"{format_key(path) or 'the spec'} holds {what}"
            self._complain("bad-text", message, "remove the escape that makes it", path, mark, lost=path)
            return ""
        return node.value

    def _mapping(self, node: Node, path: Path) -> dict[str, Plain]:
        data: dict[str, Plain] = {}
        first: dict[str, int] = {}
        for key, value in zip(node.value[::2], node.value[1::2], strict=True):
            mark = self._mark(key)
            written = key.value if key.kind == "alias" else key
            if written.kind != "scalar" or FORBIDDEN_IN_TEXT.search(written.value):
                message = f"a key of {format_key(path) or 'the spec'} is not a word"
                hint = 'keys are plain words; a list or mapping goes behind a colon ("key: value")'
                self._complain("bad-key", message, hint, path, mark, lost=path)
                continue
            name = written.value
            here = (*path, name)
            if name == "<<" and key.plain:
                message = 'the merge key "<<" is not supported'
                hint = "write the keys out; an anchor (&name) and alias (*name) may stand for a whole value"
                self._complain("yaml-merge-key", message, hint, here, mark, lost=path)
            elif name in first:
                where = " and on line ".join(str(line) for line in sorted({first[name], key.line}))
                message = f"{format_key(here)} is given twice, on line {where}"
                self._complain("duplicate-key", message, "keep one of the two", here, mark)
            else:
                first[name] = key.line
                self.tree.places.keys[here] = mark
                data[name] = self.expand(value, here, mark)
        return data

    def _mark(self, node: Node) -> Mark:
        return Mark(self.source, node.line, self.document.shifted(node.line, node.column))

    def _complain(
        self, code: str, message: str, hint: str, path: Path, mark: Mark, lost: Path | None = None
    ) -> None:
        # The value is read all the same: what else is wrong with it is worth saying.
        place = replace(self.document.location(mark.line, 1), column=mark.column)
        self.tree.diagnostics.append(Diagnostic(code, message, hint, format_key(path), place))
        if lost is not None:
            self.tree.broken.add(lost)
