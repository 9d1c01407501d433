"""From a spectrum to the record to be applied: several candidates, the best by its own information."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Literal

import numpy as np

from inputdesign_cli.information import Experiment
from inputdesign_cli.plant.polynomial import Array
from inputdesign_cli.signal.achieved import record_information
from inputdesign_cli.signal.generate import filtered_noise, line_powers, multisine
from inputdesign_cli.signal.spectral_factor import spectral_factor
from inputdesign_cli.spectrum import FirBasis

Method = Literal["filtered_noise", "multisine"]
# Beyond this relative error of its autocovariances a factor no longer has the designed spectrum.
_FACTOR_RESIDUAL = 1e-8


@dataclass(frozen=True)
class Record:
    """The samples (n,) of the excitation, what made them, and the worst r_u / r_adm that they buy."""

    samples: Array
    method: Method
    worst_ratio: float
    factor_residual: float | None


def realise(
    experiment: Experiment,
    basis: FirBasis,
    x: Array,
    worst_ratio: Callable[[Array], float],
    *,
    method: Method,
    samples: int,
    candidates: int,
    seed: int,
) -> Record:
    """The best of several records of the spectrum, each scaled to its power exactly.

    Filtered noise needs a spectral factor. Where that cannot be had to 1e-8 (a spectrum with deep
    zeros) a multisine is made instead, which needs none; `Record.method` says so.

    Args:
        worst_ratio: maps an information matrix to the largest r_u / r_adm.
        candidates: how many records are tried, each from its own stream of `seed`.
    """
    factor = spectral_factor(x) if method == "filtered_noise" else None
    if factor is not None and factor.residual > _FACTOR_RESIDUAL:
        method = "multisine"
    power = line_powers(basis.density(x, 2 * np.pi * np.arange(samples // 2 + 1) / samples), samples)
    best: Record | None = None
    for stream in np.random.SeedSequence(seed).spawn(candidates):
        rng = np.random.default_rng(stream)
        if factor is not None and method == "filtered_noise":
            record = filtered_noise(factor.taps, samples, rng)
        else:
            record = multisine(power, samples, rng)
        record = record * np.sqrt(x[0] / np.mean(record**2))
        try:
            ratio = worst_ratio(record_information(experiment, record))
        except np.linalg.LinAlgError:  # too short to excite every parameter
            ratio = np.inf
        if best is None or ratio < best.worst_ratio:
            best = Record(record, method, ratio, None if factor is None else factor.residual)
    if best is None:
        raise ValueError("at least one candidate is needed")
    return best
