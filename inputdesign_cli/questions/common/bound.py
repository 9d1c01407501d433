"""What an information matrix shows over frequency and of parameters: bound.csv, nyquist.csv, ellipses.

bound.csv has r_u against r_adm, entry by entry. nyquist.csv has the loop of one input and one output.
"""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass

import numpy as np

from inputdesign_cli.accuracy import OnModelError
from inputdesign_cli.arrays import Array
from inputdesign_cli.design.convex.designs import Design
from inputdesign_cli.information import Experiment
from inputdesign_cli.outcome.curves import (
    BoundCurves,
    BoundPanel,
    Curves,
    Ellipse,
    EllipseCurves,
    NyquistCurves,
)
from inputdesign_cli.outcome.objectives import WHITE
from inputdesign_cli.outcome.results import Table
from inputdesign_cli.outcome.units import Units
from inputdesign_cli.questions.common.spectrum import axis, distinct

_GRID_POINTS = 400
_NEARLY = 0.5
_NOTHING, _ROUNDING = 1e-9, 1e-9
_PAIRS = 6

Pairs = Sequence[tuple[str, str]]


@dataclass(frozen=True)
class Informed:
    """An experiment with its information, as curves show it.

    Attributes:
        units: of the spec.
        experiment: of the counted length.
        information: M (k, k) in its coordinates; `white` that of white excitation.
        white: see there; None if it is not compared with.
        errors: bounds on the model error; entries of G without one, if nothing is `stated`.
        stated: whether a requirement states r_adm.
        pairs: of parameters that ellipses show.
        active: for each error, the frequencies at which it binds; empty for none.
    """

    units: Units
    experiment: Experiment
    information: Array
    white: Array | None
    errors: Sequence[OnModelError]
    stated: bool
    pairs: Pairs | None
    active: Sequence[Array] = ()

    def curves(
        self,
        *,
        record: Array | None = None,
        equal: Array | None = None,
        white_labels: tuple[str, str] = WHITE,
        of_several: bool = False,
        flat: bool = True,
    ) -> tuple[dict[str, Table], dict[str, Curves]]:
        """Return the tables and figures of the bound, the loop and the parameters, as far as they exist.

        Args:
            record: see `bound_curves`, as all but `flat`.
            equal: see there.
            white_labels: see there.
            of_several: see there.
            flat: whether ellipses show white excitation as well.
        """
        tables, curves = dict[str, Table](), dict[str, Curves]()
        with suppress(np.linalg.LinAlgError):  # a parameter that the design does not excite
            tables["bound"], curves["bound"] = bound_curves(
                self.units,
                self.errors,
                self.information,
                white=self.white,
                equal=equal,
                white_labels=white_labels,
                record=record,
                stated=self.stated,
                active=self.active,
                of_several=of_several,
            )
            loops = nyquist_curves(self.units, self.errors[:1], self.information, self.active)
            tables, curves = tables | loops[0], curves | loops[1]
        white = self.white if flat else None
        drawn = experiment_ellipses(self.experiment, self.information, white, self.pairs)
        return tables, curves if drawn is None else curves | {"ellipses": drawn}

    def of_length(self, samples: int, *, flat: bool = True) -> dict[str, Curves]:
        """Return `bound` and `ellipses` of records of this many samples with the same spectrum."""
        found: dict[str, Curves] = {}
        longer = self.experiment.of_length(self.information, samples)
        white = None
        if flat and self.white is not None:
            white = self.experiment.of_length(self.white, samples)
        with suppress(np.linalg.LinAlgError):
            found["bound"] = bound_curves(self.units, self.errors, longer, stated=self.stated)[1]
        drawn = experiment_ellipses(self.experiment, longer, white, self.pairs)
        return found if drawn is None else found | {"ellipses": drawn}


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
    """(k, k): M of white excitation at the cost of the design, or of its length; None if limits bind both.

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


def nyquist_curves(
    units: Units, errors: Sequence[OnModelError], information: Array, active: Sequence[Array] = ()
) -> tuple[dict[str, Table], dict[str, Curves]]:
    """C G with discs of radius |C| r_u, by file stem; nothing without a loop, or for several channels.

    The loop is that whose sensitivity is bounded, else that of the experiment.

    Args:
        errors: the first has r_u and a band; information (k, k) is in its coordinates.
        active: of each error the frequencies of the experiment at which it binds; empty for none.
    """
    if not errors or not units.single:
        return {}, {}
    error, limiting = errors[0], active[0] if active else np.zeros(0)
    kept = error.admissible.kept
    loop = error.experiment.loop if kept is None else kept.loop
    if loop is None:
        return {}, {}
    limiting = distinct(limiting, error.band[1])
    w = axis(*error.band, np.concatenate([error.grid, limiting]))
    S, applied = (part[:, 0, 0] for part in loop.sensitivity(w))
    # With integral action S vanishes at frequency zero, where the loop has no end.
    inside = np.abs(S) > _NOTHING
    w, S, applied = w[inside], S[inside], applied[inside]
    L, radius = 1.0 / S - 1.0, np.abs(applied / S) * error.error_bound(information, w)
    frequency = w / units.frequency
    columns = {units.frequency_header: frequency, "CG_re": L.real, "CG_im": L.imag, "radius": radius}
    circle = None
    if kept is not None:
        columns["distance_kept"] = np.abs(kept.weight.at(w))
        lowest, highest = columns["distance_kept"].min(), columns["distance_kept"].max()
        circle = float(lowest) if highest - lowest <= _ROUNDING * highest else None
    curves = NyquistCurves(frequency, L, radius, circle, limiting / units.frequency)
    return {"nyquist": Table(columns)}, {"nyquist": curves}


def experiment_ellipses(
    experiment: Experiment, information: Array, white: Array | None, pairs: Pairs | None
) -> EllipseCurves | None:
    """The chosen `pairs`, by default those most correlated where there are several channels.

    Args:
        information, white: (k, k) in the coordinates of `experiment`, by the design and by flat excitation.

    Returns:
        None when there is no pair to show, or some parameter has no finite variance.
    """
    single = experiment.model.outputs == experiment.model.inputs == 1
    if experiment.size < 2 or (pairs is None and single):
        return None
    try:
        covariance = experiment.raw_covariance(information)
        flat = None if white is None else experiment.raw_covariance(white)
    except np.linalg.LinAlgError:  # a parameter that this excitation does not show
        return None
    names, theta = experiment.model.names, experiment.model.theta
    if pairs is None:
        scale = np.sqrt(np.diag(covariance))
        correlation = np.triu(np.abs(covariance / np.outer(scale, scale)), 1)
        order = np.argsort(-correlation, axis=None)[: min(_PAIRS, len(names) * (len(names) - 1) // 2)]
        index = [tuple(int(i) for i in np.unravel_index(at, correlation.shape)) for at in order]
    else:
        index = [(names.index(a), names.index(b)) for a, b in pairs]
    found = []
    for i, j in index:
        chosen = np.ix_([i, j], [i, j])
        found.append(
            Ellipse(
                (names[i], names[j]),
                theta[[i, j]],
                covariance[chosen],
                None if flat is None else flat[chosen],
            )
        )
    return EllipseCurves(tuple(found))
