"""A run directory is whole or absent, and never a mixture of two runs."""

import errno
import hashlib
import json
import os
import pathlib
import platform
from contextlib import suppress
from importlib import metadata

import numpy as np
import pytest

from inputdesign_cli.errors import DataError, OutputError
from inputdesign_cli.outcome.results import Results
from inputdesign_cli.outcome.run_directory import read_run, write_run
from tests.support.outcomes import typed
from tests.support.run_directories import a_run, marks, names, write_with_figures


def test_the_files_of_a_run(tmp_path):
    paths = write_with_figures(a_run("first", optimality=True), tmp_path / "runs" / "a")
    assert [path.name for path in paths] == [
        "spec.yaml",
        "signal.csv",
        "optimality.csv",
        "signal.png",
        "optimality.png",
        "figures.json",
        "result.json",
    ]
    assert names(tmp_path / "runs" / "a") == {path.name for path in paths}
    assert names(tmp_path / "runs") == {"a"}
    assert (tmp_path / "runs" / "a" / "signal.png").read_bytes() == b"drawn"


def test_the_result_names_its_software_and_its_spec(tmp_path):
    write_run(a_run("first"), tmp_path / "a")
    result = json.loads((tmp_path / "a" / "result.json").read_text())
    assert result["spec_sha256"] == hashlib.sha256((tmp_path / "a" / "spec.yaml").read_bytes()).hexdigest()
    assert result["environment"]["python"] == platform.python_version()
    assert result["environment"]["numpy"] == metadata.version("numpy")
    assert set(result["environment"]) >= {"platform", "idesign", "scipy", "cvxpy", "clarabel"}


def test_read_run_returns_what_was_written(tmp_path):
    write_with_figures(a_run("first"), tmp_path / "a")
    result = read_run(tmp_path / "a")
    assert result["title"] == "first"
    assert result["objective"] == {"kind": "least_cost", "value": 5.0}
    assert set(result["files"]) == {"spec.yaml", "signal.csv", "signal.png", "figures.json"}


def test_a_later_run_replaces_an_earlier_one_and_its_stale_figure(tmp_path):
    write_with_figures(a_run("first", optimality=True), tmp_path / "a")
    write_with_figures(a_run("second"), tmp_path / "a")
    assert names(tmp_path / "a") == {"spec.yaml", "signal.csv", "signal.png", "figures.json", "result.json"}
    assert marks(tmp_path / "a") == {"second"}


def test_files_of_the_user_survive(tmp_path):
    write_with_figures(a_run("first", optimality=True), tmp_path / "a")
    (tmp_path / "a" / "notes.txt").write_text("mine")
    (tmp_path / "a" / "photo.png").write_text("mine")
    (tmp_path / "a" / "data").mkdir()
    write_with_figures(a_run("second"), tmp_path / "a")
    assert (tmp_path / "a" / "notes.txt").read_text() == "mine"
    assert (tmp_path / "a" / "photo.png").read_text() == "mine"
    assert (tmp_path / "a" / "data").is_dir()


@pytest.mark.parametrize(
    ("there", "target", "code"),
    [
        ("spec.yaml", ".", "output-not-a-run"),
        ("a", "a", "output-not-a-directory"),
        ("a", "a/b", "output-not-writable"),
    ],
)
def test_a_file_of_the_user_is_never_overwritten(tmp_path, there, target, code):
    (tmp_path / there).write_text("mine")
    with pytest.raises(OutputError) as caught:
        write_with_figures(a_run("first"), tmp_path / target)
    assert caught.value.diagnostics[0].code == code
    assert code != "output-not-a-run" or there in caught.value.diagnostics[0].message
    assert names(tmp_path) == {there}
    assert (tmp_path / there).read_text() == "mine"


def test_a_run_into_an_empty_directory(tmp_path):
    (tmp_path / "a").mkdir()
    write_run(a_run("first"), tmp_path / "a")
    assert names(tmp_path / "a") == {"spec.yaml", "signal.csv", "figures.json", "result.json"}


def test_a_link_to_a_directory_stays_a_link(tmp_path):
    (tmp_path / "disc").mkdir()
    (tmp_path / "a").symlink_to(tmp_path / "disc")
    write_run(a_run("first"), tmp_path / "a")
    assert (tmp_path / "a").is_symlink()
    assert (tmp_path / "disc" / "result.json").is_file()


def contents(directory) -> dict[str, bytes]:
    return {path.name: path.read_bytes() for path in directory.iterdir()}


