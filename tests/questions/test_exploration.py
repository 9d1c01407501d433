"""`explore`: from a raw log to a model and a spec that solves, and validation of models on other data."""

import json
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
import scipy.signal
from typer.testing import CliRunner

from inputdesign_cli.cli import app
from inputdesign_cli.cli.summary import summary
from inputdesign_cli.errors import DataError
from inputdesign_cli.finding import Severity
from inputdesign_cli.questions import explore, identify, solve
from inputdesign_cli.questions.building.system import build_model
from inputdesign_cli.questions.building.uncertainty import build_nominal_covariance
from inputdesign_cli.questions.exploration.build import Asked, spec_text
from inputdesign_cli.records import Preparation, read_log
from inputdesign_cli.specification import load_spec, parse_spec
from tests.support.logs import lag_log
from tests.support.plants import stated
from tests.support.refusals import code_of, refused

STEP = Path(__file__).parents[2] / "docs" / "data" / "tclab" / "step.csv"

PLANT = "plant: {B: [0, 1], F: [1, -0.7]}\n"


@pytest.fixture(scope="module")
def run(tmp_path_factory):
    """The folder that `idesign explore` writes for a log whose columns it finds by itself."""
    folder = tmp_path_factory.mktemp("log")
    log = lag_log(folder / "log.csv", samples=200)
    done = CliRunner().invoke(app, ["explore", str(log), "-o", str(folder / "run")])
    assert done.exit_code == 0, done.output
    return folder / "run"


def test_the_plant_of_a_log_is_found_and_trusted(run):
    result, there = json.loads((run / "result.json").read_text()), {path.name for path in run.iterdir()}
    told = result["exploration"]
    assert {*result["files"], "result.json", "report.html"} == there
    assert {"model.yaml", "spec.yaml", "structures.png", "fit.png", "frequency_response.csv"} <= there
    assert told["reasons"] == []
    assert (told["sample_time"], told["time_unit"]) == (0.5, "min")
    (output,) = told["outputs"]
    assert abs(output["delay"][0] - 3) <= 1
    assert result["validation"]["simulation_fit_percent"] > 60.0


def test_the_written_spec_solves_within_the_range_of_the_log(run):
    text = (run / "spec.yaml").read_text()
    spec = parse_spec(text, overrides=["signal=null", "spectrum.order=5"])
    assert {channel: one.name for channel, one in (spec.channels or {}).items()} == {
        "u1": "input",
        "y1": "output",
    }
    results = solve(parse_spec(text, overrides=["experiment.samples=60", "spectrum.order=5"]))
    assert results.result["status"] == "optimal"
    # The signal lies within the range of the input in the log.
    low, high = (
        end(np.loadtxt(run.parent / "log.csv", delimiter=",", skiprows=1)[:, 1]) for end in (np.min, np.max)
    )
    played = results.tables["signal"].columns["u1 input"]
    assert low - 1e-9 <= np.min(played) < np.max(played) <= high + 1e-9


def test_validation_on_other_data_has_the_fit_of_the_true_plant(run, tmp_path):
    other = lag_log(tmp_path / "other.csv", seed=1)
    judged = explore(other, model=load_spec(run / "model.yaml", design=False))
    validation = judged.results.result["validation"]
    _, u, y = np.loadtxt(other, delimiter=",", skiprows=1).T
    e = y - scipy.signal.lfilter([0, 0, 0, 0.2], [1, -0.8], u - 40.0)  # about a level
    fit = 100.0 * (1.0 - np.std(e) / np.std(y))
    assert validation["simulation_fit_percent"] == pytest.approx(fit, abs=1.0)
    assert validation["prediction_fit_percent"] == pytest.approx(fit, abs=1.0)


