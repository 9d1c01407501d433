"""`idesign solve`, `idesign analyse` and `idesign simulate`: a spec in, a run out; and `idesign validate`."""

from __future__ import annotations

import json
from contextlib import ExitStack
from pathlib import Path
from typing import TYPE_CHECKING

import typer

from inputdesign_cli.cli.applying import instructions
from inputdesign_cli.cli.options import Changes, Into, Shown, Workers
from inputdesign_cli.cli.run import Place, keep, name_of, read_spec
from inputdesign_cli.cli.sweep import show_trade
from inputdesign_cli.cli.terminal import computing, ending_early
from inputdesign_cli.compute.time_limit import stoppable
from inputdesign_cli.errors import STANDARD_STREAM, IdesignError

if TYPE_CHECKING:
    from inputdesign_cli.compute.executor import Executor
    from inputdesign_cli.outcome.results import Results
    from inputdesign_cli.questions import Verb


def solve(
    spec: Path,
    *,
    changes: Changes,
    into: Into,
    keep_partial: bool = False,
    fast: bool = False,
    trade: str | None = None,
    shown: Shown,
) -> None:
    """Design the experiment that a spec asks for.

    Writes a run directory with the spectrum, the signal to apply, the model error that it buys, and the
    proof of optimality; prints a summary.
    """
    if trade and (into.no_output or keep_partial or str(spec) == STANDARD_STREAM):
        message = "--trade needs a spec on disc and a directory to write, and does not go with --keep-partial"
        raise typer.BadParameter(message)
    changes, came = changes.faster(fast), list[int]()
    if trade:
        with computing(spec, quiet=shown.quiet):
            from inputdesign_cli.sweeps.plan import trade_plan

            stated, words = read_spec(spec, changes), trade.split(",")
            plan = trade_plan(spec, stated, words, changes.overrides or (), changes.confine)
    with ExitStack() as stack:
        if keep_partial:
            came = stack.enter_context(ending_early(stack.enter_context(stoppable())))
        results, place = _results("solve", spec, changes, into, shown)
    keep(results, place, shown)
    if not (shown.quiet or shown.json_output or into.no_output):
        for line in instructions(results, str(place.directory / "spec.yaml")):  # with changes by `--set`
            typer.echo(line)
    if trade:
        show_trade(plan, stated, words, place.directory, shown)
    if came:
        raise typer.Exit(128 + came[0])


def analyse(spec: Path, *, changes: Changes, into: Into, shown: Shown) -> None:
    """Show what accuracy a given excitation buys.

    Nothing is optimised: the excitation stands in the spec under `spectrum.given`. Writes a run
    directory and prints a summary.
    """
    keep(*_results("analyse", spec, changes, into, shown), shown)


def simulate(spec: Path, *, changes: Changes, into: Into, workers: Workers, shown: Shown) -> None:
    """Try the designed experiment on the true system, many times.

    Designs as `solve` does, runs the experiment as often as `simulation.runs` says, each time with new
    noise, and adds to the run directory of `solve` what the models did; prints a summary.
    The runs go in batches, each with a seed of its own: the result is the same wherever they are computed.
    """
    computes = workers.executor(quiet=shown.quiet)
    keep(*_results("simulate", spec, changes, into, shown, computes), shown)


def _results(
    verb: Verb, file: Path, changes: Changes, into: Into, shown: Shown, executor: Executor | None = None
) -> tuple[Results, Place]:
    """Return the results of a verb for a spec file and the place of the run, which is checked before.

    The numerical libraries are imported behind the message.
    """
    place = Place(into, name_of(file), [file])
    with computing(file, quiet=shown.quiet):
        from inputdesign_cli.questions import run_verb

        spec = read_spec(file, changes)
        place = place.checked(spec)
        return run_verb(verb, spec, executor), place


def validate(specs: list[Path], *, changes: Changes, json_output: bool = False, quiet: bool = False) -> None:
    """Check specs without computing a design.

    A valid spec can be read and is well posed. One that states nothing of a design (accuracy, limits,
    spectrum, ..) is checked for what `identify` needs. All problems of all files are reported at once.
    """
    from inputdesign_cli import questions

    errors: list[IdesignError] = []
    estimated: list[Path] = []
    for path in specs:
        try:
            spec = read_spec(path, changes, design=None)
            questions.validate(spec)
        except IdesignError as error:
            errors.append(error)
        else:
            estimated += [] if spec.asks_for_design else [path]
            if not quiet and not json_output:
                typer.echo(
                    f"{path}: valid" + ("" if spec.asks_for_design else " for identify; no design is asked")
                )
    if errors:
        worst = max(errors, key=lambda error: error.exit_code)
        raise type(worst)([diagnostic for error in errors for diagnostic in error.diagnostics])
    if json_output:
        found = {"valid": [str(path) for path in specs]}
        if estimated:
            found["for_identify_only"] = [str(path) for path in estimated]
        typer.echo(json.dumps(found, indent=1, ensure_ascii=False))
