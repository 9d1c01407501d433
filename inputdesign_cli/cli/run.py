"""What commands that make a run end with: a run directory and a summary."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING

import typer

from inputdesign_cli.cli.terminal import status
from inputdesign_cli.errors import OutputError

if TYPE_CHECKING:
    from inputdesign_cli.runs.results import Results


@dataclass(frozen=True)
class Place:
    """Where a run goes: to `output` or else to runs/`name`; what it was made from, the spec first."""

    output: Path | None
    name: str
    sources: Sequence[Path]
    overwrite: bool = False
    nowhere: bool = False  # nothing is written

    def __post_init__(self) -> None:
        if self.nowhere and self.output is not None:
            raise typer.BadParameter("--no-output writes nothing, and --output says where")

    @property
    def directory(self) -> Path:
        """The run directory."""
        return self.output or Path("runs") / self.name


def keep(
    results: Results,
    place: Place,
    *,
    figures: bool,
    json_output: bool,
    quiet: bool,
    figure_format: str = "png",
) -> None:
    """Write a run to its place, with figures or without, and print its result or its summary.

    Raises:
        OutputError: as `write_run`, and `output-is-the-spec`.
    """
    if place.nowhere:
        show(results, [], json_output=json_output, quiet=quiet)
        return
    with status(f"{place.directory}: writing ...", quiet=quiet):
        results, files = written(results, place, figures=figures, figure_format=figure_format)
    show(results, files, json_output=json_output, quiet=quiet)


def written(
    results: Results, place: Place, *, figures: bool, figure_format: str = "png"
) -> tuple[Results, list[Path]]:
    """Write a run to its place; what was written of the results, and the files.

    Raises:
        OutputError: as `write_run`, and `output-is-the-spec`.
    """
    from inputdesign_cli.runs.run_directory import write_run

    results = _spare_the_spec(results, place)
    drawings = {}
    if figures:
        from inputdesign_cli.figures.plots import draw_all

        drawings = draw_all(results, figure_format)
    files = write_run(results, place.directory, drawings, sources=place.sources, overwrite=place.overwrite)
    return results, files


def show(results: Results, files: Sequence[Path], *, json_output: bool, quiet: bool) -> None:
    """Print the result as it was written, if it was, or its summary."""
    if json_output and files:
        typer.echo(files[-1].read_text(encoding="utf-8"), nl=False)
    elif json_output:
        from inputdesign_cli.runs.run_directory import finished_result
        from inputdesign_cli.runs.text_formats import json_text

        typer.echo(json_text(finished_result(results)), nl=False)
    elif not quiet:
        from inputdesign_cli.cli.summary import summary

        typer.echo(summary(results.result, results.time_unit, files))


def _spare_the_spec(results: Results, place: Place) -> Results:
    """The results with the user's own text where the spec is the spec.yaml of the run itself."""
    from inputdesign_cli.runs.record import SPEC
    from inputdesign_cli.specification import same_content
    from inputdesign_cli.specification.yaml.files import read_text

    target = place.directory / SPEC
    spec = place.sources[0]
    if not (target.exists() and spec.exists() and target.samefile(spec)):
        return results
    text = read_text(target)
    if not same_content(text, results.resolved_spec):
        message = (
            f"{target} is the spec itself, and what it includes or --set changes would be written into it"
        )
        hint = "choose another directory with -o, or write the changes into the file"
        raise OutputError.because("output-is-the-spec", message, hint)
    return replace(results, resolved_spec=text)
