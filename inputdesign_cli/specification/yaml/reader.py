"""YAML text to plain data and the place of every key and value, of bounded depth and size.

The text is read event by event and not by PyYAML's loader: its constructors know dates, tags and YAML 1.1
numbers, and it recurses. Aliases are expanded; duplicate keys, tags and merge keys are refused.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass, field

import yaml

from inputdesign_cli.errors import Diagnostic, Location, SpecError
from inputdesign_cli.specification.yaml.places import Mark, Path, Places, format_key
from inputdesign_cli.specification.yaml.plain import FORBIDDEN_IN_TEXT, Plain
from inputdesign_cli.specification.yaml.scalars import clip, resolve

MAX_DEPTH = 64
MAX_NODES = 100_000

# The parser written in C is some ten times faster; both give the same events and marks.
_PARSER: Plain = getattr(yaml, "CSafeLoader", yaml.SafeLoader)
_FORBIDDEN = re.compile("[^\t\n\r\x20-\x7e\x85\xa0-\ud7ff\ue000-\ufffd\U00010000-\U0010ffff]")
_PLAIN_TAGS = (None, "!")
# A pattern of PyYAML's message (its C and Python parsers word it differently), its meaning, and a remedy.
_MEANINGS = (
    ("',' or ']'", "a list is not closed, or a comma is missing", 'close it with "]"'),
    ("',' or '}'", "a mapping is not closed, or a comma is missing", 'close it with "}"'),
    (
        "mapping values are not allowed",
        "a colon stands where no key can begin",
        "start the key on its own line, at the indentation of its neighbours; put a text that contains "
        '": " in quotes',
    ),
    ("could not (find|found) expected ':'", "a key is not followed by a colon", 'write "key: value"'),
    (
        "did not find expected key|expected <block end>|did not find expected '-' indicator",
        "this line does not fit the indentation of the lines above",
        "keys of one mapping begin in the same column; so do the dashes of one list",
    ),
    ("unexpected end of stream", "a quotation mark is not closed", "close it on the same line"),
    ("undefined alias", "this alias (*name) refers to no anchor (&name) above it", "write the value out"),
    (
        "undefined tag handle",
        "tags (!name) are not used in a spec",
        'remove the tag; put a text that begins with "!" in quotes',
    ),
    (
        "unknown escape character",
        "this backslash is not a known escape",
        "use single quotes, or double the \\",
    ),
    (
        "expected the node content|did not find expected node content",
        "a value is missing or begins with a character that YAML reserves",
        "write a value; put a text that begins with a special character in quotes",
    ),
    (
        "expected <document start>",
        "the text goes on after the end of the spec",
        "a spec is one mapping of keys; check the indentation of this line",
    ),
)

Event = tuple[Plain, Mark]
"""An event of the parser (PyYAML has no types) and where it stands."""


@dataclass
class Tree:
    """The nested dicts, lists and scalars of a text, their places, and what was wrong on the way.

    `diagnostics` did not stop the reading; `broken` are the paths where something is lost; `included` are the
    files whose blocks it has, as it names them.
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
    tree = Tree(None, Places(sources=[(file, lines)]))
    document = Document(file, lines, len(before), source, tree)
    if bad := _FORBIDDEN.search(text):
        above = (text[: bad.start()] + "|").splitlines()
        message = f"the text holds a character that YAML does not allow (U+{ord(bad.group()):04X})"
        mark = document.mark(len(above), len(above[-1]))
        raise document.error("file-encoding", message, mark, "remove it; a spec is plain UTF-8 text")
    try:
        tree.data = document.read(text, at)
    except yaml.YAMLError as error:
        raise syntax_error(error, file, lines, len(before)) from None
    return tree