@pytest.mark.slow
def test_a_real_record_with_jittering_times_and_no_header_is_explored():
    """Its noise integrates: a pole of D is as near to the unit circle as a spec allows."""
    found = explore(STEP, Preparation(columns={"time": "1", "u1": "2", "y1": "3"}))
    assert "jitter-evened-out" in [one["code"] for one in found.results.result["findings"]]
    assert found.results.result["validation"]["simulation_fit_percent"] > 90.0
    assert parse_spec(found.results.resolved_spec).sample_time == pytest.approx(1.0, abs=0.05)
    parse_spec(found.results.files["model.yaml"].decode(), design=False)


@pytest.mark.slow
def test_an_input_without_effect_earns_no_trust(tmp_path):
    """The best of many structures explains 22 % of the noise of these 20 unseen samples."""
    path = lag_log(tmp_path / "log.csv", gain=0.0, samples=50, seed=1)
    told = CliRunner().invoke(app, ["explore", str(path), "--no-output"])
    assert told.exit_code == 1, told.output
    assert "no trust" in told.stdout


@pytest.fixture
def integrating(tmp_path):
    """Return a log of y(t) - y(t-1) = 0.02 u(t-1)."""
    rng = np.random.default_rng(1)
    u = np.repeat(rng.choice([-1.0, 1.0], 60), 8)
    y = np.cumsum(np.concatenate([[0.0], 0.02 * u[:-1]])) + 0.05 * rng.standard_normal(480)
    log = tmp_path / "log.csv"
    np.savetxt(log, np.column_stack([u, y]), delimiter=",", header="u,y", comments="")
    return log


@pytest.mark.slow
def test_an_integrator_is_trusted_only_if_it_is_stated_as_the_structure(integrating):
    """The record determines only the slope: a long time constant explains it as well."""
    prepared = Preparation(sample_time=1.0)
    found = explore(integrating, prepared)
    assert [one.code for one in found.results.outcome.findings if one.message.startswith("no trust")] == [
        "like-integrator"
    ]
    stated = explore(integrating, prepared, structure="integrator")
    assert stated.reasons == ()
    for one in (found, stated):
        theta = one.results.outcome.identification.theta
        assert theta["K"] == pytest.approx(0.02, rel=0.03)
        assert theta["L"] < 0.2
    design = solve(parse_spec(stated.results.resolved_spec, overrides=["spectrum.lines=20"]))
    assert design.outcome.status == "optimal"


@pytest.mark.parametrize("samples", [1, 2, 40])
@pytest.mark.parametrize("scale", [1e-320, 1e-300, 1e-160, 1e160, 1e300, 1e308])
def test_signals_beyond_arithmetic_are_refused_by_their_row(scale, samples, tmp_path):
    rng = np.random.default_rng(3)
    path = tmp_path / "log.csv"
    rows = [f"{u:.3f},{scale * y!r}" for u, y in rng.uniform(0.5, 1.0, (samples, 2)).tolist()]
    path.write_text("\n".join(["u,y", *rows]) + "\n")
    for read in (explore, lambda log: identify(parse_spec(PLANT, design=False), log)):
        (told,) = refused(read, path, kind=DataError)
        assert told.code == "beyond-precision"
        assert told.location.line >= 2


@pytest.mark.parametrize("times", [[3, 2, 1, 0], [0, 0, 1, 2], [0, 1, 1, 2], [0, 2, 1, 3]])
def test_times_that_do_not_increase_are_named_by_every_command(times, tmp_path):
    path = tmp_path / "log.csv"
    path.write_text("time,u,y\n" + "".join(f"{t!r},{i % 2},{i}\n" for i, t in enumerate(times)))
    wrong = 2 + next(i for i in range(1, 4) if times[i] <= times[i - 1])
    for read in (explore, lambda log: identify(parse_spec(PLANT, design=False), log)):
        (told,) = refused(read, path, kind=DataError)
        assert (told.code, told.location.line) == ("data-not-uniform", wrong)
        assert "sample_time" not in told.hint


