"""Verdicts met, missed and undecided on records, on models and on the plant of the spec."""

import shlex
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
import scipy.signal
import scipy.stats
from scipy.stats import chi2, norm

from inputdesign_cli import assess, parse_spec
from inputdesign_cli.finding import Severity
from inputdesign_cli.findings.far_from_nominal import far_from_nominal, from_nominal
from inputdesign_cli.findings.other_systems import contradictions, differences
from inputdesign_cli.outcome.units import Units
from inputdesign_cli.questions.building.system import build_model
from tests.support.heater import HEATER, LAG, SLOW, covariance_of, heater

UNITS = Units("s", 1.0, sampled=True, closed_loop=False, inputs=1, outputs=1)


def test_a_right_model_is_met(heater_record):
    found = assess(parse_spec(HEATER), heater_record("a.csv", 720, 1))
    assert (found.verdict, found.results.result["status"]) == ("met", "met")
    assert found.results.result["identification"]["failed"] == []


@pytest.mark.first(1)
@pytest.mark.parametrize(
    ("drift", "following"), [(0.0, "idesign explore {}"), (1.0, "idesign assess SPEC {} --detrend linear")]
)
def test_a_missing_lag_leaves_the_verdict_undecided(drift, following, heater_record):
    record = heater_record("a.csv", 720, 1, lag=True, drift=drift)
    found = assess(parse_spec(HEATER), record)
    result = found.results.result
    assert (found.verdict, result["status"]) == ("undecided", "undecided")
    assert "recent_inputs" in result["identification"]["failed"]
    # b6, b7 cover the delay; the lag adds coefficients after them.
    assert result["identification"]["tests"]["recent_inputs"]["lag"] in (7, 8, 9)
    listed = {one["code"]: one for one in result["findings"]}
    assert listed["plant-structure"]["severity"] == "refuted"
    assert "signal" not in found.results.tables
    assert result["assessment"]["verdict"] == "undecided"
    assert result["assessment"]["causes"] == ["contradicted"]
    assert result["assessment"]["next"] == following.format(shlex.quote(str(record)))


@pytest.mark.slow
def test_a_record_of_another_plant_is_named(heater_record, tmp_path):
    spec = parse_spec(HEATER)
    first, second = heater_record("a.csv", 400, 1), heater_record("b.csv", 400, 2)
    assert assess(spec, [first, second]).verdict == "met"
    rows = np.genfromtxt(second, delimiter=",", names=True)
    other = tmp_path / "other.csv"
    table = np.column_stack([rows["time_s"], rows["u"], -rows["y"]])
    np.savetxt(other, table, delimiter=",", header="time_s,u,y", comments="")
    found = assess(spec, [first, other])
    assert found.verdict == "undecided"
    (differs,) = [one for one in found.results.outcome.findings if one.code == "records-differ"]
    assert {differs.where, differs.figures["against"]} == {"a.csv", "other.csv"}
    assert differs.message in found.results.outcome.assessment.undecided


def test_columns_of_channels_that_the_plant_does_not_have_are_reported(heater_record):
    path = heater_record("a.csv", 720, 1)
    lines = path.read_text().splitlines()
    path.write_text("\n".join([f"{lines[0]},u2", *(f"{line},0.5" for line in lines[1:])]))
    findings = assess(parse_spec(HEATER), path).results.outcome.findings
    assert ["u2"] in [one.figures["columns"] for one in findings if one.code == "columns-unused"]


@pytest.mark.slow
def test_an_undecided_verdict_has_a_nonparametric_frequency_response(heater_record):
    found = assess(parse_spec(HEATER), heater_record("a.csv", 720, 1, lag=True))
    table, told = found.results.tables["frequency_response"].columns, found.results.result["assessment"]
    G = table["G_re"] + 1j * table["G_im"]
    q = np.exp(-5j * table["frequency_rad_per_s"])
    gain = 2.35 * (1 - SLOW) * (1 - LAG)
    truth = gain * (0.4 * q**6 + 0.6 * q**7) / ((1 - SLOW * q) * (1 - LAG * q))
    assert np.mean(np.abs(G - truth) < table["radius"]) > 0.85
    assert told["frequency_response"]["model_outside"] > 0.2
    assert "frequency_response" in found.results.curves
    assert (
        "frequency_response" not in assess(parse_spec(HEATER), heater_record("b.csv", 720, 1)).results.tables
    )


@pytest.mark.slow
def test_in_a_loop_the_frequency_response_is_that_to_a_recorded_reference(heater_record, tmp_path):
    loop = [
        "experiment.controller={numerator: [0.01], denominator: [1]}",
        "accuracy.model_error.relative=1.0",
        "plant={B: [0, 0, 0.03, 0.02], F: [1, -0.97]}",
    ]
    columns = heater(720, 1)
    for name, by in (("r", "r"), ("note", "u")):
        named = columns | {name: columns["u"] + 0.01 * columns["y"]}
        path = tmp_path / f"{name}.csv"
        rows = "\n".join(",".join(map(repr, map(float, row))) for row in zip(*named.values(), strict=True))
        path.write_text(",".join(named) + "\n" + rows + "\n")
        result = assess(parse_spec(HEATER, overrides=loop), path).results.result
        assert result["assessment"]["frequency_response"]["excitation"] == by
        codes = {one["code"] for one in result["findings"]}
        assert ("response-biased-by-loop" in codes) == (by == "u")


