"""Monte Carlo studies: simulated errors are as designed, on the model and on other plants."""

import pickle

import numpy as np
import pytest

from inputdesign_cli import load_spec, parse_spec, simulate
from inputdesign_cli.compute.executor import Finished
from inputdesign_cli.errors import SpecError
from tests.support.matrix_specs import JENKINS
from tests.support.refusals import refusal

FLEXIBLE = "specs/flexible_transmission.yaml"
FIRST = "specs/first_order.yaml"
ARX = "specs/two_by_two_arx.yaml"
LOOP = "specs/two_by_two_loop.yaml"
MOTOR = "specs/motor_loop.yaml"
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
FAST = "solver.any_spectrum=false"
GIVEN = "spectrum={given: {type: white, power: 450}}"
TRUE = "[[0, 1.0, 0.4], [0, -0.5, 0.3]], [[0, 0.6, 0.2], [0, 1.2, -0.5]]"


def simulated(spec, *overrides):
    """The outcome of a study; a spec is a path or a text."""
    read = load_spec if spec.endswith(".yaml") else lambda text, changes: parse_spec(text, overrides=changes)
    return simulate(read(spec, list(overrides)))


def of_design(*asked):
    return simulated(*asked).result["simulation"]["inputs"]["design"]


def within_wishart(simulation):
    low, high = simulation["wishart_range"]
    for entry in simulation["inputs"].values():
        eigenvalues = np.array(entry["covariance_eigenvalues"])
        assert low < eigenvalues.min()
        assert eigenvalues.max() < high
        assert entry["not_converged"] == 0


@pytest.fixture(scope="module")
def flexible():
    return simulated(FLEXIBLE, "simulation.runs=200", FAST).result


def test_the_flexible_transmission_meets_r_adm_on_its_design_model_only(flexible):
    # Errata: 83 % of the runs for the design and 93 % for the white input on the true plant; 99 % and 100 %
    # where the plant is the design model. Four standard errors of 200 runs are 10.6, 7.3 and 2.8 %.
    design = flexible["simulation"]["inputs"]["design"]
    white = flexible["simulation"]["inputs"]["white_that_suffices"]
    assert design["within_r_adm"] == pytest.approx(0.83, abs=0.106)
    assert white["within_r_adm"] == pytest.approx(0.93, abs=0.073)
    assert design["on_design_model"]["within_r_adm"] == pytest.approx(0.99, abs=0.028)
    assert white["on_design_model"]["within_r_adm"] > 0.97
    low, middle, high = design["violations"]["frequency_quantiles"]
    assert 0.36 < low < middle < high < 0.42
    assert "initial-estimate-off" in {one["code"] for one in flexible["findings"]}
    simulation, designed = flexible["simulation"]["inputs"], flexible["power"]["excitation"][0]
    for name in ("design", "white"):
        assert simulation[name]["power"]["excitation"][0] == pytest.approx(designed, rel=1e-12)


PLANT = """
plant: {B: [0, 1, 0.4], F: [1, -0.7]}
noise: {variance: 0.5}
spectrum: {type: fir, order: 4}
report: {ellipses: [[b1, f1]]}
simulation: {runs: 60, seed: 1}
"""
D_OPTIMAL = "accuracy: {criterion: D}\nlimits: {input_power: 1}\n"
PRIOR = "prior: {information: [[50, 0, 0], [0, 40, 0], [0, 0, 60]]}"


def compared(text, *overrides):
    """The result, the share within the promised r_u, r_u over frequency, and the ellipse."""
    found = simulated(PLANT + text, *overrides)
    design = found.result["simulation"]["inputs"]["design"]
    (panel,) = found.curves["errors_design"].panels
    (pair,) = found.curves["ellipses"].pairs
    return found, design["within_promised_r_u"], (panel.frequency, panel.r_u), pair


