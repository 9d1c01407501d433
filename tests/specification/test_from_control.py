"""Systems of python-control as plants: states become transfer functions, and wrong arguments are named."""

from pathlib import Path
from types import SimpleNamespace

import control
import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

from inputdesign_cli import Spec, from_control
from inputdesign_cli.errors import SpecError
from inputdesign_cli.questions.building.system import build_model
from inputdesign_cli.specification import transfer_of_states
from tests.support.refusals import refused

RATES = st.lists(st.floats(0.05, 20.0), min_size=1, max_size=5)


def modes(rates, gains):
    """Parallel modes: the response is the sum of gain / (s + rate)."""
    n = len(rates)
    return -np.diag(rates), np.ones((n, 1)), np.array([gains]), np.zeros((1, 1))


def transfer_functions(system):
    matrices = (system.A, system.B, system.C, system.D)
    return transfer_of_states.transfer_functions(*matrices, discrete=system.isdtime(strict=True))


def response(entry, points):
    return np.polyval(entry[0], points) / np.polyval(entry[1], points)


@settings(max_examples=20, deadline=None)
@given(rates=RATES, seed=st.integers(0, 99), unit=st.sampled_from([1e-9, 1e-5, 1.0, 1e5, 1e9]))
def test_transfer_functions_have_the_response_of_the_states_in_every_unit_of_time(rates, seed, unit):
    """Coordinates are mixed, and time runs in units of `unit`."""
    rng = np.random.default_rng(seed)
    n = len(rates)
    gains = rng.choice([-1.0, 1.0], n) * rng.uniform(0.2, 2.0, n)
    A, b, c, d = modes(rates, gains)
    mixed, _ = np.linalg.qr(rng.standard_normal((n, n)))
    system = control.ss(unit * mixed.T @ A @ mixed, unit * mixed.T @ b, c @ mixed, d)
    ((entry,),) = transfer_functions(system)
    w = np.geomspace(0.01, 100, 40)
    exact = sum(g / (1j * w + r) for g, r in zip(gains, rates, strict=True))
    size = sum(abs(g / (1j * w + r)) for g, r in zip(gains, rates, strict=True))
    assert np.all(np.abs(response(entry, 1j * w * unit) - exact) <= 1e-8 * np.abs(exact) + 1e-11 * size)
    assert len(entry[0]) <= len(entry[1]) <= n + 1


@pytest.mark.parametrize("unit", [1e-9, 1e-4, 1.0, 1e5, 1e9])
@pytest.mark.parametrize(
    ("zeros", "poles"),
    [
        ([-1.5, -2.5, -3.5], [-1.0, -2, -3]),
        ([-1.5, -2.5, -3.5], [-1.0, -2, -3, -4]),
        ([-1.5, -2.5, -3.5, -4.5], [-1.0, -2, -3, -4, -5]),
        ([-3.0], [-1.0, -20]),
        ([-1.001] * 4, [-1.0] * 5),
        ([], [-1.0, -1, 0]),
        ([-1.0000001], [-1.0, -2]),
    ],
)
def test_neither_fast_nor_slow_systems_lose_zeros_or_poles(zeros, poles, unit):
    """Small leading coefficients were lost, and zeros near poles in rad/time_unit."""
    gain = unit ** (len(poles) - len(zeros))
    above, below = (np.atleast_1d(np.poly(np.array(roots) * unit)) for roots in (zeros, poles))
    n = len(poles)
    c = gain * np.pad(above, (n + 1 - above.size, 0))  # in companion form, badly scaled
    A = np.vstack([-below[1:], np.eye(n)[:-1]])
    ((entry,),) = transfer_functions(control.ss(A, np.eye(n)[:, [0]], [c[1:] - c[0] * below[1:]], [[c[0]]]))
    s = 1j * np.geomspace(0.01, 100, 60)
    exact = np.prod([s - z for z in zeros], axis=0) / np.prod([s - p for p in poles], axis=0)
    np.testing.assert_allclose(response(entry, s * unit), exact, rtol=1e-8)
    assert [len(part) for part in entry] == [len(zeros) + 1, len(poles) + 1]


def test_a_slow_discrete_pole_is_not_cancelled_by_a_nearby_zero():
    zero, pole = 0.9999999, 0.99999995
    ((entry,),) = transfer_functions(control.ss(control.zpk([zero], [pole, 0.5], 0.1, dt=1)))
    z = np.exp(1j * np.geomspace(1e-9, 3.0, 60))
    np.testing.assert_allclose(response(entry, z), 0.1 * (z - zero) / (z - pole) / (z - 0.5), rtol=1e-8)


@pytest.mark.parametrize("unit", [1e-7, 1.0, 1e6])
@pytest.mark.parametrize("hidden", [-5.0, 0.0, 3.0])
def test_a_mode_that_no_input_reaches_is_no_pole(unit, hidden):
    A, b, c, d = modes([1.0, 2.0, -hidden], [1.0, 1.0, 1.0])
    b[2] = 0.0
    ((entry,),) = transfer_functions(control.ss(unit * A, unit * b, c, d))
    np.testing.assert_allclose(-np.sort(-np.roots(entry[1])), [-unit, -2 * unit], rtol=1e-12)


