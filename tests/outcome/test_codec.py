import json
import math
from collections.abc import Mapping
from contextlib import suppress
from dataclasses import dataclass, field, fields, is_dataclass
from typing import Literal, get_args, get_type_hints

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

from inputdesign_cli.arrays import Array, ComplexArray
from inputdesign_cli.outcome import Outcome, OutcomeError, plain, read_plain
from inputdesign_cli.outcome.codec import NULL, json_text, others


@dataclass(frozen=True)
class Part:
    name: Literal["a", "b"]
    value: float


@dataclass(frozen=True)
class Whole:
    parts: tuple[Part, ...]
    pair: tuple[int, float]
    matrix: Array
    response: ComplexArray
    by_name: Mapping[str, Part]
    empty: float | None = None
    unstable: float | None = field(default=None, metadata=NULL)
    several: float | tuple[float | None, ...] | None = None
    rest: Mapping[str, object] = others()


PLAIN = {
    "parts": [{"name": "a", "value": 1.0}],
    "pair": [3, 0.5],
    "matrix": [[1.0, 2.0], [3.0, 4.0]],
    "response": [{"re": 1.0, "im": -2.0}],
    "by_name": {"x": {"name": "b", "value": 2.0}},
    "unstable": None,
    "several": [1.0, None],
    "unknown_key": {"kept": [1, "2"]},
}


def test_plain_data_come_back_as_they_were():
    assert plain(read_plain(Whole, PLAIN)) == PLAIN


def test_values_have_the_types_of_their_fields():
    whole = read_plain(Whole, PLAIN)
    assert whole.parts == (Part("a", 1.0),)
    assert whole.response[0] == 1.0 - 2.0j
    assert whole.matrix.shape == (2, 2)
    assert whole.empty is None
    assert whole.rest == {"unknown_key": {"kept": [1, "2"]}}


def test_numbers_of_numpy_are_read_as_plain_ones():
    read = read_plain(Part, {"name": "a", "value": np.float64(2.0)})
    assert type(read.value) is float


@pytest.mark.parametrize(
    ("key", "value"),
    [
        ("parts", [{"name": "c", "value": 1.0}]),
        ("parts", [{"name": "a"}]),
        ("parts", {"name": "a"}),
        ("pair", [1]),
        ("pair", [True, 1.0]),
        ("matrix", [["x"]]),
        ("by_name", [1]),
        ("several", "text"),
    ],
)
def test_what_has_another_form_is_an_error_that_names_the_place(key, value):
    with pytest.raises(OutcomeError, match=f'"{key}'):
        read_plain(Whole, {**PLAIN, key: value})


@pytest.mark.slow
@settings(deadline=None)
@given(
    st.dictionaries(st.sampled_from(list(PLAIN)), st.recursive(st.none() | st.floats() | st.text(), st.lists))
)
def test_whatever_is_written_there_nothing_else_is_raised(changes):
    with suppress(OutcomeError):
        read_plain(Whole, {**PLAIN, **changes})


def sections(kind, seen):
    """Every dataclass that a result is made of."""
    for hint in get_type_hints(kind).values():
        todo = [hint]
        while todo:
            one = todo.pop()
            todo += get_args(one)
            if is_dataclass(one) and one not in seen:
                seen.add(one)
                sections(one, seen)
    return seen


def test_a_section_has_one_field_at_most_for_keys_of_other_names():
    for section in sections(Outcome, {Outcome}):
        assert sum("others" in entry.metadata for entry in fields(section)) <= 1, section


def test_json_of_numpy_and_complex_values():
    value = {
        "b": np.float64(0.1),
        "a": np.arange(4).reshape(2, 2),
        "flag": np.bool_(True),
        "z": np.array([1 + 2j]),
        "none": None,
        "pair": (1, "µ"),
    }
    text = json_text(value)
    assert json.loads(text) == {
        "b": 0.1,
        "a": [[0, 1], [2, 3]],
        "flag": True,
        "z": [{"re": 1.0, "im": 2.0}],
        "none": None,
        "pair": [1, "µ"],
    }
    assert list(json.loads(text)) == ["b", "a", "flag", "z", "none", "pair"]
    assert "µ" in text
    assert text.startswith('{\n "b": 0.1,\n')


@pytest.mark.parametrize("bad", [math.nan, math.inf, np.array([1.0, np.nan]), complex(0, -math.inf)])
def test_json_has_no_nan_and_names_the_place(bad):
    with pytest.raises(ValueError, match=r"result\.deep\[0\]"):
        plain({"deep": [bad]})


@pytest.mark.parametrize("bad", [{1: 2}, {"a": object()}, {"a": {1, 2}}])
def test_json_refuses_foreign_types(bad):
    with pytest.raises(TypeError, match="result"):
        plain(bad)
