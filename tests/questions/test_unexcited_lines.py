"""Lines that data do not excite are not measured, and periods are asked for where they would help."""

import numpy as np
import pytest

from inputdesign_cli import assess, identify, parse_spec, solve
from inputdesign_cli.errors import DataError
from inputdesign_cli.identification.periodic_response import Periods, excited_lines
from inputdesign_cli.questions.frequency_response.build import build_measurement

TEXT = """
plant: {B: [0, 0.4, 0.1], F: [1, -1.5, 0.8]}
noise: {D: [1, -0.9], variance: 0.01}
experiment: {samples: 2500}
accuracy: {frequency_response: {relative: 0.05, band: [0.05, 2.5], lines: 20, transient: 1}}
signal: {periods: 5, phases: schroeder}
"""
PERIOD = 500
LINE = 4  # harmonic of the first line, 2 pi 4 / 500 = 0.05 rad/sample


def table_of(u, seed=0):
    """A record of the plant and the noise of the spec, whatever the input."""
    model = build_measurement(parse_spec(TEXT)).model
    e = 0.1 * np.random.default_rng(seed).standard_normal((1, len(u), 1))
    answer, noise = model.simulate(u[None, :, None], e, 1.0)
    y = (answer + noise)[0, :, 0]
    return {"time_s": np.arange(float(len(u))), "u1": u, "y1": y}


def times(periods=5):
    return np.arange(float(periods * PERIOD))


def sine():
    return np.sin(2.0 * np.pi * LINE / PERIOD * times())


def square():
    """Of odd harmonics of 250 samples: 2, 6, 10, .. of the period."""
    return np.where(times() % 250 < 125, 1.0, -1.0)


def of_spec():
    return set(build_measurement(parse_spec(TEXT)).terms.grid.excited)


@pytest.mark.parametrize(
    ("u", "lines"), [(sine(), {LINE}), (1e6 * sine() + 1e8, {LINE}), (square(), set(range(2, 250, 4)))]
)
def test_only_lines_with_power_are_measured(write, u, lines):
    there = lines & of_spec()
    results = identify(parse_spec(TEXT), write(table_of(u)), frequency_response=True)
    told = results.result["frequency_response"]
    w = 2.0 * np.pi * np.array(sorted(there)) / PERIOD
    for name in ("frequency_response", "deviations"):
        assert results.tables[name].columns["frequency_rad_per_s"] == pytest.approx(w)
    assert (told["lines"], told["asked"]) == (len(there), 20)
    first = 2.0 * np.pi * min(of_spec() - there) / PERIOD
    (one,) = [one for one in results.outcome.findings if one.code == "unexcited-lines"]
    assert one.figures == {"lines": 20 - len(there), "asked": 20, "first": pytest.approx(first)}


@pytest.mark.slow
def test_the_noise_of_a_line_is_not_that_of_its_unexcited_neighbours(write):
    # Of |U|^2 = N p / 2 with p = 1/2 and 2000 samples, Phi_v = 0.01 / |1 - 0.9 exp(-jw)|^2.
    w = 2.0 * np.pi * LINE / PERIOD
    truth = np.sqrt(0.01 / np.abs(1.0 - 0.9 * np.exp(-1j * w)) ** 2 / (2000 * 0.25))
    found = []
    for seed in range(20):
        data = write(table_of(sine(), seed))
        results = identify(parse_spec(TEXT), data, frequency_response=True)
        found.append(float(results.tables["deviations"].columns["deviation_data"][0]))
    assert np.sqrt(np.mean(np.square(found))) == pytest.approx(truth, rel=0.3)


def test_noise_of_the_inputs_is_no_excitation_and_strong_lines_are_some():
    rng = np.random.default_rng(1)
    harmonics = np.arange(1, 200)
    seen = excited_lines((sine() + 0.01 * rng.standard_normal(2500))[:, None], Periods(PERIOD), harmonics)
    assert seen[LINE - 1]
    assert seen.sum() <= 8  # 2 of 198 are expected by chance


def test_data_that_leave_lines_out_have_no_verdict(write):
    with pytest.raises(DataError, match="19 of 20 lines") as caught:
        assess(parse_spec(TEXT), write(table_of(sine())))
    assert caught.value.diagnostics[0].code == "not-exciting"


def told_periods(write, u, admitted=0.05):
    spec = parse_spec(TEXT).with_(**{"accuracy.frequency_response.relative": admitted})
    found = assess(spec, write(table_of(u)))
    return spec, found, found.results.result["assessment"].get("periods")


@pytest.mark.slow
def test_as_many_periods_as_are_told_do(write):
    u = solve(parse_spec(TEXT)).signal[:, 0]
    spec, first, needed = told_periods(write, u, 0.04)
    assert first.verdict != "met"
    longer = np.tile(u[:PERIOD], needed + 1)
    verdicts = [assess(spec, write(table_of(longer, 10 + seed))).verdict for seed in range(12)]
    assert verdicts.count("met") >= 6
    assert "missed" not in verdicts
    half = np.tile(u[:PERIOD], needed // 2 + 1)
    assert assess(spec, write(table_of(half, 9))).verdict != "met"


@pytest.mark.parametrize(
    ("u", "why"),
    [
        (np.random.default_rng(9).standard_normal(2500), "do not repeat"),
        (1e-3 * np.tile(np.random.default_rng(9).standard_normal(500), 5), "are too weak at some lines"),
    ],
    ids=["white", "weak"],
)
def test_more_periods_are_not_asked_for_where_they_are_no_remedy(write, u, why):
    _, found, needed = told_periods(write, u)
    assert needed is None
    told = found.results.result["assessment"]
    text = told.get("no_top_up", "") + " ".join(told.get("undecided", []))
    assert "no remedy" in text
    assert why in text
    assert "signal.csv" in text
