import pickle

import numpy as np
import pytest

from inputdesign_cli import load_spec, parse_spec, simulate
from inputdesign_cli.compute.executor import Finished
from inputdesign_cli.errors import SpecError

SPEC = "specs/two_by_two_arx.yaml"
LOOP = "specs/two_by_two_loop.yaml"
JENKINS = """
plant:
  B: [[[0, 1.0], [0, 0.5]], [[0, 0, 0.7], [0]]]
  F: [[[1, -0.7], [1, 0.3]], [[1, -0.5], [1]]]
noise: {C: [[1, 0.5], [1, -0.3]], D: [1, -0.6], variance: [[0.2, 0.05], [0.05, 0.1]]}
experiment: {samples: 400}
accuracy: {model_error: {relative: 0.1}}
spectrum: {type: fir, order: 4}
simulation: {runs: 100, seed: 2}
"""
IN_SECONDS = """
sample_time: 0.5
plant: {continuous: {numerator: [[[3.1], [1, 3.2]]], denominator: [1, 1.5, 1.5]}}
noise: {variance: 0.5}
experiment: {samples: 600}
accuracy: {model_error: {relative: 0.1}}
limits: {band: [0, 3]}
spectrum: {type: multisine, lines: 6}
signal: {samples: 600}
simulation: {runs: 100, seed: 2}
"""


GIVEN = "spectrum={given: {type: white, power: 450}}"
TRUE = "[[0, 1.0, 0.4], [0, -0.5, 0.3]], [[0, 0.6, 0.2], [0, 1.2, -0.5]]"


@pytest.fixture(scope="module")
def studied():
    overrides = ["spectrum.order=2", "simulation={runs: 60, compare: [white, prbs]}"]
    return simulate(load_spec(SPEC, overrides))


def within_wishart(simulation):
    low, high = simulation["wishart_range"]
    for entry in simulation["inputs"].values():
        eigenvalues = np.array(entry["covariance_eigenvalues"])
        assert low < eigenvalues.min()
        assert eigenvalues.max() < high
        assert entry["not_converged"] == 0


def test_covariances_lie_in_the_range_of_the_wishart_distribution(studied):
    within_wishart(studied.result["simulation"])


@pytest.mark.slow
def test_of_box_jenkins_plants_they_do_as_well():
    within_wishart(simulate(parse_spec(JENKINS)).result["simulation"])


def test_the_promise_is_kept_on_the_design_model(studied):
    inputs = studied.result["simulation"]["inputs"]
    # r_u is a joint region of 95 % for all entries at all frequencies.
    for name in ("design", "white", "prbs", "white_that_suffices"):
        assert inputs[name]["within_r_u_limits"][1] > 0.95
    assert inputs["design"]["within_r_adm_limits"][1] > 0.95
    assert inputs["design"]["theory_on_truth"]["worst_ratio"] == pytest.approx(1.0, abs=1e-3)
    assert inputs["white"]["theory_on_truth"]["worst_ratio"] > 1.5
    assert inputs["white_that_suffices"]["theory_on_truth"]["worst_ratio"] == pytest.approx(1.0, abs=1e-3)


def test_powers_are_equal_and_those_of_the_design(studied):
    inputs, designed = studied.result["simulation"]["inputs"], studied.result["power"]["excitation"]
    assert sum(inputs["design"]["power"]["input"]) == pytest.approx(sum(designed), rel=1e-6)
    np.testing.assert_allclose(inputs["design"]["power"]["input"], designed, rtol=0.02)
    for name in ("white", "prbs"):
        np.testing.assert_allclose(inputs[name]["power"]["input"], sum(designed) / 2, rtol=1e-6)
        assert inputs[name]["cost"] == pytest.approx(studied.result["cost"], rel=1e-6)


