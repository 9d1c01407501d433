"""Arguments and options that several commands share, so that they read the same everywhere."""

from __future__ import annotations

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


SpecFile = Annotated[Path, typer.Argument(metavar="SPEC", help="The experiment to design, a YAML file.")]
DataFile = Annotated[
    Path, typer.Argument(metavar="DATA", help="The record of an experiment: a CSV file with columns u and y.")
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
