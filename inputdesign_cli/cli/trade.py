"""`idesign solve --trade`: what more or less time and amplitude would buy."""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from inputdesign_cli.cli.computing import computing

if TYPE_CHECKING:
    from inputdesign_cli.figures.trade import Trade
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


def tell_trade(
    file: Path,
    spec: Spec,
    words: Sequence[str],
    directory: Path,
    *,
    overrides: Sequence[str],
    confine: Path | None,
    figure_format: str = "png",
    quiet: bool,
) -> Trade:
    """Run the sweep, draw the trade into its directory, and print the table."""
    with computing(directory, quiet=quiet, doing=f"trading {' and '.join(words)}"):
        from inputdesign_cli.figures.sweep_figures import draw_into
        from inputdesign_cli.figures.trade import draw_trade
        from inputdesign_cli.sweeps.trade import run_trade

        found = run_trade(
            file, spec, words, directory, overrides=overrides, confine=confine, figure_format=figure_format
        )
        drawn = draw_into(directory, "trade", lambda page: draw_trade(found, page), figure_format)
    if not quiet:
        typer.echo("\n" + trade_table(found))
        if not found.criterion:
            typer.echo("\nerror of the model over what is asked: below one is enough; more time to the right")
        typer.echo(f"\nfiles   {directory}: {drawn.name}, sweep.csv, sweep.yaml")
    return found


def trade_table(trade: Trade) -> str:
    """Lengths across, amplitudes down."""
    heads = [f"{length:g} {trade.unit}" for length in trade.lengths]
    rows = [["criterion" if trade.criterion else "error / asked", *heads]]
    for text, values in zip(trade.amplitudes, trade.values, strict=True):
        cells = [f"{value:.3g}" if math.isfinite(value) else "none" for value in values]
        rows.append([f"amplitude {text}" if text else "best record", *cells])
    widths = [max(map(len, column)) for column in zip(*rows, strict=True)]
    lines = ["  ".join(cell.rjust(width) for cell, width in zip(row, widths, strict=True)) for row in rows]
    return "\n".join(lines)
