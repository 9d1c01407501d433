"""Top-ups after an estimate: another experiment or none, about the operating point of the record."""

import json
from pathlib import Path

import numpy as np
import pytest
import scipy.signal
from typer.testing import CliRunner

from inputdesign_cli import assess, identify, parse_spec
from inputdesign_cli.cli import app
from inputdesign_cli.findings.designed_records import level_notes
from tests.support.heater import HEATER, STRUCTURE


@pytest.mark.slow
def test_assess_states_the_error_that_remains_after_a_limited_top_up(heater_record):
    path = heater_record("a.csv", 300, 1, power=0.02)
    limits = ["objective=best_accuracy", "limits.input_power=0.005", "accuracy.model_error.relative=0.05"]
    found = assess(parse_spec(HEATER, overrides=limits), path)
    result = found.results.result
    left, times = result["assessment"]["left"], result["assessment"]["experiments"]
    assert left > 1.5
    assert result["signal"]["begun_anywhere"] > 1.0
    # The stated number of top-ups is enough, and one fewer is not.
    one = np.asarray(result["information"]["matrix"])
    data = np.asarray(identify(parse_spec(HEATER), path).result["information"]["matrix"])
    theta = result["identification"]["theta"]
    w = np.linspace(1e-6, 0.02 * 5, 400)
    z = np.exp(-1j * w)[:, None]
    B, F = theta["b6"] * z**6 + theta["b7"] * z**7, 1 + theta["f1"] * z
    gradient = np.concatenate([z**6 / F, z**7 / F, 0 * z, -B * z / F**2], axis=1)
    T = np.stack([gradient.real, gradient.imag], axis=1)

    def ratio(n):
        P = np.linalg.inv(data + n * (one - data))
        r_u = result["model_error"]["alpha"] * np.sqrt(np.linalg.eigvalsh(T @ P @ T.swapaxes(1, 2))[:, -1])
        return np.max(r_u / (0.05 * np.abs(B / F)[:, 0]))

    assert ratio(times) < 1.001 < 1.002 * ratio(times - 1)


def test_a_top_up_without_excitation_states_the_error_after_its_noise(tmp_path):
    """Without excitation N samples of an ARX system add N / (1 - a1^2) to the information on a1."""
    rng, N = np.random.default_rng(0), 1000
    u, e = 0.3 * rng.standard_normal(N), rng.standard_normal(N)
    y = scipy.signal.lfilter([0, 1], [1, -0.5], u) + scipy.signal.lfilter([1], [1, -0.5], e)
    np.savetxt(tmp_path / "a.csv", np.column_stack([u, y]), delimiter=",", header="u,y", comments="")
    bound = 0.025
    found = assess(
        parse_spec(
            f"plant: {{A: [1, -0.5], B: [0, 1]}}\nnoise: {{variance: 1}}\nexperiment: {{samples: {N}}}\n"
            f"accuracy: {{standard_deviation: {{a1: {bound}}}}}\nspectrum: {{type: white}}\n"
        ),
        tmp_path / "a.csv",
    )
    judged, estimate = found.results.result["assessment"], found.results.result["identification"]
    assert (found.verdict, judged["top_up_status"]) == ("missed", "nothing_needed")
    both = estimate["standard_deviation"]["a1"] ** -2 + N / (1 - estimate["theta"]["a1"] ** 2)
    assert judged["left"] == pytest.approx(both**-0.5 / bound, rel=1e-3)


@pytest.mark.first(1)
@pytest.mark.parametrize(
    ("overrides", "verdict", "why"),
    [
        (["limits.input_power=0.0001"], "missed", "cannot be met within the limits"),
        (["experiment.controller={numerator: [9], denominator: [1]}"], "undecided", "unstable"),
    ],
)
def test_the_estimate_is_kept_when_no_design_follows(overrides, verdict, why, heater_record):
    path = heater_record("a.csv", 300, 1, power=0.02)
    spec = parse_spec(HEATER, overrides=["accuracy.model_error.relative=0.05", *overrides])
    found = assess(spec, path)
    assert found.verdict == verdict
    assert why in json.dumps(found.results.result["assessment"])
    plain = identify(parse_spec(STRUCTURE, design=False), path)
    assert found.results.result["identification"]["theta"] == pytest.approx(
        plain.result["identification"]["theta"]
    )
    assert {"fit", "residuals"} <= set(found.results.tables)
    assert "model.yaml" in found.results.files


