"""Arguments and options that several commands share, so that they read the same everywhere."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from inputdesign_cli.cli.completion import spec_keys

SpecFile = Annotated[Path, typer.Argument(metavar="SPEC", help="The experiment to design, a YAML file.")]
DataFiles = Annotated[
    list[Path],
    typer.Argument(
        metavar="DATA...", help="Records of experiments, CSV files with columns u and y, estimated jointly."
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
Overrides = Annotated[
    list[str] | None,
    typer.Option(
        "--set",
        metavar="KEY=VALUE",
        help="Override one entry of the spec, such as spectrum.order=10 (the value is YAML). Repeatable.",
        autocompletion=spec_keys,
    ),
]
Output = Annotated[
    Path | None,
    typer.Option(
        "--output",
        "-o",
        metavar="DIR",
        help="Directory of the run. The default is runs/ and the name of the spec.",
    ),
]
Json = Annotated[
    bool, typer.Option("--json", help="Print the result as JSON on standard output, and nothing else.")
]
Quiet = Annotated[bool, typer.Option("--quiet", "-q", help="Print errors only.")]
Figures = Annotated[
    bool, typer.Option("--figures/--no-figures", help="Draw the figures of the run, or leave them out.")
]
