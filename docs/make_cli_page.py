"""Writes docs/cli.md from the help texts of the commands."""

from __future__ import annotations

import inspect
from enum import Enum
from pathlib import Path

import typer

from inputdesign_cli.cli import app

PAGE = Path(__file__).with_name("cli.md")

INTRODUCTION = """\
# The command line

<!-- Written by `make docs` from the help texts: change those, not this page. -->

{help}

Data go to standard output, everything else to standard error; progress is shown on a terminal only, and
`NO_COLOR` is honoured. Every command explains itself with `--help`, and `idesign --version` prints the
version. A command exits with

| code | when |
|---|---|
| 0 | done |
| 1 | a value differs from its golden value, or a target is missed |
| 2 | the spec, the data or the usage is wrong, or something cannot be written |
| 3 | no experiment can do what is asked |
| 4 | the required accuracy was not proved |
| 5 | undecided: the data contradict the model structure (`assess`, `next`) |
| 70 | an error inside idesign; please report it |
| 130, 143, 129 | interrupted (Ctrl-C), terminated (SIGTERM), the terminal has gone (SIGHUP) |
| 141 | the reader of standard output has gone (`idesign .. \\| head`); nothing is said then |
"""


def page() -> str:
    """The whole page as Markdown."""
    group = typer.main.get_command(app)
    parts = [INTRODUCTION.format(help=group.help)]
    for name, command in group.commands.items():
        parts.append(section(name, command))
    return "\n".join(parts)


def section(name, command) -> str:
    """One command: what it does, how it is called, its arguments and options."""
    shown = [parameter for parameter in command.params if parameter.name != "help"]
    arguments = [p for p in shown if p.param_type_name == "argument"]
    options = [p for p in shown if p.param_type_name == "option"]
    usage = " ".join(["idesign", name, *(["[OPTIONS]"] if options else []), *(a.metavar for a in arguments)])
    rows = [(f"`{a.metavar}`", a.help) for a in arguments] + [(option_names(o), o.help) for o in options]
    lines = [f"## idesign {name}", "", inspect.cleandoc(command.help), "", "```", usage, "```"]
    if rows:
        lines += ["", "| | |", "|---|---|", *(f"| {left} | {right} |" for left, right in rows)]
    return "\n".join(lines) + "\n"


def option_names(option) -> str:
    """The names of an option, and the metavar or the choices of its value."""
    names = ", ".join(f"`{name}`" for name in sorted([*option.opts, *option.secondary_opts], key=len))
    if option.is_flag:
        return names
    if isinstance(option.default, Enum):
        return f"{names} {'|'.join(type(option.default))} (default {option.default})".replace("|", "\\|")
    return f"{names} {option.metavar}"


if __name__ == "__main__":
    PAGE.write_text(page(), encoding="utf-8")
