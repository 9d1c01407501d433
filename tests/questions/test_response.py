"""Designs of a frequency response: closed forms, refusals, the audit, and simulated experiments."""

import re
from dataclasses import replace
from functools import cache

import numpy as np
import pytest
import scipy.signal

from inputdesign_cli import analyse, parse_spec, simulate, solve
from inputdesign_cli.errors import InaccurateError, InfeasibleError
from inputdesign_cli.outcome import Outcome, read_plain
from inputdesign_cli.outcome.results import Table
from inputdesign_cli.questions import build_task
from inputdesign_cli.questions.frequency_response.solve import audit_response
from tests.support.refusals import code_of, refusal

SINGLE = """
plant: {B: [0, 0.4, 0.1], F: [1, -1.5, 0.8]}
noise: {D: [1, -0.9], variance: 0.01}
experiment: {samples: 2000}
accuracy: {frequency_response: {relative: 0.05, band: [0.1, 2], lines: 12}}
signal: {periods: 5}
"""
SEVERAL = """
plant: {B: [[[0, 0.4], [0, 0, 0.3]], [[0, 0.1], [0, 0.5]]], F: [[[1, -0.8], [1, -0.5]],
  [[1, -0.6], [1, -0.9]]]}
noise: {D: [1, -0.5], variance: [[0.01, 0.002], [0.002, 0.02]]}
experiment: {samples: 4000}
accuracy: {frequency_response: {absolute: 0.05, band: [0.1, 2], lines: 6}}
"""


def spec(text=SINGLE, **changes):
    return parse_spec(text).with_(**{key.replace("__", "."): value for key, value in changes.items()})


@cache
def plain():
    """The design of SINGLE; no test may change it."""
    return solve(spec()).result


def lines_of(result):
    w = np.array(result["spectrum"]["frequencies"])
    z = np.exp(-1j * w)
    G = (0.4 * z + 0.1 * z**2) / (1 - 1.5 * z + 0.8 * z**2)
    return w, np.abs(G), 0.01 / np.abs(1 - 0.9 * z) ** 2


def test_the_powers_are_those_of_the_closed_form():
    result = plain()
    w, size, noise = lines_of(result)
    assert np.rint(w * 400 / (2 * np.pi)) == pytest.approx(w * 400 / (2 * np.pi), abs=1e-9)
    powers = 2 * noise / (1600 * (0.05 * size) ** 2)
    assert np.array(result["spectrum"]["powers"]) == pytest.approx(powers, rel=1e-12)
    assert result["cost"] == pytest.approx(powers.sum(), rel=1e-12)
    assert result["power"]["output"] == pytest.approx([np.sum(powers * size**2)], rel=1e-12)
    assert result["status"] == "optimal"
    flat = w.size * powers.max()
    assert result["baseline"]["white"]["ratio"] == pytest.approx(flat / powers.sum(), rel=1e-12)


def test_limits_are_exhausted_by_the_best_accuracy_and_the_shortest_experiment():
    need = plain()["cost"]
    best = solve(spec(objective="best_accuracy", limits__input_power=4 * need)).result
    assert best["objective"]["kind"] == "accuracy_factor"
    assert best["objective"]["value"] == pytest.approx(0.5, rel=1e-12)
    assert best["power"]["input"] == pytest.approx([4 * need], rel=1e-12)
    stated = {"limits__input_power": 2 * need, "accuracy__frequency_response__period": 400}
    short = solve(spec(objective="shortest_experiment", signal=None, **stated)).result
    assert short["objective"]["value"] == pytest.approx(800.0, rel=1e-9)
    assert short["samples"] == 3 * 400  # two periods count, one is left to the transient
    assert short["frequency_response"]["worst_ratio"] == pytest.approx(1.0, rel=1e-9)


def test_a_lower_limit_on_the_output_is_met_where_it_is_cheapest():
    floor = 2.0 * plain()["power"]["output"][0]
    result = solve(spec(limits__output_power={"min": floor})).result
    _, size, _ = lines_of(result)
    more = np.array(result["spectrum"]["powers"]) - np.array(plain()["spectrum"]["powers"])
    # Output power is cheapest at the line of the largest gain, so that only this line gets more.
    top = int(np.argmax(size))
    assert more[top] == pytest.approx(plain()["power"]["output"][0] / size[top] ** 2, rel=1e-6)
    assert np.abs(np.delete(more, top)).max() < 1e-9
    assert result["objective"]["relative_gap"] < 1e-9