@dataclass
class Document:
    """Turns the events of a text into plain data; marks and diagnostics go into the tree."""

    file: str
    lines: list[str]
    shift: int
    source: int
    tree: Tree
    count: int = 0
    events: Iterator[Event] = field(default_factory=lambda: iter(()))

    def read(self, text: str, at: Path) -> Plain:
        """Return the plain data of the text; None for a text without a document."""
        parser = _PARSER(text)
        try:
            self.events = self._expanded(parser)
            first = next(self.events, None)
            data = None if first is None else self._value(*first, at, None)
            next(self.events, None)  # errors behind the value are errors, too
        finally:
            parser.dispose()
        return data

    def mark(self, line: int, column: int) -> Mark:
        """The place in the text as the user wrote it; both count from 1."""
        return Mark(self.source, line, column + (self.shift if line == 1 else 0))

    def error(self, code: str, message: str, mark: Mark, hint: str) -> SpecError:
        """Return the error that stops the reading."""
        return SpecError.because(code, message, hint, location=self._location(mark))

    def spend(self, mark: Mark) -> None:
        """Count one value.

        Raises:
            SpecError: `yaml-limit` for too many.
        """
        self.count += 1
        if self.count > MAX_NODES:
            hint = "move large tables into a CSV file; do not let aliases repeat aliases"
            raise self.error("yaml-limit", f"the spec holds more than {MAX_NODES} values", mark, hint)

    def _check_depth(self, depth: int, mark: Mark) -> None:
        if depth > MAX_DEPTH:
            message = f"lists and mappings are nested more than {MAX_DEPTH} deep"
            hint = "no key of a spec needs more than six levels; is a bracket left open?"
            raise self.error("yaml-limit", message, mark, hint)

    def _location(self, mark: Mark) -> Location:
        text = self.lines[mark.line - 1] if 0 < mark.line <= len(self.lines) else ""
        return Location(self.file, mark.line, mark.column, text)

    def _expanded(self, parser: Plain) -> Iterator[Event]:
        """Yield the events of values; an alias yields the events of its anchor, from its own place."""
        anchors: dict[str, list[Event]] = {}
        recording: dict[str, tuple[int, list[Event]]] = {}
        depth = documents = 0
        while parser.check_event():
            event = parser.get_event()
            mark = self.mark(event.start_mark.line + 1, event.start_mark.column + 1)
            documents += isinstance(event, yaml.DocumentStartEvent)
            if documents > 1:
                hint = "a file holds one spec; put the other into a file of its own"
                raise self.error("several-documents", 'a second document begins here ("---")', mark, hint)
            if not isinstance(event, yaml.NodeEvent | yaml.CollectionEndEvent):
                continue
            found = [(event, mark)]
            if isinstance(event, yaml.AliasEvent):
                (first, _), *inner = self._anchored(anchors, recording, str(event.anchor), mark)
                found = [(first, mark), *inner]
            elif isinstance(event, yaml.NodeEvent) and event.anchor:
                recording[event.anchor] = depth, []
            depth += isinstance(event, yaml.CollectionStartEvent)
            depth -= isinstance(event, yaml.CollectionEndEvent)
            self._check_depth(depth - 1, mark)
            for _, events in recording.values():
                events.extend(found)
            for name in [name for name, (begun, _) in recording.items() if begun == depth]:
                anchors[name] = recording.pop(name)[1]
            for one in found:
                if isinstance(one[0], yaml.NodeEvent):
                    self.spend(one[1])
                yield one

    def _anchored(
        self, anchors: dict[str, list[Event]], recording: dict[str, Plain], name: str, mark: Mark
    ) -> list[Event]:
        if name in recording:
            raise self.error("yaml-limit", f"the alias *{name} contains itself", mark, "write the value out")
        if name not in anchors:
            message = f"the alias *{name} refers to no anchor &{name} above it"
            hint = "write the value out; put a text that begins with * in quotes"
            raise self.error("yaml-syntax", message, mark, hint)
        return anchors[name]

    def _value(self, event: Plain, mark: Mark, path: Path, key: Mark | None) -> Plain:
        """Return the plain data that begin with an event; `key` marks the key in front, if there is one."""
        self._check_depth(len(path), mark)
        mapping = isinstance(event, yaml.MappingStartEvent)
        self.tree.places.values[path] = key if mapping and key else mark
        if event.tag not in _PLAIN_TAGS:
            message = f"{format_key(path) or 'the spec'} carries the tag {clip(str(event.tag))}"
            hint = "remove the tag: a spec holds plain numbers, texts, lists and mappings"
            self._complain("yaml-tag", message, hint, path, mark)
        if mapping:
            return self._mapping(path)
        if isinstance(event, yaml.SequenceStartEvent):
            items: list[Plain] = []
            for item, place in self._inside():
                items.append(self._value(item, place, (*path, len(items)), None))
            return items
        if event.style in (None, ""):
            return resolve(event.value)
        if bad := FORBIDDEN_IN_TEXT.search(event.value):
            what = f"the unprintable character U+{ord(bad.group()):04X}"
            message = f"{format_key(path) or 'the spec'} holds {what}"
            self._complain("bad-text", message, "remove the escape that makes it", path, mark, lost=path)
            return ""
        return event.value

    def _mapping(self, path: Path) -> dict[str, Plain]:
        data: dict[str, Plain] = {}
        first: dict[str, int] = {}
        for event, mark in self._inside():
            scalar = isinstance(event, yaml.ScalarEvent)
            if not scalar or FORBIDDEN_IN_TEXT.search(event.value):
                message = f"a key of {format_key(path) or 'the spec'} is not a word"
                hint = 'keys are plain words; a list or mapping goes behind a colon ("key: value")'
                self._complain("bad-key", message, hint, path, mark, lost=path)
                self._skip(event)
                self._skip(next(self.events)[0])
                continue
            name = event.value
            here = (*path, name)
            if name == "<<" and event.style in (None, ""):
                message = 'the merge key "<<" is not supported'
                hint = "write the keys out; an anchor (&name) and alias (*name) may stand for a whole value"
                self._complain("yaml-merge-key", message, hint, here, mark, lost=path)
            elif name in first:
                where = " and on line ".join(str(line) for line in sorted({first[name], mark.line}))
                message = f"{format_key(here)} is given twice, on line {where}"
                self._complain("duplicate-key", message, "keep one of the two", here, mark)
            else:
                first[name] = mark.line
                self.tree.places.keys[here] = mark
                data[name] = self._value(*next(self.events), here, mark)
                continue
            self._skip(next(self.events)[0])
        return data

    def _inside(self) -> Iterator[Event]:
        """Yield the first event of each item of a list or mapping; the caller reads the rest of the item."""
        for event, mark in self.events:
            if isinstance(event, yaml.CollectionEndEvent):
                return
            yield event, mark

    def _skip(self, event: Plain) -> None:
        """Read past a value, whatever it is."""
        depth = int(isinstance(event, yaml.CollectionStartEvent))
        while depth:
            event, _ = next(self.events)
            depth += isinstance(event, yaml.CollectionStartEvent)
            depth -= isinstance(event, yaml.CollectionEndEvent)

    def _complain(
        self, code: str, message: str, hint: str, path: Path, mark: Mark, lost: Path | None = None
    ) -> None:
        # The value is read all the same: what else is wrong with it is worth saying.
        self.tree.diagnostics.append(Diagnostic(code, message, hint, format_key(path), self._location(mark)))
        if lost is not None:
            self.tree.broken.add(lost)


