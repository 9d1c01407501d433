"""Specs with several channels and in continuous time: designs against plain programs, and bad input."""

import warnings
from pathlib import Path

import cvxpy as cp
import numpy as np
import pytest
import scipy.integrate

from inputdesign_cli import load_spec, solve, validate
from inputdesign_cli.errors import EXIT_BAD_INPUT, SpecError
from inputdesign_cli.information import Experiment
from inputdesign_cli.specification import parse_spec
from inputdesign_cli.tasks.build.convex import build_convex
from tests.support.plants import arx

SPECS = Path(__file__).parents[2] / "specs"

CONTINUOUS = """
plant:
  continuous:
    numerator: [[[3.125], [3.188]], [[5.313], [1.563]]]
    denominator: [[[1, 1.5, 1.563], [1, 2, 1.063]], [[1, 0.5, 1.063], [1, 1, 0.312]]]
noise: {variance: [[1, 0], [0, 1]]}
accuracy: {criterion: E}
limits: {input_power: 1000, output_power: 1000}
spectrum: {type: polynomial, order: 4, band: [0, 2.0]}
"""


def changed(text, *overrides):
    return parse_spec(text, overrides=list(overrides))


@pytest.fixture(scope="module")
def design():
    return solve(load_spec(SPECS / "two_by_two.yaml", ["accuracy.criterion=E", "spectrum.order=6"]))


def test_result_is_recomputed_and_proved(design):
    objective = design.result["objective"]
    M = np.array(design.result["information"]["matrix"])
    assert objective["value"] == pytest.approx(np.linalg.eigvalsh(M)[0], rel=1e-8)
    assert objective["value"] <= objective["upper_bound"] <= objective["any_spectrum_bound"]
    assert objective["relative_gap"] <= 1e-5
    assert len(design.result["power"]["input"]) == len(design.result["power"]["output"]) == 2


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
    model = build_convex(spec).experiment.model
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
    random = solve(
        load_spec(
            SPECS / "two_by_two.yaml",
            ["accuracy.criterion=E", "spectrum.order=6", "signal.phases=random", "signal.candidates=1"],
        )
    )
    assert random.result["signal"]["efficiency"] < signal["efficiency"]


def test_plots_are_there(design):
    assert {"spectrum", "signal", "optimality", "ellipses"} <= set(design.curves)
    assert design.curves["spectrum"].spectrum.shape[1:] == (2, 2)


@pytest.mark.slow
def test_bases_agree_and_print_their_own_coefficients():
    results = [
        solve(changed(CONTINUOUS, f"spectrum.basis={basis}")).result for basis in ("chebyshev", "monomial")
    ]
    values = [result["objective"]["value"] for result in results]
    assert values[0] == pytest.approx(values[1], rel=1e-9)
    S = [np.array(result["spectrum"]["coefficients"]) for result in results]
    assert S[0].shape == (10, 10)
    assert np.abs(S[0] - S[1]).max() > 1e-3 * np.abs(S[0]).max()


def test_few_columns_have_a_lower_value_under_the_same_bound():
    full = solve(changed(CONTINUOUS)).result["objective"]
    few = solve(changed(CONTINUOUS, "spectrum.factor_columns=1")).result
    assert few["objective"]["value"] < full["value"]
    assert few["objective"]["upper_bound"] == pytest.approx(full["upper_bound"], rel=1e-9)
    assert few["status"] == "lower_bound"
    assert few["spectrum"]["factor_columns"] == 1


@pytest.mark.slow
def test_relative_scale_does_not_depend_on_units():
    """Input in other units: relative criteria of the same experiment are the same."""
    scaled = CONTINUOUS.replace(
        "[[3.125], [3.188]], [[5.313], [1.563]]", "[[.3125], [.3188]], [[.5313], [.1563]]"
    )
    scaled = scaled.replace("input_power: 1000", "input_power: 100000")
    values = [
        solve(changed(text, "accuracy.scale=relative")).result["objective"]["value"]
        for text in (CONTINUOUS, scaled)
    ]
    assert values[0] == pytest.approx(values[1], rel=1e-6)


def test_limits_of_each_channel_bind():
    result = solve(changed(CONTINUOUS, "limits={input_power: [100, 20]}", "accuracy.criterion=D")).result
    np.testing.assert_allclose(result["power"]["input"], [100.0, 20.0], rtol=1e-6)
    assert [entry["channel"] for entry in result["limits"]] == [1, 2]