def test_every_entry_has_its_error_bands(studied):
    curves = studied.curves["errors_design"]
    assert [band.entry for band in curves.panels] == [(0, 0), (0, 1), (1, 0), (1, 1)]
    for band in curves.panels:
        assert np.all(band.quantiles[0.05] <= band.quantiles[0.95])
        assert np.all(band.quantiles[0.95] < band.r_u)
    assert studied.curves["cloud_design"].theta.shape == (60, 10)


def test_the_true_system_may_be_another():
    plant = f"{{A: [[1, -0.9], [1, 0.4]], B: [{TRUE}]}}"
    overrides = [GIVEN, f"simulation={{runs: 60, plant: {plant}, noise: {{relative_std: 0.1}}}}"]
    result = simulate(load_spec(SPEC, overrides)).result
    simulation = result["simulation"]
    design = simulation["inputs"]["design"]
    assert simulation["true_parameters"]["a1[1]"] == -0.9
    assert design["mean_estimate"]["a1[1]"] == pytest.approx(-0.9, abs=0.02)
    assert design["on_design_model"]["within_r_u_limits"][1] > 0.95
    assert design["within_r_u_limits"][1] > 0.95
    smallest = min(result["power"]["output"])
    np.testing.assert_allclose(simulation["true_variance"], 0.01 * smallest * np.eye(2), rtol=1e-9)


def test_a_true_system_of_another_structure_has_no_theory():
    plant = f"{{A: [[1, -0.7, 0.1], [1, 0.4]], B: [{TRUE}]}}"
    overrides = [GIVEN, f"simulation={{runs: 20, plant: {plant}}}"]
    design = simulate(load_spec(SPEC, overrides)).result["simulation"]["inputs"]["design"]
    assert "within_r_u" not in design
    assert "within_r_adm" in design


def test_a_loop_keeps_its_promise():
    outcome = simulate(load_spec(LOOP, ["simulation={runs: 50, compare: [white]}"]))
    result, simulation = outcome.result, outcome.result["simulation"]
    within_wishart(simulation)
    design = simulation["inputs"]["design"]
    assert design["within_r_adm_limits"][1] > 0.95
    for kind in ("input", "output", "excitation"):  # the runs start from rest
        np.testing.assert_allclose(design["power"][kind], result["power"][kind], rtol=0.01)
        if kind in design["total_power"]:
            assert np.all(np.array(design["total_power"][kind]) > design["power"][kind])
    shown = outcome.tables["disturbance_design"].columns
    for i in (1, 2):  # until it has faded
        assert np.abs(shown[f"y{i}_r"][-1]) < 0.2 * np.abs(shown[f"y{i}_r"]).max()
        assert np.sum(shown[f"y{i}_r"] ** 2) / 2000 == pytest.approx(
            result["power"]["output"][i - 1], rel=0.1
        )
    white = simulation["inputs"]["white"]
    assert white["theory_on_truth"]["worst_ratio"] > 1.2
    assert sum(white["power"]["excitation"]) == pytest.approx(sum(design["power"]["excitation"]))


@pytest.mark.slow
def test_a_loop_around_a_held_plant_keeps_its_promise():
    """Also where the true motor is another: noise reaches u and is no harm to the direct method."""
    true = "plant: {continuous: {numerator: [2.2], denominator: [1, 11, 20]}, sample: zoh}"
    overrides = [f"simulation={{runs: 80, {true}}}", "spectrum.order=8"]
    simulation = simulate(load_spec("specs/motor_loop.yaml", overrides)).result["simulation"]
    within_wishart(simulation)
    design = simulation["inputs"]["design"]
    assert design["within_r_u_limits"][1] > 0.95
    assert design["on_design_model"]["within_r_adm_limits"][1] > 0.95
    mean = [design["mean_estimate"][name] for name in ("b0", "a1", "a0")]
    np.testing.assert_allclose(mean, [2.2, 11, 20], rtol=0.01)
    for kind, total in design["total_power"].items():
        assert total[0] > design["power"][kind][0]


