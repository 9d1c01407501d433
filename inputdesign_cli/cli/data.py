"""Data in, a run out: `idesign explore`, `identify` and `assess`; in parts `campaign`, `next`, `status`."""

from __future__ import annotations

import shlex
from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Literal

import typer

from inputdesign_cli.cli.applying import instructions
from inputdesign_cli.cli.options import Changes, Into, Shown, typed
from inputdesign_cli.cli.rows import Levels, Rows, Written, levels
from inputdesign_cli.cli.run import Place, keep, name_of, read_spec
from inputdesign_cli.cli.terminal import computing
from inputdesign_cli.errors import EXIT_DONE, EXIT_MISSED, EXIT_UNDECIDED

if TYPE_CHECKING:
    from inputdesign_cli.outcome.results import Results


def explore(
    data: list[Path],
    *,
    rows: Rows,
    spec: Path | None = None,
    validate: Path | None = None,
    structure: Literal["any", "fopdt", "sopdt", "integrator", "arx", "armax", "oe", "bj"] = "any",
    operating_point: str = "",
    into: Into,
    shown: Shown,
) -> None:
    """Find a model in a log, and write a spec for the next experiment.

    Needs no spec. Delays, orders and the family of the model are estimated on one part of the record and
    judged on the other; the simplest that explains it as well is taken. Writes model.yaml, a commented
    spec.yaml for `idesign solve`, figures and report.html; prints a summary. With --spec the spec that is
    written keeps what that one asks for. Exits with 1, and says why, where no model deserves trust.
    """
    point = ["--operating-point", operating_point] if levels(operating_point) else []
    if point and spec is None:
        message = "it goes with --spec, whose next command takes it: explore estimates levels itself"
        raise typer.BadParameter(message, param_hint="--operating-point")
    if spec is not None and validate is not None:
        raise typer.BadParameter("a model that is judged needs no further spec", param_hint="--spec")
    ending = "explored" if validate is None else "validated"
    sources = [*filter(None, [spec, validate]), *data]
    place = Place(into, f"{data[0].stem}_{ending}", sources, numbered=True)
    with computing(data[0], quiet=shown.quiet):
        from inputdesign_cli import questions

        model = None if validate is None else read_spec(validate, Changes(), design=False)
        place = place.checked(model)
        only = None if structure == "any" else structure
        asked = None if spec is None else read_spec(spec, Changes())
        taken = replace(rows.of(data), operating_point=levels(operating_point))
        found = questions.explore(data, taken, model=model, structure=only, asked=asked)
    keep(found.results, place, shown, page=validate is None)
    if found.reasons:
        raise typer.Exit(EXIT_MISSED)
    if validate is None and not (shown.quiet or shown.json_output or into.no_output):
        from inputdesign_cli.findings.places import argument

        found_spec = argument(str(place.directory / "spec.yaml"))
        if spec is None:
            then = f"idesign solve {shlex.quote(found_spec)}   (say in it how accurate the model must be)"
        elif any(one.code == "written-spec-refused" for one in found.results.outcome.findings or ()):
            then = f"mend {found_spec}, until this accepts it: idesign validate {shlex.quote(found_spec)}"
        else:
            removed = found.levels.split() if rows.detrend == "none" else []
            options = [*typed(rows), *(point if point and "--detrend" not in removed else removed)]
            logs = (argument(str(path)) for path in data)
            then = shlex.join(["idesign", "assess", found_spec, *options, *logs])
        typer.echo(f"Then: {then}")


def identify(
    data: list[Path],
    *,
    spec: Path | None = None,
    changes: Changes,
    into: Into,
    levels: Levels,
    rows: Rows,
    frequency_response: bool = False,
    shown: Shown,
) -> None:
    """Estimate the plant and the noise from recorded experiments.

    Orders and delay are as in the spec's plant and noise; it need not ask for a design. Writes
    model.yaml, the estimate as blocks to paste into a spec, with figures of the fit, the residuals and the
    model error; prints a summary. In closed loop the direct method is used, from u and y alone.
    """
    if spec is None:
        raise typer.BadParameter(
            "it says which structure is estimated; `idesign explore DATA` finds one without a spec",
            param_hint="--spec",
        )
    place = Place(into, f"{data[0].stem}_identified", [spec, *data], numbered=True)
    with computing(data[0], quiet=shown.quiet):
        from inputdesign_cli import questions
        from inputdesign_cli.outcome.run_directory import check_counted_once

        stated = read_spec(spec, changes, design=False)
        place = place.checked(stated)
        check_counted_once(spec, data)
        results = questions.identify(
            stated,
            data,
            remove_means=levels.remove_means,
            operating_point=levels.point,
            preparation=rows.of(data),
            frequency_response=frequency_response,
        )
    keep(results, place, shown)