def test_arx_with_every_entry_bounded_is_the_textbook_optimum():
    """A plain program on a grid with the binding frequencies: block Toeplitz positivity by a Gram matrix."""
    order = 4
    spec = load_spec(SPECS / "two_by_two_arx.yaml", [f"spectrum.order={order}"])
    result = solve(spec).result
    assert result["objective"]["relative_gap"] <= 1e-5
    assert result["model_error"]["worst_ratio"] == pytest.approx(1.0, abs=1e-6)
    task = build_convex(spec)
    experiment = task.experiment.whitened(result["baseline"]["white"]["cost"])
    basis, k = task.question.basis, experiment.size
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
    for make in task.question.requirements:
        requirement = make(experiment)
        for w in grid:
            R = requirement.cut(float(w)).matrix
            constraints.append(0.5 * (M + M.T) - R >> 0)
    problem = cp.Problem(cp.Minimize(power @ x), constraints)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # that it may be inaccurate; four digits are compared
        problem.solve(solver=cp.CLARABEL)
    assert result["cost"] == pytest.approx(scale * problem.value, rel=1e-4)


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
def test_least_cost_in_every_family_is_proved(overrides):
    common = ["spectrum.order=4"] if not overrides[0].startswith("spectrum") else []
    result = solve(load_spec(SPECS / "two_by_two_arx.yaml", [*common, *overrides])).result
    assert result["objective"]["relative_gap"] <= 1e-5
    assert result["objective"]["any_spectrum_bound"] <= result["objective"]["value"] * (1 + 1e-6)


def test_weighted_variance_in_continuous_time_holds_for_every_entry():
    weight = "{continuous: {numerator: [1], denominator: [1, 1]}}"
    asked = f"accuracy={{weighted_variance: {{max: 0.01, weight: {weight}}}}}"
    spec = changed(CONTINUOUS, asked, "limits=null")
    result = solve(spec).result
    assert result["objective"]["relative_gap"] <= 1e-6
    P = np.array(result["information"]["covariance"])
    w = np.linspace(0.0, 2.0, 500)
    gradient = build_convex(spec).experiment.model.plant_gradient(w)
    variance = np.einsum("nkij,kl,nlij->nij", gradient.conj(), P, gradient).real / (1 + w**2)[:, None, None]
    assert variance.max() == pytest.approx(0.01, rel=1e-4)


@pytest.mark.parametrize("sampled", [False, True])
def test_one_channel_in_continuous_time(sampled):
    plant = "{continuous: {numerator: [2.0], denominator: [1, 0.6, 1]}" + (
        ", sample: zoh}" if sampled else "}"
    )
    text = f"""
plant: {plant}
noise: {{variance: 0.1}}
experiment: {{samples: 400}}
accuracy: {{criterion: D}}
limits: {{input_power: 1}}
spectrum: {{type: polynomial, order: 8, band: [0, 2.0]}}
"""
    outcome = solve(changed(text))
    assert outcome.result["information"]["parameters"] == ["b0", "a0", "a1"]
    assert outcome.result["objective"]["relative_gap"] <= 1e-6
    assert list(outcome.tables["spectrum"].columns) == ["frequency_rad_per_s", "phi", "phi_record"]
    assert outcome.result["signal"]["efficiency"] > 0.9


BAD = {
    "improper": (
        "plant.continuous.numerator=[[[1, 0, 0, 3.1], [3.2]], [[5.3], [1.6]]]",
        "improper-transfer",
        "not proper",
    ),
    "unstable": (
        "plant.continuous.denominator=[[[1, -1.5, 1.6], [1, 2, 1.1]], [[1, 0.5, 1.1], [1, 1, 0.3]]]",
        "unstable-polynomial",
        "",
    ),
    "zero width": ("spectrum.band=[2, 2]", "bad-band", ""),
    "zero limit": ("limits.input_power=0", "out-of-range", ""),
    "contradictory": ("limits.input_power={min: 20, max: 10}", "conflicting-keys", "larger than max"),
    "no band": ("spectrum={type: free}", "needs-band", "frequencies have no end"),
    "indistinguishable": (
        "plant.continuous={numerator: [[[1, 1], [1]]], denominator: [[[1, 2, 1], [1, 1]]]}",
        "not-identifiable",
        r"no excitation within the band can tell these parameters apart: b0\[1,1\], a0\[1,1\], a1\[1,1\]",
    ),
    "too slow": ("sample_time=4", "beyond-nyquist", "cannot carry the band"),
    "band beyond the limit": ("limits.band=[0, 1]", "bad-limit", r"leaves limits.band"),
    "sensitivity": (
        "accuracy={model_error: {sensitivity: {max_db: 6, controller: {numerator: [0.1]}}}}",
        "unsuitable-key",
        "works in discrete time, but the plant is not sampled",
    ),
    "levels in continuous time": ("signal.type=binary", "not-supported", "has no levels"),
    "hold in continuous time": ("signal.hold=2", "not-supported", "holds nothing"),
    "columns without a criterion": (
        "accuracy={standard_deviation: {'b0[1,1]': 0.1}}",
        "not-supported",
        "factor_columns is for a criterion",
    ),
}


