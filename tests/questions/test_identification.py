import numpy as np
import pytest
import scipy.signal
import yaml

from inputdesign_cli import assess, identify, load_spec, parse_spec, solve
from inputdesign_cli.errors import DataError, SpecError

SPEC = "specs/first_order.yaml"
EASY = ["spectrum.order=5", "accuracy.model_error={relative: 0.03, alpha: 2.45}"]


def record(u, seed=0):
    """The system of the first-order spec."""
    e = np.random.default_rng(seed).standard_normal(u.size)
    y = scipy.signal.lfilter([0, 3.6], [1, -0.7], u) + scipy.signal.lfilter([1, -0.9], [1], e)
    return {"time_s": np.arange(u.size, dtype=float), "u1": u, "y1": y}


@pytest.fixture
def data(write):
    u = np.random.default_rng(1).standard_normal(500)
    return write(record(u))


def test_the_blocks_can_be_pasted(data):
    outcome = identify(load_spec(SPEC), data)
    theta = outcome.result["identification"]["theta"]
    assert is_true(outcome.result["identification"], (("b1", 3.6), ("c1", -0.9), ("f1", -0.7)))
    pasted = yaml.safe_load(outcome.files["model.yaml"].decode())
    assert pasted["plant"] == {"B": [0.0, theta["b1"]], "F": [1.0, theta["f1"]]}
    content = {**yaml.safe_load(load_spec(SPEC).to_yaml()), **pasted}
    assert solve(parse_spec(yaml.safe_dump(content))).result["status"] == "optimal"
    assert pasted["estimate"]["parameters"] == theta
    covariance = np.array(pasted["estimate"]["covariance"])
    np.testing.assert_allclose(np.linalg.inv(covariance), outcome.result["information"]["matrix"], rtol=1e-9)


SPIKED = """
plant: {B: [0, 0.5], F: [1, -0.7]}
noise: {variance: 0.01}
experiment: {samples: 500}
accuracy: {model_error: {relative: 0.1}}
"""


def spiked(size):
    """Return u and y of the plant above with spikes of this size, in samples 100, 301 and 400."""
    rng = np.random.default_rng(1)
    u = rng.standard_normal(500)
    y = scipy.signal.lfilter([0, 0.5], [1, -0.7], u) + 0.1 * rng.standard_normal(500)
    y[[100, 301, 400]] += [size, -size, 1.5 * size]
    return u, y


def is_true(found, truth=(("b1", 0.5), ("f1", -0.7))):
    """Whether an estimate is one of the plant above."""
    return all(abs(found["theta"][k] - true) < 4 * found["standard_deviation"][k] for k, true in truth)


def test_spikes_leave_the_verdict_open_until_they_are_taken_out(write):
    u, y = spiked(3.0)
    judged = assess(parse_spec(SPIKED), write({"u1": u, "y1": y}))
    assert judged.verdict == "undecided"
    (spikes,) = [one for one in judged.results.outcome.findings if one.code == "spikes"]
    assert spikes.figures["times"] == [100.0, 301.0, 400.0]
    assert judged.results.outcome.assessment.causes == ("contradicted",)
    y[[100, 301, 400]] = np.nan
    mended = assess(parse_spec(SPIKED), write({"u1": u, "y1": y}))
    assert mended.verdict == "met"
    assert is_true(mended.results.result["identification"])


def test_spikes_far_beyond_the_signal_are_replaced_and_said(write):
    u, y = spiked(1e6)
    judged = assess(parse_spec(SPIKED), write({"u1": u, "y1": y}))
    (replaced,) = [one for one in judged.results.outcome.findings if one.code == "spikes-replaced"]
    assert replaced.figures["rows"] == [102, 303, 402]
    assert judged.verdict == "met"
    assert is_true(judged.results.result["identification"])


def test_a_top_up_makes_up_for_what_is_missing(write):
    u = 0.3 * np.random.default_rng(2).standard_normal(500)
    columns = record(u)
    path = write(columns)
    spec = load_spec(SPEC, EASY)
    short = assess(spec, path)
    assert not short.met
    result = short.results.result
    assert result["assessment"]["requirements"][0]["worst_ratio"] > 1
    assert result["model_error"]["worst_ratio"] == pytest.approx(1.0, abs=1e-6)
    # Cheaper than the experiment from scratch on the same model.
    pasted = yaml.safe_load(short.results.files["model.yaml"].decode())
    scratch = solve(parse_spec(yaml.safe_dump({**yaml.safe_load(spec.to_yaml()), **pasted})))
    assert result["cost"] < scratch.result["cost"]


@pytest.mark.slow
def test_offsets_and_outliers_are_told(write):
    columns = record(np.random.default_rng(3).standard_normal(500))
    columns["y1"] = columns["y1"] + 100.0
    columns["u1"][40] = 60.0
    outcome = identify(load_spec(SPEC), write(columns))
    assert "row 42" in " ".join(outcome.result["notes"])
    (start,) = [one for one in outcome.outcome.findings if one.code == "start-estimated"]
    assert start.figures["first_residual"] == pytest.approx(columns["y1"][0], rel=1e-2)
    known = identify(load_spec(SPEC), write(columns), operating_point={"y1": 100.0})
    assert not known.result["identification"]["free_start"]