@pytest.mark.first(2)
@pytest.mark.parametrize(
    ("factor", "contradicts"), [(1.0, False), (1.1, False), (1.6, False), (-1.0, True), (3.0, True)]
)
def test_a_plant_that_is_not_the_one_of_the_spec_is_reported(factor, contradicts, heater_record):
    path = heater_record("a.csv", 720, 1)
    B = [0, 0, 0, 0, 0, 0, *(factor * 2.35 * (1 - SLOW) * share for share in (0.4, 0.6))]
    found = assess(parse_spec(HEATER, overrides=[f"plant={{B: {B}, F: [1, {-SLOW}]}}"]), path)
    result = found.results.result
    nominal = result["assessment"]["nominal"]
    listed = {one["code"]: one for one in result.get("findings", [])}
    assert found.verdict == "met"
    assert ("another-plant" in listed) == contradicts
    assert nominal["opposite_sign"] == (factor < 0)
    assert nominal["degrees_of_freedom"] == 3
    names = ["b6", "b7", "f1"]
    P = covariance_of(result, names)
    away = np.array([*B[6:], -SLOW]) - [result["identification"]["theta"][name] for name in names]
    assert nominal["statistic"] == pytest.approx(away @ np.linalg.solve(P, away), rel=1e-6)
    far = nominal["statistic"] > chi2.isf(2 * norm.sf(5.0), 3)
    assert ("far-from-the-spec" in listed) == (far and not contradicts)
    if contradicts:
        share = abs(factor - 1.0) / max(abs(factor), 1.0)
        assert nominal["worst_difference"] == pytest.approx(share, rel=0.15)
        assert listed["another-plant"]["figures"]["deviations"] == np.sqrt(nominal["statistic"])


@pytest.mark.parametrize(
    ("deviations", "admitted", "contradicts"),
    [
        (0.5, None, False),
        (3.0, None, False),
        (4.5, None, True),
        (9.0, None, True),
        (20.0, 0.5, True),
        (20.0, 30.0, False),
    ],
)
def test_a_far_estimate_contradicts_the_spec_by_chi_squared_and_admissible_error(
    deviations, admitted, contradicts
):
    """With two parameters, chi-squared exceeds deviations^2 with probability exp(-deviations^2 / 2).

    As b1 goes from 1 to 3, G differs by at most 2/0.3 = 6.7.
    """
    nominal = build_model(parse_spec("plant: {B: [0, 1], F: [1, -0.7]}\n", design=False))
    theta, covariance = nominal.theta + np.array([2.0, 0.0]), (2.0 / deviations) ** 2 * np.eye(2)
    estimate = SimpleNamespace(theta=theta, covariance=covariance, names=["b1", "f1"])
    estimate.search = SimpleNamespace(rivals=())
    error = SimpleNamespace(
        grid=np.array([0.1]),
        entry=None,
        error_bound=lambda information, w: np.zeros(w.shape),
        admissible=SimpleNamespace(at=lambda w: np.full(w.shape, admitted)),
    )
    asked = admitted is not None
    distance = from_nominal(UNITS, nominal, nominal.at(theta), estimate, [error], np.eye(2), asked=asked)
    assert distance.nominal.probability == pytest.approx(np.exp(-(deviations**2) / 2), rel=1e-6)
    told = "another-plant" if contradicts else "far-from-the-spec"
    assert [one.code for one in far_from_nominal(distance)] == [told] * (contradicts or asked)
    weights = {one.severity for one in far_from_nominal(distance)}  # a spec without uncertainty gets a note
    assert weights <= ({Severity.DOUBT} if contradicts else {Severity.NOTE})
    uncertain = replace(distance, exact=False)
    assert {one.severity for one in far_from_nominal(uncertain)} <= {Severity.DOUBT}


def test_the_level_of_a_test_is_divided_among_repeated_looks():
    """Records have a level of 0.001 and priors one of 0.01, which all looks share (Bonferroni)."""
    prior, tests = SimpleNamespace(differing=4e-4, alike=0.9), SimpleNamespace(alike=(2e-5, 2e-5))
    estimate = SimpleNamespace(prior=prior, tests=tests)
    assert differences(estimate, ["a.csv", "b.csv"], looks=24)
    assert contradictions(estimate, looks=24)
    assert not differences(estimate, ["a.csv", "b.csv"], looks=26)
    assert not contradictions(estimate, looks=26)


