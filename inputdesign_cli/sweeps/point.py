"""One point of a sweep: run the verb, and leave a run directory or the reason why there is none."""

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
from inputdesign_cli.questions.verbs import Verb, run_verb
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
    """What a worker needs to know of a point."""

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
    """How a point ended: its status, its failure, and its `files` where ours are out of reach."""

    status: str
    failure: Mapping[str, object] | None = None
    files: Mapping[str, bytes] | None = None


def run_point(job: PointJob) -> PointEnd:
    """Compute a point and write its run into the directory of the sweep, or return the files of its run.

    Raises:
        OutputError: the files cannot be written, which is not the fault of the point.
    """
    if job.root is not None:
        with at_work(job.root):
            return _compute(job, Layout(job.root).run(job.key))
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
        end = _compute(replace(job, draft=replace(job.draft, folder=data, confine=None)), run)
        files = None if end.failure else {path.name: path.read_bytes() for path in sorted(run.iterdir())}
        return replace(end, files=files)


def _compute(job: PointJob, directory: Path) -> PointEnd:
    started = time.perf_counter()
    try:
        spec = job.draft.spec(job.overrides)
        with bare_interruptions():
            results = run_verb(job.verb, spec)
        seconds = time.perf_counter() - started
        timing = {**(results.outcome.timing_s or {}), "point": seconds}
        results = replace(results, outcome=replace(results.outcome, timing_s=timing))
        from inputdesign_cli.figures.plots import draw_all
        from inputdesign_cli.outcome.run_directory import write_run

        write_run(results, directory, draw_all(results, job.figures) if job.figures else {})
    except OutputError:
        raise
    except IdesignError as error:
        codes = {kind.exit_code: status for status, kind in KINDS.items()}
        status = codes.get(error.exit_code, BROKEN)
        return failed(status, error.diagnostics[0], time.perf_counter() - started)
    except Exception as error:
        diagnostic = Diagnostic("internal-error", f"{type(error).__name__}: {error}")
        return failed(BROKEN, diagnostic, time.perf_counter() - started)
    return PointEnd(str(results.result.get("status", "done")))


def failed(status: str, diagnostic: Diagnostic, seconds: float) -> PointEnd:
    """The end of a point without a result, with the content of its failure file."""
    content = {
        "format": 1,
        "status": status,
        "code": diagnostic.code,
        "message": diagnostic.message,
        "hint": diagnostic.hint,
        "key": diagnostic.key,
        "timing_s": {"point": seconds},
        "environment": environment(),
    }
    return PointEnd(status, content)