def test_a_true_system_that_the_controller_does_not_hold_is_refused():
    plant = "{A: [[1, -1.1], [1, -0.6]], B: [[[0, -1.0, -0.4], [0, 0]], [[0, 0], [0, 1.2, -0.5]]]}"
    with pytest.raises(SpecError) as caught:
        simulate(load_spec(LOOP, [f"simulation={{runs: 5, plant: {plant}}}"]))
    assert caught.value.diagnostics[0].code == "unstable-loop"
    assert caught.value.diagnostics[0].key == "simulation.plant"


IN_Q = "B: [[[0, 2], [0, 1]], [[0, 1], [0, 2]]], F: [[[1, -0.5], [1, -0.5]], [[1, -0.5], [1, -0.5]]]"
IN_S = (
    "continuous: {numerator: [[[2.77258872], [1.38629436]], [[1.38629436], [2.77258872]]], denominator: [1, "
)
IN_S += "0.69314718]}, sample: zoh"
COLOURED = "noise: {C: [1, 0.8], variance: 0.5}"


@pytest.mark.first(1)
@pytest.mark.parametrize("nominal", [IN_Q, IN_S])
@pytest.mark.parametrize("loop", ["", ", controller: {numerator: [[[0.1], [0]], [[0], [0.1]]]}"])
def test_the_truth_may_be_in_s_or_in_q(nominal, loop):
    """b/(s + ln 2) behind a hold of one second is b/(2 ln 2) q^-1/(1 - q^-1/2)."""
    found = []
    for truth in (IN_Q, IN_S):
        text = f"plant: {{{nominal}}}\nnoise: {{variance: 0.5}}\nexperiment: {{samples: 200{loop}}}\n"
        text += "accuracy: {model_error: {relative: 0.5}}\nspectrum: {given: {type: white, power: 4}}\n"
        text += f"simulation: {{runs: 20, plant: {{{truth}}}, {COLOURED}}}\n"
        found.append(simulate(parse_spec(text)).result["simulation"]["inputs"]["design"])
    for key in ("power", "total_power"):
        for kind in ("input", "output"):
            np.testing.assert_allclose(found[0][key][kind], found[1][key][kind], rtol=1e-6)
    for name, value in found[0]["mean_estimate"].items():
        assert value == pytest.approx(found[1]["mean_estimate"][name], rel=1e-4, abs=1e-5)
    if not loop:  # y is noise of mean square 0.5 (1 + 0.8^2) about what the input causes
        added = np.subtract(found[0]["total_power"]["output"], found[0]["power"]["output"])
        np.testing.assert_allclose(added, 0.82, rtol=0.3)


def test_prior_information_narrows_the_estimates():
    prior = "experiment.prior={information: [[1.0e+5]], parameters: ['a1[1]']}"
    given = ["spectrum={given: {type: white, power: 5}}", "simulation={runs: 150}", prior]
    design = simulate(load_spec(SPEC, given)).result["simulation"]["inputs"]["design"]
    assert all(0.8 < ratio < 1.2 for ratio in design["rms_over_theory"].values())


def test_a_given_table_is_tried(tmp_path):
    table = tmp_path / "phi.csv"
    table.write_text(
        "frequency,phi_11,phi_12_re,phi_12_im,phi_22\n0,9,3,0,4\n3.1416,9,3,0,4\n", encoding="utf-8"
    )
    overrides = [f"spectrum={{given: {{type: table, file: {table}}}}}", "simulation={runs: 100}"]
    simulation = simulate(load_spec(SPEC, overrides)).result["simulation"]
    within_wishart(simulation)
    np.testing.assert_allclose(simulation["inputs"]["design"]["power"]["input"], [9.0, 4.0], rtol=0.01)


