"""YAML text to a tree of nodes with their lines and columns, of bounded depth and size.

The text is read event by event and not by PyYAML's loader: its constructors know dates, tags and YAML 1.1
numbers, and it recurses.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass

import yaml

from inputdesign_cli.errors import Location, SpecError
from inputdesign_cli.specification.yaml.plain import Plain
from inputdesign_cli.specification.yaml.syntax import syntax_error

MAX_DEPTH = 64
MAX_NODES = 100_000

# The parser written in C is some ten times faster; both give the same events and marks.
_PARSER: Plain = getattr(yaml, "CSafeLoader", yaml.SafeLoader)
_FORBIDDEN = re.compile("[^\t\n\r\x20-\x7e\x85\xa0-\ud7ff\ue000-\ufffd\U00010000-\U0010ffff]")


@dataclass
class Node:
    """A scalar (`value` is its text), a list of nodes, a mapping (keys and values in turn), or an alias.

    Where it stands is counted from 1 in the text that the parser saw.
    """

    kind: str
    value: Plain
    line: int
    column: int
    plain: bool = False
    tag: str | None = None
    open: bool = False


@dataclass
class Document:
    """The text that is read: its name, its lines, what was put before its first line, and what it cost."""

    file: str
    lines: list[str]
    shift: int
    count: int = 0

    def location(self, line: int, column: int) -> Location:
        """The place of a node in the text as the user wrote it."""
        text = self.lines[line - 1] if 0 < line <= len(self.lines) else ""
        return Location(self.file, line, self.shifted(line, column), text)

    def shifted(self, line: int, column: int) -> int:
        """The column in the line as the user wrote it."""
        return column + (self.shift if line == 1 else 0)

    def error(self, code: str, message: str, line: int, column: int, hint: str) -> SpecError:
        """What stops the reading."""
        return SpecError.because(code, message, hint, location=self.location(line, column))

    def spend(self, line: int, column: int, depth: int) -> None:
        """Count one node.

        Raises:
            SpecError: `yaml-limit` for too many nodes, or too deep ones.
        """
        self.count += 1
        # Composing and expanding count alike; twice the limit bounds both, and large honest files pass.
        if self.count > 2 * MAX_NODES:
            hint = "move large tables into a CSV file; do not let aliases repeat aliases"
            raise self.error("yaml-limit", f"the spec holds more than {MAX_NODES} values", line, column, hint)
        if depth > MAX_DEPTH:
            message = f"lists and mappings are nested more than {MAX_DEPTH} deep"
            hint = "no key of a spec needs more than six levels; is a bracket left open?"
            raise self.error("yaml-limit", message, line, column, hint)


def compose(text: str, document: Document) -> Node | None:
    """The tree of nodes; None for a text without a document.

    Raises:
        SpecError: The text is not YAML, or is too deep or too large.
    """
    if bad := _FORBIDDEN.search(text):
        above = (text[: bad.start()] + "|").splitlines()
        message = f"the text holds a character that YAML does not allow (U+{ord(bad.group()):04X})"
        hint = "remove it; a spec is plain UTF-8 text"
        raise document.error("file-encoding", message, len(above), len(above[-1]), hint)
    try:
        return _compose(_events(text), document)
    except yaml.YAMLError as error:
        raise syntax_error(error, document.file, document.lines, document.shift) from None


def _events(text: str) -> Iterator[Plain]:
    parser = _PARSER(text)
    try:
        while parser.check_event():
            yield parser.get_event()
    finally:
        parser.dispose()


def _compose(events: Iterator[Plain], document: Document) -> Node | None:
    root: Node | None = None
    stack: list[Node] = []
    anchors: dict[str, Node] = {}
    documents = 0
    for event in events:
        line, column = event.start_mark.line + 1, event.start_mark.column + 1
        if isinstance(event, yaml.DocumentStartEvent):
            documents += 1
            if documents > 1:
                message = 'a second document begins here ("---")'
                hint = "a file holds one spec; put the other into a file of its own"
                raise document.error("several-documents", message, line, column, hint)
            continue
        if isinstance(event, yaml.CollectionEndEvent):
            stack.pop().open = False
            continue
        if isinstance(event, yaml.AliasEvent):
            node = Node("alias", _anchored(anchors, str(event.anchor), document, line, column), line, column)
        elif isinstance(event, yaml.ScalarEvent):
            node = Node("scalar", event.value, line, column, event.style in (None, ""), event.tag)
        elif isinstance(event, yaml.CollectionStartEvent):
            kind = "list" if isinstance(event, yaml.SequenceStartEvent) else "mapping"
            node = Node(kind, [], line, column, tag=event.tag, open=True)
        else:
            continue
        if event.anchor and node.kind != "alias":
            anchors[event.anchor] = node
        if stack:
            stack[-1].value.append(node)
        else:
            root = node
        if node.open:
            stack.append(node)
        document.spend(line, column, len(stack))
    return root


def _anchored(anchors: dict[str, Node], name: str, document: Document, line: int, column: int) -> Node:
    if name not in anchors:
        message = f"the alias *{name} refers to no anchor &{name} above it"
        hint = "write the value out; put a text that begins with * in quotes"
        raise document.error("yaml-syntax", message, line, column, hint)
    if anchors[name].open:
        message = f"the alias *{name} contains itself"
        raise document.error("yaml-limit", message, line, column, "write the value out")
    return anchors[name]
