"""model.yaml has the sample time of its data: a spec inherits it, states the same one, or is refused."""

from dataclasses import replace

import numpy as np
import pytest
import yaml

from inputdesign_cli import assess, identify, load_spec, parse_spec, solve
from inputdesign_cli.identification.estimators import identify as identify_model
from inputdesign_cli.questions.assessment.outcome import model_text
from inputdesign_cli.questions.building.header import build_units
from inputdesign_cli.questions.building.system import build_model
from inputdesign_cli.specification import is_prior
from tests.support.refusals import refusal

STRUCTURE = """
sample_time: 5
time_unit: min
plant: {B: [0, 1.5], F: [1, -0.7]}
noise: {variance: 0.01}
"""
ASKED = """
experiment: {samples: 200}
accuracy: {standard_deviation: {b1: 0.01}}
spectrum: {type: white}
signal: {samples: 100, seed: 1, candidates: 1}
"""


@pytest.fixture(scope="module")
def record(tmp_path_factory):
    """A record of B = 1.5 q^-1, F = 1 - 0.7 q^-1 with white input, by the recursion."""
    rng = np.random.default_rng(1)
    u, y = rng.standard_normal(300), np.zeros(300)
    for t in range(1, 300):
        y[t] = 0.7 * y[t - 1] + 1.5 * u[t - 1]
    path = tmp_path_factory.mktemp("data") / "r.csv"
    rows = np.column_stack([5.0 * np.arange(300), u, y + 0.1 * rng.standard_normal(300)])
    np.savetxt(path, rows, delimiter=",", header="time_min,u1,y1", comments="")
    return path


def models(record):
    """The model.yaml of each command that writes one."""
    yield identify(parse_spec(STRUCTURE, design=False), record).files["model.yaml"]
    yield assess(parse_spec(STRUCTURE + ASKED), record).results.files["model.yaml"]


@pytest.fixture(scope="module")
def model(record):
    return next(models(record)).decode()


def test_every_command_writes_the_sample_time_of_the_data(record, tmp_path):
    for content in models(record):
        stated = yaml.safe_load(content)
        assert (stated["sample_time"], stated["time_unit"]) == (5.0, "min")
        (tmp_path / "model.yaml").write_bytes(content)
        (tmp_path / "spec.yaml").write_text("include: model.yaml\n" + ASKED)
        spec = load_spec(tmp_path / "spec.yaml")
        assert (spec.sample_time, spec.time_unit) == (5.0, "min")
        assert spec.nyquist == pytest.approx(np.pi / 5.0)


PRIOR = "\nexperiment: {samples: 200, prior: {information: model.yaml}}\n"


def test_a_spec_may_state_the_same_sample_time(model, tmp_path):
    (tmp_path / "model.yaml").write_text(model)
    prior = ASKED.replace("\nexperiment: {samples: 200}\n", PRIOR)
    texts = [
        "include: model.yaml\n" + prior,
        "include: model.yaml\nsample_time: 5.0\ntime_unit: min\n" + prior,
        STRUCTURE + prior,
    ]
    costs = [solve(parse_spec(text, folder=tmp_path)).result["cost"] for text in texts]
    assert costs[1] == costs[0]
    assert costs[2] == pytest.approx(costs[0], rel=0.2)  # nominal values in place of estimates


@pytest.mark.parametrize(
    ("clock", "numbers"), [("sample_time: 2", ("2 here", "5.0 in")), ("time_unit: s", ("s here", "min in"))]
)
def test_another_sample_time_than_that_of_an_included_model_is_refused(clock, numbers, model, tmp_path):
    (tmp_path / "model.yaml").write_text(model)
    found = refusal(lambda: parse_spec(f"include: model.yaml\n{clock}\n{ASKED}", folder=tmp_path))
    assert (found.code, found.key) == ("bad-include", clock.split(":")[0])
    assert all(number in found.message for number in numbers)


@pytest.mark.parametrize("clock", ["", "sample_time: 2\ntime_unit: min", "sample_time: 5"])
@pytest.mark.parametrize(
    ("key", "block"),
    [
        ("experiment.prior.information", PRIOR),
        ("uncertainty.covariance", "\nexperiment: {samples: 200}\nuncertainty: {covariance: model.yaml}\n"),
    ],
)
def test_another_sample_time_than_that_of_a_prior_is_refused(clock, key, block, model, tmp_path):
    (tmp_path / "model.yaml").write_text(model)
    plant = "".join(line + "\n" for line in STRUCTURE.splitlines() if line.startswith(("plant", "noise")))
    rest = ASKED.replace("\nexperiment: {samples: 200}\n", block)
    found = refusal(lambda: solve(parse_spec(f"{clock}\n{plant}{rest}", folder=tmp_path)))
    assert (found.code, found.key) == ("wrong-estimate", key)
    assert "5 min apart" in found.message
    assert ("2 min here" if "2" in clock else "s here") in found.message


def test_a_model_file_without_a_sample_time_is_accepted_as_a_prior(model, tmp_path):
    lines = [line for line in model.splitlines() if not line.startswith(("sample_time", "time_unit"))]
    (tmp_path / "model.yaml").write_text("\n".join(lines))
    text = STRUCTURE + ASKED.replace("\nexperiment: {samples: 200}\n", PRIOR)
    assert solve(parse_spec(text, folder=tmp_path)).result["status"] in ("optimal", "nothing_needed")


def test_a_covariance_that_is_singular_to_rounding_is_neither_written_nor_a_prior(model, tmp_path):
    """One direction has 1e-18 of the information of the other, which is below rounding."""
    spec = parse_spec(STRUCTURE, design=False)
    plant, rng = build_model(spec), np.random.default_rng(1)
    u = rng.standard_normal((200, 1))
    y = plant.simulate(u, 0.1 * rng.standard_normal((200, 1)), 1.0)[0] + 0.1 * rng.standard_normal((200, 1))
    estimate = identify_model(plant, u, y)
    sound = yaml.safe_load(model_text(build_units(spec), plant, estimate))
    assert np.all(np.linalg.eigvalsh(sound["estimate"]["covariance"]) > 0.0)
    blind = replace(estimate, factor=np.array([[1.0, 0.0], [1.0, 1e-9]]))
    text = model_text(build_units(spec), plant, blind)
    assert "covariance" not in yaml.safe_load(text)["estimate"]
    assert "singular to rounding" in text
    (tmp_path / "model.yaml").write_text(text)
    found = refusal(
        lambda: solve(
            parse_spec(STRUCTURE + ASKED.replace("\nexperiment: {samples: 200}\n", PRIOR), folder=tmp_path)
        )
    )
    assert (found.code, found.key) == ("bad-model-file", "experiment.prior.information")


@pytest.mark.parametrize("units", [(1.0, 1.0), (1e6, 1e-9), (1e-7, 1e7)])
def test_a_covariance_is_a_valid_prior_in_any_units_of_the_parameters(units):
    """The eigenvalues may differ by any power of ten; eigenvalues of correlations do not."""
    scale = np.array([units[1] / units[0], 1.0])
    covariance = np.array([[1.0, 0.98], [0.98, 1.0]]) * np.outer(scale, scale)
    assert is_prior({"b1": 1.0, "f1": 0.5}, covariance.tolist())
    covariance[0, 1] = covariance[1, 0] = 1.02 * scale[0]
    assert not is_prior({"b1": 1.0, "f1": 0.5}, covariance.tolist())
    assert not is_prior({"b1": 1.0, "f1": 0.5}, [[1e-300, 1e300], [1e300, 1e-300]])