@pytest.mark.first(2)
@pytest.mark.parametrize("signal", [{}, {"offset": [5.0, -3.0], "quantisation": {"bits": 5, "range": 100}}])
@pytest.mark.parametrize("spec", ["specs/first_order.yaml", SPEC])
def test_the_delivered_record_is_tried_about_its_operating_point(spec, signal):
    overrides = ["simulation={runs: 20, excitation: record}", "spectrum.order=3"]
    if signal and "first" in spec:
        signal = {"offset": 5.0, "quantisation": {"bits": 8, "range": 10}}
    overrides += [f"signal.{key}={value}" for key, value in signal.items()]
    result = simulate(load_spec(spec, overrides)).result
    np.testing.assert_allclose(
        result["simulation"]["inputs"]["design"]["power"]["input"], result["signal"]["power"]
    )


class Elsewhere:
    """Tasks travel as bytes and are done in reverse order, as other processes may do them."""

    shares_files = True

    def run(self, function, tasks):
        for sent in reversed([pickle.dumps((function, task)) for task in tasks]):
            there, task = pickle.loads(sent)
            yield Finished(task, pickle.loads(pickle.dumps(there(task))))


@pytest.mark.first(1)
@pytest.mark.parametrize(
    ("spec", "overrides"),
    [
        (SPEC, [GIVEN]),
        (SPEC, ["spectrum.order=2"]),
        (SPEC, ["spectrum.order=2", "signal.type=binary"]),
        (SPEC, ["spectrum={type: multisine, lines: 8}"]),
        ("specs/motor_loop.yaml", ["spectrum.order=3"]),
    ],
)
def test_the_result_does_not_depend_on_where_it_is_computed(spec, overrides):
    overrides = [*overrides, "simulation={runs: 30, seed: 5}", "signal.candidates=1"]
    here = simulate(load_spec(spec, overrides)).result["simulation"]
    there = simulate(load_spec(spec, overrides), executor=Elsewhere()).result["simulation"]
    assert here["inputs"]["design"]["mean_estimate"] == there["inputs"]["design"]["mean_estimate"]


@pytest.mark.slow
@pytest.mark.parametrize("hold", [True, False])
def test_plants_in_s_keep_their_promise(hold):
    overrides = ["plant.sample=zoh"] if hold else []
    simulation = simulate(parse_spec(IN_SECONDS, overrides=overrides)).result["simulation"]
    within_wishart(simulation)
    design = simulation["inputs"]["design"]
    assert design["within_r_adm_limits"][1] > 0.95
    assert design["within_r_u_limits"][1] > 0.95
    assert design["within_r_u"] <= design["within_r_adm"]  # the design keeps r_u below r_adm


@pytest.mark.slow
def test_the_design_reaches_the_cramer_rao_bound():
    overrides = ["simulation={runs: 500, seed: 4}", "experiment.samples=2000", "signal.samples=2000"]
    simulation = simulate(load_spec(SPEC, overrides)).result["simulation"]
    within_wishart(simulation)
    ratios = np.array(list(simulation["inputs"]["design"]["rms_over_theory"].values()))
    # The error of one ratio of 500 runs is 3.2 %; the rms over ten parameters is within 5 %.
    assert np.sqrt(np.mean(ratios**2)) == pytest.approx(1.0, abs=0.05)


@pytest.mark.slow
def test_a_run_that_tells_too_little_is_counted_not_fatal():
    """Poles so fast, and noise so strong, that some runs see a plant that answers at once."""
    spec = parse_spec(
        "plant:\n"
        "  continuous: {numerator: [[[1.3]], [[1.6]]], denominator: [[[1, 1.8]], [[1, 1.9]]]}\n"
        "  sample: zoh\n"
        "noise: {variance: [[16000, 10000], [10000, 17000]]}\nexperiment: {samples: 200}\n"
        "accuracy: {criterion: E}\nlimits: {input_power: 2}\nspectrum: {type: fir, order: 4}\n"
        "signal: {type: multisine, candidates: 1}\nsimulation: {runs: 10, seed: 1}\n"
    )
    entry = simulate(spec).result["simulation"]["inputs"]["design"]
    assert 0 < entry["not_converged"] <= 10
