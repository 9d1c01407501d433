"""A writer that is killed at any call of the file system leaves the old run or the new one, whole."""

import ctypes
import json
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
EXCHANGES = hasattr(ctypes.CDLL(None), "renameat2")


def kills(folder, how, users):
    command = [sys.executable, "-m", "tests.support.killed_writer", str(folder), how, users]
    ended = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, timeout=100)
    assert ended.returncode == 0, ended.stderr
    return [json.loads(line) for line in ended.stdout.splitlines()]


@pytest.mark.first(1)
@pytest.mark.parametrize(
    ("how", "users"), [("exchange", "plain"), ("exchange", "folder"), ("moves", "plain")]
)
def test_whenever_the_writer_is_killed_the_next_call_finds_a_whole_run(tmp_path, how, users):
    left = kills(tmp_path, how, users)
    assert len(left) > 20
    for kill in left:
        assert kill["then"] in ("first", "second"), kill
        assert kill["at_once"] != "mixed", kill
        assert "error" not in kill
        assert (kill["strange"], kill["in_the_end"], kill["notes"]) == ([], "second", "mine"), kill
    assert {kill["then"] for kill in left} == {"first", "second"}
    # In one step there is no moment without a run; moves have such moments, or this test would prove nothing.
    in_one_step = EXCHANGES and (how, users) == ("exchange", "plain")
    assert ("none" in {kill["at_once"] for kill in left}) != in_one_step