def assess(
    spec: Path, data: list[Path], *, changes: Changes, into: Into, levels: Levels, rows: Rows, shown: Shown
) -> None:
    """Show whether the data of a real experiment meet the target.

    Identifies the model, from all records jointly, and compares the accuracy that the data give with what
    the spec asks for. Exits with 0 if it is met. If not, exits with 1 and writes the cheapest experiment
    that, after these data, meets it: its signal is ready to apply. Exits with 5, undecided, where the
    data contradict the model or leave it open; the output says what to run next.
    """
    # Several records judged together make another run than the first of them alone.
    together = f"_and_{len(data) - 1}_more" if len(data) > 1 else ""
    sources = [spec, *data]
    place = Place(into, f"{data[0].stem}{together}_assessed", sources, judges=True, numbered=True)
    with computing(data[0], quiet=shown.quiet):
        from inputdesign_cli import questions
        from inputdesign_cli.outcome.run_directory import check_counted_once

        stated = read_spec(spec, changes)
        place = place.checked(stated)
        check_counted_once(spec, data)
        assessment = questions.assess(
            stated,
            data,
            remove_means=levels.remove_means,
            operating_point=levels.point,
            preparation=rows.of(data),
        )
    again, explores = typed(changes, levels, rows), ["idesign", "explore", "--spec", str(spec)]
    explores += typed(replace(levels, remove_means=False))  # explore estimates levels itself
    begins = {
        "idesign assess SPEC": ["idesign", "assess", str(spec), *again],
        # The longer beginning comes first: columns that the command has are not named twice.
        "idesign explore --columns": [*explores, *typed(replace(rows, columns="")), "--columns"],
        "idesign explore": [*explores, *typed(rows)],
        "idesign solve SPEC": ["idesign", "solve", str(spec), *typed(changes)],
    }
    results = _with_typed(assessment.results, begins, explored=_explored(spec, data, assessment.results))
    keep(results, place, shown)
    if not (shown.quiet or shown.json_output or into.no_output):
        more = ["idesign", "assess", str(spec), *map(str, data), "MORE.csv", *again]
        for line in instructions(results, str(spec), shlex.join(more)):
            typer.echo(line)
    _end(assessment.verdict)


def _with_typed(results: Results, begins: Mapping[str, Sequence[str]], *, explored: bool) -> Results:
    """Return an assessment whose next command names the spec and the options that were typed.

    Args:
        begins: the beginnings of commands -> the words that replace them.
        explored: whether `explore` has chosen the structure by the same data: it would choose it again.
    """
    judged = results.outcome.assessment
    assert judged is not None
    command = judged.next or ""
    if explored and command.startswith("idesign explore"):
        command = "idesign solve SPEC  # explore knows no better structure here: take a further record"
    begin = next((one for one in begins if command.startswith(one)), None)
    if begin is not None:
        command = shlex.join(begins[begin]) + command.removeprefix(begin)
    return replace(
        results, outcome=replace(results.outcome, assessment=replace(judged, next=command or None))
    )


def _explored(spec: Path, data: Sequence[Path], results: Results) -> bool:
    """Return whether `idesign explore` has found the structure of this estimate in the same data."""
    from inputdesign_cli.outcome.run_files import SPEC, known_result
    from inputdesign_cli.outcome.sentences import parameter

    made = known_result(spec.parent) if spec.name == SPEC else {}
    known = {(spec.parent / str(name)).resolve() for name in made.get("made_from", ())}
    if "exploration" not in made or not known >= {one.resolve() for one in data}:
        return False
    found, theirs = results.outcome.identification, made.get("identification", {}).get("theta", {})
    ours = {} if found is None or found.theta is None else found.theta
    here, there = ({name for name in theta if parameter(name) == name} for theta in (ours, theirs))
    return here == there


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
    place = Place(Into(output, overwrite), name_of(spec), [spec], relocates=False)
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
    withdraw: list[int] | None = None,
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
    the campaign goes on and when the data meet the target, and with 1 where it has ended without that. Exits
    with 5 where the data contradict the model or leave it open.
    """
    if data is not None and withdraw:
        raise typer.BadParameter("give a record, or withdraw one", param_hint="--withdraw")
    if regardless and withdraw:
        raise typer.BadParameter("withdraw first, then say it without a record", param_hint="--regardless")
    with computing(directory, quiet=quiet):
        from inputdesign_cli import questions
        from inputdesign_cli.outcome.run_files import SPEC
        from inputdesign_cli.questions.campaign.directory import advanced, withdrawn
        from inputdesign_cli.questions.campaign.memory import held, read_memory
        from inputdesign_cli.specification import parse_spec

    with held(directory):
        with computing(directory, quiet=quiet):
            memory = read_memory(directory, withdrawing=withdraw or ())
            stated = parse_spec(memory.spec, str(directory / SPEC), folder=memory.folder)
            if withdraw:
                decide = partial(withdrawn, memory=memory, numbers=sorted(set(withdraw)))
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
    _end(results.result["status"])


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


def _end(verdict: str) -> None:
    """End a command with the exit code of its verdict, if it is not zero."""
    code = {"missed": EXIT_MISSED, "undecided": EXIT_UNDECIDED}.get(verdict, EXIT_DONE)
    if code:
        raise typer.Exit(code)
