"""Sections that other packages add to a spec by entry points: requirements, spectra and control laws.

An entry point of `idesign.requirements`, `idesign.spectra` or `idesign.control_laws` has the name of its key
in the spec (a spectrum: of its `type`) and refers to a `Section`. The method `build` of the section builds
its object, and its `CODES` explain the errors that it raises.
"""

from __future__ import annotations

from contextlib import suppress
from functools import cache, reduce
from operator import or_
from typing import Annotated, get_args

from pydantic.fields import FieldInfo

from inputdesign_cli.errors import SpecError
from inputdesign_cli.plugins import loaded, points, refused
from inputdesign_cli.specification.models.accuracy import Accuracy
from inputdesign_cli.specification.models.loop import ClosedLoopError, Control
from inputdesign_cli.specification.models.section import Section, optional
from inputdesign_cli.specification.models.spec import Spec
from inputdesign_cli.specification.models.spectrum import Spectrum
from inputdesign_cli.specification.yaml.plain import Plain

GROUPS = ("requirements", "spectra", "control_laws")


@cache
def added(group: str) -> dict[str, type[Section]]:
    """Return the sections that installed packages add to a group, by key; `SpecError` (`bad-plug-in`)."""
    found: dict[str, type[Section]] = {}
    for point in points(f"idesign.{group}").values():
        section = loaded(point)
        if not (isinstance(section, type) and issubclass(section, Section) and hasattr(section, "build")):
            raise refused(point, "is no Section with a method build")
        found[point.name] = section
    return found


@cache
def install() -> None:
    """Add the keys of all installed packages to the models of a spec; `SpecError` (`bad-plug-in`)."""
    sections = {group: added(group) for group in GROUPS}
    if not any(sections.values()):
        return
    for group, model in (("requirements", Accuracy), ("control_laws", Control)):
        for name, section in sections[group].items():
            if name in model.model_fields:
                raise refused(points(f"idesign.{group}")[name], "has the name of a key that exists")
            _set_field(model, name, section | None, (section.__doc__ or name).splitlines()[0])
    alternatives, *choice = get_args(Spectrum)
    taken = {own.phrase for own in get_args(alternatives)}
    for name, section in sections["spectra"].items():
        if section.phrase in taken or section.phrase != f"type: {name}":
            what = f"is a Section of {section.phrase or 'no phrase'}, not of a new type called {name}"
            raise refused(points("idesign.spectra")[name], what)
    wider: Plain = Annotated[(reduce(or_, sections["spectra"].values(), alternatives), *choice)]
    _set_field(Spec, "spectrum", wider | None, Spec.model_fields["spectrum"].description or "")
    for changed in (Control, ClosedLoopError, Accuracy, Spec):
        changed.model_rebuild(force=True)


def _set_field(model: type[Section], name: str, annotation: Plain, description: str) -> None:
    model.model_fields[name] = FieldInfo.from_annotated_attribute(annotation, optional(description))


def codes() -> dict[str, dict[str, str]]:
    """Return the explanations of the codes of errors that installed packages raise: title, text, remedy."""
    sections = list[type[Section]]()
    for group in GROUPS:
        with suppress(SpecError):  # `idesign explain` must explain this error, too
            sections += added(group).values()
    return {code: dict(entry) for section in sections for code, entry in section.CODES.items()}