def test_a_criterion_per_sample_is_simulated_like_one_for_the_whole_record():
    # log det M is stationary at its optimum: a gap of 1e-10 allows about its root in M, 1e-5.
    per_sample, *found = compared(f"{D_OPTIMAL}signal: {{samples: 400}}", "solver.tolerance=1e-10")
    of_length, *expected = compared(f"{D_OPTIMAL}experiment: {{samples: 400}}", "solver.tolerance=1e-10")
    assert (per_sample.result["samples"], of_length.result["samples"]) == (1, 400)
    assert found[0] == expected[0]
    np.testing.assert_allclose(np.interp(1.0, *found[1]), np.interp(1.0, *expected[1]), rtol=1e-5)
    for kind in ("covariance", "white"):
        one, other = (getattr(each[2], kind) for each in (found, expected))
        np.testing.assert_allclose(one, other, rtol=1e-5, atol=1e-12)
    (only,) = per_sample.result["findings"]
    assert (only["code"], only["figures"]) == ("other-length", {"counted": 1, "simulated": 400})
    assert "notes" not in of_length.result


@pytest.mark.parametrize("region", ["first_order", "ellipsoid"])
def test_prior_information_does_not_grow_with_the_length_of_the_record(region):
    given = ["spectrum={given: {type: white, power: 1}}", "simulation.runs=20"]
    accuracy = f"accuracy: {{model_error: {{relative: 0.2, region: {region}}}}}\n"
    short = f"{accuracy}experiment: {{samples: 100, {PRIOR}}}\nsignal: {{samples: 400}}"
    long = f"{accuracy}experiment: {{samples: 400, {PRIOR}}}"
    designed, *found = compared(short, *given)
    _, *expected = compared(long, *given)
    assert designed.result["samples"] == 100
    assert found[0] == expected[0]
    np.testing.assert_allclose(np.interp(1.0, *found[1]), np.interp(1.0, *expected[1]), rtol=1e-4)
    np.testing.assert_allclose(found[2].covariance, expected[2].covariance, rtol=1e-9)
    # bound.csv stays the statement of the design, for its own length.
    (bound,) = designed.curves["bound"].panels
    assert np.interp(1.0, bound.frequency, bound.r_u) > 1.5 * np.interp(1.0, *found[1])


@pytest.fixture(scope="module")
def studied():
    return simulated(ARX, "spectrum.order=2", "simulation={runs: 60, compare: [white, prbs]}", FAST)


def test_simulated_errors_on_the_design_model_are_within_r_u_and_r_adm(studied):
    """The records have the powers of the design; every entry has its error bands."""
    within_wishart(studied.result["simulation"])
    inputs, designed = studied.result["simulation"]["inputs"], studied.result["power"]["excitation"]
    # r_u is a joint region of 95 % for all entries at all frequencies.
    for name in ("design", "white", "prbs", "white_that_suffices"):
        assert inputs[name]["within_r_u_limits"][1] > 0.95
    assert inputs["design"]["within_r_adm_limits"][1] > 0.95
    assert inputs["design"]["theory_on_truth"]["worst_ratio"] == pytest.approx(1.0, abs=1e-3)
    assert inputs["white"]["theory_on_truth"]["worst_ratio"] > 1.5
    assert inputs["white_that_suffices"]["theory_on_truth"]["worst_ratio"] == pytest.approx(1.0, abs=1e-3)
    assert sum(inputs["design"]["power"]["input"]) == pytest.approx(sum(designed), rel=1e-6)
    np.testing.assert_allclose(inputs["design"]["power"]["input"], designed, rtol=0.02)
    for name in ("white", "prbs"):
        np.testing.assert_allclose(inputs[name]["power"]["input"], sum(designed) / 2, rtol=1e-6)
        assert inputs[name]["cost"] == pytest.approx(studied.result["cost"], rel=1e-6)
    panels = studied.curves["errors_design"].panels
    assert [band.entry for band in panels] == [(0, 0), (0, 1), (1, 0), (1, 1)]
    for band in panels:
        assert np.all(band.quantiles[0.05] <= band.quantiles[0.95])
        assert np.all(band.quantiles[0.95] < band.r_u)
    assert studied.curves["cloud_design"].pairs[0].estimates.shape == (60, 2)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("spec", "overrides"),
    [
        (JENKINS + "simulation: {runs: 100, seed: 2}\n", []),
        (IN_SECONDS, []),
        (IN_SECONDS, ["plant.sample=zoh"]),
    ],
)
def test_simulated_errors_of_box_jenkins_and_continuous_plants_are_within_r_u(spec, overrides):
    simulation = simulated(spec, *overrides).result["simulation"]
    within_wishart(simulation)
    design = simulation["inputs"]["design"]
    assert design["within_r_adm_limits"][1] > 0.95
    assert design["within_r_u_limits"][1] > 0.95
    assert design["within_r_u"] <= design["within_r_adm"]  # the design keeps r_u below r_adm


