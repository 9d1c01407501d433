"""`idesign explain`."""

from __future__ import annotations

from typing import Annotated

import typer

from inputdesign_cli.cli.completion import error_codes
from inputdesign_cli.cli.terminal import aligned


def explain(
    code: Annotated[
        str | None,
        typer.Argument(
            metavar="[CODE]", help="The code of an error; without it, all codes.", autocompletion=error_codes
        ),
    ] = None,
) -> None:
    """Explain an error code.

    Says what it means and what to do about it.
    """
    from inputdesign_cli.error_codes import explanation, explanations

    if code is None:
        known = sorted(explanations().items())
        typer.echo("\n".join(aligned([(name, entry.title) for name, entry in known], wrap=True)))
    else:
        typer.echo(explanation(code))
