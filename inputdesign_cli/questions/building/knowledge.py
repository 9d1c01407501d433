"""`uncertainty` -> what is known of the parameters before any data, and how plants are drawn."""

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
from inputdesign_cli.questions.building.system import build_experiment, read_excitation_record, record_step
from inputdesign_cli.questions.common.knowledge import Foreseen, Knowledge
from inputdesign_cli.specification import Spec, load_estimate
from inputdesign_cli.specification.models.uncertainty import SOURCES, Uncertainty

KEY = "uncertainty"
# Confidences of an ellipsoid: of the plants that are possible, and of the plants that a design is made for.
_POSSIBLE, _DESIGNED = 0.999, 0.998
# An estimate that is farther from the plant of the spec, in standard deviations, is of another plant.
_AWAY = 3.0

Draw = Callable[[np.random.Generator], Array]


@dataclass(frozen=True)
class UncertainPlant:
    """The parameters of an uncertain plant.

    Attributes:
        spec: exists here only while a question is built.
        stated: its section `uncertainty`.
        experiment: on the nominal plant.
    """

    spec: Spec
    stated: Uncertainty
    experiment: Experiment

    @property
    def nominal(self) -> Model:
        """The plant of the spec."""
        return self.experiment.model

    def drawing(self) -> Draw:
        """Return a function that draws parameters (k,).

        Raises:
            SpecError: `unknown-parameter`, `wrong-shape`, `bad-interval`, `not-positive-definite`, or
                `wrong-estimate`.
            DataError: a record cannot be used.
        """
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

    def region(self, confidence: float) -> tuple[str, Array, Array, bool]:
        """Return the region of the draws: its name, centre (k,), columns (k, m), and whether it is a box.

        It is the ellipsoid of a confidence, or the box of all intervals.

        Raises:
            SpecError, DataError: see `drawing`.
        """
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

    def second_moments(self) -> Array:
        """Return the mean (k, k) of (theta - nominal)(theta - nominal)^T over the draws, or over the list.

        Raises:
            SpecError, DataError: see `drawing`.
        """
        nominal, listed = self.nominal.theta, self.stated.scenarios
        if isinstance(listed, tuple):
            away = np.array([self.moved(values, f"{KEY}.scenarios") for values in listed]) - nominal
            return np.asarray(away.T @ away / len(listed))
        if self.stated.intervals is None:
            return self._covariance()
        _, centre, columns, _ = self.region(1.0)
        # The variance of even draws is a third of the squared half width.
        return np.asarray(columns @ columns.T / 3.0 + np.outer(centre - nominal, centre - nominal))

    def moved(self, values: Mapping[str, float], key: str) -> Array:
        """Return the nominal parameters (k,) with other values of some of them.

        Raises:
            SpecError: `unknown-parameter`.
        """
        names, theta = list(self.nominal.names), self.nominal.theta.copy()
        for name, value in values.items():
            check_known(self.spec, names, name, key)
            theta[names.index(name)] = value
        return theta

    def _even(self, intervals: Mapping[str, tuple[float, float]]) -> Draw:
        names, nominal = list(self.nominal.names), self.nominal.theta
        for name, (low, high) in intervals.items():
            key = f"{KEY}.intervals.{name}"
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
        """The covariance (k, k) of the parameters, zero for known ones."""
        stated, names = self.stated, self.nominal.names
        key = f"{KEY}.{stated.stated(*SOURCES)[0]}"
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
        """The information (k, k) about the nominal plant in the samples of an earlier excitation."""
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
                hint="name the parameters that it is about, or take an experiment that informs about all",
                key=key,
            ) from None

    def _check_same_plant(self, name: str, values: Mapping[str, float], covariance: Array, key: str) -> None:
        """Raise `SpecError` (`wrong-estimate`) if the file is about another plant than the spec."""
        nominal = dict(zip(self.nominal.names, self.nominal.theta.tolist(), strict=True))
        deviation = dict(zip(self.nominal.names, np.sqrt(np.diag(covariance)).tolist(), strict=True))
        far = [p for p, x in values.items() if abs(x - nominal[p]) > _AWAY * deviation[p]]
        if far:
            both = ", ".join(f"{p} is {values[p]:.4g} there and {nominal[p]:.4g} here" for p in far)
            raise self.spec.complain(
                "wrong-estimate",
                f"{name} is an estimate of another plant: {both}, more than {_AWAY:g} standard deviations "
                "apart",
                hint="take plant and noise from the same file: include: " + name,
                key=key,
            )


def build_knowledge(spec: Spec) -> Knowledge | None:
    """Return the region of the plants that are possible; None if it is not stated, or plants are listed.

    Raises:
        SpecError, DataError: see `UncertainPlant.drawing`.
    """
    return _region(spec, _POSSIBLE)


def build_foreseen(spec: Spec, nominal: Model) -> Foreseen | None:
    """Return the plants that the design was made for; None without a stated region."""
    region = _region(spec, _DESIGNED)
    return None if region is None else Foreseen(region, np.flatnonzero(nominal.in_plant))


def _region(spec: Spec, confidence: float) -> Knowledge | None:
    stated = spec.uncertainty
    if stated is None or isinstance(stated.scenarios, tuple):
        return None
    uncertain = UncertainPlant(spec, stated, build_experiment(spec))
    uncertain.drawing()  # raises what does not fit
    _, centre, columns, box = uncertain.region(confidence)
    return Knowledge(centre, columns, box)


def build_nominal_covariance(spec: Spec, nominal: Model) -> Array:
    """Return the covariance (k, k) of the parameters of the spec's own plant; zero if it states none.

    It follows from `uncertainty`, or else from the `estimate` block that identify wrote.
    """
    covariance = np.zeros((nominal.theta.size, nominal.theta.size))
    if spec.uncertainty is not None:
        moments = UncertainPlant(spec, spec.uncertainty, build_experiment(spec)).second_moments()
        covariance[: len(moments), : len(moments)] = moments
    elif spec.estimate is not None:
        names = list(nominal.names)
        rows = [row for row, name in enumerate(spec.estimate.parameters) if name in names]
        own = [names.index(list(spec.estimate.parameters)[row]) for row in rows]
        stated = np.array(spec.estimate.covariance, dtype=float)[np.ix_(rows, rows)]
        away = np.array(list(spec.estimate.parameters.values()))[rows] - nominal.theta[own]
        if np.all(np.abs(away) <= _AWAY * np.sqrt(np.diag(stated))):
            covariance[np.ix_(own, own)] = stated
    return covariance
