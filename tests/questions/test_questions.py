"""Results of specs with limits, criteria and further requirements."""

import numpy as np
import pytest
import yaml

from inputdesign_cli import load_spec, parse_spec, solve, validate
from inputdesign_cli.errors import SpecError
from tests.support.first_order_specs import ERROR, FIR, PLANT, run


def test_results_of_a_shortest_experiment_are_for_a_whole_number_of_samples():
    """Ratio and bound.csv hold for 7 samples, not 6.4, and agree with r_u from the covariance."""
    text = ERROR.replace("0.01", "0.1") + FIR + "objective: shortest_experiment\nlimits: {input_power: 0.2}\n"
    outcome = solve(parse_spec(PLANT + text))
    result, table = outcome.result, outcome.tables["bound"].columns
    assert result["samples"] > 1.01 * result["objective"]["value"]
    names = result["information"]["parameters"]
    P = np.asarray(result["information"]["covariance"])
    part = [names.index("b1"), names.index("f1")]
    w = table["frequency_rad_per_s"]
    q, F = np.exp(-1j * w), 1 - 0.7 * np.exp(-1j * w)
    T = np.array([q / F, -3.6 * q**2 / F**2])
    rows = np.stack([T.real, T.imag]).transpose(2, 0, 1)
    variance = np.linalg.eigvalsh(rows @ P[np.ix_(part, part)] @ rows.transpose(0, 2, 1))[:, -1]
    r_u = 2.45 * np.sqrt(variance)
    np.testing.assert_allclose(table["r_u"], r_u, rtol=1e-7)
    assert result["model_error"]["worst_ratio"] == pytest.approx((r_u / table["r_adm"]).max(), rel=1e-7)
    assert result["model_error"]["worst_ratio"] < 0.999
    assert result["signal"]["samples"] > result["samples"] == np.ceil(result["objective"]["value"])
    assert result["signal"]["worst_ratio"] <= 1.0 + 1e-9


@pytest.mark.parametrize("samples", [100, 1000])
def test_the_criterion_of_a_record_is_scaled_to_the_length_of_the_experiment(samples):
    """One gain in white noise: M = prior + N P / lambda, whatever the length of the record."""
    result = solve(
        parse_spec(
            "plant: {B: [0, 2.0]}\nnoise: {variance: 0.5}\nlimits: {input_power: 3}\n"
            "experiment: {samples: 100, prior: {information: [[40]]}}\n"
            "accuracy: {criterion: E}\nspectrum: {type: fir, order: 2}\n"
            f"signal: {{samples: {samples}, type: binary}}\n"
        )
    ).result
    told = 100 * 3.0 / 0.5
    assert result["objective"]["value"] == pytest.approx(40 + told, rel=1e-6)
    lost = 1 - 1 / samples  # the response to the last sample is not recorded
    assert result["signal"]["criterion"] == pytest.approx(40 + told * lost, rel=1e-3)


def test_best_accuracy_with_half_the_needed_power_has_sqrt_2_times_the_error():
    """Half the power that the accuracy needs: r_u is at least sqrt(2) times what is admissible."""
    least = run(ERROR + FIR)["cost"]
    limits = f"limits: {{input_power: {least / 2}, output_power: 1000}}\n"
    result = run(f"{ERROR}{FIR}objective: best_accuracy\n{limits}")
    assert result["objective"]["kind"] == "accuracy_factor"
    assert result["objective"]["value"] == pytest.approx(np.sqrt(2), rel=1e-6)
    assert result["model_error"]["worst_ratio"] == pytest.approx(np.sqrt(2), rel=1e-6)
    assert [entry["binding"] for entry in result["limits"]] == [True, False]
    assert result["limits"][0]["value"] == pytest.approx(least / 2, rel=1e-6)
    (met,) = result["requirements"]
    assert (met["name"], met["frequency"]) == ("model_error", pytest.approx(np.pi, rel=1e-5))


