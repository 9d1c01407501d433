"""Processes answer like the caller itself, survive each other's death, and never outlive the caller."""

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from inputdesign_cli.compute.executor import InProcess, WorkerLostError
from inputdesign_cli.compute.processes import Processes
from tests.support import jobs
from tests.support.processes import running


@pytest.mark.parametrize("executor", [InProcess(), Processes(1), Processes(2)])
def test_answers_and_errors_belong_to_their_tasks(executor):
    done = {f.job: f for f in executor.run(jobs.fail_on_three, range(6))}
    assert {job: f.answer for job, f in done.items()} == {0: 0, 1: 1, 2: 2, 3: None, 4: 4, 5: 5}
    assert isinstance(done[3].error, ValueError)
    assert str(done[3].error) == "three"


def test_tasks_are_drawn_as_workers_become_free():
    drawn = []

    def tasks():
        for i in range(50):
            drawn.append(i)
            yield i

    answers = Processes(2).run(jobs.square, tasks())
    for _ in range(5):
        next(answers)
    assert len(drawn) <= 8
    answers.close()


def test_the_task_of_a_killed_process_is_tried_again(tmp_path):
    done = list(Processes(2).run(jobs.die_once, [str(tmp_path / "a"), str(tmp_path / "b")]))
    assert [f.answer for f in done] == ["survived", "survived"]


def test_a_task_that_kills_every_process_is_given_up():
    (done,) = Processes(1).run(jobs.die, [0])
    assert isinstance(done.error, WorkerLostError)


def test_a_process_computes_on_one_thread_and_the_caller_keeps_its_settings(monkeypatch):
    monkeypatch.setenv("OPENBLAS_NUM_THREADS", "7")
    ((count, pid),) = [f.answer for f in Processes(1).run(jobs.threads, [0])]
    assert count == "1"
    assert pid != os.getpid()
    assert os.environ["OPENBLAS_NUM_THREADS"] == "7"


ROOT = Path(__file__).parents[2]
CALLER = """
import sys
sys.path.insert(0, sys.argv[1])
from tests.support import jobs
from inputdesign_cli.compute.processes import Processes
if __name__ == "__main__":
    for f in Processes(2).run(jobs.slow_identity, range(100)):
        print(f.answer[1], flush=True)
"""


def test_processes_end_with_a_killed_caller(tmp_path):
    script = tmp_path / "caller.py"
    script.write_text(CALLER)
    command = [sys.executable, str(script), str(ROOT)]
    with running(command, stdout=subprocess.PIPE, text=True) as caller:
        pids = {int(caller.stdout.readline()) for _ in range(4)}
        caller.send_signal(signal.SIGKILL)
        caller.communicate()
    deadline = time.monotonic() + 5
    while any(alive(pid) for pid in pids) and time.monotonic() < deadline:
        time.sleep(0.02)
    assert not any(alive(pid) for pid in pids)


def alive(pid):
    try:
        with open(f"/proc/{pid}/stat") as file:
            return file.read().rpartition(")")[2].split()[0] != "Z"
    except FileNotFoundError:
        return False
