"""Writes docs/cli.md from the help texts of the commands."""

from __future__ import annotations

import inspect
import re
from collections import Counter
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
| 5 | undecided: the data contradict the model or leave it open (`assess`, `next`) |
| 70 | an error inside idesign; please report it |
| 130, 143, 129 | interrupted (Ctrl-C), terminated (SIGTERM), the terminal has gone (SIGHUP) |
| 141 | the reader of standard output has gone (`idesign .. \\| head`); nothing is printed then |

## Options of several commands
"""


def page() -> str:
    """Return the whole page as Markdown."""
    group = typer.main.get_command(app)
    commands = {name: rows_of(command) for name, command in group.commands.items()}
    counted = Counter(row for rows in commands.values() for row in rows)
    run = [row for row in commands["solve"] if row in commands["explore"]]
    data = [row for row in commands["explore"] if row in commands["assess"] and row not in run]
    others = [row for row, count in counted.items() if count > 1 and row not in run + data]
    groups = {"Run options": run, "Data options": data, "Other options": others}
    parts = [INTRODUCTION.format(help=group.help)]
    parts += [f"### {title}\n\n{listed(rows)}" for title, rows in groups.items()]
    parts += [section(name, command, groups) for name, command in group.commands.items()]
    return "\n".join(parts)


def rows_of(command) -> list[tuple[str, str]]:
    """Return the name and the help of every argument and option of a command."""
    shown = [parameter for parameter in command.params if parameter.name != "help"]
    arguments = [(f"`{p.metavar}`", p.help) for p in shown if p.param_type_name == "argument"]
    return arguments + [(option_names(p, command), p.help) for p in shown if p.param_type_name == "option"]


def section(name, command, groups) -> str:
    """Describe one command: what it does, its own arguments and options, and the common ones."""
    rows = rows_of(command)
    arguments = [p.metavar for p in command.params if p.param_type_name == "argument"]
    own = [row for row in rows if not any(row in group for group in groups.values())]
    whole = [title for title, group in groups.items() if all(row in rows for row in group)]
    single = [row for title, group in groups.items() if title not in whole for row in group if row in rows]
    also = [re.findall(r"`-[^`]+`", left)[-1] for left, _ in single if "`-" in left]
    also += [title.lower() for title in whole]
    lines = ["## " + " ".join(["idesign", name, *arguments]), "", inspect.cleandoc(command.help), ""]
    lines += [listed(own)] if own else []
    lines += [f"Also {', '.join(also)}.\n"] if also else []
    return "\n".join(lines)


def listed(rows) -> str:
    """Return a Markdown list of names and what they mean."""
    return "".join(f"- {left}: {right}\n" for left, right in rows)


def option_names(option, command) -> str:
    """The names of an option, and the metavar or the choices of its value."""
    names = ", ".join(f"`{name}`" for name in sorted([*option.opts, *option.secondary_opts], key=len))
    if option.is_flag:
        return names
    choices = option.display_type(typer.Context(command)).strip("<>")
    if "|" in choices and not option.metavar:
        return f"{names} {choices}{f' (default {option.default})' if option.default else ''}"
    return f"{names} {option.metavar}" if option.metavar else names


if __name__ == "__main__":
    PAGE.write_text(page(), encoding="utf-8")
