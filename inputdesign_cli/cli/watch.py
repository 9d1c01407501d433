"""`idesign report` and `idesign watch`: pages about a spec, a run, a campaign or a sweep."""

from __future__ import annotations

import time
from collections.abc import Iterator
from contextlib import contextmanager
from functools import partial
from pathlib import Path
from threading import Event, Thread
from typing import TYPE_CHECKING

import typer

from inputdesign_cli.cli.options import Changes, Into, Shown
from inputdesign_cli.cli.run import Place, keep, read_spec
from inputdesign_cli.cli.terminal import complain, status
from inputdesign_cli.errors import STANDARD_STREAM, IdesignError, OutputError
from inputdesign_cli.regular_file import read_regular

if TYPE_CHECKING:
    from inputdesign_cli.live.pages import Stamp
    from inputdesign_cli.live.server import Board

_LOOK = 0.1  # seconds between looks at the file while it is solved


def report(directory: Path, *, output: Path | None = None, bibtex: bool = False, quiet: bool = False) -> None:
    """Write a run or a sweep as one HTML page.

    The page has the question, the answer, its proof, what was assumed and how to reproduce it, with
    charts. It needs no network and no script, and can be printed.
    """
    with status(f"{directory}: writing ...", quiet=quiet):
        from inputdesign_cli.outcome.run_directory import replace_text
        from inputdesign_cli.outcome.run_files import PAGE, is_page
        from inputdesign_cli.report.render import bibtex_text, report_text

        if bibtex:
            typer.echo(bibtex_text(directory), nl=False)
            return
        if str(output) == STANDARD_STREAM:
            typer.echo(report_text(directory))
            return
        file = output or directory / PAGE
        if file.exists() and not is_page(file):
            hint = "choose another name, or move it away: only a page that idesign wrote is replaced"
            raise OutputError.because("output-exists", f"{file} exists already, and is no report", hint)
        replace_text(file, report_text(directory))
    if not quiet:
        typer.echo(file)


def watch(
    spec: Path,
    *,
    changes: Changes,
    output: Path | None = None,
    overwrite: bool = False,
    fast: bool = False,
    figures: bool = True,
    port: int = 0,
) -> None:
    """Serve a local page that solves a spec again whenever it is saved.

    The page shows the answer, its pictures and the design before it; what is wrong stands at its line, beside
    the last good design. The run directory is that of `solve`. Of a directory it shows the run, the campaign
    or the sweep in it, and follows that. It is served to this machine only, until Ctrl-C.
    """
    from inputdesign_cli.live.pages import message_page
    from inputdesign_cli.live.server import Board, serving

    if str(spec) == STANDARD_STREAM:
        raise typer.BadParameter("standard input cannot be followed: name a file", param_hint="SPEC")
    board = Board()
    board.show(message_page(spec.name, "Computing .."))
    with serving(board, port) as address:
        typer.echo(address)
        typer.echo(f"follows {spec}; open the address in a browser, Ctrl-C ends it", err=True)
        if spec.is_dir():
            _follow_directory(spec, board)
        changes = changes.faster(fast)
        place = Place(Into(output, overwrite), spec.stem, [spec])
        _follow_spec(spec, changes, place, board, figures)


def _follow_spec(spec: Path, changes: Changes, place: Place, board: Board, figures: bool) -> None:
    """Solve the spec and show its page, again and again."""
    from inputdesign_cli.live.pages import Followed, stamp, wait_for_change
    from inputdesign_cli.questions import run_verb

    followed, files = Followed(spec.name), [spec]
    while True:
        before, started = stamp(files), time.monotonic()
        lines = read_regular(spec).decode(errors="replace").splitlines() if spec.is_file() else []
        board.show(followed.computing().page)
        try:
            with _given_up_when_saved(files, before):
                files = [spec, *_named_files(spec, changes.overrides or [])]
                before = stamp(files)
                asked = read_spec(spec, changes)
                place = place.checked(asked)
                results = run_verb("solve", asked)
            if stamp(files) == before:
                keep(results, place, Shown(figures=False, quiet=True))
                solved = partial(
                    followed.solved, place.directory, time.strftime("%H:%M:%S"), time.monotonic() - started
                )
                # First the answer, then the pictures of the page, then the files of figures.
                board.show(solved(pictures=False).page)
                followed = solved()
                board.show(followed.page)
                typer.echo(followed.said, err=True)
                if figures and stamp(files) == before:
                    keep(results, place, Shown(quiet=True))
        except IdesignError as error:
            followed = followed.failed(error, lines, str(spec))
            complain(error)
        if stamp(files) == before:
            board.show(followed.page)
            wait_for_change(files, before)


def _named_files(spec: Path, overrides: list[str]) -> list[Path]:
    """Return the files that the spec includes or names, where it can be read."""
    from inputdesign_cli.specification import read_template

    try:
        draft = read_template(spec, overrides)
        return [draft.folder / name for name in (*draft.included, *draft.files(draft.data))]
    except IdesignError:
        return []


@contextmanager
def _given_up_when_saved(files: list[Path], before: Stamp) -> Iterator[None]:
    """Stop the computation inside at its next round once a file is saved."""
    from inputdesign_cli.compute.time_limit import stoppable
    from inputdesign_cli.live.pages import stamp

    done = Event()
    with stoppable() as stop:

        def look() -> None:
            while not done.wait(_LOOK):
                if stamp(files) != before:
                    stop()
                    return

        Thread(target=look, daemon=True).start()
        try:
            yield
        finally:
            done.set()


def _follow_directory(directory: Path, board: Board) -> None:
    """Show the run, the campaign or the sweep in a directory, and how many points a sweep has so far."""
    from inputdesign_cli.live.pages import followed_page, message_page, stamp, wait_for_change
    from inputdesign_cli.report.render import report_text

    records = [directory / name for name in ("result.json", "sweep.csv", "sweep.json", "points", "failures")]
    while True:
        before = stamp(records)
        try:
            board.show(followed_page(report_text(directory)))
        except IdesignError as error:
            points = sum(1 for _ in (directory / "points").glob("*/result.json"))
            said = f"{points} points have a result so far." if points else error.diagnostics[0].message
            board.show(message_page(directory.name, said, "shows what comes"))
        wait_for_change(records, before)
