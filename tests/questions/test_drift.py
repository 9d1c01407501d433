"""Lines in the data, from the file to the estimate."""

import numpy as np
import pytest
from scipy.signal import lfilter

from inputdesign_cli import parse_spec, questions
from inputdesign_cli.records import Preparation

SPEC = "plant: {B: [0, 0.3], F: [1, -0.7]}\nnoise: {C: [1, 0.4], variance: 0.01}\n"


def log(path, slope, seed=4, samples=400):
    rng = np.random.default_rng(seed)
    u = np.repeat(rng.choice([-1.0, 1.0], samples // 8), 8)
    y = lfilter([0, 0.3], [1, -0.7], u) + lfilter([1, 0.4], [1], 0.1 * rng.standard_normal(samples))
    columns = np.column_stack([u, y + slope * np.arange(samples)])
    np.savetxt(path, columns, delimiter=",", header="u,y", comments="")
    return path


@pytest.mark.first(1)
@pytest.mark.parametrize("detrend", ["linear", "auto"])
def test_a_line_that_is_taken_away_does_not_move_the_estimate(tmp_path, detrend):
    """The plant makes a line of that of the input, which is not that through the output."""
    spec, told = parse_spec(SPEC, design=False), []
    for slope in (0.01, 0.03):
        data = log(tmp_path / f"{slope}.csv", slope)
        found = questions.identify(spec, data, preparation=Preparation(detrend=detrend)).result
        told.append(list(found["identification"]["theta"].values()))
    np.testing.assert_allclose(told[0], told[1], rtol=1e-5)


@pytest.mark.first(1)
@pytest.mark.parametrize(("gain", "code"), [(0.3, "noise-prevails"), (0.0, "output-unexplained")])
def test_noise_that_wanders_farther_than_the_plant_does_not_hide_it(tmp_path, gain, code):
    """The likelihood ratio of least squares on differences with the noise known: beyond chance, or not."""
    rng = np.random.default_rng(11)
    samples, deviation = 600, 0.3
    u = np.repeat(rng.choice([-1.0, 1.0], samples // 10), 10)
    walk = np.cumsum(deviation * rng.standard_normal(samples))
    y = lfilter([0, gain], [1, -0.7], u) + walk
    moves = np.diff(y)
    caused = np.diff(lfilter([0, 1.0], [1, -0.7], u))
    ratio = (caused @ moves) ** 2 / (caused @ caused) / deviation**2
    assert (ratio > 50.0) == bool(gain)
    data = tmp_path / "log.csv"
    np.savetxt(data, np.column_stack([u, y]), delimiter=",", header="u,y", comments="")
    text = "plant: {B: [0, 0.3], F: [1, -0.7]}\nnoise: {drift: true, variance: 0.09}\n"
    found = questions.identify(parse_spec(text, design=False), data).result
    assert found["identification"]["fit_percent"] < 0.0
    either = {"noise-prevails", "output-unexplained"}
    assert [one["code"] for one in found["findings"] if one["code"] in either] == [code]
