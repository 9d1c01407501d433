"""Pictures of a page are the same wherever they are drawn, and soon once the processes are ready."""

import os
import time

import pytest

from inputdesign_cli import parse_spec, solve
from inputdesign_cli.compute.executor import InProcess
from inputdesign_cli.compute.processes import Processes
from inputdesign_cli.live.painters import Painters
from inputdesign_cli.outcome.run_directory import write_run
from inputdesign_cli.report.charts import run_charts
from tests.support.pages import SPEC


def test_pictures_of_other_processes_are_the_same(tmp_path):
    found = solve(parse_spec(SPEC % ""))
    write_run(found, tmp_path / "run", {})
    drawing = Painters(2)
    assert isinstance(drawing.executor, InProcess)
    drawing.get_ready()
    end = time.monotonic() + 60.0
    while isinstance(drawing.executor, InProcess):
        assert time.monotonic() < end
        time.sleep(0.1)
    here, there = (
        run_charts(tmp_path / "run", found.result, "s", by) for by in (InProcess(), drawing.executor)
    )
    drawing.end()
    assert list(there) == list(here)
    assert there == here


def test_one_processor_draws_by_itself():
    drawing = Painters(1)
    drawing.get_ready()
    assert isinstance(drawing.executor, InProcess)
    drawing.end()


def name_of_process(_):
    return os.getpid()


def test_processes_stay_from_run_to_run_until_they_are_ended():
    standing = Processes(2)
    standing.start()
    first, second = ({one.answer for one in standing.run(name_of_process, range(8))} for _ in range(2))
    assert len(first | second) <= 2
    run = standing.run(name_of_process, range(8))
    next(run)
    run.close()  # nobody takes the answers under way
    assert {one.answer for one in standing.run(time.sleep, [0.0, 0.0])} == {None}
    standing.end()
    for process in first | second:
        with pytest.raises(ProcessLookupError):
            os.kill(process, 0)
