"""Curves as the CSV files of a run hold them, with what they show in words."""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping

import numpy as np

from inputdesign_cli.runs.curves import (
    BoundCurves,
    BoundPanel,
    Curves,
    NyquistCurves,
    OptimalityCurves,
    PredictedPanel,
    SignalCurves,
    SpectrumCurves,
)
from inputdesign_cli.runs.objectives import white_labels
from inputdesign_cli.runs.results import Array, Result

Columns = Mapping[str, Array]
# Curves, and what they show in words.
Drawn = tuple[Curves, str]
# The tables of a run by file stem, its result, and whether it is in closed loop.
Reader = Callable[[Mapping[str, Columns], Result, bool], Drawn | None]

# An entry of G limits the design where its r_u / r_adm is above this.
_LIMITS = 0.999
# The certificate is at its limit where it is above this.
_AT_LIMIT = 1.0 - 1e-4
WITHOUT_LIMIT = "The error r_u that the model may have, and the gain |G|, against frequency."


def read_bound(tables: Mapping[str, Columns], result: Result, closed_loop: bool) -> Drawn | None:
    """r_u against r_adm, entry by entry."""
    table = tables["bound"]
    w = _frequency(table)
    error = result.get("model_error", {})
    places = [name.removeprefix("r_u") for name in table if re.fullmatch(r"r_u(_\d\d)?", name)]
    if not places or not all(f"G_abs{place}" in table for place in places):
        return None
    frequencies = _active(result, w)

    def panel(place: str) -> BoundPanel:
        r_u, r_adm = table[f"r_u{place}"], table.get(f"r_adm{place}")
        # Of several entries each limits at frequencies of its own.
        near = np.interp(frequencies, w, np.zeros(w.size) if r_adm is None else r_u / r_adm) > _LIMITS
        return BoundPanel(
            w,
            r_u,
            table[f"G_abs{place}"],
            r_adm,
            table.get(f"r_u_white{place}"),
            frequencies if len(places) == 1 else frequencies[near],
            table.get(f"r_u_record{place}"),
            # Beside a design the figure of the data is one of its own.
            label="data" if "identification" in result and "objective" not in result else "design",
            r_u_equal=table.get(f"r_u_equal{place}"),
            white_labels=white_labels(result),
            entry=(int(place[1]) - 1, int(place[2]) - 1) if place else None,
        )

    curves = BoundCurves(tuple(panel(place) for place in places))
    if all(one.r_adm is None for one in curves.panels):
        return curves, WITHOUT_LIMIT
    worst = f"; the largest ratio is {error['worst_ratio']:.6g}" if "worst_ratio" in error else ""
    return curves, f"Model error r_u and admissible error r_adm against frequency{worst}."


def read_nyquist(tables: Mapping[str, Columns], result: Result, closed_loop: bool) -> Drawn | None:
    """The loop with the discs of the data."""
    table = tables["nyquist"]
    if not {"CG_re", "CG_im", "radius"} <= set(table):
        return None
    w, kept = _frequency(table), table.get("distance_kept")
    circle = float(kept[0]) if kept is not None and np.ptp(kept) <= 1e-9 * kept[0] else None
    loop = table["CG_re"] + 1j * table["CG_im"]
    curves = NyquistCurves(w, loop, table["radius"], circle, _active(result, w))
    nearest = float((np.abs(1.0 + loop) - table["radius"]).min())
    told = f", of which {circle:.4g} is asked" if circle is not None else ""
    return curves, (
        "Nyquist plot of the loop C G with the discs in which the data leave it: they stay "
        f"{nearest:.4g} away from -1{told}."
    )


def read_spectrum(tables: Mapping[str, Columns], result: Result, closed_loop: bool) -> Drawn | None:
    """The density of one input, or the powers of its sinusoids."""
    table = tables["spectrum"]
    lines = "power" in table
    if not lines and "phi" not in table:
        return None
    w, phi = _frequency(table), table["power" if lines else "phi"]
    if not w.size:
        return None
    white = result.get("baseline", {}).get("white", {}).get("power", {}).get("excitation", [None])[0]
    record = table["phi_record"][:, None] if "phi_record" in table else None
    density = phi[:, None, None].astype(np.complex128)
    symbol = "r" if closed_loop else "u"
    curves = SpectrumCurves(w, density, white=white, lines=lines, symbol=symbol, record=record)
    peak = w[int(np.argmax(phi))]
    if lines:
        return curves, f"Powers of {w.size} sinusoids against frequency, the largest at {peak:.3g}."
    return curves, f"Spectral density of the excitation against frequency, with its peak at {peak:.3g}."


def read_optimality(tables: Mapping[str, Columns], result: Result, closed_loop: bool) -> Drawn | None:
    """The certificate, with the frequencies at which it is at its limit."""
    table = tables["optimality"]
    if "ratio" not in table:
        return None
    w, ratio = _frequency(table), table["ratio"]
    peaks = (ratio >= _AT_LIMIT) & (ratio >= np.roll(ratio, 1)) & (ratio >= np.roll(ratio, -1))
    curves = OptimalityCurves(w, ratio, w[peaks])
    return curves, f"Worth of a unit of cost against frequency; its maximum is {ratio.max():.4g}."


def read_signal(tables: Mapping[str, Columns], result: Result, closed_loop: bool) -> Drawn | None:
    """The record, and the outputs that are to be expected."""
    table = tables["signal"]
    time, *headers = table
    if not time.startswith("time") or not headers:
        return None
    limits = {name: (pair[0], pair[1]) for name, pair in result.get("signal", {}).get("limits", {}).items()}
    labels = dict(header.partition(" ")[::2] for header in headers)
    expected = tables.get("predicted_output", {})
    panels = tuple(
        PredictedPanel(name, expected[header], expected[f"{name}_noise_deviation"], None, label)
        for header in expected
        for name, _, label in (header.partition(" "),)
        if f"{name}_noise_deviation" in expected
    )
    channels = {header.partition(" ")[0]: table[header] for header in headers}
    curves = SignalCurves(table[time], channels, limits, labels, panels)
    below = f" Below: the output to be expected of {', '.join(p.name for p in panels)}." if panels else ""
    return (
        curves,
        f"The signal {', '.join(channels)} against time, and the distribution of its values.{below}",
    )


READERS: Mapping[str, Reader] = {
    "bound": read_bound,
    "nyquist": read_nyquist,
    "spectrum": read_spectrum,
    "optimality": read_optimality,
    "signal": read_signal,
}


def _frequency(table: Columns) -> Array:
    return next(values for name, values in table.items() if name.startswith("frequency"))


def _active(result: Result, w: Array) -> Array:
    """The limiting frequencies that the result tells, within those of the curve."""
    found = result.get("model_error", {}).get("active_frequencies", [])
    return np.clip(np.array(found, dtype=float), w[0], w[-1])
