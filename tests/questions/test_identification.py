"""Estimates from records: written models reproduce them, and records without information are refused."""

import numpy as np
import pytest
import scipy.signal
import yaml

from inputdesign_cli import assess, identify, load_spec, parse_spec, solve, validate
from inputdesign_cli.errors import DataError, SpecError
from inputdesign_cli.questions.building.system import build_experiment, build_model
from tests.support.matrix_specs import JENKINS
from tests.support.records import simulated

SPEC = "specs/first_order.yaml"
ARX = "specs/two_by_two_arx.yaml"
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
COMMON = IN_S.replace("DENOMINATOR", "[1, 1.5, 1.5]")
EACH = IN_S.replace("DENOMINATOR", "[[[1, 1.5, 1.5], [1, 2, 1]], [[1, 0.5, 1], [1, 1, 0.3]]]")
HELD = ["plant.sample=zoh"]


def table(u, y, step=1.0):
    """Columns of a record u (n, r), y (n, p)."""
    columns = {"time_s": step * np.arange(float(len(u)))}
    for letter, x in (("u", u), ("y", y)):
        columns |= {f"{letter}{i + 1}": column for i, column in enumerate(x.T)}
    return columns


def record(spec, samples=500, seed=0, power=1.0):
    """Columns of an experiment with white inputs on the plant of a spec."""
    u, y = simulated(build_model(spec), samples, np.random.default_rng(seed), power=power)
    return table(u[0], y[0])


def recorded_in_s(spec, samples, seed):
    """Columns for a plant in s with held or band-limited white inputs, by scipy's simulation."""
    rng, matrix, hold = np.random.default_rng(seed), spec.plant.continuous, spec.plant.sample == "zoh"
    step, finer = spec.sample_time, 1 if hold else 40
    u = rng.standard_normal((samples, 2))
    driven = u if hold else scipy.signal.resample(np.concatenate([u, 0 * u]), 2 * samples * finer)
    y = rng.standard_normal((samples, 2)) @ np.linalg.cholesky(spec.noise.covariance(2)).T
    for i, j in np.ndindex(2, 2):
        system = matrix.numerator_matrix[i][j], matrix.denominator_matrix[i][j]
        at = step / finer * np.arange(len(driven))
        _, found, _ = scipy.signal.lsim(system, driven[:, j], at, interp=not hold)
        y[:, i] += found[: samples * finer : finer]
    return table(u, y, step)


def recorded_in_loop(spec, samples, power):
    """u and y of the loop of a spec under white r; other tests check the loop itself."""
    experiment, rng = build_experiment(spec), np.random.default_rng(1)
    model = experiment.model
    e = rng.standard_normal((samples, model.outputs)) @ np.linalg.cholesky(model.covariance).T
    y, u = experiment.loop.signals(np.sqrt(power) * rng.standard_normal((samples, model.inputs)), e)
    return table(u, y, spec.sample_time)


def codes(results):
    return {one.code: one for one in results.outcome.findings or ()}


def check_truth(found, model, deviations=4.5):
    """Asserts that the estimate is within some standard deviations of this model."""
    for name, true in zip(model.names, model.theta, strict=True):
        assert abs(found["theta"][name] - true) < deviations * found["standard_deviation"][name]


@pytest.fixture
def data(write):
    return write(record(load_spec(SPEC)))


PASTED = {
    "one channel": (load_spec(SPEC), lambda spec: record(spec, 1000)),
    "two channels": (load_spec(ARX, ["spectrum.order=4"]), lambda spec: record(spec, 1000)),
    "jenkins": (parse_spec(JENKINS), lambda spec: record(spec, 1000)),
    "held": (parse_spec(EACH, overrides=HELD), lambda spec: recorded_in_s(spec, 1500, 2)),
    "in s": (parse_spec(COMMON), lambda spec: recorded_in_s(spec, 1500, 2)),
}


@pytest.mark.first(2)
@pytest.mark.parametrize("name", PASTED)
def test_the_blocks_of_model_yaml_give_a_spec_with_the_estimated_model(name, write):
    """The estimate is near the true model, and the spec with the blocks has it as its plant and is valid."""
    spec, made = PASTED[name]
    model = build_model(spec)
    outcome = identify(spec, write(made(spec)))
    found = outcome.result["identification"]
    check_truth(found, model)
    np.testing.assert_allclose(found["variance"], model.covariance, atol=0.15 * model.covariance.max())
    pasted = yaml.safe_load(outcome.files["model.yaml"].decode())
    again = parse_spec(yaml.safe_dump({**yaml.safe_load(spec.to_yaml()), **pasted}))
    validate(again)
    assert build_model(again).names == model.names
    np.testing.assert_allclose(build_model(again).theta, list(found["theta"].values()))
    assert pasted["estimate"]["parameters"] == found["theta"]
    information = outcome.result["information"]
    np.testing.assert_allclose(pasted["estimate"]["covariance"], information["covariance"])
    product = np.array(information["matrix"]) @ information["covariance"]
    np.testing.assert_allclose(product, np.eye(len(product)), atol=1e-6)


