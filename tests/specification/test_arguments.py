"""What is wrong with an argument is told by its name; none is ignored."""

from pathlib import Path
from types import SimpleNamespace

import control
import numpy as np
import pytest

from inputdesign_cli import Spec, from_control
from inputdesign_cli.errors import SpecError
from inputdesign_cli.questions.building.system import build_model
from tests.support.refusals import refused

STATES = control.ss([[0, 1], [0, -3.5]], [[0], [10.0]], [[1, 0]], [[0]])
HEATER = control.tf([2.1], [180, 1])
SAMPLES = control.tf([0.1], [1, -0.8], 0.5)

PLACES = [
    ["a list"],
    "d",
    {"d": ("Q", 1, 1)},
    {"d": (["A"], 0, 0)},
    {"d": ("A", 5, 1)},
    {"d": ("A", -3, 1)},
    {"d": ("A", 1)},
    {"d": ("A", 1.0, 1)},
    {"d": None},
    {"d": ("A", 1, 1), "e": ("A", -1, -1)},
]

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


def test_places_count_as_in_python():
    spec = from_control(STATES, sample_time=0.1, parameters={"d": ("A", -1, np.int64(1)), "g": ["B", 1, 0]})
    assert build_model(spec).names == ("d", "g")


def test_poles_at_zero_are_delays():
    """z^-3 / (1 - 0.5 z^-1) has one parameter above and one below."""
    assert build_model(from_control(control.tf([1], [1, -0.5, 0, 0], 1))).names == ("b3", "f1")


def itself():
    holds = []
    holds.append(holds)
    return holds


NO_DATA = [{1, 2}, 3j, b"x", object(), range(3), np.array([1j]), itself()]


@pytest.mark.parametrize("value", NO_DATA, ids=[type(value).__name__ for value in NO_DATA])
def test_what_no_file_could_hold_is_refused_by_name(value):
    spec = from_control(HEATER)
    for key, call in (
        ("noise.variance", lambda: Spec.from_dict({"noise": {"variance": value}})),
        ("noise.variance", lambda: spec.with_(**{"noise.variance": value})),
        ("", lambda: Spec.from_dict(value)),
    ):
        assert refused(call)[0].key.startswith(key)


def test_keys_that_are_no_keys():
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
