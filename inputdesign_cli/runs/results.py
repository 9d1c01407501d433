"""What a design, an analysis or a study hands to the record and the report: plain data, nothing to compute.

`result` is the content of `result.json`; the rest is what the CSV files and the plots need. Frequencies
are in rad per time unit, spectra in the convention of the contract (power = integral over the normalised
circle / 2 pi).
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from html import escape
from typing import Any, cast

import numpy as np
from numpy.typing import ArrayLike, NDArray

from inputdesign_cli.runs.curves import Curves, SpectrumCurves

Array = NDArray[np.float64]
# Data as JSON has it. What is in a result is known by its path, not by its type.
Json = Any
Result = Mapping[str, Json]


@dataclass(frozen=True)
class Table:
    """Columns of one CSV file: header name (with its unit, `frequency_rad_per_s`) -> values (n,)."""

    columns: Mapping[str, Array]


@dataclass(frozen=True)
class Results:
    """One run: the result and what illustrates it. `tables` and `curves` go by file stem ("bound")."""

    result: Result
    resolved_spec: str  # YAML text of the spec with all overrides applied
    time_unit: str = "s"
    tables: Mapping[str, Table] = field(default_factory=dict)
    curves: Mapping[str, Curves] = field(default_factory=dict)
    files: Mapping[str, bytes] = field(default_factory=dict)  # file name ("model.yaml") -> content

    @property
    def parameters(self) -> tuple[str, ...]:
        """(k,): names of what is estimated."""
        return tuple(self.result["information"]["parameters"])

    @property
    def information(self) -> Array:
        """(k, k): the information matrix of the experiment."""
        return np.array(self.result["information"]["matrix"], dtype=float)

    @property
    def covariance(self) -> Array:
        """(k, k): its inverse."""
        return np.array(self.result["information"]["covariance"], dtype=float)

    @property
    def signal(self) -> Array:
        """(n, r): the record to be applied, as signal.csv has it."""
        _, *channels = self.tables["signal"].columns.values()
        return np.stack(channels, axis=1)

    @property
    def bound(self) -> Mapping[str, Array]:
        """The columns of bound.csv: frequency_rad_per_s, r_u, r_adm, .."""
        return self.tables["bound"].columns

    def spectrum(self, w: ArrayLike) -> NDArray[np.complex128]:
        """(.., r, r): the spectrum at frequencies `w`, a number or an array (..), in rad per time unit.

        A density is interpolated between the frequencies of spectrum.csv; of sinusoids it is their power,
        and zero between them. A frequency within a thousandth of a line, and of its distance to the next one,
        is that of the line.
        """
        found, stated = cast(SpectrumCurves, self.curves["spectrum"]), np.asarray(w, dtype=float)
        at, shape = stated.ravel(), (*stated.shape, *found.spectrum.shape[1:])
        if found.lines:
            nearest = np.abs(found.frequency - at[:, None]).argmin(axis=1)
            on = np.abs(found.frequency[nearest] - at) <= _SAME_LINE * _room(found.frequency)[nearest]
            powers = np.where(on[:, None, None], found.spectrum[nearest], 0.0)
            return powers.reshape(shape).astype(complex)
        flat = found.spectrum.reshape(len(found.frequency), -1)
        columns = [np.interp(at, found.frequency, column, left=0.0, right=0.0) for column in flat.T]
        return np.stack(columns, axis=1).reshape(shape).astype(complex)

    def _repr_html_(self) -> str:
        """What a notebook shows: the head of the result."""
        rows = [("status", self.result.get("status", "")), ("samples", self.result.get("samples", ""))]
        objective = self.result.get("objective", {})
        rows += [(str(objective.get("kind", "objective")), _digits(objective.get("value", "")))]
        rows += [("proved bound", _digits(objective[key])) for key in _BOUNDS if key in objective]
        deviations = self.result.get("information", {}).get("standard_deviation", {})
        rows += [(f"standard deviation of {name}", _digits(value)) for name, value in deviations.items()]
        cells = "".join(
            f"<tr><th>{escape(name)}</th><td>{escape(str(value))}</td></tr>" for name, value in rows
        )
        return f"<b>{escape(str(self.result.get('title', '')))}</b><table>{cells}</table>"


_BOUNDS = ("lower_bound", "upper_bound")
# Frequencies are written with three digits, say: so much of what lies around a line is the line.
_SAME_LINE = 1e-3


def _room(frequency: Array) -> Array:
    """(n,): the frequency of each line, or its distance to the next one where that is less."""
    apart = np.abs(frequency[:, None] - frequency)
    np.fill_diagonal(apart, np.inf)
    return np.minimum(frequency, apart.min(axis=1))


def _digits(value: Json) -> str:
    return f"{value:.6g}" if isinstance(value, float) else str(value)
