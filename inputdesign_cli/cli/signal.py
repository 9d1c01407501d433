"""`idesign signal`: ready-made signals, what they excite, and files for hardware."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from inputdesign_cli.cli.options import Json, Quiet, path_option
from inputdesign_cli.cli.terminal import aligned
from inputdesign_cli.errors import OutputError
from inputdesign_cli.plugins import names

if TYPE_CHECKING:
    from inputdesign_cli.outcome.results import Results

_ENDINGS = ("csv", "mat", "npz", "h", "png")
_ROUNDING = 1e-12
# Beyond these sizes squares and their sums leave double precision.
_SMALLEST, _LARGEST = 1e-15, 1e15
_TIME_UNITS = ("s", "ms", "us", "min", "h", "d")


@dataclass(frozen=True)
class Kinds:
    """The kinds of signals, of which one is made."""

    prbs: Annotated[
        int | None,
        typer.Option(
            "--prbs", metavar="BITS", min=2, max=32, help="Pseudo-random binary: period 2^BITS - 1 values."
        ),
    ] = None
    multisine: Annotated[
        int | None,
        typer.Option(
            "--multisine", metavar="LINES", min=1, help="Equal sinusoids in --band, of a low crest factor."
        ),
    ] = None
    chirp: Annotated[
        str,
        typer.Option("--chirp", metavar="LOW:HIGH", help="A sinusoid whose frequency rises over the band."),
    ] = ""
    steps: Annotated[
        int | None,
        typer.Option("--steps", metavar="N", min=2, help="N levels over the range, in random order."),
    ] = None

    kind: Annotated[
        str, typer.Option("--kind", metavar="NAME", help="A kind that another package adds, in --band.")
    ] = ""

    def chosen(self) -> str:
        """Return the kind that is asked for.

        Raises:
            typer.BadParameter: There is none, or more than one.
        """
        kinds = {name: value for name, value in vars(self).items() if value not in (None, "")}
        if len(kinds) != 1:
            said = " and ".join(f"--{name}" for name in kinds) or "none of them"
            raise typer.BadParameter(f"give one of --prbs, --multisine, --chirp and --steps, not {said}")
        if self.kind and self.kind not in names("idesign.signals"):
            message = f"no package adds a kind {self.kind!r}"
            raise typer.BadParameter(message, param_hint="--kind")
        return self.kind or next(iter(kinds))


@dataclass(frozen=True)
class Form:
    """How long a signal is, how far it reaches, and what holds for some kinds only."""

    samples: Annotated[
        int | None, typer.Option(min=3, help="Length. The default is one period of a prbs, or 1000.")
    ] = None
    span: Annotated[
        str,
        typer.Option("--range", metavar="LOW:HIGH", help="Least and largest value; several inputs: 0:5,2:3."),
    ] = "-1:1"
    inputs: Annotated[int, typer.Option(min=1, max=20, help="Channels with signals of their own.")] = 1
    band: Annotated[
        str, typer.Option(metavar="LOW:HIGH", help="Of a multisine, in rad per time unit (default: all).")
    ] = ""
    odd: Annotated[bool, typer.Option("--odd", help="Of a multisine, odd harmonics only.")] = False
    hold: Annotated[int, typer.Option(min=1, help="Samples for which each value of a prbs stands.")] = 1
    periods: Annotated[int, typer.Option(min=1, help="Equal periods of a multisine in the record.")] = 1
    seed: Annotated[int, typer.Option(min=0, help="Of the random numbers.")] = 0
    sample_time: Annotated[float, typer.Option(metavar="T", help="Time between samples.")] = 1.0
    time_unit: Annotated[str, typer.Option(metavar="UNIT", help="s, ms, us, min, h or d.")] = "s"

    def check(self, kind: str) -> None:
        """Check that every option means something to this kind.

        Raises:
            typer.BadParameter: An option does not, or cannot be used.
        """
        others = {"--band": (bool(self.band), "multisine"), "--odd": (self.odd, "multisine")}
        others |= {"--periods": (self.periods > 1, "multisine"), "--hold": (self.hold > 1, "prbs")}
        for option, (stated, owner) in others.items():
            if stated and kind != owner and kind not in names("idesign.signals"):
                message = f"it is of --{owner}, and does nothing to --{kind}: leave it out"
                raise typer.BadParameter(message, param_hint=option)
        if not _SMALLEST <= self.sample_time <= _LARGEST:
            message = f"it is a positive number, from {_SMALLEST:g} to {_LARGEST:g}"
            raise typer.BadParameter(message, param_hint="--sample-time")
        if self.time_unit not in _TIME_UNITS:
            raise typer.BadParameter(f"it is one of {', '.join(_TIME_UNITS)}", param_hint="--time-unit")


def signal(
    *,
    kinds: Kinds,
    form: Form,
    output: Annotated[
        list[str] | None,
        typer.Option(
            "--output",
            "-o",
            metavar="FILE",
            help="Repeatable. The ending names the kind: .csv, .mat (MATLAB), .npz (numpy), .h (C), .png.",
        ),
    ] = None,
    overwrite: Annotated[bool, typer.Option("--overwrite", help="Replace files that exist.")] = False,
    json_output: Json = False,
    quiet: Quiet = False,
) -> None:
    """Make a signal without a spec, and show what it excites.

    Give one of --prbs, --multisine, --chirp and --steps. Prints the peak, the crest factor, the order of
    persistent excitation and the band of each channel; -o writes the samples, a C header for hardware among
    the kinds. With several inputs a prbs is shifted, a multisine has a period for each input.
    """
    kind = kinds.chosen()
    files = _files(output or [], overwrite)
    form.check(kind)
    from inputdesign_cli.questions.ready_made import ReadyMade, make_signal

    band, option = (kinds.chirp, "--chirp") if kinds.chirp else (form.band, "--band")
    results = make_signal(
        ReadyMade(
            kind,
            bits=kinds.prbs,
            number=kinds.multisine or kinds.steps,
            band=_pair(band, option) if band else None,
            samples=form.samples,
            levels=_levels(form.span, form.inputs),
            hold=form.hold,
            periods=form.periods,
            odd=form.odd,
            seed=form.seed,
            sample_time=form.sample_time,
            time_unit=form.time_unit,
        )
    )
    for file in files:
        _write(file, results)
    if json_output:
        from inputdesign_cli.outcome.text_formats import json_text

        typer.echo(json_text(results.result), nl=False)
    elif not quiet:
        typer.echo(_summary(results, files))


def _files(names: Sequence[str], overwrite: bool) -> list[Path]:
    """Return where to write; every name is checked before anything is computed.

    Raises:
        typer.BadParameter: An ending that stands for no kind of file.
        OutputError: `output-exists`.
    """
    files = [path_option(name) for name in names]
    for file in files:
        if file.suffix.removeprefix(".").lower() not in _ENDINGS:
            listed = ", ".join(f".{ending}" for ending in _ENDINGS)
            raise typer.BadParameter(f"{file.name} ends with none of {listed}", param_hint="--output")
        if file.exists() and not overwrite:
            hint = "choose another name, or replace it with --overwrite"
            raise OutputError.because("output-exists", f"{file} exists already", hint)
    return files


def _pair(text: str, option: str) -> tuple[float, float]:
    """Return two numbers, the second larger.

    Raises:
        typer.BadParameter: The text is something else.
    """
    from inputdesign_cli.specification.yaml.scalars import plain_number

    low, colon, high = text.partition(":")
    try:
        found = plain_number(low), plain_number(high)
    except ValueError:
        found = (math.nan, math.nan)
    if not colon or not all(map(math.isfinite, found)):
        raise typer.BadParameter(f"{text!r} is not of the form LOW:HIGH, as in 0.1:2", param_hint=option)
    if not found[0] < found[1]:
        message = f"in {text!r}, LOW:HIGH, {low.strip()} is not below {high.strip()}"
        if found[0] > found[1]:
            message += f": write the lower one first, {high.strip()}:{low.strip()}"
        raise typer.BadParameter(message, param_hint=option)
    if option != "--range" and found[0] < 0.0:
        message = f"in {text!r}, LOW:HIGH, {low.strip()} is negative, and frequencies are not"
        raise typer.BadParameter(message, param_hint=option)
    if max(map(abs, found)) > _LARGEST or found[1] - found[0] < _SMALLEST:
        message = f"{text!r} is beyond {_LARGEST:g}, or narrower than {_SMALLEST:g}: take another unit"
        raise typer.BadParameter(message, param_hint=option)
    return found


def _levels(text: str, inputs: int) -> tuple[tuple[float, float], ...]:
    found = tuple(_pair(part, "--range") for part in text.split(","))
    if len(found) not in (1, inputs):
        message = f"it has {len(found)} ranges, and there are {inputs} inputs"
        raise typer.BadParameter(message, param_hint="--range")
    return found * inputs if len(found) == 1 else found


def _write(file: Path, results: Results) -> None:
    """Write one file of the kind that its ending names."""
    from inputdesign_cli.outcome.run_directory import write_bytes
    from inputdesign_cli.outcome.signal_files import WRITERS
    from inputdesign_cli.outcome.text_formats import csv_text

    table, ending = results.tables["signal"], file.suffix.removeprefix(".").lower()
    if ending == "png":
        from inputdesign_cli.figures.plots import draw

        write_bytes(file, draw(results.curves["signal"], results.time_unit))
        spectrum = draw(results.curves["spectrum"], results.time_unit)
        write_bytes(file.with_stem(f"{file.stem}_spectrum"), spectrum)
        return
    if ending == "csv":
        write_bytes(file, csv_text(table).encode())
        return
    write_bytes(file, WRITERS[ending](table.columns, results.result["signal"]["sample_time"]))


def _summary(results: Results, files: Sequence[Path]) -> str:
    """Return what was made and what it excites, a line a fact."""
    entry = results.result["signal"]
    unit, step = entry["time_unit"], entry["sample_time"]
    whole = f"{entry['samples']} samples every {step:g} {unit}"
    if entry["period"] < entry["samples"]:
        whole += f", a period of {entry['period']}"
    lines = [("signal", f"{entry['type']}, {whole}")]
    for name, one in entry["channels"].items():
        low, high = one["band"]
        mean = one["mean"] if abs(one["mean"]) > _ROUNDING * one["peak"] else 0.0
        sizes = f"mean {mean:.4g}, power {one['power']:.4g} about it, peak {one['peak']:.4g}"
        crest = f"crest factor {one['crest_factor']:.4g}"
        order = f"persistently exciting of order {one['order_of_excitation']}"
        lines.append(
            (name, f"{sizes}, {crest}; {order}; 90 % of the power from {low:.4g} to {high:.4g} rad/{unit}")
        )
    if files:
        lines.append(("files", ", ".join(map(str, files))))
    return "\n".join(aligned(lines, gap=3, wrap=True))
