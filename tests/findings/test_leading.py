"""One finding explains the others, and the command that it names leads to a verdict."""

import json
import shlex
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
import scipy.signal

from inputdesign_cli import assess, load_spec, parse_spec
from inputdesign_cli.errors import EXIT_DONE, EXIT_MISSED, EXIT_UNDECIDED
from inputdesign_cli.finding import NOTE, REFUTED, UNDECIDED, Finding
from inputdesign_cli.findings import kinds
from inputdesign_cli.findings.faults import follows_inputs
from inputdesign_cli.findings.leading import Leading, _no_leak, following, leading
from inputdesign_cli.findings.places import Record
from inputdesign_cli.questions import explore
from inputdesign_cli.questions.building.system import build_model
from inputdesign_cli.records import Preparation
from tests.explore.test_choice import lagging_tank
from tests.support.commands import caller
from tests.support.heater import said

ASKED = "accuracy={model_error: {relative: 0.15, band: [0.0005, 0.01]}}"
SPEC = f"""
sample_time: 15
noise: {{variance: 0.01}}
experiment: {{samples: 480}}
limits: {{input_power: 36}}
spectrum: {{type: fir, order: 10}}
{ASKED.replace("=", ": ")}
"""
IN_S = "{continuous: {gain: 1.6, time_constant: 240, dead_time: 35}, sample: zoh}"
IN_Q = "{B: [0, 0, 0, 0.08, 0.01], F: [1, -0.944]}"
STEP, K, T, L = 15, 1.72, 262.0, 31


