"""Experiments on the design model, identified as real ones are: with a search from several starts."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from inputdesign_cli.arrays import Array
from inputdesign_cli.identification import Earlier, Estimate, Rival, identify
from inputdesign_cli.information import Experiment
from inputdesign_cli.monte_carlo.simulated_runs import noise, responses


def searched_run(
    nominal: Experiment, record: Array, step: float, rng: np.random.Generator, earlier: Earlier | None
) -> tuple[Estimate, bool]:
    """The minima that the search of `identify` finds, and whether the best one is that of the nominal plant.

    The estimate is the minimum that is nearest to the nominal parameters; its rivals are the others, whose
    excess is negative where they explain the record better.

    Args:
        nominal: the experiment, in raw parameters.
        record: (n, r), the excitation.
        step: time between samples in the unit of the experiment's frequencies.
        earlier: what counts along.

    Raises:
        SpecError: see `identify`.
    """
    true, model = replace(nominal, samples=len(record)), nominal.model
    (_, u), (_, y) = responses(true, record[None], noise(true, 1, rng), step)
    found = identify(
        model, u[0], y[0], step, start=model.theta, feedback=true.loop is not None, rest=True, earlier=earlier
    )
    minima = (Rival(found.theta, 0.0), *found.search.rivals)
    away = [float(np.sum((found.factor.T @ (one.theta - model.theta)) ** 2)) for one in minima]
    number = int(np.argmin(away))
    home = minima[number]
    others = tuple(Rival(one.theta, one.excess - home.excess) for n, one in enumerate(minima) if n != number)
    return replace(found, theta=home.theta).with_rivals(others), number == 0