def test_a_negative_sample_time_of_a_file_is_refused(tmp_path):
    path = tmp_path / "log.npz"
    np.savez(path, u=np.arange(40.0), y=np.arange(40.0), Ts=-1.0)
    for read in (explore, lambda log: identify(parse_spec(PLANT, design=False), log)):
        assert code_of(read, path, kind=DataError) == "data-unreadable"


@pytest.fixture(scope="module")
def rows():
    """(900, 3): u, y and r of a lag with gain 2 and 6 samples, strong noise, and u = 0.8 (r - y)."""
    rng = np.random.default_rng(5)
    r = np.repeat(rng.choice([-1.0, 1.0], 200), rng.integers(4, 20, 200))[:900]
    y, u, x, pole = np.zeros(900), np.zeros(900), 0.0, np.exp(-1.0 / 6.0)
    for k in range(900):
        y[k] = x + 0.3 * rng.standard_normal()
        u[k] = 0.8 * (r[k] - y[k])
        x = pole * x + 2.0 * (1.0 - pole) * u[k]
    return np.c_[u, y, r]


def saved(path, rows, header):
    np.savetxt(path, rows, delimiter=",", header=header, comments="", fmt="%.10g")
    return path


@pytest.mark.slow
def test_the_frequency_response_from_the_reference_is_not_biased_by_feedback(rows, tmp_path):
    named = saved(tmp_path / "named.csv", rows, "u,y,SP")
    plain = saved(tmp_path / "plain.csv", rows, "u,y,r")
    by_name = explore([named], Preparation(columns={"r1": "SP"})).results
    told = by_name.result["exploration"]["frequency_response"]
    assert told["excitation"] == "r"
    assert "caveat" not in told
    table = by_name.tables["frequency_response"].columns
    w, G = table["frequency_rad_per_s"], table["G_re"] + 1j * table["G_im"]
    z, pole = np.exp(1j * w), np.exp(-1.0 / 6.0)
    inside = np.abs(G - 2.0 * (1.0 - pole) / (z - pole)) <= table["radius"]
    assert np.mean(inside) > 0.85
    np.testing.assert_array_equal(read_log(plain, Preparation()).r, rows[:, 2:])
    assert read_log(named, Preparation()).r is None


def test_a_column_r_that_holds_text_is_not_taken_as_the_reference(rows, tmp_path):
    text = saved(tmp_path / "log.csv", rows, "u,y,r").read_text().splitlines()
    text[5] = text[5].rpartition(",")[0] + ",good"
    (tmp_path / "log.csv").write_text("\n".join(text))
    log = read_log(tmp_path / "log.csv", Preparation())
    assert log.r is None
    assert log.lengths == (900,)


def test_references_of_some_inputs_only_are_refused(rows, tmp_path):
    path = saved(tmp_path / "log.csv", rows[:, [0, 0, 1, 2]], "u1,u2,y1,SP")
    (told,) = refused(read_log, path, Preparation(columns={"r1": "SP"}), kind=DataError)
    assert (told.code, "--columns r2=NAME" in told.hint) == ("data-missing-column", True)


LOG = SimpleNamespace(
    u=np.array([[1e5], [1e5 + 2.0], [1e5 + 1.0]]),
    y=np.zeros((3, 1)),
    step=1e-5,
    time_unit="s",
    names={"u1": "a: #\nb", "y1": "y"},
)
FOUND = SimpleNamespace(
    model=stated("plant: {B: [0, 1], F: [1, -0.5]}"),
    taken=(SimpleNamespace(orders=SimpleNamespace(physical=False, family="OE")),),
    estimate=SimpleNamespace(
        names=("b1", "f1"), theta=np.array([1.0, -0.5]), covariance=np.diag([1e-2, 1e-3])
    ),
    integrates=(),
)