def record(path, fault, seed, samples=480):
    """Write a record of a heat exchanger whose model in the spec is right but for one fault."""
    rng = np.random.default_rng(seed)
    n, pole, lag = samples * STEP, np.exp(-1.0 / T), np.exp(-1.0 / 60.0)
    u = np.repeat(rng.choice([-6.0, 6.0], n // 150 + 1), 150)[:n]
    late = L + 45 * (fault == "delay")
    y = scipy.signal.lfilter([0, K * (1 - pole)], [1, -pole], np.concatenate([np.zeros(late), u])[:n])
    if fault == "lag":
        y = scipy.signal.lfilter([1 - lag], [1, -lag], y)
    if fault == "inverse":
        y = y - 60.0 * np.diff(y, prepend=0.0)
    colour = np.exp(-STEP / 60.0) * (fault == "noise")
    e = 0.1 * np.sqrt(1.0 - colour**2) * rng.standard_normal(samples)
    time, slope = STEP * np.arange(samples), (fault == "drift") / 3600.0
    values = y[::STEP] + scipy.signal.lfilter([1], [1, -colour], e) + slope * time
    table = np.column_stack([time, u[::STEP] + 45, values + 82])
    np.savetxt(path, table, delimiter=",", header="time,u1,y1", comments="")
    return path


def followed(spec, data, command):
    """The outcome of the command that a verdict names."""
    if command.startswith("idesign explore"):
        assert shlex.split(command) == ["idesign", "explore", str(data)]
        found = explore([data]).results.resolved_spec
        return assess(parse_spec(found, overrides=[ASKED]), data)
    *again, option, value = shlex.split(command)
    assert again == ["idesign", "assess", "SPEC", str(data)]
    if option == "--detrend":
        return assess(spec, data, preparation=Preparation(detrend=value))
    assert option == "--set"
    return assess(parse_spec(spec.to_yaml(), overrides=[value]), data)


def ended(fault, plant, seed, path):
    """Whether a verdict is reached, if necessary by the command that the first one names."""
    spec, data = parse_spec(f"plant: {plant}{SPEC}"), record(path / f"{fault}.csv", fault, seed)
    found = assess(spec, data)
    command = found.results.outcome.assessment.next
    assert (command is not None) == (found.verdict == "undecided")
    if command is None:
        return True
    assert len(said(found.results).split()) <= 150
    return followed(spec, data, command).verdict != "undecided"


@pytest.mark.first(1)
@pytest.mark.parametrize(("fault", "seed"), [("noise", 0), ("drift", 0)])
def test_the_named_command_leads_to_a_verdict(fault, seed, tmp_path):
    assert ended(fault, IN_Q, seed, tmp_path)


@pytest.mark.parametrize(
    ("known", "names", "named"),
    [
        ("log.csv", "b3 b4 f1 d1", "solve"),
        ("log.csv", "K T L", "explore"),
        ("other.csv", "b3 b4 f1", "explore"),
    ],
)
def test_a_structure_that_explore_chose_by_the_same_data_is_not_explored_again(
    known, names, named, tmp_path, monkeypatch, capsys
):
    monkeypatch.chdir(tmp_path)
    record(tmp_path / "log.csv", "delay", 0)
    Path("run").mkdir()
    Path("run/spec.yaml").write_text(f"plant: {IN_Q}{SPEC}")
    made = {"format": 1, "exploration": {}, "made_from": ["../spec.yaml", f"../{known}"]}
    made["identification"] = {"theta": dict.fromkeys(names.split(), 1.0)}
    Path("run/result.json").write_text(json.dumps(made))
    code, out, _ = caller(monkeypatch, capsys)("assess", "run/spec.yaml", "log.csv", "--no-figures")
    assert code == EXIT_UNDECIDED
    assert out.splitlines()[-1].startswith(f"next: idesign {named} ")


@pytest.mark.first(1)
@pytest.mark.parametrize("fault", ["drift", "delay"])
def test_the_command_runs_as_it_is_printed(fault, tmp_path, monkeypatch, capsys):
    """It runs in the folder of the user, with blanks in file names and with the options that were typed."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr("inputdesign_cli.figures.plots.draw_all", lambda *_: {})
    folder, idesign = Path("of today"), caller(monkeypatch, capsys)
    folder.mkdir()
    record(folder / "a record.csv", fault, 0)
    renamed = (folder / "a record.csv").read_text().replace("time,u1,y1", "time,valve,outlet")
    (folder / "a record.csv").write_text(renamed)
    (folder / "heat exchanger.yaml").write_text(f"plant: {IN_Q}{SPEC}")
    options = ["--columns", "u=valve,y=outlet", "--set", "title=a trial"]
    options += ["--operating-point", "u1=0,y1=0"] if fault == "delay" else []
    code, out, _ = idesign("assess", folder / "heat exchanger.yaml", folder / "a record.csv", *options)
    assert code == EXIT_UNDECIDED
    printed = out.splitlines()[-1].removeprefix("next: ")
    assert json.loads(Path("runs/a record_assessed/result.json").read_text())["assessment"]["next"] == printed
    code, out, _ = idesign(*shlex.split(printed)[1:])
    assert code == EXIT_DONE
    if fault == "delay":  # explore keeps what the spec asks for, and names the command that judges it
        then = out.splitlines()[-1].removeprefix("Then: ")
        assert "--operating-point u1=0,y1=0" in then
        assert idesign(*shlex.split(then)[1:])[0] in (EXIT_DONE, EXIT_MISSED)
        # A spec that lies where explore writes is explored again beside it.
        spec = Path("runs/a record_explored/spec.yaml")
        spec.write_text((folder / "heat exchanger.yaml").read_text())
        code, out, _ = idesign("assess", spec, folder / "a record.csv", *options, "-o", "again")
        assert code == EXIT_UNDECIDED
        assert idesign(*shlex.split(out.splitlines()[-1].removeprefix("next: "))[1:])[0] == EXIT_DONE


@pytest.mark.slow
@pytest.mark.parametrize("plant", [IN_S, IN_Q], ids=["s", "q"])
@pytest.mark.parametrize("fault", ["noise", "drift", "lag", "inverse", "delay"])
def test_the_named_command_leads_to_a_verdict_in_nine_of_ten_records(fault, plant, tmp_path):
    assert sum(ended(fault, plant, seed, tmp_path) for seed in range(10)) >= 9


def test_findings_that_may_follow_from_the_first_one_say_so():
    """Only the message changes. Notes on the preparation of a record do not follow from a finding."""
    first = Finding("plant-structure", REFUTED, "a lag is missing")
    drift = Finding("drift", REFUTED, "it drifts", "y1", {"probability": 1e-9})
    note = Finding("segments", NOTE, "two segments")
    found = following([note, drift, first], Leading([first], "idesign explore log.csv"))
    assert found == [note, replace(drift, message="This may follow from plant-structure: it drifts"), first]


@pytest.mark.parametrize("seed", [0, 10])
def test_the_sum_of_coloured_and_white_noise_is_modelled_without_a_command(seed, tmp_path):
    """The sensor of a room adds white noise; the first larger noise model left coloured residuals."""
    rng, n, pole, fades = np.random.default_rng(seed), 864, np.exp(-100 / 2700), np.exp(-100 / 600)
    u = 10.0 * np.repeat(rng.choice([-1.0, 1.0], n // 6), 6)
    y = scipy.signal.lfilter([0, 0, 0.14 * (1 - pole)], [1, -pole], u)
    y += scipy.signal.lfilter([1], [1, -fades], 0.08 * np.sqrt(1 - fades**2) * rng.standard_normal(n))
    y += 0.05 * rng.standard_normal(n)
    table = np.column_stack([100.0 * np.arange(n), u, np.round(y, 2)])
    np.savetxt(tmp_path / "room.csv", table, delimiter=",", header="time,u1,y1", comments="")
    spec = parse_spec("""
sample_time: 100
plant: {continuous: {gain: 0.15, time_constant: 3600, dead_time: 210}, sample: zoh}
noise: {standard_deviation: 0.1, correlation_time: 600}
experiment: {samples: 864}
accuracy: {model_error: {relative: 0.5, band: [0.0001, 0.003]}}
limits: {amplitude: 10}
""")
    found = assess(spec, tmp_path / "room.csv")
    assert found.verdict == "met"
    assert "noise-estimated-along" in {one.code for one in found.results.findings}


@pytest.mark.parametrize("of_inputs", [True, False])
def test_spikes_that_follow_the_moves_of_inputs_are_no_faults_of_measurement(of_inputs):
    rng = np.random.default_rng(0)
    u = np.repeat(rng.choice([-1.0, 1.0], 60), 10)[:, None]
    late = np.concatenate([np.zeros(2), np.diff(u[:, 0], prepend=u[0])[:-2]])
    other = np.where(rng.random(600) < 0.05, rng.standard_normal(600), 0.0)
    errors = late if of_inputs else other
    assert follows_inputs(errors[errors != 0.0], np.flatnonzero(errors).tolist(), u) == of_inputs


DATA = Record(np.zeros((40, 1)), np.zeros((40, 1)), None, np.arange(40.0), (40,), (("a.csv", 40),))


def test_every_finding_that_leaves_a_verdict_open_names_a_command():
    """The message of a refuted campaign has its own command."""
    open_ = {code for code, kind in kinds().items() if kind.severity in (REFUTED, UNDECIDED)}
    for code in open_ - {"campaign-refuted"}:
        first = leading([Finding(code, REFUTED, "x", "", {"rows": []})], None, DATA)
        assert first.command.startswith(
            ("idesign assess SPEC DATA", "idesign explore DATA", "idesign solve SPEC ")
        )
        assert "{" not in first.command.replace("{numerator", "")


@pytest.mark.parametrize(("pole", "explores"), [(0.7, True), (1.2, False)])
def test_an_unstable_plant_is_not_explored(pole, explores, tmp_path, monkeypatch):
    """The spec lacks a lag, and has an integrator: messages say "lowest frequencies", not 1e-13 rad/s."""
    monkeypatch.chdir(tmp_path)
    rng, N = np.random.default_rng(0), 400
    r, e = rng.choice([-2.0, 2.0], N), 0.3 * rng.standard_normal(N)
    loop = np.polyadd(np.polymul([1, -pole], [1, -0.6]), [0, 0.4, 0])  # y = 0.4 q^-1 u / A, u = r - y
    y = scipy.signal.lfilter([0, 0.4], loop, r) + scipy.signal.lfilter([1], loop, e)
    table = np.column_stack([r, r - y, y])
    np.savetxt("log.csv", table, delimiter=",", header="r1,u1,y1", comments="", fmt="%.9g")
    found = assess(
        parse_spec("""
plant: {A: [1, -1], B: [0, 0.5]}
noise: {variance: 0.09}
experiment: {samples: 400, controller: {numerator: [1], denominator: [1]}}
cost: {input_power: 1}
accuracy: {model_error: {relative: 0.1}}
spectrum: {type: fir, order: 4}
"""),
        "log.csv",
    )
    assert found.verdict == "undecided"
    command = found.results.outcome.assessment.next
    assert command.startswith("idesign explore log.csv" if explores else "idesign assess SPEC log.csv")
    (far,) = (one for one in found.results.findings if one.code == "another-plant")
    assert ("e-13 rad" in far.message, "lowest frequencies" in far.message) == (False, True)


@pytest.mark.parametrize(
    ("codes", "first"),
    [
        (["noise-structure", "plant-structure", "drift", "plant-changed"], "plant-structure"),
        (["plant-nonlinear", "drift", "noise-structure"], "drift"),
        (["plant-structure", "input-logged-late"], "input-logged-late"),
        (["no-accuracy-here", "search-not-settled"], "search-not-settled"),
        (["input-without-effect", "records-differ"], "records-differ"),
    ],
)
def test_the_finding_that_explains_the_others_comes_first(codes, first):
    found = leading([Finding(code, REFUTED, code) for code in codes], None, DATA)
    assert [one.code for one in found.findings] == [first]
    assert leading([], None, DATA) is None


def led(plant, noise, *codes):
    """The command after findings of these codes (none: a drift), for a model of this plant and noise."""
    text = f"sample_time: 10\nplant: {plant}\nnoise: {noise}\n"
    model = build_model(parse_spec(text, design=False))
    estimate = SimpleNamespace(
        search=SimpleNamespace(records=SimpleNamespace(kind=SimpleNamespace(model=model))),
        tests=SimpleNamespace(scores=(), failed_besides=()),
    )
    line = np.linspace(0.0, 9.0, 200)[:, None] + np.random.default_rng(0).standard_normal((200, 1))
    data = Record(np.sin(np.arange(200.0))[:, None], line, None, np.arange(200.0), (200,), (("a.csv", 200),))
    found = {one: {"rows": [[10, 160]]} if one == "level-shift" else {} for one in codes or ("drift",)}
    kinds_ = [Finding(one, REFUTED, one, "", figures) for one, figures in found.items()]
    return leading(kinds_, estimate, data).command


LAG = "{continuous: {gain: 1, time_constant: 60}, sample: zoh}"
TANK = "{continuous: {numerator: [0.02], denominator: [1, 0], delay: 10}, sample: zoh}"
NAMED_TANK = TANK.replace("{cont", "{parameters: {slope: 0.02}, cont").replace("[0.02]", "[slope]")


def test_a_missing_lag_is_not_taken_for_a_leak():
    """Past inputs explain the residuals (p = 1e-7); a leak does less well (0.4, 3e-4), or better (1e-9)."""
    for probability, leaks in ((0.4, False), (3e-4, False), (1e-9, True)):
        tests = SimpleNamespace(
            scores=(SimpleNamespace(name="leak", probability=probability),),
            failed_besides=(SimpleNamespace(fault="plant", probability=1e-7),),
        )
        assert _no_leak(SimpleNamespace(tests=tests)) is not leaks


def test_no_command_adds_a_drift_or_a_leak_that_the_model_has():
    """A line in the output of a tank is its response to the input, or a leak; noise drifts once only."""
    assert "--detrend linear" in led(LAG, "{variance: 1}")
    noise = "{standard_deviation: 1, correlation_time: 60}"
    assert "noise.drift=true" in led(TANK, noise)
    assert led(TANK, noise.replace("}", ", drift: true}")).startswith("idesign explore")
    for code in ("plant-structure", "drift"):
        assert led(LAG, noise.replace("}", ", drift: true}"), code).startswith("idesign explore")
    of_structure = ("drift", "plant-structure")
    for more in ((), of_structure, (*of_structure, "noise-structure"), ("level-shift",)):
        assert '"plant.continuous.denominator=[1, leak]"' in led(NAMED_TANK, noise, *more)
    assert "leak" not in led(LAG, "{variance: 1}", *of_structure)
    assert "leak" not in led(LAG, "{variance: 1}", "level-shift")


LAGGING = """
sample_time: 5
plant:
  parameters: {slope: 0.018, dead_time: 10}
  continuous: {numerator: [slope], denominator: [1, 0], delay: dead_time}
  sample: zoh
noise: {standard_deviation: 0.05, correlation_time: 10}
experiment: {samples: 600}
accuracy: {model_error: {relative: 0.5, band: [0.01, 0.1]}}
limits: {amplitude: 2}
spectrum: {type: multisine, lines: 100}
"""


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(3))
def test_a_tank_behind_a_lagging_valve_is_led_to_its_model(seed, tmp_path):
    """Slope 0.02/s, lag 20 s, dead time 8 s: the spec has no lag; `explore` finds it, and its spec is met."""
    spec, log, (u, y) = (
        tmp_path / "s.yaml",
        tmp_path / "log.csv",
        lagging_tank(np.random.default_rng(seed), 600),
    )
    spec.write_text(LAGGING)
    rows = np.column_stack([5.0 * np.arange(600), u, y])
    np.savetxt(log, rows, delimiter=",", header="time,u1,y1", comments="", fmt="%.10g")
    judged = assess(spec, log)
    command = judged.results.outcome.assessment.next
    assert (judged.verdict, command.split()[:2]) == ("undecided", ["idesign", "explore"])
    found = explore(log, asked=load_spec(spec))
    assert found.reasons == ()
    theta = found.results.result["identification"]["theta"]
    assert [theta[name] for name in ("K", "T", "L")] == pytest.approx([0.02, 20.0, 8.0], rel=0.05, abs=0.5)
    again = assess(parse_spec(found.results.resolved_spec), log, remove_means=True)
    assert again.met
