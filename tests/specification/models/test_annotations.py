"""The type that a model declares at the location of an error, and the words for what it refuses."""

from __future__ import annotations

from typing import Annotated, get_args

import pytest
from pydantic import Field, ValidationError

from inputdesign_cli.specification import Spec
from inputdesign_cli.specification.models.fields import Number, PerChannel, Several
from inputdesign_cli.specification.models.pydantic_errors import Wording, declared_at, sections_in, translate
from inputdesign_cli.specification.models.section import TAG, Section, pick, tag
from inputdesign_cli.specification.models.spectrum import Given, Spectrum


class Leaf(Section, phrase="a leaf", family="toys"):
    size: Annotated[Number, Wording("a size", "measure it")]


class Twig(Section, phrase="a twig", family="toys"):
    leaves: Annotated[Several[Leaf], Wording("a list of leaves")]
    weights: PerChannel[Annotated[Number, Field(ge=2)]] = 2.0


Part = Annotated[
    Annotated[Leaf, tag(Leaf.phrase)] | Annotated[Twig, tag(Twig.phrase)],
    pick(lambda value: Twig.phrase if "leaves" in value else Leaf.phrase),
    Wording("a part", "write a leaf"),
]


class Tree(Section):
    part: Part | None = None
    named: dict[str, Annotated[Number, Wording("a height")]] = Field(default={})


@pytest.mark.parametrize(
    ("location", "what"),
    [
        (("part", TAG + "a leaf", "size"), "a size"),
        (("part", TAG + "a twig", "leaves"), "a list of leaves"),
        (("part", TAG + "a twig", "leaves", 3, "size"), "a size"),
        (("named", "oak"), "a height"),
        (("part", TAG + "a twig", "size"), ""),
        (("nothing", 2, "like", "this"), ""),
    ],
)
def test_the_wording_at_a_location(location, what):
    assert declared_at(Tree, location).wording.what == what


def refused(data):
    with pytest.raises(ValidationError) as caught:
        Tree.model_validate(data)
    return [(d.code, d.path, d.message, d.hint) for d in translate(caught.value, data, Tree)]


def test_what_is_refused_is_named():
    """The words of a type, its hint, and the path of the value; other kinds are in `test_bad_input`."""
    expected = "not-a-number", ("part", "size"), "{key} must be a size, not true", "measure it"
    assert refused({"part": {"size": True}}) == [expected]
    found = refused({"part": {"leaves": [{"size": 1, "weights": 2}]}})
    assert [one[:2] for one in found] == [("unsuitable-key", ("part", "leaves", 0, "weights"))]


@pytest.mark.parametrize(
    "value", [10**400, -(10**400), float("nan"), float("inf")], ids=["huge", "-huge", "nan", "inf"]
)
def test_numbers_that_no_double_holds_are_refused(value):
    data = {"part": {"size": value}}
    assert refused(data)[0][0] == "not-finite"
    data = {"plant": {"B": [0, 1]}, "noise": {"variance": 1}, "experiment": {"samples": value}}
    with pytest.raises(ValidationError) as caught:
        Spec.model_validate(data)
    (found,) = translate(caught.value, data, Spec)
    assert found.code == ("out-of-range" if isinstance(value, int) else "not-finite")


@pytest.mark.parametrize("union", [Spec.model_fields["plant"].annotation, Given, Spectrum])
def test_alternatives_say_their_kind(union):
    kinds = [getattr(model, "kind", None) or kind_of(model) for model in sections_in(union)]
    assert len(set(kinds)) == len(kinds)


def kind_of(model):
    field = model.model_fields.get("type")
    return get_args(field.annotation)[0] if field else model.type