SPEC = """
plant: {{B: [0, {b1}], F: [1, -0.7]}}
noise: {{variance: 1.0}}
experiment: {{samples: 2000}}
accuracy: {{model_error: {{relative: 0.1}}}}
spectrum: {{type: white}}
"""
TRUE, NOMINAL = np.array([3.5, -0.72]), np.array([3.0, -0.7])
MATRIX = "[[0.1, 0.002], [0.002, 0.0004]]"
P = np.array([[0.1, 0.002], [0.002, 0.0004]])
STATED = {
    "": np.zeros((2, 2)),
    f"estimate: {{parameters: {{b1: 3.0, f1: -0.7}}, covariance: {MATRIX}}}": P,
    f"estimate: {{parameters: {{f1: -0.7, b1: 3.0}}, covariance: {MATRIX}}}": P[::-1, ::-1],
    f"estimate: {{parameters: {{b1: 9.0, f1: -0.7}}, covariance: {MATRIX}}}": np.zeros((2, 2)),
    f"estimate: {{parameters: {{b1: 3.0, K: 1.0}}, covariance: {MATRIX}}}": np.diag([0.1, 0.0]),
    f"uncertainty: {{covariance: {MATRIX}, scenarios: 3}}": P,
    f"uncertainty: {{information: {np.linalg.inv(P).tolist()}, scenarios: 3}}": P,
    # Uniform draws: a twelfth of the squared width, and the squared distance of the middle.
    "uncertainty: {intervals: {b1: [2.8, 3.4]}, scenarios: 3}": np.diag([0.6**2 / 12 + 0.1**2, 0.0]),
    "uncertainty: {scenarios: [{b1: 2.8}, {b1: 3.4, f1: -0.6}]}": np.array([[0.1, 0.02], [0.02, 0.005]]),
}  # fmt: skip


@pytest.fixture(scope="module")
def record(tmp_path_factory):
    rng = np.random.default_rng(1)
    u = rng.standard_normal(2000)
    y = scipy.signal.lfilter([0, TRUE[0]], [1, TRUE[1]], u) + rng.standard_normal(2000)
    path = tmp_path_factory.mktemp("data") / "record.csv"
    np.savetxt(path, np.column_stack([u, y]), delimiter=",", header="u,y", comments="")
    return path


@pytest.mark.first(4)
@pytest.mark.parametrize("stated", STATED)
def test_the_statistic_adds_the_covariances_of_the_estimate_and_of_the_spec(record, stated):
    found = assess(parse_spec(SPEC.format(b1=3.0) + stated), record)
    result = found.results.result
    nominal = result["assessment"]["nominal"]
    theta = [result["identification"]["theta"][name] for name in ("b1", "f1")]
    away, both = theta - NOMINAL, covariance_of(result, ["b1", "f1"]) + STATED[stated]
    statistic = away @ np.linalg.solve(both, away)
    assert nominal["statistic"] == pytest.approx(statistic, rel=1e-6)
    assert nominal["probability"] == pytest.approx(scipy.stats.chi2.sf(statistic, 2), rel=1e-5, abs=1e-300)


def test_a_difference_within_the_stated_uncertainty_is_not_another_plant(record):
    """G may differ at a frequency by two standard deviations of the difference."""
    gap = {}
    for b1, known in ((3.0, False), (3.0, True), (-3.0, True)):
        block = f"estimate: {{parameters: {{b1: {b1}, f1: -0.7}}, covariance: {MATRIX}}}" if known else ""
        result = assess(parse_spec(SPEC.format(b1=b1) + block), record).results.result
        gap[b1, known] = result["assessment"]["nominal"]["worst_difference"], len(result.get("notes", []))
    assert gap[3.0, False][0] > 0.1
    assert gap[3.0, True] == (0.0, gap[3.0, False][1] - 1)
    assert gap[-3.0, True][0] > 1.0
    assert gap[-3.0, True][1] == gap[3.0, False][1]


@pytest.mark.slow
def test_two_records_are_judged_together_by_the_stated_worst_ratio(heater_record):
    """The first record alone misses the accuracy; both records together meet it."""
    spec = parse_spec(HEATER, overrides=["accuracy.model_error.relative=0.1"])
    first = heater_record("a.csv", 300, 1, power=0.02, level=(40.0, 52.3), warm=1.0)
    second = heater_record("b.csv", 700, 2, power=0.5, level=(41.0, 50.0), warm=-2.0)
    alone, both = assess(spec, first), assess(spec, [first, second])
    assert (alone.verdict, both.verdict) == ("missed", "met")
    result = both.results.result
    assert result["identification"]["records"] == [300, 700]
    assert result["samples"] == 1000
    (listed,) = result["assessment"]["requirements"]
    assert listed["worst_ratio"] == pytest.approx(result["model_error"]["worst_ratio"])
    apart = np.linalg.inv(assess(spec, second).results.result["information"]["covariance"])
    ratio = np.diag(result["information"]["matrix"]) / np.diag(apart)
    assert np.all(ratio > 0.9)
    assert np.array_equal(np.unique(both.results.tables["fit"].columns["record"]), [1, 2])
