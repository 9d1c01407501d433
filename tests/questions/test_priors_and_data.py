"""Priors beside a record: whether they count, and whether they contradict it."""

import json
from functools import partial

import numpy as np
import pytest
import scipy
import yaml

from inputdesign_cli import assess, identify, parse_spec, solve
from inputdesign_cli.errors import DataError, SpecError
from inputdesign_cli.identification.earlier import Earlier
from inputdesign_cli.outcome.results import Table
from inputdesign_cli.outcome.text_formats import csv_text
from tests.support.campaigns import answered
from tests.support.outcomes import codes_in
from tests.support.refusals import refusals

LAG = """
plant: {B: [0, 3.6], F: [1, -0.7]}
noise: {variance: 1.0}
experiment: {samples: 200}
accuracy: {model_error: {relative: 0.3}}
spectrum: {type: fir, order: 4}
signal: {candidates: 1}
"""


@pytest.fixture
def lag_record(write):
    """Writes a record of the lag about an operating point, with a start off it by `warm`."""

    def written(name, samples, seed, *, power=1.0, level=(0.0, 0.0), warm=0.0):
        u = np.sqrt(power) * np.random.default_rng(1000 + seed).standard_normal(samples)
        y = answered(u, seed) + warm * 0.72 ** np.arange(samples)
        return write({"time_s": np.arange(1.0 * samples), "u": u + level[0], "y": y + level[1]}, name)

    return written


@pytest.fixture(scope="module")
def estimated(tmp_path_factory):
    """The result of `identify` for a record of the lag, which other tests take as a prior."""
    folder = tmp_path_factory.mktemp("estimated")
    u = np.sqrt(0.5) * np.random.default_rng(1001).standard_normal(300)
    (folder / "a.csv").write_text(csv_text(Table({"time_s": np.arange(300.0), "u": u, "y": answered(u, 1)})))
    return identify(parse_spec(LAG), folder / "a.csv")


def test_a_prior_without_its_estimate_affects_neither_verdict_nor_top_up(lag_record):
    overrides = ["accuracy.model_error.relative=0.05"]
    path = lag_record("a.csv", 300, 1, power=0.5)
    plain = assess(parse_spec(LAG, overrides=overrides), path)
    prior = yaml.safe_dump({"information": (1e3 * np.eye(2)).tolist()}, default_flow_style=True)
    stated = assess(parse_spec(LAG, overrides=[*overrides, f"experiment.prior={prior}"]), path)
    assert plain.verdict == stated.verdict == "missed"
    requirements = [one.results.result["assessment"]["requirements"] for one in (plain, stated)]
    assert requirements[0] == requirements[1]
    assert plain.results.resolved_spec == stated.results.resolved_spec
    written = yaml.safe_load(stated.results.resolved_spec)["experiment"]["prior"]
    assert written["parameters"] == pytest.approx(stated.results.result["identification"]["theta"])
    found = [codes_in(one.results.result).count("prior-left-out") for one in (stated, plain)]
    assert found == [1, 0]


def test_a_prior_with_its_estimate_has_the_effect_of_its_record(lag_record, tmp_path):
    spec = parse_spec(LAG, overrides=["accuracy.model_error.relative=0.1"], folder=tmp_path)
    first = lag_record("a.csv", 700, 1, power=0.5, level=(40.0, 52.3), warm=1.0)
    second = lag_record("b.csv", 700, 2, power=0.5, level=(41.0, 50.0), warm=-2.0)
    (tmp_path / "model.yaml").write_bytes(identify(spec, first).files["model.yaml"])
    alone, both = assess(spec, second), assess(spec, [first, second])
    named = ["accuracy.model_error.relative=0.1", "experiment.prior.information=model.yaml"]
    known = assess(parse_spec(LAG, overrides=named, folder=tmp_path), second)
    ratio, joint, single = (
        found.results.result["assessment"]["requirements"][0]["worst_ratio"] for found in (known, both, alone)
    )
    assert ratio == pytest.approx(joint, rel=0.1)
    assert ratio < 0.9 * single
    result = known.results.result
    assert result["model_error"]["worst_ratio"] == pytest.approx(ratio)
    assert result["identification"]["prior"]["probability"] > 1e-3


