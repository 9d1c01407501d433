"""The beginning and the end of a run: its spec, its place, and its summary."""

from __future__ import annotations

import sys
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING

import typer

from inputdesign_cli.cli.options import Changes, Into, Shown
from inputdesign_cli.cli.terminal import status
from inputdesign_cli.errors import STANDARD_STREAM, OutputError, bad_spec
from inputdesign_cli.regular_file import read_regular

if TYPE_CHECKING:
    from inputdesign_cli.outcome.results import Results
    from inputdesign_cli.outcome.run_directory import Origin
    from inputdesign_cli.specification import Spec
    from inputdesign_cli.specification.models.realisation import Figures


def read_spec(file: Path, changes: Changes, *, design: bool | None = True) -> Spec:
    """Return the spec in a file; in standard input (`-`) names are relative to the current folder.

    Args:
        design: whether the spec must ask for a design. None: only a spec that states a part of one must.

    Raises:
        SpecError: as `load_spec`.
    """
    import inputdesign_cli.specification as specification

    overrides, confine = changes.overrides or (), changes.confine
    if str(file) != STANDARD_STREAM:
        return specification.load_spec(file, overrides, confine=confine, design=design)
    return specification.parse_spec(standard_input(), "<stdin>", overrides, confine=confine, design=design)


def standard_input() -> str:
    """Return the text of a spec on standard input.

    Raises:
        SpecError: it is closed, too large, or no text.
    """
    from inputdesign_cli.specification.yaml.files import MAX_BYTES, decode

    if sys.stdin is None:
        raise bad_spec("file-unreadable", "standard input is closed", hint="name a file")
    raw = sys.stdin.buffer.read(MAX_BYTES + 1)
    if len(raw) > MAX_BYTES:
        raise bad_spec("file-too-large", f"the spec is larger than {MAX_BYTES // 2**20} MiB")
    return decode(raw, "<stdin>")


def name_of(file: Path) -> str:
    """Return the name of a spec for use in names of directories."""
    return "stdin" if str(file) == STANDARD_STREAM else file.stem


# Errors that protect the content of a place: a `numbered` run takes another place.
_PROTECTED = {
    *("output-other-run", "output-is-the-spec", "output-spec-changed"),
    *("output-signal-changed", "campaign-exists"),
}


@dataclass(frozen=True)
class Place:
    """Holds the place of a run, by default runs/`name`, and the files it is made from, the spec first.

    A run without files continues the one in the directory. Where the default place of one that is
    `numbered` holds a run of something else, it takes the first of runs/`name`_2, .. that does not.
    """

    into: Into
    name: str = ""
    sources: Sequence[Path] = ()
    judges: bool = False  # the run has a verdict
    numbered: bool = False
    asked: str = ""  # the spec as it was read
    figures: Figures | None = None  # their form, if the spec has one
    relocates: bool = True  # whether names of files in the spec become relative to the run directory

    def __post_init__(self) -> None:
        if self.into.no_output and self.into.output is not None:
            raise typer.BadParameter("--no-output writes nothing, and --output says where")

    @property
    def directory(self) -> Path:
        """Return the run directory."""
        return self.into.output or Path("runs") / self.name

    @property
    def origin(self) -> Origin | None:
        """Return the origin of the run: its files and the text of its spec."""
        from inputdesign_cli.outcome.run_directory import Origin

        judged = self.judges
        return Origin(self.sources, self.asked, self.into.overwrite, judged) if self.sources else None

    def checked(self, spec: Spec | None) -> Place:
        """Return the place for the run of a spec that was read, before anything is computed.

        Raises:
            OutputError: the directory cannot take the run, see `check_place`, and `output-is-the-spec`.
        """
        place = self if spec is None else replace(self, asked=spec.to_yaml(), figures=spec.figures)
        if place.origin is None or place.into.no_output:
            return place
        from inputdesign_cli.outcome.run_directory import check_place

        free = self.numbered and self.into.output is None
        number = 1
        while True:
            try:
                check_place(place.directory, place.origin, place.spared(place.asked))
                return place
            except OutputError as error:
                if not free or error.diagnostics[0].code not in _PROTECTED:
                    raise
            number += 1
            place = replace(place, name=f"{self.name}_{number}")

    def spared(self, spec: str) -> str:
        """Return the `spec.yaml` of the run: the user's own text where it is the spec itself.

        Otherwise names of files in it become relative to the directory of the run.

        Args:
            spec: the text of the run otherwise.

        Raises:
            OutputError: `output-is-the-spec`, its content would change.
        """
        from inputdesign_cli.outcome.run_files import SPEC
        from inputdesign_cli.specification import relocated, same_content
        from inputdesign_cli.specification.yaml.files import read_text

        target = self.directory / SPEC
        if not any(target.exists() and one.exists() and target.samefile(one) for one in self.sources[:1]):
            if not (self.relocates and self.sources):
                return spec
            stated = self.sources[0]
            here = Path() if str(stated) == STANDARD_STREAM else stated.parent
            return relocated(spec, here, self.directory)
        text = read_text(target)
        if not same_content(text, spec):
            message = (
                f"{target} is the spec itself, and what it includes or --set changes would be written into it"
            )
            hint = "choose another directory with -o, or write the changes into the file"
            raise OutputError.because("output-is-the-spec", message, hint)
        return text


def keep(results: Results, place: Place, shown: Shown, *, page: bool = False) -> None:
    """Write a run to its place, and print its result or its summary.

    Args:
        page: whether the page about it is written as well.

    Raises:
        OutputError: as `write_run`, and `output-is-the-spec`.
    """
    if place.into.no_output:
        _show(results, [], shown)
        return
    results, directory = replace(results, resolved_spec=place.spared(results.resolved_spec)), place.directory
    with status(f"{directory}: writing ...", quiet=shown.quiet):
        from inputdesign_cli.outcome.run_directory import has_other_values, replace_text, write_run

        drawings = {}
        if shown.figures:
            from inputdesign_cli.figures.plots import draw_all
            from inputdesign_cli.specification.models.realisation import Figures

            form = place.figures or Figures()
            drawings = draw_all(results, shown.figure_format or form.format, form.width)
        replaced = has_other_values(directory, results.resolved_spec)
        files = write_run(results, directory, drawings, origin=place.origin)
        if page:
            from inputdesign_cli.outcome.run_files import PAGE
            from inputdesign_cli.report.render import report_text

            replace_text(directory / PAGE, report_text(directory))
            files = [directory / PAGE, *files]
    _show(results, files, shown, replaced=replaced)


def _show(results: Results, files: Sequence[Path], shown: Shown, *, replaced: bool = False) -> None:
    """Print the result as it was written, if it was, or its summary; `replaced` is as in `summary`."""
    if shown.json_output and files:
        typer.echo(read_regular(files[-1]).decode(), nl=False)
    elif shown.json_output:
        from inputdesign_cli.outcome.codec import json_text
        from inputdesign_cli.outcome.run_directory import finished_result

        typer.echo(json_text(finished_result(results)), nl=False)
    elif not shown.quiet:
        from inputdesign_cli.cli.summary import summary

        typer.echo(summary(results.outcome, results.time_unit, files, replaced=replaced))
