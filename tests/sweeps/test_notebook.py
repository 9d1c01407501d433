"""`sweep` from Python: a function in whatever order things are imported, of a file or a spec, to a table."""

import pkgutil
import subprocess
import sys

import numpy as np
import pandas
import pytest

import inputdesign_cli
from inputdesign_cli import load_spec, parse_spec, sweep
from inputdesign_cli.errors import SpecError
from tests.support.sweep_files import SPEC, rows

IMPORTS = (
    "from inputdesign_cli import sweep",
    "import inputdesign_cli.sweeps.running",
    "import inputdesign_cli.cli",
)


def test_no_public_name_is_that_of_a_module():
    """A module that is imported takes the place of the function of its name."""
    modules = {module.name for module in pkgutil.iter_modules(inputdesign_cli.__path__)}
    assert modules & {name for name in inputdesign_cli.__all__ if name != "__version__"} == set()


@pytest.mark.first(1)
@pytest.mark.parametrize("order", [IMPORTS, IMPORTS[1:] + IMPORTS[:1], IMPORTS[2:] + IMPORTS[:2]], ids=str)
def test_it_is_a_function_in_every_order_of_imports(order):
    code = "\n".join([*order, "import inputdesign_cli as i", "from inputdesign_cli import sweep"])
    code += "\nfrom inputdesign_cli.sweeps.notebook import sweep as function"
    code += "\nassert sweep is function and i.sweep is function and callable(function)"
    subprocess.run([sys.executable, "-c", code], check=True)


def test_a_file_and_a_spec_give_the_same_frame(spec, stub, tmp_path):
    varied = {"experiment.samples": np.array([10, 20]), "spectrum.order": "0:2:1"}
    frames = [
        sweep(str(spec), ["experiment.samples=10,20", "spectrum.order=0:2:1"]),
        sweep(spec, varied),
        sweep(load_spec(spec), varied),
        sweep(parse_spec(SPEC + "sweep: {set: {experiment.samples: [10, 20], spectrum.order: '0:2:1'}}")),
    ]
    for frame in frames:
        assert isinstance(frame, pandas.DataFrame)
        pandas.testing.assert_frame_equal(frame.drop(columns="time_s"), frames[0].drop(columns="time_s"))
        assert "run" not in frame
    expected = [100 / n + 1 / (1 + m) for n in (10, 20) for m in (0, 1, 2)]
    np.testing.assert_allclose(frames[0]["objective.value"], expected)


def test_a_spec_names_files_from_its_folder(tmp_path, stub, monkeypatch):
    text = SPEC.replace("{relative: 0.1}", "{table: r.csv}")
    (tmp_path / "r.csv").write_text("frequency,r_adm\n0.1,1\n3.2,1\n")
    stated = parse_spec(text, folder=tmp_path)
    monkeypatch.chdir("/")
    first = sweep(stated, "experiment.samples=10,20", directory=tmp_path / "out")
    assert list(first["status"]) == ["optimal", "optimal"]
    (tmp_path / "r.csv").write_text("frequency,r_adm\n0.1,2\n3.2,1\n")
    sweep(stated, "experiment.samples=10,20", directory=tmp_path / "out")
    assert stub == [10, 20, 10, 20]


def test_a_directory_keeps_the_runs(spec, stub, tmp_path):
    out = tmp_path / "out"
    for _ in range(2):
        frame = sweep(spec, {"experiment.samples": [10, 20]}, directory=out)
    assert stub == [10, 20]
    assert list(frame["run"]) == [row["run"] for row in rows(out)]
    assert all((out / run).is_dir() for run in frame["run"])


def test_points_without_a_result_are_rows(spec, stub):
    frame = sweep(spec, {"experiment.samples": [6, 7, 9]})
    assert list(frame["status"]) == ["optimal", "infeasible", "error"]
    assert np.isfinite(frame["objective.value"]).tolist() == [True, False, False]


def test_nothing_to_vary_is_an_error(spec, stub):
    for settings in ((), {}, {"experiment.samples": 5}):
        with pytest.raises(SpecError):
            sweep(spec, settings)
    assert stub == []