def test_the_written_spec_keeps_requirements_and_limits_of_a_given_one():
    """It drops the prior on the parameters of the given spec; another time unit is refused."""
    wishes = "title: a loop\nchannels: {u1: {unit: V}, y1: {name: speed, unit: rpm}}\n"
    wishes += "accuracy: {loop: {max_sensitivity_db: 6}}\nlimits: {amplitude: 3, duration: 4e-3}\n"
    held = (
        "experiment: {controller: {numerator: [1], denominator: [1]}, prior: {information: [[1, 0], [0, 1]]}}"
    )
    spec = parse_spec(
        f"sample_time: 1e-5\nplant: {{B: [0, 2], F: [1, -0.7]}}\nnoise: {{variance: 1}}\n{wishes}{held}"
    )
    found = parse_spec(spec_text(LOG, FOUND, [Path("a.csv")], asked=Asked.of(spec)))
    for name in ("accuracy", "limits", "objective", "title"):
        assert getattr(found, name) == getattr(spec, name)
    named = {name: (one.name, one.unit) for name, one in found.channels.items()}  # names as in the log
    assert named == {"u1": ("a: # b", "V"), "y1": ("speed", "rpm")}
    np.testing.assert_array_equal(
        build_nominal_covariance(found, build_model(found)), FOUND.estimate.covariance
    )
    assert (found.experiment.prior, found.plant.B) == (None, (0, 1))
    assert found.experiment.controller == spec.experiment.controller
    assert code_of(Asked.of(spec).check_unit, "min") == "data-wrong-unit"


def test_a_given_spec_that_does_not_fit_the_model_of_the_log_is_reported(tmp_path):
    """The plant of the spec has other parameters, and the log another unit."""
    log = lag_log(tmp_path / "log.csv", samples=200)
    log.write_text(log.read_text().replace("output", "output (cm)", 1))
    spec = tmp_path / "s.yaml"
    spec.write_text(
        f"sample_time: 0.5\ntime_unit: min\nchannels: {{y1: {{unit: m}}}}\n{PLANT}noise: {{variance: 1}}\n"
        "experiment: {samples: 60}\naccuracy: {standard_deviation: {f1: 0.01}}\nspectrum: {type: white}\n"
    )
    done = CliRunner().invoke(app, ["explore", str(log), "--spec", str(spec), "-o", str(tmp_path / "run")])
    found = {one["code"]: one for one in json.loads((tmp_path / "run/result.json").read_text())["findings"]}
    assert done.exit_code == 0
    assert "idesign validate" in done.output.splitlines()[-1]
    assert found["written-spec-refused"]["figures"]["error"] == "unknown-parameter"
    assert found["unit-not-converted"]["figures"] == {"found": "cm", "stated": "m"}


def test_a_written_spec_finds_the_files_of_the_given_one(tmp_path):
    log, folder = lag_log(tmp_path / "log.csv", samples=200), tmp_path / "specs"
    folder.mkdir()
    (folder / "adm.csv").write_text("frequency,r_adm\n0.001,0.2\n6,0.2\n")
    (folder / "s.yaml").write_text(
        f"sample_time: 0.5\ntime_unit: min\n{PLANT}noise: {{variance: 1}}\nexperiment: {{samples: 60}}\n"
        "accuracy: {model_error: {table: adm.csv, band: [0.01, 5]}}\nspectrum: {type: white}\n"
    )
    spec = load_spec(folder / "s.yaml")
    found = explore(log, asked=spec).results.outcome.findings
    assert "written-spec-refused" not in {one.code for one in found}


@pytest.mark.parametrize(
    ("head", "stated"), [("Valve [%]", ("Valve", "%")), ("u", None), ("level " * 8, None)]
)
def test_channels_of_the_written_spec_are_named_as_in_the_log(head, stated):
    log = SimpleNamespace(**{**vars(LOG), "names": {"u1": head, "y1": "y"}})
    channels = parse_spec(spec_text(log, FOUND, [Path("a.csv")])).channels or {}
    assert [(one.name, one.unit) for one in channels.values()] == ([stated] if stated else [])