def test_estimates_are_those_of_a_true_system_that_differs_from_the_spec():
    plant = f"{{A: [[1, -0.9], [1, 0.4]], B: [{TRUE}]}}"
    result = simulated(
        ARX, GIVEN, f"simulation={{runs: 60, plant: {plant}, noise: {{relative_std: 0.1}}}}"
    ).result
    simulation = result["simulation"]
    design = simulation["inputs"]["design"]
    assert simulation["true_parameters"]["a1[1]"] == -0.9
    assert design["mean_estimate"]["a1[1]"] == pytest.approx(-0.9, abs=0.02)
    assert design["on_design_model"]["within_r_u_limits"][1] > 0.95
    assert design["within_r_u_limits"][1] > 0.95
    smallest = min(result["power"]["output"])
    np.testing.assert_allclose(simulation["true_variance"], 0.01 * smallest * np.eye(2), rtol=1e-9)


def test_no_r_u_is_stated_for_a_true_system_of_another_structure():
    plant = f"{{A: [[1, -0.7, 0.1], [1, 0.4]], B: [{TRUE}]}}"
    design = of_design(ARX, GIVEN, f"simulation={{runs: 20, plant: {plant}}}")
    assert "within_r_u" not in design
    assert "within_r_adm" in design


def test_simulated_errors_of_a_loop_are_within_r_adm_at_the_designed_powers():
    outcome = simulated(LOOP, "simulation={runs: 50, compare: [white]}", FAST)
    result, simulation = outcome.result, outcome.result["simulation"]
    within_wishart(simulation)
    design = simulation["inputs"]["design"]
    assert design["within_r_adm_limits"][1] > 0.95
    for kind in ("input", "output", "excitation"):  # the runs start from rest
        np.testing.assert_allclose(design["power"][kind], result["power"][kind], rtol=0.01)
        if kind in design["total_power"]:
            assert np.all(np.array(design["total_power"][kind]) > design["power"][kind])
    shown = outcome.tables["disturbance_design"].columns
    for i in (1, 2):  # the response has faded at the end
        assert np.abs(shown[f"y{i}_r"][-1]) < 0.2 * np.abs(shown[f"y{i}_r"]).max()
        mean = np.sum(shown[f"y{i}_r"] ** 2) / 2000
        assert mean == pytest.approx(result["power"]["output"][i - 1], rel=0.1)
    white = simulation["inputs"]["white"]
    assert white["theory_on_truth"]["worst_ratio"] > 1.2
    assert sum(white["power"]["excitation"]) == pytest.approx(sum(design["power"]["excitation"]))


@pytest.mark.slow
def test_simulated_errors_of_a_loop_around_a_held_plant_are_within_r_u():
    """The true motor differs from the spec; noise in u does not bias the direct method."""
    true = "plant: {continuous: {numerator: [2.2], denominator: [1, 11, 20]}, sample: zoh}"
    simulation = simulated(MOTOR, f"simulation={{runs: 80, {true}}}", "spectrum.order=8").result["simulation"]
    within_wishart(simulation)
    design = simulation["inputs"]["design"]
    assert design["within_r_u_limits"][1] > 0.95
    assert design["on_design_model"]["within_r_adm_limits"][1] > 0.95
    mean = [design["mean_estimate"][name] for name in ("b0", "a1", "a0")]
    np.testing.assert_allclose(mean, [2.2, 11, 20], rtol=0.01)


def test_a_true_system_that_the_controller_does_not_stabilise_is_refused():
    plant = "{A: [[1, -1.1], [1, -0.6]], B: [[[0, -1.0, -0.4], [0, 0]], [[0, 0], [0, 1.2, -0.5]]]}"
    found = refusal(lambda: simulated(LOOP, f"simulation={{runs: 5, plant: {plant}}}"), SpecError)
    assert (found.code, found.key) == ("unstable-loop", "simulation.plant")