@pytest.mark.parametrize(("letter", "measure"), [
    ("D", lambda M: np.linalg.slogdet(M)[1]),
    ("A", lambda M: -np.trace(np.linalg.inv(M))),
    ("E", lambda M: np.linalg.eigvalsh(M)[0]),
    ("T", np.trace),
])  # fmt: skip
@pytest.mark.parametrize("scale", ["absolute", "relative"])
def test_criteria_have_the_value_of_the_reported_information_matrix(letter, measure, scale):
    result = run(f"accuracy: {{criterion: {letter}, scale: {scale}}}\nlimits: {{input_power: 1}}\n" + FIR)
    M = np.asarray(result["information"]["matrix"])
    if scale == "relative":
        theta = np.array([3.6, -0.9, -0.7])
        M = theta[:, None] * M * theta
    objective = result["objective"]
    assert objective["kind"] == letter
    assert objective["value"] == pytest.approx(measure(M), rel=1e-8)
    assert objective["value"] <= objective["upper_bound"] + 1e-9 * abs(objective["value"])
    assert objective["relative_gap"] <= 1e-6
    assert objective["any_spectrum_bound"] >= objective["value"] * (1 - 1e-9 * np.sign(objective["value"]))


def test_an_earlier_record_is_prior_information(tmp_path):
    """An earlier record with half the optimal information leaves about half of the cost."""
    plain = solve(parse_spec(PLANT + ERROR + FIR))
    w = 0.155 * np.arange(4000)
    record = tmp_path / "u.csv"
    power = 0.5 * plain.result["objective"]["any_spectrum_bound"] * 500 / 4000
    samples = np.sqrt(2 * power) * np.cos(w)
    record.write_text("time_s,u1\n" + "".join(f"{i},{u:.17g}\n" for i, u in enumerate(samples)))
    spec = PLANT.replace("samples: 500", f"samples: 500, prior: {{information: {record}}}")
    free = solve(parse_spec(spec + ERROR + "spectrum: {type: free}\n")).result
    assert free["cost"] == pytest.approx(0.5 * 0.1925467, rel=1e-2)


def test_standard_deviations_are_reached():
    result = run("accuracy: {standard_deviation: {b1: 0.01, f1: 0.002}}\n" + FIR)
    sd = result["information"]["standard_deviation"]
    assert sd["b1"] <= 0.01 * (1 + 1e-7)
    assert sd["f1"] <= 0.002 * (1 + 1e-7)
    assert max(sd["b1"] / 0.01, sd["f1"] / 0.002) == pytest.approx(1.0, abs=1e-6)
    assert [r["name"] for r in result["requirements"]] == [
        "standard_deviation of b1",
        "standard_deviation of f1",
    ]


def test_an_information_target_takes_parameters_by_name_in_any_order():
    by_name = run(
        "accuracy: {information: {matrix: [[1.0e+6, 0], [0, 1.0e+4]], parameters: [f1, b1]}}\n" + FIR
    )
    M = np.asarray(by_name["information"]["matrix"])
    slack = np.linalg.eigvalsh(M - np.diag([1e4, 0.0, 1e6]))
    assert slack[0] == pytest.approx(0.0, abs=1e-3)


def test_a_weight_in_s_is_sampled():
    """A first-order lag with a zero-order hold is (1 - a) q^-1 / (1 - a q^-1), a = exp(-T / tau)."""
    continuous = "{continuous: {numerator: [1], denominator: [2, 1]}, sample: zoh}"
    a = np.exp(-0.5)
    discrete = f"{{numerator: [0, {1 - a:.17g}], denominator: [1, {-a:.17g}]}}"
    costs = [
        run(f"accuracy: {{model_error: {{absolute: 0.05, weight: {weight}}}}}\n" + FIR)["cost"]
        for weight in (continuous, discrete)
    ]
    assert costs[0] == pytest.approx(costs[1], rel=1e-9)


def test_density_limits_from_numbers_tables_and_filters(tmp_path):
    """The same level in three forms gives the same design, which keeps to it everywhere."""
    loose = ERROR.replace("0.01", "0.015")
    unlimited = solve(parse_spec(PLANT + loose + FIR))
    level = 0.8 * unlimited.tables["spectrum"].columns["phi"].max()
    table = tmp_path / "level.csv"
    table.write_text(f"frequency,phi\n0,{level:.17g}\n3.2,{level:.17g}\n", encoding="utf-8")
    root = f"{np.sqrt(level):.17g}"
    forms = [f"{level:.17g}", f"{{max: {{table: {table}}}}}", f"{{max: {{numerator: [{root}]}}}}"]
    results = [solve(parse_spec(PLANT + loose + FIR + f"limits: {{spectrum: {form}}}\n")) for form in forms]
    costs = [outcome.result["cost"] for outcome in results]
    assert costs[1] == pytest.approx(costs[0], rel=1e-6)
    assert costs[2] == pytest.approx(costs[0], rel=1e-6)
    assert costs[0] > unlimited.result["cost"]
    for outcome in results:
        assert outcome.tables["spectrum"].columns["phi"].max() <= level * (1 + 1e-6)
        assert outcome.result["limits"][-1]["binding"]


