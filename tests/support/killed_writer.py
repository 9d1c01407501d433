"""Replace a run by another, killed before each of its file operations, and print the state after each.

    python -m tests.support.killed_writer FOLDER plain|folder

Each line is a JSON object: the state right after the kill, and after the next `read_run`.
"""

import json
import os
import signal
import sys
from pathlib import Path

import numpy as np

from inputdesign_cli.errors import DataError
from inputdesign_cli.outcome.results import Results, Table
from inputdesign_cli.outcome.run_directory import read_run, write_run
from tests.support.outcomes import typed

STEPS = ("open", "os.", "shutil.")


def a_run(mark: str) -> Results:
    tables = {name: Table({"u1": np.full(4, float(len(mark)))}) for name in ("signal", mark)}
    return Results(typed({"format": 1, "title": mark}), f"title: {mark}\n", tables=tables)


def kill_at(step: int) -> None:
    """Count the audit events of files from now on, and kill this process at the given one."""
    left = [step]

    def hear(event: str, _arguments: tuple) -> None:
        if event.startswith(STEPS):
            left[0] -= 1
            if left[0] == 0:
                os.kill(os.getpid(), signal.SIGKILL)

    sys.addaudithook(hear)


def state(folder: Path) -> str:
    """The mark of the run that stands whole in `folder`, or "none", or "mixed"."""
    if not (folder / "result.json").exists():
        return "none"
    result = json.loads((folder / "result.json").read_text())
    mark = result["title"]
    texts = {f"title: {mark}\n": "spec.yaml", "\n".join(["u1", *[str(len(mark))] * 4, ""]): "signal.csv"}
    whole = all((folder / name).exists() for name in result["files"])
    return mark if whole and all((folder / n).read_text() == t for t, n in texts.items()) else "mixed"


def attempt(folder: Path, step: int, users: str) -> dict | None:
    """One replacement, killed at `step`; None if it ended before."""
    target = folder / str(step) / "a"
    write_run(a_run("first"), target)
    (target / "notes.txt").write_text("mine")
    if users == "folder":
        (target / "data").mkdir()
    child = os.fork()
    if child == 0:
        kill_at(step)
        write_run(a_run("second"), target)
        os._exit(0)
    _, status = os.waitpid(child, 0)
    if not os.WIFSIGNALED(status):
        return None
    left = {"at_once": state(target)}
    try:
        read_run(target)
    except DataError as error:
        left["error"] = str(error)
    beside = {path.name for path in target.parent.iterdir()}
    inside = {path.name for path in target.iterdir()}
    files = {"spec.yaml", "signal.csv", "result.json", f"{state(target)}.csv", "notes.txt"}
    files |= {"data"} if users == "folder" else set()
    left |= {"then": state(target), "strange": sorted((beside - {"a"}) | (inside ^ files))}
    write_run(a_run("second"), target)
    return left | {"in_the_end": state(target), "notes": (target / "notes.txt").read_text()}


def main(folder: str, users: str) -> None:
    os.fsync = lambda handle: None  # for a power cut, not for a kill
    step = 1
    while (left := attempt(Path(folder), step, users)) is not None:
        print(json.dumps(left))
        step += 1


if __name__ == "__main__":
    main(*sys.argv[1:])
