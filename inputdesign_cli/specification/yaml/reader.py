"""YAML text to plain data and the place of every key and value, of bounded depth and size.

PyYAML's nodes are read here and not by its constructors, which know dates, tags and YAML 1.1 numbers. Aliases
are expanded; duplicate keys, tags and merge keys are refused.
"""

from __future__ import annotations

import re
from dataclasses import dataclass, field
from pathlib import Path as FilePath

import yaml

from inputdesign_cli.errors import Diagnostic, Location, SpecError
from inputdesign_cli.specification.yaml.places import Path, Places, format_key
from inputdesign_cli.specification.yaml.plain import FORBIDDEN_IN_TEXT, Plain
from inputdesign_cli.specification.yaml.scalars import clip, resolve

MAX_DEPTH = 64
MAX_NODES = 100_000

# The parser written in C is about ten times faster. Without resolvers, any other tag stands in the text.
_TAGS = {"DEFAULT_SCALAR_TAG": "scalar", "DEFAULT_SEQUENCE_TAG": "list", "DEFAULT_MAPPING_TAG": "mapping"}
_Loader: Plain = type(
    "_Loader", (getattr(yaml, "CSafeLoader", yaml.SafeLoader),), {**_TAGS, "yaml_implicit_resolvers": {}}
)
_FORBIDDEN = re.compile("[^\t\n\r\x20-\x7e\x85\xa0-\ud7ff\ue000-\ufffd\U00010000-\U0010ffff]")
# A pattern of PyYAML's message (its C and Python parsers word it differently), its meaning, and a remedy.
_MEANINGS = (
    ("',' or ']'", "a list is not closed, or a comma is missing", 'close it with "]"'),
    ("',' or '}'", "a mapping is not closed, or a comma is missing", 'close it with "}"'),
    ("mapping values are not", "a colon stands where no key can begin", 'put a text with ": " in quotes'),
    ("could not (find|found) expected ':'", "a key is not followed by a colon", 'write "key: value"'),
    (
        "did not find expected key|expected <block end>|did not find expected '-' indicator",
        "this line does not fit the indentation of the lines above",
        "keys of one mapping begin in the same column; so do the dashes of one list",
    ),
    ("unexpected end of stream", "a quotation mark is not closed", "close it on the same line"),
    ("undefined alias", "no anchor &name stands above this alias *name", "write the value out, or quote it"),
    ("duplicate anchor", "this anchor (&name) stands above already", "choose another name for one of them"),
    ("undefined tag handle", "tags (!name) are not used in a spec", "remove the tag, or quote the text"),
    ("unknown escape", "this backslash is not a known escape", "use single quotes, or double the \\"),
    ("expected the node|node content", "a value is missing", "write a value; quote special characters"),
    ("expected <document start>", "the text goes on after the end of the spec", "check the indentation"),
)


@dataclass
class Tree:
    """The nested dicts, lists and scalars of a text, their places, and the errors found while reading.

    `diagnostics` did not stop the reading; `broken` are the paths whose content is lost. `included` are the
    files whose blocks it has, by the names in the text: relative ones start in the `folder`.
    """

    data: Plain = field(default_factory=dict)
    places: Places = field(default_factory=Places)
    folder: FilePath = field(default_factory=FilePath)
    diagnostics: list[Diagnostic] = field(default_factory=list)
    broken: set[Path] = field(default_factory=set)
    included: list[str] = field(default_factory=list)

    def sound(self) -> Tree:
        """Return the tree itself; its diagnostics are raised as a `SpecError`."""
        if self.diagnostics:
            raise SpecError(self.diagnostics)
        return self


def read(text: str, file: str, *, before: str = "", at: Path = ()) -> Tree:
    """Read one YAML document; the tree has the diagnostics of single keys.

    `before` stands before the text on its first line, as `key=` of an override. `at` is the path of its root
    in a larger tree. Raises `SpecError`: it is not YAML, too deep or too large.
    """
    tree = Tree(None, Places([file]))
    document = _Document(file, (before + text).splitlines(), len(before), tree)
    if bad := _FORBIDDEN.search(text):
        above = (text[: bad.start()] + "|").splitlines()
        message = f"the text holds a character that YAML does not allow (U+{ord(bad.group()):04X})"
        hint = "remove it; a spec is plain UTF-8 text"
        location = document.location(len(above), len(above[-1]))
        raise SpecError.because("file-encoding", message, hint, location=location)
    try:
        document.check_size(text)
        node = yaml.compose(text, Loader=_Loader)
    except yaml.YAMLError as error:
        raise document.syntax_error(error) from None
    document.count = 0
    if node is not None:
        tree.data = document.value(node, at, None)
    return tree


