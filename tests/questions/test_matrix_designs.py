"""Designs of several channels, in continuous time and in loops: written files, single channels, units."""

import warnings
from pathlib import Path

import cvxpy as cp
import numpy as np
import pytest
import scipy.integrate

from inputdesign_cli import load_spec, solve
from inputdesign_cli.questions.building.system import build_experiment
from inputdesign_cli.questions.least_cost.build import build_convex
from inputdesign_cli.specification import parse_spec
from tests.support.matrix_specs import ARX, CONTINUOUS, IN_LOOP, changed

SPECS = Path(__file__).parents[2] / "specs"


@pytest.fixture(scope="module")
def design():
    return solve(load_spec(SPECS / "two_by_two.yaml", ["accuracy.criterion=E", "spectrum.order=6"]))


def test_spectrum_file_has_the_information_of_the_result(design):
    """M recomputed from the columns of spectrum.csv by the trapezoidal rule."""
    columns = design.tables["spectrum"].columns
    w = columns["frequency_rad_per_s"]
    phi = np.array(
        [
            [columns["phi_11"], columns["phi_12_re"] + 1j * columns["phi_12_im"]],
            [columns["phi_12_re"] - 1j * columns["phi_12_im"], columns["phi_22"]],
        ]
    ).transpose(2, 0, 1)
    assert np.linalg.eigvalsh(phi).min() >= -1e-9 * phi.real.max()
    spec = load_spec(SPECS / "two_by_two.yaml")
    model = build_convex(spec).simulation.nominal.model
    F = model.plant_gradient(w)
    integrand = np.einsum("nlpa,nab,nmpb->nlm", F, phi, F.conj(), optimize=True).real / np.pi
    M = scipy.integrate.trapezoid(integrand, w, axis=0)
    expected = np.array(design.result["information"]["matrix"])
    np.testing.assert_allclose(M, expected, atol=2e-3 * np.abs(expected).max())
    total = np.trace(phi, axis1=1, axis2=2).real / np.pi
    power = scipy.integrate.trapezoid(total, w)
    assert power == pytest.approx(sum(design.result["power"]["input"]), rel=0.05)


def test_record_has_two_channels_and_keeps_the_smallest_eigenvalue(design):
    assert list(design.tables["signal"].columns) == ["time_s", "u1", "u2"]
    signal = design.result["signal"]
    assert signal["efficiency"] >= 0.97
    assert sum(signal["input_power"]) <= 1.02 * 1000
    assert sum(signal["output_power"]) <= 1.02 * 1000
    asked = ["accuracy.criterion=E", "spectrum.order=6", "signal.phases=random", "signal.candidates=1"]
    random = solve(load_spec(SPECS / "two_by_two.yaml", [*asked, "solver.any_spectrum=false"]))
    assert random.result["signal"]["efficiency"] < signal["efficiency"]


@pytest.mark.slow
def test_a_spectral_factor_of_one_column_has_a_lower_value_and_the_same_bound():
    full = solve(changed(CONTINUOUS)).result["objective"]
    few = solve(changed(CONTINUOUS, "spectrum.factor_columns=1")).result
    assert few["objective"]["value"] < full["value"]
    assert few["objective"]["upper_bound"] == pytest.approx(full["upper_bound"], rel=1e-9)
    assert few["status"] == "lower_bound"
    assert few["spectrum"]["factor_columns"] == 1


def test_limits_of_each_channel_bind():
    result = solve(changed(CONTINUOUS, "limits={input_power: [100, 20]}", "accuracy.criterion=D")).result
    np.testing.assert_allclose(result["power"]["input"], [100.0, 20.0], rtol=1e-6)
    assert [entry["channel"] for entry in result["limits"]] == [1, 2]


