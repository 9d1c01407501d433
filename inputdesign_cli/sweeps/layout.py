"""The directory of a sweep, and what may be relied on in it.

    sweep.yaml           the spec with its `sweep` block: `idesign sweep` on it repeats the sweep
    sweep.json           what was swept, and how the points ended
    sweep.csv            one row a point
    points/<key>/        the run directory of a point that has a result
    failures/<key>.json  why a point has none
    .lock, .worker-<id>  locks; they hold as long as their processes live. .process names who holds .lock

A point is done when its directory or its failure stands: both appear in one step. `<key>` is a hash of
the resolved spec, of the files that it names, of the command and of the version of this package.
"""

from __future__ import annotations

import contextlib
import json
import os
import shutil
import uuid
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from inputdesign_cli.errors import DataError, OutputError
from inputdesign_cli.outcome.codec import json_text
from inputdesign_cli.outcome.origin import digest
from inputdesign_cli.outcome.record import PAGE, RESULT, SPEC as RUN_SPEC, is_page, is_plain, unreadable
from inputdesign_cli.outcome.replacing import locked
from inputdesign_cli.outcome.run_directory import output_errors, read_run, replace_text
from inputdesign_cli.regular_file import read_regular

SPEC, SUMMARY, TABLE = "sweep.yaml", "sweep.json", "sweep.csv"
LOCK, OWNER, WORKER = ".lock", ".process", ".worker-"
_ENDLESS = -1.0  # seconds, in the words of `locked`
_FAILURE = ("status", "code", "message", "hint", "key")


def run_flaw(directory: Path, spec: str | None = None) -> str:
    """Return what is wrong with the run of a point, of this `spec` if it is known; nothing where it holds."""
    try:
        result = read_run(directory)
        written = digest(read_regular(directory / RUN_SPEC).decode("utf-8"))
    except DataError as error:
        return error.diagnostics[0].message
    except (OSError, ValueError) as error:
        return f"{directory / RUN_SPEC} cannot be read: {error}"
    if result.get("spec_sha256") != written or (spec is not None and written != digest(spec)):
        return f"{directory} is not the run of this point: it has another spec"
    return ""


@dataclass(frozen=True)
class Layout:
    """Where the parts of a sweep stand in its directory."""

    root: Path

    def run(self, key: str) -> Path:
        """The run directory of a point."""
        return self.root / "points" / key

    def failure(self, key: str) -> Path:
        """The file that says why a point has no result."""
        return self.root / "failures" / f"{key}.json"

    def has_result(self, key: str) -> bool:
        """Whether the run of a point is whole."""
        return (self.run(key) / RESULT).is_file()

    def has_failure(self, key: str) -> bool:
        """Whether a point has been tried in vain."""
        return self.failure(key).is_file()

    def read(self, key: str) -> dict[str, Any] | None:
        """The result of a point, or its failure (which has a `code`), or None.

        Raises:
            DataError: `run-unreadable`.
        """
        for path in (self.run(key) / RESULT, self.failure(key)):
            try:
                content = json.loads(read_regular(path))
            except (FileNotFoundError, NotADirectoryError):
                continue
            except (OSError, ValueError, RecursionError) as error:
                raise unreadable(path, str(error)) from error
            if not isinstance(content, dict):
                raise unreadable(path, "it is no mapping")
            return content
        return None

    def discard(self, key: str) -> None:
        """Remove what is there of a point, its run in one step, so that it is computed again."""
        run = self.run(key)
        with output_errors(run):
            if run.exists():
                partial = run.parent / f".{key}.partial-{os.getpid()}"
                shutil.rmtree(partial, ignore_errors=True)
                run.rename(partial)
                shutil.rmtree(partial, ignore_errors=True)
            self.failure(key).unlink(missing_ok=True)

    def flaw(self, key: str, spec: str | None = None) -> str:
        """Return what is wrong with what is there of a point; nothing where it holds, or nothing is there.

        Args:
            spec: the resolved spec of the point, where it is known.
        """
        if self.has_result(key):
            return run_flaw(self.run(key), spec)
        try:
            failure = self.read(key)
        except DataError as error:
            return error.diagnostics[0].message
        whole = failure is None or all(isinstance(failure.get(name), str) for name in _FAILURE)
        return "" if whole else f"{self.failure(key)} is not what idesign writes of a failure"

    def write_failure(self, key: str, content: Mapping[str, object]) -> None:
        """Note why a point has no result, in one step."""
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
        partial = target.parent / f".{key}.partial-{os.getpid()}"
        with output_errors(target):
            shutil.rmtree(partial, ignore_errors=True)
            partial.mkdir(parents=True)
            for name, content in files.items():
                (partial / name).write_bytes(content)
            partial.rename(target)

    def remove_page(self) -> None:
        """Remove the page about what the sweep was before."""
        if is_page(self.root / PAGE):
            (self.root / PAGE).unlink()

    def clear(self) -> None:
        """Remove what killed processes left half written. Only the holder of the lock may."""
        for folder in (self.root, self.root / "points", self.root / "failures"):
            for path in folder.glob(".*.partial*"):
                if path.is_dir():
                    shutil.rmtree(path, ignore_errors=True)
                else:
                    path.unlink(missing_ok=True)


@contextlib.contextmanager
def opened(root: Path) -> Iterator[Layout]:
    """The directory of a sweep, made if it is missing and held for this process alone.

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
                raise _taken(root)
            replace_text(root / OWNER, str(os.getpid()))
            for worker in root.glob(f"{WORKER}*"):
                # Processes of a killed sweep hold it until they have noticed, which takes no time.
                with locked(worker, _ENDLESS):
                    worker.unlink(missing_ok=True)
            layout = Layout(root)
            layout.clear()
        yield layout


def _taken(root: Path) -> OutputError:
    owner = ""
    with contextlib.suppress(OSError):
        owner = read_regular(root / OWNER, 20).decode(errors="replace").strip()
    message = f"another sweep is writing into {root}{f' (process {owner})' if owner else ''}"
    return OutputError.because("sweep-locked", message, "wait for it, or choose another directory with -o")


@contextlib.contextmanager
def at_work(root: Path) -> Iterator[None]:
    """Held by a process that writes a point, so that no other sweep begins before it has ended."""
    lock = root / f"{WORKER}{uuid.uuid4().hex}"
    with locked(lock):
        try:
            yield
        finally:
            with contextlib.suppress(OSError):
                lock.unlink()
