"""A log whose output wanders as a random walk does, beside the steps of its input."""

import numpy as np
import pytest
import scipy.signal

from inputdesign_cli.questions import explore
from inputdesign_cli.questions.exploration.build import _inside
from inputdesign_cli.records import Preparation

GAIN, LAG, LATE = 2.0, 9.0, 2.3


def lagged(u, finer=20):
    """Return the answer of a lag behind a dead time, on a finer grid."""
    fine = np.concatenate([np.zeros(round(LATE * finer)), np.repeat(u, finer)])[: u.size * finer]
    pole = np.exp(-1.0 / finer / LAG)
    return GAIN * scipy.signal.lfilter([0.0, 1.0 - pole], [1.0, -pole], fine)[::finer]


@pytest.mark.slow
def test_a_walk_that_hides_the_gain_earns_no_trust(tmp_path):
    rng = np.random.default_rng(1)
    u = np.resize(np.repeat([0.0, 1.0, -1.0, 0.0, 1.0, 0.0, -1.0, 0.0], 35), 300)
    y = 60.0 + lagged(u) + 0.06 * np.cumsum(rng.standard_normal(u.size)) + 0.04 * rng.standard_normal(u.size)
    log = tmp_path / "log.csv"
    np.savetxt(
        log, np.column_stack([np.arange(u.size), 45.0 + u, y]), delimiter=",", header="time,u,y", comments=""
    )
    done = explore([log], Preparation())
    theta = done.results.result["identification"]["theta"]
    gain = theta["b3"] / (1.0 + theta["a1"])
    assert done.reasons or gain == pytest.approx(GAIN, rel=0.1)


@pytest.mark.parametrize("radius", [1.0, 1.0 - 1e-9, 0.9995, 0.99, 0.5])
def test_the_noise_of_the_next_experiment_fades_as_fast_as_the_record_tells(radius):
    """Estimates may have poles of the noise on the circle: there, information has no end."""
    D = np.real(np.poly([radius * np.exp(0.04j), radius * np.exp(-0.04j), 0.3])).tolist()
    noise = {"C": [1.0, -0.2], "D": D, "variance": 2.0, "drift": False}
    inside, drawn = _inside(noise, 200)
    roots = np.abs(np.roots(inside["D"]))
    assert roots.max() <= 1.0 - 1.0 / 200 + 1e-12
    if radius < 0.995:
        assert (inside, drawn) == (noise, [])
    else:
        assert drawn == ["D"]
        assert {**inside, "D": D} == noise
        # Frequencies stay; a root is moved by a two-hundredth at most.
        np.testing.assert_allclose(np.angle(np.roots(inside["D"])[:2]), np.angle(np.roots(D)[:2]), atol=1e-9)
        assert np.abs(np.sort(roots) - np.sort(np.abs(np.roots(D)))).max() <= 1.0 / 200 + 1e-12
    several, _ = _inside({"C": [[1.0, -0.2], [1.0]], "D": [D, [1.0, -0.5]]}, 200)
    assert several == {"C": [[1.0, -0.2], [1.0]], "D": [inside["D"], [1.0, -0.5]]}
