"""The points of a sweep: each is computed once, and its files lie in the directory of the sweep.

    sweep.yaml           the spec with its `sweep` block: `idesign sweep` on it repeats the sweep
    sweep.json           the grid of the sweep, and the status of its points
    sweep.csv            one row a point
    points/<key>/        the run directory of a point that has a result
    failures/<key>.json  why a point has none
    .lock                a lock that holds as long as its process lives; .process names that process

A point is done when its directory or its failure exists: both appear in one step. `<key>` is a hash of
the resolved spec, of the files that it names, of the command and of the version of this package.
"""

from __future__ import annotations

import contextlib
import json
import os
import shutil
import tempfile
import threading
import time
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from inputdesign_cli.compute.interruptions import bare_interruptions
from inputdesign_cli.errors import (
    DataError,
    Diagnostic,
    IdesignError,
    InaccurateError,
    InfeasibleError,
    OutputError,
    SpecError,
)
from inputdesign_cli.outcome.codec import json_text
from inputdesign_cli.outcome.run_directory import digest, output_errors, read_run, replace_text, run_contents
from inputdesign_cli.outcome.run_files import (
    RESULT,
    SPEC as RUN_SPEC,
    environment,
    is_plain,
    locked,
    readable,
    sync,
    unreadable,
)
from inputdesign_cli.questions import Verb, run_verb
from inputdesign_cli.regular_file import read_regular
from inputdesign_cli.specification import SpecTemplate, renamed

SPEC, SUMMARY, TABLE = "sweep.yaml", "sweep.json", "sweep.csv"
LOCK, OWNER = ".lock", ".process"
_FAILURE = ("status", "code", "message", "hint", "key")


def checked_run(directory: Path, spec: str | None = None) -> dict[str, Any]:
    """Return the result of the run of a point, of this `spec` if it is known.

    Raises:
        DataError: the run is not whole, or belongs to another point.
    """
    result = read_run(directory)
    with readable(directory / RUN_SPEC):
        written = digest(read_regular(directory / RUN_SPEC).decode("utf-8"))
    if result.get("spec_sha256") != written or (spec is not None and written != digest(spec)):
        raise unreadable(directory / RUN_SPEC, "it was changed, or is of another point")
    return result


@dataclass(frozen=True)
class Layout:
    """Names the paths of the parts of a sweep in its directory."""

    root: Path

    def run(self, key: str) -> Path:
        """Return the run directory of a point."""
        return self.root / "points" / key

    def failure(self, key: str) -> Path:
        """Return the file with the reason why a point has no result."""
        return self.root / "failures" / f"{key}.json"

    def read(self, key: str, spec: str | None = None) -> dict[str, Any] | None:
        """Return the result of a point, or its failure (which has a `code`), or None.

        Args:
            spec: the resolved spec of the point, where it is known.

        Raises:
            DataError: the files of the point are damaged.
        """
        if (self.run(key) / RESULT).is_file():
            return checked_run(self.run(key), spec)
        path = self.failure(key)
        with readable(path):
            try:
                failure = json.loads(read_regular(path))
            except (FileNotFoundError, NotADirectoryError):
                return None
        if not (isinstance(failure, dict) and all(isinstance(failure.get(name), str) for name in _FAILURE)):
            raise unreadable(path, "it is not what idesign writes of a failure")
        return failure

    def discard(self, key: str) -> None:
        """Remove the files of a point, so that it is computed again."""
        run = self.run(key)
        with output_errors(run):
            (run / RESULT).unlink(missing_ok=True)
            shutil.rmtree(run, ignore_errors=True)
            self.failure(key).unlink(missing_ok=True)

    def write_failure(self, key: str, content: Mapping[str, object]) -> None:
        """Write why a point has no result, in one step."""
        path = self.failure(key)
        with output_errors(path):
            path.parent.mkdir(parents=True, exist_ok=True)
        replace_text(path, json_text(content))

    def adopt(self, key: str, files: Mapping[str, bytes]) -> None:
        """Put the run of a point, computed elsewhere, in its place in one step.

        Raises:
            DataError: `worker-answer`: these are not the files of a run, or have names with a folder in them.
        """
        strange = [name for name, content in files.items() if not (is_plain(name) and type(content) is bytes)]
        if strange or RESULT not in files:
            what = f"the file {strange[0]!r}" if strange else f"no {RESULT}"
            message = f"a worker answered with {what}: that is no run of a point"
            hint = "look at who may reach the cluster (docs/security.md)"
            raise DataError.because("worker-answer", message, hint)
        target = self.run(key)
        partial = target.parent / f".{key}.partial"
        with output_errors(target):
            partial.mkdir(parents=True)
            for name, content in files.items():
                (partial / name).write_bytes(content)
            for name in (*files, ""):
                sync(partial / name)
            partial.rename(target)


