"""`idesign signal`: files that other programs read, and refusals."""

import json
import re

import numpy as np
import pytest
import scipy.io
from typer.testing import CliRunner

from inputdesign_cli.cli import app


def run(*words):
    return CliRunner().invoke(app, ["signal", *map(str, words)])


def test_every_kind_of_file_holds_the_same_samples(tmp_path):
    files = [tmp_path / f"u.{ending}" for ending in ("csv", "mat", "npz", "h")]
    words = [word for file in files for word in ("-o", file)]
    result = run("--prbs", 5, "--hold", 2, "--range", "20:80", "--sample-time", 0.5, *words)
    assert result.exit_code == 0, result.output
    csv, mat, npz, header = files
    table = np.loadtxt(csv, delimiter=",", skiprows=1)
    assert csv.read_text().splitlines()[0] == "time_s,u1"
    assert table[:, 0] == pytest.approx(0.5 * np.arange(62))
    u = table[:, 1]
    assert set(np.unique(u)) == {20.0, 80.0}
    assert scipy.io.loadmat(mat)["u1"][:, 0].tolist() == u.tolist()
    with np.load(npz) as content:
        assert content["u1"].tolist() == u.tolist()
        assert content["sample_time"] == 0.5
    (listed,) = re.findall(r"u1\[SIGNAL_SAMPLES\] = \{(.*?)\}", header.read_text(), re.DOTALL)
    assert [float(number) for number in listed.split(",")] == u.tolist()
    assert "#define SIGNAL_SAMPLES 62" in header.read_text()


def test_equal_commands_make_equal_files(tmp_path):
    for name in ("a", "b"):
        run(
            "--multisine", 5, "--samples", 100, "-o", tmp_path / f"{name}.npz", "-o", tmp_path / f"{name}.mat"
        )
    for ending in ("npz", "mat"):
        assert (tmp_path / f"a.{ending}").read_bytes() == (tmp_path / f"b.{ending}").read_bytes()


def test_the_order_of_excitation_is_reported():
    found = json.loads(run("--multisine", 8, "--samples", 200, "--json").stdout)["signal"]
    assert found["channels"]["u1"]["order_of_excitation"] == 16
    assert "order 16" in run("--multisine", 8, "--samples", 200).stdout


def test_pictures_are_drawn(tmp_path):
    assert run("--chirp", "0.1:1", "-o", tmp_path / "u.png").exit_code == 0
    assert {file.name for file in tmp_path.iterdir()} == {"u.png", "u_spectrum.png"}


@pytest.mark.parametrize(
    ("words", "said"),
    [
        ([], "give one of"),
        (["--prbs", 5, "--steps", 3], "give one of"),
        (["--prbs", 5, "-o", "u.txt"], "ends with none of"),
        (["--chirp", "2"], "LOW:HIGH"),
        (["--chirp", "1:0.1"], "write 0.1:1?"),
        (["--chirp", "0.1:9"], "Nyquist"),
        (["--chirp=-1:1"], "within 0 to 1e+15"),
        (["--multisine", 5, "--range", "5:1"], "write 1:5?"),
        (["--multisine", 5, "--range", "5:5"], "1e-15 apart"),
        (["--chirp", "0.1:1", "--inputs", 2], "moves one input"),
        (["--multisine", 5, "--inputs", 2, "--range", "0:1,0:1,0:1"], "3 ranges"),
        (["--multisine", 500, "--samples", 100], "49 harmonics"),
        (["--multisine", 5, "--samples", 100, "--periods", 3], "--samples 99"),
        (["--steps", 3, "--sample-time", 0], "positive"),
        (["--steps", 3, "--sample-time", "nan"], "positive"),
        (["--steps", 3, "--time-unit", "fortnight"], "is not one of"),
        (["--prbs", 5, "--range=-1e308:1e308"], "1e-15"),
        (["--prbs", 5, "--range", "1e-320:2e-320"], "1e-15"),
        (["--steps", 5, "--sample-time", "1e-320"], "1e-15"),
        (["--chirp", "0.1:1e300"], "1e-15"),
        (["--prbs", 5, "--band", "0:1"], "does nothing to"),
        (["--prbs", 5, "--odd"], "does nothing to"),
        (["--chirp", "0.1:1", "--hold", 7], "does nothing to"),
        (["--steps", 5, "--periods", 2], "does nothing to"),
        (["--chirp", "0.1:1", "--band", "0:3"], "does nothing to"),
        (["--kind", "steps", "--samples", 20, "--hold", 30], "keeps one value"),
        (["--kind", "white", "--samples", 30, "--band", "1.1:1.2"], "keeps one value"),
        (["--kind", "white", "--samples", 61, "--periods", 3], "--samples 60"),
        (["--kind", "multisine", "--samples", 60, "--periods", 2, "--hold", 7], "--samples 56"),
        (["--kind", "chirp", "--samples", 120, "--periods", 3, "--band", "0.01:0.1"], "--samples 345"),
        (["--kind", "white", "--band", "0.1:2", "--hold", 2], "Nyquist"),
        (["--prbs", 5, "--range", "999999999:1000000000"], "millionth"),
        (["--prbs", 5, "-o", "u.png", "-o", "u_spectrum.png"], "written twice"),
    ],
)
def test_signals_that_cannot_be_made_are_refused_with_the_reason(words, said, tmp_path):
    result = run(*words, *([] if "-o" in words else ["-o", tmp_path / "u.csv"]))
    assert result.exit_code == 2
    assert said in result.output
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize(("asked", "there"), [("u.csv", "u.csv"), ("u.png", "u_spectrum.png")])
def test_files_are_not_replaced_unasked(asked, there, tmp_path):
    asked, file = tmp_path / asked, tmp_path / there
    file.write_text("mine")
    assert run("--steps", 3, "-o", asked).exit_code == 2
    assert [one.read_text() for one in tmp_path.iterdir()] == ["mine"]
    assert run("--steps", 3, "-o", asked, "--overwrite").exit_code == 0
    assert file.read_bytes() != b"mine"