@dataclass
class _Document:
    """Turns the nodes of a text into plain data; locations and diagnostics go into the tree."""

    file: str
    lines: list[str]
    shift: int
    tree: Tree
    count: int = 0

    def location(self, line: int, column: int) -> Location:
        """Return a place of the text as the user wrote it, counted from 1."""
        text = self.lines[line - 1] if 0 < line <= len(self.lines) else ""
        return Location(self.file, line, column + (self.shift if line == 1 else 0), text)

    def begin(self, node: Plain) -> Location:
        """Return the place where a node or event begins."""
        return self.location(node.start_mark.line + 1, node.start_mark.column + 1)

    def check_size(self, text: str) -> None:
        """Refuse a text that is too large before its nodes are built (`yaml-limit`, `several-documents`)."""
        depth = documents = 0
        for event in yaml.parse(text, Loader=_Loader):
            documents += isinstance(event, yaml.DocumentStartEvent)
            if documents > 1:
                hint = "a file holds one spec; put the other into a file of its own"
                what = 'a second document begins here ("---")'
                raise SpecError.because("several-documents", what, hint, location=self.begin(event))
            if isinstance(event, yaml.NodeEvent):
                self._spend(event, depth)
            depth += isinstance(event, yaml.CollectionStartEvent)
            depth -= isinstance(event, yaml.CollectionEndEvent)

    def _spend(self, node: Plain, depth: int) -> None:
        """Count one value, and raise `yaml-limit` for too many, or one too deep."""
        self.count += 1
        message, hint = "", "is a bracket open, or an alias inside itself?"
        if self.count > MAX_NODES:
            message = f"the spec holds more than {MAX_NODES} values"
            hint = "move large tables into a CSV file; do not let aliases repeat aliases"
        elif depth > MAX_DEPTH:
            message = f"lists and mappings are nested more than {MAX_DEPTH} deep"
        if message:
            raise SpecError.because("yaml-limit", message, hint, location=self.begin(node))

    def value(self, node: Plain, path: Path, key: Location | None) -> Plain:
        """Return the plain data of a node; `key` is the place of the key in front, if there is one."""
        self._spend(node, len(path))
        place, mapping = self.begin(node), isinstance(node, yaml.MappingNode)
        self.tree.places.values[path] = key if mapping and key else place
        if node.tag not in _TAGS.values():
            hint = "remove the tag: a spec holds plain numbers, texts, lists and mappings"
            whole = format_key(path) or "the spec"
            self._complain("yaml-tag", f"{whole} carries the tag {clip(node.tag)}", hint, path, place)
        if mapping:
            return self._mapping(node, path)
        if isinstance(node, yaml.SequenceNode):
            return [self.value(item, (*path, i), None) for i, item in enumerate(node.value)]
        if node.style in (None, ""):
            return resolve(node.value)
        if bad := FORBIDDEN_IN_TEXT.search(node.value):
            whole = format_key(path) or "the spec"
            message = f"{whole} holds the unprintable character U+{ord(bad.group()):04X}"
            self._complain("bad-text", message, "remove the escape that makes it", path, place, lost=path)
            return ""
        return node.value

    def _mapping(self, node: Plain, path: Path) -> dict[str, Plain]:
        data: dict[str, Plain] = {}
        keys = self.tree.places.keys
        for name_node, value in node.value:
            place, name, here = self.begin(name_node), name_node.value, (*path, name_node.value)
            if not isinstance(name_node, yaml.ScalarNode) or FORBIDDEN_IN_TEXT.search(name):
                message = f"a key of {format_key(path) or 'the spec'} is not a word"
                hint = 'keys are plain words; a list or mapping goes behind a colon ("key: value")'
                self._complain("bad-key", message, hint, path, place, lost=path)
            elif name == "<<" and name_node.style in (None, ""):
                message = 'the merge key "<<" is not supported'
                hint = "write the keys out; an anchor (&name) and alias (*name) may stand for a whole value"
                self._complain("yaml-merge-key", message, hint, here, place, lost=path)
            elif name in data:
                where = " and on line ".join(str(line) for line in sorted({keys[here].line, place.line}))
                message = f"{format_key(here)} is given twice, on line {where}"
                self._complain("duplicate-key", message, "keep one of the two", here, place)
            else:
                keys[here] = place
                data[name] = self.value(value, here, place)
        return data

    def _complain(
        self, code: str, message: str, hint: str, path: Path, place: Location, lost: Path | None = None
    ) -> None:
        # The value is read all the same, so that its other errors are reported, too.
        self.tree.diagnostics.append(Diagnostic(code, message, hint, format_key(path), place))
        if lost is not None:
            self.tree.broken.add(lost)

    def syntax_error(self, error: yaml.YAMLError) -> SpecError:
        """Return the parser's error with its place, in plain words."""
        opened = getattr(error, "context_mark", None)
        mark = getattr(error, "problem_mark", None) or opened
        place = self.location(mark.line + 1, mark.column + 1) if mark is not None else self.location(1, 1)
        if place.line > len(self.lines):
            # The end of the file: point behind the last character that was written.
            line = max((i for i, one in enumerate(self.lines, 1) if one.strip()), default=1)
            text = self.lines[line - 1] if self.lines else ""
            place = Location(self.file, line, len(text.rstrip()) + 1, text)
        message, hint = _meaning(error, place.text[place.column - 1 : place.column])
        if opened is not None and opened.line + 1 != place.line and "closed" in message:
            message += f" (it begins on line {opened.line + 1})"
        return SpecError.because("yaml-syntax", message, hint, location=place)


def _meaning(error: yaml.YAMLError, character: str) -> tuple[str, str]:
    problem = f"{getattr(error, 'problem', '')} {getattr(error, 'context', '')}"
    if character == "\t":
        return "a tab is used where YAML wants spaces", "indent with spaces"
    if "cannot start any token" in problem:
        return f'a value cannot begin with "{character}"', "put the text in quotes"
    for pattern, message, hint in _MEANINGS:
        if re.search(pattern, problem):
            return message, hint
    return "this is not valid YAML", "compare with an example spec (`idesign init` writes one)"
