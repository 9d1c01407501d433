"""A real scheduler and two worker processes on loopback: the same results, whatever happens to a worker."""

import json
import os
import shutil
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import IO

import pytest

from inputdesign_cli import load_spec, simulate
from inputdesign_cli.compute.cluster import Cluster
from inputdesign_cli.compute.processes import Processes
from inputdesign_cli.errors import DataError
from inputdesign_cli.outcome.codec import json_text
from tests.support import jobs
from tests.support.sweep_files import SPEC, run_sweep, timeless_files, timeless_rows

pytest.importorskip("distributed")
# Dask's own warnings are not ours to mend.
pytestmark = pytest.mark.filterwarnings("default")

SILENT = {"stdout": subprocess.DEVNULL, "stderr": subprocess.DEVNULL}
PATHS = str(Path(__file__).parents[2])


def wait_until(holds: Callable[[], bool]) -> None:
    deadline = time.monotonic() + 120
    while not holds():
        assert time.monotonic() < deadline
        time.sleep(0.05)


class Loopback:
    """A scheduler and its workers, each a process of its own (no nanny: a killed worker stays dead)."""

    def __init__(self, folder: Path, host: str = "127.0.0.1", certificates: tuple[str, ...] = ()) -> None:
        self.folder, self.file, self.certificates = folder, folder / "scheduler.json", certificates
        self.environment = {**os.environ, "PYTHONPATH": PATHS, "OPENBLAS_NUM_THREADS": "1"}
        options = ["--host", host, "--port", "0", "--no-dashboard", "--no-show", "--no-jupyter"]
        self.processes = []
        self.start("scheduler", *options, "--scheduler-file", str(self.file))
        wait_until(self.file.exists)

    def start(self, *arguments: str, **streams: IO) -> subprocess.Popen:
        command = [sys.executable, "-m", "dask", *arguments, *self.certificates]
        self.processes.append(subprocess.Popen(command, env=self.environment, **{**SILENT, **streams}))
        return self.processes[-1]

    def add_worker(self) -> subprocess.Popen:
        """Start a worker and wait for its registration, which may take half a minute on a busy machine."""
        options = ["--no-nanny", "--no-dashboard", "--nthreads", "1"]
        options += [] if self.certificates else ["--host", "127.0.0.1"]
        place = ["--local-directory", str(self.folder / "scratch")]
        log = self.folder / f"worker_{len(self.processes)}.log"
        with log.open("w") as stream:
            worker = self.start("worker", "--scheduler-file", str(self.file), *options, *place, stderr=stream)
        wait_until(lambda: "Registered to" in log.read_text())
        return worker

    @property
    def address(self) -> str:
        return json.loads(self.file.read_text())["address"]

    def end(self) -> None:
        for process in reversed(self.processes):
            process.kill()
            process.wait()


@pytest.fixture(scope="module")
def loopback(tmp_path_factory):
    cluster = Loopback(tmp_path_factory.mktemp("cluster"))
    cluster.add_worker()
    cluster.add_worker()
    yield cluster
    cluster.end()


def test_two_workers_share_the_work(loopback):
    done = list(Cluster(loopback.address).run(jobs.slow_identity, range(8)))
    assert sorted(f.answer[0] for f in done) == list(range(8))
    assert len({f.answer[1] for f in done}) == 2


def test_the_error_of_a_job_is_returned_with_that_job(loopback):
    done = {f.job: f for f in Cluster(loopback.address).run(jobs.fail_on_three, range(5))}
    assert str(done[3].error) == "three"
    assert done[4].answer == 4


@pytest.mark.slow
def test_a_sweep_that_loses_a_worker_has_the_same_results_to_the_last_digit(loopback, tmp_path):
    spec = tmp_path / "small.yaml"
    spec.write_text(SPEC)
    settings = ["experiment.samples=60:71:1", "spectrum.order=1,-1"]
    here = tmp_path / "here"
    run_sweep(spec, settings, directory=here)
    victim = loopback.add_worker()
    killed = []

    def kill_one(progress):
        if progress.passed == 5 and not killed:
            victim.send_signal(signal.SIGKILL)
            killed.append(victim)

    there = tmp_path / "there"
    done = run_sweep(spec, settings, directory=there, executor=Cluster(loopback.address), watch=kill_one)
    assert killed
    assert done.statuses == {"invalid": 12, "optimal": 12}
    assert timeless_rows(there) == timeless_rows(here)
    assert timeless_files(there) == timeless_files(here)


@pytest.mark.slow
def test_data_files_are_sent_to_the_workers_with_the_points(loopback, tmp_path):
    (tmp_path / "a").mkdir()
    (tmp_path / "r.csv").write_text("frequency,r_adm\n0,1\n3.2,1\n")
    (tmp_path / "a" / "more.yaml").write_text("title: included\n")
    spec = tmp_path / "a" / "t.yaml"
    spec.write_text(SPEC.replace("relative: 0.1", "table: ../r.csv").replace("title", "# title"))
    settings = ["experiment.samples=60,70", "include=more.yaml"]
    run_sweep(spec, settings, directory=tmp_path / "here")
    run_sweep(spec, settings, directory=tmp_path / "there", executor=Cluster(loopback.address))
    assert timeless_files(tmp_path / "there") == timeless_files(tmp_path / "here")
    assert {row["status"] for row in timeless_rows(tmp_path / "there")} == {"optimal"}


