"""What the runs of a loop-error study lost -> the entry `simulation` and its histogram."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from inputdesign_cli.arrays import Array
from inputdesign_cli.design.loop_error.loss import LossTheory, loss_theory
from inputdesign_cli.design.loop_error.parametric import ParametricCriterion
from inputdesign_cli.monte_carlo.loop_error import LossStudy
from inputdesign_cli.monte_carlo.statistics import whitened_eigenvalues
from inputdesign_cli.outcome.curves import Curves, LossCurves
from inputdesign_cli.questions.loop_error.outcome import Entry, theory_entry
from inputdesign_cli.signal.lines import Lines


def loss_results(
    criterion: ParametricCriterion,
    studies: Mapping[str, LossStudy],
    inputs: Mapping[str, Lines],
    samples: int,
) -> tuple[Entry, dict[str, Curves]]:
    """What `simulation` says of each input, and the histogram if there is anything to count.

    Args:
        criterion: of the true system.
        inputs: the spectra that were tried.
    """
    theory, entries = {}, {}
    for name, lines in inputs.items():
        information = criterion.information(lines.frequencies, lines.powers, np.ones(len(lines.powers)))
        theory[name] = loss_theory(criterion, information)
        entries[name] = _entry(theory[name], studies[name], samples * information)
    found: Entry = {"inputs": entries}
    losses = {name: study.loss for name, study in studies.items() if study.loss.size > 1}
    if {"design", "white"} <= losses.keys():
        found["improvement"] = {
            "measured": 1 - float(losses["design"].mean() / losses["white"].mean()),
            "theory": 1 - theory["design"].mean / theory["white"].mean,
        }
    means = {name: theory[name].mean for name in losses}
    return found, {"loss": LossCurves(losses, means)} if losses else {}


def _entry(theory: LossTheory, study: LossStudy, information: Array) -> Entry:
    entry: Entry = {
        "theory": theory_entry(theory),
        "unstable": study.unstable,
        "mean_estimate": study.estimates.mean(axis=0),
        "power": study.power,
    }
    if len(study.estimates) > 1:
        entry["covariance_eigenvalues"] = whitened_eigenvalues(study.estimates, information)
    if study.loss.size > 1:
        entry |= {
            "loss": _moments(study.loss),
            "squared": _moments(study.loss**2),
            "exact": {"loss": _moments(study.exact), "squared": _moments(study.exact**2)},
        }
    return entry


def _moments(values: Array) -> dict[str, float]:
    sd = float(values.std(ddof=1))
    return {"mean": float(values.mean()), "sd": sd, "standard_error": sd / float(np.sqrt(values.size))}