IN_Q = "B: [[[0, 2], [0, 1]], [[0, 1], [0, 2]]], F: [[[1, -0.5], [1, -0.5]], [[1, -0.5], [1, -0.5]]]"
IN_S = (
    "continuous: {numerator: [[[2.77258872], [1.38629436]], [[1.38629436], [2.77258872]]], "
    "denominator: [1, 0.69314718]}, sample: zoh"
)
COLOURED = "noise: {C: [1, 0.8], variance: 0.5}"


@pytest.mark.first(1)
@pytest.mark.parametrize("nominal", [IN_Q, IN_S])
@pytest.mark.parametrize("loop", ["", ", controller: {numerator: [[[0.1], [0]], [[0], [0.1]]]}"])
def test_a_true_system_in_s_or_in_q_gives_the_same_simulation(nominal, loop):
    """b/(s + ln 2) behind a hold of one second is b/(2 ln 2) q^-1/(1 - q^-1/2)."""
    found = []
    for truth in (IN_Q, IN_S):
        text = f"plant: {{{nominal}}}\nnoise: {{variance: 0.5}}\nexperiment: {{samples: 200{loop}}}\n"
        text += "accuracy: {model_error: {relative: 0.5}}\nspectrum: {given: {type: white, power: 4}}\n"
        found.append(of_design(f"{text}simulation: {{runs: 20, plant: {{{truth}}}, {COLOURED}}}\n"))
    for key in ("power", "total_power"):
        for kind in ("input", "output"):
            np.testing.assert_allclose(found[0][key][kind], found[1][key][kind], rtol=1e-6)
    for name, value in found[0]["mean_estimate"].items():
        assert value == pytest.approx(found[1]["mean_estimate"][name], rel=1e-4, abs=1e-5)
    if not loop:  # the noise adds 0.5 (1 + 0.8^2) to the output power
        added = np.subtract(found[0]["total_power"]["output"], found[0]["power"]["output"])
        np.testing.assert_allclose(added, 0.82, rtol=0.3)


def test_prior_information_narrows_the_estimates():
    prior = "experiment.prior={information: [[1.0e+5]], parameters: ['a1[1]']}"
    design = of_design(ARX, "spectrum={given: {type: white, power: 5}}", "simulation={runs: 150}", prior)
    assert all(0.8 < ratio < 1.2 for ratio in design["rms_over_theory"].values())


@pytest.mark.first(1)
@pytest.mark.parametrize(
    ("spec", "signal"),
    [
        (FIRST, {"offset": 5.0, "quantisation": {"bits": 8, "range": 10}}),
        (ARX, {"offset": [5.0, -3.0], "quantisation": {"bits": 5, "range": 100}}),
        (FIRST, {}),
        (ARX, {}),
    ],
)
def test_the_delivered_record_is_simulated_about_its_operating_point(spec, signal):
    changes = [f"signal.{key}={value}" for key, value in signal.items()]
    result = simulated(spec, "simulation={runs: 20, excitation: record}", "spectrum.order=3", *changes).result
    tried = result["simulation"]["inputs"]["design"]["power"]["input"]
    np.testing.assert_allclose(tried, result["signal"]["power"])


class Elsewhere:
    """An executor that pickles tasks and does them in reverse order, as other processes may."""

    shares_files = True

    def run(self, function, tasks):
        for sent in reversed([pickle.dumps((function, task)) for task in tasks]):
            there, task = pickle.loads(sent)
            yield Finished(task, pickle.loads(pickle.dumps(there(task))))


@pytest.mark.first(2)
@pytest.mark.parametrize(
    ("spec", "overrides"),
    [
        (FIRST, ["spectrum.order=3"]),
        (ARX, [GIVEN]),
        (ARX, ["spectrum.order=2", "signal.type=binary"]),
        (ARX, ["spectrum={type: multisine, lines: 8}"]),
        (MOTOR, ["spectrum.order=3"]),
    ],
)
def test_equal_seeds_give_equal_estimates_in_any_executor(spec, overrides):
    asked = load_spec(spec, [*overrides, "simulation={runs: 30, seed: 5}", "signal.candidates=1"])
    here, there = simulate(asked), simulate(asked, executor=Elsewhere())
    means = [one.result["simulation"]["inputs"]["design"]["mean_estimate"] for one in (here, there)]
    assert means[0] == means[1]


