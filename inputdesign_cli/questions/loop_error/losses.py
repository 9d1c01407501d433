"""Losses of the closed loop over all Monte Carlo runs -> the section `simulation` and its histogram."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from inputdesign_cli.arrays import Array
from inputdesign_cli.design.loop_error.loss import LossTheory, loss_theory
from inputdesign_cli.design.loop_error.parametric import ParametricCriterion
from inputdesign_cli.monte_carlo.loop_error import LossStudy
from inputdesign_cli.monte_carlo.statistics import whitened_eigenvalues
from inputdesign_cli.outcome.curves import Curves, LossCurves
from inputdesign_cli.outcome.loop_error import LossMoments
from inputdesign_cli.outcome.simulation import ExactLoss, Improvement, TriedInput
from inputdesign_cli.questions.loop_error.outcome import theory_of
from inputdesign_cli.signal.lines import Lines


def loss_results(
    criterion: ParametricCriterion,
    studies: Mapping[str, LossStudy],
    inputs: Mapping[str, Lines],
    samples: int,
) -> tuple[dict[str, TriedInput], Improvement | None, dict[str, Curves]]:
    """Return what each input gave, the improvement over white noise, and the histogram where runs count.

    Args:
        criterion: of the true system.
        inputs: the spectra that were tried.
    """
    theory, entries = {}, {}
    for name, lines in inputs.items():
        information = criterion.information(lines.frequencies, lines.powers, np.ones(len(lines.powers)))
        theory[name] = loss_theory(criterion, information)
        entries[name] = _tried(theory[name], studies[name], samples * information)
    losses = {name: study.loss for name, study in studies.items() if study.loss.size > 1}
    improvement = None
    if {"design", "white"} <= losses.keys():
        measured = 1 - float(losses["design"].mean() / losses["white"].mean())
        improvement = Improvement(measured, 1 - theory["design"].mean / theory["white"].mean)
    means = {name: theory[name].mean for name in losses}
    return entries, improvement, {"loss": LossCurves(losses, means)} if losses else {}


def _tried(theory: LossTheory, study: LossStudy, information: Array) -> TriedInput:
    several, counted = len(study.estimates) > 1, study.loss.size > 1
    return TriedInput(
        theory=theory_of(theory),
        unstable=study.unstable,
        mean_estimate=study.estimates.mean(axis=0),
        power=tuple(np.ravel(study.power).tolist()),
        covariance_eigenvalues=whitened_eigenvalues(study.estimates, information) if several else None,
        loss=_moments(study.loss) if counted else None,
        squared=_moments(study.loss**2) if counted else None,
        exact=ExactLoss(_moments(study.exact), _moments(study.exact**2)) if counted else None,
    )


def _moments(values: Array) -> LossMoments:
    sd = float(values.std(ddof=1))
    return LossMoments(float(values.mean()), sd, sd / float(np.sqrt(values.size)))