@pytest.mark.slow
@pytest.mark.parametrize("inputs", [1, 2])
def test_the_amplitude_of_the_spec_is_the_range_of_the_log(inputs, tmp_path):
    rng = np.random.default_rng(3)
    u = 1e5 + np.repeat(rng.choice([0.0, 1.0, 5.0], (60, inputs), p=[0.6, 0.3, 0.1]), 5, axis=0)
    y = scipy.signal.lfilter([0, 1], [1, -0.8], (u - 1e5).sum(axis=1)) + 0.1 * rng.standard_normal(300)
    log = tmp_path / "log.csv"
    head = [*(f"u{j + 1}" for j in range(inputs)), "y"]
    np.savetxt(log, np.column_stack([u, y]), delimiter=",", header=",".join(head), comments="", fmt="%.10g")
    allowed = parse_spec(explore(log, Preparation(sample_time=1.0)).results.resolved_spec)
    half, level = (np.atleast_1d(one) for one in (allowed.limits.amplitude.input, allowed.signal.offset))
    np.testing.assert_allclose([level - half, level + half], [u.min(axis=0), u.max(axis=0)], atol=1e-4)


@pytest.mark.parametrize("loop", [False, True])
@pytest.mark.parametrize("reasons", [(), ("the record\nis too short: see #3", "y wanders " * 30)])
def test_reasons_for_distrust_stand_in_head_and_title_of_the_written_spec(reasons, loop):
    text = spec_text(LOG, FOUND, [Path('title: "odd".csv')], reasons, loop=loop)
    spec = parse_spec(text)
    doubted = "On a model that deserves no trust: " if reasons else ""
    assert spec.title == f'{doubted}The next experiment after title: "odd".csv'
    assert (spec.sample_time, spec.limits.input_power.max, spec.signal.offset) == (1e-5, 0.666667, 100001.0)
    assert spec.limits.amplitude.input == 1.0  # half of the range of the log
    head = text.partition("\ntitle:")[0].splitlines()
    assert all(line.startswith("#") and len(line) <= 110 for line in head)
    words = " ".join(line.lstrip("# ") for line in head)
    for reason in reasons:
        assert " ".join(reason.split()) in words
    assert ("experiment: {controller:" in words) == loop


MODEL = """
sample_time: 0.5
time_unit: min
plant: {B: [0, 0, 0, 0.2], F: [1, -0.8]}
noise: {variance: 1}
"""


def stored(folder, text=MODEL):
    """A file with a model; the default is the plant of the logs."""
    path = folder / "model.yaml"
    path.write_text(text)
    return path


def test_the_fit_of_a_validated_model_keeps_the_times_of_the_record(tmp_path):
    path = lag_log(tmp_path / "late.csv")
    lines = path.read_text().splitlines()
    head, *rows = (line.split(",") for line in lines)
    shifted = [",".join([f"{float(time) + 1000.0:g}", *rest]) for time, *rest in rows]
    path.write_text("\n".join([",".join(head), *shifted]))
    found = explore(path, model=load_spec(stored(tmp_path), design=False)).results
    assert found.tables["fit"].columns["time_min"][[0, -1]].tolist() == [1000.0, 1149.5]


def test_several_validation_files_are_placed_one_after_the_other(tmp_path):
    files = [lag_log(tmp_path / f"{seed}.csv", seed=seed, samples=100) for seed in (1, 2)]
    judged = explore(files, model=load_spec(stored(tmp_path), design=False)).results
    assert judged.curves["fit"].lengths == (100, 100)
    np.testing.assert_allclose(judged.curves["fit"].time, 0.5 * np.arange(200.0))
    np.testing.assert_array_equal(judged.tables["fit"].columns["record"], np.repeat([1.0, 2.0], 100))


