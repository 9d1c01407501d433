"""Plants in s under a digital controller, from spec to files: against polynomials and a plain program."""

import warnings

import cvxpy as cp
import numpy as np
import pytest
import scipy.signal
import scipy.stats

from inputdesign_cli import assess, identify, load_spec, parse_spec, solve
from inputdesign_cli.errors import SpecError
from inputdesign_cli.outcome.run_directory import write_run
from inputdesign_cli.questions.building.system import build_experiment
from inputdesign_cli.questions.least_cost.build import build_convex

MOTOR = "specs/motor_loop.yaml"
GAIN = np.array([[2.0, -0.5], [0.0, 1.2]])
DECAY = np.array([[1.0, 1.5], [0.8, 0.3]])
STEP = 0.4
REST = """
noise: {variance: [[1.0, 0.4], [0.4, 0.5]]}
experiment:
  samples: 500
  controller:
    numerator: [[[0.5, -0.4], [0.1]], [[0.0], [0.6, -0.5]]]
    denominator: [1, -1]
cost: {input_power: 1, output_power: [0.1, 0.2], excitation_power: 0.01}
accuracy: {model_error: {relative: 0.1, alpha: 3}}
spectrum: {type: fir, order: 1}
"""


def rows(matrix):
    return np.asarray(matrix).tolist()


HELD = f"""
sample_time: {STEP}
plant:
  continuous:
    numerator: {rows(GAIN[..., None])}
    denominator: {rows(np.stack([np.ones((2, 2)), DECAY], axis=-1))}
  sample: zoh
{REST}"""
FORGOTTEN = np.exp(-DECAY * STEP)
POLYNOMIAL = f"""
sample_time: {STEP}
plant:
  B: {rows(np.stack([np.zeros((2, 2)), GAIN / DECAY * (1 - FORGOTTEN)], axis=-1))}
  F: {rows(np.stack([np.ones((2, 2)), -FORGOTTEN], axis=-1))}
{REST}"""


def designed(text, *overrides):
    spec = parse_spec(text, overrides=[*overrides, "solver.any_spectrum=false"])
    return build_convex(spec).designed().design.result


@pytest.mark.first(1)
@pytest.mark.parametrize(
    "overrides",
    [
        ("spectrum={type: multisine, lines: 5}", "cost={output_power: 1}", "limits={input_power: 77.5}"),
        ("accuracy={model_error: {sensitivity: {max_db: 6}}}",),
    ],
)
def test_what_does_not_depend_on_coordinates_is_that_of_polynomials(overrides):
    """r_u is that of the model, whichever way first-order entries are parametrised."""
    held, polynomial = designed(HELD, *overrides), designed(POLYNOMIAL, *overrides)
    assert held.gap < 1e-6
    assert held.objective == pytest.approx(polynomial.objective, rel=2e-6)
    assert held.information.shape == (6, 6)


def motor(theta, w):
    """G of the motor at theta = (b0, a0, a1), by scipy."""
    top, bottom, _ = scipy.signal.cont2discrete(([theta[0]], [1, theta[2], theta[1]]), 0.05, "zoh")
    return scipy.signal.freqz(top[0], bottom, w)[1]


@pytest.mark.slow
def test_the_motor_against_a_plain_program():
    """The least cost of r of order 3: relative parameters, sums over a circle, LMIs at 180 frequencies."""
    spec = load_spec(MOTOR, ["spectrum.order=3"])
    found = build_convex(spec).designed().design.result
    theta, samples, variance, order = np.array([2.0, 20.02, 12.0]), 600, 2.5e-5, 3

    def gradient(w):
        steps = 1e-5 * np.diag(theta)
        return np.array([(motor(theta + h, w) - motor(theta - h, w)) / 2e-5 for h in steps])

    def controller(w):
        return (40 - 36.2 * np.exp(-1j * w)) / (1 - np.exp(-1j * w))

    w = (np.arange(8192) + 0.5) * 2 * np.pi / 8192  # beside the integrator
    G, C, D = motor(theta, w), controller(w), gradient(w)
    S = 1 / (1 + C * G)
    cosines = np.array([np.ones(w.size)] + [2 * np.cos(k * w) for k in range(1, order + 1)])
    price = cosines @ (np.abs(S) ** 2 * (1 + 1000 * np.abs(G) ** 2)) / w.size
    noise = samples / w.size * ((D * C * S) @ (D * C * S).conj().T).real
    maps = [samples / variance / w.size * ((D * S * c) @ (D * S).conj().T).real for c in cosines]
    at = np.concatenate(
        [np.geomspace(1e-3, np.pi, 60), np.linspace(0.2, 0.9, 60), np.linspace(0.465, 0.478, 60)]
    )
    r_adm = (np.abs(1 + controller(at) * motor(theta, at)) - 10 ** (-5 / 20)) / np.abs(controller(at))
    T = gradient(at) * np.sqrt(scipy.stats.chi2.ppf(0.95, 3)) / r_adm
    x = cp.Variable(order + 1)
    scale = np.sqrt(np.diag(maps[0]))
    M = (noise + sum(x[k] * maps[k] for k in range(order + 1))) / np.outer(scale, scale)
    grid = np.linspace(0, np.pi, 500)
    constraints = [1 * x[0] + sum(2 * np.cos(k * grid) * x[k] for k in range(1, order + 1)) >= 0]
    for column in T.T:
        R = np.stack([column.real, column.imag]) / scale
        constraints.append((M + M.T) / 2 - R.T @ R >> 0)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        expected = cp.Problem(cp.Minimize(price @ x), constraints).solve(solver=cp.CLARABEL)
    assert found.objective == pytest.approx(expected, rel=2e-5)


