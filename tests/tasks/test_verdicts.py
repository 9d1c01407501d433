"""Met, missed or undecided: what `assess` says of records, right models and wrong ones."""

import html
import json
from pathlib import Path

import numpy as np
import pytest
import scipy.signal
import yaml
from typer.testing import CliRunner

from inputdesign_cli import assess, identify, load_spec, parse_spec, solve
from inputdesign_cli.cli import app
from inputdesign_cli.cli.summary import summary
from inputdesign_cli.errors import DataError, SpecError

STRUCTURE = """
sample_time: 5
plant: {B: [0, 0, 0, 0, 0, 0, 0.03, 0.02], F: [1, -0.97]}
noise: {C: [1, -0.2], D: [1, -0.8], variance: 0.001}
"""
HEATER = (
    STRUCTURE
    + """
experiment: {samples: 400}
accuracy: {model_error: {relative: 0.3, band: [0, 0.02]}}
spectrum: {type: fir, order: 6}
"""
)
# exp(-5/205), exp(-5/8): a gain of 2.35 behind a time constant of 205 s and a lag of 8 s.
SLOW, LAG = 0.97590, 0.53526


def heater(samples, seed, *, lag=False, drift=0.0, level=(0.0, 0.0), warm=0.0, power=9.0):
    """A heater, sampled every 5 s: dead time of 5.6 samples, coloured noise, drift in degrees an hour."""
    rng = np.random.default_rng(seed)
    u = np.sqrt(power) * np.repeat(rng.choice([-1.0, 1.0], samples // 8 + 1), 8)[:samples]
    B, F = np.array([0, 0, 0, 0, 0, 0, 0.4, 0.6]) * 2.35 * (1 - SLOW), [1, -SLOW]
    if lag:
        B, F = B * (1 - LAG), np.convolve(F, [1, -LAG])
    y = scipy.signal.lfilter(B, F, u) + warm * SLOW ** np.arange(samples)
    y += scipy.signal.lfilter([1, -0.2], [1, -0.8], 0.03 * rng.standard_normal(samples))
    time = 5.0 * np.arange(samples)
    return {"time_s": time, "u": u + level[0], "y": y + level[1] + drift * time / 3600}


@pytest.fixture
def record(tmp_path):
    """Writes a record of the heater."""

    def written(name, *args, **kwargs):
        columns, path = heater(*args, **kwargs), tmp_path / name
        rows = zip(*columns.values(), strict=True)
        text = "".join(",".join(map(repr, map(float, row))) + "\n" for row in rows)
        path.write_text(",".join(columns) + "\n" + text)
        return path

    return written


def said(results):
    """The summary in the terminal."""
    return summary(results.result, results.time_unit, [Path("run/result.json")])


def test_a_right_model_is_met(record):
    found = assess(parse_spec(HEATER), record("a.csv", 720, 1))
    assert (found.verdict, found.results.result["status"]) == ("met", "met")
    assert found.results.result["identification"]["failed"] == []


@pytest.mark.parametrize("drift", [0.0, 1.0])
def test_a_missing_lag_leaves_the_verdict_undecided(drift, record):
    found = assess(parse_spec(HEATER), record("a.csv", 720, 1, lag=True, drift=drift))
    result = found.results.result
    assert (found.verdict, result["status"]) == ("undecided", "undecided")
    assert "recent_inputs" in result["identification"]["failed"]
    # b6, b7 stand for the delay; what the lag adds comes after them.
    assert result["identification"]["tests"]["recent_inputs"]["lag"] in (7, 8, 9)
    assert "raise the orders of B and F" in " ".join(result["notes"])
    assert "signal" not in found.results.tables
    assert "undecided, neither met nor missed" in said(found.results)


def test_records_of_two_plants_are_named(record, tmp_path):
    spec = parse_spec(HEATER)
    first, second = record("a.csv", 400, 1), record("b.csv", 400, 2)
    assert assess(spec, [first, second]).verdict == "met"
    rows = np.genfromtxt(second, delimiter=",", names=True)
    other = tmp_path / "other.csv"
    table = np.column_stack([rows["time_s"], rows["u"], -rows["y"]])
    np.savetxt(other, table, delimiter=",", header="time_s,u,y", comments="")
    found = assess(spec, [first, other])
    assert found.verdict == "undecided"
    (said,) = [r for r in found.results.result["assessment"]["undecided"] if "one system" in r]
    assert {"a.csv", "other.csv"} < set(said.split())
    assert said in found.results.result["notes"]


@pytest.mark.parametrize("rows", [720, 500])
def test_a_record_counts_once(rows, record, tmp_path):
    """A file given twice, and a file that holds the beginning of another."""
    first, again = record("a.csv", 720, 1), tmp_path / "again.csv"
    again.write_text("".join(first.read_text().splitlines(keepends=True)[: rows + 1]))
    with pytest.raises(DataError, match="hold the same samples") as raised:
        assess(parse_spec(HEATER), [first, again])
    assert raised.value.diagnostics[0].code == "data-repeated"


def test_channels_that_the_plant_does_not_have_are_not_passed_over_in_silence(record):
    path = record("a.csv", 720, 1)
    lines = path.read_text().splitlines()
    path.write_text("\n".join([f"{lines[0]},u2", *(f"{line},0.5" for line in lines[1:])]))
    notes = assess(parse_spec(HEATER), path).results.result["notes"]
    assert any("u2 is not used" in note for note in notes)


NARROW = """
sample_time: 10
plant: {B: [0, 0, 0, 0, 0.04], F: [1, -0.95]}
noise: {D: [1, -0.8], variance: 0.01}
experiment: {samples: 600}
cost: {input_power: 1}
accuracy: {model_error: {relative: 0.1, band: [0.0005, 0.02]}}
spectrum: {type: fir, order: 20}
signal: {type: binary, seed: 1}
"""


@pytest.fixture(scope="module")
def narrow(tmp_path_factory):
    """Writes a record with the narrow-band input that is designed for the model, and perhaps a pole more."""
    u = 1.3 * solve(parse_spec(NARROW)).tables["signal"].columns["u1"]

    def written(seed, pole=0.0):
        e = 0.1 * np.random.default_rng(seed).standard_normal(u.size + 300)
        B, F = np.array([0, 0, 0, 0, 0.04]) * (1 - pole), np.convolve([1, -0.95], [1, -pole])
        y = scipy.signal.lfilter(B, F, u) + scipy.signal.lfilter([1], [1, -0.8], e)[300:]
        path = tmp_path_factory.mktemp("narrow") / "a.csv"
        np.savetxt(path, np.column_stack([u, y]), delimiter=",", header="u,y", comments="")
        return path

    return written


@pytest.mark.parametrize("seed", [2, 3])
def test_a_pole_that_a_narrow_band_hardly_shows_leaves_it_undecided(seed, narrow):
    found = assess(parse_spec(NARROW), narrow(seed, 0.5))
    assert found.verdict == "undecided"
    reasons = found.results.result["assessment"]["undecided"]
    assert "one more " in reasons[-1]
    assert set(reasons) <= set(found.results.result["notes"])
    assert "(f2)" in " ".join(found.results.result["notes"])


def test_what_a_narrow_band_leaves_open_stands_beside_the_verdict(narrow):
    path = narrow(1)
    found = assess(parse_spec(NARROW), path)
    assert found.verdict == "met"
    entries = {e["parameter"]: e for e in found.results.result["assessment"]["neglected"]}
    worst = max(entries.values(), key=lambda e: e["may_move"])
    assert worst["may_move"] > max(1.0, worst["moves"])
    assert "rests on the structure" in " ".join(found.results.result["notes"])
    fine = np.linspace(0.005, 0.2, 2000)

    def plant(overrides):
        entry = identify(parse_spec(NARROW, overrides=overrides), path).result["identification"]["theta"]
        B = [0, 0, 0, entry.get("b3", 0.0), entry["b4"]]
        return scipy.signal.freqz(B, [1, entry["f1"]], fine)[1]

    own, more = plant([]), plant(["plant.B=[0, 0, 0, 0.001, 0.04]"])
    to_first_order = np.max(np.abs(more - own) / np.abs(own)) / 0.1
    assert entries["b3"]["moves"] == pytest.approx(to_first_order, rel=0.05)


def test_a_drift_is_told_from_noise(record):
    spec = parse_spec(HEATER, overrides=["noise={C: [1], D: [1, -0.5], variance: 0.001}"])
    found = assess(spec, record("a.csv", 720, 1, drift=2.0)).results.result
    assert "trend" in found["identification"]["failed"]
    assert "remove the trend" in " ".join(found["notes"])


def test_undecided_has_its_own_exit_code(record, tmp_path):
    spec, path = tmp_path / "spec.yaml", record("a.csv", 720, 1, lag=True)
    spec.write_text(HEATER)
    run = CliRunner().invoke(
        app, ["assess", str(spec), str(path), "-o", str(tmp_path / "run"), "--no-figures", "--json"]
    )
    assert run.exit_code == 5
    result = json.loads(run.stdout)
    assert result["status"] == "undecided"
    assert {"fit.csv", "residuals.csv", "bound.csv", "model.yaml"} < set(result["files"])


def test_records_are_judged_together_by_the_number_that_is_printed(record):
    """Information of two records adds up, and the top-up counts the first as the joint verdict does."""
    spec = parse_spec(HEATER, overrides=["accuracy.model_error.relative=0.1"])
    first = record("a.csv", 300, 1, power=0.02, level=(40.0, 52.3), warm=1.0)
    second = record("b.csv", 700, 2, power=0.5, level=(41.0, 50.0), warm=-2.0)
    alone, both = assess(spec, first), assess(spec, [first, second])
    assert (alone.verdict, both.verdict) == ("missed", "met")
    result = both.results.result
    assert result["identification"]["records"] == [300, 700]
    assert result["samples"] == 1000
    (listed,) = result["assessment"]["requirements"]
    assert listed["worst_ratio"] == pytest.approx(result["model_error"]["worst_ratio"])
    apart = np.linalg.inv(assess(spec, second).results.result["information"]["covariance"])
    ratio = np.diag(result["information"]["matrix"]) / np.diag(apart)
    assert np.all(ratio > 0.9)
    assert np.array_equal(np.unique(both.results.tables["fit"].columns["record"]), [1, 2])


def test_a_prior_without_its_estimate_does_not_count(record):
    path = record("a.csv", 300, 1, power=0.02)
    spec = parse_spec(HEATER)
    plain = assess(spec, path).results.result
    prior = yaml.safe_dump({"information": (1e9 * np.eye(5)).tolist()}, default_flow_style=True)
    with_prior = assess(parse_spec(HEATER, overrides=[f"experiment.prior={prior}"]), path).results.result
    assert with_prior["assessment"]["requirements"] == plain["assessment"]["requirements"]
    assert "experiment.prior does not count" in " ".join(with_prior["notes"])


def test_a_prior_with_its_estimate_counts_as_its_record_does(record, tmp_path):
    spec = parse_spec(HEATER, overrides=["accuracy.model_error.relative=0.1"], folder=tmp_path)
    first = record("a.csv", 700, 1, power=0.5, level=(40.0, 52.3), warm=1.0)
    second = record("b.csv", 700, 2, power=0.5, level=(41.0, 50.0), warm=-2.0)
    (tmp_path / "model.yaml").write_bytes(identify(spec, first).files["model.yaml"])
    alone, both = assess(spec, second), assess(spec, [first, second])
    named = ["accuracy.model_error.relative=0.1", "experiment.prior.information=model.yaml"]
    known = assess(parse_spec(HEATER, overrides=named, folder=tmp_path), second)
    ratio, joint, single = (
        found.results.result["assessment"]["requirements"][0]["worst_ratio"] for found in (known, both, alone)
    )
    assert ratio == pytest.approx(joint, rel=0.1)
    assert ratio < 0.9 * single
    result = known.results.result
    assert result["model_error"]["worst_ratio"] == pytest.approx(ratio)
    assert "experiment.prior counts" in " ".join(result["notes"])
    assert result["identification"]["prior"]["probability"] > 1e-3


def test_a_prior_of_another_system_decides_nothing(record):
    path = record("a.csv", 700, 1, power=0.5)
    found = identify(parse_spec(HEATER), path).result
    values = {name: 1.01 * value for name, value in found["identification"]["theta"].items()}
    prior = json.dumps({"information": found["information"]["matrix"].tolist(), "parameters": values})
    verdict = assess(parse_spec(HEATER, overrides=[f"experiment.prior={prior}"]), path)
    assert verdict.verdict == "undecided"
    assert "contradict each other" in " ".join(verdict.results.result["assessment"]["undecided"])


@pytest.mark.parametrize(
    "text",
    ["", "secret: [", "- 1", "plant: {B: [0, 1]}", "estimate: {parameters: {b1: 1}, covariance: [[1, 0]]}"],
)
def test_what_is_no_model_file_is_refused_and_not_shown(tmp_path, text):
    (tmp_path / "model.yaml").write_text(text)
    spec = parse_spec(HEATER, overrides=["experiment.prior.information=model.yaml"], folder=tmp_path)
    with pytest.raises(SpecError) as caught:
        solve(spec)
    (diagnostic,) = caught.value.diagnostics
    assert (diagnostic.code, diagnostic.key) == ("bad-model-file", "experiment.prior.information")
    assert "secret" not in str(caught.value)


def test_what_a_top_up_within_limits_leaves_is_told(record):
    path = record("a.csv", 300, 1, power=0.02)
    limits = ["objective=best_accuracy", "limits.input_power=0.005", "accuracy.model_error.relative=0.05"]
    found = assess(parse_spec(HEATER, overrides=limits), path)
    result = found.results.result
    left, times = result["assessment"]["left"], result["assessment"]["experiments"]
    assert left > 1.5
    assert f"still {left:.4g} times" in said(found.results)
    assert "makes up for it" not in said(found.results)
    # So many of them, one after the other, are enough, and one fewer is not.
    one = np.asarray(result["information"]["matrix"])
    data = np.asarray(identify(parse_spec(HEATER), path).result["information"]["matrix"])
    theta = list(result["identification"]["theta"].values())
    w = np.linspace(1e-6, 0.02 * 5, 400)
    z = np.exp(-1j * w)[:, None]
    B, F = theta[0] * z**6 + theta[1] * z**7, 1 + theta[4] * z
    gradient = np.concatenate([z**6 / F, z**7 / F, 0 * z, 0 * z, -B * z / F**2], axis=1)
    T = np.stack([gradient.real, gradient.imag], axis=1)

    def ratio(n):
        P = np.linalg.inv(data + n * (one - data))
        r_u = result["model_error"]["alpha"] * np.sqrt(np.linalg.eigvalsh(T @ P @ T.swapaxes(1, 2))[:, -1])
        return np.max(r_u / (0.05 * np.abs(B / F)[:, 0]))

    assert ratio(times) < 1.001 < 1.002 * ratio(times - 1)


@pytest.mark.parametrize(
    ("overrides", "verdict", "why"),
    [
        (["limits.input_power=0.0001"], "missed", "cannot be met within the limits"),
        (["experiment.controller={numerator: [9], denominator: [1]}"], "undecided", "unstable"),
    ],
)
def test_the_estimate_is_kept_when_no_design_follows(overrides, verdict, why, record):
    path = record("a.csv", 300, 1, power=0.02)
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
    assert ("no experiment is designed" in said(found.results)) == (verdict == "missed")


def test_a_spec_without_a_question_is_enough_to_identify(record, tmp_path):
    spec, path = tmp_path / "structure.yaml", record("a.csv", 300, 1)
    spec.write_text(STRUCTURE)
    out = tmp_path / "run"
    run = CliRunner().invoke(
        app, ["identify", str(path), "--spec", str(spec), "-o", str(out), "--no-figures"]
    )
    assert run.exit_code == 0, run.output
    run = CliRunner().invoke(app, ["report", str(out)])
    assert run.exit_code == 0, run.output
    assert identify(load_spec(spec, design=False), path).result["status"] == "identified"
    with pytest.raises(Exception, match="nothing is asked"):
        solve(load_spec(spec))


def test_the_operating_point_of_the_command_line(record, tmp_path):
    spec, path = tmp_path / "spec.yaml", record("a.csv", 300, 2, level=(40.0, 52.3))
    spec.write_text(STRUCTURE)
    call = ["identify", str(path), "--spec", str(spec), "-o", str(tmp_path / "run"), "--no-figures", "--json"]
    known = CliRunner().invoke(app, [*call, "--operating-point", "u1=40,y=52.3"])
    assert not json.loads(known.stdout)["identification"]["free_start"]
    unknown = CliRunner().invoke(app, call)
    assert json.loads(unknown.stdout)["identification"]["free_start"]
    assert CliRunner().invoke(app, [*call, "--operating-point", "u1:40"]).exit_code == 2


def test_beside_an_undecided_model_stands_what_the_data_say_without_one(record):
    found = assess(parse_spec(HEATER), record("a.csv", 720, 1, lag=True))
    table, told = found.results.tables["frequency_response"].columns, found.results.result["assessment"]
    G = table["G_re"] + 1j * table["G_im"]
    q = np.exp(-5j * table["frequency_rad_per_s"])
    gain = 2.35 * (1 - SLOW) * (1 - LAG)
    truth = gain * (0.4 * q**6 + 0.6 * q**7) / ((1 - SLOW * q) * (1 - LAG * q))
    assert np.mean(np.abs(G - truth) < table["radius"]) > 0.85
    assert told["frequency_response"]["model_outside"] > 0.2
    assert "frequency_response" in found.results.curves
    assert "frequency_response" not in assess(parse_spec(HEATER), record("b.csv", 720, 1)).results.tables


def test_in_a_loop_the_reference_is_used_where_it_is_recorded(record, tmp_path):
    loop = [
        "experiment.controller={numerator: [0.01], denominator: [1]}",
        "accuracy.model_error.relative=1.0",
        "plant={B: [0, 0, 0.03, 0.02], F: [1, -0.97]}",
    ]
    columns = heater(720, 1)
    for name, by in (("r", "r"), ("note", "u")):
        named = columns | {name: columns["u"] + 0.01 * columns["y"]}
        path = tmp_path / f"{name}.csv"
        rows = "\n".join(",".join(map(repr, map(float, row))) for row in zip(*named.values(), strict=True))
        path.write_text(",".join(named) + "\n" + rows + "\n")
        result = assess(parse_spec(HEATER, overrides=loop), path).results.result
        assert result["assessment"]["frequency_response"]["excitation"] == by
        assert ("record the reference as column r" in " ".join(result["notes"])) == (by == "u")


@pytest.mark.parametrize(("factor", "contradicts"), [(1.0, False), (1.1, False), (-1.0, True), (3.0, True)])
def test_a_plant_that_is_not_the_one_of_the_spec_is_told(factor, contradicts, record):
    path = record("a.csv", 720, 1)
    B = [0, 0, 0, 0, 0, 0, *(factor * 2.35 * (1 - SLOW) * share for share in (0.4, 0.6))]
    found = assess(parse_spec(HEATER, overrides=[f"plant={{B: {B}, F: [1, {-SLOW}]}}"]), path)
    result = found.results.result
    nominal, notes = result["assessment"]["nominal"], " ".join(result.get("notes", []))
    assert found.verdict == "met"
    assert ("contradicts the plant of the spec" in notes) == contradicts
    assert nominal["opposite_sign"] == (factor < 0)
    assert nominal["degrees_of_freedom"] == 3
    names = ["b6", "b7", "f1"]
    P = covariance_of(result, names)
    away = np.array([*B[6:], -SLOW]) - [result["identification"]["theta"][name] for name in names]
    assert nominal["statistic"] == pytest.approx(away @ np.linalg.solve(P, away), rel=1e-6)
    if contradicts:
        share = abs(factor - 1.0) / max(abs(factor), 1.0)
        assert nominal["worst_difference"] == pytest.approx(share, rel=0.15)
        assert "b7 is" in notes or "b6 is" in notes


def covariance_of(result, names):
    """The covariance of some parameters."""
    at = [result["information"]["parameters"].index(name) for name in names]
    return np.array(result["information"]["covariance"])[np.ix_(at, at)]


def test_a_top_up_varies_about_the_operating_point_and_the_page_tells_the_whole_command(record, tmp_path):
    spec, path = tmp_path / "spec.yaml", record("first run.csv", 300, 2, level=(40.0, 52.3))
    asked = (
        "experiment: {samples: 400}\naccuracy: {standard_deviation: {b6: 0.0002}}\nsignal: {candidates: 1}\n"
    )
    spec.write_text(STRUCTURE + asked)
    out = tmp_path / "run"
    call = [
        "assess",
        str(spec),
        str(path),
        "-o",
        str(out),
        "--no-figures",
        "--operating-point",
        "u1=40,y1=52.3",
    ]
    run = CliRunner().invoke(app, call)
    assert run.exit_code == 1, run.output
    result = json.loads((out / "result.json").read_text())
    assert result["identification"]["operating_point"] == {"u1": 40.0, "y1": 52.3}
    assert result["signal"]["operating_point"] == [40.0]
    assert any("varies about the operating point, u1 = 40" in note for note in result["notes"])
    u = np.loadtxt(out / "signal.csv", delimiter=",", skiprows=1)[:, 1]
    assert np.mean(u) == pytest.approx(40.0, abs=3 * np.std(u))
    assert CliRunner().invoke(app, ["report", str(out)]).exit_code == 0
    page = html.unescape((out / "report.html").read_text())
    assert "idesign assess spec.yaml 'first run.csv' --operating-point u1=40.0,y1=52.3" in page
