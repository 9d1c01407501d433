"""`uncertainty` -> how the parameters of plants that the true one might be are drawn."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace

import numpy as np

from inputdesign_cli.arrays import Array
from inputdesign_cli.information import Experiment, FiniteRecord
from inputdesign_cli.plant import Model
from inputdesign_cli.questions.building.model_error import confidence_factor
from inputdesign_cli.questions.building.parameters import check_known, embedded
from inputdesign_cli.questions.building.prior import inverse
from inputdesign_cli.questions.building.system import read_excitation_record, record_step
from inputdesign_cli.specification import Spec, load_estimate
from inputdesign_cli.specification.models.uncertainty import SOURCES, Uncertainty

_KEY = "uncertainty"
_AWAY = 3.0  # standard deviations

Draw = Callable[[np.random.Generator], Array]


def drawing(spec: Spec, stated: Uncertainty, experiment: Experiment) -> Draw:
    """How parameters (k,) are drawn about those of the nominal plant.

    Raises:
        SpecError: `unknown-parameter`, `wrong-shape`, `bad-interval`, `not-positive-definite`, or
            `wrong-estimate`.
        DataError: a record cannot be used.
    """
    return _Source(spec, stated, experiment).drawing()


def reach(
    spec: Spec, stated: Uncertainty, experiment: Experiment, confidence: float
) -> tuple[str, Array, Array, bool]:
    """What the draws are from, up to a confidence: in words, centre (k,), columns (k, m), whether a box.

    Raises:
        SpecError, DataError: see `drawing`.
    """
    return _Source(spec, stated, experiment).reach(confidence)


@dataclass(frozen=True)
class Unsure:
    """A spec, what it says of how little is known of its plant, and the experiment at the nominal one."""

    spec: Spec
    stated: Uncertainty
    experiment: Experiment

    @property
    def nominal(self) -> Model:
        """The plant that the spec states."""
        return self.experiment.model


class _Source(Unsure):
    """What is known of the parameters."""

    def drawing(self) -> Draw:
        """How parameters (k,) are drawn."""
        if self.stated.intervals is not None:
            return self._even(self.stated.intervals)
        covariance = self._covariance()
        varied = np.diag(covariance) > 0.0
        root = np.linalg.cholesky(covariance[np.ix_(varied, varied)])
        nominal = self.nominal.theta

        def draw(rng: np.random.Generator) -> Array:
            theta = nominal.copy()
            theta[varied] += root @ rng.standard_normal(len(root))
            return theta

        return draw

    def reach(self, confidence: float) -> tuple[str, Array, Array, bool]:
        """The intervals, or the ellipsoid of a confidence."""
        names, nominal = list(self.nominal.names), self.nominal.theta
        if self.stated.intervals is not None:
            index = [names.index(name) for name in self.stated.intervals]
            low, high = np.array(list(self.stated.intervals.values())).T
            centre, columns = nominal.copy(), np.zeros((nominal.size, len(index)))
            centre[index] = 0.5 * (low + high)
            columns[index, np.arange(len(index))] = 0.5 * (high - low)
            return "the intervals", centre, columns[:, low < high], True
        covariance = self._covariance()
        varied = np.diag(covariance) > 0.0
        root = np.linalg.cholesky(covariance[np.ix_(varied, varied)])
        columns = np.zeros((nominal.size, len(root)))
        columns[varied] = confidence_factor(confidence, len(root)) * root
        return f"the ellipsoid of confidence {confidence:g}", nominal, columns, False

    def _even(self, intervals: Mapping[str, tuple[float, float]]) -> Draw:
        names, nominal = list(self.nominal.names), self.nominal.theta
        for name, (low, high) in intervals.items():
            key = f"{_KEY}.intervals.{name}"
            check_known(self.spec, names, name, key)
            value = nominal[names.index(name)]
            if not low <= value <= high:
                raise self.spec.complain(
                    "bad-interval",
                    f"{name} is {value:.6g} in the plant, outside of [{low:g}, {high:g}]",
                    hint="widen the interval, or move the plant into it",
                    key=key,
                )
        index = [names.index(name) for name in intervals]
        low, high = np.array(list(intervals.values())).T

        def draw(rng: np.random.Generator) -> Array:
            theta = nominal.copy()
            theta[index] = rng.uniform(low, high)
            return theta

        return draw

    def _covariance(self) -> Array:
        """(k, k), zero for parameters that are known."""
        stated, names = self.stated, self.nominal.names
        key = f"{_KEY}.{stated.stated(*SOURCES)[0]}"
        source = stated.covariance if stated.covariance is not None else stated.information
        if isinstance(source, str):
            if not source.endswith((".yaml", ".yml")):
                return self._inverted(self._of_record(source, key), key)
            found = load_estimate(self.spec, source, key)
            covariance, listed = np.array(found.covariance, dtype=float), tuple(found.parameters)
            full = embedded(self.spec, names, covariance, listed, key)
            self._check_same_plant(source, found.parameters, full, key)
            return full
        matrix = np.array(source, dtype=float)
        if stated.covariance is None:
            matrix = self._inverted(matrix, key)
        return embedded(self.spec, names, matrix, stated.parameters, key)

    def _of_record(self, name: str, key: str) -> Array:
        """(k, k): what the samples of an earlier excitation tell of the nominal plant."""
        record = read_excitation_record(self.spec, name, key)
        earlier = replace(self.experiment, samples=len(record), prior=None)
        return FiniteRecord(earlier, len(record), record_step(self.spec)).information(record)

    def _inverted(self, information: Array, key: str) -> Array:
        try:
            return inverse(information)
        except np.linalg.LinAlgError:
            raise self.spec.complain(
                "not-positive-definite",
                "the information matrix is singular: it says nothing about some of the parameters, so that "
                "no plants can be drawn",
                hint="name the parameters that it is about, or take an experiment that tells all apart",
                key=key,
            ) from None

    def _check_same_plant(self, name: str, values: Mapping[str, float], covariance: Array, key: str) -> None:
        """Raise `SpecError` (`wrong-estimate`) where the file is about another plant than the spec."""
        nominal = dict(zip(self.nominal.names, self.nominal.theta.tolist(), strict=True))
        deviation = dict(zip(self.nominal.names, np.sqrt(np.diag(covariance)).tolist(), strict=True))
        far = [p for p, x in values.items() if abs(x - nominal[p]) > _AWAY * deviation[p]]
        if far:
            told = ", ".join(f"{p} is {values[p]:.4g} there and {nominal[p]:.4g} here" for p in far)
            raise self.spec.complain(
                "wrong-estimate",
                f"{name} is an estimate of another plant: {told}, more than {_AWAY:g} standard deviations "
                "apart",
                hint="take plant and noise from the same file: include: " + name,
                key=key,
            )
