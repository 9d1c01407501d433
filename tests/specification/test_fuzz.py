"""Any text is read as a spec or refused with diagnostics; nothing else happens."""

from __future__ import annotations

import json
import random
from pathlib import Path

import yaml
from hypothesis import HealthCheck, given, settings, strategies as st

from inputdesign_cli.diagnostics import as_json, explanations, render
from inputdesign_cli.errors import SpecError
from inputdesign_cli.specification import parse_spec
from tests.fuzzing.mutations import mutated, places

HERE = Path(__file__).parent
SPECS = sorted([*(HERE / "data").glob("*.yaml"), *(HERE.parents[1] / "specs").glob("*.yaml")])
TEXTS = [path.read_text() for path in SPECS]
DATA = [yaml.safe_load(text) for text in TEXTS]

RAW = (
    "Input should", "valid dictionary", "Field required", "Extra inputs", "pydantic", "Traceback", "{key}",
    "\x00", "Value error", "unable to",
)  # fmt: skip

quick = settings(
    max_examples=30, deadline=None, derandomize=True, database=None, suppress_health_check=list(HealthCheck)
)


def read_or_complain(text, overrides=()):
    try:
        spec = parse_spec(text, "f.yaml", overrides)
    except SpecError as caught:
        check(caught)
        return
    again = parse_spec(spec.to_yaml())
    assert again.sha256 == spec.sha256
    assert again.model_dump() == spec.model_dump()


def check(error):
    assert error.diagnostics
    for diagnostic in error.diagnostics:
        assert diagnostic.code in explanations(), diagnostic
        assert diagnostic.message
        assert diagnostic.location is not None, diagnostic
        assert diagnostic.location.line >= 1
        assert 1 <= diagnostic.location.column <= len(diagnostic.location.text) + 1, diagnostic
        assert not any(phrase in diagnostic.message + diagnostic.hint for phrase in RAW), diagnostic
    assert render(error)
    assert json.dumps(as_json(error))


WORDS = (
    "plant noise variance B F A C accuracy model_error relative sensitivity spectrum type fir given limits "
    "max continuous numerator denominator regression signal simulation criterion D true null ~ 1 -1 0 1e-3 "
    ".inf .nan 010 0x1 1e999 [ ] { } , : - ? & * &a *a ! | > % @ ` ' # << <<: --- ..."
)
words = st.sampled_from(
    [*WORDS.split(), '"', "\n", "\n  ", ": ", ": [", "]\n", " ", "\t", "\u2028", "é", "\x85"]
)


@settings(quick, max_examples=30)
@given(st.lists(words, max_size=60).map(" ".join) | st.text(max_size=80))
def test_words_of_the_language_in_any_order_and_any_text(text):
    read_or_complain(text)


@quick
@given(
    st.sampled_from(TEXTS),
    st.lists(st.tuples(st.floats(0, 1), st.integers(0, 4), st.text(max_size=3)), max_size=4),
)
def test_examples_with_characters_cut_out_and_put_in(text, edits):
    for where, cut, insert in edits:
        at = int(where * len(text))
        text = text[:at] + insert + text[at + cut :]
    read_or_complain(text)


scalars = st.one_of(
    st.none(),
    st.booleans(),
    st.integers(-3, 3),
    st.sampled_from([0, 1, -1, 10**400, 1e308, -1e308, 1e-308, 5e-324, float("inf"), float("nan")]),
    st.floats(),
    st.sampled_from(["", "fir", "white", "D", "1e-3", "zoh", "x", "moments", "least_cost", "best_accuracy"]),
    st.text(max_size=5),
)
KEYS = {str(k) for d in DATA for p in places(d) for k in p} | {"", "x", "1", "table", "max", "min"}
keys = st.sampled_from(sorted(KEYS))
values = st.recursive(
    scalars,
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(keys, inner, max_size=3),
    max_leaves=6,
)


@settings(quick, max_examples=60)
@given(st.integers(0, 10**9))
def test_examples_with_parts_replaced(seed):
    data = mutated(random.Random(seed))
    read_or_complain(yaml.safe_dump(data, allow_unicode=True, default_flow_style=None))


@settings(quick, max_examples=25)
@given(
    st.sampled_from(TEXTS),
    st.lists(
        st.sampled_from(sorted({".".join(map(str, p)) for d in DATA for p in [(), *places(d)]})), max_size=3
    ),
    st.data(),
)
def test_random_overrides(text, targets, data):
    overrides = [
        f"{t}={data.draw(values | st.text(max_size=4))!r}"
        if data.draw(st.booleans())
        else f"{t}={data.draw(words)}"
        for t in targets
    ]
    read_or_complain(text, overrides)
