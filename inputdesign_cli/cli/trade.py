"""`idesign solve --trade`: a sweep that shows what more or less time and amplitude would buy."""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from inputdesign_cli.cli.options import Changes, Shown, Workers
from inputdesign_cli.cli.terminal import aligned, computing

if TYPE_CHECKING:
    from inputdesign_cli.figures.sweep_table import Trade
    from inputdesign_cli.specification import Spec

WORDS = ("samples", "amplitude")


def _words(text: str | None) -> str | None:
    for word in () if text is None else text.split(","):
        if word not in WORDS:
            raise typer.BadParameter(f'"{word}" is neither samples nor amplitude')
    return text


TradeWords = Annotated[
    str | None,
    typer.Option(
        "--trade",
        metavar="samples,amplitude",
        callback=_words,
        help="Draw what a quarter to twice the time and half to twice the amplitude would buy, too: "
        "a sweep in DIR-trade.",
    ),
]


def show_trade(
    file: Path, spec: Spec, words: Sequence[str], run: Path, changes: Changes, shown: Shown
) -> None:
    """Sweep in a directory next to that of the run, draw the trade, and print its table."""
    quiet, directory = shown.quiet or shown.json_output, run.with_name(f"{run.name}-trade")
    with computing(directory, quiet=quiet, doing=f"trading {' and '.join(words)}"):
        from inputdesign_cli.figures.sweep import draw_into, draw_trade
        from inputdesign_cli.figures.sweep_table import read_sweep
        from inputdesign_cli.sweeps.plan import build_plan
        from inputdesign_cli.sweeps.running import SweepRun
        from inputdesign_cli.sweeps.trade import trade_of, trade_settings

        settings = [*(changes.overrides or []), *trade_settings(spec, words)]
        SweepRun(
            build_plan(file, settings, confine=changes.confine),
            directory,
            Workers(jobs=0).executor(quiet=quiet),
            figure_format=shown.figure_format,
            overwrite=True,  # the directory belongs to the run, whatever was traded there before
        ).run()
        found = trade_of(read_sweep(directory), spec)
        drawn = draw_into(directory, "trade", lambda page: draw_trade(found, page), shown.figure_format)
    if not quiet:
        typer.echo("\n" + trade_table(found))
        if not found.criterion:
            typer.echo("\nerror of the model over what is asked: below one is enough; more time to the right")
        typer.echo(f"\nfiles   {directory}: {drawn.name}, sweep.csv, sweep.yaml")


def trade_table(trade: Trade) -> str:
    """Return the table with lengths across and amplitudes down."""
    heads = [f"{length:g} {trade.unit}" for length in trade.lengths]
    rows = [["criterion" if trade.criterion else "error / asked", *heads]]
    for text, values in zip(trade.amplitudes, trade.values, strict=True):
        cells = [f"{value:.3g}" if math.isfinite(value) else "none" for value in values]
        rows.append([f"amplitude {text}" if text else "best record", *cells])
    return "\n".join(aligned(rows, right=range(len(heads) + 1)))