def syntax_error(error: yaml.YAMLError, file: str, lines: list[str], shift: int = 0) -> SpecError:
    """Return the parser's error with its place; `shift` columns are added on the first line."""
    mark = getattr(error, "problem_mark", None) or getattr(error, "context_mark", None)
    line, column = (mark.line + 1, mark.column + 1) if mark is not None else (1, 1)
    column += shift if line == 1 else 0
    if line > len(lines):
        # The end of the file: point behind the last character that was written.
        line = max(len(lines), 1)
        while line > 1 and not lines[line - 1].strip():
            line -= 1
        column = len(lines[line - 1].rstrip()) + 1 if lines else 1
    text = lines[line - 1] if lines else ""
    message, hint = _meaning(error, text[column - 1 : column])
    opened = getattr(error, "context_mark", None)
    if opened is not None and opened.line + 1 != line and "closed" in message:
        message += f" (it begins on line {opened.line + 1})"
    location = Location(file, line, column, text)
    return SpecError.because("yaml-syntax", message, hint, location=location)


def _meaning(error: yaml.YAMLError, character: str) -> tuple[str, str]:
    problem = " ".join(str(part) for part in (getattr(error, "problem", ""), getattr(error, "context", "")))
    if "cannot start any token" in problem or character == "\t":
        if character == "\t":
            return "a tab is used where YAML wants spaces", "indent with spaces"
        return f'a value cannot begin with "{character}"', "put the text in quotes"
    for pattern, message, hint in _MEANINGS:
        if re.search(pattern, problem):
            return message, hint
    return "this is not valid YAML", "compare with an example spec (`idesign init` writes one)"
