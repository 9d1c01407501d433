"""The contract of `result.json`: what 04bdf145 wrote for the shipped specs is still there, field by field.

Further fields are welcome; a missing one, another type or another number is a broken promise. Where a number
was mended since, `results.json` has the new one. A later design of equal cost within the proved gap, or a
later record of it, also replaced the earlier one, as did a shorter list of structures of `explore`.
"""

import json
from pathlib import Path

import pytest

from tests.contract.condensed import condensed
from tests.support.commands import caller

HERE = Path(__file__).parent
ROOT = HERE.parents[1]
EXPECTED = json.loads((HERE / "results.json").read_text())
QUICK = {"analyse-first_order_given", "simulate-first_order", "simulate-regression"}
CLOSE = 2e-6
# A design is proved to 1e-7 of its cost, which is flat at the optimum. Designs of two machines differ by the
# square root of that; their costs, bounds and binding errors agree.
ALIKE = 4e-4
PROVED = {"objective", "cost", "baseline", "model_error", "certificate", "samples"}
# Proofs stop where they are good enough, and that depends on the order of additions.
ROUGH = {
    *("lower_bound", "relative_gap", "any_spectrum_gap", "any_spectrum_bound", "any_structure_bound"),
    *("cuts", "rounds", "steps", "nodes", "active_frequencies", "spectral_factor_residual"),
    "worst_scenario",  # one of several plants that bind equally
}
DATA = [HERE / "data/w1_5.csv", "--operating-point", "u1=45,y1=82"]
OTHERS = {
    "explore-buck": ["explore", ROOT / "docs/data/buck_converter/buck_id.csv"],
    "identify-process": ["identify", "--spec", HERE / "data/w1.yaml", *DATA],
    "assess-process": ["assess", HERE / "data/w1.yaml", *DATA],
}


def command(name):
    if name in OTHERS:
        return OTHERS[name]
    verb, spec = name.split("-", 1)
    runs = ["--set", "simulation.runs=20"] if verb == "simulate" else []
    return [verb, ROOT / f"specs/{spec}.yaml", *runs]


def largest(value):
    """The largest number of nested lists, or of a long list that is condensed."""
    parts = value.values() if isinstance(value, dict) else value if isinstance(value, list) else ()
    return max(map(largest, parts), default=abs(value) if isinstance(value, int | float) else 0.0)


def differences(expected, found, where, close=CLOSE, scale=1e-9):
    """Every difference; entries of a list that are zero but for rounding count beside the largest."""
    if isinstance(expected, dict) and isinstance(found, dict):
        size = largest(expected) if "length" in expected else scale
        for key in expected:
            if key not in found:
                yield f"{where}.{key} is missing"
            elif key not in ROUGH:
                share = CLOSE if key in PROVED else close
                yield from differences(expected[key], found[key], f"{where}.{key}", share, size)
    elif isinstance(expected, list) and isinstance(found, list) and len(expected) == len(found):
        size = max(scale, largest(expected))
        for index, pair in enumerate(zip(expected, found, strict=True)):
            yield from differences(*pair, f"{where}[{index}]", close, size)
    elif isinstance(expected, float) and isinstance(found, int | float):
        if abs(found - expected) > close * max(abs(expected), scale):
            yield f"{where} is {found}, not {expected}"
    elif expected != found:
        yield f"{where} is {found}, not {expected}"


@pytest.mark.parametrize(
    "name", [name if name in QUICK else pytest.param(name, marks=pytest.mark.slow) for name in EXPECTED]
)
def test_results_contain_every_recorded_field_and_number(name, tmp_path, monkeypatch):
    monkeypatch.chdir(ROOT)
    caller(monkeypatch)(*command(name), "-o", tmp_path / "run", "--no-figures", "--quiet")
    result = json.loads((tmp_path / "run/result.json").read_text())
    assert result.get("notes", []) == [one["message"] for one in result.get("findings", [])]
    found = condensed(result)
    designed = name.startswith("simulate")
    assert list(differences(EXPECTED[name], found, name, ALIKE if designed else CLOSE)) == []
