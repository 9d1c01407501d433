"""`idesign solve`, `idesign analyse` and `idesign simulate`: a spec in, a run out."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import typer

from inputdesign_cli.cli.computing import computing
from inputdesign_cli.cli.options import (
    Confine,
    Fast,
    FigureFormat,
    Figures,
    Json,
    KeepPartial,
    NoOutput,
    Output,
    Overrides,
    Overwrite,
    Quiet,
    SpecFile,
)
from inputdesign_cli.cli.reading import name_of, read_spec
from inputdesign_cli.cli.run import Place, keep
from inputdesign_cli.cli.streams import ending_early
from inputdesign_cli.cli.trade import TradeWords, tell_trade
from inputdesign_cli.cli.workers import ClusterAddress, Jobs, WorkerTimeout, executor
from inputdesign_cli.compute.time_limit import stoppable
from inputdesign_cli.errors import STANDARD_STREAM

if TYPE_CHECKING:
    from inputdesign_cli.compute.executor import Executor
    from inputdesign_cli.outcome.results import Results
    from inputdesign_cli.questions.verbs import Verb


def solve(
    spec: SpecFile,
    overrides: Overrides = None,
    confine: Confine = None,
    output: Output = None,
    overwrite: Overwrite = False,
    no_output: NoOutput = False,
    keep_partial: KeepPartial = False,
    fast: Fast = False,
    trade: TradeWords = None,
    figures: Figures = True,
    figure_format: FigureFormat = "png",
    json_output: Json = False,
    quiet: Quiet = False,
) -> None:
    """Design the experiment that a spec asks for.

    Writes a run directory with the spectrum, the signal to apply, the model error that it buys, and the
    proof of optimality; prints a summary.
    """
    place = Place(output, name_of(spec), [spec], overwrite, no_output)
    if trade and (no_output or keep_partial or str(spec) == STANDARD_STREAM):
        message = "--trade needs a spec on disc and a directory to write, and does not go with --keep-partial"
        raise typer.BadParameter(message)
    if fast:
        overrides = [*(overrides or []), "solver.any_spectrum=false"]
    if not keep_partial:
        results, place = _results("solve", place, overrides, confine, quiet)
        keep(
            results, place, figures=figures, figure_format=figure_format, json_output=json_output, quiet=quiet
        )
        if trade:
            read = read_spec(spec, overrides, confine)
            beside = place.directory.with_name(f"{place.directory.name}-trade")
            tell_trade(
                spec,
                read,
                trade.split(","),
                beside,
                overrides=overrides or [],
                confine=confine,
                figure_format=figure_format,
                quiet=quiet or json_output,
            )
        return
    with stoppable() as stop, ending_early(stop) as came:
        results, place = _results("solve", place, overrides, confine, quiet)
    keep(results, place, figures=figures, figure_format=figure_format, json_output=json_output, quiet=quiet)
    if came:
        raise typer.Exit(128 + came[0])


def analyse(
    spec: SpecFile,
    overrides: Overrides = None,
    confine: Confine = None,
    output: Output = None,
    overwrite: Overwrite = False,
    no_output: NoOutput = False,
    figures: Figures = True,
    figure_format: FigureFormat = "png",
    json_output: Json = False,
    quiet: Quiet = False,
) -> None:
    """Tell what accuracy a given excitation buys.

    Nothing is optimised: the excitation stands in the spec under `spectrum.given`. Writes a run
    directory and prints a summary.
    """
    place = Place(output, name_of(spec), [spec], overwrite, no_output)
    results, place = _results("analyse", place, overrides, confine, quiet)
    keep(results, place, figures=figures, figure_format=figure_format, json_output=json_output, quiet=quiet)


def simulate(
    spec: SpecFile,
    overrides: Overrides = None,
    confine: Confine = None,
    output: Output = None,
    overwrite: Overwrite = False,
    no_output: NoOutput = False,
    jobs: Jobs = 1,
    cluster: ClusterAddress = None,
    worker_timeout: WorkerTimeout = None,
    figures: Figures = True,
    figure_format: FigureFormat = "png",
    json_output: Json = False,
    quiet: Quiet = False,
) -> None:
    """Try the designed experiment on the true system, many times.

    Designs as `solve` does, runs the experiment as often as `simulation.runs` says, each time with new
    noise, and adds to the run directory of `solve` what the models did; prints a summary.
    The runs go in batches, each with a seed of its own: the result is the same wherever they are computed.
    """
    place = Place(output, name_of(spec), [spec], overwrite, no_output)
    results, place = _results(
        "simulate", place, overrides, confine, quiet, executor(jobs, cluster, worker_timeout, quiet=quiet)
    )
    keep(results, place, figures=figures, figure_format=figure_format, json_output=json_output, quiet=quiet)


def _results(
    verb: Verb,
    place: Place,
    overrides: list[str] | None,
    confine: Path | None,
    quiet: bool,
    executor: Executor | None = None,
) -> tuple[Results, Place]:
    """What a verb makes of a spec file for its place, which is looked at before.

    The numerical libraries are imported behind the message.
    """
    file = place.sources[0]
    with computing(file, quiet=quiet):
        from inputdesign_cli.questions.verbs import run_verb

        spec = read_spec(file, overrides, confine)
        place = place.checked(spec)
        return run_verb(verb, spec, executor), place
