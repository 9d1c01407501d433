"""`idesign explain` and `idesign schema`: what codes mean, and what a spec may hold."""

from __future__ import annotations

import json
from typing import Annotated

import typer

from inputdesign_cli.cli.completion import error_codes
from inputdesign_cli.cli.terminal import aligned


def explain(
    code: Annotated[
        str | None,
        typer.Argument(
            metavar="[CODE]",
            help="The code of an error or of a finding; without it, all codes.",
            autocompletion=error_codes,
        ),
    ] = None,
) -> None:
    """Explain the code of an error or of a finding.

    Says what it means and what to do about it.
    """
    from inputdesign_cli.error_codes import explanation
    from inputdesign_cli.findings import explanations

    if code is None:
        known = sorted(explanations().items())
        typer.echo("\n".join(aligned([(name, entry.title) for name, entry in known], wrap=True)))
    else:
        typer.echo(explanation(code, explanations()))


def schema() -> None:
    """Print the JSON schema of a spec.

    Editors use it for completion and for checks while you type.
    """
    typer.echo(schema_text(), nl=False)


def schema_text() -> str:
    """The JSON schema of a spec as the text of a file."""
    from inputdesign_cli.specification import json_schema

    return json.dumps(json_schema(), indent=1, ensure_ascii=False) + "\n"
