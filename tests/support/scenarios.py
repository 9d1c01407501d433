"""Several plants of one structure to design for."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from inputdesign_cli.accuracy import ModelError, Relative
from inputdesign_cli.design.convex.question import Alternative
from inputdesign_cli.information import Experiment
from inputdesign_cli.plant import close_loop


def relative_of(experiment: Experiment, fraction: float, alpha: float = 2.45) -> list:
    """The maker of a bound relative to the G of this experiment's own plant."""
    admissible = Relative(experiment.model, fraction, (0, 0))

    def make(coordinates: Experiment) -> ModelError:
        return ModelError(
            experiment=coordinates, band=(0.0, np.pi), entry=(0, 0), admissible=admissible, alpha=alpha
        )

    return [make]


def moved(experiment: Experiment, theta: np.ndarray) -> Experiment:
    """The same experiment on another plant of the structure, its loop closed by the same controller."""
    model, loop = experiment.model.at(theta), experiment.loop
    return replace(experiment, model=model, loop=loop and close_loop(model, loop.controller))


def alternatives(experiment: Experiment, thetas: Sequence[np.ndarray], fraction: float) -> list[Alternative]:
    """One scenario for each theta (k,), the accuracy relative to its own G."""
    plants = [moved(experiment, theta) for theta in thetas]
    return [Alternative(plant, relative_of(plant, fraction)) for plant in plants]


def around(experiment: Experiment, number: int, spread: float, seed: int = 0) -> list[np.ndarray]:
    """Parameters scattered around the nominal ones, by this share of each."""
    theta = experiment.model.theta
    rng = np.random.default_rng(seed)
    return [theta * (1.0 + spread * rng.standard_normal(theta.size)) for _ in range(number)]