@pytest.mark.first(3)
@pytest.mark.parametrize(
    "overrides",
    [
        pytest.param(["spectrum={type: multisine, lines: 30}"], marks=pytest.mark.slow),
        ["spectrum={type: free}"],
        pytest.param(["spectrum={type: white}"], marks=pytest.mark.slow),
        ["spectrum={type: polynomial, order: 3, band: [0.2, 2.5], coefficients: complex}"],
        pytest.param(["plant.A=[1, -0.6]"], marks=pytest.mark.slow),
        ["objective=shortest_experiment", "limits.input_power=100"],
        ["accuracy={standard_deviation: {'b1[2,1]': 0.05}}"],
        pytest.param(["cost.input_power=[1, 2]"], marks=pytest.mark.slow),
        ["accuracy={weighted_variance: {max: 0.01, weight: {numerator: [1, 0.5]}}}"],
    ],
)
def test_least_cost_has_a_proved_gap_for_all_spectra_and_requirements(overrides):
    common = ["spectrum.order=4"] if not overrides[0].startswith("spectrum") else []
    result = solve(load_spec(SPECS / "two_by_two_arx.yaml", [*common, *overrides])).result
    assert result["objective"]["relative_gap"] <= 1e-5
    assert result["objective"]["any_spectrum_bound"] <= result["objective"]["value"] * (1 + 1e-6)


def test_weighted_variance_in_continuous_time_holds_for_every_entry():
    weight = "{continuous: {numerator: [1], denominator: [1, 1]}}"
    asked = f"accuracy={{weighted_variance: {{max: 0.01, weight: {weight}}}}}"
    spec = changed(CONTINUOUS, asked, "limits=null", "spectrum.order=2", "solver.any_spectrum=false")
    result = solve(spec).result
    assert result["objective"]["relative_gap"] <= 1e-6
    P = np.array(result["information"]["covariance"])
    w = np.linspace(0.0, 2.0, 500)
    gradient = build_convex(spec).simulation.nominal.model.plant_gradient(w)
    variance = np.einsum("nkij,kl,nlij->nij", gradient.conj(), P, gradient).real / (1 + w**2)[:, None, None]
    assert variance.max() == pytest.approx(0.01, rel=1e-4)


GAINS = ARX + "accuracy: {model_error: {relative: 0.1}}\n"


# u2 in thousandths: its coefficients are a thousand times smaller, its power 1e6 times larger.
MILLI = "plant.B=[[[0, 1.0, 0.4], [0, -0.0005, 0.0003]], [[0, 0.6, 0.2], [0, 0.0012, -0.0005]]]"


@pytest.mark.first(1)
@pytest.mark.parametrize("spectrum", ["{type: fir, order: 4}", "{type: free}"])
@pytest.mark.parametrize(
    ("asked", "same"),
    [
        (["cost={input_power: [1, 1]}"], ["cost={input_power: [1, 1.0e-6]}"]),
        (
            ["limits={input_power: [2, 1]}", "objective=best_accuracy"],
            ["limits={input_power: [2, 1.0e6]}", "objective=best_accuracy"],
        ),
        (
            ["limits={input_power: [2, 1]}", "objective=shortest_experiment"],
            ["limits={input_power: [2, 1.0e6]}", "objective=shortest_experiment"],
        ),
    ],
)
def test_the_units_of_the_inputs_do_not_matter(spectrum, asked, same):
    found = []
    for overrides in (asked, [*same, MILLI]):
        spec = changed(GAINS, f"spectrum={spectrum}", *overrides)
        found.append(build_convex(spec).designed().design)
    assert found[1].result.objective == pytest.approx(found[0].result.objective, rel=1e-6)
    bounds = [design.any_spectrum.certificate.bound for design in found]
    assert bounds[1] == pytest.approx(bounds[0], rel=2e-5)


def test_a_limit_with_a_tiny_multiplier_does_not_prevent_the_proof():
    """Input 1 may have nearly any power: the multiplier of its limit is below a solver's accuracy."""
    spec = parse_spec(
        "plant: {A: [[1, -0.35], [1, -0.3]], B: [[[0, 1.4, -0.7], [0, 0.3]], [[0, -0.2], [0, 1.4, -0.2]]]}\n"
        "noise: {variance: [[1.0, 0.4], [0.4, 0.5]]}\nexperiment: {samples: 500}\n"
        "accuracy: {criterion: E}\nspectrum: {type: fir, order: 6}\n"
        "limits: {input_power: [1000000.0, 2.5]}\n"
    )
    result = build_convex(spec).designed().design.result
    assert result.gap < 1e-6


