"""From a spectrum to the record of one input."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from inputdesign_cli.information import Experiment, PowerKind
from inputdesign_cli.plant.polynomial import Array
from inputdesign_cli.signal.achieved import input_and_output, record_information
from inputdesign_cli.signal.bounds import Bounds, limited_gains, limiter_of
from inputdesign_cli.signal.generator import SignalGenerator
from inputdesign_cli.signal.selection import Candidates, Evaluator, Record, Target, best_record
from inputdesign_cli.signal.settings import SignalSettings
from inputdesign_cli.spectrum import FirBasis, LinesBasis


def realise(
    experiment: Experiment,
    basis: FirBasis | LinesBasis,
    x: Array,
    demand: Target,
    recipe: SignalSettings,
    *,
    samples: int,
    bounds: Bounds | None = None,
) -> Record:
    """The best of several records of the spectrum.

    Filtered noise needs a spectral factor. Where that cannot be had to 1e-8 (a spectrum with deep
    zeros) a multisine is made instead, which needs none; `Record.method` says so.
    """
    bounds = bounds or Bounds()
    drawer = SignalGenerator(basis, x, recipe, samples)
    wanted = recipe.phases == "optimised" and drawer.method == "multisine" and recipe.hold == 1
    gains = limited_gains(experiment, bounds, drawer.lines.frequencies) if wanted else ()
    shape = Candidates(
        lambda rng: drawer.values(rng, gains),
        drawer.method,
        drawer.total,
        None if drawer.factor is None else drawer.factor.residual,
    )

    def powers(record: Array) -> Mapping[PowerKind, Array]:
        u, y = input_and_output(experiment, record)
        means = (np.array([np.mean(signal**2)]) for signal in (u, y, record))
        kinds: tuple[PowerKind, ...] = ("input", "output", "excitation")
        return dict(zip(kinds, means, strict=True))

    bench = Evaluator(
        lambda record: record_information(experiment, record),
        powers,
        tuple((kind, None, most) for kind, most in bounds.powers),
    )
    return best_record(shape, limiter_of(experiment, recipe, bounds), bench, demand)
