"""Compute one point of a sweep: run the verb, and write a run directory or the reason why there is none."""

from __future__ import annotations

import os
import tempfile
import threading
import time
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path

from inputdesign_cli.compute.interruptions import bare_interruptions
from inputdesign_cli.errors import (
    Diagnostic,
    IdesignError,
    InaccurateError,
    InfeasibleError,
    OutputError,
    SpecError,
)
from inputdesign_cli.outcome.record import environment
from inputdesign_cli.questions import Verb, run_verb
from inputdesign_cli.specification import SpecTemplate
from inputdesign_cli.sweeps.layout import Layout, at_work

KINDS: dict[str, type[IdesignError]] = {
    "invalid": SpecError,
    "infeasible": InfeasibleError,
    "inaccurate": InaccurateError,
}
LOST, BROKEN = "lost", "error"
FAILURES = frozenset({*KINDS, LOST, BROKEN})
"""The statuses of points that were tried and have no result."""

# So far below the temporary folder stand the data files, so that a name such as ../tables/r.csv stays in it.
_DEPTH = ["data"] * 8

_alone = threading.Lock()


@dataclass(frozen=True)
class PointJob:
    """Holds all that a worker needs for a point."""

    index: int
    key: str
    draft: SpecTemplate
    overrides: tuple[str, ...]
    verb: Verb
    figures: str
    root: Path | None  # the directory of the sweep; None on a machine that may not see it
    files: dict[str, bytes] | None = None  # what the spec names, for such a machine


@dataclass(frozen=True)
class PointEnd:
    """Holds the end of a point: its failure, if it failed, and its `files` where ours are out of reach."""

    failure: Mapping[str, object] | None = None
    files: Mapping[str, bytes] | None = None


def run_point(job: PointJob) -> PointEnd:
    """Compute a point and write its run into the directory of the sweep, or return the files of its run.

    Raises:
        OutputError: the files cannot be written, which is not the fault of the point.
    """
    if job.root is not None:
        with at_work(job.root):
            return PointEnd(_compute(job, Layout(job.root).run(job.key)))
    # A worker of a cluster may have several threads; the plots and the clocks of the points want one.
    with _alone, tempfile.TemporaryDirectory(prefix="idesign-") as folder:
        run = Path(folder) / "run"
        data = Path(folder).joinpath(*_DEPTH)
        data.mkdir(parents=True)
        for name, content in (job.files or {}).items():
            path = Path(os.path.normpath(data / name))
            if path.is_relative_to(folder):
                path.parent.mkdir(parents=True, exist_ok=True)
                path.write_bytes(content)
        failure = _compute(replace(job, draft=replace(job.draft, folder=data, confine=None)), run)
        written = {} if failure else {path.name: path.read_bytes() for path in sorted(run.iterdir())}
        return PointEnd(failure, written or None)


def _compute(job: PointJob, directory: Path) -> dict[str, object] | None:
    """Compute a point and write its run; return its failure, if it fails."""
    from inputdesign_cli.figures.plots import draw_all
    from inputdesign_cli.outcome.run_directory import write_run

    started = time.perf_counter()
    try:
        spec = job.draft.spec(job.overrides)
        with bare_interruptions():
            results = run_verb(job.verb, spec)
        timing = {**(results.outcome.timing_s or {}), "point": time.perf_counter() - started}
        results = replace(results, outcome=replace(results.outcome, timing_s=timing))
        write_run(results, directory, draw_all(results, job.figures) if job.figures else {})
    except OutputError:
        raise
    except IdesignError as error:
        status = next((status for status, kind in KINDS.items() if kind.exit_code == error.exit_code), BROKEN)
        return failure_of(status, error.diagnostics[0], time.perf_counter() - started)
    except Exception as error:
        diagnostic = Diagnostic("internal-error", f"{type(error).__name__}: {error}")
        return failure_of(BROKEN, diagnostic, time.perf_counter() - started)
    return None


def failure_of(status: str, diagnostic: Diagnostic, seconds: float = 0.0) -> dict[str, object]:
    """Return the content of the file about a point without a result."""
    return {
        "format": 1,
        "status": status,
        "code": diagnostic.code,
        "message": diagnostic.message,
        "hint": diagnostic.hint,
        "key": diagnostic.key,
        "timing_s": {"point": seconds},
        "environment": environment(),
    }