def test_almost_free_power_near_dc_is_reported_and_a_limit_removes_it(flexible):
    """With an integrator in the loop, excitation near frequency zero costs almost nothing."""
    path, free = "specs/flexible_transmission.yaml", "spectrum={type: free}"
    design = solve(load_spec(path, [free]))
    assert design.result["cost"] == pytest.approx(6.556636, rel=1e-5)
    assert "excitation-almost-free" in {one["code"] for one in design.result["findings"]}
    capped = solve(load_spec(path, [free, "limits.excitation_power=20"])).result
    assert "notes" not in capped
    assert capped["power"]["excitation"][0] <= 20 * (1 + 1e-9)
    assert capped["cost"] == pytest.approx(6.556636, rel=2e-2)


@pytest.mark.parametrize(
    ("spec", "override"),
    [
        ("first_order", "experiment.prior={information: [[1e9,0,0],[0,1e9,0],[0,0,1e9]]}"),
        ("flexible_transmission", "accuracy={model_error: {relative: 1000}}"),
    ],
)
def test_no_excitation_is_needed_where_the_prior_or_the_noise_suffices(spec, override):
    """The first spec has a prior, the second the noise of normal operation in a loop."""
    result = solve(load_spec(f"specs/{spec}.yaml", [override, "spectrum.order=3"])).result
    assert (result["status"], result["cost"]) == ("nothing_needed", 0.0)
    assert [one["code"] for one in result["findings"]] == ["no-excitation-needed"]


def test_an_input_without_power_under_the_trace_criterion_is_reported():
    """The trace is largest with all power at one input."""
    found = solve(
        parse_spec(
            "plant: {B: [[[0, 1], [0, 0.4]]], F: [[[1, -0.8], [1, -0.5]]]}\nnoise: {variance: 1}\n"
            "experiment: {samples: 500}\naccuracy: {criterion: T}\nlimits: {input_power: 1}\n"
            "spectrum: {type: fir, order: 3}\n"
        )
    ).result
    assert found["power"]["input"] == pytest.approx([1.0, 0.0], abs=1e-9)
    (idle,) = [one for one in found["findings"] if one["code"] == "input-without-power"]
    assert idle["where"] == "input 2"


@pytest.mark.parametrize("spectrum", ["fir, order: 4", "free", "white"])
@pytest.mark.parametrize(("share", "needed"), [(1.05, False), (0.99, True)])
def test_a_parameter_that_the_noise_alone_determines_needs_no_excitation(spectrum, share, needed):
    """Noise alone gives var a1 = (1 - a1^2) / N for N samples of an ARX system, and nothing about b1."""
    bound = share * np.sqrt((1 - 0.5**2) / 1000)
    found = solve(
        parse_spec(
            "plant: {A: [1, -0.5], B: [0, 1]}\nnoise: {variance: 1}\nexperiment: {samples: 1000}\n"
            f"accuracy: {{standard_deviation: {{a1: {bound}}}}}\nspectrum: {{type: {spectrum}}}\n"
        )
    ).result
    assert (found["cost"] > 0) == needed
    assert (found["status"] == "nothing_needed") != needed


def test_a_command_takes_a_spec_its_file_or_its_content(tmp_path):
    file = tmp_path / "first.yaml"
    file.write_text(PLANT + ERROR + FIR)
    cost = solve(parse_spec(PLANT + ERROR + FIR)).cost
    for given in (file, str(file), yaml.safe_load(file.read_text())):
        validate(given)
        assert solve(given).cost == pytest.approx(cost, rel=1e-9)
    with pytest.raises(SpecError) as caught:
        solve(str(tmp_path / "other.yaml"))
    assert caught.value.diagnostics[0].code == "file-missing"