def test_a_prior_from_the_same_data_is_refused_in_any_format_of_their_file(lag_record, estimated, tmp_path):
    path = lag_record("a.csv", 300, 1, power=0.5)
    (tmp_path / "model.yaml").write_bytes(estimated.files["model.yaml"])
    spaced = tmp_path / "b.csv"
    spaced.write_text(path.read_text().replace(",", ", "))
    known = parse_spec(LAG, overrides=["experiment.prior.information=model.yaml"], folder=tmp_path)
    for file in (path, spaced):
        told = refusals(partial(assess, known, file), DataError)[0]
        assert (told.code, told.key) == ("data-repeated", "experiment.prior")


def test_a_prior_from_a_copy_of_the_data_leaves_the_verdict_undecided(lag_record, estimated, tmp_path):
    """The copy is rounded to four digits and lacks the last two rows."""
    path = lag_record("a.csv", 300, 1, power=0.5)
    (tmp_path / "model.yaml").write_bytes(estimated.files["model.yaml"])
    known = parse_spec(LAG, overrides=["experiment.prior.information=model.yaml"], folder=tmp_path)
    head, *rows = path.read_text().splitlines()
    copy = tmp_path / "copy.csv"
    rounded = [",".join(f"{float(cell):.4g}" for cell in row.split(",")) for row in rows[:298]]
    copy.write_text("\n".join([head, *rounded]))
    verdict = assess(known, copy)
    assert verdict.verdict == "undecided"
    assert "prior-of-these-data" in codes_in(verdict.results.result)


def test_the_probability_that_estimates_agree_is_uniform_for_independent_data():
    """The probability is uniform for two Gaussian estimates and vanishes for the same one."""
    rng = np.random.default_rng(1)
    information = np.array([[4.0, 1.0], [1.0, 2.0]])
    deviation = np.linalg.cholesky(np.linalg.inv(information))
    factor = np.linalg.cholesky(2.0 * information)
    found = []
    for _ in range(2000):
        one, other = (deviation @ rng.standard_normal((2, 2))).T
        found.append(Earlier(one, information).likeness((one + other) / 2.0, factor))
    assert scipy.stats.kstest(found, "uniform").pvalue > 1e-3
    assert Earlier(one, information).likeness(one, factor) < 1e-9


def test_a_prior_of_another_system_leaves_the_verdict_undecided(lag_record):
    path = lag_record("a.csv", 700, 1, power=0.5)
    found = identify(parse_spec(LAG), path).result
    values = {name: 1.1 * value for name, value in found["identification"]["theta"].items()}
    prior = json.dumps({"information": found["information"]["matrix"], "parameters": values})
    verdict = assess(parse_spec(LAG, overrides=[f"experiment.prior={prior}"]), path)
    assert verdict.verdict == "undecided"
    assert "prior-contradicted" in codes_in(verdict.results.result)


@pytest.mark.parametrize(
    "text",
    ["", "secret: [", "- 1", "plant: {B: [0, 1]}", "estimate: {parameters: {b1: 1}, covariance: [[1, 0]]}"],
)
def test_an_invalid_model_file_is_refused_without_showing_its_content(tmp_path, text):
    (tmp_path / "model.yaml").write_text(text)
    spec = parse_spec(LAG, overrides=["experiment.prior.information=model.yaml"], folder=tmp_path)
    with pytest.raises(SpecError) as caught:
        solve(spec)
    (diagnostic,) = caught.value.diagnostics
    assert (diagnostic.code, diagnostic.key) == ("bad-model-file", "experiment.prior.information")
    assert "secret" not in str(caught.value)


@pytest.mark.parametrize("name", ["folder", "there-is-none.csv", "text.csv", "output.csv"])
@pytest.mark.parametrize("ask", [identify, assess, lambda spec, path: solve(spec)])
def test_a_prior_that_cannot_be_read_is_refused_by_every_command(ask, name, lag_record, tmp_path):
    path = lag_record("a.csv", 300, 1, power=0.5)
    (tmp_path / "folder").mkdir()
    (tmp_path / "text.csv").write_text("u1\nhigh\nlow\n")
    (tmp_path / "output.csv").write_text("time_s,y1\n0,1\n1,2\n")
    spec = parse_spec(LAG, overrides=[f"experiment.prior={{information: {name}}}"], folder=tmp_path)
    with pytest.raises((SpecError, DataError)) as caught:
        ask(spec, path)
    assert {d.key for d in caught.value.diagnostics} == {"experiment.prior.information"}