@pytest.mark.slow
@pytest.mark.parametrize("seed", [0, 2])
def test_a_short_pilot_from_rest_is_not_said_to_begin_otherwise(write, seed):
    """Nor does its estimate of C run to the unit circle, which would remember for ever what was before it."""
    columns = record(0.3 * np.random.default_rng(seed).standard_normal(50), seed=seed + 10)
    result = identify(load_spec(SPEC), write(columns)).result
    assert not result["identification"]["free_start"]
    assert abs(result["identification"]["theta"]["c1"]) < 1 - 1 / 50
    assert "start-estimated" not in {one["code"] for one in result.get("findings", [])}
    # Where the first residual leaves no doubt it is said.
    columns["y1"] = columns["y1"] + 100.0
    told = identify(load_spec(SPEC), write(columns)).outcome.findings
    (start,) = [one for one in told if one.code == "start-estimated"]
    assert abs(start.figures["first_residual"]) > 3.0 * start.figures["noise"]


@pytest.mark.first(1)
@pytest.mark.parametrize("seed", [2, 3])
def test_noise_from_before_the_record_is_no_start_in_motion(write, seed):
    """A zero of C at 0.93 is remembered beyond the first tenth of 150 samples; the plant was at rest."""
    u, e = np.random.default_rng(seed).standard_normal((2, 1150))
    y = scipy.signal.lfilter([0, 3.6], [1, -0.7], np.where(np.arange(1150) < 1000, 0.0, u))
    y = (y + scipy.signal.lfilter([1, -0.93], [1], e))[1000:]
    result = identify(load_spec(SPEC), write({"time_s": np.arange(150.0), "u1": u[1000:], "y1": y})).result
    assert not result["identification"]["free_start"]
    assert abs(result["identification"]["theta"]["c1"]) < 1 - 1 / 150
    assert "start-estimated" not in {one["code"] for one in result.get("findings", [])}


@pytest.mark.parametrize("others", [(), pytest.param((False, True), marks=pytest.mark.slow)])
def test_an_operating_point_does_not_move_the_estimate(write, others):
    """Known, unknown, or its means removed: the same model, within a standard deviation."""
    columns = record(np.random.default_rng(3).standard_normal(500))
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
    ("change", "code"),
    [
        (lambda c: {k: v[:5] for k, v in c.items()}, "too-few-samples"),
        (lambda c: {**c, "u1": np.ones(500)}, "constant-input"),
        (lambda c: {**c, "y1": scipy.signal.lfilter([0, 3.6], [1, -0.7], c["u1"])}, "noise-free-data"),
    ],
)
def test_bad_records_are_refused(change, code, write):
    columns = change(record(np.random.default_rng(4).standard_normal(500)))
    path = write(columns)
    with pytest.raises((SpecError, DataError)) as caught:
        identify(load_spec(SPEC, ["noise={variance: 1}"]), path)
    assert caught.value.diagnostics[0].code == code


def test_an_unknown_channel_is_refused(data):
    with pytest.raises(SpecError) as caught:
        identify(load_spec(SPEC), data, operating_point={"u2": 1.0})
    assert caught.value.diagnostics[0].code == "unknown-channel"


@pytest.mark.parametrize("plant", ["{B: [0, 0.5], F: [1, -0.8]}", "{A: [1, -0.8], B: [0, 0.5]}"])
@pytest.mark.parametrize("first", [[1.0], [1.0, 0.5]])
@pytest.mark.parametrize("samples", [20, 40, 200])
def test_an_output_that_the_start_alone_explains_has_no_noise(samples, first, plant, write):
    """To the last digit: nothing is left to gain, and nothing to divide by."""
    spec = parse_spec(f"plant: {plant}\nnoise: {{variance: 1}}\nexperiment: {{samples: 200}}\n", design=False)
    pulse, y = np.eye(1, samples)[0], np.zeros(samples)
    y[: len(first)] = first
    with pytest.raises(DataError) as caught:
        identify(spec, write({"u1": pulse, "y1": y}))
    assert caught.value.diagnostics[0].code == "noise-free-data"


def test_data_of_another_structure_are_told(data):
    outcome = identify(load_spec(SPEC, ["plant={B: [0, 1]}", "noise={variance: 1}"]), data)
    assert "plant-structure" in {one.code for one in outcome.outcome.findings}


def test_there_must_be_a_target(data):
    spec = load_spec(SPEC, ["accuracy={criterion: D}", "limits={input_power: 1}"])
    with pytest.raises(SpecError) as caught:
        assess(spec, data)
    assert caught.value.diagnostics[0].code == "nothing-to-assess"