def test_the_record_repeats_and_has_the_lines_of_the_design():
    results = solve(spec(signal__phases="optimised"))
    u = results.signal[:, 0]
    assert u.size == 2000
    assert u[400:] == pytest.approx(u[:-400], abs=1e-12)
    transforms = np.abs(np.fft.rfft(u[:400]) / 400) ** 2 * 2
    numbers = np.rint(np.array(results.result["spectrum"]["frequencies"]) * 400 / (2 * np.pi)).astype(int)
    scale = 1 + results.result["signal"]["extra_power"]
    assert transforms[numbers] == pytest.approx(
        scale * np.array(results.result["spectrum"]["powers"]), rel=1e-9
    )
    assert np.delete(transforms, numbers).max() < 1e-20
    assert results.result["signal"]["crest_factor"][0] < 2.2
    # Noise leaks in a finite record, which the scale of the record compensates.
    assert results.result["signal"]["worst_ratio"] == pytest.approx(1.0, rel=1e-9)


@pytest.mark.parametrize("text", [SINGLE, SEVERAL], ids=["one input", "two inputs"])
def test_simulated_deviations_are_those_designed_at_every_line(text):
    results = simulate(spec(text, simulation={"runs": 2500, "seed": 3}))
    entry = results.result["simulation"]["inputs"]["design"]
    assert entry["deviation_ratio"]["least"] > 0.95
    assert entry["deviation_ratio"]["largest"] < 1.05
    low, high = entry["chance"]
    assert low < entry["deviation_ratio"]["least"]
    assert entry["deviation_ratio"]["largest"] < high
    assert entry["bias"] < 0.12
    table = results.tables["deviations"].columns
    designed = [name for name in table if name.startswith("deviation") and "_record" not in name]
    for name in (name for name in designed if "sim" not in name):
        simulated = table[name.replace("deviation", "deviation_simulated")]
        assert simulated == pytest.approx(table[name], rel=0.05)


def test_the_baseline_of_equal_lines_keeps_a_lower_limit():
    floor = 3.0 * plain()["baseline"]["white"]["cost"]
    result = solve(spec(limits__input_power={"min": floor})).result
    assert result["cost"] == pytest.approx(floor, rel=1e-9)
    assert result["baseline"]["white"]["cost"] == pytest.approx(floor, rel=1e-9)


def test_a_record_that_misses_the_accuracy_for_a_limit_is_reported():
    need = plain()["cost"]
    found = solve(spec(limits__input_power=need * (1 + 1e-9))).outcome
    (one,) = [one for one in found.findings if one.code == "noise-leaks"]
    assert one.figures["ratio"] == found.signal.worst_ratio > 1.0001


def test_a_simulation_of_a_single_run_is_refused():
    assert code_of(simulate, spec(simulation={"runs": 1})) == "out-of-range"


def test_the_powers_of_the_lines_of_two_inputs_have_their_closed_form():
    result = solve(spec(SEVERAL)).result
    powers = np.array(result["spectrum"]["powers"])
    w = np.array(result["spectrum"]["frequencies"])
    noise = np.array([0.01, 0.02]) / np.abs(1 - 0.5 * np.exp(-1j * w))[:, None] ** 2
    counted = result["frequency_response"]["counted"]
    assert counted == 3200
    each = 2 * noise.max(axis=1) / (counted * 0.05**2)
    assert powers == pytest.approx(np.einsum("l,ab->lab", each, np.eye(2)), rel=1e-9)


def test_a_given_multisine_of_a_quarter_of_the_power_has_twice_the_error():
    designed = plain()
    w, powers = designed["spectrum"]["frequencies"], np.array(designed["spectrum"]["powers"])
    given = {"type": "multisine", "frequencies": w, "amplitudes": np.sqrt(2 * powers / 4).tolist()}
    result = analyse(spec(spectrum={"given": given})).result
    assert result["status"] == "missed"
    assert result["frequency_response"]["worst_ratio"] == pytest.approx(2.0, rel=1e-9)


def test_a_noise_spectrum_from_a_file_takes_the_place_of_the_model(tmp_path, write):
    w = np.linspace(0.05, 3.0, 400)
    noise = 0.01 / np.abs(1 - 0.9 * np.exp(-1j * w)) ** 2
    path = write({"frequency_rad_per_s": w, "noise_spectrum": noise})
    result = solve(spec(accuracy__frequency_response__noise=str(path))).result
    assert result["cost"] == pytest.approx(plain()["cost"], rel=1e-3)
    double = write({"frequency_rad_per_s": w, "noise_spectrum": 2 * noise}, "double.csv")
    twice = solve(spec(accuracy__frequency_response__noise=str(double))).result
    assert twice["cost"] == pytest.approx(2 * result["cost"], rel=1e-12)


