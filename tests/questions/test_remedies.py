"""What is said to mend a refuted structure can be written into the spec that states it."""

import re
from pathlib import Path

import numpy as np
import pytest

from inputdesign_cli import load_spec, parse_spec
from inputdesign_cli.errors import SpecError
from inputdesign_cli.findings.refuted_structure import quantities, remedies_of
from inputdesign_cli.questions.assessment.build import build_identification
from inputdesign_cli.questions.least_cost.build import build_convex

SPEC = """
sample_time: 5
noise: {variance: 0.04}
experiment: {samples: 400}
accuracy: {model_error: {relative: 0.3, band: [0.001, 0.1]}}
spectrum: {type: fir, order: 8}
"""
SHORT = "{continuous: {gain: 2.1, time_constant: 180, dead_time: 25}, sample: zoh}"
IN_S = "{continuous: {numerator: [2.1], denominator: [180, 1]}, sample: zoh}"
NAMED = """{parameters: {K: 2.1, T: 180, L: 25}, sample: zoh,
  continuous: {numerator: [K], denominator: [T, 1], delay: L}}"""
STATES = "{parameters: {a: 0.03}, state_space: {A: [[-a]], B: [[1]], C: [[a]]}, sample: zoh}"
IN_Q = "{B: [0, 0.05], F: [1, -0.97]}"
NAMED_IN_Q = "{parameters: {b: 0.05, f: -0.97}, B: [0, b], F: [1, f]}"
PLANTS = {"short": SHORT, "s": IN_S, "named": NAMED, "states": STATES, "q": IN_Q, "named q": NAMED_IN_Q}
WORDS = {
    "short": "numerator: [K]",
    "s": "raise the orders of numerator and denominator",
    "named": "[T2, 1] as another factor of the denominator",
    "states": "a further state",
    "q": "raise the orders of B and F",
    "named q": "by a name in parameters",
}


def remedies(plant, *overrides):
    spec = parse_spec(f"plant: {plant}\n{SPEC}", overrides=overrides)
    return spec, remedies_of(build_identification(spec).nominal)


@pytest.mark.parametrize("kind", PLANTS)
def test_remedies_are_in_the_words_of_the_plant(kind):
    spec, found = remedies(PLANTS[kind])
    assert WORDS[kind] in found["plant"]
    for other, words in WORDS.items():
        assert other == kind or words not in found["plant"]
    for fault in ("noise", "drift"):
        (block,) = re.findall(r"noise: (\{.*\})\)", found[fault])
        build_convex(parse_spec(spec.to_yaml(), overrides=[f"noise={{variance: 0.04, {block[1:]}"]))


@pytest.mark.parametrize("kind", PLANTS)
def test_only_coefficients_have_orders(kind):
    """A gain or a lag that may be zero is not an order; c1 is, beside parameters of any name."""
    spec = parse_spec(f"plant: {PLANTS[kind]}\n{SPEC}", overrides=["noise={C: [1, -0.2], variance: 0.04}"])
    model = build_identification(spec).nominal
    orders = {"s": ("b0", "a0", "c1"), "q": ("b1", "f1", "c1")}.get(kind, ("c1",))
    found = dict(zip(model.names, quantities(model).tolist(), strict=True))
    assert found == {name: name not in orders for name in model.names}


ORDERS = {
    "first": ("time_constant: {}", ["180"], ("T1",), 18.0),
    "second": ("damping: {}, natural_frequency: {}", ["0.3", "0.02"], ("zeta", "w"), 5.0),
}


@pytest.mark.parametrize("late", [", dead_time: 25", ", dead_time: 0", ""], ids=["late", "at once", "no key"])
@pytest.mark.parametrize("order", ORDERS)
def test_a_lag_more_is_written_as_it_is_said(order, late):
    """Written into the spec it is the same plant behind a lag, all of it to be estimated."""
    keys, values, names, lag = ORDERS[order]
    plant = f"{{continuous: {{gain: 2.1, {keys.format(*values)}{late}}}, sample: zoh}}"
    spec, found = remedies(plant)
    parameters, continuous = re.findall(r"plant\.\w+: (\{.*?\})(?= and plant| in place)", found["plant"])
    more = f"plant: {{parameters: {parameters}, continuous: {continuous}, sample: zoh}}\n{SPEC}"
    model, before = (build_identification(one).nominal for one in (parse_spec(more), spec))
    assert model.names == ("K", *names, "T2", *(("L",) if late == ", dead_time: 25" else ()))
    w = np.array([1e-4, 1e-2, 0.1])
    # Samples are 5 s apart: at low frequencies a lag is a delay of as much.
    low = model.plant_at(w)[:, 0, 0] / before.plant_at(w)[:, 0, 0]
    assert low[0] == pytest.approx(1.0 / (1.0 + 1j * lag * w[0] / 5.0), rel=1e-6)
    assert np.all(np.diff(np.abs(low)) < 0.0)


def test_a_noise_that_drifts_is_not_told_to_drift():
    _, found = remedies(NAMED, "noise.drift=true", "noise.C=[1, -0.8]")
    assert "raise the order of D under noise" in found["drift"]
    assert "such as" not in found["noise"]


@pytest.mark.parametrize(
    "path", sorted((Path(__file__).parents[2] / "specs").glob("*.yaml")), ids=lambda path: path.stem
)
def test_every_shipped_plant_has_remedies(path):
    """Of regressions, which have no structure to mend, there is no such task."""
    try:
        model = build_identification(load_spec(path, design=False)).nominal
    except SpecError:
        return
    assert all(remedies_of(model).values())
