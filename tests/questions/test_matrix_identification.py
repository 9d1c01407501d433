import numpy as np
import pytest
import scipy.signal
import yaml

from inputdesign_cli import assess, identify, load_spec, parse_spec, validate
from inputdesign_cli.errors import DataError, SpecError
from inputdesign_cli.questions.building.system import build_experiment, build_model
from tests.support.records import simulated

SPEC = "specs/two_by_two_arx.yaml"
# Every polynomial, one of them common, and an entry that is zero.
JENKINS = """
plant:
  B: [[[0, 1.0], [0, 0.5]], [[0, 0, 0.7], [0]]]
  F: [[[1, -0.7], [1, 0.3]], [[1, -0.5], [1]]]
noise: {C: [[1, 0.5], [1, -0.3]], D: [1, -0.6], variance: [[0.2, 0.05], [0.05, 0.1]]}
experiment: {samples: 400}
accuracy: {model_error: {relative: 0.1}}
spectrum: {type: fir, order: 4}
"""


def record(spec, samples=500, power=1.0, seed=0):
    """Columns of an experiment with white inputs on the plant of a spec."""
    u, y = simulated(build_model(spec), samples, np.random.default_rng(seed), power=power)
    columns = {"time_s": np.arange(samples, dtype=float)}
    for letter, x in (("u", u[0]), ("y", y[0])):
        columns |= {f"{letter}{i + 1}": column for i, column in enumerate(x.T)}
    return columns


@pytest.fixture
def data(write):
    return write(record(load_spec(SPEC)))


@pytest.mark.first(1)
@pytest.mark.parametrize("given", ["arx", "jenkins"])
def test_the_blocks_can_be_pasted(given, write):
    spec = load_spec(SPEC, ["spectrum.order=4"]) if given == "arx" else parse_spec(JENKINS)
    model = build_model(spec)
    outcome = identify(spec, write(record(spec, 1000)))
    found = outcome.result["identification"]
    for name, true in zip(model.names, model.theta, strict=True):
        assert abs(found["theta"][name] - true) < 4.5 * found["standard_deviation"][name]
    np.testing.assert_allclose(found["variance"], model.covariance, atol=0.15 * model.covariance.max())
    pasted = yaml.safe_load(outcome.files["model.yaml"].decode())
    content = {**yaml.safe_load(spec.to_yaml()), **pasted}
    again = parse_spec(yaml.safe_dump(content))
    estimated = build_model(again)
    assert estimated.names == model.names
    np.testing.assert_allclose(estimated.theta, list(found["theta"].values()))
    validate(again)
    assert pasted["estimate"]["parameters"] == found["theta"]
    np.testing.assert_allclose(pasted["estimate"]["covariance"], outcome.result["information"]["covariance"])


IN_S = """
sample_time: 0.5
plant:
  continuous: {numerator: [[[3.1], [1, 3.2]], [[5.3], [1.6]]], denominator: DENOMINATOR}
noise: {variance: [[0.5, 0.1], [0.1, 0.3]]}
experiment: {samples: 500}
accuracy: {model_error: {relative: 0.05}}
limits: {band: [0, 3]}
spectrum: {type: multisine, lines: 8}
"""
EACH = "[[[1, 1.5, 1.5], [1, 2, 1]], [[1, 0.5, 1], [1, 1, 0.3]]]"


def recorded_in_s(spec, samples, hold, rng):
    """The same for a plant in s, held inputs or their band-limited interpolation, by scipy's simulation."""
    matrix, step, finer = spec.plant.continuous, spec.sample_time, 1 if hold else 40
    u = rng.standard_normal((samples, 2))
    driven = u if hold else scipy.signal.resample(np.concatenate([u, 0 * u]), 2 * samples * finer)
    y = rng.standard_normal((samples, 2)) @ np.linalg.cholesky(spec.noise.covariance(2)).T
    for i, j in np.ndindex(2, 2):
        system = matrix.numerator_matrix[i][j], matrix.denominator_matrix[i][j]
        at = step / finer * np.arange(len(driven))
        _, found, _ = scipy.signal.lsim(system, driven[:, j], at, interp=not hold)
        y[:, i] += found[: samples * finer : finer]
    return {"time_s": step * np.arange(samples), "u1": u[:, 0], "u2": u[:, 1], "y1": y[:, 0], "y2": y[:, 1]}


@pytest.mark.slow
@pytest.mark.parametrize("hold", [True, pytest.param(False, marks=pytest.mark.slow)])
@pytest.mark.parametrize("denominator", [pytest.param(EACH, marks=pytest.mark.slow), "[1, 1.5, 1.5]"])
def test_plants_in_s_come_back(hold, denominator, write):
    overrides = ["plant.sample=zoh"] if hold else []
    spec = parse_spec(IN_S.replace("DENOMINATOR", denominator), overrides=overrides)
    model = build_model(spec)
    columns = recorded_in_s(spec, 1500, hold, np.random.default_rng(2))
    outcome = identify(spec, write(columns))
    found = outcome.result["identification"]
    for name, true in zip(model.names, model.theta, strict=True):
        assert abs(found["theta"][name] - true) < 4.5 * found["standard_deviation"][name]
    np.testing.assert_allclose(found["variance"], model.covariance, atol=0.06)
    assert "notes" not in outcome.result
    pasted = yaml.safe_load(outcome.files["model.yaml"].decode())
    again = parse_spec(yaml.safe_dump({**yaml.safe_load(spec.to_yaml()), **pasted}))
    assert build_model(again).names == model.names
    np.testing.assert_allclose(build_model(again).theta, list(found["theta"].values()))


