"""What memory or time cannot hold is refused before it starts, and what only scales information is not."""

from __future__ import annotations

import numpy as np
import pytest

from inputdesign_cli import parse_spec, solve, validate
from tests.support.refusals import refusal

PLANT = "plant: {B: [0, 3.6], F: [1, -0.7]}\nnoise: {C: [1, -0.9], variance: 1.0}\n"
BOUND = "accuracy: {model_error: {relative: 0.01, alpha: 2.45}}\nspectrum: {type: fir, order: 3}\n"


def refused(text):
    diagnostic = refusal(lambda: validate(parse_spec(text)))
    assert diagnostic.code == "too-large"
    return diagnostic


def test_samples_scale_information_and_need_no_room():
    few, many = (solve(parse_spec(f"{PLANT}{BOUND}experiment: {{samples: {n}}}")) for n in (500, 10**15))
    assert many.result["cost"] * 10**15 == pytest.approx(few.result["cost"] * 500, rel=1e-6)
    assert "signal" in few.result
    assert "signal" not in many.result
    assert "signal.samples" in " ".join(many.result["notes"])


def test_a_record_that_is_asked_for_has_to_fit():
    found = refused(f"{PLANT}{BOUND}experiment: {{samples: {10**15}}}\nsignal: {{seed: 1}}")
    assert found.key == "experiment.samples"
    assert "signal.samples: 1000000" in found.hint


def test_the_record_of_a_shortest_experiment_may_be_too_long():
    text = (
        f"{PLANT}{BOUND}objective: shortest_experiment\nlimits: {{input_power: 1.0e-9}}\nsignal: {{seed: 1}}"
    )
    found = solve(parse_spec(text)).result
    assert found["samples"] > 10**9
    assert "signal" not in found


def test_a_model_of_many_parameters_is_refused_with_what_fits():
    zeros = ", ".join(["0"] * 150)
    found = refused(f"plant: {{B: [0, 1], A: [1, {zeros}, 0.5]}}\nnoise: {{variance: 1}}\n{BOUND}")
    assert found.key == "plant"
    assert "127 parameters fit" in found.hint


@pytest.mark.slow
def test_a_wide_plant_of_long_polynomials_is_refused():
    row = ", ".join(["[0" + ", 1" * 100 + "]"] * 20)
    assert (
        refused(f"plant: {{B: [{', '.join([f'[{row}]'] * 20)}]}}\nnoise: {{variance: 1}}\n{BOUND}").key
        == "plant"
    )


def test_the_solver_is_given_what_is_left(slow_solver):
    text = f"{PLANT}{BOUND}experiment: {{samples: 500}}\n".replace("order: 3", "order: 20")
    solve(parse_spec(text + "solver: {time_limit: 10000}"))
    np.testing.assert_allclose(slow_solver, 10000.0 - 3.0 * np.arange(len(slow_solver)))
    slow_solver.clear()
    solve(parse_spec(text + "solver: {time_limit: 7}"))
    assert slow_solver == pytest.approx([7.0, 4.0, 1.0])
