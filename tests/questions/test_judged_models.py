"""A model that is judged by a log: `idesign explore LOG --validate MODEL`."""

import re

import numpy as np
import pytest
import scipy.signal
from typer.testing import CliRunner

from inputdesign_cli.cli import app
from inputdesign_cli.errors import DataError
from inputdesign_cli.questions import explore
from inputdesign_cli.specification import load_spec
from tests.support.logs import lag_log

MODEL = """
sample_time: 0.5
time_unit: min
plant: {B: [0, 0, 0, 0.2], F: [1, -0.8]}
noise: {variance: 1}
"""


def stored(folder, text=MODEL):
    """A model as a file; as it stands, it is the plant of the logs."""
    path = folder / "model.yaml"
    path.write_text(text)
    return path


def test_times_of_the_record_stay_under_a_verdict(tmp_path):
    path = lag_log(tmp_path / "late.csv")
    lines = path.read_text().splitlines()
    head, *rows = (line.split(",") for line in lines)
    shifted = [",".join([f"{float(time) + 1000.0:g}", *rest]) for time, *rest in rows]
    path.write_text("\n".join([",".join(head), *shifted]))
    found = explore(path, model=load_spec(stored(tmp_path), design=False)).results
    assert found.tables["fit"].columns["time_min"][[0, -1]].tolist() == [1000.0, 1149.5]


def test_files_that_a_model_is_judged_by_follow_each_other(tmp_path):
    files = [lag_log(tmp_path / f"{seed}.csv", seed=seed, samples=100) for seed in (1, 2)]
    judged = explore(files, model=load_spec(stored(tmp_path), design=False)).results
    assert judged.curves["fit"].lengths == (100, 100)
    np.testing.assert_allclose(judged.curves["fit"].time, 0.5 * np.arange(200.0))
    np.testing.assert_array_equal(judged.tables["fit"].columns["record"], np.repeat([1.0, 2.0], 100))


def test_a_model_of_the_wrong_sign_is_told_and_exits_with_one(tmp_path):
    """Its simulation is worse than a level: -100 % where the model is the plant with its sign changed."""
    log = lag_log(tmp_path / "log.csv", seed=1)
    model = stored(tmp_path, MODEL.replace("0.2", "-0.2"))
    told = CliRunner().invoke(app, ["explore", str(log), "--validate", str(model), "--no-output"])
    assert told.exit_code == 1
    assert "less than 5 % is nothing" in re.sub(r"\s+", " ", told.stdout)
    judged = explore(log, model=load_spec(model, design=False))
    assert judged.results.result["validation"]["reasons"] == list(judged.reasons)
    assert len(judged.reasons) == 1


@pytest.mark.parametrize(("noise", "explained"), [(0.1, 100.0), (1.5, 50.0)])
def test_a_poor_fit_is_held_against_a_model_where_inputs_explain_the_rest(noise, explained, tmp_path):
    """A lag in place of a resonance; and the plant itself in noise that hides most of it."""
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
    assert ["past inputs explain" in reason for reason in lag.reasons] == [True]


def test_a_model_without_a_sample_time_is_named(tmp_path):
    model = stored(tmp_path, MODEL.replace("sample_time: 0.5\n", ""))
    with pytest.raises(DataError, match=r"none is stated.*in model.yaml") as caught:
        explore(lag_log(tmp_path / "log.csv", seed=1), model=load_spec(model, design=False))
    assert "write sample_time: 0.5 in it" in caught.value.diagnostics[0].hint


def test_an_output_that_never_changes_is_refused_as_without_a_model(tmp_path):
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
