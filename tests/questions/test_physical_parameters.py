"""Known and named parameters and dead times: closed forms, estimates, domains of expressions."""

import json

import numpy as np
import pytest
import scipy.signal

from inputdesign_cli import identify as estimated, parse_spec, solve
from inputdesign_cli.errors import DataError
from inputdesign_cli.identification import identify
from inputdesign_cli.plant import input_gradients, noise_gradients
from inputdesign_cli.questions import assess
from inputdesign_cli.questions.building.system import build_model
from inputdesign_cli.specification import Spec
from tests.support.outcomes import codes_in

REST = """
sample_time: 0.5
noise: {variance: 0.1}
experiment: {samples: 300}
accuracy: {model_error: {relative: 0.1, band: [0.05, 1.5]}}
spectrum: {type: fir, order: 8}
solver: {tolerance: 1.0e-10}
"""


PROCESS = "{continuous: {gain: 2.0, time_constant: 3.0, dead_time: 1.685}, sample: zoh}"


def spec_of(plant, rest=REST) -> Spec:
    return parse_spec(f"plant: {plant}\n{rest}")


def test_the_information_of_a_dead_time_has_its_closed_form():
    """G = e^(-tau s) alone: M = N / sigma^2 (1/2 pi) int w^2 Phi, power P flat over [-W, W]: N P W^2 / 3."""
    text = (
        "plant: {continuous: {numerator: [1], denominator: [1], delay: 0.7}, known: [b0]}\n"
        "noise: {variance: 0.1}\nexperiment: {samples: 300}\nlimits: {band: [0, 2]}\nsample_time: 0.5\n"
        "accuracy: {standard_deviation: {delay: 0.01}}\nspectrum: {type: white}\n"
        "solver: {any_spectrum: false}"
    )
    power = solve(parse_spec(text)).result["cost"]
    assert power == pytest.approx(0.1 / (300 * 2.0**2 / 3.0 * 0.01**2), rel=1e-9)


def record_of(model, samples=600, seed=0):
    rng = np.random.default_rng(seed)
    u = np.repeat(rng.choice([-1.0, 1.0], (samples // 4, model.inputs)), 4, axis=0)
    e = rng.normal(size=(samples, model.outputs)) @ np.linalg.cholesky(model.covariance).T
    return u, sum(model.simulate(u, e, 1.0))


@pytest.mark.slow
@pytest.mark.parametrize("nominal", ["[2.0, 3.0, 1.685]", "[1.0, 8.0, 9.0]"])
def test_gain_time_constant_and_dead_time_are_found_from_poor_nominal_values(nominal):
    """Within four standard deviations, whatever the nominal values."""
    words = dict(zip(("gain", "time_constant", "dead_time"), json.loads(nominal), strict=True))
    truth = build_model(spec_of(PROCESS))
    start = build_model(spec_of(json.dumps({"continuous": words, "sample": "zoh"})))
    u, y = record_of(truth)
    found = identify(start, u, y, start=start.theta)
    assert found.names == ("gain", "time_constant", "dead_time")
    deviation = np.abs(found.theta - truth.theta) / np.sqrt(np.diag(found.covariance))
    assert np.all(deviation < 4.0)
    assert found.tests.failed == ()


COLOURED = (
    "{noise: {C: [1, 0.5], D: [1, -0.3], variance: 0.04, known: %s}, experiment: {samples: 300}, plant: "
    "{parameters: {%s: 2.1, T: 18}, continuous: {gain: %s, time_constant: T}, sample: zoh, known: %s}}"
)


@pytest.mark.parametrize("name", ["c2", "d0", "noise_0", "noise_1", "b0", "delay", "a1", "e0", "p0", "gain"])
@pytest.mark.parametrize(
    ("of_plant", "of_noise"), [((), ()), ((), ("c1",)), (("T",), ("d1",)), (("name",), ())]
)
def test_known_parameters_of_plant_and_noise_do_not_affect_each_other(name, of_plant, of_noise):
    """The gradients equal the gradients of a plant whose parameter is called K, whatever its name."""

    def model_of(called):
        listed = json.dumps([called if one == "name" else one for one in of_plant])
        # An empty list is not accepted as a list of names.
        text = COLOURED % (json.dumps(of_noise), called, called, listed)
        return build_model(parse_spec(text.replace(", known: []", ""), design=False))

    w, found, other = np.array([0.1, 1.0]), model_of(name), model_of("K")
    assert found.names == tuple(name if one == "K" else one for one in other.names)
    np.testing.assert_array_equal(input_gradients([found], w)[0], input_gradients([other], w)[0])
    np.testing.assert_array_equal(noise_gradients([found], w)[0], noise_gradients([other], w)[0])


@pytest.mark.parametrize(("end", "stopped"), [(22.0, True), (10.0, False)])
def test_an_estimate_stopped_at_the_end_of_an_expression_leaves_the_verdict_open(end, stopped, tmp_path):
    """The plant has T = 20; an expression that is undefined below 22 stops the estimate there."""
    rng = np.random.default_rng(3)
    u, pole = np.repeat(rng.choice([-1.0, 1.0], 80), 5), np.exp(-5.0 / 20.0)
    y = scipy.signal.lfilter([0.0, 0.0, 2.0 * (1.0 - pole)], [1.0, -pole], u) + 0.2 * rng.standard_normal(400)
    np.savetxt(tmp_path / "log.csv", np.c_[u, y], delimiter=",", header="u,y", comments="")
    spec = parse_spec(f"""
sample_time: 5
plant:
  parameters: {{K: 2, T: 25}}
  B: [0, 0, K*(1 - exp(-5/T))]
  F: [1, "-exp(-5/T) + 0*log(T - {end})"]
noise: {{variance: 0.04}}
experiment: {{samples: 400}}
accuracy: {{model_error: {{relative: 0.5}}}}
""")
    judged = assess(spec, [tmp_path / "log.csv"])
    assert ("stopped-at-an-end" in codes_in(judged.results.result)) == stopped
    assert judged.verdict == ("undecided" if stopped else "met")


def _held(gain, seed):
    """(300, 2): u, held for 3 to 11 samples of one second, and y of gain/(6 s + 1) with noise."""
    rng = np.random.default_rng(seed)
    u = np.repeat(rng.choice([-1.0, 1.0], 60), rng.integers(3, 12, 60))[:300]
    pole = np.exp(-1.0 / 6.0)
    y = scipy.signal.lfilter([0.0, gain * (1.0 - pole)], [1.0, -pole], u)
    return np.c_[u, y + 0.1 * rng.standard_normal(300)]


_LAG = """
sample_time: 1
plant: {parameters: {T: 6, p: %g}, continuous: {numerator: ["%s"], denominator: [T, 1]}, sample: zoh}
noise: {variance: 0.02}
experiment: {samples: 300}
"""


@pytest.mark.slow
def test_a_search_that_a_pole_of_an_expression_blocks_is_refused_with_where_it_ended(tmp_path):
    """1/(p - 1) from p = 3 does not reach p = 0.5: p grows until it has no effect."""
    np.savetxt(tmp_path / "log.csv", _held(-2.0, 4), delimiter=",", header="u,y", comments="")
    with pytest.raises(DataError) as caught:
        estimated(parse_spec(_LAG % (3.0, "1/(p - 1)"), design=False), tmp_path / "log.csv")
    (diagnostic,) = caught.value.diagnostics
    assert diagnostic.code == "not-exciting"
    assert diagnostic.message.endswith("parameters: p")
    assert float(diagnostic.hint.partition("p = ")[2].partition(")")[0]) > 1e6
    assert "start elsewhere" in diagnostic.hint
