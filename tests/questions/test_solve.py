"""From a spec to a result: content of the result, golden files, grid method, and refused tables."""

from pathlib import Path

import numpy as np
import pytest

from inputdesign_cli import load_spec, parse_spec, solve, validate
from inputdesign_cli.errors import DataError
from inputdesign_cli.outcome.golden import compare, load_golden
from inputdesign_cli.questions import execute
from inputdesign_cli.questions.least_cost.sought import GridMethod
from tests.support.first_order_specs import ERROR, PLANT
from tests.support.outcomes import codes_in
from tests.support.refusals import refusals

ROOT = Path(__file__).parent.parent.parent
SMALL = f"{PLANT}{ERROR}spectrum: {{type: fir, order: 3}}\nsignal: {{seed: 1}}\n"


def spec_of(text, **changes):
    return parse_spec(text, overrides=[f"{key.replace('__', '.')}={value}" for key, value in changes.items()])


# The others take longer; `make golden` runs them all.
QUICK = ("first_order", "flexible_transmission", "given_excitations", "peer_examples")


@pytest.mark.first(1)
@pytest.mark.parametrize("name", QUICK)
def test_golden_files_are_reproduced(name):
    """Each quantity is compared with the paper's figure and the independent solution."""
    golden = load_golden(ROOT / "golden" / f"{name}.yaml")
    rows = compare(golden, {run.name: execute(golden, run) for run in golden.runs})
    assert rows
    assert [row for row in rows if not row.passed] == []


def test_the_numbers_of_a_result_are_consistent():
    outcome = solve(spec_of(SMALL))
    result = outcome.result
    c = np.asarray(result["spectrum"]["coefficients"])
    assert result["status"] == "optimal"
    assert result["objective"]["value"] == pytest.approx(c[0])  # the cost is the input power
    assert result["objective"]["relative_gap"] <= 1e-7
    bounds = [result["objective"][key] for key in ("any_spectrum_bound", "lower_bound", "value")]
    assert bounds == sorted(bounds)
    M, P = np.asarray(result["information"]["matrix"]), np.asarray(result["information"]["covariance"])
    np.testing.assert_allclose(M @ P, np.eye(3), atol=1e-8)
    assert result["model_error"]["worst_ratio"] == pytest.approx(1.0, abs=1e-7)
    signal = outcome.tables["signal"].columns
    assert list(signal) == ["time_s", "u1"]
    power = np.mean(signal["u1"] ** 2)
    assert power == pytest.approx(c[0] * (1 + result["signal"]["extra_power"]))
    assert result["signal"]["worst_ratio"] == pytest.approx(1.0, abs=1e-8)  # with the least power
    bound = outcome.tables["bound"].columns
    assert np.all(bound["r_u"] <= bound["r_adm"] * (1 + 1e-7))
    assert list(outcome.tables["spectrum"].columns) == ["frequency_rad_per_s", "phi", "phi_record"]


def test_sample_time_scales_frequencies_and_nothing_else():
    """The same discrete plant sampled ten times as fast: frequencies times ten, costs unchanged."""
    slow, fast = solve(spec_of(SMALL)), solve(spec_of(SMALL, sample_time=0.1))
    assert fast.result["cost"] == pytest.approx(slow.result["cost"], rel=1e-9)
    ratio = (
        fast.tables["bound"].columns["frequency_rad_per_s"]
        / slow.tables["bound"].columns["frequency_rad_per_s"]
    )
    np.testing.assert_allclose(ratio, 10.0)
    assert fast.tables["signal"].columns["time_s"][1] == pytest.approx(0.1)


def test_equal_seeds_give_equal_signals():
    one, two, other = (
        solve(spec_of(SMALL, signal__seed=seed)).tables["signal"].columns["u1"] for seed in (4, 4, 5)
    )
    np.testing.assert_array_equal(one, two)
    assert not np.array_equal(one, other)


def test_the_grid_method_is_reported_as_optimal_on_its_grid_only():
    outcome = solve(spec_of(SMALL, solver="{method: lmi, grid: 60}"))
    assert outcome.result["status"] == "optimal_on_grid"
    (told,) = [one for one in outcome.result["findings"] if one["code"] == "accuracy-on-grid"]
    assert told["figures"]["grid"] == 60
    assert told["figures"]["worst_ratio"] == pytest.approx(1.0, abs=1e-2)
    assert outcome.result["cost"] == pytest.approx(solve(spec_of(SMALL)).result["cost"], rel=1e-5)


@pytest.mark.parametrize("lo", [0.0, 1e-4, 0.02, 1.0])
@pytest.mark.parametrize("lines", [2, 3, 50])
def test_the_grid_runs_from_one_end_of_the_band_to_the_other(lo, lines):
    grid = GridMethod(lines, "gram").frequencies(lo, 2.5)
    assert grid.size == lines
    assert (grid[0], grid[-1]) == pytest.approx((lo, 2.5), rel=1e-14)
    assert np.all(np.diff(grid) > 0.0)


