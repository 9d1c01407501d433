"""`idesign signal`: ready-made signals, what they excite, and files for hardware."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import typer

from inputdesign_cli.cli.options import path_option, refuse_existing
from inputdesign_cli.cli.rows import TimeUnit, refuse, span
from inputdesign_cli.cli.terminal import aligned
from inputdesign_cli.plugins import names, own

if TYPE_CHECKING:
    from inputdesign_cli.outcome.results import Results
    from inputdesign_cli.questions.ready_made import ReadyMade

_ENDINGS = ("csv", "mat", "npz", "h", "png")
_ROUNDING = 1e-12
# Beyond these sizes squares and their sums leave double precision.
_SMALLEST, _LARGEST = 1e-15, 1e15


@dataclass(frozen=True)
class Form:
    """Holds the kinds of signals, of which one is made, its length and range, and options of some kinds."""

    prbs: int | None = None
    multisine: int | None = None
    chirp: str = ""
    steps: int | None = None
    kind: str = ""
    samples: int | None = None
    span: str = "-1:1"
    inputs: int = 1
    band: str = ""
    odd: bool = False
    hold: int = 1
    periods: int = 1
    seed: int = 0
    sample_time: float = 1.0
    time_unit: TimeUnit = "s"

    def asked(self) -> ReadyMade:
        """Return the signal of the kind that is asked for.

        Raises:
            typer.BadParameter: There is none or more than one, or an option cannot be used for it.
        """
        from inputdesign_cli.questions.ready_made import ReadyMade

        kinds = {name: vars(self)[name] for name in ("prbs", "multisine", "chirp", "steps", "kind")}
        stated = [name for name, value in kinds.items() if value not in (None, "")]
        if len(stated) != 1:
            said = " and ".join(f"--{name}" for name in stated) or "none of them"
            raise typer.BadParameter(
                f"give one of --prbs, --multisine, --chirp, --steps and --kind, not {said}"
            )
        known = {*own("idesign.signals"), *names("idesign.signals")} - {"slewed"}  # it needs a rate
        if self.kind and self.kind not in known:
            refuse(f"no kind is {self.kind!r}: there are {', '.join(sorted(known))}", "--kind")
        kind = self.kind or stated[0]
        owners = {"--band": (self.band, "multisine"), "--odd": (self.odd, "multisine")}
        owners |= {"--periods": (self.periods > 1, "multisine"), "--hold": (self.hold > 1, "prbs")}
        for option, (is_stated, owner) in owners.items():
            if is_stated and kind not in (owner, self.kind):
                refuse(f"it is of --{owner}, and does nothing to --{kind}: leave it out", option)
        if not _SMALLEST <= self.sample_time <= _LARGEST:
            refuse(f"it is a positive number, from {_SMALLEST:g} to {_LARGEST:g}", "--sample-time")
        band, option = (self.chirp, "--chirp") if self.chirp else (self.band, "--band")
        ranges = tuple(_pair(part, "--range") for part in self.span.split(","))
        if len(ranges) not in (1, self.inputs):
            refuse(f"it has {len(ranges)} ranges, and there are {self.inputs} inputs", "--range")
        return ReadyMade(
            kind,
            bits=self.prbs,
            number=self.multisine or self.steps,
            band=_pair(band, option, least=0.0) if band else None,
            samples=self.samples,
            levels=ranges * (self.inputs // len(ranges)),
            hold=self.hold,
            periods=self.periods,
            odd=self.odd,
            seed=self.seed,
            sample_time=self.sample_time,
            time_unit=self.time_unit,
        )


def signal(
    *,
    form: Form,
    output: list[str] | None = None,
    overwrite: bool = False,
    json_output: bool = False,
    quiet: bool = False,
) -> None:
    """Make a signal without a spec, and show what it excites.

    Give one of --prbs, --multisine, --chirp, --steps and --kind. Prints the peak, the crest factor, the order
    of persistent excitation and the band of each channel; -o writes the samples, a C header for hardware
    among the kinds. With several inputs a prbs is shifted, a multisine has a period for each input.
    """
    files = [path_option(name) for name in output or ()]
    for file in files:
        if file.suffix.removeprefix(".").lower() not in _ENDINGS:
            listed = ", ".join(f".{ending}" for ending in _ENDINGS)
            refuse(f"{file.name} ends with none of {listed}", "--output")
    written = [*files, *(f.with_stem(f"{f.stem}_spectrum") for f in files if f.suffix.lower() == ".png")]
    if len({part.absolute() for part in written}) < len(written):
        refuse("a file would be written twice: give each a name of its own", "--output")
    for part in written:
        refuse_existing(part, overwrite)
    asked = form.asked()
    from inputdesign_cli.questions.ready_made import make_signal

    results = make_signal(asked)
    for file in files:
        _write(file, results)
    if json_output:
        from inputdesign_cli.outcome.codec import json_text

        typer.echo(json_text(results.result), nl=False)
    elif not quiet:
        typer.echo(_summary(results, written))


def _pair(text: str, option: str, least: float = -_LARGEST) -> tuple[float, float]:
    """Return two numbers, the second larger, or raise `typer.BadParameter`."""
    low, high = found = span(text, option, "LOW:HIGH")
    size = max(map(abs, found))
    apart = max(_SMALLEST, 1e-6 * size)  # values have 13 digits, most of which must be left for the moves
    if not (size <= _LARGEST and high - low >= apart and low >= least):
        sizes = f"{max(least, -_LARGEST):g} to {_LARGEST:g}, {_SMALLEST:g} apart or a millionth of the larger"
        refuse(f"{text!r} is no LOW:HIGH within {sizes}", option)
    return found


def _write(file: Path, results: Results) -> None:
    """Write one file of the kind that its ending names."""
    from inputdesign_cli.outcome.run_directory import write_bytes
    from inputdesign_cli.outcome.text_formats import WRITERS, csv_text

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
    """Return the properties of the signal and of each channel, one in a line."""
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
