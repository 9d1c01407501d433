"""A cluster behind TLS as docs/security.md sets one up: with certificates it computes, without it says so."""

import os
import shutil
import subprocess
import sys
import time
from pathlib import Path

import pytest

from tests.support.processes import running
from tests.support.sweep_files import SPEC, timeless_rows

pytest.importorskip("distributed")
pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(shutil.which("openssl") is None, reason="openssl makes the certificates"),
]

SILENT = {"stdout": subprocess.DEVNULL, "stderr": subprocess.DEVNULL}
SETTINGS = ("--set", "spectrum.order=1,2")
NAMED = {
    "DASK_DISTRIBUTED__COMM__TLS__CA_FILE": "ca.pem",
    "DASK_DISTRIBUTED__COMM__TLS__CLIENT__CERT": "cert.pem",
    "DASK_DISTRIBUTED__COMM__TLS__CLIENT__KEY": "key.pem",
}


@pytest.fixture
def folder(tmp_path):
    """A spec, and a certificate that signs itself."""
    command = (
        "openssl req -x509 -newkey rsa:2048 -nodes -days 2 -subj /CN=localhost -keyout key.pem -out ca.pem"
    )
    subprocess.run(command.split(), cwd=tmp_path, check=True, **SILENT)
    shutil.copy(tmp_path / "ca.pem", tmp_path / "cert.pem")
    (tmp_path / "spec.yaml").write_text(SPEC)
    return tmp_path


@pytest.fixture
def address(folder):
    """Of a scheduler with one worker."""
    paths = {"PYTHONPATH": str(Path(__file__).parents[2]), "OPENBLAS_NUM_THREADS": "1"}
    own = {"cwd": folder, "env": os.environ | paths, **SILENT}
    certificates = ["--tls-ca-file", "ca.pem", "--tls-cert", "cert.pem", "--tls-key", "key.pem"]
    dask, told = [sys.executable, "-m", "dask"], folder / "scheduler.json"
    place = ["--host", "tls://127.0.0.1", "--no-dashboard"]
    scheduler = [*dask, "scheduler", *place, "--port", "0", "--scheduler-file", told.name, *certificates]
    with running(scheduler, **own):
        end = time.monotonic() + 30
        while not told.exists():
            assert time.monotonic() < end
            time.sleep(0.05)
        found = next(part for part in told.read_text().split('"') if part.startswith("tls://"))
        with running(
            [*dask, "worker", found, "--no-nanny", "--nthreads", "1", "--no-dashboard", *certificates], **own
        ):
            yield found


def swept(folder, address, out, **more):
    command = [sys.executable, "-m", "inputdesign_cli", "sweep", "spec.yaml", *SETTINGS, "-o", out]
    command += ["--cluster", address] if address else []
    return subprocess.run(
        command, cwd=folder, env=os.environ | more, capture_output=True, text=True, timeout=120
    )


def test_a_sweep_goes_through_tls(folder, address):
    there = swept(folder, address, "there", **NAMED)
    assert there.returncode == 0, there.stderr
    assert swept(folder, "", "here").returncode == 0
    assert timeless_rows(folder / "there") == timeless_rows(folder / "here")
    without = swept(folder, address, "without")
    assert without.returncode == 2
    assert "cluster-unreachable" in without.stderr
    assert "docs/security.md" in without.stderr
    plain = swept(folder, address.replace("tls://", "tcp://"), "plain", **NAMED)
    assert plain.returncode == 2
    assert "cluster-unreachable" in plain.stderr
