"""A writer that is killed at any call of the file system leaves the old run or the new one, whole."""

import json
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]


@pytest.mark.first(1)
@pytest.mark.parametrize("users", ["folder", "plain"])
def test_whenever_the_writer_is_killed_the_next_call_finds_a_whole_run(tmp_path, users):
    command = [sys.executable, "-m", "tests.support.killed_writer", str(tmp_path), users]
    ended = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, timeout=100)
    assert ended.returncode == 0, ended.stderr
    left = [json.loads(line) for line in ended.stdout.splitlines()]
    assert len(left) > 20
    for kill in left:
        assert kill["then"] in ("first", "second"), kill
        assert kill["at_once"] != "mixed", kill
        assert "error" not in kill
        assert (kill["strange"], kill["in_the_end"], kill["notes"]) == ([], "second", "mine"), kill
    assert {kill["then"] for kill in left} == {"first", "second"}
    # There are moments without a run that the next call ends, or this test would prove nothing.
    assert "none" in {kill["at_once"] for kill in left}
