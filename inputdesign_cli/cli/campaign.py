"""`idesign campaign`, `idesign next` and `idesign status`: an experiment in parts."""

from __future__ import annotations

from dataclasses import replace
from functools import partial
from pathlib import Path

import typer

from inputdesign_cli.cli.options import Changes, Into, Shown
from inputdesign_cli.cli.rows import Written, levels
from inputdesign_cli.cli.run import Place, keep, name_of, read_spec
from inputdesign_cli.cli.terminal import computing
from inputdesign_cli.errors import EXIT_DONE, EXIT_MISSED, EXIT_UNDECIDED

_EXIT = {"running": EXIT_DONE, "stopped": EXIT_DONE, "missed": EXIT_MISSED, "undecided": EXIT_UNDECIDED}


def campaign(
    spec: Path,
    *,
    changes: Changes,
    output: Path | None = None,
    overwrite: bool = False,
    figures: bool = True,
    json_output: bool = False,
    quiet: bool = False,
) -> None:
    """Begin an experiment that goes in parts.

    Plans the first part: signal.csv is ready to apply. Give what was recorded to `idesign next`, which
    estimates the model, plans the next part with all data so far, and stops as soon as they meet the target.
    The directory remembers every plan, record and decision.
    """
    place = Place(Into(output, overwrite), name_of(spec), [spec])
    with computing(spec, quiet=quiet):
        from inputdesign_cli import questions
        from inputdesign_cli.questions.campaign.directory import begun

        stated = read_spec(spec, changes)
        place = place.checked(stated)
        first = partial(begun, folder=stated.resolve_path("."), directory=place.directory)
        results = questions.next_round(stated, first, begins=True)
    keep(results, place, Shown(figures, json_output=json_output, quiet=quiet))


def proceed(
    directory: Path,
    data: Path | None = None,
    *,
    withdraw: int | None = None,
    as_applied: bool = False,
    regardless: bool = False,
    written: Written,
    operating_point: str = "",
    figures: bool = True,
    json_output: bool = False,
    quiet: bool = False,
) -> None:
    """Take the record of a part, and plan the next or stop.

    All records that count are estimated jointly. Without DATA the decision is made anew. Exits with 0 while
    the campaign goes on, and when the data meet the target; with 1 where it has ended without that, with 5
    where the data contradict the model structure.
    """
    if data is not None and withdraw is not None:
        raise typer.BadParameter("give a record, or withdraw one", param_hint="--withdraw")
    if regardless and withdraw is not None:
        raise typer.BadParameter("withdraw first, then say it without a record", param_hint="--regardless")
    with computing(directory, quiet=quiet):
        from inputdesign_cli import questions
        from inputdesign_cli.outcome.run_files import SPEC
        from inputdesign_cli.questions.campaign.directory import advanced, withdrawn
        from inputdesign_cli.questions.campaign.memory import held, read_memory
        from inputdesign_cli.specification import parse_spec

    with held(directory):
        with computing(directory, quiet=quiet):
            memory = read_memory(directory, withdrawing=withdraw)
            stated = parse_spec(memory.spec, str(directory / SPEC), folder=memory.folder)
            if withdraw is not None:
                decide = partial(withdrawn, memory=memory, number=withdraw)
            else:
                taken = replace(written.preparation(), operating_point=levels(operating_point))
                decide = partial(
                    advanced,
                    memory=memory,
                    given=data,
                    preparation=taken,
                    unlike=as_applied,
                    regardless=regardless,
                )
            results = questions.next_round(stated, decide)
        place = Place(Into(directory), figures=stated.figures)
        keep(results, place, Shown(figures, json_output=json_output, quiet=quiet))
    code = _EXIT[results.result["status"]]
    if code:
        raise typer.Exit(code)


def status(directory: Path, *, json_output: bool = False) -> None:
    """Show how a campaign stands: what has been reached, and what comes next."""
    from inputdesign_cli.outcome.codec import json_text
    from inputdesign_cli.questions.campaign.memory import read_memory

    memory = read_memory(directory)
    if json_output:
        typer.echo(json_text(memory.campaign), nl=False)
        return
    from inputdesign_cli.cli.summary import summary
    from inputdesign_cli.outcome.run_directory import read_outcome
    from inputdesign_cli.outcome.run_files import RESULT, readable

    with readable(directory / RESULT):
        text = summary(read_outcome(directory), memory.campaign.time_unit, [])
    typer.echo(text)