def test_what_a_design_writes_is_what_an_analysis_reads(tmp_path):
    """The powers and the accuracy of spectrum.csv, and of signal.csv, as given excitations."""
    spec = load_spec(MOTOR, ["signal.scale=design", "spectrum.order=4", "signal.candidates=1"])
    outcome = solve(spec)
    write_run(outcome, tmp_path)
    result = outcome.result
    given = f"spectrum={{given: {{type: table, file: {tmp_path / 'spectrum.csv'}}}}}"
    table = solve(parse_spec(spec.to_yaml(), overrides=[given])).result
    for kind in ("input", "output", "excitation"):
        np.testing.assert_allclose(table["power"][kind], result["power"][kind], rtol=1e-4)
    given = f"spectrum={{given: {{signal: {tmp_path / 'signal.csv'}}}}}"
    signal = solve(parse_spec(spec.to_yaml(), overrides=[given])).result
    for kind in ("input", "output"):
        np.testing.assert_allclose(signal["power"][kind], result["signal"][f"{kind}_power"], rtol=1e-9)
    assert list(outcome.tables["signal"].columns) == ["time_s", "r1"]


def test_a_limit_on_the_output_holds_for_the_record():
    """What the record causes is had from the loop, sample by sample."""
    spec = load_spec(MOTOR, ["limits.amplitude.output=0.02", "spectrum.order=5", "signal.candidates=2"])
    outcome = solve(spec)
    r = np.asarray(outcome.tables["signal"].columns["r1"])[:, None]
    y, u = build_experiment(spec).loop.signals(r, np.zeros_like(r))
    assert np.abs(y).max() <= 0.02 * (1 + 1e-9)
    entry = outcome.result["signal"]
    assert entry["output_peak"][0] == pytest.approx(np.abs(y).max(), rel=1e-9)
    assert entry["input_power"][0] == pytest.approx(np.mean(u**2), rel=1e-9)
    assert entry["worst_ratio"] <= 1 + 1e-6


def recorded(spec, samples, rng, path):
    """u and y of the loop of a spec, under white r; what it is made of is tested with the loop."""
    experiment = build_experiment(spec)
    model = experiment.model
    e = rng.standard_normal((samples, model.outputs)) @ np.linalg.cholesky(model.covariance).T
    y, u = experiment.loop.signals(rng.standard_normal((samples, model.inputs)), e)
    names = [f"u{i + 1}" for i in range(model.inputs)] + [f"y{i + 1}" for i in range(model.outputs)]
    np.savetxt(path, np.column_stack([u, y]), delimiter=",", header=",".join(names), comments="")
    return path


@pytest.mark.first(1)
@pytest.mark.parametrize("text", [None, HELD])
def test_a_loop_is_identified_directly_and_topped_up(text, tmp_path):
    spec = load_spec(MOTOR) if text is None else parse_spec(text)
    data = recorded(spec, 1500, np.random.default_rng(1), tmp_path / "d.csv")
    outcome = identify(spec, data)
    model, found = build_experiment(spec).model, outcome.result["identification"]
    for name, true in zip(model.names, model.theta, strict=True):
        assert abs(found["theta"][name] - true) < 4.5 * found["standard_deviation"][name]
    assert "notes" not in outcome.result  # u(t) answers e(t), which is no fault of the model
    if model.outputs > 1:
        return
    loose = "accuracy={model_error: {relative: 5}}"
    assert assess(parse_spec(spec.to_yaml(), overrides=[loose]), data).met
    strict = "accuracy={model_error: {relative: 0.02}}"
    more = assess(parse_spec(spec.to_yaml(), overrides=[strict, "spectrum.order=2"]), data)
    assert not more.met
    after = more.results.result["information"]["standard_deviation"]
    assert all(after[name] < found["standard_deviation"][name] for name in model.names)


def test_frequencies_of_complaints_are_in_the_unit_of_the_spec():
    """The nominal loop peaks at 4.35 dB, at 9.54 rad/s."""
    with pytest.raises(SpecError, match=r"9\.54\d* rad/s"):
        build_convex(load_spec(MOTOR, ["accuracy.model_error.sensitivity.max_db=4"]))