@pytest.mark.slow
def test_a_spectrum_of_order_zero_costs_more_than_order_one_and_less_than_white():
    """White excitation has order zero, and each spectrum of order zero is also one of order one."""
    costs = [
        solve(
            changed(GAINS, f"spectrum={{{kind}}}", "signal.candidates=1", "solver.any_spectrum=false")
        ).result["cost"]
        for kind in ("type: fir, order: 1", "type: fir, order: 0", "type: white")
    ]
    assert costs[0] < costs[1] < costs[2]


@pytest.mark.slow
def test_free_spectra_of_unequal_limits_are_proved():
    """Many rounds pass before a useful sinusoid is found, which must not end the search."""
    spec = changed(
        "plant: {B: [[[0, 1.0], [0, -0.5]], [[0, 0.6], [0, 1.2]]],\n"
        "  F: [[[1, -0.7], [1, 0.3]], [[1, -0.5], [1, -0.8]]]}\n"
        "noise: {variance: [[1.0, 0.4], [0.4, 0.5]]}\nexperiment: {samples: 500}\n"
        "accuracy: {model_error: {relative: 0.1}}\nobjective: best_accuracy\n"
        "limits: {input_power: [2, 1]}\nspectrum: {type: free}\n"
    )
    assert build_convex(spec).designed().design.result.gap < 1e-6


LOOP = f"""{IN_LOOP}
cost: {{input_power: 1, output_power: 0.1, excitation_power: 0.01}}
accuracy: {{standard_deviation: {{'a1[1]': 0.002, 'b1[1,2]': 0.01}}}}
solver: {{any_spectrum: false}}
signal: {{candidates: 1}}
"""


TWO_ALONE = """
plant: {A: [[1, -1.1], [1, -0.6]], B: [[[0, 1, 0.4], [0]], [[0], [0, 0.7]]]}
noise: {C: [[1, 0.3], [1]], variance: [[1, 0], [0, 0.5]]}
experiment:
  samples: 500
  controller:
    numerator: [[[0.3, -0.25], [0]], [[0], [0.3]]]
    denominator: [[[1, -1], [1]], [[1], [1, -0.5]]]
"""


def in_loop(*overrides):
    return parse_spec(LOOP, overrides=list(overrides))


def test_two_decoupled_loops_cost_the_sum_of_both_alone():
    common = "cost: {input_power: 1, output_power: 0.2}\nspectrum: {type: fir, order: 5}\n"
    common += "accuracy: {model_error: {relative: 0.05, alpha: 3}}\n"
    both = parse_spec(TWO_ALONE + common)
    alone = [
        "plant: {A: [1, -1.1], B: [0, 1, 0.4]}\nnoise: {C: [1, 0.3], variance: 1}\n"
        "experiment: {samples: 500, controller: {numerator: [0.3, -0.25], denominator: [1, -1]}}\n",
        "plant: {A: [1, -0.6], B: [0, 0.7]}\nnoise: {variance: 0.5}\n"
        "experiment: {samples: 500, controller: {numerator: [0.3], denominator: [1, -0.5]}}\n",
    ]
    design = build_convex(both).designed().design.result
    costs = []
    for text in alone:
        spec = parse_spec(text + common)
        costs.append(build_convex(spec).designed().design.result.objective)
    assert design.gap < 1e-6
    assert design.objective == pytest.approx(sum(costs), rel=2e-6)


def test_units_of_the_channels_do_not_make_a_loop_algebraic():
    """u1 in millionths, u2 in millions: the gains differ by 1e12, the loop is the same and has its delay."""
    scaled = in_loop(
        "plant.B=[[[0, 1.0e+6, 0.4e+6], [0, -0.3e-6]], [[0, 0.4e+6], [0, 1.2e-6, -0.5e-6]]]",
        "experiment.controller.numerator=[[[0.3e-6, -0.25e-6], [0]], [[0], [0.3e+6, -0.2e+6]]]",
    )
    build_convex(scaled)


