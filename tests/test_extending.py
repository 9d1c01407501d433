"""The promise of docs/CONTRIBUTING.md: what its examples add from outside is designed and proved."""

import json
import re
from dataclasses import replace
from pathlib import Path

import cvxpy as cp
import numpy as np
import pydantic
import pytest
from typer.testing import CliRunner

from extending.pieces import PiecesBasis
from extending.total_variance import TotalVariance
from inputdesign_cli import parse_spec, plugins, solve
from inputdesign_cli.cli import app
from inputdesign_cli.errors import SpecError
from inputdesign_cli.questions.building import requirements as builders
from inputdesign_cli.questions.task import build_task
from inputdesign_cli.specification import loading
from inputdesign_cli.specification.models import accuracy as words
from inputdesign_cli.specification.models.spec import Spec

PAGE = (Path(__file__).parent.parent / "docs" / "CONTRIBUTING.md").read_text(encoding="utf-8")
SAMPLES, VARIANCE, ORDER = 200, 0.5, 6

SPEC = """
plant: {{B: [0, 1, 0.5, 0.2]}}
noise: {{variance: 0.5}}
experiment: {{samples: 200}}
accuracy: {accuracy}
spectrum: {{type: fir, order: 6}}
signal: {{seed: 1}}
"""


def run_block(file, names, old="", new=""):
    """Run the block of the page that belongs to this file of the package; `names` is what the file holds."""
    (block,) = re.findall(rf"<!-- {re.escape(file)} -->\n```python\n(.*?)```", PAGE, flags=re.DOTALL)
    exec(compile(block.replace(old, new) if old else block, file, "exec", dont_inherit=True), names)
    return names


@pytest.fixture
def total_variance(monkeypatch):
    """The package with the requirement of the page."""
    # On the page a line is added to `Accuracy`; from outside, a class that has the line takes its place.
    more = run_block(
        "specification/models/accuracy.py",
        dict(vars(words)),
        old="class Accuracy(Section)",
        new="class Accuracy(Accuracy)",
    )["Accuracy"]
    monkeypatch.setattr(
        loading, "Spec", pydantic.create_model("Spec", __base__=Spec, accuracy=(more, more()))
    )
    table = dict(builders.BUILDERS)
    names = {**vars(builders), "BUILDERS": table, "TotalVariance": TotalVariance}
    run_block("questions/building/requirements.py", names)
    monkeypatch.setattr(builders, "BUILDERS", table)


def spec_of(accuracy):
    return parse_spec(SPEC.format(accuracy=accuracy))


def autocovariances():
    """r_0 .. r_m of a FIR spectrum in cvxpy: traces along the diagonals of a positive Gram matrix."""
    gram = cp.Variable((ORDER + 1, ORDER + 1), PSD=True)
    return [cp.trace(np.eye(ORDER + 1, k=-lag) @ gram) for lag in range(ORDER + 1)]


def information_of(r):
    """Of the three parameters of B, per sample and variance: the Toeplitz matrix of the autocovariances."""
    return cp.bmat([[r[abs(i - j)] for j in range(3)] for i in range(3)])


def least_power(weights, most):
    """By a plain program, sum_i w_i e_i^T M^-1 e_i <= most."""
    r = autocovariances()
    spread = cp.matrix_frac(np.diag(np.sqrt(weights)), information_of(r))
    problem = cp.Problem(cp.Minimize(r[0]), [spread <= most * SAMPLES / VARIANCE])
    return problem.solve(solver="CLARABEL")


@pytest.mark.usefixtures("total_variance")
def test_equal_weights_are_best_served_by_white_input():
    """tr R^-1 >= k^2 / tr R with equality for R in proportion to I: the power is k sigma^2 / (N max)."""
    result = solve(spec_of("{total_variance: {weights: {b1: 1, b2: 1, b3: 1}, max: 0.01}}")).result
    assert result["cost"] == pytest.approx(3 * VARIANCE / (SAMPLES * 0.01), rel=1e-7)
    assert result["objective"]["relative_gap"] < 1e-6
    assert result["status"] == "optimal"


@pytest.mark.usefixtures("total_variance")
def test_the_optimum_is_that_of_a_plain_program():
    found = solve(spec_of("{total_variance: {weights: {b1: 1, b2: 9, b3: 2}, max: 0.02}}"))
    result = found.result
    assert result["cost"] == pytest.approx(least_power([1.0, 9.0, 2.0], 0.02), rel=1e-5)
    assert result["objective"]["relative_gap"] < 1e-6
    assert result["objective"]["lower_bound"] <= result["cost"] * (1 + 1e-12)
    (listed,) = result["requirements"]
    assert listed["name"] == "total_variance"
    assert listed["worst_ratio"] == pytest.approx(1.0, abs=1e-6)
    variances = np.array([result["information"]["standard_deviation"][f"b{i}"] for i in (1, 2, 3)]) ** 2
    assert variances @ [1.0, 9.0, 2.0] == pytest.approx(0.02, rel=1e-5)
    # The record is judged by it as well: chosen to meet it with its own samples.
    assert result["signal"]["worst_ratio"] <= 1.0 + 1e-9


