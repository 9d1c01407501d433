"""Where a command computes: in its own process, in several, or on a cluster."""

from __future__ import annotations

import os
from typing import TYPE_CHECKING, Annotated

import typer

if TYPE_CHECKING:
    from inputdesign_cli.compute.executor import Executor

Jobs = Annotated[
    int, typer.Option("--jobs", "-j", metavar="N", min=0, help="Processes to compute with; 0: one per core.")
]
ClusterAddress = Annotated[
    str | None,
    typer.Option(
        "--cluster",
        metavar="ADDRESS",
        help="Compute on the Dask cluster at this address, tcp://HOST:PORT or tls://HOST:PORT. Without TLS "
        "anybody who reaches it can run programs there and here (docs/security.md).",
    ),
]
WorkerTimeout = Annotated[
    float | None,
    typer.Option(
        "--worker-timeout",
        metavar="SECONDS",
        min=0.0,
        help="Give up when the cluster has been without workers for so long; the default is to wait.",
    ),
]


def executor(jobs: int, cluster: str | None, worker_timeout: float | None, *, quiet: bool) -> Executor:
    """What the options ask for; an address comes first."""
    from inputdesign_cli.compute.cluster import Cluster
    from inputdesign_cli.compute.executor import InProcess
    from inputdesign_cli.compute.processes import Processes

    if cluster is not None:
        tell = (lambda text: None) if quiet else (lambda text: typer.echo(text, err=True))
        return Cluster(cluster, worker_timeout=worker_timeout, tell=tell)
    count = jobs or _cores()
    return Processes(count) if count > 1 else InProcess()


def _cores() -> int:
    """Return the number of cores that this process may use."""
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1