def test_lines_for_the_detection_of_nonlinearity_have_no_power():
    results = solve(spec(accuracy__frequency_response__detection=3, experiment__samples=5000))
    response, u = results.result["frequency_response"], results.signal[:1000, 0]
    power = np.abs(np.fft.rfft(u)) ** 2
    number = {
        kind: np.rint(np.array(w) * 1000 / (2 * np.pi)).astype(int)
        for kind, w in response["detection"].items()
    }
    assert response["lines"] == 12
    assert np.all(number["odd"] % 2 == 1)
    assert np.all(number["even"] % 2 == 0)
    silent = np.concatenate([number["odd"], number["even"]])
    assert power[silent].max() < 1e-20 * power.max()


def test_a_limit_that_is_too_tight_is_refused_with_the_feasible_error():
    need = plain()["cost"]
    with pytest.raises(InfeasibleError) as caught:
        solve(spec(limits__input_power=need / 4))
    assert "2 times those admitted" in str(caught.value)
    assert solve(spec(limits__input_power=need / 4, accuracy__frequency_response__relative=0.1 * (1 + 1e-9)))
    assert solve(spec(limits__input_power=need * (1 + 1e-9)))


@pytest.mark.parametrize("limit", ["amplitude.input", "amplitude.output", "rate"])
@pytest.mark.parametrize("share", [0.5, 1.05])
def test_the_remedies_for_limits_on_amplitude_and_rate_give_a_record(limit, share):
    """The limits are 0.5 and 1.05 times the root mean square of the record without limits."""
    key, u = f"limits.{limit}", solve(spec()).signal[:, 0]
    y = scipy.signal.lfilter([0, 0.4, 0.1], [1, -1.5, 0.8], u)[400:]
    of = {"amplitude.input": u, "amplitude.output": y, "rate": np.diff(u, prepend=0.0)}[limit]
    stated = share * float(np.sqrt(np.mean(of**2)))
    found = refusal(lambda: solve(parse_spec(SINGLE, overrides=[f"{key}={stated}"])), InfeasibleError)
    assert found.code == ("infeasible" if share < 1 else "limits-too-tight")
    times = float(re.search(r"admit ([0-9.]+) times", found.hint)[1])
    period = re.search(r"objective: shortest_experiment, with (\S+): (\d+)", found.hint)
    assert (period is None) == (limit == "rate")  # a rate alone limits no power
    ways = [[f"{key}={times * stated}"], [f"accuracy.frequency_response.relative={0.05 * times}"]]
    ways += [["objective=shortest_experiment", f"{period[1]}={period[2]}"]] if period else []
    for way in ways:
        done = solve(parse_spec(SINGLE, overrides=[f"{key}={stated}", *way])).outcome
        assert done.signal.worst_ratio <= 1.01


def test_a_spec_that_was_read_for_identify_is_checked_before_it_is_designed():
    told = refusal(lambda: solve(parse_spec(f"{SINGLE}\n", overrides=["accuracy={}"], design=False)))
    assert told.code == "nothing-asked"


@pytest.fixture(scope="module")
def audited():
    task = build_task(spec())
    return task, *task.solved()


@pytest.mark.parametrize(
    "path", ["cost", "spectrum.powers", "frequency_response.worst_ratio", "signal.worst_ratio"]
)
def test_the_audit_rejects_a_wrong_number(audited, path):
    terms, plan, results = audited
    result = {name: dict(part) if isinstance(part, dict) else part for name, part in results.result.items()}
    *outer, name = path.split(".")
    holder = result[outer[0]] if outer else result
    holder[name] = np.asarray(holder[name]) * 1.00001
    with pytest.raises(InaccurateError):
        audit_response(terms, plan, replace(results, outcome=read_plain(Outcome, result)))


def test_the_audit_rejects_a_wrong_record(audited):
    terms, plan, results = audited
    columns = dict(results.tables["signal"].columns)
    columns["u1"] = columns["u1"] * np.where(np.arange(columns["u1"].size) < 500, 1.0, 1.0001)
    with pytest.raises(InaccurateError):
        audit_response(terms, plan, replace(results, tables={**results.tables, "signal": Table(columns)}))
