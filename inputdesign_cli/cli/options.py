"""Arguments and options that several commands share, so that they read the same everywhere.

`options.toml` declares them: the ones that commands share, and the ones of single commands and groups.
"""

from __future__ import annotations

import os
import tomllib
from collections.abc import Callable, Iterator
from dataclasses import dataclass, fields, is_dataclass, replace
from functools import wraps
from importlib import resources
from inspect import Parameter, Signature, signature
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal, get_type_hints

import typer

from inputdesign_cli.errors import OutputError

if TYPE_CHECKING:
    from _typeshed import DataclassInstance

    from inputdesign_cli.compute.executor import Executor

TABLE: dict[str, dict[str, dict[str, Any]]] = tomllib.loads(
    (resources.files(__package__) / "options.toml").read_text(encoding="utf-8")
)
TRADED = ("samples", "amplitude")


def declared(command: Callable[..., None], name: str) -> Callable[..., None]:
    """Return the command with an argument or an option for each of its parameters, see `options.toml`.

    A parameter whose type is a dataclass stands for an option for each of its fields. Parameters that take
    positions are arguments of the command line.
    """
    hints = get_type_hints(command)
    groups = {one: kind for one, kind in hints.items() if isinstance(kind, type) and is_dataclass(kind)}
    parameters: list[Parameter] = []
    for one in signature(command).parameters.values():
        if one.name not in groups:
            is_argument = one.kind is Parameter.POSITIONAL_OR_KEYWORD
            parameters.append(_declared(one, hints[one.name], name, is_argument=is_argument))
            continue
        kind, types = groups[one.name], get_type_hints(groups[one.name])
        for field in fields(kind):
            stated = one.replace(name=field.name, default=field.default)
            parameters.append(_declared(stated, types[field.name], _owner(kind, field.name)))

    @wraps(command)
    def run(**given: object) -> None:
        made = {
            one: hints[one](**{field.name: given.pop(field.name) for field in fields(kind)})
            for one, kind in groups.items()
        }
        command(**given, **made)

    run.__annotations__ = {one.name: one.annotation for one in parameters}
    run.__dict__["__signature__"] = Signature(parameters)
    return run


def _owner(kind: type, name: str) -> str:
    """Return the section of `options.toml` that declares a field of a dataclass."""
    return next((c.__name__ for c in kind.__mro__ if name in TABLE.get(c.__name__, ())), "shared")


def typed(*groups: DataclassInstance) -> list[str]:
    """Return the words of a command line that give these options again, except options at their defaults.

    Args:
        groups: dataclasses of options, as a command takes them.
    """
    words: list[str] = []
    for group in groups:
        for field in fields(group):
            given = getattr(group, field.name)
            if given == field.default:
                continue
            stated = TABLE[_owner(type(group), field.name)][field.name]
            name, _, off = stated.get("names", [f"--{field.name.replace('_', '-')}"])[0].partition("/")
            switch = field.type == "bool"
            values = given if isinstance(given, list) else [given]
            words += [name if given else off] if switch else [w for one in values for w in (name, str(one))]
    return words


def _declared(one: Parameter, kind: type, owner: str, *, is_argument: bool = False) -> Parameter:
    """Return a parameter with its declaration for typer."""
    stated = dict(TABLE.get(owner, {}).get(one.name) or TABLE["shared"][one.name])
    names = stated.pop("names", ())
    for key in ("parser", "autocompletion", "callback"):
        if key in stated:
            stated[key] = _CALLS[stated[key]]
    default = ... if one.default is Parameter.empty else one.default
    made = typer.Argument(default, **stated) if is_argument else typer.Option(default, *names, **stated)
    return one.replace(annotation=kind, default=made, kind=Parameter.KEYWORD_ONLY)


def path_option(text: str) -> Path:
    """Return the path that an option gives; refuse an empty text, as of a variable that is not set."""
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


def _trade_words(text: str | None) -> str | None:
    for word in () if text is None else text.split(","):
        if word not in TRADED:
            raise typer.BadParameter(f'"{word}" is neither samples nor amplitude')
    return text


def error_codes(incomplete: str) -> list[tuple[str, str]]:
    """Return the codes that `idesign explain` knows, with their titles."""
    from inputdesign_cli.findings import explanations

    known = sorted(explanations().items())
    return [(code, entry.title) for code, entry in known if code.startswith(incomplete)]


def spec_keys(incomplete: str) -> list[str]:
    """Return the keys of a spec that `--set` takes, or, after an equals sign, the words that a key takes."""
    from inputdesign_cli.specification import json_schema

    schema = json_schema()
    found = dict.fromkeys(_completions(schema, schema, ""))
    return [
        text
        for text in found
        if text.startswith(incomplete) and text.endswith("=") == ("=" not in incomplete)
    ]


def _completions(node: dict[str, Any], root: dict[str, Any], path: str) -> Iterator[str]:
    """Yield `KEY=` for all keys that hold values, not into lists, and `KEY=WORD` for each text they take."""
    if "$ref" in node:
        yield from _completions(root["$defs"][node["$ref"].rpartition("/")[2]], root, path)
    for alternative in (*node.get("anyOf", ()), *node.get("oneOf", ())):
        yield from _completions(alternative, root, path)
    words = ["true", "false"] if node.get("type") == "boolean" else [*node.get("enum", ()), node.get("const")]
    yield from (f"{path}={word}" for word in words if isinstance(word, str))
    for key, below in node.get("properties", {}).items():
        name = f"{path}.{key}" if path else key
        if name != "sweep":
            yield f"{name}="
            yield from _completions(below, root, name)


_CALLS: dict[str, Callable[..., object]] = {
    "path": path_option,
    "run": run_path,
    "error_codes": error_codes,
    "spec_keys": spec_keys,
    "trade_words": _trade_words,
}


@dataclass(frozen=True)
class Changes:
    """Holds the changes of a spec, and the files that it may name."""

    overrides: list[str] | None = None
    confine: Path | None = None

    def faster(self, fast: bool) -> Changes:
        """Return the changes, without the bound over every spectrum if the run is to be fast."""
        more = ["solver.any_spectrum=false"] * fast
        return replace(self, overrides=[*(self.overrides or []), *more])


@dataclass(frozen=True)
class Into:
    """Holds the place of a run."""

    output: Path | None = None
    overwrite: bool = False
    no_output: bool = False


@dataclass(frozen=True)
class Shown:
    """Holds options on the figures and the printed output of a run."""

    figures: bool = True
    figure_format: Literal["png", "svg", "pdf"] | None = None
    json_output: bool = False
    quiet: bool = False


@dataclass(frozen=True)
class Workers:
    """Describes where a command computes: in its own process, in several, or on a cluster."""

    jobs: int = 1
    cluster: str | None = None
    worker_timeout: float | None = None

    def executor(self, *, quiet: bool) -> Executor:
        """Return the executor: a cluster if an address is given, else one or more processes here."""
        from inputdesign_cli.compute.cluster import Cluster
        from inputdesign_cli.compute.executor import InProcess
        from inputdesign_cli.compute.processes import Processes

        if self.cluster is not None:
            say = (lambda text: None) if quiet else (lambda text: typer.echo(text, err=True))
            return Cluster(self.cluster, worker_timeout=self.worker_timeout, say=say)
        cores = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
        count = self.jobs or cores
        return Processes(count) if count > 1 else InProcess()