def test_a_top_up_just_meets_the_accuracy_that_the_data_miss(write):
    """It is cheaper than an experiment from scratch for the same model."""
    spec = load_spec(SPEC, ["spectrum.order=5", "accuracy.model_error={relative: 0.03, alpha: 2.45}"])
    short = assess(spec, write(record(spec, seed=2, power=0.09)))
    assert not short.met
    result = short.results.result
    assert result["assessment"]["requirements"][0]["worst_ratio"] > 1
    assert result["model_error"]["worst_ratio"] == pytest.approx(1.0, abs=1e-6)
    pasted = yaml.safe_load(short.results.files["model.yaml"].decode())
    scratch = solve(parse_spec(yaml.safe_dump({**yaml.safe_load(spec.to_yaml()), **pasted})))
    assert result["cost"] < scratch.result["cost"]


@pytest.mark.slow
@pytest.mark.parametrize(("relative", "enough"), [(2.0, True), (0.1, False)])
def test_assess_gives_met_or_missed_for_a_plant_in_continuous_time(relative, enough, write):
    spec = parse_spec(COMMON, overrides=[*HELD, f"accuracy.model_error.relative={relative}"])
    found = assess(spec, write(recorded_in_s(spec, 500, 1)))
    assert found.met == enough
    if not enough:
        assert found.results.result["requirements"][0]["worst_ratio"] == pytest.approx(1.0, abs=1e-6)


@pytest.mark.slow
def test_a_held_input_in_a_band_limited_model_is_reported(write):
    held = recorded_in_s(parse_spec(EACH, overrides=HELD), 1500, 1)
    assert "input-taken-as-band-limited" in codes(identify(parse_spec(EACH), write(held)))


LOOPS = {
    "motor": (
        "specs/motor_loop.yaml",
        1500,
        1.0,
        ["spectrum.order=2", "accuracy={model_error: {relative: 0.02}}"],
    ),
    "two": ("specs/two_by_two_loop.yaml", 1000, 100.0, ["spectrum.order=4", "experiment.samples=1000"]),
}


@pytest.mark.first(1)
@pytest.mark.parametrize("name", LOOPS)
def test_a_loop_is_identified_directly_and_topped_up(name, write):
    """u(t) depends on e(t), which fails no test of the model; the plant alone may be unstable."""
    path, samples, power, overrides = LOOPS[name]
    spec = load_spec(path, overrides)
    data = write(recorded_in_loop(spec, samples, power))
    assessed = assess(spec, data)
    found = assessed.results.result["identification"]
    check_truth(found, build_experiment(spec).model)
    assert found["failed"] == []
    assert (np.atleast_1d(found["fit_percent"])[0] is None) == (name == "two")
    assert not assessed.met
    assert "r1" in assessed.results.tables["signal"].columns
    after = assessed.results.result["information"]["standard_deviation"]
    assert all(after[name] < deviation for name, deviation in found["standard_deviation"].items())
    if name == "motor":
        assert assess(load_spec(path, ["accuracy={model_error: {relative: 5}}"]), data).met


def test_written_predictions_simulations_and_residuals_agree_with_the_model(write):
    outcome = identify(load_spec(ARX), write(record(load_spec(ARX))))
    columns = {name: np.asarray(values) for name, values in outcome.tables["fit"].columns.items()}
    model = build_model(load_spec(ARX)).at(list(outcome.result["identification"]["theta"].values()))
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
    # The residuals through the noise model are the output minus the simulation.
    rest = np.stack([columns["y1"], columns["y2"]], axis=1) - caused
    np.testing.assert_allclose(noise, rest, atol=1e-8)
    assert {f"cross_correlation_{i}{j}" for i in (1, 2) for j in (1, 2)} < set(
        outcome.tables["residuals"].columns
    )
    assert {"r_u_12", "r_adm_12", "G_abs_21"} < set(outcome.tables["bound"].columns)


@pytest.mark.slow
def test_offsets_and_outliers_are_reported(write):
    columns = record(load_spec(SPEC), seed=3)
    columns["y1"] = columns["y1"] + 100.0
    columns["u1"][40] = 60.0
    outcome = identify(load_spec(SPEC), write(columns))
    assert "row 42" in " ".join(outcome.result["notes"])
    first = codes(outcome)["start-estimated"].figures["first_residual"]
    assert first == pytest.approx(columns["y1"][0], rel=1e-2)
    known = identify(load_spec(SPEC), write(columns), operating_point={"y1": 100.0})
    assert not known.result["identification"]["free_start"]