@contextlib.contextmanager
def opened(root: Path) -> Iterator[Layout]:
    """Open the directory of a sweep, made if it is missing and held for this process alone.

    Raises:
        OutputError: `sweep-locked` (another process sweeps into it), `output-not-a-sweep` (something else is
            in it), `output-not-a-directory`, `output-not-writable`, `output-full`.
    """
    with contextlib.ExitStack() as held:
        with output_errors(root):
            if root.exists() and not root.is_dir():
                message = f"{root} is a file, and a sweep is written into a directory"
                raise OutputError.because(
                    "output-not-a-directory", message, "choose another directory with -o"
                )
            root.mkdir(parents=True, exist_ok=True)
            foreign = sorted(p.name for p in root.iterdir() if not p.name.startswith("."))
            if foreign and not (root / SUMMARY).is_file():
                message = f"{root} already has {', '.join(foreign[:4])}, and no {SUMMARY} of an earlier sweep"
                hint = "choose another directory with -o"
                raise OutputError.because("output-not-a-sweep", message, hint)
            if not held.enter_context(locked(root / LOCK)):
                owner = ""
                with contextlib.suppress(OSError):
                    owner = read_regular(root / OWNER, 20).decode(errors="replace").strip()
                message = f"another sweep is writing into {root}{f' (process {owner})' if owner else ''}"
                hint = "wait for it, or choose another directory with -o"
                raise OutputError.because("sweep-locked", message, hint)
            replace_text(root / OWNER, str(os.getpid()))
            # Remove half-written files of killed processes; only the holder of the lock may do so.
            for path in (*root.glob(".*.partial*"), *root.glob("failures/.*.partial*")):
                path.unlink(missing_ok=True)
            for run in root.glob("points/*"):
                if run.name.startswith(".") or not (run / RESULT).is_file():
                    shutil.rmtree(run, ignore_errors=True)
        yield Layout(root)


KINDS: dict[str, type[IdesignError]] = {
    "invalid": SpecError,
    "infeasible": InfeasibleError,
    "inaccurate": InaccurateError,
}
LOST, BROKEN = "lost", "error"
FAILURES = frozenset({*KINDS, LOST, BROKEN})
"""The statuses of points that were tried and have no result."""

# Data files lie this deep in the temporary folder, so that a name such as ../tables/r.csv stays in it.
_DEPTH = ["data"] * 8

_alone = threading.Lock()


@dataclass(frozen=True)
class PointJob:
    """Holds the data that a worker needs for a point."""

    index: int
    key: str
    draft: SpecTemplate
    overrides: tuple[str, ...]
    verb: Verb
    figures: str
    names: Mapping[str, str]  # files that the spec names -> their names in the run
    files: dict[str, bytes] | None = None  # contents of these files, for a machine without them


PointEnd = tuple[Mapping[str, object] | None, Mapping[str, bytes] | None]
"""The failure of a point, or the files of its run."""


def run_point(job: PointJob) -> PointEnd:
    """Compute a point, and return the files of its run."""
    # A worker of a cluster may have several threads; plots and timing need a single one.
    with _alone, contextlib.ExitStack() as stack:
        if job.files is None:
            return _compute(job, job.draft)
        folder = stack.enter_context(tempfile.TemporaryDirectory(prefix="idesign-"))
        data = Path(folder).joinpath(*_DEPTH)
        data.mkdir(parents=True)
        for name, content in job.files.items():
            path = Path(os.path.normpath(data / name))
            if path.is_relative_to(folder):
                path.parent.mkdir(parents=True, exist_ok=True)
                path.write_bytes(content)
        return _compute(job, replace(job.draft, folder=data, confine=None))


def _compute(job: PointJob, draft: SpecTemplate) -> PointEnd:
    from inputdesign_cli.figures.plots import draw_all

    started = time.perf_counter()
    try:
        spec = draft.spec(job.overrides)
        with bare_interruptions():
            results = run_verb(job.verb, spec)
        timing = {**(results.outcome.timing_s or {}), "point": time.perf_counter() - started}
        written = renamed(results.resolved_spec, job.names)
        results = replace(results, outcome=replace(results.outcome, timing_s=timing), resolved_spec=written)
        return None, run_contents(results, draw_all(results, job.figures) if job.figures else {})
    except IdesignError as error:
        status = next((status for status, kind in KINDS.items() if kind.exit_code == error.exit_code), BROKEN)
        return failure_of(status, error.diagnostics[0], time.perf_counter() - started), None
    except Exception as error:
        diagnostic = Diagnostic("internal-error", f"{type(error).__name__}: {error}")
        return failure_of(BROKEN, diagnostic, time.perf_counter() - started), None


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
