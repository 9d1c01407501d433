"""The command line: thin files that hold a command or its kind, and the only room that prints.

Nothing heavy is imported here or at the top of a command's file: `idesign --help` answers at once.
"""

from __future__ import annotations

import os
from typing import Annotated

import typer

from inputdesign_cli.cli.data import assess, campaign, explore, identify, proceed, status
from inputdesign_cli.cli.designs import analyse, simulate, solve, validate
from inputdesign_cli.cli.options import declared
from inputdesign_cli.cli.reference import check, examples, explain, init, schema
from inputdesign_cli.cli.signal import signal
from inputdesign_cli.cli.sweep import sweep
from inputdesign_cli.cli.terminal import guarded, prepare_signals, prepare_streams
from inputdesign_cli.cli.watch import report, watch
from inputdesign_cli.cli.wizard import wizard
from inputdesign_cli.compute.executor import ONE_THREAD
from inputdesign_cli.version import __version__

app = typer.Typer(
    name="idesign",
    help="Optimal experiments for system identification: from a YAML file to a signal and a proof.",
    epilog="Exit codes: 0 done, 1 a golden mismatch or a missed target, 2 bad input or usage, "
    "3 infeasible, 4 the required accuracy was not proved, 5 undecided (the data contradict the model or "
    "leave it open), 70 an internal error, 129 the terminal has gone, 130 interrupted, 141 the reader of the "
    "output has gone, 143 terminated.",
    no_args_is_help=True,
    add_completion=True,
    rich_markup_mode=None,
    pretty_exceptions_enable=False,
    context_settings={"help_option_names": ["-h", "--help"]},
)


def _show_version(wanted: bool) -> None:
    if wanted:
        typer.echo(f"idesign {__version__}")
        raise typer.Exit


@app.callback()
def _start(
    version: Annotated[
        bool,
        typer.Option("--version", help="Print the version and exit.", callback=_show_version, is_eager=True),
    ] = False,
) -> None:
    pass


COMMANDS = (
    solve,
    analyse,
    simulate,
    explore,
    identify,
    assess,
    campaign,
    proceed,
    status,
    sweep,
    report,
    watch,
    validate,
    check,
    signal,
    examples,
    init,
    wizard,
    explain,
    schema,
)
# A function called `next` would hide the built-in one.
_NAMES = {"proceed": "next"}
for command in COMMANDS:
    name = _NAMES.get(command.__name__, command.__name__)
    app.command(name)(guarded(declared(command, name)))


def main() -> None:
    """Run the `idesign` command."""
    prepare_streams()
    prepare_signals()
    for name, value in ONE_THREAD.items():  # numpy, which reads them, has not been imported yet
        os.environ.setdefault(name, value)
    app(prog_name="idesign")
