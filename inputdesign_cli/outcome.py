"""What a design, an analysis or a study hands to the record and the report: plain data, nothing to compute.

`result` is the content of `result.json`; the rest is what the CSV files and the plots need. Frequencies
are in rad per time unit, spectra in the convention of the contract (power = integral over the normalised
circle / 2 pi).
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Table:
    """Columns of one CSV file: header name (with its unit, `frequency_rad_per_s`) -> values (n,)."""

    columns: Mapping[str, Array]


@dataclass(frozen=True)
class SpectrumCurves:
    """The designed spectrum over frequency, as a density, as lines, or both."""

    frequency: Array  # (n,) rad per time unit
    density: Array | None = None  # (n,) Phi(frequency)
    white: float | None = None  # the flat level of the white baseline, for comparison
    line_frequency: Array | None = None  # (L,)
    line_power: Array | None = None  # (L,) mean square of each sinusoid
    symbol: str = "u"  # which signal: "u" in open loop, "r" in closed loop


@dataclass(frozen=True)
class BoundCurves:
    """Model error against admissible error over frequency; all arrays (n,)."""

    frequency: Array
    r_u: Array
    G_abs: Array
    r_adm: Array | None = None
    r_u_white: Array | None = None  # of white excitation at the cost that it needs
    active: Array = field(default_factory=lambda: np.zeros(0))  # frequencies where r_u touches r_adm


@dataclass(frozen=True)
class OptimalityCurves:
    """The equivalence-theorem ratio over frequency: at most one everywhere, one on the support."""

    frequency: Array
    ratio: Array
    support: Array


@dataclass(frozen=True)
class SignalCurves:
    """The record to be applied: `time` (n,), one array (n,) a channel."""

    time: Array
    channels: Mapping[str, Array]  # "u1" -> samples (closed loop: "r1")


@dataclass(frozen=True)
class Outcome:
    """One run: the result and what illustrates it. `tables` and `curves` go by file stem ("bound")."""

    result: Mapping[str, Any]
    resolved_spec: str  # YAML text of the spec with all overrides applied
    time_unit: str = "s"
    tables: Mapping[str, Table] = field(default_factory=dict)
    curves: Mapping[str, SpectrumCurves | BoundCurves | OptimalityCurves | SignalCurves] = field(
        default_factory=dict
    )
