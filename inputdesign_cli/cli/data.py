"""`idesign explore`, `idesign identify` and `idesign assess`: the data of an experiment in, a run out."""

from __future__ import annotations

from pathlib import Path
from typing import Literal

import typer

from inputdesign_cli.cli.options import Changes, Into, Shown
from inputdesign_cli.cli.rows import Levels, Rows
from inputdesign_cli.cli.run import Place, keep, read_spec
from inputdesign_cli.cli.terminal import computing
from inputdesign_cli.errors import EXIT_MISSED, EXIT_UNDECIDED

_EXIT = {"missed": EXIT_MISSED, "undecided": EXIT_UNDECIDED}


def explore(
    data: list[Path],
    *,
    rows: Rows,
    validate: Path | None = None,
    structure: Literal["any", "fopdt", "sopdt", "integrator", "arx", "armax", "oe", "bj"] = "any",
    into: Into,
    shown: Shown,
) -> None:
    """Find a model in a log, and write a spec for the next experiment.

    Needs no spec. Delays, orders and the family of the model are estimated on one part of the record and
    judged on the other; the simplest that explains it as well is taken. Writes model.yaml, a
    commented spec.yaml for `idesign solve`, figures and report.html; prints a summary. Exits with 1, and
    says why, where no model deserves trust.
    """
    ending = "explored" if validate is None else "validated"
    sources = [*([validate] if validate is not None else []), *data]
    place = Place(into, f"{data[0].stem}_{ending}", sources)
    with computing(data[0], quiet=shown.quiet):
        from inputdesign_cli import questions

        model = None if validate is None else read_spec(validate, Changes(), design=False)
        place = place.checked(model)
        only = None if structure == "any" else structure
        found = questions.explore(data, rows.of(data), model=model, structure=only)
    keep(found.results, place, shown, page=validate is None)
    if found.reasons:
        raise typer.Exit(EXIT_MISSED)


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
    place = Place(into, f"{data[0].stem}_identified", [spec, *data])
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
    that, after these data, meets it: its signal is ready to apply. Exits with 5, undecided, where tests of
    the residuals refute the model structure; the note says what to change.
    """
    place = Place(into, f"{data[0].stem}_assessed", [spec, *data], judges=True)
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
    keep(assessment.results, place, shown)
    if assessment.verdict in _EXIT:
        raise typer.Exit(_EXIT[assessment.verdict])
