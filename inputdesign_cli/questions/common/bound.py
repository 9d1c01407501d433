"""bound.csv and its plot: r_u against r_adm over frequency, entry by entry."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from inputdesign_cli.accuracy import OnModelError
from inputdesign_cli.arrays import Array
from inputdesign_cli.design.convex.designs import Design
from inputdesign_cli.outcome.curves import BoundCurves, BoundPanel
from inputdesign_cli.outcome.objectives import WHITE
from inputdesign_cli.outcome.results import Table
from inputdesign_cli.outcome.units import Units
from inputdesign_cli.questions.common.spectrum import axis, distinct

_GRID_POINTS = 400
_NEARLY = 0.5


def bound_curves(
    units: Units,
    errors: Sequence[OnModelError],
    information: Array,
    *,
    white: Array | None = None,
    record: Array | None = None,
    stated: bool = True,
    active: Sequence[Array] = (),
    label: str = "design",
    equal: Array | None = None,
    white_labels: tuple[str, str] = WHITE,
    of_several: bool = False,
) -> tuple[Table, BoundCurves]:
    """r_u, r_adm and |G| of every entry (or of the norm of G) over the band of the requirement.

    Args:
        information: M (k, k) in the coordinates of the errors; `white`, `equal` and `record`: that of the
            baseline, of white excitation with the means of the design, and of the record to be applied.
        stated: whether a requirement states r_adm; without, the errors' own r_adm mean nothing.
        active: for each error, the frequencies of the experiment at which it binds; empty for none.
        label: what gave r_u.
        white_labels: what `white` and `equal` are called.
        of_several: whether the design serves other plants, too, which these curves do not show.
    """
    binding = active or [np.zeros(0)] * len(errors)
    peaks = _peaks(errors, information) if stated else np.zeros(0)
    w = _axis(errors, np.concatenate([*binding, peaks]))
    frequency = w / units.frequency
    columns: dict[str, Array] = {units.frequency_header: frequency}
    panels = []
    for error, binds in zip(errors, binding, strict=True):
        panel = BoundPanel(
            frequency=frequency,
            r_u=error.error_bound(information, w),
            G_abs=error.nominal_size(w),
            r_adm=error.admissible.at(w) if stated else None,
            r_u_white=None if white is None else error.error_bound(white, w),
            active=distinct(np.maximum(binds, w[0]), w[-1]) / units.frequency,
            r_u_record=None if record is None else error.error_bound(record, w),
            label=label,
            r_u_equal=None if equal is None else error.error_bound(equal, w),
            white_labels=white_labels,
            entry=None if units.single else error.entry,
            names=units.passage(error.entry),
        )
        suffix = "" if error.entry is None else units.suffix(*error.entry)
        listed = {
            "r_u": panel.r_u,
            "r_adm": panel.r_adm,
            "G_abs": panel.G_abs,
            "r_u_white": panel.r_u_white,
            "r_u_record": panel.r_u_record,
            "r_u_equal": panel.r_u_equal,
        }
        columns |= {f"{name}{suffix}": values for name, values in listed.items() if values is not None}
        panels.append(panel)
    return Table(columns), BoundCurves(tuple(panels), of_several)


def _peaks(errors: Sequence[OnModelError], information: Array) -> Array:
    found = [v.frequency for error in errors for v in error.violations(information, above=_NEARLY)]
    return np.array([w for w in found if w is not None])


def _axis(errors: Sequence[OnModelError], extra: Array) -> Array:
    """Frequencies of the band with the `extra` ones, and what shows the shape of resonances."""
    grid = np.unique(np.concatenate([error.grid for error in errors]))
    shape = grid[:: max(len(grid) // _GRID_POINTS, 1)]
    return axis(*errors[0].band, np.concatenate([extra, shape]))


def equal_white(design: Design, samples: int, ratio: float) -> Array | None:
    """(k, k): M of white excitation at the cost of the design, or of its length; None where limits bind both.

    M less what is known without excitation is in proportion to the power and to the length.

    Args:
        samples: of the delivered experiment.
        ratio: of the cost of white excitation that meets the requirements to that of the design.
    """
    problem, white = design.problem, design.white
    if problem.goal == "factor" or ratio <= 0.0:
        return None
    share = samples / white.s if problem.goal == "samples" else 1.0 / ratio
    known = problem.fixed_information[0]
    return np.asarray(known + share * (white.informations[0] - known))
