"""Arguments and options that several commands share, so that they read the same everywhere."""

from __future__ import annotations

import os
from collections.abc import Sequence
from pathlib import Path
from typing import Annotated, Any

import typer

from inputdesign_cli.cli.completion import spec_keys


def one_of(words: Sequence[str], help_text: str) -> Any:
    """The option that takes one of these words, the first if it is absent."""

    def check(value: str) -> str:
        if value not in words:
            from inputdesign_cli.specification.wording import unknown_word

            message, hint = unknown_word(value, words)
            raise typer.BadParameter("; ".join(filter(None, (message.replace("{key}", "it"), hint))))
        return value

    listed = ", ".join([f"{words[0]} (default)", *words[1:]])
    return typer.Option(
        metavar="WORD",
        callback=check,
        autocompletion=lambda: list(words),
        show_default=False,
        help=f"{help_text}: {listed}.",
    )


SpecFile = Annotated[
    Path, typer.Argument(metavar="SPEC", help="The experiment to design, a YAML file; - is standard input.")
]
Confine = Annotated[
    Path | None,
    typer.Option(
        metavar="DIR",
        exists=True,
        file_okay=False,
        help="Refuse a spec that names files outside DIR (links followed).",
    ),
]
DataFiles = Annotated[
    list[Path],
    typer.Argument(
        metavar="DATA...",
        help="Records of experiments with columns u and y, estimated jointly: CSV, TSV, .mat, .npz, and with "
        "the extra data parquet and Excel.",
    ),
]
OperatingPoint = Annotated[
    str,
    typer.Option(
        "--operating-point",
        metavar="u1=..,y1=..",
        help="What channels vary about, such as u1=40,y1=52.3; it is subtracted. For inputs the default is "
        "signal.offset.",
    ),
]
Means = Annotated[
    bool, typer.Option("--remove-means", help="Take the means of u and y away (an operating point).")
]
Columns = Annotated[
    str,
    typer.Option(
        "--columns",
        metavar="u1=..,y1=..",
        help="Which column holds which channel, by name or number: u1=Heater 1,y1=4,time=1.",
    ),
]
SampleTime = Annotated[
    float | None,
    typer.Option("--sample-time", metavar="T", help="Time between rows, where the file does not tell it."),
]
TimeUnit = Annotated[
    str | None,
    typer.Option("--time-unit", metavar="UNIT", help="Of the times in the file: s, ms, us, min, h or d."),
]
Resample = Annotated[
    bool,
    typer.Option(
        "--resample",
        help="Even out times that jitter by more than 10 % of the sample time, too; join columns that were "
        "written at different times.",
    ),
]
DetrendWord = Annotated[
    str,
    one_of(("none", "constant", "linear", "auto"), "What to take away from every signal, segment by segment"),
]
StructureWord = Annotated[
    str,
    one_of(
        ("any", "fopdt", "sopdt", "integrator", "arx", "armax", "oe", "bj"),
        "The structure of the model (fopdt: a lag with dead time)",
    ),
]
Skip = Annotated[
    int, typer.Option("--skip", metavar="N", min=0, help="Leave out the first N rows of data of every file.")
]
Span = Annotated[
    str, typer.Option("--range", metavar="FROM:TO", help="Keep rows whose times lie between these two.")
]
Without = Annotated[
    list[str] | None,
    typer.Option(
        "--without",
        metavar="ROWS",
        help="Leave out these rows, as notes number them, such as 183-240,310; the record is cut there. Of "
        "several files: log1.csv:183-240. Repeatable.",
    ),
]
Overrides = Annotated[
    list[str] | None,
    typer.Option(
        "--set",
        metavar="KEY=VALUE",
        help="Override one entry of the spec, such as spectrum.order=10 (the value is YAML). Repeatable.",
        autocompletion=spec_keys,
    ),
]


def path_option(text: str) -> Path:
    """The path that an option gives; an empty text (of a variable that is not set) is none."""
    if not text.strip():
        raise typer.BadParameter("the name is empty")
    return Path(text)


def run_path(text: str) -> Path:
    """The directory that a run is to be written into."""
    path = path_option(text)
    if path.absolute() == Path(path.absolute().anchor) or os.path.realpath(path) == os.path.abspath(os.sep):
        raise typer.BadParameter("the root of the file system is no directory for a run")
    return path


def _into(default: str) -> Any:
    told = f"Directory to write. The default is {default}."
    return typer.Option("--output", "-o", metavar="DIR", help=told, parser=run_path)


Output = Annotated[Path | None, _into("runs/SPEC, without the ending of the file")]
EstimateOutput = Annotated[Path | None, _into("runs/DATA_identified, without the ending of the file")]
ExplorationOutput = Annotated[
    Path | None, _into("runs/DATA_explored, or runs/DATA_validated, without the ending of the file")
]
VerdictOutput = Annotated[Path | None, _into("runs/DATA_assessed, without the ending of the file")]
SweepOutput = Annotated[Path | None, _into("runs/SPEC-sweep, without the ending of the file")]
NoOutput = Annotated[
    bool, typer.Option("--no-output", help="Write no files; print the summary, or the result with --json.")
]
Overwrite = Annotated[
    bool,
    typer.Option("--overwrite", help="Replace a run of another spec, or one whose spec.yaml was changed."),
]
Json = Annotated[
    bool, typer.Option("--json", help="Print the result as JSON on standard output, and nothing else.")
]
Quiet = Annotated[bool, typer.Option("--quiet", "-q", help="Print errors only.")]
KeepPartial = Annotated[
    bool,
    typer.Option(
        "--keep-partial",
        help="After Ctrl-C or SIGTERM write the best design so far, as after solver.time_limit; a second one "
        "ends at once.",
    ),
]
Fast = Annotated[
    bool,
    typer.Option(
        "--fast",
        help="Leave out the bound over every spectrum, which may take as long as the design, and the search "
        "for other dead times that fit as well (solver.any_spectrum: false).",
    ),
]
Figures = Annotated[
    bool, typer.Option("--figures/--no-figures", help="Draw the figures of the run, or leave them out.")
]
FigureFormat = Annotated[
    str, one_of(("png", "svg", "pdf"), "The format of the figures; svg and pdf can be scaled")
]