def test_the_grid_method_keeps_the_accuracy_at_the_low_end_of_the_band():
    """A very slow lag whose error is largest at the lowest frequency, a ten-thousandth of the highest."""
    text = """
plant: {A: [1, -0.995], B: [0, 0.005]}
noise: {variance: 0.1}
experiment: {samples: 500}
accuracy: {model_error: {relative: 0.1, alpha: 2, band: [3.0e-4, 3]}}
spectrum: {type: fir, order: 6}
"""
    exact, on_grid = (
        solve(parse_spec(f"{text}solver: {{{solver}}}\n")).result
        for solver in ("method: exchange", "method: lmi, grid: 40")
    )
    assert exact["model_error"]["worst_frequency"] == pytest.approx(3e-4)
    assert on_grid["cost"] == pytest.approx(exact["cost"], rel=1e-5)
    assert on_grid["model_error"]["worst_ratio"] <= 1.0 + 1e-5


@pytest.mark.parametrize("kind", ["fir, order: 3", "free"])
def test_the_bound_over_every_spectrum_can_be_left_out(kind):
    whole, fast = (
        solve(spec_of(SMALL, spectrum=f"{{type: {kind}}}", solver__any_spectrum=asked)).result
        for asked in ("true", "false")
    )
    assert fast["objective"]["value"] == whole["objective"]["value"]
    free = kind == "free"  # the family is every spectrum
    assert ("any_spectrum_bound" in fast["objective"]) is free
    assert ("other-spectra-left-out" in codes_in(fast)) is not free


# Specs that name a table, whose path is TABLE.
TABLED = {
    "r_adm": (SMALL.replace("relative: 0.01", "table: TABLE"), []),
    "phi": (SMALL.replace("{type: fir, order: 3}", "{given: {type: table, file: TABLE}}"), ["signal=null"]),
    "level": (SMALL + "limits: {spectrum: {max: {table: TABLE}}}\n", []),
    "entries": (
        (ROOT / "specs" / "two_by_two_arx.yaml").read_text(),
        ["accuracy.model_error={table: TABLE}"],
    ),
    "matrix": (
        (ROOT / "specs" / "two_by_two_given.yaml").read_text(),
        ["spectrum={given: {type: table, file: TABLE}}"],
    ),
}
TABLES = [
    ("r_adm", "frequency_rad_per_s,r_adm\n0.1,1\n1,1\n", "bad-table", "covers 0.1 to 1"),
    ("r_adm", "frequency,r_adm\n0,1\n3.2,-1\n", "bad-table", "row 3"),
    ("r_adm", "frequency,r_adm\n3.2,1\n0,1\n", "bad-table", "increase"),
    ("r_adm", "frequency,bound\n0,1\n3.2,1\n", "data-missing-column", "r_adm"),
    ("r_adm", "frequency,r_adm\n0,1\n3.2,x\n", "data-not-a-number", "'x'"),
    ("r_adm", "frequency,r_adm\n", "data-unreadable", "no rows"),
    ("r_adm", None, "data-unreadable", "does not exist"),
    ("phi", "frequency,phi\n0.2,1\n0.1,1\n", "bad-table", "increase"),
    ("phi", "frequency,phi\n0.2,1\n5.0,1\n", "bad-table", "Nyquist"),
    ("phi", "frequency,phi\n0.2,-1\n0.5,1\n", "bad-table", "phi must be nonnegative"),
    ("phi", "frequency,power\n0.3,1\n0.9,-0.2\n", "bad-table", "power must be nonnegative"),
    ("phi", "frequency,phi\n0.2,1\n0.5,-1\n", "bad-table", "row 3"),
    ("level", "frequency,phi\n1,1\n0,1\n", "bad-table", "increase"),
    ("level", "frequency,phi\n0,1\n3.2,-1\n", "bad-table", "row 3"),
    (
        "entries",
        "frequency,r_adm_11,r_adm_12\n0,1,1\n3.2,1,1\n",
        "data-missing-column",
        "no column for r_adm_21",
    ),
    ("entries", "frequency,r_adm\n0,0.1\n2,0.1\n", "bad-table", "the band is"),
    (
        "matrix",
        "frequency,phi_11,phi_12_re,phi_12_im,phi_22\n0,1,2,0,1\n1,1,2,0,1\n",
        "bad-table",
        "positive semidefinite",
    ),
]


@pytest.mark.parametrize(("of", "content", "code", "words"), TABLES)
def test_bad_tables_are_refused_with_their_fault(tmp_path, of, content, code, words):
    table = tmp_path / "r.csv"
    if content is not None:
        table.write_text(content, encoding="utf-8")
    text, changes = TABLED[of]
    spec = parse_spec(
        text.replace("TABLE", str(table)), overrides=[one.replace("TABLE", str(table)) for one in changes]
    )
    found = refusals(lambda: validate(spec), DataError)[0]
    assert found.code == code
    assert words in found.message


@pytest.mark.parametrize("path", sorted((ROOT / "specs").glob("*.yaml")), ids=lambda p: p.stem)
def test_shipped_specs_validate(path):
    validate(load_spec(path))
