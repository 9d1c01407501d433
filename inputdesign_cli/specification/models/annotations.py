"""The type that a model declares at a path, and what that type is called in a diagnostic."""

from __future__ import annotations

import types
import typing
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Annotated, Any, Union

from pydantic import Tag

from inputdesign_cli.specification.models.section import TAG, Section
from inputdesign_cli.specification.models.units import Measure


@dataclass(frozen=True)
class Wording:
    """What a diagnostic calls a type, and what it advises; it stands in the `Annotated[..]` of the type.

    Args:
        what: What the value must be: "a list of coefficients".
        hint: How to mend a value that is not of this type.
    """

    what: str
    hint: str = ""


@dataclass(frozen=True)
class Declared:
    """A type without its annotations, and these; the outermost annotation stands last."""

    type: Any
    metadata: tuple[object, ...] = ()

    @property
    def wording(self) -> Wording:
        """The outermost wording, or an empty one."""
        return next((m for m in reversed(self.metadata) if isinstance(m, Wording)), Wording(""))

    @property
    def alternatives(self) -> dict[str, Declared]:
        """The types of a union by their tags, which are empty for what carries none."""
        parts = [declared(part) for part in typing.get_args(self.type)] if _is_union(self.type) else []
        return {part.tag: part for part in parts}

    @property
    def tag(self) -> str:
        """What tells it apart from the other alternatives of a union."""
        own = TAG + self.section.phrase if self.section else ""
        return next((m.tag for m in self.metadata if isinstance(m, Tag)), own)

    @property
    def section(self) -> type[Section] | None:
        """The type itself if it is a mapping of the spec."""
        return self.type if isinstance(self.type, type) and issubclass(self.type, Section) else None

    def at(self, step: str | int) -> Declared:
        """The type one step down: at a key, at an index, or behind the tag of an alternative."""
        if isinstance(step, str) and step.startswith(TAG):
            return self.alternatives.get(step, _UNKNOWN)
        if self.section is not None:
            field = self.section.model_fields.get(str(step))
            return declared(field.annotation, tuple(field.metadata)) if field else _UNKNOWN
        parts = typing.get_args(self.type)
        if isinstance(step, int) and len(parts) > step and ... not in parts:
            return declared(parts[step])
        return declared(parts[-1 if isinstance(step, str) else 0]) if parts else _UNKNOWN


_UNKNOWN = Declared(object)


def declared(annotation: Any, metadata: tuple[object, ...] = ()) -> Declared:
    """The annotation taken apart; that a key may be absent (None) does not count."""
    if typing.get_origin(annotation) is Annotated:
        inner, *outer = typing.get_args(annotation)
        return declared(inner, (*outer, *metadata))
    if _is_union(annotation):
        present = [part for part in typing.get_args(annotation) if part is not types.NoneType]
        if len(present) == 1:
            return declared(present[0], metadata)
    return Declared(annotation, metadata)


def declared_at(root: type[Section], location: Sequence[str | int]) -> Declared:
    """The type at the location of a pydantic error, tags included."""
    found = Declared(root)
    for step in location:
        found = found.at(step)
    return found


def measure_at(root: type[Section], location: Sequence[str | int]) -> Measure | None:
    """What a number at the location counts in: what is said nearest to it, within its section."""
    found, latest = Declared(root), None
    for step in location:
        found = found.at(step)
        own = next((m for m in reversed(found.metadata) if isinstance(m, Measure)), None)
        latest = own or (None if found.section else latest)
    return latest


def sections_in(annotation: Any) -> set[type[Section]]:
    """Every section that an annotation names, however deep in unions and lists."""
    if section := Declared(annotation).section:
        return {section}
    return {section for part in typing.get_args(annotation) for section in sections_in(part)}


def _is_union(annotation: Any) -> bool:
    return typing.get_origin(annotation) in (Union, types.UnionType)
