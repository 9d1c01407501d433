"""Ctrl-C and SIGTERM with --keep-partial write the best design so far; without it, nothing."""

from __future__ import annotations

import json
import os
import signal

import clarabel
import pytest

SPEC = """
plant: {B: [0, 3.6], F: [1, -0.7]}
noise: {C: [1, -0.9], variance: 1.0}
experiment: {samples: 500}
accuracy: {model_error: {relative: 0.01, alpha: 2.45}}
spectrum: {type: fir, order: 20}
"""


@pytest.fixture
def interrupted(run, monkeypatch, tmp_path):
    """Solve with signals that come while the solver is called for the second time: exit code, stderr."""
    (tmp_path / "spec.yaml").write_text(SPEC)
    make = clarabel.DefaultSolver

    def call(*numbers, options=()):
        calls = []

        def solver(*arguments):
            calls.append(1)
            if len(calls) == 2:
                for number in numbers:
                    os.kill(os.getpid(), number)
            return make(*arguments)

        monkeypatch.setattr(clarabel, "DefaultSolver", solver)
        before = signal.getsignal(signal.SIGINT)
        signal.signal(signal.SIGINT, signal.default_int_handler)
        try:
            code, _, said = run("solve", "spec.yaml", "--no-figures", *options)
        finally:
            signal.signal(signal.SIGINT, before)
        return code, said

    return call


@pytest.mark.parametrize(("number", "code"), [(signal.SIGINT, 130), (signal.SIGTERM, 143)])
def test_the_best_so_far_is_written(interrupted, tmp_path, number, code):
    ended, said = interrupted(number, options=["--keep-partial"])
    assert (ended, "what is known so far" in said) == (code, True)
    result = json.loads((tmp_path / "runs" / "spec" / "result.json").read_text())
    assert (result["status"], result["solver"]["ended_by"]) == ("gap_open", "the interrupt")
    assert 0.0 < result["objective"]["lower_bound"] < result["objective"]["value"]
    assert (tmp_path / "runs" / "spec" / "spectrum.csv").exists()


def test_a_second_one_ends_at_once(interrupted, tmp_path):
    code, _ = interrupted(signal.SIGINT, signal.SIGINT, options=["--keep-partial"])
    assert code == 130
    assert not (tmp_path / "runs").exists()


def test_without_the_option_nothing_is_written(interrupted, tmp_path):
    code, said = interrupted(signal.SIGINT)
    assert (code, said) == (130, "interrupted\n")
    assert not (tmp_path / "runs").exists()