@pytest.mark.first(1)
@pytest.mark.parametrize(("samples", "before", "zero"), [(150, 1000, 0.93), (50, 0, 0.9)])
@pytest.mark.parametrize("seed", [2, 3])
def test_noise_from_before_the_record_is_not_taken_for_a_start_in_motion(write, seed, samples, before, zero):
    """A zero of C has effects beyond the first tenth of a record; the plant was at rest.

    The estimate of C does not reach the unit circle, where such effects would never fade.
    """
    u, e = np.random.default_rng(seed).standard_normal((2, before + samples))
    u = 0.3 * u if before == 0 else u
    y = scipy.signal.lfilter([0, 3.6], [1, -0.7], np.where(np.arange(u.size) < before, 0.0, u))
    y = (y + scipy.signal.lfilter([1, -zero], [1], e))[before:]
    columns = table(u[before:, None], y[:, None])
    found = identify(load_spec(SPEC), write(columns))
    assert not found.result["identification"]["free_start"]
    assert abs(found.result["identification"]["theta"]["c1"]) < 1 - 1 / samples
    assert "start-estimated" not in codes(found)
    if before == 0:  # a first residual of many deviations is reported
        columns["y1"] = columns["y1"] + 100.0
        start = codes(identify(load_spec(SPEC), write(columns)))["start-estimated"]
        assert abs(start.figures["first_residual"]) > 3.0 * start.figures["noise"]


@pytest.mark.parametrize("others", [(), pytest.param((False, True), marks=pytest.mark.slow)])
def test_an_operating_point_does_not_move_the_estimate(write, others):
    """A known point, an unknown one and removed means give the same model within a standard deviation."""
    columns = record(load_spec(SPEC), seed=3)
    plain = identify(load_spec(SPEC), write(columns)).result["identification"]
    gain = 3.6 / 0.3
    moved = {**columns, "u1": columns["u1"] + 40.0, "y1": columns["y1"] + 52.3}
    spec = load_spec(SPEC, ["signal.offset=40"])
    ways = [
        identify(spec, write(moved), operating_point={"y1": 52.3}),
        identify(spec, write({**moved, "y1": moved["y1"] + 40.0 * gain})),
        *(identify(load_spec(SPEC), write(moved), remove_means=removed) for removed in others),
    ]
    for n, found in enumerate(way.result["identification"] for way in ways):
        for name, value in plain["theta"].items():
            assert abs(found["theta"][name] - value) < plain["standard_deviation"][name], (n, name)
    assert ways[0].result["identification"]["theta"] == pytest.approx(plain["theta"], rel=1e-6)


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
    path = write(change(record(load_spec(ARX))))
    with pytest.raises((SpecError, DataError)) as caught:
        identify(load_spec(ARX), path)
    assert caught.value.diagnostics[0].code == code
    assert named in caught.value.diagnostics[0].message


def test_an_unknown_channel_is_refused(data):
    with pytest.raises(SpecError) as caught:
        identify(load_spec(SPEC), data, operating_point={"u2": 1.0})
    assert caught.value.diagnostics[0].code == "unknown-channel"


@pytest.mark.parametrize("plant", ["{B: [0, 0.5], F: [1, -0.8]}", "{A: [1, -0.8], B: [0, 0.5]}"])
@pytest.mark.parametrize("first", [[1.0], [1.0, 0.5], None])
@pytest.mark.parametrize("samples", [20, 200])
def test_an_output_without_noise_is_refused(samples, first, plant, write):
    """The start or the input explains the output to the last digit, so the variance of the noise is zero."""
    spec = parse_spec(f"plant: {plant}\nnoise: {{variance: 1}}\nexperiment: {{samples: 200}}\n", design=False)
    u, y = np.eye(1, samples)[0], np.zeros(samples)
    if first is None:
        u = np.random.default_rng(4).standard_normal(samples)
        y = scipy.signal.lfilter([0, 0.5], [1, -0.8], u)
    else:
        y[: len(first)] = first
    with pytest.raises(DataError) as caught:
        identify(spec, write({"u1": u, "y1": y}))
    assert caught.value.diagnostics[0].code == "noise-free-data"


def test_assess_without_an_accuracy_to_meet_is_refused(data):
    spec = load_spec(SPEC, ["accuracy={criterion: D}", "limits={input_power: 1}"])
    with pytest.raises(SpecError) as caught:
        assess(spec, data)
    assert caught.value.diagnostics[0].code == "nothing-to-assess"
