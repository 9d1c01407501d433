"""Instructions of a design: how to apply and log its signal, and how to judge the record."""

import json
import shlex
import shutil
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
import scipy.signal

from inputdesign_cli.cli.applying import instructions
from inputdesign_cli.errors import EXIT_DONE, EXIT_MISSED, EXIT_UNDECIDED


def words(applied, caused, point=None):
    noise = [f"{y}_noise_deviation" for y in caused]
    columns = {"signal": applied, "predicted_output": [*caused, *noise]}
    tables = {
        name: SimpleNamespace(columns=dict.fromkeys(["time_s", *names])) for name, names in columns.items()
    }
    signal = SimpleNamespace(sample_time=2.0, operating_point=point)
    results = SimpleNamespace(tables=tables, time_unit="s", outcome=SimpleNamespace(signal=signal))
    return " ".join(instructions(results, "spec.yaml"))


@pytest.mark.parametrize(
    ("said", "parts"),
    [
        (words(["u1 valve (%)", "u2"], ["y1", "y2"], [40.0, 5.0]),
         ("log time, u1, u2, y1 and y2 every 2 s", "--columns time=NAME,u1=NAME,u2=NAME,y1=NAME,y2=NAME",
          "--operating-point u1=40,u2=5,y1=REST,y2=REST")),
        # A converter of 31 steps of 24/31 V has no level of 10 V: the record swings about another.
        (words(["u1"], ["y1"], [10.5]), ("--operating-point u1=10.5,y1=REST",)),
        (words(["u1"], ["y1"]), ("idesign assess spec.yaml log.csv",)),
        # A reference is no position of the actuator.
        (words(["r1"], ["u1", "y1"], [40.0]),
         ("has the level 40 of the input in it: while y rests, u = r",
          "u = r - C y", "may go further than the actuator", "log time, r1, u1 and y1 ",
          "--operating-point u1=40,y1=REST")),
    ],
)  # fmt: skip
def test_instructions_state_the_columns_to_log_and_the_operating_point(said, parts):
    assert [one for one in parts if one not in said] == []


SPEC = """\
sample_time: 2
plant: {B: [0, 1], F: [1, -0.5]}
noise: {variance: 0.01}
experiment: {samples: 60}
accuracy: {model_error: {relative: 0.5}}
limits: {amplitude: 1}
objective: best_accuracy
signal: {type: binary, candidates: 1, seed: 1, offset: 4}
solver: {any_spectrum: false}
"""


def test_the_command_that_solve_names_judges_its_record(run, tmp_path):
    """It has the operating point, and the run's spec the changes by --set. A second lag refutes the model."""
    (tmp_path / "spec.yaml").write_text(SPEC)
    _, out, _ = run("solve", "spec.yaml", "--set", "limits.amplitude=2", "--no-figures")
    *_, last = out.splitlines()
    command = shlex.split(last.removeprefix("Then: idesign ").partition("   (")[0].replace("REST", "7"))
    u = np.loadtxt("runs/spec/signal.csv", delimiter=",", skiprows=1)[:, 1]
    assert sorted(set(u)) == [2.0, 6.0]

    def record(name, plant, slower=1.0):
        y = 7.0 + scipy.signal.lfilter([0, 1], plant, u - 4.0)
        y += 0.1 * np.random.default_rng(1).standard_normal(u.size)
        rows = np.column_stack([2.0 * np.arange(u.size), u, slower * y])
        np.savetxt(name, rows, delimiter=",", header="time,u1,y1", comments="")

    for plant, asked, expected in (
        ([1, -0.5], 0.5, EXIT_DONE),
        ([1, -0.5], 0.001, EXIT_MISSED),
        ([1, -1.3, 0.4], 0.5, EXIT_UNDECIDED),
    ):
        record("log.csv", plant)
        code, out, err = run(*command, "--no-figures", "--set", f"accuracy.model_error.relative={asked}")
        assert code == expected, out + err
        if expected == EXIT_MISSED:  # the command that judges the additional record, too, runs as printed
            record("MORE.csv", plant, 1.001)
            then = shlex.split(out.splitlines()[-1].removeprefix("Then: idesign "))
            assert run(*then, "--no-figures", "--quiet")[0] in (EXIT_DONE, EXIT_MISSED)
            both = json.loads((tmp_path / "runs/log_and_1_more_assessed/result.json").read_text())
            assert [Path(one).name for one in both["made_from"][1:]] == ["log.csv", "MORE.csv"]
            Path("MORE.csv").unlink()
            shutil.rmtree("runs/log_and_1_more_assessed")
        assert ("Then: idesign assess" in out) == (expected == EXIT_MISSED)
    # Records that are judged together have their own run next to the run of the first alone.
    record("log.csv", [1, -0.5])
    record("more.csv", [1, -0.5], 1.001)
    assert run(*command, "more.csv", "--no-figures")[0] != 2
    assert (tmp_path / "runs/log_and_1_more_assessed/result.json").is_file()
