"""The base of every model of the spec: frozen, without unknown keys, and with one form of check."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import Any, ClassVar, Self

from pydantic import BaseModel, ConfigDict, Discriminator, GetJsonSchemaHandler, Tag, model_validator
from pydantic_core import core_schema

from inputdesign_cli.specification.models.path_diagnostic import PathDiagnostic, carry

TAG = "\x00"
"""Marks the tags that pydantic puts into the path of an error inside a union; they are not keys."""

FAMILIES: dict[str, list[type[Section]]] = {}
"""Models that are alternatives of each other, so that a key of one inside another gets a useful answer."""


class Section(BaseModel):
    """A mapping of the spec.

    A subclass that is one of several alternatives names its `family` as a class argument and calls itself
    by a `phrase` in diagnostics ("type: fir"); the phrase is its tag in the union of the alternatives.
    """

    model_config = ConfigDict(frozen=True, extra="forbid")

    phrase: ClassVar[str] = ""
    family: ClassVar[str] = ""

    def __init_subclass__(cls, family: str = "", phrase: str = "", **kwargs: Any) -> None:
        super().__init_subclass__(**kwargs)
        if family:
            cls.family, cls.phrase = family, phrase
            FAMILIES.setdefault(family, []).append(cls)

    def check(self) -> Iterator[PathDiagnostic]:
        """What is wrong with the section as a whole, once each of its values is valid."""
        return iter(())

    def stated(self, *keys: str) -> tuple[str, ...]:
        """Those of the keys that have a value."""
        return tuple(key for key in keys if getattr(self, key) is not None)

    @model_validator(mode="after")
    def _checked(self) -> Self:
        if found := tuple(self.check()):
            raise carry(*found)
        return self


def tag(word: str) -> Tag:
    """The pydantic tag of an alternative."""
    return Tag(TAG + word)


def pick(choose: Callable[[dict[str, Any]], str], plain: str = "") -> Discriminator:
    """The discriminator of a union of sections.

    Args:
        choose: The phrase of the alternative that a mapping of the file stands for.
        plain: The tag of the alternative that is no mapping, if there is one.
    """

    def chosen(value: object) -> str:
        if isinstance(value, Section):
            return TAG + value.phrase
        return TAG + (choose(value) if isinstance(value, dict) else plain)

    return Discriminator(chosen)


class Shorthand:
    """Allow a plain value in place of a mapping: it is read as `{key: value}`."""

    def __init__(self, key: str, *schemas: dict[str, Any]) -> None:
        self.key, self.schemas = key, schemas

    def __get_pydantic_core_schema__(self, source: Any, handler: Any) -> core_schema.CoreSchema:
        def widen(value: Any) -> Any:
            return value if isinstance(value, dict | Section) else {self.key: value}

        return core_schema.no_info_before_validator_function(widen, handler(source))

    def __get_pydantic_json_schema__(self, schema: Any, handler: GetJsonSchemaHandler) -> dict[str, Any]:
        return {"anyOf": [*self.schemas, handler(schema)]}
