"""The base of every model of the spec: frozen, no unknown keys, and it says which model read which data."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, ClassVar

from pydantic import (
    BaseModel,
    BeforeValidator,
    ConfigDict,
    GetJsonSchemaHandler,
    Tag,
    ValidationInfo,
    model_validator,
)
from pydantic_core import core_schema

from inputdesign_cli.specification.models.findings import describe, fail

TAG = "\x00"
"""Marks the tags that pydantic puts into the path of an error inside a union; they are not keys."""

FAMILIES: dict[str, list[type[Section]]] = {}
"""Models that are alternatives of each other, so that a key of one inside another gets a useful answer."""


class Section(BaseModel):
    """A mapping of the spec.

    A subclass that is one of several alternatives names its `family` as a class argument and calls itself
    by a `phrase` in diagnostics ("type: fir").
    """

    model_config = ConfigDict(frozen=True, extra="forbid")

    phrase: ClassVar[str] = ""
    family: ClassVar[str] = ""

    def __init_subclass__(cls, family: str = "", phrase: str = "", **kwargs: Any) -> None:
        super().__init_subclass__(**kwargs)
        if family:
            cls.family, cls.phrase = family, phrase
            FAMILIES.setdefault(family, []).append(cls)

    @model_validator(mode="before")
    @classmethod
    def _remember(cls, value: Any, info: ValidationInfo) -> Any:
        # The context maps the identity of each mapping of the input to the model that read it: pydantic
        # does not say which keys would have been right where it found an unknown one.
        if isinstance(info.context, dict):
            info.context[id(value)] = cls
        return value


def tag(word: str) -> Tag:
    """The pydantic tag of an alternative."""
    return Tag(TAG + word)


def picker(choose: Callable[[dict[str, Any]], str]) -> Callable[[Any], str]:
    """A discriminator: the tag that `choose` names for a mapping; instances are of their own class."""

    def pick(value: Any) -> str:
        if isinstance(value, Section):
            return TAG + value.phrase
        return TAG + choose(value if isinstance(value, dict) else {})

    return pick


def needs_mapping(example: str) -> BeforeValidator:
    """Refuse what is not a mapping, with an example of what to write."""

    def check(value: Any) -> Any:
        if isinstance(value, dict | Section):
            return value
        raise fail(
            "wrong-shape", f"{{key}} must be a mapping of keys, not {describe(value)}", f"write {example}"
        )

    return BeforeValidator(check)


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