def test_a_chain_has_no_zeros_in_any_coordinates():
    rng = np.random.default_rng(3)
    A = -np.diag([1, 2, 3, 4, 5.0]) + np.eye(5, k=1)
    mixed, _ = np.linalg.qr(rng.standard_normal((5, 5)))
    b, c = np.eye(5)[:, [4]], np.eye(5)[[0]]
    ((entry,),) = transfer_functions(control.ss(mixed.T @ A @ mixed, mixed.T @ b, c @ mixed, [[0.0]]))
    np.testing.assert_allclose(entry[0], [1.0], rtol=1e-11)


def test_repeated_poles_go_to_the_entries_that_they_reach():
    B = np.array([[1.0, 0], [0, 1], [0, 1]])
    rows = transfer_functions(control.ss(np.diag([-1.0, -1, -2]), B, np.eye(3), np.zeros((3, 2))))
    assert rows == [[([1.0], [1.0, 1.0]), ([0.0], [1.0])]] + [
        [([0.0], [1.0]), ([1.0], [1.0, pole])] for pole in (1.0, 2.0)
    ]


def test_a_pure_gain_is_converted_and_an_inaccurate_conversion_is_refused():
    assert transfer_functions(control.ss([], [], [], [[2.0]])) == [[([2.0], [1.0])]]
    # Poles that the coefficients of a polynomial in z no longer distinguish.
    poles = [1 - k * 1e-6 for k in (1, 2, 3, 4)]
    states = control.ss(np.diag(poles), np.ones((4, 1)), np.ones((1, 4)), [[0.0]], 1.0)
    for system in (states, control.ss([[1e200, 1], [1, -1e200]], [[1.0], [1]], [[1.0, 1]], [[0.0]])):
        assert refused(from_control, system)[0].code == "inaccurate-conversion"


STATES = control.ss([[0, 1], [0, -3.5]], [[0], [10.0]], [[1, 0]], [[0]])
HEATER = control.tf([2.1], [180, 1])
SAMPLES = control.tf([0.1], [1, -0.8], 0.5)
PLACES = [
    ["a list"], "d", {"d": ("Q", 1, 1)}, {"d": (["A"], 0, 0)}, {"d": ("A", 5, 1)}, {"d": ("A", -3, 1)},
    {"d": ("A", 1)}, {"d": ("A", 1.0, 1)}, {"d": None}, {"d": ("A", 1, 1), "e": ("A", -1, -1)},
]  # fmt: skip
WRONG = [
    *((STATES, "parameters", {"parameters": places}) for places in PLACES),
    (HEATER, "parameters", {"parameters": {"d": ("A", 0, 0)}, "delay": 5}),
    (SAMPLES, "sample_time", {"sample_time": 2.0}),
    (SAMPLES, "delay", {"delay": 0}),
    (HEATER, "known", {"known": "b0"}),
    (HEATER, "plant", {"plant": {"B": [0, 1]}}),
    (HEATER, "sample_time", {"sample_time": "a"}),
    (HEATER, "sample_time", {"sample_time": [1.0]}),
    (HEATER, "delay", {"delay": "x"}),
    (HEATER, "delay", {"delay": {1.0}}),
    (HEATER, "noise", {"noise": [1]}),
    (HEATER, "noise", {"noise": SimpleNamespace(variance=1)}),
    (HEATER, "experiment", {"experiment": {"samples": 3j}}),
    (control.tf([1, 0.2, 0.1], [1, -0.5], 1), "plant", {}),
]


@pytest.mark.parametrize(("system", "name", "arguments"), WRONG)
def test_a_wrong_argument_of_from_control_is_named(system, name, arguments):
    found = refused(from_control, system, **arguments)
    for one in found:
        assert name in one.key.replace("[", ".").split(".")
        assert name in one.message or name == "plant"
        assert one.hint or " must be " in one.message


def test_negative_places_in_a_matrix_count_from_its_end():
    spec = from_control(STATES, sample_time=0.1, parameters={"d": ("A", -1, np.int64(1)), "g": ["B", 1, 0]})
    assert build_model(spec).names == ("d", "g")


def test_poles_at_zero_are_delays():
    """z^-3 / (1 - 0.5 z^-1) has one parameter in the numerator and one in the denominator."""
    assert build_model(from_control(control.tf([1], [1, -0.5, 0, 0], 1))).names == ("b3", "f1")


def itself():
    holds = []
    holds.append(holds)
    return holds


NO_DATA = [{1, 2}, 3j, b"x", object(), range(3), np.array([1j]), itself()]


@pytest.mark.parametrize("value", NO_DATA, ids=[type(value).__name__ for value in NO_DATA])
def test_values_that_no_file_could_hold_are_refused_by_key(value):
    spec = from_control(HEATER)
    for key, call in (
        ("noise.variance", lambda: Spec.from_dict({"noise": {"variance": value}})),
        ("noise.variance", lambda: spec.with_(**{"noise.variance": value})),
        ("", lambda: Spec.from_dict(value)),
    ):
        assert refused(call)[0].key.startswith(key)


def test_malformed_keys_are_refused():
    spec = from_control(HEATER)
    for call in (
        lambda: spec.with_(**{"title=x": 1}),
        lambda: spec.with_(**{"": 1}),
        lambda: Spec.from_dict({"title": "x", 1: 2, "1": 3}),
        lambda: Spec.from_dict({}, folder=3),
    ):
        with pytest.raises(SpecError):
            call()


def test_names_of_files_may_be_paths():
    prior = {"information": Path("there-is-none.csv")}
    spec = from_control(HEATER, experiment={"prior": prior})
    assert spec.experiment.prior.information == "there-is-none.csv"
