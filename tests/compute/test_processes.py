"""Processes answer like the caller itself, survive each other's death, and never outlive the caller."""

import os
import signal
import subprocess
import sys
import time
from itertools import pairwise
from pathlib import Path

import pytest

from inputdesign_cli import parse_spec, simulate, solve
from inputdesign_cli.compute import interruptions
from inputdesign_cli.compute.executor import InProcess, WorkerLostError
from inputdesign_cli.compute.interruptions import bare_interruptions, interrupt
from inputdesign_cli.compute.processes import Processes
from inputdesign_cli.compute.time_limit import Counted, watching
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


SPEC = """
plant: {B: [0, 1], F: [1, -0.7]}
noise: {variance: 1}
experiment: {samples: 500}
cost: {input_power: 1}
accuracy: {model_error: {relative: 0.1}}
spectrum: {type: fir, order: 4}
"""


def test_a_design_reports_its_rounds():
    told = []
    with watching(told.append):
        result = solve(parse_spec(SPEC)).result
    design = told[: result["solver"]["rounds"]]
    assert [done.number for done in design] == list(range(1, len(design) + 1))
    assert all(earlier.bound <= later.bound for earlier, later in pairwise(design))
    assert design[-1].bound == result["objective"]["lower_bound"]
    assert len(told) > len(design), "the bound over every spectrum has rounds of its own"


def test_fresh_plants_and_simulated_runs_report_their_progress():
    """These parts follow the design and take longest."""
    told = []
    uncertain = "uncertainty: {covariance: [[0.001, 0], [0, 4.0e-4]], scenarios: 3, fresh: 70}\n"
    with watching(told.append):
        simulate(parse_spec(f"{SPEC}{uncertain}simulation: {{runs: 120}}\n"))
    assert Counted("fresh plants", 70, 70) in told
    assert [str(one) for one in told[-2:]] == ["simulated runs: 100 of 120", "simulated runs: 120 of 120"]


def ended(number):
    """An interruption that a compiled module replaces by an error of its own, without a cause."""
    with bare_interruptions():
        try:
            interrupt(number, None)
        except BaseException:
            raise ImportError("failed to import") from None


@pytest.mark.parametrize(
    ("number", "end", "code"), [(signal.SIGINT, KeyboardInterrupt, ()), (signal.SIGHUP, SystemExit, (129,))]
)
def test_an_interruption_that_another_error_replaced_is_raised_after_all(number, end, code):
    with pytest.raises(end) as raised:
        ended(number)
    assert raised.value.args == code


def test_errors_without_an_interruption_are_raised_unchanged():
    with pytest.raises(SystemExit):
        ended(signal.SIGTERM)
    with pytest.raises(ValueError, match="wrong"), bare_interruptions():
        raise ValueError("wrong")


def test_an_import_that_lasts_too_long_is_interrupted(tmp_path, monkeypatch):
    """The patience with imports, five seconds otherwise, is zero here."""
    name = "inputdesign_cli.compute.interruptions"
    (tmp_path / "lasting.py").write_text(
        f"import sys\nfrom {name} import interrupt\ninterrupt(1, sys._getframe())\n"
    )
    monkeypatch.syspath_prepend(tmp_path)
    monkeypatch.setattr(interruptions, "_PATIENCE", 0.0)
    with pytest.raises(SystemExit) as raised, bare_interruptions():
        __import__("lasting")
    assert raised.value.code == 129


class Dropping:
    """A key whose comparison is interrupted and drops the interruption."""

    def __hash__(self):
        return 1

    def __eq__(self, _):
        try:
            interrupt(signal.SIGTERM, None)
        except SystemExit:
            return True


def dropping(tidied):
    with bare_interruptions():
        try:
            assert {Dropping(): 1}[Dropping()] == 1
            time.sleep(20)
        finally:
            try:
                raise ValueError("while it tidies up")
            except ValueError:
                time.sleep(0.3)
            tidied.append(True)


def test_a_dropped_interruption_is_raised_again_but_not_during_clean_up():
    tidied = []
    with pytest.raises(SystemExit) as raised:
        dropping(tidied)
    assert (raised.value.code, tidied) == (143, [True])
    time.sleep(0.2)
    assert signal.getitimer(signal.ITIMER_REAL) == (0.0, 0.0)
