"""Arguments and options that several commands share, so that they read the same everywhere.

A parameter of a command whose type is a dataclass of this file stands for an option for each of its fields.
"""

from __future__ import annotations

import os
from collections.abc import Callable
from dataclasses import dataclass, fields, is_dataclass
from functools import wraps
from inspect import Parameter, Signature, signature
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal, get_type_hints

import typer

from inputdesign_cli.cli.completion import spec_keys
from inputdesign_cli.errors import OutputError

if TYPE_CHECKING:
    from inputdesign_cli.compute.executor import Executor


def unfolded(command: Callable[..., None]) -> Callable[..., None]:
    """Return the command with an option for each field of its parameters that are dataclasses."""
    hints = get_type_hints(command, include_extras=True)
    groups = {name: kind for name, kind in hints.items() if is_dataclass(kind)}
    parameters: list[Parameter] = []
    for one in signature(command).parameters.values():
        if one.name not in groups:
            parameters.append(one.replace(annotation=hints[one.name], kind=Parameter.KEYWORD_ONLY))
            continue
        types = get_type_hints(hints[one.name], include_extras=True)
        parameters += [
            one.replace(name=field.name, default=field.default, annotation=types[field.name])
            for field in fields(groups[one.name])
        ]

    @wraps(command)
    def run(**given: object) -> None:
        made = {
            name: hints[name](**{field.name: given.pop(field.name) for field in fields(kind)})
            for name, kind in groups.items()
        }
        command(**given, **made)

    run.__annotations__ = {one.name: one.annotation for one in parameters}
    run.__dict__["__signature__"] = Signature(parameters)
    return run


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


def path_option(text: str) -> Path:
    """Return the path that an option gives; an empty text (of a variable that is not set) is none."""
    if not text.strip():
        raise typer.BadParameter("the name is empty")
    return Path(text)


def run_path(text: str) -> Path:
    """Return the directory that a run is to be written into."""
    path = path_option(text)
    if path.absolute() == Path(path.absolute().anchor) or os.path.realpath(path) == os.path.abspath(os.sep):
        raise typer.BadParameter("the root of the file system is no directory for a run")
    return path


def refuse_existing(file: Path, overwrite: bool, option: str = "--overwrite") -> None:
    """Refuse a file that exists, unless it may be overwritten.

    Raises:
        OutputError: `output-exists`.
    """
    if file.exists() and not overwrite:
        hint = f"choose another name, or overwrite it with {option}"
        raise OutputError.because("output-exists", f"{file} exists already", hint)


Output = Annotated[
    Path | None,
    typer.Option(
        "--output",
        "-o",
        metavar="DIR",
        help="Directory to write. The default is runs/SPEC, runs/SPEC-sweep, or runs/DATA_explored, "
        "_validated, _identified or _assessed.",
        parser=run_path,
    ),
]
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
    Literal["png", "svg", "pdf"], typer.Option(help="The format of the figures; svg and pdf can be scaled.")
]


@dataclass(frozen=True)
class Changes:
    """What is changed in a spec, and which files it may name."""

    overrides: Annotated[
        list[str] | None,
        typer.Option(
            "--set",
            metavar="KEY=VALUE",
            help="Override one entry of the spec, as in spectrum.order=10 (the value is YAML). Repeatable.",
            autocompletion=spec_keys,
        ),
    ] = None
    confine: Confine = None


@dataclass(frozen=True)
class Into:
    """Where a run goes."""

    output: Output = None
    overwrite: Overwrite = False
    no_output: NoOutput = False


@dataclass(frozen=True)
class Shown:
    """What is drawn and printed of a run."""

    figures: Figures = True
    figure_format: FigureFormat = "png"
    json_output: Json = False
    quiet: Quiet = False


@dataclass(frozen=True)
class Workers:
    """Where a command computes: in its own process, in several, or on a cluster."""

    jobs: Annotated[
        int,
        typer.Option("--jobs", "-j", metavar="N", min=0, help="Processes to compute with; 0: one per core."),
    ] = 1
    cluster: Annotated[
        str | None,
        typer.Option(
            "--cluster",
            metavar="ADDRESS",
            help="Compute on the Dask cluster at this address, tcp://HOST:PORT or tls://HOST:PORT. Without "
            "TLS anybody who reaches it can run programs there and here (docs/security.md).",
        ),
    ] = None
    worker_timeout: Annotated[
        float | None,
        typer.Option(
            "--worker-timeout",
            metavar="SECONDS",
            min=0.0,
            help="Give up when the cluster has been without workers for so long; the default is to wait.",
        ),
    ] = None

    def executor(self, *, quiet: bool) -> Executor:
        """Return what computes; an address comes first."""
        from inputdesign_cli.compute.cluster import Cluster
        from inputdesign_cli.compute.executor import InProcess
        from inputdesign_cli.compute.processes import Processes

        if self.cluster is not None:
            tell = (lambda text: None) if quiet else (lambda text: typer.echo(text, err=True))
            return Cluster(self.cluster, worker_timeout=self.worker_timeout, tell=tell)
        cores = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
        count = self.jobs or cores
        return Processes(count) if count > 1 else InProcess()
