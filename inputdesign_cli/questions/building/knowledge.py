"""`uncertainty` -> what is known of the parameters before any data, and how plants are drawn."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from inputdesign_cli.arrays import Array
from inputdesign_cli.information import Experiment
from inputdesign_cli.plant import Model
from inputdesign_cli.questions.building.model_error import confidence_factor
from inputdesign_cli.questions.building.parameters import check_known, embedded
from inputdesign_cli.questions.building.prior import inverse
from inputdesign_cli.questions.building.system import build_experiment, information_in, read_excitation_record
from inputdesign_cli.questions.common.knowledge import Foreseen, Knowledge
from inputdesign_cli.specification import Spec, load_estimate
from inputdesign_cli.specification.models.uncertainty import SOURCES, Uncertainty

KEY = "uncertainty"
# Confidences of an ellipsoid: of the plants that are possible, and of the plants that a design is made for.
POSSIBLE, _DESIGNED = 0.999, 0.998
# An estimate that is farther from the plant of the spec, in standard deviations, is of another plant.
_AWAY = 3.0


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

    @cached_property
    def spread(self) -> Knowledge:
        """How far the parameters spread around the nominal ones (k,), in columns (k, m).

        They are even over the box of all intervals, or normal with the covariance columns columns^T. Raises
        `SpecError`: `unknown-parameter`, `wrong-shape`, `bad-interval`, `not-positive-definite`, or
        `wrong-estimate`. Or `DataError`: a record cannot be used.
        """
        if self.stated.intervals is not None:
            return self._box(self.stated.intervals)
        covariance = self._covariance()
        varied = np.flatnonzero(np.diag(covariance) > 0.0)
        columns = np.zeros((len(covariance), varied.size))
        columns[varied] = np.linalg.cholesky(covariance[np.ix_(varied, varied)])
        return Knowledge(self.nominal.theta, columns, box=False)

    def draw(self, rng: np.random.Generator) -> Array:
        """Draw parameters (k,)."""
        known, size = self.spread, self.spread.columns.shape[1]
        z = rng.uniform(-1.0, 1.0, size) if known.box else rng.standard_normal(size)
        return np.asarray(known.centre + known.columns @ z)

    def region(self, confidence: float) -> Knowledge:
        """Return the region of the draws: the ellipsoid of a confidence, or the box of all intervals."""
        known = self.spread
        if known.box:
            return replace(known, columns=known.columns[:, np.any(known.columns != 0.0, axis=0)])
        return replace(known, columns=confidence_factor(confidence, known.columns.shape[1]) * known.columns)

    def second_moments(self) -> Array:
        """Return the mean (k, k) of (theta - nominal)(theta - nominal)^T over the draws, or over the list."""
        nominal, listed = self.nominal.theta, self.stated.scenarios
        if isinstance(listed, tuple):
            away = np.array([self.moved(values, f"{KEY}.scenarios") for values in listed]) - nominal
            return np.asarray(away.T @ away / len(listed))
        columns, off = self.spread.columns, self.spread.centre - nominal
        # The variance of even draws is a third of the squared half width.
        return np.asarray(columns @ columns.T / (3.0 if self.spread.box else 1.0) + np.outer(off, off))

    def moved(self, values: Mapping[str, float], key: str) -> Array:
        """Return the nominal parameters (k,) with other values of some of them.

        Raises `SpecError`: `unknown-parameter`.
        """
        names, theta = list(self.nominal.names), self.nominal.theta.copy()
        for name, value in values.items():
            check_known(self.spec, names, name, key)
            theta[names.index(name)] = value
        return theta

    def _box(self, intervals: Mapping[str, tuple[float, float]]) -> Knowledge:
        names, nominal = list(self.nominal.names), self.nominal.theta
        centre, columns = nominal.copy(), np.zeros((nominal.size, len(intervals)))
        for column, (name, (low, high)) in enumerate(intervals.items()):
            key = f"{KEY}.intervals.{name}"
            check_known(self.spec, names, name, key)
            row = names.index(name)
            if not low <= nominal[row] <= high:
                message = f"{name} is {nominal[row]:.6g} in the plant, outside of [{low:g}, {high:g}]"
                hint = "widen the interval, or move the plant into it"
                raise self.spec.complain("bad-interval", message, hint=hint, key=key)
            centre[row], columns[row, column] = 0.5 * (low + high), 0.5 * (high - low)
        return Knowledge(centre, columns, box=True)

    def _covariance(self) -> Array:
        """The covariance (k, k) of the parameters, zero for known ones."""
        stated, names = self.stated, self.nominal.names
        key = f"{KEY}.{stated.stated(*SOURCES)[0]}"
        source = stated.covariance if stated.covariance is not None else stated.information
        if isinstance(source, str):
            if not source.endswith((".yaml", ".yml")):
                record = read_excitation_record(self.spec, source, key)
                earlier = replace(self.experiment, prior=None)
                return self._inverted(information_in(self.spec, earlier, record), key)
            found = load_estimate(self.spec, source, key)
            covariance, listed = np.array(found.covariance, dtype=float), tuple(found.parameters)
            full = embedded(self.spec, names, covariance, listed, key)
            self._check_same_plant(source, found.parameters, full, key)
            return full
        matrix = np.array(source, dtype=float)
        if stated.covariance is None:
            matrix = self._inverted(matrix, key)
        return embedded(self.spec, names, matrix, stated.parameters, key)

    def _inverted(self, information: Array, key: str) -> Array:
        try:
            return inverse(information)
        except np.linalg.LinAlgError:
            message = "the information matrix is singular: no plants can be drawn of some parameters"
            hint = "name the parameters that it is about, or take an experiment that informs about all"
            raise self.spec.complain("not-positive-definite", message, hint=hint, key=key) from None

    def _check_same_plant(self, name: str, values: Mapping[str, float], covariance: Array, key: str) -> None:
        """Raise `SpecError` (`wrong-estimate`) if the file is about another plant than the spec."""
        rows = zip(self.nominal.names, self.nominal.theta, np.sqrt(np.diag(covariance)), strict=True)
        both = ", ".join(
            f"{parameter} is {values[parameter]:.4g} there and {nominal:.4g} here"
            for parameter, nominal, deviation in rows
            if parameter in values and abs(values[parameter] - nominal) > _AWAY * deviation
        )
        if both:
            message = f"{name} is an estimate of another plant: {both}, more than {_AWAY:g} deviations apart"
            hint = f"take plant and noise from the same file: include: {name}"
            raise self.spec.complain("wrong-estimate", message, hint=hint, key=key)


def build_knowledge(spec: Spec, confidence: float = POSSIBLE) -> Knowledge | None:
    """Return the region of the plants that are possible; None if it is not stated, or plants are listed.

    Raises `SpecError` or `DataError`: see `UncertainPlant.spread`.
    """
    stated = spec.uncertainty
    if stated is None or isinstance(stated.scenarios, tuple):
        return None
    return UncertainPlant(spec, stated, build_experiment(spec)).region(confidence)


def build_foreseen(spec: Spec, nominal: Model) -> Foreseen | None:
    """Return the plants that the design was made for; None without a stated region."""
    region = build_knowledge(spec, _DESIGNED)
    return None if region is None else Foreseen(region, np.flatnonzero(nominal.in_plant))


def build_nominal_covariance(spec: Spec, nominal: Model) -> Array:
    """Return the covariance (k, k) of the parameters of the spec's own plant; zero if it states none.

    It follows from `uncertainty`, or else from the `estimate` block that identify wrote.
    """
    covariance = np.zeros((nominal.theta.size, nominal.theta.size))
    if spec.uncertainty is not None:
        moments = UncertainPlant(spec, spec.uncertainty, build_experiment(spec)).second_moments()
        covariance[: len(moments), : len(moments)] = moments
    elif spec.estimate is not None:
        names, values = list(nominal.names), spec.estimate.parameters
        rows = [row for row, name in enumerate(values) if name in names]
        own = [names.index(name) for name in values if name in names]
        stated = np.array(spec.estimate.covariance, dtype=float)[np.ix_(rows, rows)]
        away = np.array(list(values.values()))[rows] - nominal.theta[own]
        if np.all(np.abs(away) <= _AWAY * np.sqrt(np.diag(stated))):
            covariance[np.ix_(own, own)] = stated
    return covariance
