"""Nearly unidentifiable parameters: designs where precision suffices, and no claims where it does not."""

from __future__ import annotations

import math

import numpy as np
import pytest

from inputdesign_cli import parse_spec, solve
from inputdesign_cli.errors import InaccurateError, SpecError
from tests.support.refusals import code_of, refusals


def worst_ratio(B, F, variance, lines, samples, relative, alpha, band):
    """The worst r_u / r_adm of an output-error model by sums over its lines, with scaled parameters."""
    w, powers = np.asarray(lines["frequencies"]), np.asarray(lines["powers"])

    def gradients(w):
        z = np.exp(-1j * w)
        b, f = np.polyval(B[::-1], z), np.polyval(F[::-1], z)
        powers_of_b = [i for i, c in enumerate(B) if c]
        rows = [z**i / f for i in powers_of_b] + [-(z**i) * b / f**2 for i in range(1, len(F))]
        return b / f, np.array(rows)

    psi = gradients(w)[1] * np.sqrt(samples * powers / variance)
    stacked = np.concatenate([psi.real, psi.imag], axis=1).T
    scale = np.linalg.norm(stacked, axis=0)
    triangle = np.linalg.qr(stacked / scale, mode="r")
    at = np.linspace(*band, 2000)
    G, dG = gradients(at)
    half = np.linalg.solve(triangle.T, dG / scale[:, None])
    real = np.stack([half.real, half.imag])
    largest = np.linalg.eigvalsh(np.einsum("ikn,jkn->nij", real, real))[:, -1]
    return float(np.max(alpha * np.sqrt(largest) / (relative * np.abs(G))))


@pytest.mark.parametrize("pole", [0.999, 0.9999998, 0.99999999])
def test_lines_determine_a_plant_with_a_pole_next_to_the_unit_circle(pole):
    text = f"""
plant: {{B: [0, 0.5, 0.2], F: [1, -{pole}]}}
noise: {{variance: 0.1}}
experiment: {{samples: 500}}
accuracy: {{model_error: {{relative: 0.1, alpha: 2, band: [0.1, 3]}}}}
spectrum: {{type: multisine, lines: 20}}
"""
    found = solve(parse_spec(text)).result
    assert found["status"] == "optimal"
    ratio = worst_ratio(
        [0, 0.5, 0.2], [1, -pole], 0.1, found["spectrum"], 500, relative=0.1, alpha=2, band=(0.1, 3)
    )
    assert ratio == pytest.approx(1.0, abs=1e-6)


@pytest.mark.parametrize(("samples", "told"), [(20, False), (30, False), (100, True)])
def test_a_record_claims_no_accuracy_that_rounding_decides(samples, told):
    F = np.poly([0.900, 0.901, 0.902, 0.903, 0.904, 0.905])
    text = f"""
plant: {{B: [0, 1.0], F: {F.tolist()}}}
noise: {{variance: 1}}
experiment: {{samples: {samples}}}
accuracy: {{model_error: {{relative: 0.1, alpha: 2}}}}
spectrum: {{type: fir, order: 10}}
signal: {{seed: 1}}
"""
    found = solve(parse_spec(text)).result
    assert ("worst_ratio" in found["signal"]) == told
    assert ("record-undetermined" in [one["code"] for one in found.get("findings", [])]) != told
    if told:  # by 60 digits: 0.999999990644
        assert math.isclose(found["signal"]["worst_ratio"], 1.0, abs_tol=1e-6)


NEAR = """
plant: {B: [0, 1], F: [1, -0.9999998, 0]}
noise: {C: [1, -0.9999999], variance: 1}
experiment: {samples: 500}
accuracy: {model_error: {relative: 0.1, band: [0.01, 3]}}
"""


def test_a_singular_excitation_is_refused_as_such_and_lines_give_an_optimum():
    told = refusals(lambda: solve(parse_spec(NEAR)), InaccurateError)[0]
    assert told.code == "numerically-singular"
    lines = ["limits={band: [0.01, 3.14]}", "spectrum={type: multisine, lines: 20}"]
    result = solve(parse_spec(NEAR, overrides=lines)).result
    assert result["status"] == "optimal"
    assert result["findings"][0]["code"] == "experiment-short"


@pytest.mark.parametrize(
    ("pole", "of_noise", "told"), [(0.5, 0, False), (0.99, 0, False), (0.999, 0, True), (0.5, 0.999, False)]
)
def test_an_experiment_shorter_than_its_slowest_mode_is_reported(pole, of_noise, told):
    """Slow modes of the noise are not reported."""
    spec = f"""
plant: {{B: [0, 1], F: [1, {-pole}]}}
noise: {{variance: 1, D: [1, {-of_noise}]}}
experiment: {{samples: 500}}
accuracy: {{model_error: {{relative: 0.1, band: [0.01, 3]}}}}
spectrum: {{type: fir, order: 3}}
"""
    findings = solve(parse_spec(spec)).result.get("findings", [])
    assert any(one["code"] == "experiment-short" for one in findings) == told


FAST = """
sample_time: 1
plant: {{continuous: {{gain: 2, {dynamics}}}, sample: zoh}}
noise: {{variance: 0.04}}
experiment: {{samples: 5000}}
accuracy: {{model_error: {{relative: 0.1}}}}
spectrum: {{type: fir, order: 4}}
solver: {{any_spectrum: false}}
signal: {{samples: 100}}
"""


@pytest.mark.first(6)
@pytest.mark.parametrize(
    "dynamics",
    [
        *[f"time_constant: {T:.1e}" for T in np.geomspace(1e-4, 1e3, 8)],
        *[f"time_constant: {T:.1e}, dead_time: 2.5" for T in np.geomspace(1e-3, 1e2, 6)],
        *[f"damping: 0.5, natural_frequency: {w:.1e}" for w in np.geomspace(1e-2, 1e3, 6)],
    ],
)
def test_dynamics_faster_than_the_sampling_are_not_taken_for_poles_on_the_circle(dynamics):
    """A mode decays by exp(-h/T) within a sample; below rounding no sample shows it."""
    try:
        found = solve(parse_spec(FAST.format(dynamics=dynamics))).result
    except (SpecError, InaccurateError) as error:
        (told,) = error.diagnostics
        assert told.code in ("without-effect", "numerically-singular", "not-identifiable")
        number = float(dynamics.split()[1].strip(",")) if "time" in dynamics[:4] else 0.0
        assert number < 0.2  # slow plants are never refused
    else:
        assert found["status"] == "optimal"


def test_a_predictor_pole_on_the_unit_circle_is_not_called_an_integrating_plant():
    states = "A: [[a]], B: [[1]], C: [[1]], K: [['a - 1']], time: discrete"
    text = f"""
plant: {{parameters: {{a: 0.9}}, state_space: {{{states}}}}}
noise: {{variance: 1}}
experiment: {{samples: 500}}
accuracy: {{model_error: {{relative: 0.1}}}}
"""
    assert code_of(solve, parse_spec(text)) == "unstable-polynomial"
