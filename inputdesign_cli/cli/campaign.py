"""`idesign campaign`, `idesign next` and `idesign status`: an experiment in parts."""

from __future__ import annotations

from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Annotated

import typer

from inputdesign_cli.cli.options import (
    Changes,
    Figures,
    Into,
    Json,
    Output,
    Overwrite,
    Quiet,
    Shown,
    SpecFile,
)
from inputdesign_cli.cli.reading import name_of, read_spec
from inputdesign_cli.cli.rows import OperatingPoint, Written, levels
from inputdesign_cli.cli.run import Place, keep, renew
from inputdesign_cli.cli.terminal import computing
from inputdesign_cli.errors import EXIT_DONE, EXIT_MISSED, EXIT_UNDECIDED

CampaignDirectory = Annotated[
    Path, typer.Argument(metavar="DIR", help="The directory that idesign campaign wrote.")
]
Recorded = Annotated[
    Path | None, typer.Argument(metavar="DATA", help="What was recorded of the part that signal.csv was for.")
]
Withdraw = Annotated[
    int | None,
    typer.Option("--withdraw", metavar="N", min=1, help="Leave out record N from now on; its file stays."),
]
AsApplied = Annotated[
    bool,
    typer.Option(
        "--as-applied",
        help="Take a record of something else than what was planned: at another scale, an earlier plan, "
        "or none.",
    ),
]
Regardless = Annotated[
    bool,
    typer.Option(
        "--regardless",
        help="Go on, from now on, where tests of the residuals refute the structure of the model.",
    ),
]
_EXIT = {"running": EXIT_DONE, "stopped": EXIT_DONE, "missed": EXIT_MISSED, "undecided": EXIT_UNDECIDED}


def campaign(
    spec: SpecFile,
    *,
    changes: Changes,
    output: Output = None,
    overwrite: Overwrite = False,
    figures: Figures = True,
    json_output: Json = False,
    quiet: Quiet = False,
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
        results = begun(partial(questions.next_round, stated), stated.resolve_path("."), place.directory)
    keep(results, place, Shown(figures, json_output=json_output, quiet=quiet))


def proceed(
    directory: CampaignDirectory,
    data: Recorded = None,
    *,
    withdraw: Withdraw = None,
    as_applied: AsApplied = False,
    regardless: Regardless = False,
    written: Written,
    operating_point: OperatingPoint = "",
    figures: Figures = True,
    json_output: Json = False,
    quiet: Quiet = False,
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
        from inputdesign_cli.outcome.record import SPEC
        from inputdesign_cli.questions.campaign.directory import advanced, withdrawn
        from inputdesign_cli.questions.campaign.memory import held, read_memory
        from inputdesign_cli.specification import parse_spec

    with held(directory):
        with computing(directory, quiet=quiet):
            memory = read_memory(directory, withdrawing=withdraw)
            stated = parse_spec(memory.spec, str(directory / SPEC), folder=memory.folder)
            decide = partial(questions.next_round, stated)
            if withdraw is not None:
                results = withdrawn(decide, memory, withdraw)
            elif data is None:
                results = advanced(decide, memory, None, None, regardless=regardless)
            else:
                taken = replace(written.preparation(), operating_point=levels(operating_point))
                part = questions.recorded_part(stated, data, taken)
                results = advanced(decide, memory, data, part, unlike=as_applied, regardless=regardless)
        renew(results, directory, Shown(figures, json_output=json_output, quiet=quiet))
    code = _EXIT[results.result["status"]]
    if code:
        raise typer.Exit(code)


def status(directory: CampaignDirectory, json_output: Json = False) -> None:
    """Show how a campaign stands: what has been reached, and what comes next."""
    from inputdesign_cli.outcome.codec import json_text
    from inputdesign_cli.questions.campaign.memory import read_memory

    memory = read_memory(directory)
    if json_output:
        typer.echo(json_text(memory.campaign), nl=False)
        return
    from inputdesign_cli.cli.summary import summary
    from inputdesign_cli.outcome.record import RESULT, readable
    from inputdesign_cli.outcome.run_directory import read_outcome

    with readable(directory / RESULT):
        text = summary(read_outcome(directory), memory.campaign.time_unit, [])
    typer.echo(text)