@pytest.mark.slow
def test_a_cluster_without_workers_is_reported_and_given_up(tmp_path):
    cluster = Loopback(tmp_path)
    worker = cluster.add_worker()
    told = []
    executor = Cluster(cluster.address, worker_timeout=1.0, say=told.append)
    answers = executor.run(jobs.slow_identity, range(100))
    try:
        next(answers)
        worker.kill()
        started = time.monotonic()
        with pytest.raises(DataError) as caught:
            list(answers)
    finally:
        cluster.end()
    assert caught.value.diagnostics[0].code == "cluster-no-workers"
    assert told == [f"no workers at {executor.address}; waiting"]
    assert time.monotonic() - started < 10


@pytest.mark.slow
def test_a_sweep_whose_scheduler_ends_is_finished_later(tmp_path):
    spec = tmp_path / "small.yaml"
    spec.write_text(SPEC)
    cluster = Loopback(tmp_path)
    cluster.add_worker()
    setting = ["experiment.samples=60:66:1"]

    def end(progress):
        if progress.passed == 2:
            cluster.end()

    try:
        executor = Cluster(cluster.address, patience=2.0)
        with pytest.raises(DataError) as caught:
            run_sweep(spec, setting, directory=tmp_path / "o", executor=executor, watch=end)
    finally:
        cluster.end()
    assert caught.value.diagnostics[0].code == "cluster-unreachable"
    assert run_sweep(spec, setting, directory=tmp_path / "o").computed <= 5


@pytest.mark.parametrize("address", ["tcp://127.0.0.1:9", "nonsense://x", "tls://127.0.0.1:9"])
def test_an_unreachable_cluster_is_refused(address):
    with pytest.raises(DataError, match="TLS asks for certificates" if "tls" in address else None) as caught:
        list(Cluster(address, patience=0.1).run(jobs.square, [1]))
    assert "tls" in address or caught.value.diagnostics[0].code == "cluster-unreachable"


SPECS = Path(__file__).parents[2] / "specs"


@pytest.mark.slow
@pytest.mark.parametrize(
    ("name", "overrides"),
    [
        ("regression", ["simulation.runs=500", "simulation.compare=[binary]"]),
        ("distillation_column", ["experiment.samples=1000", "simulation.runs=450", "signal.candidates=1"]),
    ],
)
def test_simulated_runs_are_the_same_wherever_they_are_computed(loopback, name, overrides):
    spec = load_spec(SPECS / f"{name}.yaml", overrides)
    here, there, beyond = (
        timeless(simulate(spec, executor=executor))
        for executor in (None, Processes(2), Cluster(loopback.address))
    )
    assert here == there
    assert here == beyond


NAMED = {
    "DASK_DISTRIBUTED__COMM__TLS__CA_FILE": "ca.pem",
    "DASK_DISTRIBUTED__COMM__TLS__CLIENT__CERT": "cert.pem",
    "DASK_DISTRIBUTED__COMM__TLS__CLIENT__KEY": "key.pem",
}


@pytest.mark.slow
@pytest.mark.skipif(shutil.which("openssl") is None, reason="openssl makes the certificates")
def test_a_sweep_goes_through_tls(tmp_path):
    """With the certificates of docs/security.md the sweep is computed; without them it is refused."""
    made = "openssl req -x509 -newkey rsa:2048 -nodes -days 2 -subj /CN=localhost -keyout key.pem -out ca.pem"
    subprocess.run(made.split(), cwd=tmp_path, check=True, **SILENT)
    shutil.copy(tmp_path / "ca.pem", tmp_path / "cert.pem")
    (tmp_path / "spec.yaml").write_text(SPEC)
    files = {"ca-file": "ca.pem", "cert": "cert.pem", "key": "key.pem"}
    stated = [part for name, file in files.items() for part in (f"--tls-{name}", str(tmp_path / file))]
    cluster = Loopback(tmp_path, "tls://127.0.0.1", tuple(stated))
    cluster.add_worker()

    def swept(out, *address, **more):
        command = [sys.executable, "-m", "inputdesign_cli", "sweep", "spec.yaml", "-o", out]
        command += ["--set", "spectrum.order=1,2", *address]
        environment = cluster.environment | more
        return subprocess.run(
            command, cwd=tmp_path, env=environment, capture_output=True, text=True, timeout=120
        )

    try:
        there = swept("there", "--cluster", cluster.address, **NAMED)
        assert there.returncode == 0, there.stderr
        assert swept("here").returncode == 0
        assert timeless_rows(tmp_path / "there") == timeless_rows(tmp_path / "here")
        without = swept("without", "--cluster", cluster.address)
        assert (without.returncode, "cluster-unreachable" in without.stderr) == (2, True)
        assert "docs/security.md" in without.stderr
        plain = swept("plain", "--cluster", cluster.address.replace("tls://", "tcp://"), **NAMED)
        assert (plain.returncode, "cluster-unreachable" in plain.stderr) == (2, True)
    finally:
        cluster.end()


def timeless(outcome):
    return json_text({key: value for key, value in outcome.result.items() if key != "timing_s"})
