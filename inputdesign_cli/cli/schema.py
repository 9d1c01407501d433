"""`idesign schema`."""

from __future__ import annotations

import json

import typer


def schema() -> None:
    """Print the JSON schema of a spec.

    Editors use it for completion and for checks while you type.
    """
    from inputdesign_cli.specification import json_schema

    typer.echo(json.dumps(json_schema(), indent=1, ensure_ascii=False))