@pytest.mark.parametrize("name", BAD)
def test_bad_input_is_refused_with_place_and_hint(name):
    override, code, message = BAD[name]
    extra = ["spectrum.factor_columns=1"] if name.startswith("columns") else []
    noise = ["noise.variance=1"] if name == "indistinguishable" else []
    with pytest.raises(SpecError, match=message or None) as caught:
        validate(changed(CONTINUOUS, override, *extra, *noise))
    diagnostic = caught.value.diagnostics[0]
    assert (diagnostic.code, caught.value.exit_code) == (code, EXIT_BAD_INPUT)
    assert diagnostic.hint
    assert diagnostic.key


def test_the_spec_of_the_example_is_that_of_the_tests():
    task = build_convex(load_spec(SPECS / "two_by_two_arx.yaml"))
    assert task.experiment.model.names == Experiment(arx(), 1).model.names


GAINS = """
plant: {A: [[1, -0.7], [1, 0.4]], B: [[[0, 1.0, 0.4], [0, -0.5, 0.3]], [[0, 0.6, 0.2], [0, 1.2, -0.5]]]}
noise: {variance: [[1.0, 0.4], [0.4, 0.5]]}
experiment: {samples: 500}
accuracy: {model_error: {relative: 0.1}}
"""
# u2 in thousandths: its coefficients are a thousand times smaller, its power 1e6 times larger.
MILLI = "plant.B=[[[0, 1.0, 0.4], [0, -0.0005, 0.0003]], [[0, 0.6, 0.2], [0, 0.0012, -0.0005]]]"


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
        found.append(build_convex(spec).designed()[0].design)
    assert found[1].result.objective == pytest.approx(found[0].result.objective, rel=1e-6)
    bounds = [design.any_spectrum.certificate.bound for design in found]
    assert bounds[1] == pytest.approx(bounds[0], rel=2e-5)


def test_a_limit_that_hardly_matters_does_not_spoil_the_proof():
    """Input 1 may have nearly any power: what it is worth is below the accuracy of a solver."""
    spec = parse_spec(
        "plant: {A: [[1, -0.35], [1, -0.3]], B: [[[0, 1.4, -0.7], [0, 0.3]], [[0, -0.2], [0, 1.4, -0.2]]]}\n"
        "noise: {variance: [[1.0, 0.4], [0.4, 0.5]]}\nexperiment: {samples: 500}\n"
        "accuracy: {criterion: E}\nspectrum: {type: fir, order: 6}\n"
        "limits: {input_power: [1000000.0, 2.5]}\n"
    )
    result = build_convex(spec).designed()[0].design.result
    assert result.gap < 1e-6


def test_a_spectrum_of_order_zero_is_white_in_time():
    """No better than order one, and no worse than the best flat spectrum, which is one of its members."""
    costs = [
        solve(changed(GAINS, f"spectrum={{{kind}}}", "signal.candidates=1")).result["cost"]
        for kind in ("type: fir, order: 1", "type: fir, order: 0", "type: white")
    ]
    assert costs[0] < costs[1] < costs[2]


def test_free_spectra_of_unequal_limits_are_proved():
    """Many rounds pass here before a sinusoid is found that pays: no reason to stop."""
    spec = changed(
        "plant: {B: [[[0, 1.0], [0, -0.5]], [[0, 0.6], [0, 1.2]]],\n"
        "  F: [[[1, -0.7], [1, 0.3]], [[1, -0.5], [1, -0.8]]]}\n"
        "noise: {variance: [[1.0, 0.4], [0.4, 0.5]]}\nexperiment: {samples: 500}\n"
        "accuracy: {model_error: {relative: 0.1}}\nobjective: best_accuracy\n"
        "limits: {input_power: [2, 1]}\nspectrum: {type: free}\n"
    )
    assert build_convex(spec).designed()[0].design.result.gap < 1e-6