@pytest.mark.slow
def test_a_top_up_varies_about_the_operating_point(heater_record, tmp_path):
    spec, path = tmp_path / "spec.yaml", heater_record("a.csv", 300, 2, level=(40.0, 52.3))
    asked = (
        "experiment: {samples: 400}\naccuracy: {standard_deviation: {b6: 0.0002}}\nsignal: {candidates: 1}\n"
    )
    spec.write_text(STRUCTURE + asked)
    out = tmp_path / "run"
    options = ["-o", str(out), "--no-figures", "--operating-point", "u1=40,y1=52.3"]
    run = CliRunner().invoke(app, ["assess", str(spec), str(path), *options])
    assert run.exit_code == 1, run.output
    result = json.loads((out / "result.json").read_text())
    assert result["identification"]["operating_point"] == {"u1": 40.0, "y1": 52.3}
    assert result["signal"]["operating_point"] == [40.0]
    (levels,) = [one for one in result["findings"] if one["code"] == "about-an-operating-point"]
    assert levels["figures"] == {"levels": [40.0]}
    u = np.loadtxt(out / "signal.csv", delimiter=",", skiprows=1)[:, 1]
    assert np.mean(u) == pytest.approx(40.0, abs=3 * np.std(u))


@pytest.mark.parametrize(
    ("levels", "point", "means", "expected"),
    [
        ({}, None, [7.0, 0.1], {"record-about-zero": {"offset": [7.0, 0.0]}}),
        (
            {"u1": 7.0},
            [7.0, 0.0],
            [7.0, -30.0],
            {
                "about-an-operating-point": {"levels": [7.0, 0.0]},
                "record-about-zero": {"offset": [7.0, -30.0]},
            },
        ),
        ({}, [7.0, 1.0], [7.0, -30.0], {}),
        ({}, None, [0.3, -0.9], {}),
        ({}, None, None, {}),
    ],
)
def test_notes_state_the_operating_point_and_the_level_of_each_input(levels, point, means, expected):
    found = level_notes(levels, point, None if means is None else np.array(means), np.ones(2))
    assert {one.code: one.figures for one in found} == expected


@pytest.mark.slow
def test_the_spec_of_a_top_up_counts_the_earlier_record(heater_record, tmp_path, monkeypatch):
    """With the second record alone it gives the worst ratio of the first spec with both."""
    monkeypatch.chdir(tmp_path)
    asked = "experiment: {samples: 400}\naccuracy: {standard_deviation: {b6: 0.0004}}\n"
    Path("spec.yaml").write_text(STRUCTURE + asked + "signal: {candidates: 1}\n")
    first, second = (heater_record(name, 300, seed) for name, seed in (("1.csv", 2), ("2.csv", 3)))

    def ran(*arguments):
        options = [*map(str, arguments), "--no-figures", "--json"]
        return json.loads(CliRunner().invoke(app, ["assess", *options]).stdout)

    ran("spec.yaml", first, "-o", "a")
    joint, known = ran("spec.yaml", first, second, "-o", "b"), ran("a/spec.yaml", second, "-o", "c")
    alone = ran("spec.yaml", second, "-o", "d")
    ratio, by_prior, single = (
        run["assessment"]["requirements"][0]["worst_ratio"] for run in (joint, known, alone)
    )
    assert by_prior == pytest.approx(ratio, rel=0.05)
    assert ratio < 0.9 * single
    copied = tmp_path / "copied.csv"
    copied.write_bytes(first.read_bytes())
    for given in (first, copied):
        (error,) = ran("a/spec.yaml", given, second, "-o", "e")["errors"]
        assert error["code"] == "data-repeated"


def test_an_estimate_outside_the_stated_intervals_is_topped_up(tmp_path):
    """The intervals of the top-up are extended to the estimate."""
    text = """
plant: {B: [0, 1]}
noise: {variance: 4}
experiment: {samples: 400}
accuracy: {model_error: {relative: 0.1}}
spectrum: {type: white}
uncertainty: {intervals: {b1: [0.8, 1.2]}, scenarios: 3, fresh: 0}
signal: {candidates: 1, seed: 1}
"""
    rng = np.random.default_rng(3)
    u, e = rng.standard_normal((2, 400))
    rows = np.c_[np.arange(400), u, 0.6 * np.r_[0, u[:-1]] + 2 * e]
    path = tmp_path / "log.csv"
    np.savetxt(path, rows, delimiter=",", header="time,u,y", comments="")
    found = assess(parse_spec(text), path)
    result = found.results.result
    assert found.verdict == "missed"
    assert result["identification"]["theta"]["b1"] < 0.8
    assert "no_top_up" not in result["assessment"]
    assert result["robust"]["scenarios"] == 3
    assert found.results.signal.size