@pytest.mark.usefixtures("total_variance")
def test_its_words_are_checked_like_all_others():
    with pytest.raises(SpecError, match="max"):
        spec_of("{total_variance: {weights: {b1: 1}, max: -1}}")
    with pytest.raises(SpecError, match='no parameter "b9"'):
        build_task(spec_of("{total_variance: {weights: {b9: 1}, max: 1}}"))


def test_a_new_family_of_spectra_is_designed_and_proved():
    """Powers in three bands: M is a sum of Toeplitz matrices of sin(k w) / k, and the rest plain cvxpy."""
    edges, target = np.array([0.0, 0.5, 1.4, np.pi]), [[60, 35, 5], [35, 60, 35], [5, 35, 60]]
    made = PiecesBasis(1, tuple(edges))
    task = build_task(spec_of(f"{{information: {target}}}"))
    asked = replace(task.asked, question=replace(task.asked.question, basis=made))
    found = replace(task, asked=asked).solve().result

    powers = cp.Variable(3, nonneg=True)
    lags = np.arange(3)[:, None]
    primitive = np.where(lags == 0, edges, np.sin(lags * edges) / np.maximum(lags, 1))
    shares = np.diff(primitive) / np.diff(edges)
    M = SAMPLES / VARIANCE * information_of([shares[lag] @ powers for lag in range(3)])
    plain = cp.Problem(cp.Minimize(cp.sum(powers)), [M >> np.array(target)])
    plain.solve(solver="CLARABEL")

    assert found["cost"] == pytest.approx(plain.value, rel=1e-6)
    assert found["objective"]["relative_gap"] < 1e-6
    assert found["spectrum"]["powers"] == pytest.approx(powers.value, abs=1e-5 * plain.value)


@pytest.fixture
def schroeder_chirp(tmp_path, monkeypatch):
    """A package is installed whose entry points name the kind of docs/extending, and one not there."""
    about = tmp_path / "chirps-1.0.dist-info"
    about.mkdir()
    (about / "METADATA").write_text("Metadata-Version: 2.1\nName: chirps\nVersion: 1.0\n")
    module = "extending.schroeder_chirp"
    named = f"schroeder_chirp = {module}:KIND\nlost_chirp = {module}:LOST\n"
    (about / "entry_points.txt").write_text(f"[idesign.signals]\n{named}")
    monkeypatch.syspath_prepend(tmp_path)
    plugins.points.cache_clear()
    yield
    monkeypatch.undo()
    plugins.points.cache_clear()


def chirp_spec():
    text = SPEC.format(accuracy="{model_error: {relative: 0.2, alpha: 2}}")
    return parse_spec(text.replace("{seed: 1}", "{type: schroeder_chirp, seed: 1}"))


@pytest.mark.usefixtures("schroeder_chirp")
def test_a_new_kind_of_signal_realises_a_design():
    found = solve(chirp_spec())
    signal, u = found.result["signal"], found.tables["signal"].columns["u1"]
    assert signal["type"] == "schroeder_chirp"
    assert signal["worst_ratio"] <= 1.0 + 1e-9
    # Its lines have the powers of the design, c_0 + 2 sum c_k cos(k w), and Schroeder's phases a low peak.
    c, w = found.result["spectrum"]["coefficients"], 2.0 * np.pi * np.arange(SAMPLES // 2 + 1) / SAMPLES
    density = c[0] + 2.0 * sum(c[k] * np.cos(k * w) for k in range(1, len(c)))
    lines = np.abs(np.fft.rfft(u))[1:-1] ** 2
    assert lines / lines.sum() == pytest.approx(density[1:-1] / density[1:-1].sum(), abs=1e-9)
    assert signal["crest_factor"][0] < 2.0


@pytest.mark.usefixtures("schroeder_chirp")
def test_a_new_kind_of_signal_is_made_without_a_spec():
    words = ["signal", "--kind", "schroeder_chirp", "--band", "0.1:1", "--samples", "400", "--json"]
    result = CliRunner().invoke(app, words)
    assert result.exit_code == 0, result.output
    signal = json.loads(result.stdout)["signal"]
    lines = [n for n in range(1, 200) if 0.1 <= 2 * np.pi * n / 400 <= 1]
    assert signal["channels"]["u1"]["order_of_excitation"] == 2 * len(lines)
    assert signal["channels"]["u1"]["crest_factor"] < 2.0


@pytest.mark.usefixtures("schroeder_chirp")
def test_a_kind_of_signal_that_its_package_does_not_hold_is_refused():
    result = CliRunner().invoke(app, ["signal", "--kind", "lost_chirp"])
    assert result.exit_code == 2
    assert "LOST" in result.output


def test_a_kind_of_signal_that_nobody_added_is_refused():
    with pytest.raises(SpecError, match="type"):
        chirp_spec()
    assert CliRunner().invoke(app, ["signal", "--kind", "schroeder_chirp"]).exit_code == 2
