"""The base of every model of the spec, and the diagnostics that its checks return."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from typing import ClassVar, Self

from pydantic import (
    BaseModel,
    ConfigDict,
    Discriminator,
    Field,
    GetCoreSchemaHandler,
    GetJsonSchemaHandler,
    Tag,
    model_validator,
)
from pydantic_core import PydanticCustomError, core_schema

from inputdesign_cli.errors import Diagnostic
from inputdesign_cli.specification.models.wording import choices, show
from inputdesign_cli.specification.yaml.places import Path, Places, format_key
from inputdesign_cli.specification.yaml.plain import Plain

CARRIER = "diagnostics"
"""The type of the pydantic error that carries diagnostics, and their key in its context."""


@dataclass(frozen=True)
class PathDiagnostic:
    """One thing that is wrong. `{key}` in message and hint stands for the full dotted name of `path`.

    The path begins at the model that reports it; callers extend it to the root of the file. `at_key` points
    at the key and not at its value. `keys` are the keys below `path` that it is about, if not all. `meant` is
    the key that an unknown one probably stands for.
    """

    code: str
    message: str
    hint: str = ""
    path: Path = ()
    at_key: bool = False
    keys: tuple[str, ...] = ()
    meant: str = ""

    def placed(self, places: Places, whole: str) -> Diagnostic:
        """Return the diagnostic with its line; `whole` names the file in place of an empty key."""
        key = format_key(self.path)
        message, hint = (text.replace("{key}", key or whole) for text in (self.message, self.hint))
        return Diagnostic(self.code, message, hint, key, places.at(self.path, at_key=self.at_key))


def carry(*diagnostics: PathDiagnostic) -> PydanticCustomError:
    """Return the pydantic error that carries the diagnostics, for a validator to raise."""
    return PydanticCustomError(CARRIER, CARRIER, {CARRIER: diagnostics})


def fail(code: str, message: str, hint: str = "") -> PydanticCustomError:
    """Return the pydantic error of one diagnostic about the value at hand."""
    return carry(PathDiagnostic(code, message, hint))


@dataclass(frozen=True)
class Wording:
    """Words for the values of a type ("a list of coefficients"), and a hint for other values."""

    what: str
    hint: str = ""


@dataclass(frozen=True)
class Size:
    """The largest number, or the longest list, that a key takes; stands in the `Annotated[..]` of a type."""

    most: int
    why: str

    def check(self, value: Plain) -> Plain:
        """Return the value itself, or raise `PydanticCustomError` (`too-large`)."""
        listed = isinstance(value, list | tuple | dict)
        size = len(value) if listed else value
        if isinstance(size, int | float) and not isinstance(size, bool) and self.most < size < 2**1024:
            held = f"has {size} entries" if listed else f"is {show(size)}"
            hint = f"write at most {self.most}" + (" entries" if listed else "")
            raise fail("too-large", f"{{key}} {held}, and at most {self.most} are taken: {self.why}", hint)
        return value

    def __get_pydantic_core_schema__(
        self, source: object, handler: GetCoreSchemaHandler
    ) -> core_schema.CoreSchema:
        return core_schema.no_info_before_validator_function(self.check, handler(source))

    def __get_pydantic_json_schema__(
        self, schema: core_schema.CoreSchema, handler: GetJsonSchemaHandler
    ) -> dict[str, Plain]:
        inner = handler(schema)
        limits = {"array": "maxItems", "integer": "maximum", "object": "maxProperties"}
        limit = limits.get(str(inner.get("type")))
        return {**inner, limit: self.most} if limit else inner


_Keys = tuple[str, ...]
TAG = "\x00"
"""Marks the tags that pydantic puts into the path of an error inside a union; they are not keys."""

FAMILIES: dict[str, list[type[Section]]] = {}
"""Models that are alternatives of each other, for the hint on a key of one inside another."""


class Section(BaseModel):
    """A mapping of the spec.

    A subclass that is one of several alternatives names its `family` as a class argument and calls itself
    by a `phrase` in diagnostics ("type: fir"); the phrase is its tag in the union of the alternatives.
    Further class arguments are groups of keys, of which exactly one (`one_of`), at least one (`some_of`) or
    at most one (`not_both`) is given.
    """

    model_config = ConfigDict(frozen=True, extra="forbid", defer_build=True)

    phrase: ClassVar[str] = ""
    family: ClassVar[str] = ""
    groups: ClassVar[tuple[tuple[_Keys, ...], ...]] = ((), (), ())

    def __init_subclass__(
        cls,
        family: str = "",
        phrase: str = "",
        one_of: tuple[_Keys, ...] = (),
        some_of: tuple[_Keys, ...] = (),
        not_both: tuple[_Keys, ...] = (),
        **kwargs: Plain,
    ) -> None:
        super().__init_subclass__(**kwargs)
        if family:
            cls.family, cls.phrase = family, phrase
            FAMILIES.setdefault(family, []).append(cls)
        cls.groups = (one_of, some_of, not_both)

    @classmethod
    def __get_pydantic_core_schema__(
        cls, source: type[BaseModel], handler: GetCoreSchemaHandler
    ) -> core_schema.CoreSchema:
        return Tag(TAG + cls.phrase).__get_pydantic_core_schema__(source, handler)

    def check(self) -> Iterator[PathDiagnostic]:
        """Yield the diagnostics of the section as a whole; each of its values is valid."""
        return iter(())

    ELSEWHERE: ClassVar[Mapping[str, str]] = {}
    """Common keys that this section does not have -> a hint on its own keys."""
    CODES: ClassVar[Mapping[str, Mapping[str, str]]] = {}
    """Codes of the errors of a section from another package, with title, text and remedy."""

    def stated(self, *keys: str) -> tuple[str, ...]:
        """Return the keys that have a value."""
        return tuple(key for key in keys if getattr(self, key) is not None)

    def at(self, *path: str) -> object:
        """Return the value at a path below; None if a section or key on the path is absent."""
        inner = getattr(self, path[0], None)
        if path[1:]:
            return inner.at(*path[1:]) if isinstance(inner, Section) else None
        return inner

    def choose(self, keys: _Keys, least: int = 0, *, several: bool = False) -> Iterator[PathDiagnostic]:
        """Check that at least this many of the keys are given, and at most one, or `several`."""
        given = self.stated(*keys)
        if len(given) < least:
            needs = f"{{key}} needs one of {choices(keys)}"
            yield PathDiagnostic("missing-key", needs, "add one of them", keys=keys)
        for extra in () if several else given[1:]:
            message = f"{{key}} stands beside {given[0]}; give only one of {choices(keys)}"
            yield PathDiagnostic("conflicting-keys", message, "remove one of the two", (extra,), at_key=True)

    @model_validator(mode="after")
    def _checked(self) -> Self:
        found, one_of, some_of, not_both = [*self.check()], *self.groups
        found += [one for keys in (*one_of, *not_both) for one in self.choose(keys, int(keys in one_of))]
        found += [one for keys in some_of for one in self.choose(keys, 1, several=True)]
        if found:
            raise carry(*found)
        return self


def tag(word: str) -> Tag:
    """Return the pydantic tag of an alternative."""
    return Tag(TAG + word)


def by_tag(choose: Callable[[Plain], str]) -> Discriminator:
    """Return the discriminator of a union whose alternatives have a `tag`."""
    return Discriminator(lambda value: TAG + choose(value))


def pick(choose: Callable[[dict[str, Plain]], str], plain: str = "") -> Discriminator:
    """Return the discriminator of a union of sections: by the phrase for a mapping, or the tag `plain`."""

    def chosen(value: Plain) -> str:
        if isinstance(value, Section):
            return value.phrase
        return choose(value) if isinstance(value, dict) else plain

    return by_tag(chosen)


class Shorthand:
    """Allow a plain value in place of a mapping: it is read as `{key: value}`."""

    def __init__(self, key: str, *schemas: dict[str, Plain]) -> None:
        self.key, self.schemas = key, schemas

    def __get_pydantic_core_schema__(
        self, source: object, handler: GetCoreSchemaHandler
    ) -> core_schema.CoreSchema:
        def widen(value: Plain) -> Plain:
            return value if isinstance(value, dict | Section) else {self.key: value}

        return core_schema.no_info_before_validator_function(widen, handler(source))

    def __get_pydantic_json_schema__(
        self, schema: core_schema.CoreSchema, handler: GetJsonSchemaHandler
    ) -> dict[str, Plain]:
        return {"anyOf": [*self.schemas, handler(schema)]}


def optional(description: str, **more: Plain) -> Plain:
    """Return the field of a key that may be absent; its value is then None."""
    return Field(default=None, description=description, **more)
