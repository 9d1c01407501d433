"""Conversion from and to python-control systems, specs from plain data, results as arrays."""

from dataclasses import replace

import control
import numpy as np
import pytest

from inputdesign_cli import Spec, from_control, parse_spec, solve, to_control
from inputdesign_cli.errors import SpecError
from inputdesign_cli.questions.building.system import build_model
from tests.support.refusals import refusals

W = np.array([0.05, 0.4, 1.3])


def response(model, w):
    return model.plant_at(w)


def test_a_discrete_transfer_function_is_converted_in_both_directions():
    system = control.tf([0.3, 0.1], [1, -1.2, 0.5], 0.5)
    spec = from_control(system)
    model = build_model(spec)
    assert model.names == ("b1", "b2", "f1", "f2")
    assert spec.sample_time == 0.5
    np.testing.assert_allclose(response(model, W)[:, 0, 0], system(np.exp(1j * W)), rtol=1e-12)
    np.testing.assert_allclose(to_control(spec)(np.exp(1j * W)), system(np.exp(1j * W)), rtol=1e-12)


@pytest.mark.parametrize("delay", [None, 0.8])
def test_a_continuous_transfer_function_is_sampled_with_its_dead_time(delay):
    system = control.tf([2.0], [3.0, 1])
    spec = from_control(system, sample_time=0.5, delay=delay)
    model = build_model(spec)
    back = to_control(spec)
    assert back.dt == 0.5
    np.testing.assert_allclose(back(np.exp(1j * W)), response(model, W)[:, 0, 0], rtol=1e-10)
    if delay is None:
        held = control.sample_system(system, 0.5, "zoh")
        np.testing.assert_allclose(back(np.exp(1j * W)), held(np.exp(1j * W)), rtol=1e-10)


def test_a_continuous_system_may_stay_in_continuous_time():
    system = control.tf([[[2.0], [1.0, 0.4]]], [[[3.0, 1], [1, 0.8, 2]]])
    spec = from_control(system)
    expected = np.moveaxis(system(1j * W), -1, 0)
    np.testing.assert_allclose(response(build_model(spec), W), expected, rtol=1e-12)
    np.testing.assert_allclose(np.moveaxis(to_control(spec)(1j * W), -1, 0), expected, rtol=1e-12)
    assert refusals(lambda: to_control(from_control(system, delay=[[0.1, 0]])))[0].code == "not-supported"


def test_a_state_space_is_converted_by_transfer_functions_or_named_entries():
    A, B = np.array([[0.0, 1.0], [-2.0, -0.9]]), np.array([[0.0], [1.5]])
    system = control.ss(A, B, np.eye(2), np.zeros((2, 1)))
    w, expected = W, control.sample_system(system, 0.2, "zoh")
    by_entries = from_control(system, sample_time=0.2, parameters={"k": ("B", 1, 0)})
    for spec in (from_control(system, sample_time=0.2), by_entries):
        found = response(build_model(spec), w)
        wanted = np.moveaxis(expected(np.exp(1j * w)), -1, 0)
        np.testing.assert_allclose(found, wanted, rtol=1e-7)
        np.testing.assert_allclose(np.moveaxis(to_control(spec)(np.exp(1j * w)), -1, 0), wanted, rtol=1e-7)
    assert build_model(by_entries).names == ("k",)


def test_an_entry_of_a_state_space_has_only_the_poles_that_reach_it():
    system = control.ss(np.diag([-1.0, -2.0]), np.eye(2), np.eye(2), np.zeros((2, 2)))
    model = build_model(from_control(system, sample_time=0.1))
    assert model.names == ("b0[1,1]", "b0[2,2]", "a0[1,1]", "a0[2,2]")


@pytest.mark.parametrize(
    ("system", "code", "key"),
    [
        (control.frd([1, 2], [0.1, 0.2]), "not-supported", "plant"),
        (control.tf([1], [1, -0.5], True), "not-sampled", "sample_time"),
        (3.0, "not-supported", "plant"),
    ],
)
def test_objects_that_cannot_be_a_plant_are_refused(system, code, key):
    found = refusals(lambda: from_control(system))[0]
    assert (found.code, found.key) == (code, key)