@pytest.mark.slow
def test_uninformative_runs_are_counted_and_do_not_end_the_simulation():
    """Poles are so fast and noise so strong that some runs show a plant without dynamics."""
    entry = of_design(
        "plant:\n"
        "  continuous: {numerator: [[[1.3]], [[1.6]]], denominator: [[[1, 1.8]], [[1, 1.9]]]}\n"
        "  sample: zoh\n"
        "noise: {variance: [[16000, 10000], [10000, 17000]]}\nexperiment: {samples: 200}\n"
        "accuracy: {criterion: E}\nlimits: {input_power: 2}\nspectrum: {type: fir, order: 4}\n"
        "signal: {type: multisine, candidates: 1}\nsimulation: {runs: 10, seed: 1}\n"
    )
    assert 0 < entry["not_converged"] <= 10


@pytest.mark.slow
def test_the_design_reaches_the_cramer_rao_bound():
    overrides = ["simulation={runs: 500, seed: 4}", "experiment.samples=2000", "signal.samples=2000"]
    simulation = simulate(load_spec(ARX, overrides)).result["simulation"]
    within_wishart(simulation)
    ratios = np.array(list(simulation["inputs"]["design"]["rms_over_theory"].values()))
    # The error of one ratio of 500 runs is 3.2 %; the rms over ten parameters is within 5 %.
    assert np.sqrt(np.mean(ratios**2)) == pytest.approx(1.0, abs=0.05)


def test_covariances_of_one_channel_lie_in_the_range_of_the_wishart_distribution():
    overrides = ["simulation={runs: 150, seed: 2, compare: [white]}", "spectrum.order=5"]
    result = simulate(load_spec(FIRST, overrides)).result
    low, high = result["simulation"]["wishart_range"]
    # Output power 1e3 times that of the noise: the linear theory holds, up to a few per cent of transients.
    for entry in result["simulation"]["inputs"].values():
        eigenvalues = np.array(entry["covariance_eigenvalues"])
        assert 0.95 * low < eigenvalues.min()
        assert eigenvalues.max() < 1.05 * high
        assert entry["not_converged"] <= 0.01 * result["simulation"]["runs"]
    inputs = result["simulation"]["inputs"]
    assert inputs["white"]["within_r_adm"] < 0.9 < inputs["design"]["within_r_adm"]
    assert inputs["white_that_suffices"]["within_r_adm"] > 0.9
    assert "on_design_model" not in result["simulation"]["inputs"]["design"]


@pytest.mark.slow
def test_r_u_of_a_simulated_record_is_that_of_one_sample_over_the_root_of_n():
    """The spec is two_by_two.yaml, in continuous time, whose bound.csv is for one sample."""
    found = simulate(load_spec("specs/two_by_two.yaml", ["signal.samples=1024", "simulation.runs=2"]))
    for panel, bound in zip(found.curves["errors_design"].panels, found.curves["bound"].panels, strict=True):
        np.testing.assert_allclose(panel.r_u, bound.r_u / np.sqrt(1024), rtol=1e-9)


def test_simulated_noise_is_not_the_noise_that_the_record_was_drawn_from():
    """Seeds of candidates and runs must differ; with other seeds the largest ratio of 4000 runs is 1.32."""
    text = (
        "plant: {B: [0, 3.6], F: [1, -0.7]}\nnoise: {variance: 1.0}\nexperiment: {samples: 200}\n"
        "accuracy: {model_error: {relative: 0.05}}\nspectrum: {type: fir, order: 4}\n"
        "signal: {type: filtered_noise, seed: 1}\nsimulation: {runs: 110, seed: 1, excitation: record,"
        " plant: {B: [0, 3.4], F: [1, -0.75]}, noise: {variance: 0.8}}\n"
    )
    tried = simulate(parse_spec(text)).result["simulation"]["inputs"]["design"]
    assert tried.get("violations", {"largest_ratio": 1.0})["largest_ratio"] < 1.4