def test_an_arx_design_with_all_entries_bounded_is_that_of_a_semidefinite_program():
    """The program has the binding frequencies on its grid, and a Gram matrix for a positive spectrum."""
    order = 2
    spec = load_spec(SPECS / "two_by_two_arx.yaml", [f"spectrum.order={order}", "solver.any_spectrum=false"])
    result = solve(spec).result
    assert result["objective"]["relative_gap"] <= 1e-5
    assert result["model_error"]["worst_ratio"] == pytest.approx(1.0, abs=1e-6)
    task = build_convex(spec)
    experiment = task.simulation.nominal.whitened(result["baseline"]["white"]["cost"])
    basis, k = task.asked.question.basis, experiment.size
    maps = basis.integrals(experiment.information_density, experiment.singularities)
    power = basis.integrals(lambda w: experiment.power_density("input", w), experiment.singularities)
    scale = result["baseline"]["white"]["cost"]
    r, n = 2, 2 * (order + 1)
    gram = cp.Variable((n, n), PSD=True)
    blocks = [
        sum(gram[r * (s + t) : r * (s + t + 1), r * s : r * (s + 1)] for s in range(order + 1 - t))
        for t in range(order + 1)
    ]
    x = cp.hstack(
        [
            blocks[0][0, 0],
            blocks[0][0, 1],
            blocks[0][1, 1],
            *(b[i, j] for b in blocks[1:] for i in range(r) for j in range(r)),
        ]
    )
    M = experiment.baseline_information + cp.reshape(
        scale * maps.reshape(len(maps), -1).T @ x, (k, k), order="C"
    )
    constraints = []
    grid = np.concatenate(
        [np.linspace(1e-9, np.pi, 5), np.array(result["model_error"]["active_frequencies"])]
    )
    for make in task.asked.question.requirements:
        requirement = make(experiment)
        for w in grid:
            R = requirement.cut(float(w)).matrix
            constraints.append(0.5 * (M + M.T) - R >> 0)
    problem = cp.Problem(cp.Minimize(power @ x), constraints)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # cvxpy warns of inaccuracy; four digits are compared
        problem.solve(solver=cp.CLARABEL)
    assert result["cost"] == pytest.approx(scale * problem.value, rel=1e-4)


@pytest.mark.slow
def test_amplitude_and_rate_of_u_in_a_loop_are_limited():
    """The response of u to r, by the recursion of the loop, keeps the limits; the accuracy is met."""
    free = solve(in_loop("signal.candidates=2")).result["signal"]
    amplitude, rate = 0.8 * np.array(free["input_peak"]), 0.8 * np.array(free["input_move"])
    limits = f"limits={{amplitude: {{input: {amplitude.tolist()}}}, rate: {rate.tolist()}}}"
    spec = in_loop(limits, "signal.candidates=2")
    outcome = solve(spec)
    r = np.stack([outcome.tables["signal"].columns[name] for name in ("r1", "r2")], axis=1)
    _, u = build_experiment(spec).loop.signals(r, 0.0 * r)
    assert np.all(np.abs(u).max(axis=0) <= amplitude * (1 + 1e-10))
    assert np.all(np.abs(np.diff(u, axis=0, prepend=0.0)).max(axis=0) <= rate * (1 + 1e-10))
    assert outcome.result["signal"]["worst_ratio"] <= 1 + 1e-9
    assert outcome.result["signal"]["input_peak"] == pytest.approx(np.abs(u).max(axis=0))


def test_a_limit_on_input_power_binds_the_response_of_u_to_r():
    free = solve(in_loop()).result
    most = 0.99 * free["power"]["input"][1]
    held = solve(in_loop(f"limits.input_power=[1e6, {most}]")).result
    assert held["power"]["input"][1] == pytest.approx(most, rel=1e-6)
    assert held["cost"] > free["cost"]
    assert held["objective"]["relative_gap"] < 1e-6
