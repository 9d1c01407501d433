"""A weight with a pole on the unit circle in its band is refused; the message names key and frequency."""

import json
import re

import numpy as np
import pytest

from inputdesign_cli import parse_spec, solve
from inputdesign_cli.errors import DataError, SpecError
from tests.support.refusals import refusals

SPEC = """\
plant: {B: [0, 1], F: [1, -0.7]}
noise: {variance: 1}
experiment: {samples: 500}
spectrum: {type: fir, order: 6}
"""
POLES = {0.0: [1, -1], np.pi: [1, 1], 0.5 * np.pi: [1, 0, 1], 0.3: [1, -2 * np.cos(0.3), 1]}
LOOP = {"numerator": [0.1], "denominator": [1]}
BESIDE = {"accuracy": {"model_error": {"absolute": 1}}}
KEYS = {
    "accuracy.model_error.weight": lambda w: {"accuracy": {"model_error": {"absolute": 1, "weight": w}}},
    "accuracy.weighted_variance.weight": lambda w: {
        "accuracy": {"weighted_variance": {"max": 0.01, "weight": w}}
    },
    "accuracy.model_error.sensitivity": lambda w: {
        "accuracy": {"model_error": {"sensitivity": {**w, "controller": LOOP}}}
    },
    "limits.spectrum": lambda w: {**BESIDE, "limits": {"spectrum": {"max": w}}},
    "limits.spectrum.min": lambda w: {**BESIDE, "limits": {"spectrum": {"min": w}}},
}


def refused(content):
    with pytest.raises(SpecError) as caught:
        solve(parse_spec(SPEC, overrides=[f"{key}={json.dumps(value)}" for key, value in content.items()]))
    return caught.value.diagnostics[0]


def frequency(told):
    return float(re.search(r"([\d.]+) rad/s", told.message)[1])


@pytest.mark.parametrize("at", POLES)
@pytest.mark.parametrize("key", KEYS)
def test_a_weight_with_a_pole_on_the_unit_circle_is_refused_with_key_and_frequency(key, at):
    told = refused(KEYS[key]({"numerator": [1], "denominator": POLES[at]}))
    assert told.code in ("admissible-not-positive", "bad-limit")
    assert (told.key, frequency(told)) == (key, pytest.approx(at, rel=1e-3))


def test_a_weight_with_a_pole_outside_the_band_is_accepted():
    weight = {"numerator": [1], "denominator": [1, -1]}
    error = {"absolute": 1, "weight": weight, "band": [0.01, 3.0]}
    spec = parse_spec(SPEC, overrides=[f"accuracy.model_error={json.dumps(error)}"])
    assert solve(spec).result["status"] == "optimal"


@pytest.mark.parametrize("at", POLES)
def test_a_zero_on_the_unit_circle_is_refused_where_a_weight_must_be_positive(at):
    weight = {"numerator": POLES[at], "denominator": [1]}
    for bound in ("max", "min"):
        told = refused({**BESIDE, "limits": {"spectrum": {bound: weight}}})
        assert frequency(told) == pytest.approx(at, rel=1e-3)
    error = {"absolute": 1, "weight": weight, "region": "ellipsoid"}
    assert frequency(refused({"accuracy": {"model_error": error}})) == pytest.approx(at, rel=1e-3)


@pytest.mark.parametrize("value", [9e99, 1e308, 1e-320])
def test_a_table_of_r_adm_with_an_extreme_number_is_refused_by_row(value, tmp_path):
    (tmp_path / "t.csv").write_text(f"frequency,r_adm\n0,1\n1,{value}\n3.2,1\n")
    table = "accuracy: {model_error: {table: t.csv}}\n"
    (told,) = refusals(lambda: solve(parse_spec(SPEC + table, folder=tmp_path)), DataError)
    assert (told.code, told.key, "row 3" in told.message) == ("bad-table", "accuracy.model_error.table", True)
