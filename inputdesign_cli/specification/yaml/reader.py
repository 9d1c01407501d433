"""YAML text to plain data and the place of every key and value.

The text is read event by event and not by PyYAML's loader: its constructors know dates, tags and YAML 1.1
numbers, and it recurses. Here nesting and size are bounded, aliases are expanded under the same bounds,
and duplicate keys, tags and merge keys are refused.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import Any

import yaml

from inputdesign_cli.errors import Diagnostic, Location, SpecError
from inputdesign_cli.specification.yaml.places import Mark, Path, Places, format_key
from inputdesign_cli.specification.yaml.scalars import clip, resolve
from inputdesign_cli.specification.yaml.syntax import syntax_error

MAX_DEPTH = 64
MAX_NODES = 100_000

# The parser written in C is some ten times faster; both give the same events and marks.
_PARSER: Any = getattr(yaml, "CSafeLoader", yaml.SafeLoader)
_FORBIDDEN = re.compile("[^\t\n\r\x20-\x7e\x85\xa0-\ud7ff\ue000-\ufffd\U00010000-\U0010ffff]")
_FORBIDDEN_IN_TEXT = re.compile("[\x00-\x08\x0b-\x1f\x7f\ud800-\udfff\ufffe\uffff]")
_PLAIN_TAGS = (None, "!")


@dataclass
class Tree:
    """What a text holds: nested dicts, lists and scalars, their places, and what was wrong on the way.

    `diagnostics` are those that did not stop the reading; `broken` are the paths where something is lost.
    """

    data: Any
    places: Places
    diagnostics: list[Diagnostic] = field(default_factory=list)
    broken: set[Path] = field(default_factory=set)


@dataclass
class _Node:
    """A scalar (`value` is the text), a sequence (list of nodes) or a mapping (list of pairs)."""

    kind: str
    value: Any
    line: int
    column: int
    plain: bool = False
    tag: str | None = None
    open: bool = False


def read(text: str, file: str, *, source: int = 0, before: str = "", at: Path = ()) -> Tree:
    """Read one YAML document.

    Parameters
    ----------
    text, file : the text, and the name it goes by in diagnostics.
    source : the number its marks carry (see `Places`).
    before : what stands before the text on its first line (an override's value stands behind `key=`).
    at : the path of the text's root, if it is a part of a larger tree.

    Raises
    ------
    SpecError : the text is not YAML, or is too deep or too large.
    """
    lines = (before + text).splitlines()
    shift = len(before)
    reader = _Reader(file, lines, source, shift)
    if bad := _FORBIDDEN.search(text):
        above = (text[: bad.start()] + "|").splitlines()
        line, column = len(above), len(above[-1])
        raise reader.stop(
            "file-encoding",
            f"the text holds a character that YAML does not allow (U+{ord(bad.group()):04X})",
            line,
            column,
            "remove it; a spec is plain UTF-8 text",
        )
    try:
        root = reader.compose(_events(text))
    except yaml.YAMLError as error:
        raise syntax_error(error, file, lines, shift) from None
    tree = Tree(None, Places(sources=[(file, lines)]))
    if root is not None:
        tree.data = reader.expand(root, at, None, tree)
    return tree


def _events(text: str) -> Iterator[Any]:
    parser = _PARSER(text)
    try:
        while parser.check_event():
            yield parser.get_event()
    finally:
        parser.dispose()


class _Reader:
    def __init__(self, file: str, lines: list[str], source: int, shift: int) -> None:
        self.file, self.lines, self.source, self.shift = file, lines, source, shift
        self.count = 0

    def compose(self, events: Iterator[Any]) -> _Node | None:
        """The tree of nodes, built with an explicit stack; None for a text without a document."""
        root: _Node | None = None
        stack: list[_Node] = []
        anchors: dict[str, _Node] = {}
        documents = 0
        for event in events:
            line, column = event.start_mark.line + 1, event.start_mark.column + 1
            if isinstance(event, yaml.DocumentStartEvent):
                documents += 1
                if documents > 1:
                    raise self.stop(
                        "several-documents",
                        'a second document begins here ("---")',
                        line,
                        column,
                        "a file holds one spec; put the other into a file of its own",
                    )
                continue
            if isinstance(event, yaml.AliasEvent):
                node = self._alias(anchors, str(event.anchor), line, column)
            elif isinstance(event, yaml.ScalarEvent):
                plain = event.style in (None, "")
                node = _Node("scalar", event.value, line, column, plain, event.tag)
            elif isinstance(event, yaml.SequenceStartEvent | yaml.MappingStartEvent):
                kind = "list" if isinstance(event, yaml.SequenceStartEvent) else "mapping"
                node = _Node(kind, [], line, column, tag=event.tag, open=True)
            elif isinstance(event, yaml.SequenceEndEvent | yaml.MappingEndEvent):
                stack.pop().open = False
                continue
            else:
                continue
            self._count(line, column)
            if getattr(event, "anchor", None) and not isinstance(event, yaml.AliasEvent):
                anchors[event.anchor] = node
            if stack:
                stack[-1].value.append(node)
            else:
                root = node
            if node.open:
                stack.append(node)
                if len(stack) > MAX_DEPTH:
                    raise self.too_deep(line, column)
        return root

    def _alias(self, anchors: dict[str, _Node], name: str, line: int, column: int) -> _Node:
        if name not in anchors:
            raise self.stop(
                "yaml-syntax",
                f"the alias *{name} refers to no anchor &{name} above it",
                line,
                column,
                "write the value out; put a text that begins with * in quotes",
            )
        target = anchors[name]
        if target.open:
            raise self.stop(
                "yaml-limit", f"the alias *{name} contains itself", line, column, "write the value out"
            )
        return _Node("alias", target, line, column)

    def expand(self, node: _Node, path: Path, key_mark: Mark | None, tree: Tree) -> Any:
        """The plain data of a node; marks and diagnostics go into `tree`. Depth is bounded by `compose`
        for what is written and here for what aliases add."""
        mark = self._mark(node)
        if node.kind == "alias":
            node = node.value
        self._count(node.line, node.column)
        if len(path) > MAX_DEPTH:
            raise self.too_deep(node.line, node.column)
        tree.places.values[path] = key_mark if node.kind == "mapping" and key_mark else mark
        if node.tag not in _PLAIN_TAGS:
            self._complain(
                tree,
                "yaml-tag",
                f"{format_key(path) or 'the spec'} carries the tag {clip(str(node.tag))}",
                "remove the tag: a spec holds plain numbers, texts, lists and mappings",
                path,
                mark,
            )
        if node.kind == "scalar":
            return self._scalar(node, path, mark, tree)
        if node.kind == "list":
            return [self.expand(item, (*path, i), None, tree) for i, item in enumerate(node.value)]
        return self._mapping(node, path, tree)

    def _scalar(self, node: _Node, path: Path, mark: Mark, tree: Tree) -> Any:
        if not node.plain and (bad := _FORBIDDEN_IN_TEXT.search(node.value)):
            self._complain(
                tree,
                "bad-text",
                f"{format_key(path) or 'the spec'} holds the unprintable character U+{ord(bad.group()):04X}",
                "remove the escape that makes it",
                path,
                mark,
            )
            tree.broken.add(path)
            return ""
        return resolve(node.value) if node.plain else node.value

    def _mapping(self, node: _Node, path: Path, tree: Tree) -> dict[str, Any]:
        data: dict[str, Any] = {}
        first: dict[str, _Node] = {}
        for key, value in zip(node.value[::2], node.value[1::2], strict=True):
            mark = self._mark(key)
            written = key.value if key.kind == "alias" else key
            if written.kind != "scalar" or _FORBIDDEN_IN_TEXT.search(written.value):
                self._complain(
                    tree,
                    "bad-key",
                    f"a key of {format_key(path) or 'the spec'} is not a word",
                    'keys are plain words; a list or mapping goes behind a colon ("key: value")',
                    path,
                    mark,
                )
                tree.broken.add(path)
                continue
            name = written.value
            here = (*path, name)
            if name == "<<" and key.plain:
                self._complain(
                    tree,
                    "yaml-merge-key",
                    'the merge key "<<" is not supported',
                    "write the keys out; an anchor (&name) and alias (*name) may stand for a whole value",
                    here,
                    mark,
                )
                tree.broken.add(path)
                continue
            if name in first:
                lines = sorted({first[name].line, key.line})
                where = " and on line ".join(str(line) for line in lines)
                self._complain(
                    tree,
                    "duplicate-key",
                    f"{format_key(here)} is given twice, on line {where}",
                    "keep one of the two",
                    here,
                    mark,
                )
                continue
            first[name] = key
            tree.places.keys[here] = mark
            data[name] = self.expand(value, here, mark, tree)
        return data

    def _mark(self, node: _Node) -> Mark:
        return Mark(self.source, node.line, node.column + (self.shift if node.line == 1 else 0))

    def _count(self, line: int, column: int) -> None:
        # Composing and expanding count alike; twice the limit bounds both, and large honest files pass.
        self.count += 1
        if self.count > 2 * MAX_NODES:
            raise self.stop(
                "yaml-limit",
                f"the spec holds more than {MAX_NODES} values",
                line,
                column,
                "move large tables into a CSV file; do not let aliases repeat aliases",
            )

    def too_deep(self, line: int, column: int) -> SpecError:
        return self.stop(
            "yaml-limit",
            f"lists and mappings are nested more than {MAX_DEPTH} deep",
            line,
            column,
            "no key of a spec needs more than six levels; is a bracket left open?",
        )

    def stop(self, code: str, message: str, line: int, column: int, hint: str) -> SpecError:
        text = self.lines[line - 1] if 0 < line <= len(self.lines) else ""
        shifted = column + (self.shift if line == 1 else 0)
        place = Location(self.file, line, shifted, text)
        return SpecError(Diagnostic(code, message, hint, location=place))

    def _complain(self, tree: Tree, code: str, message: str, hint: str, path: Path, mark: Mark) -> None:
        # The value is read all the same: what else is wrong with it is worth saying.
        text = self.lines[mark.line - 1] if mark.line <= len(self.lines) else ""
        place = Location(self.file, mark.line, mark.column, text)
        tree.diagnostics.append(Diagnostic(code, message, hint, format_key(path), place))
