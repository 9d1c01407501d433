"""`experiment.prior` where it states an information matrix, and the estimate that it may belong to."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from inputdesign_cli.arrays import Array
from inputdesign_cli.identification import Earlier
from inputdesign_cli.plant import Model
from inputdesign_cli.questions.building.parameters import embedded
from inputdesign_cli.specification import Spec, load_estimate

PRIOR = "experiment.prior.information"


@dataclass(frozen=True)
class StatedPrior:
    """The information (m, m) about named parameters (no names stand for all), and their values."""

    matrix: Array
    names: tuple[str, ...] | None
    values: Mapping[str, float] | None

    def over(self, spec: Spec, known: Sequence[str]) -> Array:
        """Return the information (k, k) about all parameters of the model.

        Raises `SpecError`: it does not fit them.
        """
        return embedded(spec, known, self.matrix, self.names, PRIOR)


def stated_prior(spec: Spec) -> StatedPrior | None:
    """Return the prior of the spec, or of the model file that it names; None for a record, or no prior.

    Raises `SpecError`: `bad-model-file`.
    """
    prior = spec.experiment.prior
    if prior is None:
        return None
    if not isinstance(prior.information, str):
        return StatedPrior(np.array(prior.information, dtype=float), prior.names, prior.values)
    if not prior.names_a_model:
        return None
    found = load_estimate(spec, prior.information, PRIOR)
    covariance = np.array(found.covariance, dtype=float)
    return StatedPrior(inverse(covariance), tuple(found.parameters), found.parameters)


def build_earlier(spec: Spec, nominal: Model) -> Earlier | None:
    """Return the prior as an estimate, with nominal values of other parameters; None without values.

    Raises `SpecError`: it does not fit the parameters; `bad-model-file`.
    """
    stated = stated_prior(spec)
    if stated is None or stated.values is None:
        return None
    theta = [stated.values.get(name, value) for name, value in zip(nominal.names, nominal.theta, strict=True)]
    return Earlier(np.array(theta, dtype=float), stated.over(spec, nominal.names))


def inverse(covariance: Array) -> Array:
    """Return the inverse of a covariance or information matrix (k, k), by way of correlations.

    Raises `LinAlgError`: it is singular.
    """
    scale = np.sqrt(np.diag(covariance))
    if not np.all(scale > 0.0):
        raise np.linalg.LinAlgError
    half = np.linalg.inv(np.linalg.cholesky(covariance / np.outer(scale, scale))) / scale
    return np.asarray(half.T @ half)