def test_validating_a_model_of_the_wrong_sign_exits_with_one_and_a_reason(tmp_path):
    """The simulation is worse than a constant: the fit is -100 % for the plant with its sign changed."""
    log = lag_log(tmp_path / "log.csv", seed=1)
    model = stored(tmp_path, MODEL.replace("0.2", "-0.2"))
    told = CliRunner().invoke(app, ["explore", str(log), "--validate", str(model), "--no-output"])
    assert told.exit_code == 1
    judged = explore(log, model=load_spec(model, design=False))
    assert judged.results.result["validation"]["reasons"] == list(judged.reasons)
    assert len(judged.reasons) == 1


@pytest.mark.parametrize(("noise", "explained"), [(0.1, 100.0), (1.5, 50.0)])
def test_a_poor_fit_counts_against_a_model_only_if_the_input_explains_residuals(noise, explained, tmp_path):
    """A lag in place of a resonance is doubted; the true plant in strong noise is not."""
    rng = np.random.default_rng(5)
    u, B, F = np.repeat(rng.choice([-1.0, 1.0], 60), 10), [0, 0, 0, 0.09], [1, -1.85, 0.94]
    y = scipy.signal.lfilter(B, F, u) + noise * rng.standard_normal(600)
    table, log = np.column_stack([0.5 * np.arange(600), u, y]), tmp_path / "log.csv"
    np.savetxt(log, table, delimiter=",", header="t_min,u,y", comments="")
    plant = MODEL.replace("[0, 0, 0, 0.2]", str(B)).replace("[1, -0.8]", str(F))
    lag, right = (
        explore(log, model=load_spec(stored(tmp_path, text), design=False)) for text in (MODEL, plant)
    )
    assert right.reasons == ()
    assert right.results.result["validation"]["simulation_fit_percent"] < explained
    doubts = [one.code for one in lag.results.findings if one.severity is Severity.DOUBT]
    assert doubts == ["model-of-other-plant"]
    assert len(lag.reasons) == 1


def test_a_model_without_a_sample_time_is_refused_with_that_of_the_log(tmp_path):
    model = stored(tmp_path, MODEL.replace("sample_time: 0.5\n", ""))
    log = lag_log(tmp_path / "log.csv", seed=1)
    (told,) = refused(explore, log, model=load_spec(model, design=False), kind=DataError)
    assert (told.code, told.key, "sample_time: 0.5" in told.hint) == ("data-not-uniform", "sample_time", True)


def test_a_constant_output_is_refused_alike_with_and_without_a_model(tmp_path):
    path = lag_log(tmp_path / "stuck.csv")
    head, *rows = path.read_text().splitlines()
    path.write_text("\n".join([head, *(f"{row.rsplit(',', 1)[0]},5" for row in rows)]))
    told = []
    for model in (None, load_spec(stored(tmp_path), design=False)):
        with pytest.raises(DataError) as caught:
            explore(path, model=model)
        told += [(one.code, one.message, one.location) for one in caught.value.diagnostics]
    assert told[0] == told[1]
    assert told[0][0] == "constant-output"


@pytest.mark.slow
def test_a_vanishing_dead_time_is_reported_as_near_zero(tmp_path):
    rng = np.random.default_rng(2)
    u = np.isin(np.arange(300) // 10, [2, 3, 4, 5, 6, 7, 8, 17, 18, 19, 20, 21, 22, 23]).astype(float)
    pole = np.exp(-0.1)
    y = scipy.signal.lfilter([0, 1 - pole], [1, -pole], u) + 0.05 * rng.standard_normal(300)
    path = tmp_path / "log.csv"
    rows = "".join(f"{k},{a:g},{b:.5f}\n" for k, (a, b) in enumerate(zip(u, y, strict=True)))
    path.write_text(f"time,u,y\n{rows}")
    found = explore(path).results
    assert "L 0 +-" in summary(found.outcome, "s", [])
    assert [one["code"] for one in found.result["findings"] if one["where"] == "L"] == ["parameter-near-zero"]
    estimate = found.result["identification"]
    assert 0.0 <= estimate["theta"]["L"] <= 1.96 * estimate["standard_deviation"]["L"] < 1.0