DATA = {
    "plant": {"B": [0, 3.6], "F": [1, -0.7]},
    "noise": {"variance": 1.0},
    "experiment": {"samples": 500},
    "accuracy": {"standard_deviation": {"b1": 0.01}},
    "spectrum": {"type": "fir", "order": 3},
    "signal": {"samples": 100, "seed": 1},
    "solver": {"any_spectrum": False},
}


def test_a_spec_from_plain_data_equals_that_from_its_text():
    spec = Spec.from_dict({**DATA, "plant": {"B": np.array([0, 3.6]), "F": (1, -0.7)}})
    assert spec.sha256 == parse_spec(spec.to_yaml()).sha256 == Spec.from_dict(DATA).sha256
    other = spec.with_(**{"experiment.samples": np.int64(600), "signal.seed": None})
    assert (other.experiment.samples, other.signal.seed, spec.experiment.samples) == (600, None, 500)
    with pytest.raises(SpecError):
        spec.with_(**{"plant.F": [1, -1.7]})
    with pytest.raises(SpecError):
        Spec.from_dict({})


def test_results_are_arrays():
    outcome = solve(Spec.from_dict(DATA))
    c = outcome.result["spectrum"]["coefficients"]
    table = outcome.tables["spectrum"].columns
    frequency, phi = table["frequency_rad_per_s"], table["phi"]
    np.testing.assert_allclose(outcome.spectrum(frequency[5:9])[:, 0, 0], phi[5:9])
    np.testing.assert_array_equal(outcome.spectrum.frequency, frequency)
    np.testing.assert_array_equal(outcome.spectrum.phi, phi)
    w = np.array([0.3, 2.0])
    exact = c[0] + 2 * sum(c[k] * np.cos(k * w) for k in range(1, len(c)))
    np.testing.assert_allclose(outcome.spectrum(w)[:, 0, 0], exact, rtol=1e-2)
    np.testing.assert_allclose(outcome.covariance @ outcome.information, np.eye(2), atol=1e-6)
    assert outcome.signal.shape == (100, 1)
    assert "r_u" in outcome.bound
    lines = solve(Spec.from_dict({**DATA, "spectrum": {"type": "multisine", "frequencies": [0.2, 0.5]}}))
    power = lines.spectrum(np.array([0.2, 0.3, 0.5]))[:, 0, 0].real
    assert power[1] == 0.0
    assert power.sum() == pytest.approx(lines.result["cost"], rel=1e-6)


def test_missing_tables_of_a_result_raise_attribute_errors():
    found = solve(Spec.from_dict(DATA))
    assert [one.message for one in found.findings] == list(found.result.get("notes", []))
    bare = replace(found, curves={}, tables={})
    for name in ("signal", "bound"):
        with pytest.raises(AttributeError, match=name):
            getattr(bare, name)
    with pytest.raises(AttributeError, match="spectrum"):
        _ = bare.spectrum


def test_the_power_of_a_line_is_found_by_four_digits_of_its_frequency():
    """The lines are multiples of pi/(60 sample_time); frequencies are numbers or arrays of any shape."""
    heater = {"continuous": {"gain": 2.1, "time_constant": 180, "dead_time": 25}, "sample": "zoh"}
    spec = {
        "sample_time": 4.76,
        "plant": heater,
        "noise": {"variance": 0.04},
        "experiment": {"samples": 720},
        "accuracy": {"standard_deviation": {"gain": 0.05, "dead_time": 2}},
        "spectrum": {"type": "multisine", "lines": 60},
        "solver": {"any_spectrum": False},
    }
    outcome = solve(Spec.from_dict(spec))
    columns = outcome.tables["spectrum"].columns
    frequency, power = columns["frequency_rad_per_s"], columns["power"]
    written = np.array([float(f"{w:.4g}") for w in frequency])
    np.testing.assert_array_equal(outcome.spectrum(written)[:, 0, 0].real, power)
    between = 0.5 * (frequency[1:] + frequency[:-1])
    assert not np.any(outcome.spectrum(between))
    assert outcome.spectrum(written[0]) == np.array([[power[0]]])
    assert outcome.spectrum(written[:4].reshape(2, 2)).shape == (2, 2, 1, 1)
