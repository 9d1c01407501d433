"""Writes docs/cli.md from the help texts of the commands."""

from __future__ import annotations

import inspect
import re
from collections import Counter
from enum import Enum
from pathlib import Path

import typer

from inputdesign_cli.cli import app

PAGE = Path(__file__).with_name("cli.md")

INTRODUCTION = """\
# The command line

<!-- Written by `make docs` from the help texts: change those, not this page. -->

{help}

Results go to standard output, everything else to standard error. Progress is shown on a terminal only, and
`NO_COLOR` is honoured. Every command has `--help`; `idesign --version` prints the version.

| exit code | when |
|---|---|
| 0 | done |
| 1 | a value differs from its golden value, or a target is missed |
| 2 | the spec, the data or the usage is wrong, or something cannot be written |
| 3 | no experiment can do what is asked |
| 4 | the required accuracy was not proved |
| 5 | undecided: the data contradict the model structure (`assess`, `next`) |
| 70 | an error inside idesign; please report it |
| 130, 143, 129 | interrupted (Ctrl-C), terminated (SIGTERM), the terminal has gone (SIGHUP) |
| 141 | the reader of standard output has gone (`idesign .. \\| head`); nothing is printed then |

## Options of several commands

Sections name two groups: *run options* are {run}; *data options* are {data}.

{shared}
"""

GROUPS = {
    "data options": {
        *("--columns", "--sample-time", "--time-unit", "--resample", "--detrend"),
        *("--skip", "--range", "--without"),
    },
    "run options": {"--overwrite", "--no-output", "--no-figures", "--figure-format", "--json", "--quiet"},
}


def page() -> str:
    """Return the whole page as Markdown."""
    group = typer.main.get_command(app)
    rows = Counter(row for command in group.commands.values() for row in rows_of(command))
    shared = [row for row, count in rows.items() if count > 1]
    named = {word.split()[0]: ", ".join(f"`{one}`" for one in sorted(GROUPS[word])) for word in GROUPS}
    parts = [INTRODUCTION.format(help=group.help, shared="\n".join(listed(shared)), **named)]
    for name, command in group.commands.items():
        parts.append(section(name, command, shared))
    return "\n".join(parts)


def rows_of(command) -> list[tuple[str, str]]:
    """Return the name and the help of every argument and option of a command."""
    shown = [parameter for parameter in command.params if parameter.name != "help"]
    arguments = [(f"`{p.metavar}`", p.help) for p in shown if p.param_type_name == "argument"]
    return arguments + [(option_names(p), p.help) for p in shown if p.param_type_name == "option"]


def section(name, command, shared) -> str:
    """Describe one command: what it does, how it is called, its own arguments and options."""
    rows = rows_of(command)
    own = [row for row in rows if row not in shared]
    options = any(p.param_type_name == "option" for p in command.params if p.name != "help")
    arguments = [p.metavar for p in command.params if p.param_type_name == "argument"]
    usage = " ".join(["idesign", name, *(["[OPTIONS]"] if options else []), *arguments])
    lines = [f"## idesign {name}", "", inspect.cleandoc(command.help), "", f"`{usage}`"]
    if own:
        lines += ["", *listed(own)]
    if len(own) < len(rows):
        names = [left for left, right in rows if (left, right) in shared and "`-" in left]
        also = {re.findall(r"`(-[^`]+)`", left)[-1] for left in names}
        groups = [word for word, options in GROUPS.items() if options <= also]
        grouped = {option for word in groups for option in GROUPS[word]}
        rest = [f"`{option}`" for option in sorted(also - grouped)]
        lines += ["", f"Also {', '.join([*rest, *groups])}."] if also else []
    return "\n".join(lines) + "\n"


def listed(rows) -> list[str]:
    """Return a Markdown list of names and what they mean."""
    return [f"- {left}: {right}" for left, right in rows]


def option_names(option) -> str:
    """The names of an option, and the metavar or the choices of its value."""
    names = ", ".join(f"`{name}`" for name in sorted([*option.opts, *option.secondary_opts], key=len))
    if option.is_flag:
        return names
    if isinstance(option.default, Enum):
        return f"{names} {'|'.join(type(option.default))} (default {option.default})".replace("|", "\\|")
    return f"{names} {option.metavar}" if option.metavar else names


if __name__ == "__main__":
    PAGE.write_text(page(), encoding="utf-8")