@pytest.mark.slow
@pytest.mark.parametrize(
    ("relative", "enough"), [(2.0, True), pytest.param(0.1, False, marks=pytest.mark.slow)]
)
def test_plants_in_s_are_assessed(relative, enough, write):
    overrides = [f"accuracy.model_error.relative={relative}", "plant.sample=zoh"]
    spec = parse_spec(IN_S.replace("DENOMINATOR", "[1, 1.5, 1.5]"), overrides=overrides)
    data = write(recorded_in_s(spec, 500, True, np.random.default_rng(1)))
    found = assess(spec, data)
    assert found.met == enough
    if not enough:
        assert found.results.result["requirements"][0]["worst_ratio"] == pytest.approx(1.0, abs=1e-6)


@pytest.mark.slow
def test_a_held_input_taken_for_its_interpolation_is_told(write):
    spec = parse_spec(IN_S.replace("DENOMINATOR", EACH))
    data = write(recorded_in_s(spec, 1500, True, np.random.default_rng(1)))
    assert any("plant.sample: zoh" in note for note in identify(spec, data).result["notes"])


def recorded_in_loop(spec, samples, rng):
    """u and y of the loop of a spec, under white r; what it is made of is tested with the loop."""
    experiment = build_experiment(spec)
    e = rng.standard_normal((samples, 2)) @ np.linalg.cholesky(experiment.model.covariance).T
    y, u = experiment.loop.signals(10.0 * rng.standard_normal((samples, 2)), e)
    return {"time_s": np.arange(samples), "u1": u[:, 0], "u2": u[:, 1], "y1": y[:, 0], "y2": y[:, 1]}


@pytest.mark.slow
def test_a_loop_is_identified_directly_and_topped_up(write):
    spec = load_spec("specs/two_by_two_loop.yaml", ["spectrum.order=4", "experiment.samples=1000"])
    data = write(recorded_in_loop(spec, 1000, np.random.default_rng(1)))
    outcome = identify(spec, data)
    model, found = build_model(spec), outcome.result["identification"]
    for name, true in zip(model.names, model.theta, strict=True):
        assert abs(found["theta"][name] - true) < 4.5 * found["standard_deviation"][name]
    assert found["fit_percent"][0] is None  # the plant alone is unstable there
    assessed = assess(spec, data)
    assert not assessed.met
    assert {"r1", "r2"} < set(assessed.results.tables["signal"].columns)
    after = assessed.results.result["information"]["standard_deviation"]
    assert all(after[name] < found["standard_deviation"][name] for name in model.names)


def test_the_files_hold_what_they_say(data):
    outcome = identify(load_spec(SPEC), data)
    columns = {name: np.asarray(values) for name, values in outcome.tables["fit"].columns.items()}
    model = build_model(load_spec(SPEC)).at(list(outcome.result["identification"]["theta"].values()))
    u = np.stack([columns["u1"], columns["u2"]], axis=1)
    residuals = np.stack([columns["residual_1"], columns["residual_2"]], axis=1)
    caused, noise = model.simulate(u, residuals, 1.0)
    for i in (1, 2):
        np.testing.assert_allclose(columns[f"y{i}_predicted"], columns[f"y{i}"] - columns[f"residual_{i}"])
        expected = caused[:, i - 1]
        np.testing.assert_allclose(columns[f"y{i}_simulated"], expected, atol=1e-8)
        off = np.linalg.norm(columns[f"y{i}"] - expected)
        share = 100 * (1 - off / np.linalg.norm(columns[f"y{i}"] - columns[f"y{i}"].mean()))
        assert outcome.result["identification"]["fit_percent"][i - 1] == pytest.approx(share)
    # What the estimate leaves unexplained, sent through its noise model, is the rest of the output.
    rest = np.stack([columns["y1"], columns["y2"]], axis=1) - caused
    np.testing.assert_allclose(noise, rest, atol=1e-8)
    assert {f"cross_correlation_{i}{j}" for i in (1, 2) for j in (1, 2)} < set(
        outcome.tables["residuals"].columns
    )
    assert {"r_u_12", "r_adm_12", "G_abs_21"} < set(outcome.tables["bound"].columns)


@pytest.mark.parametrize(
    ("change", "code", "named"),
    [
        (lambda c: {k: v for k, v in c.items() if k[0] != "y"}, "data-missing-column", "y1, y2"),
        (lambda c: {k: v[:6] for k, v in c.items()}, "too-few-samples", "6 samples"),
        (lambda c: {**c, "u2": np.ones(500)}, "constant-input", "u2"),
        (lambda c: {**c, "y1": np.ones(500)}, "constant-output", "y1"),
        (lambda c: {**c, "u2": 2.0 * c["u1"]}, "not-exciting", "b1[1,1]"),
    ],
)
def test_bad_records_are_refused(change, code, named, write):
    path = write(change(record(load_spec(SPEC))))
    with pytest.raises((SpecError, DataError)) as caught:
        identify(load_spec(SPEC), path)
    assert caught.value.diagnostics[0].code == code
    assert named in caught.value.diagnostics[0].message