class Saboteur:
    """Makes the n-th of the file operations of the run fail, and every operation before it work."""

    def __init__(self, monkeypatch, failing: int, error: BaseException):
        self.count, self.failing, self.error = 0, failing, error
        for owner, name in (
            (pathlib.Path, "write_bytes"),
            (pathlib.Path, "rename"),
            (pathlib.Path, "replace"),
            (pathlib.Path, "mkdir"),
            (os, "fsync"),
        ):
            monkeypatch.setattr(owner, name, self.wrap(getattr(owner, name)))

    def wrap(self, original):
        def operation(*args, **kwargs):
            self.count += 1
            if self.count == self.failing:
                raise self.error
            return original(*args, **kwargs)

        return operation


def count_operations(monkeypatch, write) -> int:
    with monkeypatch.context() as patch:
        saboteur = Saboteur(patch, -1, OSError())
        write()
    return saboteur.count


ERRORS = [
    (OSError(errno.ENOSPC, "No space left on device"), OutputError),
    (PermissionError(errno.EACCES, "Permission denied"), OutputError),
    (KeyboardInterrupt(), KeyboardInterrupt),
]
CODES = {errno.ENOSPC: "output-full", errno.EACCES: "output-not-writable"}


@pytest.mark.parametrize(("error", "raised"), ERRORS, ids=["full", "denied", "interrupted"])
def test_a_failure_at_any_step_of_a_new_run_leaves_nothing(tmp_path, monkeypatch, error, raised):
    steps = count_operations(monkeypatch, lambda: write_run(a_run("first"), tmp_path / "probe"))
    assert steps > 6
    for step in range(1, steps):
        place = tmp_path / f"step{step}"
        place.mkdir()
        with monkeypatch.context() as patch:
            Saboteur(patch, step, error)
            with pytest.raises(raised) as caught:
                write_run(a_run("first"), place / "a")
        if raised is OutputError:
            assert caught.value.diagnostics[0].code == CODES[error.errno]
        assert names(place) == set(), step


@pytest.mark.first(2)
@pytest.mark.parametrize(("error", "raised"), ERRORS, ids=["full", "denied", "interrupted"])
def test_a_failure_at_any_step_of_a_replacement_keeps_a_whole_run(tmp_path, monkeypatch, error, raised):
    write_with_figures(a_run("first", optimality=True), tmp_path / "probe")
    steps = count_operations(monkeypatch, lambda: write_run(a_run("second"), tmp_path / "probe"))
    assert steps > 12
    old = tmp_path / "a"
    write_with_figures(a_run("first", optimality=True), old)
    (old / "notes.txt").write_text("mine")
    before = contents(old)
    outcomes = []
    for step in range(1, steps + 1):
        with monkeypatch.context() as patch:
            Saboteur(patch, step, error)
            with suppress(raised):
                write_run(a_run("second"), old)
        assert names(tmp_path) == {"a", "probe"}, step
        outcomes.append(contents(old) == before)
        if not outcomes[-1]:
            assert step == steps  # what fails after the last move
            assert marks(old) == {"second"}
            assert (old / "notes.txt").read_text() == "mine"
    assert outcomes.count(True) > 8


def test_a_nan_in_the_result_is_a_mistake_of_ours_and_writes_nothing(tmp_path):
    bad = Results(typed({"format": 1, "value": np.nan}), resolved_spec="")
    with pytest.raises(ValueError, match=r"result\.value"):
        write_with_figures(bad, tmp_path / "a")
    assert names(tmp_path) == set()


@pytest.mark.parametrize(
    ("files", "code"),
    [
        ({}, "run-missing"),
        ({"result.json": "{"}, "run-unreadable"),
        ({"result.json": "[]"}, "run-unreadable"),
        ({"result.json": "[" * 100_000}, "run-unreadable"),
        ({"result.json": '{"format": 1, "files": [1, null]}'}, "run-unreadable"),
        ({"result.json": '{"format": 1, "files": 7}'}, "run-unreadable"),
        ({"result.json": json.dumps({"format": 1, "files": ["x" * 300]})}, "run-unreadable"),
        ({"result.json": json.dumps({"format": 1, "files": ["\ud800"]})}, "run-unreadable"),
        ({"result.json": '{"format": %s}' % ("1" * 10_000)}, "run-unreadable"),
        ({"result.json": '{"format": 1, "files": ["spec.yaml"]}'}, "run-incomplete"),
    ],
)
def test_read_run_explains_what_is_wrong(tmp_path, files, code):
    for name, text in files.items():
        (tmp_path / name).write_text(text)
    with pytest.raises(DataError) as caught:
        read_run(tmp_path)
    assert caught.value.diagnostics[0].code == code


def test_read_run_of_no_directory(tmp_path):
    with pytest.raises(DataError) as caught:
        read_run(tmp_path / "nowhere")
    assert caught.value.diagnostics[0].code == "run-missing"
